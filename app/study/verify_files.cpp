#include "app/study/verify_files.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include "app/shot/shot.h"
#include "app/stages/film.h"
#include "app/stages/hash.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/scratch_folder.h"
#include "sim/checkpoint.h"
#include "sim/simulation.h"
#include "surface/surface.h"

namespace app {
namespace {

namespace fs = std::filesystem;

/// A column of water in a box of 1 m, to which cases add.
constexpr const char* kWater = "[[body]]\nname = \"column\"\nshape = { box = [[0, 0, 0], [0.5, 1, 1]] }\n";
constexpr const char* kJelly = "[sim]\nsolver = \"solid\"\n[[body]]\nname = \"cube\"\nshape = { box = [[0.2, 0.2, 0.2], [0.5, 0.5, 0.5]] }\n";
/// A small film: three frames of a drop that falls, with pictures.
constexpr const char* kFilm = R"([shot]
frames = 4
[sim]
cell = 0.1
transfer = "polypic"
[[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.4, 1, 0.5]] }
[[effect]]
kind = "gravity"
acceleration = [0, 0, -9.81]
[render]
width = 48
height = 27
spp = 1
)";

sim::VerifyCase file_case(const std::string& name, int dimension, const std::string& source) {
  sim::VerifyCase c;
  c.name = name;
  c.dimension = dimension;
  c.transfer = c.kernel = c.integrator = "any";
  c.source = source;
  return c;
}

Shot shot_from(const base::ScratchFolder& folder, const std::string& text, const std::vector<std::string>& sets = {}) {
  base::write_text_atomically(folder.path() / "x.toml", text);
  return read_shot(folder.path() / "x.toml", {.quality = {}, .sets = sets});
}

/// What is said, with exit 2, of a shot that must not run; `mesh` goes to m.obj beside it.
struct Nonsense {
  const char* name;
  std::string text, told;       // the shot, and what its line must hold
  std::string mesh = {};
  const char* source = "case 22";
};

sim::VerifyCase refused(const Nonsense& n) {
  sim::VerifyCase c = file_case(std::string("refused/") + n.name, 3, n.source);
  c.expect = "an expected failure: refused with exit 2 and \"" + n.told + "\"";
  c.run = [n] {
    const base::ScratchFolder folder;
    if (!n.mesh.empty()) base::write_text_atomically(folder.path() / "m.obj", n.mesh);
    sim::CaseOutcome found;
    found.value = 1, found.outcome = "it was accepted";
    try {
      const Shot shot = shot_from(folder, n.text);
      sim::make_simulation(shot.scene, shot.fps);
    } catch (const base::Error& e) {
      const std::string line = e.what();
      const std::size_t at = line.rfind(folder.path().string());
      found.outcome = at == std::string::npos ? line : line.substr(at + folder.path().string().size() + 1);
      found.value = e.complaint().code == base::Exit::user && line.find(n.told) != std::string::npos ? 0 : 1;
    }
    return found;
  };
  return c;
}

