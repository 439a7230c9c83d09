#include "app/shot/shot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <map>

#include "app/shot/layers.h"
#include "app/shot/reader.h"
#include "app/shot/toml.h"
#include "base/atomic_file.h"
#include "base/checksum.h"
#include "base/error.h"
#include "base/text.h"
#include "render/mesh_file.h"
#include "sim/empty_body.h"

namespace app {
namespace {

constexpr std::uintmax_t kLargestShot = 1 << 20;  // [bytes]
constexpr std::array<std::string_view, 2> kUpNames{"y", "z"};

/// A shot and what was read to get it.
struct Reading {
  Shot shot;
  Node written, given, complete;
};

Reading read_merged(const Node& root, const std::string& file) {
  Reading out;
  Reader reader(root, file);
  out.shot.params(reader);
  reader.finish();
  reader.throw_if_wrong();
  out.given = reader.given();
  out.complete = reader.complete();
  return out;
}

// A misspelt key in a rung that is not chosen would wait for the day when it is.
void check_other_rungs(const Layers& layers) {
  for (const std::string_view name : kRungs) {
    const std::string quality(name);
    if (quality == layers.quality || !layers.qualities.find(quality)) continue;
    const Node root = merged_for(layers, quality);
    Shot scratch;
    Reader reader(root, layers.file);
    scratch.params(reader);
    reader.finish();
    reader.throw_if_wrong_under(under(quality));
  }
}

Reading read_text(std::string_view text, const std::string& file, const Overrides& overrides) {
  const Layers layers = make_layers(parse_toml(text, file), file, overrides.quality, overrides.sets);
  Node root = merged(layers);
  Reading reading = read_merged(root, file);
  reading.shot.has_pictures = root.find("render") != nullptr;
  if (reading.shot.has_pictures) reading.given.at("render");   // also where none of its keys is given
  check_other_rungs(layers);
  reading.written = std::move(root);
  return reading;
}

std::string look_of(const sim::Body& body) { return body.look.empty() ? body.material : body.look; }

std::string liquid_look(const sim::Scene& scene) {
  if (!scene.bodies.empty()) return look_of(scene.bodies.front());
  for (const sim::Source& source : scene.sources)
    if (!source.look.empty()) return source.look;
  return look_of(sim::Body());
}

void require_look(base::Params& p, const std::map<std::string, render::Look>& looks, const std::string& look, const std::string& key) {
  std::string names;
  for (const auto& [name, unused] : looks) names += (names.empty() ? "" : ", ") + name;
  p.require(looks.contains(look), key, "there is no such look; there are " + names);
}

constexpr std::string_view kFolderMark = "# The files it names lie in ", kFolderEnd = "\n";

/// What a run's copy of a shot begins with where files lie elsewhere; empty for other texts.
std::string_view folder_line(std::string_view text) {
  return text.starts_with(kFolderMark) ? text.substr(0, text.find(kFolderEnd) + kFolderEnd.size()) : std::string_view();
}

/// A path as a TOML comment may hold it: bytes that are not printable ASCII, and %, as %XX.
std::string escaped(const std::string& path) {
  std::string text;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte < 0x7f && c != '%') text += c;
    else text += fmt::format("%{:02x}", byte);
  }
  return text;
}
std::string plain_bytes(std::string_view text) {
  std::string path;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    const char* const end = text.data() + std::min(text.size(), i + 3);
    if (text[i] != '%' || std::from_chars(text.data() + i + 1, end, byte, 16).ptr != text.data() + i + 3) path += text[i];
    else path += static_cast<char>(byte), i += 2;
  }
  return path;
}

/// Where the files lie that a shot names: beside it, or beside what a run's copy was made from.
std::filesystem::path folder_of(const std::filesystem::path& file, std::string_view text) {
  const std::string_view line = folder_line(text);
  std::error_code none;
  if (line.empty() || !std::filesystem::is_directory(file.parent_path() / "ledger", none)) return file.parent_path();
  return file.parent_path() / plain_bytes(line.substr(kFolderMark.size(), line.size() - kFolderMark.size() - kFolderEnd.size()));
}

/// What nobody named is called by its number.
template <class Entry>
void name_all(std::vector<Entry>& entries) {
  for (std::size_t i = 0; i < entries.size(); ++i)
    if (entries[i].name.empty()) entries[i].name = std::to_string(i + 1);
}

