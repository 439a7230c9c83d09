#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/commands/movie_info.h"
#include "app/stages/document.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"
#include "render/mesh_file.h"
#include "sim/checkpoint.h"
#include "sim/closed_mesh.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json metadata_json(const std::vector<std::array<std::string, 2>>& metadata) {
  Json out = Json::object();
  for (const auto& [name, value] : metadata) out[name] = value;
  return out;
}

Json grid_json(const surface::GridInfo& grid) {
  Json out = {{"name", grid.name},
              {"type", grid.type},
              {"class", grid.grid_class}};
  if (grid.voxel_size.allFinite()) out["voxel_size"] = {grid.voxel_size.x(), grid.voxel_size.y(), grid.voxel_size.z()};
  out["active"] = grid.active;
  if (grid.min) out["min"] = *grid.min;
  if (grid.max) out["max"] = *grid.max;
  if (grid.not_finite > 0) out["not_finite"] = grid.not_finite;
  if (grid.bbox) out["bbox"] = *grid.bbox;
  out["half"] = grid.half;
  out["compression"] = grid.compression;
  out["metadata"] = metadata_json(grid.metadata);
  return out;
}

Json volume_info(const fs::path& file) {
  Json out = {{"schema", 1}, {"file", file.string()}, {"kind", "volume"}, {"grids", Json::array()}};
  for (const surface::GridInfo& grid : surface::info(file)) {
    out["grids"].push_back(grid_json(grid));
    if (!grid.points) continue;
    out["kind"] = "points";
    out["points"] = {{"count", *grid.points}, {"attributes", grid.attributes}};
  }
  return out;
}

Json image_info(const fs::path& file) {
  const render::ImageInfo image = render::info(file);
  Json out = {{"width", image.width}, {"height", image.height}, {"channels", image.channels}, {"ranges", Json::object()}};
  for (std::size_t c = 0; c < image.channels.size(); ++c)
    if (image.ranges[c]) out["ranges"][image.channels[c]] = *image.ranges[c];
  if (image.not_finite > 0) out["not_finite"] = image.not_finite;
  out["metadata"] = metadata_json(image.metadata);
  return {{"schema", 1}, {"file", file.string()}, {"kind", "image"}, {"image", out}};
}

Json column_json(const sim::Column& column) {
  constexpr const char* kTypes[] = {"int32", "int64", "float32", "float64"};
  return {{"name", column.name}, {"type", kTypes[static_cast<int>(column.type)]}, {"rows", column.rows}, {"width", column.width}};
}

Json checkpoint_info(const fs::path& file) {
  const sim::Checkpoint checkpoint = sim::read_checkpoint(file);
  Json columns = Json::array();
  for (const sim::Column& column : checkpoint.state.columns) columns.push_back(column_json(column));
  return {{"schema", 1},
          {"file", file.string()},
          {"kind", "checkpoint"},
          {"checkpoint", {{"frame", checkpoint.state.frame}, {"hash", checkpoint.hash}, {"version", checkpoint.version}, {"columns", columns}}}};
}

Json shot_info(const fs::path& file) {
  const Shot shot = read_shot_alone(file, {});
  return {{"schema", 1},
          {"file", file.string()},
          {"kind", "shot"},
          {"shot",
           {{"name", shot.name}, {"frames", shot.frames}, {"fps", shot.fps}, {"quality", shot.quality}, {"dimension", shot.scene.options.dimension},
            {"cell", shot.scene.options.cell}, {"bodies", shot.scene.bodies.size()}, {"sources", shot.scene.sources.size()},
            {"colliders", shot.scene.colliders.size()},
            {"width", shot.render.options.width}, {"height", shot.render.options.height}}}};
}

/// What print_run stands on: a JSON document can be anybody's.
bool is_run(const Json& content) {
  const auto is_frame = [](const Json& frame) {
    if (!frame.is_object() || !frame.contains("seconds") || !frame["seconds"].is_object()) return false;
    return std::all_of(frame["seconds"].begin(), frame["seconds"].end(), [](const Json& spent) { return spent.is_number(); });
  };
  return content.is_object() && content.contains("frames") && content["frames"].is_array() &&
         std::all_of(content["frames"].begin(), content["frames"].end(), is_frame);
}

