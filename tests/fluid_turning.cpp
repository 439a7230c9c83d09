// Colliders that turn in a liquid: what does not change its place stirs nothing, and what does does as much work as the liquid gains.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/fluid/open_faces.h"
#include "sim/simulation.h"

namespace sim {
namespace {

using base::Vec3;

/// A full box of 0.8 m without gravity, and a collider in it.
Scene full_box(int dimension, const Collider& collider) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = dimension;
  o.domain = {Vec3::Zero(), dimension == 2 ? Vec3(0.8, 0.8, 0) : Vec3(0.8, 0.8, 0.8)};
  o.cell = dimension == 2 ? 0.02 : 0.05;
  o.particles_per_cell = dimension == 2 ? 4 : 8;
  o.precision = Precision::double_precision;
  Body water;
  water.name = "water";
  water.shape.box = o.domain;
  scene.bodies = {water};
  scene.colliders = {collider};
  return scene;
}

Collider blade(const Vec3& lower, const Vec3& upper, double spin) {
  Collider c;
  c.name = "blade";
  c.shape.box = base::Box{lower, upper};
  c.spin = Vec3(0, 0, spin);
  return c;
}

}  // namespace

// Over the part of a triangle or segment where a distance is below 0, against a sum over many places.
TEST(FluidTurning, TheRestOfATriangleIsIntegratedExactly) {
  for (const std::array<double, 3>& d : {std::array{-1.0, 2.0, 3.0}, {2.0, -1.0, -0.5}, {0.5, 0.7, -2.0}, {-1.0, -2.0, -3.0}, {1.0, 2.0, 3.0}, {0.0, -1.0, 1.0}}) {
    EXPECT_NEAR(integral_of_rest(d, std::array{1.0, 1.0, 1.0}), 1 - positive_part(d[0], d[1], d[2]), 1e-14);
    EXPECT_NEAR(integral_of_rest(std::array{d[0], d[1]}, std::array{1.0, 1.0}), 1 - positive_part(d[0], d[1]), 1e-14);
    constexpr int kMany = 400;
    double inside = 0, along = 0;
    for (int i = 0; i < kMany; ++i) {
      for (int j = 0; j < kMany - i; ++j) {   // two triangles, each at its middle
        for (const int upper : {0, 1}) {
          if (upper == 1 && j == kMany - i - 1) continue;
          const double x = (i + (1 + upper) / 3.0) / kMany, y = (j + (1 + upper) / 3.0) / kMany;
          if (d[0] + x * (d[1] - d[0]) + y * (d[2] - d[0]) < 0) inside += (3 - 5 * x + 4 * y) / (kMany * kMany);
        }
      }
      const double t = (i + 0.5) / kMany;
      if (d[0] + t * (d[1] - d[0]) < 0) along += (3 - 5 * t) / kMany;
    }
    EXPECT_NEAR(integral_of_rest(d, std::array{3.0, -2.0, 7.0}), inside, 2e-2);
    EXPECT_NEAR(integral_of_rest(std::array{d[0], d[1]}, std::array{3.0, -2.0}), along, 2e-2);
  }
}

// A ball that turns about its middle, and slips, is where it was.
TEST(FluidTurning, ABallThatSpinsLeavesTheWaterAroundItAtRest) {
  for (const int dimension : {2, 3}) {
    Collider ball;
    ball.name = "ball";
    ball.shape.sphere = {dimension == 2 ? Vec3(0.41, 0.37, 0) : Vec3(0.41, 0.37, 0.42), 0.17};
    ball.spin = dimension == 2 ? Vec3(0, 0, 5) : Vec3(2, -3, 4);
    const auto simulation = make_simulation(full_box(dimension, ball), 50);
    base::Ledger ledger;
    double most = 0;
    for (int f = 0; f < 25; ++f) {
      simulation->advance(ledger, {});
      most = std::max(most, simulation->totals().max_speed);
    }
    EXPECT_LE(most, 0.015 * ball.spin.norm() * 0.17) << dimension;   // a quarter, where closed faces dragged
  }
}

// What turns in a full box changes no volume, and the liquid has what was done on it, less what the transfer loses.
TEST(FluidTurning, ABladeInAFullBoxDoesTheWorkThatTheLiquidGains) {
  for (const int dimension : {2, 3}) {
    const double thick = dimension == 2 ? 0.04 : 0.1;
    const Vec3 lower(0.2, 0.4 - thick / 2, dimension == 2 ? 0 : 0.2), upper(0.6, 0.4 + thick / 2, dimension == 2 ? 0 : 0.6);
    const auto simulation = make_simulation(full_box(dimension, blade(lower, upper, 3)), 100);
    base::Ledger ledger;
    double work = 0, fastest = 0;
    for (int f = 0; f < 50; ++f) {
      simulation->advance(ledger, {});
      const Totals t = simulation->totals();
      work += t.collider_work, fastest = std::max(fastest, t.max_speed);
      EXPECT_LE(t.imbalance.value(), 1e-9) << f;
      EXPECT_LE(t.kinetic_energy, 1.05 * work) << f;   // both are known as well as the blade is resolved: two cells thick
    }
    const Totals t = simulation->totals();
    EXPECT_GT(t.kinetic_energy, 0.6 * work);
    EXPECT_LE(fastest, 3 * 0.2 * 3);
  }
}

// A gate that hangs on a pivot swings by a quarter of a turn and stops; from then on it does nothing.
TEST(FluidTurning, AGateThatStopsDoesNoMoreWork) {
  Collider gate = blade(Vec3(0.38, 0.2, 0), Vec3(0.42, 0.5, 0), M_PI);
  gate.pivot = Vec3(0.4, 0.5, 0);
  gate.start = 0.1, gate.end = 0.6;
  const auto simulation = make_simulation(full_box(2, gate), 50);
  base::Ledger ledger;
  double work = 0, energy = 0;
  for (int f = 1; f <= 50; ++f) {
    simulation->advance(ledger, {});
    const Totals t = simulation->totals();
    const bool before = f <= 5, after = f > 30;
    EXPECT_TRUE((!before && !after) || t.collider_work == 0) << f;
    EXPECT_TRUE(!before || t.kinetic_energy == 0) << f;
    EXPECT_TRUE(!after || t.kinetic_energy <= energy * (1 + 1e-9)) << f;
    work += t.collider_work, energy = t.kinetic_energy;
    for (const base::Vec3f& x : simulation->frame().position)   // where the gate ends, to the right of its pivot
      ASSERT_FALSE(after && x.x() > 0.401 && x.x() < 0.699 && x.y() > 0.481 && x.y() < 0.519) << x.transpose();
  }
  EXPECT_GT(work, 0);
}

}  // namespace sim
