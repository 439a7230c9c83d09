// Open sides of the domain and colliders that move: what goes out, what is pushed, and what an observer who moves along sees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"
#include "sim/simulation.h"
#include "tests/threads.h"

namespace sim {
namespace {

using base::Vec3;

Effect gravity(int dimension) { return {.acceleration = dimension == 2 ? Vec3(0, -9.81, 0) : Vec3(0, 0, -9.81)}; }

/// A channel along x, 1 m long and 0.4 m high (and wide), with liquid between two places.
Scene channel(int dimension, double cell, double from, double to) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = dimension;
  o.domain = {Vec3::Zero(), dimension == 2 ? Vec3(1, 0.4, 0) : Vec3(1, 0.4, 0.4)};
  o.cell = cell;
  o.particles_per_cell = dimension == 2 ? 4 : 8;
  o.precision = Precision::double_precision;
  Body water;
  water.name = "water";
  water.shape.box = base::Box{Vec3(from, 0, 0), Vec3(to, 0.4, dimension == 2 ? 0 : 0.4)};
  scene.bodies = {water};
  return scene;
}

/// Two dimensions: a domain from 0 to `size`, and water in a box.
Scene flat(const Vec3& size, double cell, const base::Box& filled) {
  Scene scene;
  scene.options.dimension = 2;
  scene.options.particles_per_cell = 4;
  scene.options.domain = {Vec3::Zero(), size};
  scene.options.cell = cell;
  Body water;
  water.name = "water";
  water.shape.box = filled;
  scene.bodies = {water};
  return scene;
}

Collider box(const Vec3& lower, const Vec3& upper, const Vec3& velocity) {
  Collider c;
  c.name = "box";
  c.shape.box = base::Box{lower, upper};
  c.velocity = velocity;
  return c;
}

// The piston moves the whole plug; no pressure, no other motion. What is beyond the open side is gone, to the particle.
TEST(FluidSides, APistonPushesAPlugOutOfAnOpenSide) {
  for (const int dimension : {2, 3})
    for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
      Scene scene = channel(dimension, 0.05, 0.1, 1);
      scene.options.boundary[0][1] = Side::open;
      scene.options.splitting = splitting;
      scene.options.seeding = Seeding::regular;
      scene.options.volume_correction = 0;
      const Vec3 speed(0.5, 0, 0);
      scene.bodies[0].velocity = speed;
      scene.colliders = {box(Vec3(0, 0, 0), Vec3(0.1, 0.4, dimension == 2 ? 0 : 0.4), speed)};
      const auto simulation = make_simulation(scene, 10);
      const Totals start = simulation->totals();
      base::Ledger ledger;
      std::int64_t left = 0;
      for (int f = 0; f < 5; ++f) simulation->advance(ledger, {}), left += simulation->totals().left;
      const Totals t = simulation->totals();
      EXPECT_EQ(t.particles + left, start.particles);
      // A quarter of a metre has gone: five columns of cells.
      EXPECT_EQ(left, start.particles / 18 * 5) << dimension;
      const Frame frame = simulation->frame();
      ASSERT_EQ(std::int64_t(frame.id.size()), t.particles);
      EXPECT_TRUE(std::is_sorted(frame.id.begin(), frame.id.end()));
      for (std::size_t p = 0; p < frame.id.size(); ++p) {
        ASSERT_NEAR((frame.velocity[p].cast<double>() - speed).norm(), 0, 2e-6);
        ASSERT_GE(frame.position[p].x(), 0.35f);
      }
    }
}

// Seen from a ball that moves with the water around it nothing happens: cut faces let through what the ball pushes aside.
TEST(FluidSides, ABallThatMovesWithTheWaterChangesNothing) {
  for (const int dimension : {2, 3}) {
    Scene scene = channel(dimension, 0.05, 0, 1);
    for (int a = 0; a < dimension; ++a) scene.options.boundary[std::size_t(a)] = {Side::periodic, Side::periodic};
    scene.options.volume_correction = 0;
    scene.options.pressure_tolerance = 1e-10;
    const Vec3 speed = dimension == 2 ? Vec3(0.7, -0.3, 0) : Vec3(0.7, -0.3, 0.2);
    scene.bodies[0].velocity = speed;
    Collider ball;
    ball.name = "ball";
    ball.shape.sphere = Shape::Sphere{dimension == 2 ? Vec3(0.31, 0.17, 0) : Vec3(0.31, 0.17, 0.21), 0.11};
    ball.velocity = speed;
    scene.colliders = {ball};
    const auto simulation = make_simulation(scene, 10);
    base::Ledger ledger;
    for (int f = 0; f < 20; ++f) simulation->advance(ledger, {});   // 1.4 m: around the side
    ASSERT_GT(simulation->totals().particles, 500);
    double most = 0;
    for (const base::Vec3f& v : simulation->frame().velocity) most = std::max(most, (v.cast<double>() - speed).norm());
    EXPECT_LE(most, 1e-5) << dimension;
  }
}