Shot make_shot(Reading reading, const std::filesystem::path& file, const std::filesystem::path& folder) {
  Shot shot = std::move(reading.shot);
  shot.name = file.stem().string();
  name_all(shot.scene.bodies), name_all(shot.scene.sources), name_all(shot.scene.colliders), name_all(shot.render.sets);
  shot.file = file;
  shot.folder = folder;
  shot.resolved = shot_text(reading.given);
  shot.values = flat(reading.complete);
  shot.written = std::move(reading.written);
  shot.render.folder = folder;
  shot.render.colliders = shot.scene.colliders;
  shot.render.liquid_look = liquid_look(shot.scene);
  if (shot.scene.options.is_solid())
    for (const sim::Body& body : shot.scene.bodies) {
      shot.render.body_looks.push_back(look_of(body)), shot.render.materials.push_back(body.name + ", " + body.material);
      shot.render.body_flows.push_back(body.solid.model == sim::Elasticity::tait);
    }
  shot.render.shows_tension = shot.scene.options.is_solid();
  shot.render.domain = shot.scene.options.domain;
  shot.render.fps = shot.fps;
  for (render::SetPiece& piece : shot.render.sets) piece.file = folder / piece.file;
  shot.render.dimension = shot.scene.options.dimension;
  return shot;
}

// Every key of something declared, with its value.
template <class Declared>
Node complete_node(Declared declared) {
  const Node nothing;
  Reader reader(nothing, "");
  declared.params(reader);
  reader.finish();
  return reader.complete();
}

// Looks and lights that come with the program are read like keys: another version may have others.
void add_built_in(const render::Setting& setting, Node& keys) {
  std::vector<std::string> used = {setting.liquid_look, "ground"};
  used.insert(used.end(), setting.body_looks.begin(), setting.body_looks.end());
  for (const sim::Collider& collider : setting.colliders) used.push_back(collider.look);
  for (const render::SetPiece& piece : setting.sets) used.push_back(piece.look);
  for (const std::string& name : used)
    if (const auto look = setting.looks.find(name); look != setting.looks.end()) keys.at("look").at(name) = complete_node(look->second);
  if (!setting.lights.empty()) return;
  Node& lights = keys.at("light");
  lights.kind = Node::Kind::array;
  for (const render::Light& light : render::default_lights(setting.domain)) lights.items.push_back(complete_node(light));
}

/// Reads the mesh of a body or collider; refuses one that is not closed.
void read_solid(sim::Shape::Mesh& mesh, const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / mesh.file;
  const render::Triangles triangles = render::read_mesh(path);
  mesh.solid = std::make_shared<const sim::ClosedMesh>(triangles.position, triangles.triangles, mesh.scale, mesh.translate);
  if (!mesh.solid->objection().empty()) base::throw_input(path.string(), mesh.solid->objection());
}

/// What is wrong with a file, said where the shot names it.
template <class Read>
void at_its_key(const Shot& shot, const std::string& key, const Read& read) {
  try {
    read();
  } catch (const base::Error& e) {
    throw error_about(shot, {.code = e.complaint().code, .key = key, .message = e.what()});
  }
}

void require_file(const std::filesystem::path& file) {
  std::error_code failure;
  if (!std::filesystem::exists(file, failure)) base::throw_input(file.string(), failure ? failure.message() : "No such file or directory");
}

/// Files that bodies and colliders are made from.
std::vector<std::filesystem::path> solid_files(const Shot& shot) {
  std::vector<std::filesystem::path> files;
  const auto add = [&](const auto& solids) {
    for (const auto& solid : solids)
      if (solid.shape.mesh) files.push_back(shot.folder / solid.shape.mesh->file);
  };
  add(shot.scene.bodies), add(shot.scene.colliders);
  return files;
}

// What the files hold that a stage is made from: a file that changed makes something else.
void add_contents(const std::vector<std::filesystem::path>& files, Node& keys) {
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto sum = base::sum_of(files[i]);
    if (!sum) base::throw_input(files[i].string(), "cannot be read");
    keys.at("files").at("file" + std::to_string(i + 1)) = make_node(std::to_string(sum->bytes) + " " + std::to_string(sum->checksum));
  }
}

// Copies the keys of `list` from every entry, or all but those.
Node entries(const Node& root, std::string_view list, std::string_view key, bool only) {
  Node out;
  out.kind = Node::Kind::array;
  const Node* from = root.find(list);
  if (!from) return out;
  for (Node entry : from->items) {
    for (const std::string& name : std::vector<std::string>(entry.keys))
      if ((name == key) != only) entry.remove(name);
    out.items.push_back(std::move(entry));
  }
  return out;
}

