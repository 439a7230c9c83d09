// The user's cache: pilots by machine, program and shot.
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <thread>

#include "app/plan/pilot.h"
#include "app/stages/document.h"
#include "app/stages/hash.h"
#include "app/stages/machine.h"
#include "app/version.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kSchema = 1;

/// Sizes that a pilot is scaled from and to; frames are in its content. Those of the surface are scaled with the cell's: what they are of it counts.
constexpr std::string_view kSizes[] = {"sim.cell", "render.width", "render.height", "render.spp", "shot.frames", "shot.quality", "surface.voxel",
                                       "surface.radius"};

/// The program's file too: a build that was never committed is another program.
std::string machine_and_program() {
  struct stat file{};
  ::stat("/proc/self/exe", &file);
  return processor_name() + "|" + std::to_string(std::thread::hardware_concurrency()) + "|" + kVersion + "|" + kCommit + "|" +
         std::to_string(file.st_size) + "|" + std::to_string(file.st_mtim.tv_sec);
}

fs::path pilot_file(const Shot& shot, int threads) {
  if (cache_folder().empty()) return {};
  std::string text = machine_and_program() + "|" + std::to_string(threads);
  for (const auto& [key, value] : shot.values)
    if (std::find(std::begin(kSizes), std::end(kSizes), key) == std::end(kSizes)) text += "\n" + key + "=" + value;
  for (const std::optional<double>& size : {shot.surface.voxel, shot.surface.radius})
    text += "\n" + (size ? base::to_text(double(float(*size / shot.scene.options.cell))) : "");   // a float: as quotients of other sizes round
  return cache_folder() / ("pilot." + hex16(fnv1a(text)) + ".json");
}

Json to_json(const MicroRun& run) {
  Json out = {{"particles", run.particles}, {"cell", run.cell}, {"pixels", run.pixels}, {"samples", run.samples}, {"peak_bytes", run.peak_bytes},
              {"frames", Json::array()}};
  for (const auto& [frame, cost] : run.frames)
    out["frames"].push_back(
        {{"frame", frame}, {"steps", cost.steps}, {"speed", cost.speed}, {"cpu", cost.cpu}, {"calls", cost.calls}, {"bytes", cost.bytes}});
  return out;
}

MicroRun run_from(const Json& json) {
  MicroRun run{json.at("particles"), json.at("cell"), json.at("pixels"), json.at("samples"), json.at("peak_bytes"), {}};
  for (const Json& frame : json.at("frames"))
    run.frames[frame.at("frame")] = {frame.at("steps"), frame.at("speed"), frame.at("cpu"), frame.at("calls"), frame.at("bytes")};
  return run;
}

}  // namespace

fs::path cache_folder() {
  const char* const xdg = std::getenv("XDG_CACHE_HOME");
  if (xdg && *xdg == '/') return fs::path(xdg) / "polypic";   // the standard ignores relative ones
  const char* const home = std::getenv("HOME");
  return home && *home ? fs::path(home) / ".cache" / "polypic" : fs::path();
}

std::optional<Pilot> cached_pilot(const Shot& shot, std::int64_t last_frame, int threads) {
  const fs::path file = pilot_file(shot, threads);
  std::error_code none;
  if (file.empty() || !fs::exists(file, none)) return {};
  try {
    const Json json = Json::parse(base::read_file(file));
    Pilot pilot{run_from(json.at("small")), run_from(json.at("wide")), run_from(json.at("fine")), json.at("last"), json.at("seconds")};
    if (json.at("schema") != kSchema || pilot.last < std::min(last_frame, kLastFollowed)) return {};
    return pilot;
  } catch (const std::exception&) {   // damaged, or of another form: measured again
    return {};
  }
}

void keep_pilot(const Shot& shot, int threads, const Pilot& pilot) {
  const fs::path file = pilot_file(shot, threads);
  if (file.empty()) return;
  try {
    fs::create_directories(file.parent_path());
    const Json json = {{"schema", kSchema}, {"shot", shot.name}, {"last", pilot.last}, {"seconds", pilot.seconds},
                       {"small", to_json(pilot.small)}, {"wide", to_json(pilot.wide)}, {"fine", to_json(pilot.fine)}};
    base::write_text_atomically(file, document_text(json));
  } catch (const fs::filesystem_error&) {
  } catch (const base::Error&) {
  }
}

}  // namespace app