// A particle in a box that moves: what it has towards the box beyond the box's own velocity is lost, all else stays.
TEST(FluidSides, WhatACollidersFaceMeetsGoesOnAsFastAsTheFace) {
  Scene scene = channel(2, 0.1, 0, 1);
  scene.colliders = {box(Vec3(0.3, 0, 0), Vec3(0.7, 0.4, 0), Vec3(0.5, 0, 0))};
  const Solids<2> solids(scene, Lattice<2>({10, 4}));
  struct Meeting {
    int cell;            // of the particle: the first or the last in the box
    double offset, before, after;
  };
  for (const auto& [cell, offset, before, after] : {Meeting{6, 0.9, 0, 0.5}, {6, 0.9, -1, 0.5}, {6, 0.9, 0.5, 0.5}, {6, 0.9, 0.8, 0.8},
                                                    {3, 0.1, 1, 0.5}, {3, 0.1, 0.4, 0.4}, {3, 0.1, -1, -1}}) {
    Moving<2, double> particle{{{cell, 2}, {offset, 0.5}}, {before, 0.3}};
    const double pushed = solids.push_out(particle);
    EXPECT_NEAR(pushed, 0.1, 0.002) << cell << ' ' << before;   // cells: to the face, and a hair
    EXPECT_EQ(particle.site.cell[0], cell == 6 ? 7 : 2);
    EXPECT_NEAR(particle.velocity[0], after, 1e-12) << cell << ' ' << before;
    EXPECT_EQ(particle.velocity[1], 0.3);
  }
}

// A plunger goes down into still water: the level rises by what it displaces, and no particle is in it.
TEST(FluidSides, APlungerRaisesTheLevelByWhatItDisplaces) {
  Scene scene = channel(2, 0.02, 0, 1);
  scene.bodies[0].shape.box->upper.y() = 0.2;
  scene.effects = {gravity(2)};
  scene.options.volume_correction = 0;
  scene.colliders = {box(Vec3(0.4, 0.24, 0), Vec3(0.6, 0.5, 0), Vec3(0, -0.06, 0))};   // 0.08 m into the water after 2 s
  const Shape now = shape_at(2, scene.colliders[0], scene.options);
  ASSERT_NEAR(now.box->lower.y(), 0.12, 1e-12);
  double raised = 0;   // the mean of three: one differs from another by a tenth
  for (const std::int64_t seed : {1, 2, 3}) {
    scene.options.seed = seed;
    const auto simulation = make_simulation(scene, 12);
    const double start = simulation->totals().potential_energy;
    base::Ledger ledger;
    for (int f = 0; f < 24; ++f) simulation->advance(ledger, {});
    for (const base::Vec3f& x : simulation->frame().position) ASSERT_GE(now.distance(x.cast<double>()), -1e-6);
    EXPECT_NEAR(simulation->totals().volume_drift.value(), 0, 0.02);   // of the cells that the plunger cuts the filling is not exact
    raised += (simulation->totals().potential_energy - start) / 3;
  }
  // Water displaced from 0.12 m up to the level 0.2 + r stands beside it: 0.2 (0.08 + r) = r.
  const double rise = 0.2 * 0.08 / 0.8, level = 0.2 + rise;
  const double lifted = 1000 * 9.81 * 0.5 * (level * level - 0.2 * (level * level - 0.12 * 0.12) - 0.2 * 0.2);
  EXPECT_NEAR(raised, lifted, 0.1 * lifted);
}

