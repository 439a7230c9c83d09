// Laws of the step as a whole: what is conserved, what is exact, and the cases that break a material point method that is careless.
#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "base/error.h"
#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

/// Scene of one particle whose coefficients have the given velocity gradient at first.
Scene lone_particle(double edge, double cell) {
  Scene scene = open_scene(3, edge, cell);
  scene.options.particles_per_cell = 1;
  scene.options.seeding = Seeding::regular;
  return scene;
}

}  // namespace

// What falls freely does so exactly: g and no force of its own.
TEST(SolidStep, ABodyInFreeFallKeepsItsShapeAndFallsAsGalileoSays) {
  Scene scene = open_scene(2, 2, 0.05);
  scene.bodies = {block({0.5, 0.5, 0}, {0.9, 0.8, 0}, kJelly)};
  scene.bodies[0].velocity = {1, 0, 0};
  scene.effects = {{"gravity", {0, -2, 0}}};
  const auto simulation = make_simulation(scene, 10);
  const auto totals = run(*simulation, 3);
  ASSERT_GT(totals[3].substeps, 20);
  EXPECT_NEAR(totals[3].linear_momentum.x(), totals[0].mass, 1e-11 * totals[0].mass);
  EXPECT_NEAR(totals[3].linear_momentum.y(), -2 * 0.3 * totals[0].mass, 1e-11 * totals[0].mass);
  EXPECT_LT(*totals[3].elastic_energy, 1e-16 * kJelly.young);
}

// Moved over a thousand cells, in single precision too: no stress comes of it.
TEST(SolidStep, TranslationOverAThousandCellsMakesNoStress) {
  Scene scene = open_scene(2, 64, 0.05);
  scene.options.domain.upper = base::Vec3(64, 1, 0);
  scene.bodies = {block({1, 0.3, 0}, {1.3, 0.6, 0}, kJelly)};
  scene.bodies[0].velocity = {50, 0, 0};
  const auto simulation = make_simulation(scene, 1);
  const base::Vec3 before = mean_position(simulation->frame());
  const auto totals = run(*simulation, 1);
  EXPECT_NEAR((mean_position(simulation->frame()) - before).x(), 50, 1e-4);
  // Energy density of a stress s is s^2 / 2E: s <= 1e-12 E.
  EXPECT_LT(*totals[1].elastic_energy / totals[1].volume, 0.5e-24 * kJelly.young);
}

// A lone particle, stretched at first by 0.6 to 1.5: for ten thousand steps its energy stays where it was, without a trend.
TEST(SolidStep, ALoneParticleNeitherGainsEnergyNorDrifts) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 3; ++n) {
    Scene scene = lone_particle(1, 0.1);
    set_transfer(scene.options, n == 0 ? "apic" : "polypic");
    scene.bodies = {ball({0.45, 0.45, 0.45}, 0.06, kJelly)};
    scene.bodies[0].velocity = {0.3 * u(rng), 0.3 * u(rng), 0.3 * u(rng)};
    const auto simulation = make_simulation(scene, 8);
    State state = simulation->state();
    for (Column& c : state.columns) {
      if (c.name == "limits") {   // a short first step, until the speed of sound is that of this state
        const double fast = 50;
        std::memcpy(c.bytes.data(), &fast, sizeof fast);
      }
      if (c.name == "deformation") {
        std::vector<double> d(10);
        std::memcpy(d.data(), c.bytes.data(), sizeof(double) * 10);
        d[0] = 0.5, d[4] = -0.4, d[8] = 0.2, d[1] = 0.2 * u(rng);
        std::memcpy(c.bytes.data(), d.data(), sizeof(double) * 10);
      }
    }
    simulation->restore(state);
    ASSERT_EQ(simulation->totals().particles, 1);
    const double start = energy(simulation->totals());
    base::Ledger ledger;
    double first = 0, last = 0;
    std::int64_t steps = 0;
    for (int f = 0; f < 140; ++f) {
      simulation->advance(ledger, {});
      const Totals now = simulation->totals();
      steps += now.substeps;
      const double e = energy(now) / start;
      if (f < 35) first = std::max(first, e);
      if (f >= 105) last = std::max(last, e);
      ASSERT_TRUE(std::isfinite(e));
    }
    EXPECT_GT(steps, 10000);
    EXPECT_LT(first, 1 + 2.6 * 0.2);
    EXPECT_LE(last, 1.02 * first);
  }
}

