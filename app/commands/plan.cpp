#include <tbb/info.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/plan/graph.h"
#include "app/plan/limits.h"
#include "app/plan/plan.h"
#include "app/plan/predict.h"
#include "app/stages/document.h"
#include "app/stages/interrupt.h"
#include "app/stages/stopwatch.h"
#include "app/stages/write_over.h"
#include "base/atomic_file.h"
#include "base/progress.h"
#include "sim/size.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

// Effects that are on, by stage; those that are off in one line at the end.
void print_effects(const Shot& shot) {
  const std::vector<ExplainedEffect> effects = explained_effects(shot);
  std::size_t name = 0, key = 0;
  for (const ExplainedEffect& e : effects)
    if (e.on) name = std::max(name, e.name.size()), key = std::max(key, e.key.size());
  std::string stage, off = shot.has_pictures ? "" : "pictures (there is no [render])";
  for (const ExplainedEffect& e : effects) {
    if (!e.on) {
      if (e.stage == stage_name(Stage::render) && !shot.has_pictures) continue;
      off += (off.empty() ? "" : ", ") + e.name;
      continue;
    }
    std::printf("%-9s %-*s  %-*s  %s\n", e.stage == stage ? "" : e.stage.c_str(), int(name), e.name.c_str(), int(key), e.key.c_str(),
                e.value.c_str());
    stage = e.stage;
  }
  std::printf("off: %s\n\n", off.c_str());
}

void print_sizes(const Shot& shot, const sim::Size& size, const FrameRange& range) {
  const base::Plan sim = plan_of(shot, Stage::simulate);
  std::string attributes;
  for (const base::Attribute& a : sim.attributes) attributes += (attributes.empty() ? "" : ", ") + a.name + " " + std::to_string(a.bytes);
  std::printf("%-10s%.0f, each %lld B: %s\n", "particles", size.particles, static_cast<long long>(sim.bytes_per_particle()), attributes.c_str());
  std::string flows;
  const std::vector<double> each = sim::flows(shot.scene);
  for (std::size_t s = 0; s < each.size(); ++s) flows += fmt::format("; {} {:.3g} m^3/s", shot.scene.sources[s].name, each[s]);
  if (!each.empty()) std::printf("%-10s%.0f more by frame %lld%s\n", "poured", particles_at(shot, range.last) - size.particles,
                                static_cast<long long>(range.last), flows.c_str());
  std::printf("%-10s%.0f\n", "cells", size.cells);
  for (const Stage s : stages_of(shot)) {
    std::string passes;
    for (const base::PassRow& pass : plan_of(shot, s).passes) passes += (passes.empty() ? "" : " ") + std::string(pass.name);
    std::printf("%-10s%s\n", std::string(stage_name(s)).c_str(), passes.c_str());
  }
}

void print_prediction(const Prediction& p, const Pilot& pilot) {
  std::string stages;
  for (const auto& [stage, seconds] : p.cpu) stages += ", " + stage + " " + base::duration_text(seconds / p.frames);
  std::printf("\n%-10s%s for %.0f frame%s; a frame: %s\n", "CPU", base::duration_text(p.cpu_seconds()).c_str(), p.frames, p.frames == 1 ? "" : "s",
              stages.substr(std::min<std::size_t>(2, stages.size())).c_str());
  std::printf("%-10s%s\n", "memory", bytes_text(p.peak_bytes).c_str());
  std::string kinds;
  for (const auto& [kind, bytes] : p.disk) kinds += (kinds.empty() ? "" : ", ") + kind + " " + bytes_text(bytes);
  std::printf("%-10s%s: %s\n", "disk", bytes_text(p.disk_bytes()).c_str(), kinds.c_str());
  const std::string errors = error_text(past_outcomes());
  std::printf("measured on this machine in %s; %s\n", base::duration_text(pilot.seconds).c_str(),
              errors.empty() ? "no finished run tells yet how good that is" : ("earlier predictions were off by " + errors).c_str());
}

Json prediction_json(const Prediction& p) {
  Json seconds = Json::object();
  for (const Stage stage : {Stage::simulate, Stage::surface, Stage::render})
    if (const auto found = p.cpu.find(std::string(stage_name(stage))); found != p.cpu.end()) seconds[found->first] = found->second / p.frames;
  return {{"seconds", seconds}, {"peak_bytes", std::llround(p.peak_bytes)}, {"disk_bytes", std::llround(p.disk_bytes())}};
}

void refuse_to_draw_over_the_shot(const std::filesystem::path& graph, const Shot& shot) {
  refuse_to_write_over({shot.file}, "--graph", graph, "is the shot itself");
  refuse_to_write_over(named_files(shot), "--graph", graph, "is a file that the shot names");
}

std::optional<Pilot> measured_pilot(const Shot& shot, const Request& request, const FrameRange& range, int threads) {
  catch_signals();
  base::Progress progress(stderr, request.quiet || request.json);
  progress.line("measuring small runs of the shot on this machine ...");
  std::optional<Pilot> measured =
      measure_pilot("/proc/self/exe", shot, request.overrides, range.last, threads, [] { return has_lost_its_reader(STDOUT_FILENO); });
  if (measured) keep_pilot(shot, threads, *measured);
  return measured;
}

}  // namespace

void plan(const Request& request) {
  const Shot shot = read_shot(find_shot(request.subject), request.overrides);
  if (request.graph) refuse_to_draw_over_the_shot(*request.graph, shot);
  if (request.graph) base::write_text_atomically(*request.graph, pass_graph(shot));
  const sim::Size size = sim::size_of(shot.scene);
  const FrameRange range = request.frames.value_or(FrameRange{1, shot.frames});
  const int threads = request.threads.value_or(tbb::info::default_concurrency());
  const double memory = free_memory(), disk = free_disk(request.out.value_or(std::filesystem::path("out") / shot.name));
  if (!request.json) print_effects(shot), print_sizes(shot, size, range), std::fflush(stdout);

  const Stopwatch watch;
  std::optional<Pilot> pilot = cached_pilot(shot, range.last, threads);
  if (!pilot) {   // as a run does, which knows no more
    require_room(shot, least(shot, range), memory, disk);
    pilot = measured_pilot(shot, request, range, threads);
    if (has_lost_its_reader(STDOUT_FILENO)) return;
  }
  std::optional<Prediction> predicted;
  if (pilot) predicted = predict(shot, *pilot, range);
  if (predicted && !request.json) print_prediction(*predicted, *pilot);
  if (!predicted && !request.json) std::printf("\nno prediction: %s\n", why_no_pilot(watch.seconds()).c_str());
  if (predicted) require_room(shot, *predicted, memory, disk);
  if (!request.json) return;
  Json out = {{"schema", 1}, {"shot", shot.name}};
  out.update(plan_json(shot));
  out["particles"] = std::llround(size.particles);
  if (!shot.scene.sources.empty()) out["particles_at_end"] = std::llround(particles_at(shot, range.last));
  out["cells"] = std::llround(size.cells);
  out["frames"] = {range.first, range.last};
  if (predicted) out["predicted"] = prediction_json(*predicted);
  std::fputs(document_text(out).c_str(), stdout);
}

}  // namespace app