// Half full, the wall at x = 1 taken away: all of it runs out, and an empty scene goes on.
TEST(FluidSides, ATankWithoutAWallRunsEmpty) {
  Scene scene = channel(2, 0.05, 0, 1);
  scene.options.boundary[0] = {Side::open, Side::open};
  scene.options.boundary[1][0] = Side::open;   // nor a floor
  scene.bodies[0].shape.box->upper.y() = 0.2;
  scene.effects = {gravity(2)};
  for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
    scene.options.splitting = splitting;
    const auto simulation = make_simulation(scene, 24);
    base::Ledger ledger;
    double height = simulation->totals().potential_energy;
    for (int f = 0; f < 24; ++f) {
      simulation->advance(ledger, {});
      const Totals t = simulation->totals();
      EXPECT_LE(t.potential_energy, height);
      height = t.potential_energy;
    }
    const Totals t = simulation->totals();
    EXPECT_EQ(t.particles, 0);
    EXPECT_EQ(t.mass, 0);
    EXPECT_FALSE(t.volume_drift.has_value());
    EXPECT_EQ(simulation->frame().id.size(), 0u);
    simulation->restore(simulation->state());
  }
}

// Torricelli: water that runs out of the foot of a wide tank through a slot, under a head of H, is sqrt(2 g H) fast there.
TEST(FluidSides, WaterLeavesAnOpenSideAsFastAsItsHeadMakesIt) {
  Scene scene = channel(2, 0.0125, 0, 0.7);
  scene.options.domain.upper.x() = 0.75;
  scene.options.boundary[0][1] = Side::open;
  scene.bodies[0].shape.box->upper.y() = 0.3;
  scene.effects = {gravity(2)};
  scene.options.precision = Precision::single_precision;
  scene.colliders = {box(Vec3(0.7, 0.025, 0), Vec3(0.75, 0.4, 0), Vec3::Zero())};   // a wall with a slot of 2.5 cm at its foot
  const auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  for (int f = 0; f < 8; ++f) simulation->advance(ledger, {});
  const Totals before = simulation->totals();
  double left = 0;
  for (int f = 0; f < 8; ++f) simulation->advance(ledger, {}), left += double(simulation->totals().left);
  const double head = 0.5 * (before.volume + simulation->totals().volume) / 0.7, speed = std::sqrt(2 * 9.81 * head);
  const double flow = left * before.volume / double(before.particles) / (8 / 24.0) / 0.025;   // [m/s] through the slot
  // A slot whose floor and roof are walls as long as it is high contracts the jet by less than a sharp hole's 0.61.
  EXPECT_GT(flow, 0.61 * speed);
  EXPECT_LT(flow, 1.02 * speed);
}

// A box full of water that a piston enters: no pressure balances that. The rest is solved, and how much is missing is said.
TEST(FluidSides, OfAPistonInAFullBoxTheImbalanceIsReported) {
  Scene scene = channel(2, 0.05, 0, 1);
  scene.effects = {gravity(2)};
  const auto still = make_simulation(scene, 24);
  base::Ledger ledger;
  still->advance(ledger, {});
  EXPECT_LE(still->totals().imbalance.value(), 1e-12);
  EXPECT_LE(still->totals().max_speed, 1e-5);
  scene.colliders = {box(Vec3(0, 0, 0), Vec3(0.1, 0.4, 0), Vec3(0.2, 0, 0))};
  const auto pushed = make_simulation(scene, 24);
  pushed->advance(ledger, {});
  // Inflow of 0.2 m/s over 0.4 m into an area of 0.9 x 0.4.
  EXPECT_NEAR(pushed->totals().imbalance.value(), 0.2 / 0.9, 0.03 * 0.2 / 0.9);
  EXPECT_TRUE(std::isfinite(pushed->totals().kinetic_energy));
}

// A ball in a full box changes no volume, however near to the floor it is: the floor itself moves nothing.
TEST(FluidSides, ABallThatMovesBesideAWallPushesNothingThroughIt) {
  for (const double height : {0.12, 0.14, 0.2}) {
    Scene scene = channel(2, 0.02, 0, 1);
    Collider ball;
    ball.name = "ball";
    ball.shape.sphere = {Vec3(0.51, height, 0), 0.1};
    ball.velocity = Vec3(0, -0.5, 0);
    scene.colliders = {ball};
    const auto simulation = make_simulation(scene, 500);
    base::Ledger ledger;
    for (int f = 0; f < 3; ++f) {
      simulation->advance(ledger, {});
      EXPECT_LE(simulation->totals().imbalance.value(), 1e-12) << height << ", frame " << f;
    }
  }
}