// Read again from `resolved`, because only the reader knows what a preset's table was before its defaults were filled in.
Node stage_keys(const Shot& shot, const std::string& stage) {
  Node all = read_text(shot.resolved, shot.file.string(), {}).complete;
  Node keys;
  const auto take = [&](std::string_view section) {
    if (const Node* found = all.find(section)) keys.at(section) = *found;
  };
  if (stage == "simulate") {
    keys.at("shot").at("fps") = make_node(shot.fps);
    take("sim");
    keys.at("sim").remove("audit");   // changes no result
    keys.at("body") = entries(all, "body", "look", false);
    if (!shot.scene.sources.empty()) keys.at("source") = entries(all, "source", "look", false);
    keys.at("collider") = entries(all, "collider", "look", false);
    take("effect");
  } else if (stage == "surface") {
    take("surface");
    if (shot.render.parts_bodies()) keys.at("body").at("look") = make_node(std::string("several"));   // which they are matters to the pictures alone
  } else {
    assert((stage == "render" || stage == "preview") && "there are four stages");
    for (const auto section : {"render", "camera", "light", "look", "set"}) take(section);
    if (stage == "preview" || shot.scene.options.dimension == 2) take("preview");
    if (shot.scene.options.dimension == 3) add_built_in(shot.render, keys);
    keys.at("body") = entries(all, "body", "look", true);
    if (!shot.scene.sources.empty()) keys.at("source") = entries(all, "source", "look", true);
    keys.at("collider") = entries(all, "collider", "look", true);
  }
  return keys;
}

}  // namespace

void Shot::params(base::Params& p) {
  std::string up;
  p.table("shot", "the film", [&](base::Params& q) {
    q("frames", frames, "1", "frames to make; frame 1 is t = 0", base::within(1, 1e6));
    q("fps", fps, "1/s", "frames a second", {.low = 0, .high = 1e6, .low_open = true});   // more is no movie
    q("up", up, "the direction that is up: z, or y in two dimensions", kUpNames);
    q("checkpoint_every", checkpoint_every, "1", "frames between two checkpoints of the simulation; one more at its end", base::within(1, 1e6));
    q("checkpoint_keep", checkpoint_keep, "1", "checkpoints that are kept, the latest ones", base::within(1, 1e6));
    q("quality", quality, "rung of the ladder of accuracy: sets sim.transfer, kernel, modes, splitting and carry, and render.spp", kRungs);
  });
  scene.params(p);
  const bool flat = scene.options.dimension == 2;
  p.require(up.empty() || up == (flat ? "y" : "z"), "shot.up", flat ? "must be \"y\" in two dimensions" : "must be \"z\"");
  if (flat) p.without("surface", "has no effect in two dimensions: points are drawn as they are");
  else p.table("surface", "from particles to a surface", [&](base::Params& q) { surface.params(q); });
  const auto of_cell = [&](double cells) {
    return "is " + base::to_text(std::round(1e4 * cells) / 1e4) + " of sim.cell = " + base::to_text(scene.options.cell) + " m; must be ";
  };
  if (!flat && surface.voxel) {
    // Coarser ones lose drops between their corners; finer ones show the particles and take the third power of memory.
    constexpr double kFinest = 1.0 / 32, kCoarsest = 2;
    const double cells = *surface.voxel / scene.options.cell;
    p.require(cells >= kFinest * (1 - 1e-9) && cells <= kCoarsest * (1 + 1e-9), "surface.voxel", of_cell(cells) + "between 1/32 and 2 of it");
  }
  constexpr double kLeastVoxel = 1.45e-5;   // [m] of smaller ones OpenVDB takes the third power for none
  const double spacing = scene.options.cell / std::pow(double(scene.options.particles_per_cell), flat ? 0.5 : 1.0 / 3);
  p.require(1.28 * spacing >= kLeastVoxel, "sim.cell",
            "puts particles " + fmt::format("{:.3g}", spacing) + " m apart: OpenVDB's files hold none that are nearer than 1.14e-05 m");
  if (!flat)
    p.require(surface.voxel.value_or(scene.options.cell / 2) >= kLeastVoxel, surface.voxel ? "surface.voxel" : "sim.cell",
              "has a surface of smaller voxels than OpenVDB holds: 1.45e-05 m");
  if (!flat && surface.radius) {
    constexpr double kThickest = 4;   // beyond, drops a basin apart are one, and the level set fills the domain
    const double cells = *surface.radius / scene.options.cell;
    p.require(cells <= kThickest * (1 + 1e-9), "surface.radius", of_cell(cells) + "4 of it at the most");
  }
  render.params(p);

  const sim::Write& write = scene.options.write;
  const std::string& color = render.preview.color;
  for (const auto& [carried, is_written] :
       {std::pair("pressure", write.pressure), std::pair("strain", write.strain), std::pair("mode_energy", write.mode_energy)})
    p.require(color != carried || is_written, "preview.color",
              std::string("needs sim.write.") + carried + " = true: particles do not carry it otherwise");
  p.require(color != "material" || scene.options.is_solid(), "preview.color", "a liquid is of one material");
  const bool pours = std::any_of(scene.sources.begin(), scene.sources.end(), [](const sim::Source& s) { return s.start == 0; });
  p.require(!scene.bodies.empty() || pours, scene.sources.empty() ? "body" : "source.1.start",
            scene.sources.empty() ? "a shot needs at least one [[body]], or a [[source]]"
                                  : "needs a [[body]], or a source that begins at the first frame: there is nothing before");
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const sim::Body& body = scene.bodies[i];
    const std::string key = "body." + std::to_string(i + 1);
    p.require(body.shape.any(), key + ".shape", "a body needs a shape");
    if (flat) continue;
    require_look(p, render.looks, look_of(body), key + (body.look.empty() ? ".material" : ".look"));
    const bool same = look_of(body) == look_of(scene.bodies.front());
    p.require(same || scene.options.is_solid(), key + ".look", "one liquid has one look: all bodies must have the same");
  }
  for (std::size_t i = 0; i < scene.sources.size(); ++i) {
    const sim::Source& source = scene.sources[i];
    const std::string key = "source." + std::to_string(i + 1);
    p.require(source.shape.any(), key + ".shape", "a source needs a shape");
    if (flat || source.look.empty()) continue;
    require_look(p, render.looks, source.look, key + ".look");
    p.require(source.look == liquid_look(scene), key + ".look", "one liquid has one look: bodies and sources must have the same");
  }
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const sim::Collider& collider = scene.colliders[i];
    const std::string key = "collider." + std::to_string(i + 1);
    p.require(collider.shape.any(), key + ".shape", "a collider needs a shape");
    if (!flat) require_look(p, render.looks, collider.look, key + ".look");
  }
  for (std::size_t i = 0; i < render.sets.size(); ++i) require_look(p, render.looks, render.sets[i].look, "set." + std::to_string(i + 1) + ".look");
}

