// Two frames of a small column of water on one thread, for step_instructions.py to count.
#include <tbb/global_control.h>

#include <cstdio>

#include "sim/plan.h"
#include "sim/simulation.h"

int main() {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  sim::Scene scene;
  scene.options.domain = {base::Vec3(0, 0, 0), base::Vec3(0.8, 0.4, 0.4)};
  scene.options.cell = 0.025;
  sim::Body body;
  body.name = "water";
  body.shape.box = base::Box{base::Vec3(0, 0, 0), base::Vec3(0.4, 0.4, 0.2)};
  scene.bodies.push_back(body);
  scene.effects.push_back({});
  const auto simulation = sim::make_simulation(scene, 24);
  base::Ledger ledger(sim::plan_of(scene));
  for (int frame = 0; frame < 2; ++frame) simulation->advance(ledger, {});
  const sim::Totals totals = simulation->totals();
  std::printf("%lld particles, %lld steps in the last frame, %016llx\n", static_cast<long long>(totals.particles),
              static_cast<long long>(totals.substeps), static_cast<unsigned long long>(totals.state_hash));
}