// A piston that lies in its wall pushes from its first step on, before it covers any face but the wall's own.
TEST(FluidSides, APistonThatComesOutOfItsWallPushesAtOnce) {
  for (const int axis : {0, 1})
    for (const double side : {1.0, -1.0}) {
      std::vector<double> momentum;
      for (const double out : {0.0, 0.02}) {   // [m] of the domain that it takes up
        Scene scene = channel(2, 0.02, 0, 1);
        scene.options.domain = {Vec3::Zero(), Vec3(1, 1, 0)};
        scene.options.seeding = Seeding::regular;
        Vec3 lower(0, 0, 0), upper(1, 1, 0), in = lower, from = upper;
        const double front = side > 0 ? out : 1 - out;
        lower[axis] = side > 0 ? out : 0.5, upper[axis] = side > 0 ? 0.5 : 1 - out;
        in[axis] = side > 0 ? -0.6 : front, from[axis] = side > 0 ? front : 1.6;
        scene.bodies[0].shape.box = base::Box{lower, upper};
        scene.colliders = {box(in, from, 0.2 * side * Vec3::Unit(axis))};
        const auto simulation = make_simulation(scene, 100);
        base::Ledger ledger;
        for (int f = 0; f < 4; ++f) simulation->advance(ledger, {});
        momentum.push_back(side * simulation->totals().linear_momentum[axis]);
      }
      EXPECT_NEAR(momentum[0], momentum[1], 0.05 * momentum[1]) << "axis " << axis << ", side " << side;
      EXPECT_GT(momentum[1], 90) << "of 100";
    }
}

/// Water .6 m deep in two dimensions, and a collider in it.
Scene pool_with(const Shape& shape, const Vec3& velocity, std::int64_t seed) {
  Scene scene = flat(Vec3(1, 1, 0), 0.02, {Vec3::Zero(), Vec3(1, 0.6, 0)});
  scene.options.seed = seed;
  Collider body;
  body.name = "body";
  body.shape = shape;
  body.velocity = velocity;
  scene.colliders = {body};
  scene.effects = {gravity(2)};
  return scene;
}

// In its wake cells come free that no particle has reached: they are no air, and the water above keeps the momentum of what the ball displaces.
TEST(FluidSides, ABallThatSinksLeavesNoHoleBehind) {
  Shape ball;
  ball.sphere = {Vec3(0.5, 0.3, 0), 0.1};
  for (const std::int64_t seed : {0, 1, 2}) {
    const auto simulation = make_simulation(pool_with(ball, Vec3(0, -0.6, 0), seed), 100);
    base::Ledger ledger;
    const double displaced = M_PI * 0.01 * 1000 * 0.6;   // [kg m/s] of as much water, upwards
    for (int f = 2; f <= 14; ++f) {
      simulation->advance(ledger, {});
      EXPECT_NEAR(simulation->totals().linear_momentum.y(), displaced, 0.06 * displaced) << "seed " << seed << ", frame " << f;
    }
  }
}

// Of a box a whole row comes free in one step, or a slanting one.
TEST(FluidSides, ABoxThatSinksLeavesNoHoleBehind) {
  for (const double angle : {0.0, 10.0, 45.0})
    for (const std::int64_t seed : {0, 1, 2})
      for (const double fps : {50.0, 100.0}) {
        Shape box;
        box.box = base::Box{Vec3(0.427, 0.22, 0), Vec3(0.587, 0.38, 0)};
        box.turn_by(angle, Vec3::UnitZ());
        const auto simulation = make_simulation(pool_with(box, Vec3(0, -0.6, 0), seed), fps);
        base::Ledger ledger;
        std::vector<double> momentum;
        for (int f = 2; f <= 0.14 * fps; ++f) {
          simulation->advance(ledger, {});
          momentum.push_back(simulation->totals().linear_momentum.y());
        }
        const auto [least, most] = std::ranges::minmax(momentum);
        EXPECT_LT(most - least, 0.15 * most) << "at " << angle << " degrees, seed " << seed << ", " << fps << " frames a second";
      }
}