Shot read_shot_alone(const std::filesystem::path& file, const Overrides& overrides) {
  const std::string text = base::read_file(file, kLargestShot);
  return make_shot(read_text(text, file.string(), overrides), file, folder_of(file, text));
}

base::Error error_about(const Shot& shot, base::Complaint complaint) {
  const Node* const value = find_value(shot.written, complaint.key);
  return base::Error(complaint_at(value ? place_of(*value) : Origin{.file = shot.file.string(), .under = {}}, std::move(complaint)));
}

Shot read_shot(const std::filesystem::path& file, const Overrides& overrides) {
  Shot shot = read_shot_alone(file, overrides);
  for (sim::Body& body : shot.scene.bodies)
    if (auto& mesh = body.shape.mesh) at_its_key(shot, "body." + body.name + ".shape.mesh.file", [&] { read_solid(*mesh, shot.folder); });
  const auto key_of_collider = [&](std::size_t i, const std::string& key) { return "collider." + shot.scene.colliders[i].name + "." + key; };
  const auto of_meshes = [&](const auto& body) {
    for (std::size_t i = 0; i < shot.scene.colliders.size(); ++i)
      if (sim::Shape& shape = shot.scene.colliders[i].shape; shape.mesh) at_its_key(shot, key_of_collider(i, "shape.mesh.file"), [&] { body(i, *shape.mesh); });
  };
  of_meshes([&](std::size_t, sim::Shape::Mesh& mesh) { read_solid(mesh, shot.folder); });
  sim::measure_meshes(shot.scene);
  of_meshes([&](std::size_t i, sim::Shape::Mesh& mesh) {
    if (!mesh.distances->objection().empty()) base::throw_input((shot.folder / mesh.file).string(), mesh.distances->objection());
    shot.render.colliders[i].shape.mesh = mesh;
  });
  if (const auto unmet = sim::find_unmet_collider(shot.scene))
    throw error_about(shot, {.key = key_of_collider(unmet->number, unmet->key), .message = unmet->need});
  for (const render::SetPiece& piece : shot.render.sets)
    at_its_key(shot, "set." + piece.name + ".mesh.file", [&] { render::check_set_piece(piece); });
  for (std::size_t i = 0; i < shot.render.lights.size(); ++i)
    if (const render::Light& light = shot.render.lights[i]; light.kind == "environment")
      at_its_key(shot, "light." + std::to_string(i + 1) + ".file", [&] {
        require_file(shot.folder / light.file);
        render::check_environment(shot.folder / light.file);
      });
  if (shot.has_pictures && shot.render.dimension == 3) at_its_key(shot, "look", [&] { render::check_media(shot.render); });
  if (const std::optional<sim::EmptyBody> empty = sim::find_empty_body(shot.scene)) throw error_about(shot, empty->complaint);
  return shot;
}