// Two balls of different stiffness and density meet: momentum is kept to rounding, and they part.
TEST(SolidStep, CollidingBodiesKeepMomentum) {
  for (const char* transfer : {"apic", "polypic", "flip", "flip and apic"}) {
    Scene scene = open_scene(2, 3, 0.025);
    const bool flips = std::string(transfer).starts_with("flip");
    set_transfer(scene.options, flips ? "apic" : transfer);
    Material heavy = kJelly;
    heavy.density = 3000, heavy.young = 4e5;
    scene.bodies = {ball({1.3, 1.5, 0}, 0.1, kJelly), ball({1.7, 1.52, 0}, 0.1, heavy)};
    scene.bodies[0].velocity = {2, 0, 0}, scene.bodies[1].velocity = {-2, 0, 0};
    scene.bodies[1].name = "other";
    if (flips) scene.bodies[0].transfer = "flip";
    if (flips && std::string(transfer) == "flip") scene.bodies[1].transfer = "flip";
    const auto simulation = make_simulation(scene, 20);
    const auto totals = run(*simulation, 6);
    const double scale = totals[0].mass * 2;
    EXPECT_LT((totals[6].linear_momentum - totals[0].linear_momentum).norm(), 1e-12 * scale) << transfer;
    if (flips) continue;   // keeps no angular momentum, and what it has too much is noise
    EXPECT_LT((totals[6].angular_momentum - totals[0].angular_momentum).norm(), 1e-11 * scale) << transfer;
    EXPECT_LT(energy(totals[6]), 1.001 * energy(totals[0])) << transfer;
    EXPECT_LT(totals[6].kinetic_energy, 0.99 * totals[0].kinetic_energy) << transfer;   // they did meet
  }
}

// Faster than sound in the material: steps get shorter, nothing is gained, and what was pressed to a hundredth of its volume comes back.
TEST(SolidStep, AnImpactFasterThanSoundGainsNoEnergy) {
  Scene scene = open_scene(2, 2, 0.05);
  Material soft = kJelly;
  soft.young = 1e3;   // sound at 1.2 m/s
  scene.bodies = {block({0.4, 0.8, 0}, {0.8, 1.2, 0}, soft), block({1.0, 0.8, 0}, {1.4, 1.2, 0}, soft)};
  scene.bodies[0].velocity = {3, 0, 0}, scene.bodies[1].velocity = {-3, 0, 0};
  scene.bodies[1].name = "other";
  const auto simulation = make_simulation(scene, 50);
  const auto totals = run(*simulation, 12);
  double largest = 0;
  std::int64_t by_motion = 0;
  for (const Totals& t : totals) largest = std::max(largest, energy(t)), by_motion += t.steps_by_motion + t.steps_by_loose;
  EXPECT_LT(largest, 1.02 * energy(totals[0]));
  EXPECT_GT(by_motion, 0);
  EXPECT_LT(totals[12].kinetic_energy, 0.9 * totals[0].kinetic_energy);
  double least = 1;
  for (const Totals& t : totals) least = std::min(least, t.least_volume.value_or(1));
  EXPECT_LT(least, 0.1);
  EXPECT_GT(totals[12].most_volume.value_or(0), 0.5);
}

// Crushed flat and let go: it comes back, whatever its law.
TEST(SolidStep, ACrushedCubeRecovers) {
  for (const Elasticity law : {Elasticity::fixed_corotated, Elasticity::neo_hookean, Elasticity::hencky}) {
    Scene scene = open_scene(3, 1, 0.1);
    Material material = kJelly;
    material.model = law;
    scene.bodies = {block({0.3, 0.3, 0.3}, {0.6, 0.6, 0.6}, material)};
    set_transfer(scene.options, "apic");
    const auto simulation = make_simulation(scene, 100);
    State state = simulation->state();
    for (Column& c : state.columns) {
      if (c.name == "limits") {   // a short first step, until the speed of sound is that of this state
        const double fast = 200;
        std::memcpy(c.bytes.data(), &fast, sizeof fast);
      }
      if (c.name == "deformation")
        for (std::int64_t row = 0; row < c.rows; ++row) {
          const double flat = law == Elasticity::hencky ? -0.4 : -0.7;   // Hencky's law softens where stretches pass e
          std::memcpy(c.bytes.data() + sizeof(double) * std::size_t(row * c.width), &flat, sizeof flat);
        }
    }
    simulation->restore(state);
    base::Ledger ledger;
    float widest = 0;
    for (int frame = 0; frame < 10; ++frame) {
      simulation->advance(ledger, {});
      ASSERT_TRUE(std::isfinite(energy(simulation->totals())));
      float low = 1e9f, high = -1e9f;
      for (const auto& x : simulation->frame().position) low = std::min(low, x.x()), high = std::max(high, x.x());
      widest = std::max(widest, high - low);
    }
    EXPECT_GT(widest, 0.36f);   // from 0.3: it grew along the axis it was crushed in
  }
}

