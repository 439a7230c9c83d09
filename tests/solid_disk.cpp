// A spinning disk and a spinning sphere with a free surface: what each transfer and carry keeps of energy and angular momentum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

/// rho 1, E 200, nu .3, R .2, omega 4, cell 1/32, 2 x 2 jitter, for `time` [s]; largest and last energy over that at the start, and the drift of
/// angular momentum.
struct Spun {
  double largest = 0, last = 0, angular = 0, linear = 0;
  bool blew_up = false;
};

Spun spin(Scene scene, double time) {
  const Material soft{.model = Elasticity::neo_hookean, .density = 1, .young = 200, .poisson = 0.3};
  const double middle = scene.options.domain.upper.x() / 2;
  Body body = ball(base::Vec3(middle, middle, scene.options.dimension == 3 ? middle : 0), 0.2, soft);
  body.spin = base::Vec3(0, 0, 4);
  scene.bodies = {body};
  const auto simulation = make_simulation(scene, 20);
  const Totals start = simulation->totals();
  Spun spun;
  base::Ledger ledger;
  for (int f = 0; f < int(std::lround(20 * time)); ++f) {
    try {
      simulation->advance(ledger, {});
    } catch (const base::Error&) {
      spun.blew_up = true;
      return spun;
    }
    const Totals now = simulation->totals();
    spun.last = energy(now) / energy(start);
    spun.largest = std::max(spun.largest, spun.last);
    spun.angular = (now.angular_momentum - start.angular_momentum).norm() / start.angular_momentum.norm();
    spun.linear = std::max(spun.linear, (now.linear_momentum - start.linear_momentum).norm() / (start.mass * 0.8));
    if (spun.largest > 2) spun.blew_up = true;
    if (spun.blew_up) return spun;
  }
  return spun;
}

Scene disk() { return open_scene(2, 1, 1.0 / 32); }

}  // namespace

// The disk does turn and stretch: a quantity that is zero would be kept by anything.
TEST(SolidDisk, SpinsAndStretches) {
  Scene scene = disk();
  set_transfer(scene.options, "apic");
  const Material soft{.model = Elasticity::neo_hookean, .density = 1, .young = 200, .poisson = 0.3};
  Body body = ball(base::Vec3(0.5, 0.5, 0), 0.2, soft);
  body.spin = base::Vec3(0, 0, 4);
  scene.bodies = {body};
  const auto simulation = make_simulation(scene, 20);
  const auto totals = run(*simulation, 2);
  EXPECT_NEAR(totals[0].angular_momentum.z(), 0.5 * totals[0].mass * 0.04 * 4, 0.03 * 0.5 * totals[0].mass * 0.04 * 4);
  EXPECT_NEAR(totals[0].mass, M_PI * 0.04, 0.02 * M_PI * 0.04);
  EXPECT_GT(*totals[2].elastic_energy, 1e-4 * totals[0].kinetic_energy);
}

TEST(SolidDisk, ApicAndHybridKeepEnergyAndAngularMomentum) {
  for (const char* transfer : {"apic", "polypic"}) {
    Scene scene = disk();
    set_transfer(scene.options, transfer);
    const Spun spun = spin(scene, 4);
    EXPECT_FALSE(spun.blew_up) << transfer;
    EXPECT_GT(spun.last, 0.998) << transfer;
    EXPECT_LT(spun.largest, 1.001) << transfer;
    EXPECT_LT(spun.angular, 1e-10) << transfer;
    EXPECT_LT(spun.linear, 1e-12) << transfer;
  }
}

TEST(SolidDisk, SinglePrecisionKeepsAngularMomentumToAHundredThousandth) {
  for (const char* transfer : {"apic", "polypic"}) {
    Scene scene = disk();
    scene.options.precision = Precision::single_precision;
    set_transfer(scene.options, transfer);
    const Spun spun = spin(scene, 4);
    EXPECT_GT(spun.last, 0.998) << transfer;
    EXPECT_LT(spun.largest, 1.001) << transfer;
    EXPECT_LT(spun.angular, 1e-5) << transfer;
  }
}

// The (1, -2, 1) rows see light nodes at full strength: with coefficients carried as they are, all modes at once blow up; limited ones do not.
TEST(SolidDisk, AllModesWithFixedCarryBlowUpAndLimitedOnesDoNot) {
  Scene scene = disk();
  set_transfer(scene.options, "polypic");
  scene.options.carry = Carry::fixed;
  EXPECT_TRUE(spin(scene, 4).blew_up);
  scene.options.carry = Carry::limited;
  const Spun limited = spin(scene, 4);
  EXPECT_FALSE(limited.blew_up);
  EXPECT_LT(limited.largest, 1.001);
  EXPECT_GT(limited.last, 0.99);
}

TEST(SolidDisk, PicAndFlipLoseIt) {
  Scene scene = disk();
  set_transfer(scene.options, "pic");
  EXPECT_LT(spin(scene, 4).last, 0.01);
  set_transfer(scene.options, "flip");
  const Spun flip = spin(scene, 4);
  EXPECT_FALSE(flip.blew_up);
  EXPECT_LT(flip.last, 0.9);
}

TEST(SolidDisk, ASphereOfTenModesIsStableWithFixedCarryAndOfAllModesWithHybrid) {
  Scene scene = open_scene(3, 0.625, 1.0 / 16);
  set_transfer(scene.options, "polypic");
  const Spun hybrid = spin(scene, 2);
  EXPECT_FALSE(hybrid.blew_up);
  EXPECT_LT(hybrid.largest, 1.001);
  EXPECT_LT(hybrid.angular, 1e-10);
  scene.options.carry = Carry::fixed;
  scene.options.modes = {.count = 0, .name = "quadratic"};
  const Spun ten = spin(scene, 2);
  EXPECT_FALSE(ten.blew_up);
  EXPECT_LT(ten.largest, 1.001);
}
