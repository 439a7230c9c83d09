#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/stages/document.h"
#include "app/plan/limits.h"
#include "app/plan/plan.h"
#include "app/plan/predict.h"
#include "app/stages/interrupt.h"
#include "base/error.h"

namespace app {
namespace {

std::vector<Stage> stages_of(const Request& request, const Shot& shot) {
  const bool is_flat = shot.scene.options.dimension == 2;
  if (request.command == "surface" && is_flat)
    throw error_about(shot, {.key = "sim.dimension", .value = "2", .hint = "polypic render draws the points", .message = "has no surface"});
  if (request.command == "simulate") return {Stage::simulate};
  if (request.command == "surface") return {Stage::surface};
  if (request.command == "render" && request.preview) return {Stage::preview};
  if (request.command == "render") {
    if (shot.has_pictures) return {Stage::render};
    throw base::Error({.file = shot.file.string(), .key = "render", .hint = "add [render], or --set render.width=960; --preview draws the points",
                       .message = "the shot asks for no pictures"});
  }
  std::vector<Stage> stages = stages_of(shot);
  if (!request.preview) return stages;
  const auto after = !is_flat && shot.render.preview.draw == "surface" ? Stage::surface : Stage::simulate;
  stages.insert(std::find(stages.begin(), stages.end(), after) + 1, Stage::preview);
  return stages;
}

bool wants(const Order& order, Stage stage) { return std::find(order.stages.begin(), order.stages.end(), stage) != order.stages.end(); }

std::int64_t recorded_frames(const Order& order, const FrameRange& range, Stage stage) {
  const std::vector<std::int64_t> frames = Folder(order.out).recorded_frames(stage);
  return std::count_if(frames.begin(), frames.end(), [&](std::int64_t f) { return f <= range.last; });
}

// Of what is still to be made.
void check_room(const Shot& shot, const Order& order, const FrameRange& range, const std::optional<Prediction>& predicted) {
  if (!wants(order, Stage::simulate)) return;
  Prediction needed = predicted ? *predicted : least(shot, range);
  const double missing = 1 - double(recorded_frames(order, range, Stage::simulate)) / double(range.last);
  for (auto& [kind, bytes] : needed.disk) bytes *= predicted || wants(order, Stage::render) || kind == "points" || kind == "checkpoint" ? missing : 0;
  require_room(shot, needed, free_memory(), free_disk(order.out));
}

// Of the files that are foretold: those of the stages and what tells of them, and not what else lies in the directory.
double written_bytes(const Folder& folder) {
  std::vector<std::filesystem::path> files = {folder.run(), folder.report()};
  for (const Stage stage : {Stage::simulate, Stage::surface, Stage::render})
    for (const std::int64_t frame : folder.recorded_frames(stage)) {
      files.push_back(folder.record(stage, frame));
      for (const std::filesystem::path& file : folder.outputs(stage, frame)) files.push_back(file);
    }
  for (const std::int64_t frame : folder.checkpoints()) files.push_back(folder.checkpoint(frame));
  double bytes = 0;
  std::error_code none;
  for (const std::filesystem::path& file : files)
    if (std::filesystem::is_regular_file(file, none)) bytes += double(std::filesystem::file_size(file, none));
  return bytes;
}

// What a run that began with nothing has cost.
void remember(const Shot& shot, const Order& order, const FrameRange& range, const Prediction& predicted, const nlohmann::ordered_json& run) {
  Outcome outcome{.shot = shot.name, .cpu_predicted = predicted.cpu_seconds(), .memory_predicted = predicted.peak_bytes,
                  .disk_predicted = predicted.disk_bytes()};
  for (const auto& frame : run.at("frames"))
    for (const auto& seconds : frame.at("cpu_seconds")) outcome.cpu += seconds.get<double>();
  outcome.memory = run.at("peak_bytes");
  outcome.disk = written_bytes(Folder(order.out));
  if (static_cast<std::int64_t>(run.at("frames").size()) == range.last) keep_outcome(outcome);
}

}  // namespace

void film(const Request& request) {
  const Shot shot = read_shot(find_shot(request.subject), request.overrides);
  if (!request.out && shot.name == "..")
    throw base::Error({.code = base::Exit::user, .file = request.subject, .hint = "--out says where", .message = "has no name that a folder in out could have"});
  Order order{.stages = stages_of(request, shot),
                    .frames = request.frames,
                    .out = request.out.value_or(std::filesystem::path("out") / shot.name),
                    .restart = request.restart,
                    .threads = request.threads.value_or(tbb::info::default_concurrency()),
                    .report = !request.no_report,
                    .command = request.line};
  const FrameRange range = order.frames.value_or(FrameRange{1, shot.frames});
  std::optional<Prediction> predicted;
  if (request.command == "run")
    if (const auto pilot = cached_pilot(shot, range.last, order.threads)) predicted = predict(shot, *pilot, range);
  check_room(shot, order, range, predicted);
  if (predicted) order.cost = base::duration_text(predicted->cpu_seconds()) + " of CPU, " + bytes_text(predicted->peak_bytes);
  const bool fresh = predicted && recorded_frames(order, range, Stage::simulate) == 0;
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(order.threads));
  catch_signals();
  surface::initialize();
  base::Progress progress(request.json ? stderr : stdout, request.quiet);
  if (request.command == "run" && !shot.has_pictures) progress.line("no pictures: the shot has no [render]");
  const nlohmann::ordered_json run = make_film(shot, order, progress);
  if (fresh) remember(shot, order, range, *predicted, run);
  if (request.json) std::fputs(document_text(run).c_str(), stdout);
}

}  // namespace app