std::vector<std::filesystem::path> named_files(const Shot& shot) {
  std::vector<std::filesystem::path> files = solid_files(shot), more = shot.render.files();
  files.insert(files.end(), more.begin(), more.end());
  return files;
}

std::string copy_of(const Shot& shot, const std::filesystem::path& out) {
  std::error_code none;
  const std::filesystem::path own = shot.folder / ".",   // the folder of a bare name is empty
                              there = std::filesystem::weakly_canonical(std::filesystem::absolute(out, none), none),
                              from = std::filesystem::weakly_canonical(std::filesystem::absolute(own, none), none);
  const std::string way = from.lexically_relative(there).generic_string();
  if (way == "." || named_files(shot).empty()) return shot.resolved;
  return std::string(kFolderMark) + escaped(way) + std::string(kFolderEnd) + shot.resolved;
}

namespace {

/// "body.1.look" as "body.column.look", for entries that have a name.
std::string with_name(const std::string& key, const Shot& shot) {
  const auto named = [&](const std::string& list, const auto& entries) {
    for (std::size_t i = 0; i < entries.size(); ++i)
      if (const std::string own = list + std::to_string(i + 1) + "."; key.starts_with(own))
        return list + entries[i].name + "." + key.substr(own.size());
    return key;
  };
  if (key.starts_with("body.")) return named("body.", shot.scene.bodies);
  if (key.starts_with("collider.")) return named("collider.", shot.scene.colliders);
  if (key.starts_with("source.")) return named("source.", shot.scene.sources);
  if (key.starts_with("set.")) return named("set.", shot.render.sets);
  return key;
}

}  // namespace

std::vector<ChangedKey> changed_keys(const std::string& resolved_before, const Shot& now, const std::string& stage) {
  const Shot then = make_shot(read_text(resolved_before, "shot.toml", {}), "shot.toml", "");
  auto before = flat(stage_keys(then, stage)), after = flat(stage_keys(now, stage));
  for (auto* keys : {&before, &after}) std::sort(keys->begin(), keys->end());   // the order in which they are told
  const std::map<std::string, std::string> old(before.begin(), before.end()), fresh(after.begin(), after.end());
  std::vector<ChangedKey> changed, of_itself;   // keys that nobody wrote come and go with one that somebody did
  for (const auto& [key, value] : after)
    if (const auto found = old.find(key); found == old.end()) (find_value(now.written, key) ? changed : of_itself).push_back({key, "", value});
    else if (found->second != value) changed.push_back({key, found->second, value});
  for (const auto& [key, value] : before)
    if (!fresh.contains(key)) (find_value(then.written, key) ? changed : of_itself).push_back({key, value, ""});
  std::vector<ChangedKey>& told = changed.empty() ? of_itself : changed;
  for (ChangedKey& key : told) key.key = with_name(key.key, now);
  if (!told.empty() && then.quality != now.quality) told.insert(told.begin(), {"shot.quality", '"' + then.quality + '"', '"' + now.quality + '"'});   // what set them
  return told;
}

bool is_resolved(const std::string& text) {
  try {
    return make_shot(read_text(text, "shot.toml", {}), "shot.toml", "").resolved == text.substr(folder_line(text).size());
  } catch (const base::Error&) {
    return false;
  }
}

std::string stage_text(const Shot& shot, const std::string& stage) {
  Node keys = stage_keys(shot, stage);
  if (stage == "simulate") add_contents(solid_files(shot), keys);
  if (stage == "render" || stage == "preview") add_contents(shot.render.files(), keys);
  return shot_text(keys);
}

}  // namespace app