// What a collider pushes where another one covers it goes nowhere: a paddle that reaches into the floor does the work of one that ends on it.
TEST(FluidSides, WhatIsInsideAnotherColliderPushesNothing) {
  std::vector<double> work, energy;
  // The floor of the second and third lies a fiftieth of a cell below a plane of faces.
  for (const auto& [floor, lower] : {std::pair(0.1, 0.1), std::pair(0.099, 0.099), std::pair(0.099, 0.0)}) {
    Scene scene = flat(Vec3(2, 1, 0), 0.05, {Vec3::Zero(), Vec3(2, 0.5, 0)});
    scene.colliders = {box(Vec3::Zero(), Vec3(2, floor, 0), Vec3::Zero()), box(Vec3(0.32, lower, 0), Vec3(0.47, 0.9, 0), Vec3(0.5, 0, 0))};
    scene.effects = {gravity(2)};
    const auto simulation = make_simulation(scene, 24);
    base::Ledger ledger;
    double sum = 0;
    for (int f = 0; f < 10; ++f) simulation->advance(ledger, {}), sum += simulation->totals().collider_work;
    work.push_back(sum), energy.push_back(simulation->totals().kinetic_energy);
  }
  for (const std::size_t n : {1u, 2u}) {
    EXPECT_NEAR(work[n], work[0], 0.02 * work[0]) << n;
    EXPECT_NEAR(energy[n], energy[0], 0.05 * energy[0]) << n;
  }
}

// Wherever between the grid's faces a thin plate stands, and however thin it is.
TEST(FluidSides, AThinPlateHoldsWaterBack) {
  for (const auto& [from, to] : {std::pair(0.505, 0.545), std::pair(0.51, 0.53), std::pair(0.53, 0.545), std::pair(0.48, 0.52)})
    for (const int dimension : {2, 3}) {
      Scene scene;
      Options& o = scene.options;
      o.dimension = dimension;
      const double wide = dimension == 3 ? 0.2 : 0;
      o.domain = {Vec3::Zero(), dimension == 3 ? Vec3(1, wide, 1) : Vec3(1, 1, 0)};
      o.cell = 0.05;
      o.particles_per_cell = dimension == 3 ? 8 : 4;
      Body water;
      water.name = "water";
      water.shape.box = base::Box{Vec3::Zero(), dimension == 3 ? Vec3(from, wide, 0.5) : Vec3(from, 0.5, 0)};
      scene.bodies = {water};
      scene.colliders = {box(Vec3(from, 0, 0), dimension == 3 ? Vec3(to, wide, 1) : Vec3(to, 1, 0), Vec3::Zero())};
      scene.effects = {gravity(dimension)};
      const auto simulation = make_simulation(scene, 24);
      const double start = simulation->totals().potential_energy;
      base::Ledger ledger;
      for (int f = 0; f < 24; ++f) simulation->advance(ledger, {});
      EXPECT_NEAR(simulation->totals().potential_energy, start, 0.04 * start) << from << " to " << to << ", " << dimension << " dimensions";
      for (const base::Vec3f& x : simulation->frame().position) ASSERT_LT(double(x.x()), from + 1e-6) << "of a plate from " << from << " to " << to;
    }
}

/// [m] twice the height of the middle of what stands in a tank a metre wide, with a step in it, after half a second.
double depth_beside(const base::Box& step, bool is_periodic) {
  Scene scene = flat(Vec3(1, 0.8, 0), 0.05, {Vec3::Zero(), Vec3(1, 0.4, 0)});
  scene.options.seeding = Seeding::regular;
  if (is_periodic) scene.options.boundary[0] = {Side::periodic, Side::periodic};
  scene.colliders = {box(step.lower, step.upper, Vec3::Zero())};
  scene.effects = {gravity(2)};
  const auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  for (int f = 0; f < 12; ++f) simulation->advance(ledger, {});
  const Totals t = simulation->totals();
  return 2 * t.potential_energy / (t.mass * 9.81);
}

TEST(FluidSides, ABoxThatEndsInAPeriodicSideClosesIt) {
  for (const double from : {0.0, 0.4, 0.85}) EXPECT_NEAR(depth_beside({Vec3(from, 0, 0), Vec3(from + 0.15, 0.8, 0)}, true), 0.4, 1e-3) << from;
}

