#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/stages/document.h"
#include "app/stages/interrupt.h"
#include "base/error.h"

namespace app {
namespace {

std::vector<Stage> stages_of(const Request& request, const Shot& shot) {
  const bool is_flat = shot.scene.options.dimension == 2;
  if (request.command == "surface" && is_flat)
    throw base::Error({.file = shot.file.string(), .key = "sim.dimension", .value = "2", .hint = "polypic render draws the points",
                       .message = "has no surface"});
  if (request.command == "simulate") return {Stage::simulate};
  if (request.command == "surface") return {Stage::surface};
  if (request.command == "render") return {request.preview ? Stage::preview : Stage::render};
  if (is_flat && request.preview) return {Stage::simulate, Stage::preview, Stage::render};
  if (is_flat) return {Stage::simulate, Stage::render};
  if (request.preview) return {Stage::simulate, Stage::preview, Stage::surface, Stage::render};
  return {Stage::simulate, Stage::surface, Stage::render};
}

}  // namespace

void film(const Request& request) {
  const Shot shot = read_shot(find_shot(request.subject), request.overrides);
  const Order order{.stages = stages_of(request, shot),
                    .frames = request.frames,
                    .out = request.out.value_or(std::filesystem::path("out") / shot.name),
                    .restart = request.restart,
                    .threads = request.threads.value_or(tbb::info::default_concurrency())};
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(order.threads));
  catch_signals();
  surface::initialize();
  base::Progress progress(request.json ? stderr : stdout, request.quiet);
  const nlohmann::ordered_json run = make_film(shot, order, progress);
  if (request.json) std::fputs(document_text(run).c_str(), stdout);
}

}  // namespace app
