#include "app/study/shot_runs.h"

#include <algorithm>

#include "app/stages/finished.h"
#include "app/stages/folder.h"
#include "app/stages/interrupt.h"
#include "app/stages/picture.h"
#include "app/stages/record.h"
#include "app/study/child.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> words_of(const ShotRun& run) {
  std::vector<std::string> words = {
      "simulate",  run.shot.string(),          "--quiet", "--no-report", "--out", run.out.string(), "--frames", "1-" + std::to_string(run.last),
      "--threads", std::to_string(run.threads)};
  if (run.overrides.quality) words.insert(words.end(), {"--quality", *run.overrides.quality});
  for (const std::string& set : run.overrides.sets) words.insert(words.end(), {"--set", set});
  return words;
}

/// Of the simulation alone, whatever else was made of it.
MeasuredRun measured_from(const Folder& folder, std::int64_t last) {
  MeasuredRun run = {{"errors", MeasuredRun::object()}};
  std::vector<double> time, energy;
  double start = 0, seconds = 0, cpu = 0, drift = 0;
  std::int64_t steps = 0, drifts = 0, peak = 0, particles = 0;
  std::map<std::string, double> changes;
  base::Ledger passes;
  for (std::int64_t frame = 1; frame <= last; ++frame) {
    const std::optional<Record> record = read_record(folder, Stage::simulate, frame);
    if (!record || !record->totals) base::throw_input(folder.record(Stage::simulate, frame).string(), "cannot be read");
    const sim::Totals& t = *record->totals;
    if (frame == 1) start = t.energy();
    time.push_back(t.time);
    energy.push_back(start != 0 ? t.energy() / start : 1);
    particles = t.particles, steps += t.substeps;
    seconds += record->seconds, cpu += record->cpu_seconds, peak = std::max(peak, record->peak_bytes);
    if (t.volume_drift) drift += std::abs(*t.volume_drift), ++drifts;
    for (const auto& [name, cost] : record->passes) {
      if (name == "write_points" || name == "checkpoint") seconds -= cost.seconds, cpu -= cost.cpu_seconds;   // a disk is as fast as it happens to be
      else passes.add(name, cost);
    }
    for (const auto& [stage, change] : t.energy_changes) changes[stage] += start != 0 ? change / start : 0;
  }
  if (drifts > 0) run["errors"]["volume"] = drift / double(drifts);
  run["course"] = {{"time", time}, {"energy", energy}, {"enstrophy", MeasuredRun::array()}};
  run["energy_changes"] = changes;
  run["particles"] = particles, run["steps"] = steps, run["seconds"] = seconds, run["cpu_seconds"] = cpu, run["peak_bytes"] = peak;
  MeasuredRun& costs = run["passes"] = MeasuredRun::object();
  base::PassCost other{last, seconds, 0, cpu};   // sums and states of frames
  for (const auto& [name, cost] : passes.passes()) other.seconds -= cost.seconds, other.cpu_seconds -= cost.cpu_seconds;
  passes.add("other", {last, std::max(0.0, other.seconds), 0, std::max(0.0, other.cpu_seconds)});
  for (const auto& [name, cost] : passes.passes())
    costs[name] = {{"calls", cost.calls}, {"seconds", cost.seconds}, {"cpu_seconds", cost.cpu_seconds}};
  return run;
}

/// Frames whose pictures, and surfaces in three dimensions, are not there.
std::vector<std::int64_t> missing_of(const Shot& shot, const Folder& folder, const StageHashes& hashes, const std::vector<std::int64_t>& frames) {
  const std::int64_t dimension = shot.scene.options.dimension;
  Finished finished(folder, hashes, dimension);
  std::vector<std::int64_t> missing;
  for (const std::int64_t frame : frames)
    if (!finished.has(Stage::render, frame) || (dimension == 3 && !finished.has(Stage::surface, frame))) missing.push_back(frame);
  return missing;
}

}  // namespace

MeasuredRun simulate(const ShotRun& run, std::string& failure) {
  failure = run_child(words_of(run)).failure;
  if (!failure.empty()) return {};
  return measured_from(Folder(run.out), run.last);
}

std::vector<std::int64_t> missing_pictures(const ShotRun& run, const std::vector<std::int64_t>& frames) {
  const Shot shot = read_shot(run.shot, run.overrides);
  return missing_of(shot, Folder(run.out), stage_hashes(shot), frames);
}

std::string make_pictures(const ShotRun& run, const std::vector<std::int64_t>& frames) {
  try {
    const Shot shot = read_shot(run.shot, run.overrides);
    const Folder folder(run.out);
    const StageHashes hashes = stage_hashes(shot);
    PictureMaker maker(shot, folder, hashes, run.threads);
    for (const std::int64_t frame : missing_of(shot, folder, hashes, frames)) {
      stop_if_signalled();
      if (shot.scene.options.dimension == 3) maker.surface(frame);
      maker.render(frame);
    }
  } catch (const base::Error& e) {
    return base::to_line(e.complaint());
  }
  return "";
}

std::int64_t disk_bytes(const fs::path& folder) {
  std::int64_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += std::int64_t(entry.file_size());
  return bytes;
}

}  // namespace app