std::vector<Nonsense> nonsense() {
  const std::string water = kWater, jelly = kJelly;
  const std::string mesh_shot = "[sim]\nsolver = \"solid\"\n[[body]]\nname = \"piece\"\nshape = { mesh = { file = \"m.obj\" } }\n";
  const std::string faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const char* const numbers = "case 7";
  return {{"cell_nan", water + "[sim]\ncell = nan\n", "sim.cell = nan m: must be finite", "", numbers},
          {"cell_infinite", water + "[sim]\ncell = inf\n", "sim.cell = inf m: must be finite", "", numbers},
          {"cell_zero", water + "[sim]\ncell = 0\n", "sim.cell = 0 m: must be above 0"},
          {"velocity_infinite", water + "velocity = [1, 0, inf]\n", "body.column.velocity = [1, 0, inf] m/s: must be finite", "", numbers},
          {"camera_nan", water + "[render]\n[camera]\nposition = [nan, 0, 0]\n", "camera.position", "", numbers},
          {"gravity_nan", water + "[[effect]]\nkind = \"gravity\"\nacceleration = [0, 0, nan]\n", "acceleration", "", numbers},
          {"mesh_nan", mesh_shot, "m.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nv 0 0 1\n" + faces, numbers},
          {"mesh_infinite", mesh_shot, "m.obj", "v 0 0 0\nv 1 0 0\nv 0 1e39 0\nv 0 0 1\n" + faces, numbers},
          {"mesh_open", mesh_shot, "is not closed", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n", numbers},
          {"young_zero", jelly + "material = { preset = \"jelly\", young = 0 }\n", "material.young = 0 Pa: must be above 0"},
          {"density_zero", jelly + "material = { preset = \"jelly\", density = 0 }\n", "material.density = 0 kg/m^3: must be above 0"},
          {"poisson_minus_one", jelly + "material = { preset = \"jelly\", poisson = -1 }\n", "material.poisson = -1: must be"},
          {"poisson_half", jelly + "material = { preset = \"jelly\", poisson = 0.5 }\n", "material.poisson = 0.5: must be", "", "case 10"},
          {"fps_zero", water + "[shot]\nfps = 0\n", "shot.fps = 0"},
          {"cfl_zero", water + "[sim]\ncfl = 0\n", "sim.cfl = 0"},
          {"domain_empty", water + "[sim]\ndomain = [[0, 0, 0], [0, 1, 1]]\n", "sim.domain"},
          {"no_particle", "[[body]]\nname = \"column\"\nshape = { box = [[5, 5, 5], [6, 6, 6]] }\n", "no particle", "", "case 5"},
          {"body_in_a_collider", water + "[[collider]]\nname = \"block\"\nshape = { box = [[0, 0, 0], [1, 1, 1]] }\n", "no particle", "", "case 17"},
          {"solid_with_linear_kernel",
           "[sim]\nsolver = \"solid\"\nkernel = \"linear\"\n[[body]]\nname = \"cube\"\nshape = { box = [[0.2, 0.2, 0.2], [0.5, 0.5, 0.5]] }\n",
           "solids need the quadratic kernel", "", "docs/transfers.md, carry"},
          {"limited_carry_with_linear_kernel", water + "[sim]\nkernel = \"linear\"\ncarry = \"limited\"\n", "carry", "", "docs/transfers.md, carry"},
          {"voxel_zero", water + "[surface]\nvoxel = 0\n", "surface.voxel = 0 m: must be above 0"},
          {"voxel_too_fine", water + "[surface]\nvoxel = 1e-9\n",
           "surface.voxel = 1e-09 m: is 0 of sim.cell = 0.02 m; must be between 1/32 and 2 of it"},
          {"voxel_too_coarse", water + "[surface]\nvoxel = 0.5\n",
           "surface.voxel = 0.5 m: is 25 of sim.cell = 0.02 m; must be between 1/32 and 2 of it"}};
}

struct Followed {
  std::vector<std::uint64_t> hashes;   // of frames 2 ...
  std::vector<double> time, energy;    // [s], [J]; the start's first
  sim::Frame last;
};

/// Frames 2 ... `frames` of a shipped shot, coarse, on a number of threads; with `restarts`, each from a checkpoint file of the frame before.
Followed follow(const Shot& shot, int threads, std::int64_t frames, bool restarts) {
  tbb::task_arena arena(threads);
  return arena.execute([&] {
    const base::ScratchFolder folder;
    Followed found;
    auto simulation = sim::make_simulation(shot.scene, shot.fps);
    const auto see = [&](const sim::Totals& t) { found.time.push_back(t.time), found.energy.push_back(t.energy()); };
    see(simulation->totals());
    base::Ledger ledger;
    for (std::int64_t frame = 2; frame <= frames; ++frame) {
      if (restarts) {
        const fs::path file = folder.path() / "state.h5";
        sim::write_checkpoint(file, "", "", simulation->state());
        simulation = sim::make_simulation(shot.scene, shot.fps);
        simulation->restore(sim::read_checkpoint(file).state);
      }
      simulation->advance(ledger, {});
      found.hashes.push_back(simulation->totals().state_hash);
      see(simulation->totals());
    }
    found.last = simulation->frame();
    return found;
  });
}

sim::VerifyCase same_bits(const fs::path& file) {
  sim::VerifyCase c = file_case("threads_and_restarts/" + file.stem().string(), 3, "case 21");
  c.expect = "the draft of the shot has the same state_hash on 1 and 2 threads, and on 4 from a checkpoint at every frame (value: runs that differ)";
  c.run = [file] {
    const Shot shot = read_shot(file, {.quality = "draft", .sets = {}});
    constexpr std::int64_t kFrames = 4;
    const Followed alone = follow(shot, 1, kFrames, false);
    int differ = 0;
    differ += follow(shot, 2, kFrames, false).hashes != alone.hashes;
    differ += follow(shot, 4, kFrames, true).hashes != alone.hashes;
    sim::CaseOutcome found;
    found.value = differ;
    found.outcome = fmt::format("{} of 2 runs differ from that on one thread; frame {} is {}", differ, kFrames, hex16(alone.hashes.back()));
    found.picture = alone.last, found.scene = shot.scene;
    if (alone.energy.front() == 0) return found;
    for (std::size_t f = 0; f < alone.energy.size(); ++f)
      found.time.push_back(alone.time[f]), found.energy.push_back(alone.energy[f] / alone.energy.front());
    return found;
  };
  return c;
}

nlohmann::ordered_json film(const base::ScratchFolder& folder, const std::string& out, std::int64_t last, const std::vector<std::string>& sets,
                            std::vector<Stage> stages) {
  base::Progress silent(stderr, true);
  const Shot shot = shot_from(folder, kFilm, sets);
  return make_film(shot, {.stages = std::move(stages), .frames = FrameRange{1, last}, .out = folder.path() / out, .restart = false, .threads = 2},
                   silent);
}

sim::VerifyCase goes_on() {
  sim::VerifyCase c = file_case("resume/goes_on", 3, "case 21");
  c.expect = "frames 1-2 and then 1-4 give the files that 1-4 at once gives (value: frames that differ)";
  c.run = [] {
    const base::ScratchFolder folder;
    const auto whole = film(folder, "whole", 4, {}, {Stage::simulate});
    film(folder, "parts", 2, {}, {Stage::simulate});
    const auto parts = film(folder, "parts", 4, {}, {Stage::simulate});
    sim::CaseOutcome found;
    for (std::size_t f = 0; f < whole.at("frames").size(); ++f) found.value += whole["frames"][f]["state_hash"] != parts["frames"][f]["state_hash"];
    found.outcome = std::to_string(whole.at("frames").size()) + " frames, " + std::to_string(int(found.value)) + " differ";
    if (whole.at("frames").size() != 4 || parts.at("frames").size() != 4) found.broken.push_back("frames are missing");
    return found;
  };
  return c;
}

sim::VerifyCase refuses_a_change() {
  sim::VerifyCase c = file_case("resume/changed_shot", 3, "case 23");
  c.expect = "an expected failure: exit 4 names the key that changed, sim.cfl";
  c.run = [] {
    const base::ScratchFolder folder;
    film(folder, "out", 2, {}, {Stage::simulate});
    sim::CaseOutcome found;
    found.value = 1, found.outcome = "it went on";
    try {
      film(folder, "out", 3, {"sim.cfl=0.5"}, {Stage::simulate});
    } catch (const base::Error& e) {
      found.outcome = base::Complaint(e.complaint()).message;
      found.value = e.complaint().code == base::Exit::resume_refused && std::string(e.what()).find("sim.cfl") != std::string::npos ? 0 : 1;
      if (found.outcome.empty()) found.outcome = e.complaint().key;
    }
    return found;
  };
  return c;
}

template <class Number>
std::int64_t not_finite(const sim::Column& c) {
  std::vector<Number> values(c.bytes.size() / sizeof(Number));
  std::memcpy(values.data(), c.bytes.data(), c.bytes.size());
  return std::count_if(values.begin(), values.end(), [](Number x) { return !std::isfinite(x); });
}

/// Numbers in a file of a run that are none; -1 for a file that nobody here can read.
std::int64_t not_finite_in(const fs::path& file) {
  const std::string kind = file.extension().string();
  if (kind == ".h5") {
    std::int64_t sum = 0;
    for (const sim::Column& c : sim::read_checkpoint(file).state.columns)
      sum += c.type == sim::Column::Type::float32 ? not_finite<float>(c) : c.type == sim::Column::Type::float64 ? not_finite<double>(c) : 0;
    return sum;
  }
  if (kind == ".exr" || kind == ".png") return std::int64_t(render::info(file).not_finite);
  if (kind == ".json") return base::read_file(file).find("null") != std::string::npos;   // what the writer makes of a number that is none
  if (kind != ".vdb") return -1;
  const auto none = [](const base::Vec3f& v) { return !v.allFinite(); };
  if (surface::holds_points(file)) {
    const sim::Frame frame = surface::read_points(file);
    return std::count_if(frame.position.begin(), frame.position.end(), none) + std::count_if(frame.velocity.begin(), frame.velocity.end(), none);
  }
  std::int64_t sum = 0;
  for (const surface::GridInfo& grid : surface::info(file)) sum += std::int64_t(grid.not_finite);
  base::Ledger ledger;
  const surface::Mesh mesh = surface::read_surface(file, {}, ledger);
  return sum + std::count_if(mesh.position.begin(), mesh.position.end(), none) + std::count_if(mesh.velocity.begin(), mesh.velocity.end(), none);
}

sim::VerifyCase files_hold_numbers() {
  sim::VerifyCase c = file_case("files_hold_numbers", 3, "docs/stability.md");
  c.expect = "points, surfaces, pictures, checkpoints and ledgers of a film hold no number that is none (value: how many do)";
  c.run = [] {
    const base::ScratchFolder folder;
    film(folder, "out", 3, {"shot.checkpoint_every=1"}, {Stage::simulate, Stage::surface, Stage::render});
    sim::CaseOutcome found;
    std::map<std::string, int> seen;
    for (const auto& entry : fs::recursive_directory_iterator(folder.path() / "out")) {
      if (!entry.is_regular_file()) continue;
      const std::int64_t bad = not_finite_in(entry.path());
      if (bad < 0) continue;
      found.value += double(bad);
      ++seen[entry.path().extension().string()];
    }
    for (const char* kind : {".vdb", ".exr", ".png", ".h5", ".json"}) {
      found.outcome += (found.outcome.empty() ? "" : ", ") + std::to_string(seen[kind]) + " " + kind;
      if (seen[kind] == 0) found.broken.push_back(std::string("no ") + kind + " was written");
    }
    return found;
  };
  return c;
}

}  // namespace

std::vector<sim::VerifyCase> file_cases() {
  std::vector<sim::VerifyCase> all;
  for (const Nonsense& n : nonsense()) all.push_back(refused(n));
  for (const fs::path& shot : shipped_shots()) all.push_back(same_bits(shot));
  all.push_back(goes_on());
  all.push_back(refuses_a_change());
  all.push_back(files_hold_numbers());
  return all;
}

}  // namespace app
