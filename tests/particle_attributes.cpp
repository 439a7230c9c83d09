// What particles carry for pictures and for other programs: pressure, strain, energy of modes.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/simulation.h"

namespace {

using base::Vec3;

sim::Scene tank(std::int64_t dimension) {
  sim::Scene scene;
  scene.options.dimension = dimension;
  scene.options.domain = {Vec3::Zero(), dimension == 2 ? Vec3(0.4, 0.4, 0) : Vec3(0.4, 0.2, 0.4)};
  scene.options.cell = 0.025;
  scene.options.particles_per_cell = dimension == 2 ? 4 : 8;
  scene.options.seeding = sim::Seeding::regular;
  scene.options.write.pressure = true;
  sim::Body water;
  water.name = "water";
  water.shape.box = dimension == 2 ? base::Box{Vec3::Zero(), Vec3(0.4, 0.2, 0)} : base::Box{Vec3::Zero(), Vec3(0.4, 0.2, 0.2)};
  scene.bodies = {water};
  scene.effects = {sim::Effect{.acceleration = dimension == 2 ? Vec3(0, -9.81, 0) : Vec3(0, 0, -9.81)}};
  return scene;
}

sim::Scene spinning_block() {
  sim::Scene scene;
  sim::Options& o = scene.options;
  o.solver = "solid", o.kernel = sim::Kernel::quadratic, o.carry = sim::Carry::hybrid, o.cfl = 0.4;
  for (auto& sides : o.boundary) sides = {sim::Side::separating, sim::Side::separating};
  o.domain = {Vec3::Zero(), Vec3(1, 1, 1)};
  o.cell = 0.0625;
  o.write = {.pressure = true, .strain = true, .mode_energy = true};
  sim::Body block;
  block.name = "block";
  block.is_solid = true;
  block.shape.box = base::Box{Vec3(0.25, 0.25, 0.25), Vec3(0.75, 0.75, 0.75)};
  block.spin = Vec3(0, 0, 3);
  scene.bodies = {block};
  return scene;
}

}  // namespace

// Half a cell at the floor, where nobody below can be asked, and at the surface, where air begins.
TEST(ParticleAttributes, PressureInStillWaterIsThatOfTheWaterAbove) {
  using enum sim::Splitting;
  for (const auto& [dimension, splitting] : {std::pair{2, lie}, {2, reflection}, {3, lie}, {3, reflection}}) {
    sim::Scene scene = tank(dimension);
    scene.options.splitting = splitting;
    const auto simulation = sim::make_simulation(scene, 24);
    for (const float p : simulation->frame().pressure) ASSERT_EQ(p, 0);
    base::Ledger ledger;
    for (int frame = 0; frame < 3; ++frame) simulation->advance(ledger, {});
    const sim::Frame frame = simulation->frame();
    ASSERT_EQ(frame.pressure.size(), frame.position.size());
    const double slope = 1000 * 9.81, allowed = 0.6 * slope * scene.options.cell;
    double deepest = 0;
    for (std::size_t i = 0; i < frame.position.size(); ++i) {
      const double depth = 0.2 - double(frame.position[i][int(dimension) - 1]);
      ASSERT_NEAR(frame.pressure[i], slope * depth, allowed) << "depth " << depth;
      deepest = std::max(deepest, double(frame.pressure[i]));
    }
    EXPECT_GT(deepest, 0.85 * slope * 0.2);
  }
}

TEST(ParticleAttributes, KineticEnergyIsThatOfTheVelocitiesAndOfTheModes) {
  sim::Scene liquid = tank(3);
  liquid.options.write.mode_energy = true;
  liquid.bodies.front().shape.box = base::Box{Vec3::Zero(), Vec3(0.2, 0.2, 0.3)};
  for (const sim::Scene& scene : {liquid, spinning_block()}) {
    const auto simulation = sim::make_simulation(scene, 24);
    base::Ledger ledger;
    for (int frame = 0; frame < 4; ++frame) simulation->advance(ledger, {});
    const sim::Frame frame = simulation->frame();
    const sim::Totals totals = simulation->totals();
    ASSERT_EQ(frame.mode_energy.size(), frame.velocity.size());
    double moving = 0, modes = 0;
    for (std::size_t i = 0; i < frame.velocity.size(); ++i)
      moving += 0.5 * frame.velocity[i].cast<double>().squaredNorm(), modes += double(frame.mode_energy[i]);
    const double mass = totals.mass / double(totals.particles);
    EXPECT_GT(mass * modes, 1e-4 * totals.kinetic_energy);
    EXPECT_NEAR(mass * (moving + modes), totals.kinetic_energy, 1e-5 * totals.kinetic_energy);
  }
}

// Integrated over a body that moves freely, minus the trace of stress is minus twice the kinetic energy but for what makes it pulsate.
TEST(ParticleAttributes, ASpinningBodyIsPulledAndStrained) {
  const auto simulation = sim::make_simulation(spinning_block(), 24);
  for (const float s : simulation->frame().strain) ASSERT_NEAR(s, 0, 1e-6);
  base::Ledger ledger;
  double mean = 0, expected = 0, strained = 0;
  constexpr int kFrames = 24;
  for (int n = 0; n < kFrames; ++n) {
    simulation->advance(ledger, {});
    const sim::Frame frame = simulation->frame();
    const sim::Totals totals = simulation->totals();
    double sum = 0;
    for (const float p : frame.pressure) sum += double(p);
    for (const float s : frame.strain) strained = std::max(strained, double(s));
    mean += sum / double(frame.pressure.size()) / kFrames;
    expected -= 2 * totals.kinetic_energy / (3 * totals.volume) / kFrames;
  }
  EXPECT_LT(expected, -10);
  EXPECT_NEAR(mean, expected, 0.3 * std::abs(expected));
  EXPECT_GT(strained, 1e-3);
}

TEST(ParticleAttributes, AreTheSameAfterARestart) {
  for (const sim::Scene& scene : {tank(2), spinning_block()}) {
    const auto first = sim::make_simulation(scene, 24), second = sim::make_simulation(scene, 24);
    base::Ledger ledger;
    for (int frame = 0; frame < 2; ++frame) first->advance(ledger, {});
    second->restore(first->state());
    EXPECT_EQ(first->frame().pressure, second->frame().pressure);
    EXPECT_EQ(first->frame().strain, second->frame().strain);
    EXPECT_EQ(first->frame().mode_energy, second->frame().mode_energy);
    EXPECT_FALSE(first->frame().pressure.empty());
  }
}

TEST(ParticleAttributes, AreNotThereUnlessAskedFor) {
  sim::Scene scene = tank(2);
  scene.options.write = {};
  const sim::Frame frame = sim::make_simulation(scene, 24)->frame();
  EXPECT_TRUE(frame.pressure.empty() && frame.strain.empty() && frame.mode_energy.empty());
}