// run.json or a record of the ledger: its own content under "run" or "record".
Json document_info(const fs::path& file) {
  const Json content = read_document(file, kLargestDocument);
  const bool run = is_run(content);
  const bool record =
      content.is_object() && (content.contains("stage") || (content.contains("file") && content.contains("from")));   // of a frame, of a movie
  if (!run && !record) base::throw_input(file.string(), "neither a run.json nor a record of a ledger");
  return {{"schema", 1}, {"file", file.string()}, {"kind", run ? "run" : "record"}, {run ? "run" : "record", content}};
}

/// Of a page of ours: what it is called.
Json page_info(const fs::path& file) {
  const std::string text = base::read_file(file, kLargestDocument), open = "<title>", close = "</title>";
  const std::size_t begin = text.find(open), end = text.find(close);
  if (text.find("<meta name=\"generator\" content=\"polypic\">") == std::string::npos || begin == std::string::npos || end == std::string::npos)
    base::throw_input(file.string(), "not a report of this program");
  const auto count = [&](const std::string& what) {
    std::int64_t found = 0;
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; ++at) ++found;
    return found;
  };
  const Json page = {{"title", text.substr(begin + open.size(), end - begin - open.size())}, {"bytes", text.size()}, {"plots", count("<svg")},
                     {"pictures", count("<img")}};
  return {{"schema", 1}, {"file", file.string()}, {"kind", "report"}, {"report", page}};
}

/// Bounds in the file's units, before `scale`, `angle` and `translate` of a shape; what is not closed can be a set, but no body or collider.
Json mesh_info(const fs::path& file) {
  const render::Triangles mesh = render::read_mesh(file);
  base::Box bounds{mesh.position.front().cast<double>(), mesh.position.front().cast<double>()};
  for (const base::Vec3f& at : mesh.position) bounds.lower = bounds.lower.cwiseMin(at.cast<double>()), bounds.upper = bounds.upper.cwiseMax(at.cast<double>());
  const auto place = [](const base::Vec3& at) { return Json{at.x(), at.y(), at.z()}; };
  const std::string objection = sim::ClosedMesh(mesh.position, mesh.triangles, 1, base::Vec3::Zero()).objection();
  Json out = {{"triangles", mesh.triangles.size()}, {"bounds", {place(bounds.lower), place(bounds.upper)}}, {"closed", objection.empty()}};
  if (!objection.empty()) out["why_not_closed"] = objection;
  return {{"schema", 1}, {"file", file.string()}, {"kind", "mesh"}, {"mesh", out}};
}

/// The extension; a checkpoint that was put aside, state.0010.h5.bad2, is still one.
std::string kind_of(const fs::path& file) { return base::extension_of(file.extension().string().starts_with(".bad") ? file.stem() : file); }