// A box typed with a few digits ends that much short of the grid's faces: it leaves no empty cells that pull.
TEST(FluidSides, ABoxThatEndsShortOfAPlaneOfFacesIsOneThatReachesIt) {
  const double whole = depth_beside({Vec3(0.4, 0, 0), Vec3(0.6, 0.1, 0)}, false);
  for (const double lacks : {5e-5, 2.5e-4, 4.5e-4})
    EXPECT_NEAR(depth_beside({Vec3(0.4 + lacks, 0, 0), Vec3(0.6 - lacks, 0.1 - lacks, 0)}, false), whole, 0.01 * whole) << lacks;
}

// Across a periodic side as in the middle of the domain.
TEST(FluidSides, AThinPlateBehindAPeriodicSideStopsWhatComesThroughIt) {
  std::vector<double> momentum;
  for (const double shift : {0.5, 0.0}) {
    Scene scene = flat(Vec3(1, 1, 0), 0.02, shift > 0 ? base::Box{Vec3(0.3, 0.4, 0), Vec3(0.48, 0.6, 0)} : base::Box{Vec3(0.8, 0.4, 0), Vec3(0.98, 0.6, 0)});
    scene.options.precision = Precision::double_precision;
    scene.options.seeding = Seeding::regular;
    scene.options.boundary[0] = {Side::periodic, Side::periodic};
    scene.bodies[0].velocity = Vec3(1, 0, 0);
    scene.colliders = {box(Vec3(0.002 + shift, 0, 0), Vec3(0.012 + shift, 1, 0), Vec3::Zero())};
    const auto simulation = make_simulation(scene, 50);
    base::Ledger ledger;
    for (int f = 0; f < 8; ++f) simulation->advance(ledger, {});
    momentum.push_back(simulation->totals().linear_momentum.x());
  }
  EXPECT_LT(momentum[0], 20);   // of 36: it stops there
  EXPECT_NEAR(momentum[1], momentum[0], 1e-3);
}

TEST(FluidSides, GoOnFromAStateToTheSameBitsOnAnyNumberOfThreads) {
  std::uint64_t hash[4];
  for (int i = 0; i < 4; ++i) {
    Scene scene = channel(3, 0.05, 0, 0.6);
    scene.options.boundary[0][1] = Side::open;
    scene.options.splitting = Splitting::reflection;
    scene.options.precision = Precision::single_precision;
    scene.effects = {gravity(3)};
    scene.colliders = {box(Vec3(0.7, 0, 0), Vec3(0.8, 0.2, 0.2), Vec3(-0.3, 0.1, 0))};
    hash[i] = on_threads(i == 3 ? 2 : 1 << i, [&] {
      auto simulation = make_simulation(scene, 24);
      base::Ledger ledger;
      for (int f = 0; f < 16; ++f) {
        simulation->advance(ledger, {});
        if (i != 3 || f != 9) continue;
        const State state = simulation->state();
        simulation = make_simulation(scene, 24);
        simulation->restore(state);
      }
      EXPECT_LT(simulation->totals().particles, 12 * 8 * 8 * 8);
      return simulation->totals().state_hash;
    });
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_EQ(hash[0], hash[2]);
  EXPECT_EQ(hash[0], hash[3]);
}

// Work of solids is no energy from nowhere: the watch lets a flow be stirred and still reflect.
TEST(FluidSides, AStirredTankStillReflects) {
  Scene scene = channel(2, 0.02, 0, 1);
  scene.options.splitting = Splitting::reflection;
  scene.bodies[0].shape.box->upper.y() = 0.2;
  scene.effects = {gravity(2)};
  scene.colliders = {box(Vec3(0.1, 0, 0), Vec3(0.2, 0.1, 0), Vec3(0.6, 0, 0))};
  const auto simulation = make_simulation(scene, 24);
  const Totals start = simulation->totals();
  base::Ledger ledger;
  std::int64_t steps = 0, fallbacks = 0;
  for (int f = 0; f < 24; ++f) simulation->advance(ledger, {}), steps += simulation->totals().substeps, fallbacks += simulation->totals().splitting_fallbacks;
  const Totals t = simulation->totals();
  EXPECT_GT(t.kinetic_energy + t.potential_energy, 1.03 * (start.kinetic_energy + start.potential_energy));
  EXPECT_LT(double(fallbacks), 0.2 * double(steps));
}

}  // namespace
}  // namespace sim
