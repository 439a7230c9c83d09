#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/plan/plan.h"
#include "sim/size.h"

namespace app {
namespace {

// Effects by stage; those that are off in one line at the end.
void print_table(const Shot& shot) {
  const std::vector<ExplainedEffect> effects = explained_effects(shot);
  std::size_t name = 0, key = 0;
  for (const ExplainedEffect& e : effects)
    if (e.on) name = std::max(name, e.name.size()), key = std::max(key, e.key.size());
  std::string stage, off;
  for (const ExplainedEffect& e : effects) {
    if (!e.on) {
      off += (off.empty() ? "" : ", ") + e.name;
      continue;
    }
    std::printf("%-9s %-*s  %-*s  %s\n", e.stage == stage ? "" : e.stage.c_str(), int(name), e.name.c_str(), int(key), e.key.c_str(), e.value.c_str());
    stage = e.stage;
  }
  std::printf("off: %s\n\n", off.c_str());

  const base::Plan sim = plan_of(shot, Stage::simulate);
  std::string attributes;
  for (const base::Attribute& a : sim.attributes) attributes += (attributes.empty() ? "" : ", ") + a.name + " " + std::to_string(a.bytes);
  std::printf("a particle holds %lld B: %s\n", static_cast<long long>(sim.bytes_per_particle()), attributes.c_str());
  for (const Stage s : stages_of(shot)) {
    std::string passes;
    for (const base::PassRow& pass : plan_of(shot, s).passes) passes += (passes.empty() ? "" : ", ") + std::string(pass.name);
    std::printf("%-9s %s\n", std::string(stage_name(s)).c_str(), passes.c_str());
  }
}

}  // namespace

void plan(const Request& request) {
  const Shot shot = read_shot(find_shot(request.subject), request.overrides);
  const sim::Size size = sim::size_of(shot.scene);
  if (!request.json) {
    print_table(shot);
    std::printf("%.0f particles, %.0f cells\n", size.particles, size.cells);
    return;
  }
  nlohmann::ordered_json out = {{"schema", 1}, {"shot", shot.name}};
  out.update(plan_json(shot));
  out["particles"] = std::llround(size.particles);
  out["cells"] = std::llround(size.cells);
  std::printf("%s\n", out.dump(2).c_str());
}

}  // namespace app