std::string plain(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

void print_grids(const Json& grids) {
  for (const Json& grid : grids) {
    std::printf("%s  %s, %s, %s active", plain(grid["name"]).c_str(), plain(grid["type"]).c_str(), plain(grid["class"]).c_str(),
                plain(grid["active"]).c_str());
    if (grid.contains("voxel_size")) std::printf(", voxel %s m", base::to_text(grid["voxel_size"][0].get<double>()).c_str());
    std::printf("%s\n", grid["half"].get<bool>() ? ", half" : "");
    if (grid.contains("min") && grid.contains("max"))
      std::printf("  values %s ... %s\n", base::to_text(grid["min"].get<double>()).c_str(), base::to_text(grid["max"].get<double>()).c_str());
    if (grid.contains("not_finite")) std::printf("  %s values are not finite\n", plain(grid["not_finite"]).c_str());
    if (grid.contains("bbox")) std::printf("  voxels %s ... %s\n", grid["bbox"][0].dump().c_str(), grid["bbox"][1].dump().c_str());
    std::printf("  compression %s\n", plain(grid["compression"]).c_str());
    for (const auto& [name, value] : grid["metadata"].items()) std::printf("  %s  %s\n", name.c_str(), plain(value).c_str());
  }
}

void print_run(const Json& run) {
  const Json& frames = run["frames"];
  double seconds = 0;
  for (const Json& frame : frames)
    for (const auto& [stage, spent] : frame["seconds"].items()) seconds += spent.get<double>();
  std::printf("shot %s, %zu frames, %s\n", plain(run.value("shot", Json("?"))).c_str(), frames.size(), base::duration_text(seconds).c_str());
  if (!run.contains("hashes")) return;
  for (const auto& [stage, hash] : run["hashes"].items()) std::printf("  %s  %s\n", stage.c_str(), plain(hash).c_str());
}

void print_text(const Json& out) {
  std::printf("%s: %s\n", plain(out["file"]).c_str(), plain(out["kind"]).c_str());
  if (out.contains("grids")) print_grids(out["grids"]);
  if (out.contains("points")) {
    std::printf("%s points\n", plain(out["points"]["count"]).c_str());
    for (const Json& attribute : out["points"]["attributes"]) std::printf("  %s\n", plain(attribute).c_str());
  }
  if (out.contains("image")) {
    const Json& image = out["image"];
    std::string channels;
    for (const Json& channel : image["channels"]) channels += " " + plain(channel);
    std::printf("%sx%s, channels%s\n", plain(image["width"]).c_str(), plain(image["height"]).c_str(), channels.c_str());
    for (const auto& [name, range] : image["ranges"].items())
      std::printf("  %s  %s ... %s\n", name.c_str(), base::to_text(range[0].get<double>()).c_str(), base::to_text(range[1].get<double>()).c_str());
    if (image.contains("not_finite")) std::printf("  %s values are not finite\n", plain(image["not_finite"]).c_str());
    for (const auto& [name, value] : image["metadata"].items()) std::printf("  %s  %s\n", name.c_str(), plain(value).c_str());
  }
  if (out.contains("run")) print_run(out["run"]);
  for (const char* part : {"record", "movie", "checkpoint", "shot", "report", "mesh"})
    if (out.contains(part))
      for (const auto& [name, value] : out[part].items()) std::printf("  %s  %s\n", name.c_str(), value.dump().c_str());
}

}  // namespace

void info(const Request& request) {
  const fs::path file = request.subject;
  std::error_code failure;
  const fs::file_status status = fs::status(file, failure);
  if (!fs::exists(status)) base::throw_input(file.string(), "No such file or directory");
  if (fs::is_directory(status)) {
    const bool is_run = fs::exists(file / "run.json", failure);
    throw base::Error({.file = file.string(), .hint = is_run ? "polypic info " + (file / "run.json").string() : "", .message = "Is a directory"});
  }
  if (!fs::is_regular_file(status)) base::throw_input(file.string(), "is a pipe or a device, not a file");
  Json out;
  const std::string extension = kind_of(file);
  try {
    if (extension == ".vdb") {
      surface::initialize();
      out = volume_info(file);
    } else if (extension == ".exr" || extension == ".png") {
      out = image_info(file);
    } else if (extension == ".json") {
      out = document_info(file);
    } else if (extension == ".h5") {
      out = checkpoint_info(file);
    } else if (extension == ".toml") {
      out = shot_info(file);
    } else if (extension == ".mp4") {
      out = {{"schema", 1}, {"file", file.string()}, {"kind", "movie"}, {"movie", movie_info(file)}};
    } else if (extension == ".html") {
      out = page_info(file);
    } else if (extension == ".obj" || extension == ".ply" || extension == ".stl") {
      out = mesh_info(file);
    } else {
      base::throw_input(file.string(), "not a kind of file that is known here: .vdb, .exr, .png, .mp4, .h5, .json, .toml, .html, .obj, .ply, .stl");
    }
  } catch (const Json::exception&) {
    base::throw_input(file.string(), "not a document of this program");
  }
  if (request.json) std::printf("%s\n", out.dump(2, ' ', false, Json::error_handler_t::replace).c_str());
  else print_text(out);
}

}  // namespace app
