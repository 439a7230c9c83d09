#include "app/plan/pilot.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>

#include "app/plan/predict.h"
#include "app/stages/interrupt.h"
#include "app/stages/program.h"
#include "app/stages/record.h"
#include "app/stages/stopwatch.h"
#include "base/scratch_folder.h"
#include "base/text.h"
#include "sim/empty_body.h"
#include "sim/size.h"

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr double kManyParticles = 60000, kFewParticles = 8000;   // of the fine and the coarse run
constexpr double kManySamples = 1e6, kManyPixels = 6e5;          // of a picture
constexpr double kFollowing = 15;                                // [s] that the fine run may take at most to its last frame
constexpr double kPatience = 6;                                  // [s] of the first run: above it the others stay as small

/// Waits for the process, or ends it when the time is over or a signal came. True when it ended well.
bool ended_well(pid_t child, double seconds, const std::function<bool()>& given_up) {
  const Stopwatch watch;
  int status = 0;
  while (::waitpid(child, &status, WNOHANG) == 0) {
    if (signal_came() || watch.seconds() > seconds || given_up()) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &status, 0);
      stop_if_signalled();
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool run(const fs::path& program, const fs::path& cache, std::vector<std::string> words, double seconds, const std::function<bool()>& given_up) {
  words.insert(words.begin(), program.string());
  std::vector<std::string> variables = {"XDG_CACHE_HOME=" + cache.string()};   // a micro-run is none that is remembered
  for (char** variable = environ; *variable; ++variable)
    if (!std::string_view(*variable).starts_with("XDG_CACHE_HOME=")) variables.emplace_back(*variable);
  std::vector<char*> environment;
  for (std::string& variable : variables) environment.push_back(variable.data());
  environment.push_back(nullptr);
  const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  pid_t child = -1;
  const int failure = start_program(std::move(words), {nothing, nothing, nothing}, environment.data(), /*in_own_group=*/false, child);
  ::close(nothing);
  return failure == 0 && ended_well(child, seconds, given_up);
}

/// The sizes of a micro-run, and the keys that make them.
struct Sizes {
  double particles = 0, cell = 0, pixels = 0, samples = 0;   // particles at the shot's last frame
  sim::Scene scene;
  std::vector<std::string> sets;
};

std::string box_text(const base::Box& box, std::int64_t dimension) {
  const auto corner = [&](const base::Vec3& v) {
    std::string text = "[";
    for (std::int64_t a = 0; a < dimension; ++a) text += (a > 0 ? "," : "") + base::to_text(v[a]);
    return text + "]";
  };
  return "[" + corner(box.lower) + "," + corner(box.upper) + "]";
}

/// The scene in cells of an edge `cell`, in a domain that grows at its upper sides where it is no multiple of it.
sim::Scene with_cell(const Shot& shot, double cell) {
  const sim::Options& o = shot.scene.options;
  sim::Scene coarse = shot.scene;
  coarse.options.cell = cell;
  for (int a = 0; a < o.dimension; ++a)
    coarse.options.domain.upper[a] = o.domain.lower[a] + std::ceil(o.domain.size()[a] / cell - 1e-6) * cell;
  return coarse;
}

void set_cell(const Shot& shot, double cell, Sizes& sizes) {
  const sim::Options& o = shot.scene.options;
  sizes.scene = with_cell(shot, cell);
  sizes.particles = sim::particles_at(double(shot.frames - 1) / shot.fps, sizes.scene);
  sizes.cell = cell;
  if (cell == o.cell) return;
  const double ratio = cell / o.cell;
  sizes.sets.push_back("sim.cell=" + base::to_text(cell));
  sizes.sets.push_back("sim.domain=" + box_text(sizes.scene.options.domain, o.dimension));
  if (o.dimension == 3 && shot.surface.voxel) sizes.sets.push_back("surface.voxel=" + base::to_text(*shot.surface.voxel * ratio));
  if (o.dimension == 3 && shot.surface.radius) sizes.sets.push_back("surface.radius=" + base::to_text(*shot.surface.radius * ratio));
}

/// A cell with about so many particles: a whole share of the domain where there is one near, so that the walls stay where they are.
double cell_with(const Shot& shot, double particles) {
  const sim::Options& o = shot.scene.options;
  const double there = particles_at(shot, shot.frames);
  if (there <= 1.3 * particles) return o.cell;
  const std::int64_t common = sim::common_parts(o);
  std::int64_t fewest = std::numeric_limits<std::int64_t>::max();
  bool periodic = false;
  for (int a = 0; a < o.dimension; ++a) {
    fewest = std::min<std::int64_t>(fewest, std::llround(o.domain.size()[a] / o.cell));
    periodic = periodic || o.periodic(a);
  }
  for (std::int64_t parts = common - 1; parts >= 1; --parts) {
    const double share = double(parts) / double(common);
    if (there * std::pow(share, double(o.dimension)) > 1.3 * particles) continue;
    if (there * std::pow(share, double(o.dimension)) < particles / 6 || fewest * parts / common < 4) break;
    return o.cell / share;
  }
  return periodic ? o.cell : o.cell * std::pow(there / particles, 1.0 / double(o.dimension));
}

/// The same, or one so much finer that every body keeps a particle and every collider a node: a shot in which one has none is refused.
double coarser_cell(const Shot& shot, double particles) {
  const double finest = shot.scene.options.cell;
  double cell = cell_with(shot, particles);
  const auto is_refused = [&] {
    sim::Scene scene = with_cell(shot, cell);
    sim::measure_meshes(scene);
    return sim::find_refused_mesh(scene).has_value() || sim::find_empty_body(scene).has_value() || sim::find_unmet_collider(scene).has_value();
  };
  for (double more = 2 * particles; cell > finest && is_refused(); more *= 2) cell = cell_with(shot, more);
  return cell;
}

void set_picture(const Shot& shot, double scale, Sizes& sizes) {
  if (!shot.has_pictures) return;
  const render::Options& o = shot.render.options;
  const auto width = std::max<std::int64_t>(16, std::llround(double(o.width) * scale)),
             height = std::max<std::int64_t>(16, std::llround(double(o.height) * scale));
  sizes.pixels = double(width * height);
  sizes.samples = shot.scene.options.dimension == 2 ? sizes.pixels : sizes.pixels * double(o.spp);
  sizes.sets.push_back("render.width=" + std::to_string(width));
  sizes.sets.push_back("render.height=" + std::to_string(height));
}

Sizes sizes_of(const Shot& shot, double cell, double picture) {
  Sizes sizes;
  set_cell(shot, cell, sizes);
  set_picture(shot, picture, sizes);
  return sizes;
}

void add_record(const Record& record, const std::string& stage, FrameCost& cost) {
  double counted = 0;
  for (const auto& [pass, spent] : record.passes) {
    cost.cpu[stage + "/" + pass] = spent.cpu_seconds;
    cost.calls[stage + "/" + pass] = double(spent.calls);
    counted += spent.cpu_seconds;
  }
  cost.cpu[stage + "/other"] = std::max(0.0, record.cpu_seconds - counted);
  cost.calls[stage + "/other"] = 1;
  for (const Record::File& file : record.files) {
    const std::string kind = file.name.substr(0, file.name.find('/'));
    cost.bytes[kind] += double(file.bytes);
  }
  cost.bytes["ledger"] += 2000;   // a record, and its part of run.json
  if (!record.totals) return;
  cost.steps = double(record.totals->substeps);
  cost.speed = record.totals->max_speed;
}

MicroRun read_run(const Sizes& sizes, const fs::path& out) {
  MicroRun result{.particles = sizes.particles, .cell = sizes.cell, .pixels = sizes.pixels, .samples = sizes.samples, .peak_bytes = 0, .frames = {}};
  const Folder folder(out);
  for (const Stage stage : {Stage::simulate, Stage::surface, Stage::render})
    for (const std::int64_t frame : folder.recorded_frames(stage)) {
      const auto record = read_record(folder, stage, frame);
      if (!record) continue;
      add_record(*record, std::string(stage_name(stage)), result.frames[frame]);
      result.peak_bytes = std::max(result.peak_bytes, double(record->peak_bytes));
      if (record->totals)   // what was expected at the end is off by as much as at this frame
        result.particles = sizes.particles * double(record->totals->particles) / sim::particles_at(record->totals->time, sizes.scene);
    }
  return result;
}

/// Of all threads together: more than it takes on the clock.
double seconds_of_simulating(const MicroRun& run) {
  double seconds = 0;
  for (const auto& [frame, cost] : run.frames)
    for (const auto& [key, spent] : cost.cpu)
      if (key.starts_with(std::string(stage_name(Stage::simulate)) + "/")) seconds += spent;
  return seconds;
}

class Measuring {
 public:
  Measuring(fs::path program, const Shot& shot, const Overrides& overrides, int threads, const std::function<bool()>& given_up)
      : program_(std::move(program)), shot_(shot), overrides_(overrides), threads_(threads), given_up_(given_up) {}

  std::optional<Pilot> measure(std::int64_t last_frame) {
    const double picture = std::min({1.0, std::sqrt(kManyPixels / pixels()), std::sqrt(kManySamples / samples())});
    const double coarse = coarser_cell(shot_, kFewParticles);
    Pilot pilot;
    pilot.last = std::min(last_frame, kLastFollowed);
    const std::int64_t first = std::min<std::int64_t>(kFirstFrames, pilot.last);
    const Sizes small = sizes_of(shot_, coarse, 0.5 * picture);
    if (!make(small, "small", 1, first)) return {};
    const bool hurry = watch_.seconds() > kPatience;
    const Sizes wide = sizes_of(shot_, coarse, hurry ? 0.5 * picture : picture);
    const Sizes fine = sizes_of(shot_, hurry ? coarse : coarser_cell(shot_, kManyParticles), hurry ? 0.5 * picture : picture);
    if (!make(fine, "fine", 1, first) || !make(wide, "wide", 1, first)) return {};
    if (pilot.last > first && !make(wide, "wide", pilot.last, pilot.last)) return {};
    // Drops fly faster in smaller cells, and there are more of them: the fine run is followed, too, where that is quick.
    pilot.small = read_run(small, scratch_.path() / "small");
    pilot.wide = read_run(wide, scratch_.path() / "wide");
    const double longer = fine.particles / wide.particles * wide.cell / fine.cell, left = kLongestPilot - watch_.seconds();
    if (pilot.last > first && longer > 1 && seconds_of_simulating(pilot.wide) * longer < std::min(kFollowing, left))
      make(fine, "fine", pilot.last, pilot.last, "simulate");
    pilot.fine = read_run(fine, scratch_.path() / "fine");
    pilot.seconds = watch_.seconds();
    return pilot;
  }

 private:
  static constexpr std::int64_t kFirstFrames = 3;

  double pixels() const { return double(shot_.render.options.width * shot_.render.options.height); }
  double samples() const { return shot_.scene.options.dimension == 2 ? pixels() : pixels() * double(shot_.render.options.spp); }

  bool make(const Sizes& sizes, const std::string& name, std::int64_t from, std::int64_t to, const std::string& command = "run") {
    std::vector<std::string> words = {command, shot_.file.string(), "--quiet", "--no-report", "--out", (scratch_.path() / name).string(), "--threads",
                                      std::to_string(threads_), "--frames", std::to_string(from) + "-" + std::to_string(to)};
    if (overrides_.quality) words.insert(words.end(), {"--quality", *overrides_.quality});
    for (const auto& list : {overrides_.sets, sizes.sets})
      for (const std::string& set : list) words.insert(words.end(), {"--set", set});
    return run(program_, scratch_.path() / "cache", std::move(words), kLongestPilot - watch_.seconds(), given_up_);
  }

  fs::path program_;
  const Shot& shot_;
  const Overrides& overrides_;
  int threads_;
  const std::function<bool()>& given_up_;
  Stopwatch watch_;
  base::ScratchFolder scratch_;
};

}  // namespace

std::optional<Pilot> measure_pilot(const fs::path& program, const Shot& shot, const Overrides& overrides, std::int64_t last_frame, int threads,
                                   const std::function<bool()>& given_up) {
  return Measuring(program, shot, overrides, threads, given_up).measure(last_frame);
}

std::string why_no_pilot(double seconds) {
  return seconds < kLongestPilot ? "a small run of this shot fails" : "small runs of this shot take more than a minute";
}

}  // namespace app
