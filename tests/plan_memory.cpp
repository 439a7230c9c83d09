// What a particle costs in memory, counted on the heap, is what the plan says.
#include <gtest/gtest.h>
#include <malloc.h>
#include <tbb/global_control.h>

#include "sim/plan.h"
#include "sim/simulation.h"

namespace {

double heap_bytes() {
  const auto info = mallinfo2();
  return double(info.uordblks + info.hblkhd);
}

sim::Scene column(bool solid, sim::Transfer transfer, sim::Kernel kernel = sim::Kernel::quadratic) {
  sim::Scene scene;
  sim::Options& o = scene.options;
  o.domain = {base::Vec3(0, 0, 0), base::Vec3(0.8, 0.8, 0.8)};
  o.cell = 0.05;
  o.transfer = transfer;
  o.kernel = kernel;
  if (solid) {
    o.solver = "solid";
    o.carry = sim::Carry::hybrid;
    o.cfl = 0.4;
    for (auto& sides : o.boundary) sides = {sim::Side::separating, sim::Side::separating};
  }
  sim::Body body;
  body.name = "column";
  body.shape.box = base::Box{base::Vec3(0, 0, 0), base::Vec3(0.45, 0.75, 0.35)};
  body.is_solid = solid;
  scene.bodies.push_back(body);
  scene.effects.push_back({});
  return scene;
}

/// Heap that a simulation holds after its first frame, and how many particles it has.
std::pair<double, double> held(sim::Scene scene, std::int64_t particles_per_cell) {
  scene.options.particles_per_cell = particles_per_cell;
  const double before = heap_bytes();
  const auto simulation = sim::make_simulation(scene, 24);
  base::Ledger ledger(sim::plan_of(scene));
  simulation->advance(ledger, {});
  return {heap_bytes() - before, double(simulation->frame().id.size())};
}

/// Of two simulations that differ in the number of particles only: the grid is the same.
void expect_planned(const sim::Scene& scene) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  held(scene, 8);   // what is allocated once and for all
  const auto [few_bytes, few] = held(scene, 8);
  const auto [many_bytes, many] = held(scene, 64);
  ASSERT_GT(many, 4 * few);
  const double planned = double(sim::plan_of(scene).bytes_per_particle());
  EXPECT_NEAR((many_bytes - few_bytes) / (many - few), planned, 0.05 * planned);
}

}  // namespace

TEST(PlanMemory, OfALiquidsParticleIsPlanned) {
  for (const auto transfer : {sim::Transfer::pic, sim::Transfer::flip, sim::Transfer::apic, sim::Transfer::polypic})
    for (const auto kernel : {sim::Kernel::linear, sim::Kernel::quadratic}) {
      SCOPED_TRACE(std::to_string(int(transfer)) + " " + std::to_string(int(kernel)));
      expect_planned(column(false, transfer, kernel));
    }
}

TEST(PlanMemory, OfASolidsParticleIsPlanned) {
  for (const auto transfer : {sim::Transfer::pic, sim::Transfer::flip, sim::Transfer::apic, sim::Transfer::polypic}) {
    SCOPED_TRACE(int(transfer));
    expect_planned(column(true, transfer));
  }
}

TEST(PlanMemory, OfACarryThatLimitsADoubleAndAReflectionIsPlanned) {
  sim::Scene limited = column(false, sim::Transfer::polypic), reflected = limited, exact = limited;
  limited.options.carry = sim::Carry::limited;
  expect_planned(limited);
  reflected.options.splitting = sim::Splitting::reflection;
  expect_planned(reflected);
  exact.options.precision = sim::Precision::double_precision;
  expect_planned(exact);
}