// State out and in again is no restart; threads do not matter.
TEST(SolidStep, GoesOnToTheBitFromAStateAndOnAnyNumberOfThreads) {
  Scene scene = walled_scene(3, 0.5, 0.05);
  scene.options.precision = Precision::single_precision;
  scene.bodies = {ball({0.25, 0.25, 0.2}, 0.12, preset_material("snow")), block({0.1, 0.1, 0}, {0.4, 0.4, 0.06}, preset_material("dry_sand"))};
  scene.bodies[1].name = "floor";
  scene.bodies[1].transfer = "apic";
  scene.effects = {{"gravity", {0, 0, -9.81}}};
  const auto straight = make_simulation(scene, 50);
  run(*straight, 4);
  const auto first = make_simulation(scene, 50);
  run(*first, 2);
  const auto second = make_simulation(scene, 50);
  second->restore(first->state());
  run(*second, 2);
  EXPECT_EQ(straight->totals().state_hash, second->totals().state_hash);
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto again = make_simulation(scene, 50);
    run(*again, 4);
    EXPECT_EQ(straight->totals().state_hash, again->totals().state_hash) << threads;
  }
}

// A scene moved by half of a periodic domain, so that bodies lie across its side, is the same scene.
TEST(SolidStep, OfBodiesAcrossAPeriodicSideNothingChanges) {
  for (const int dimension : {2, 3})
    for (const char* transfer : {"polypic", "flip"}) {
      std::vector<Totals> ends, starts;
      for (const double shift : {0.5, 0.0}) {
        Scene scene = walled_scene(dimension, 1, 0.05);
        Options& o = scene.options;
        o.seeding = Seeding::regular;
        o.boundary[0] = {Side::periodic, Side::periodic};
        o.domain.upper = dimension == 2 ? base::Vec3(1, 0.4, 0) : base::Vec3(1, 0.4, 0.4);
        set_transfer(o, transfer);
        Material jelly = kJelly;
        jelly.volume_averaging = true;
        scene.bodies = {ball({0.01 + shift, 0.2, dimension == 2 ? 0 : 0.2}, 0.12, jelly)};
        scene.bodies[0].velocity = {0.3, -1, 0};
        scene.bodies[0].spin = {0, 0, 4};
        const auto simulation = make_simulation(scene, 25);
        const auto totals = run(*simulation, 4);
        starts.push_back(totals.front()), ends.push_back(totals.back());
      }
      EXPECT_NEAR(starts[1].kinetic_energy, starts[0].kinetic_energy, 1e-6 * starts[0].kinetic_energy) << dimension << transfer;
      EXPECT_NEAR(ends[1].kinetic_energy, ends[0].kinetic_energy, 1e-4 * ends[0].kinetic_energy) << dimension << transfer;
      EXPECT_NEAR(*ends[1].elastic_energy, *ends[0].elastic_energy, 1e-4 * *ends[0].elastic_energy) << dimension << transfer;
      EXPECT_GT(*ends[0].elastic_energy, 0.05 * ends[0].kinetic_energy);   // it has met the floor
    }
}

TEST(SolidStep, GoesOnToTheBitWithTheWorkOfGravity) {
  Scene scene = open_scene(2, 1, 0.05);
  scene.options.precision = Precision::single_precision;
  scene.bodies = {ball({0.5, 0.5, 0}, 0.2, kJelly)};
  scene.bodies[0].velocity = {1, 0.3, 0};
  scene.effects = {{"gravity", {1, 0, 0}}};
  const auto straight = make_simulation(scene, 50);
  run(*straight, 2);
  const auto again = make_simulation(scene, 50);
  again->restore(straight->state());
  EXPECT_EQ(run(*straight, 1).back().gravity_work, run(*again, 1).back().gravity_work);   // to the bit
  EXPECT_NE(again->totals().gravity_work, 0);
}

// On a slope without ends a block that the ground holds falls no further than it shears.
TEST(SolidStep, GravityWorksByTheWayThatContactLeaves) {
  Scene scene = walled_scene(2, 1, 0.05);
  scene.options.boundary[0] = {Side::periodic, Side::periodic};
  scene.options.boundary[1] = {Side::sticky, Side::sticky};
  scene.options.seeding = Seeding::regular;
  scene.bodies = {block({0.3, 0, 0}, {0.7, 0.2, 0}, kJelly)};
  scene.effects = {{"gravity", {3, -9.81, 0}}};
  const auto simulation = make_simulation(scene, 50);
  const double start = mean_position(simulation->frame()).x();
  double work = 0;
  for (const Totals& t : run(*simulation, 25)) work += t.gravity_work;
  const double way = mean_position(simulation->frame()).x() - start, of_the_way = simulation->totals().mass * 3 * way;
  EXPECT_GT(way, 1e-4);
  EXPECT_NEAR(work, of_the_way, 0.15 * of_the_way);   // it swings: half a step's momentum is still to move it
}

TEST(SolidStep, AMaterialTooStiffForItsFramesIsRefusedWithItsCause) {
  Scene scene = open_scene(2, 1, 0.05);
  Material hard = kJelly;
  hard.young = 1e20;
  scene.bodies = {ball({0.5, 0.5, 0}, 0.2, hard)};
  const auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  try {
    simulation->advance(ledger, {});
    FAIL() << "it went on";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::unstable);
    EXPECT_NE(e.complaint().message.find("sound"), std::string::npos) << e.complaint().message;
  }
}
