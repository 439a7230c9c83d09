// Return maps: idempotent, inside the yield surface, and never a source of energy.
#include <gtest/gtest.h>

#include "sim/solid/drucker_prager.h"
#include "sim/solid/snow.h"
#include "tests/solid_matrices.h"

namespace {

using namespace sim;

const Lame kLame = Lame::of(1e6, 0.3);
const VonMises kMetal{.yield = 3e4, .hardening = 1e5};
const DruckerPrager kSand{.friction_angle = 0.6, .cohesion = 0};
const DruckerPrager kWetSand{.friction_angle = 0.6, .cohesion = 5e3};
const Snow kSnow{};

/// Stretches between 0.15 and 3, many of them near 1; in descending order.
Principal<double, 3> random_stretch(std::mt19937& rng) {
  std::uniform_real_distribution<double> u(-1, 1);
  const double size = std::pow(10, 2 * u(rng) - 2);
  Principal<double, 3> s;
  for (double& x : s) x = std::exp(std::clamp(size * u(rng), -1.9, 1.1)) - 1;
  std::sort(s.begin(), s.end(), std::greater<>());
  return s;
}

template <class Law>
double random_state(const Law&, std::mt19937& rng) {
  std::uniform_real_distribution<double> u(0, 0.3);
  const double state = u(rng);
  return std::is_same_v<Law, Snow> ? state - 0.15 : state < 0.1 ? 0 : state;
}

Principal<double, 3> logs(const Principal<double, 3>& s) { return held_strain<double, 3>(s); }

template <class Law>
void expect_idempotent(const Law& law, double tolerance) {
  std::mt19937 rng(21);
  int changed = 0;
  for (int n = 0; n < 100000; ++n) {
    Principal<double, 3> once = random_stretch(rng);
    double state = random_state(law, rng);
    changed += law.template project<double, 3>(kLame, once, state);
    Principal<double, 3> twice = once;
    double same_state = state;
    law.template project<double, 3>(kLame, twice, same_state);
    for (std::size_t i = 0; i < 3; ++i) ASSERT_NEAR(twice[i], once[i], tolerance) << Law::kName;
    ASSERT_NEAR(same_state, state, tolerance) << Law::kName;
    const double outside = law.template excess<double, 3>(kLame, once, state);
    ASSERT_LE(outside, 1e-10) << Law::kName;
  }
  EXPECT_GT(changed, 10000);
  EXPECT_LT(changed, 100000);
}

/// Smallest dissipation tau(returned) : change of plastic strain over the stress and strain there are, of a million returns.
template <class Law>
double least_dissipation(const Law& law) {
  std::mt19937 rng(22);
  const Hencky elastic{kLame};
  double least = 1;
  for (int n = 0; n < 1000000; ++n) {
    const Principal<double, 3> before = random_stretch(rng);
    Principal<double, 3> after = before;
    double state = random_state(law, rng);
    if (!law.template project<double, 3>(kLame, after, state)) continue;
    const Principal<double, 3> tau = elastic.template kirchhoff<double, 3>(after), e = logs(before), f = logs(after);
    double work = 0, size = 0;
    for (std::size_t i = 0; i < 3; ++i) work += tau[i] * (e[i] - f[i]), size += std::abs(tau[i]) + kLame.mu * std::abs(f[i]);
    // Volume that sand gives back is not flow: it returns to grains what they were stretched by.
    double returned = 0;
    for (std::size_t i = 0; i < 3; ++i) returned += f[i] - e[i];
    if (std::is_same_v<Law, DruckerPrager> && returned > 0) continue;
    least = std::min(least, work / std::max(size, 1e-12));
  }
  return least;
}

}  // namespace

TEST(SolidPlasticity, ReturningTwiceIsReturningOnceAndEndsInsideTheYieldSurface) {
  expect_idempotent(kMetal, 1e-12);
  expect_idempotent(VonMises{.yield = 3e4, .hardening = 0}, 1e-12);
  expect_idempotent(kSand, 1e-12);
  expect_idempotent(kWetSand, 1e-12);
  expect_idempotent(kSnow, 1e-12);
}

TEST(SolidPlasticity, FlowDissipates) {
  EXPECT_GE(least_dissipation(kMetal), -1e-15);
  EXPECT_GE(least_dissipation(kSand), -1e-15);
  EXPECT_GE(least_dissipation(kWetSand), -1e-15);
}

// Over the same returns, snow included: what is stored afterwards is not more than before.
TEST(SolidPlasticity, ReturnsDoNotAddElasticEnergy) {
  std::mt19937 rng(23);
  const Hencky hencky{kLame};
  const FixedCorotated corotated{kLame};
  double snow_gain = 0;
  for (int n = 0; n < 1000000; ++n) {
    const Principal<double, 3> before = random_stretch(rng);
    const auto check = [&](const auto& law) {
      Principal<double, 3> after = before;
      double state = random_state(law, rng);
      law.template project<double, 3>(kLame, after, state);
      const double was = hencky.template energy<double, 3>(before), is = hencky.template energy<double, 3>(after);
      ASSERT_LE(is, was * (1 + 1e-12) + 1e-12);
    };
    if (n % 3 == 0) check(kMetal);
    if (n % 3 == 1) check(kSand);
    if (n % 3 == 2) check(kWetSand);
    Principal<double, 3> after = before;
    double state = 0;
    if (!kSnow.project<double, 3>(kLame, after, state)) continue;
    const double was = corotated.energy<double, 3>(before), is = corotated.energy<double, 3>(after);
    snow_gain = std::max(snow_gain, (is - was) / was);
  }
  // The published box of stretches is not normal to lines of equal energy: one stretch cut back beside two that are compressed can store
  // more, measured .127 at worst.
  EXPECT_LT(snow_gain, 0.15);
}

// |dev tau| of a bar that flows is what was asked, and grows by the hardening.
TEST(SolidPlasticity, VonMisesFlowsAtItsYieldStressAndHardens) {
  double state = 0;
  Principal<double, 3> s{std::exp(0.2) - 1, std::exp(-0.1) - 1, std::exp(-0.1) - 1};   // pulled along one axis
  ASSERT_TRUE((kMetal.project<double, 3>(kLame, s, state)));
  const Principal<double, 3> tau = Hencky{kLame}.kirchhoff<double, 3>(s);
  EXPECT_GT(state, 0.1);
  EXPECT_NEAR(tau[0] - tau[1], kMetal.yield + kMetal.hardening * state, 1e-6 * kMetal.yield);
  EXPECT_NEAR((sum<double, 3>(logs(s))), 0, 1e-14);   // no change of volume
}

// On the cone, in triaxial compression, sin phi = (t1 - t3)/(t1 + t3): Mohr and Coulomb's friction angle.
TEST(SolidPlasticity, DruckerPragerIsMohrCoulombInTriaxialCompression) {
  double state = 0;
  Principal<double, 3> s{std::exp(0.08) - 1, std::exp(0.08) - 1, std::exp(-0.3) - 1};
  ASSERT_TRUE((kSand.project<double, 3>(kLame, s, state)));
  const Principal<double, 3> tau = Hencky{kLame}.kirchhoff<double, 3>(s);
  ASSERT_LT(tau[2], -1e4);
  EXPECT_NEAR((tau[0] - tau[2]) / -(tau[0] + tau[2]), std::sin(kSand.friction_angle), 1e-9);
  EXPECT_EQ(state, 0);
}

TEST(SolidPlasticity, DrySandBearsNoTensionAndCohesionBearsThatOfItsTip) {
  Principal<double, 3> pulled{0.05, 0.05, 0.05}, damp = pulled;
  double state = 0, damp_state = 0;
  kSand.project<double, 3>(kLame, pulled, state);
  EXPECT_NEAR((Hencky{kLame}.kirchhoff<double, 3>(pulled)[0]), 0, 1e-9);
  EXPECT_NEAR(state, 3 * std::log(1.05), 1e-12);
  kWetSand.project<double, 3>(kLame, damp, damp_state);
  EXPECT_NEAR((Hencky{kLame}.kirchhoff<double, 3>(damp)[0]), kWetSand.cohesion / std::tan(kWetSand.friction_angle), 1e-6);
}

// Pulled apart by a tenth and pushed back: the volume is the same again before grains push, where without memory 1.1^3 would be kept.
TEST(SolidPlasticity, SandThatIsPulledAndPushedBackHasItsVolumeAgain) {
  Principal<double, 3> s{0, 0, 0};
  double state = 0;
  const auto deform = [&](double strain) {
    for (double& x : s) x = std::exp(std::log1p(x) + strain) - 1;
    kSand.project<double, 3>(kLame, s, state);
  };
  for (int n = 0; n < 10; ++n) deform(0.01);
  EXPECT_NEAR(state, 0.3, 1e-12);
  for (int n = 0; n < 9; ++n) deform(-0.01);
  EXPECT_NEAR(s[0], 0, 1e-12);
  for (int n = 0; n < 2; ++n) deform(-0.01);
  EXPECT_NEAR(s[0], std::exp(-0.01) - 1, 1e-12);
  EXPECT_NEAR(state, 0, 1e-12);
}

// Pulled and pushed in turn it does not swell: what it was pulled apart by closes before it bears, and then it bears the rest.
TEST(SolidPlasticity, SnowGivesVolumeBackBeforeItIsPushed) {
  double state = 0;
  for (int n = 0; n < 100; ++n) {
    Principal<double, 3> s{0.02, 0.02, 0.02};
    ASSERT_TRUE((kSnow.project<double, 3>(kLame, s, state)));
    const double gap = std::pow(1.02 / (1 + kSnow.critical_stretch), 3);
    ASSERT_NEAR(state, gap - 1, 1e-12);
    s = {-0.001, -0.001, -0.001};
    ASSERT_TRUE((kSnow.project<double, 3>(kLame, s, state)));
    for (const double one : s) ASSERT_NEAR(one, 0, 1e-15);   // a gap that is still open bears nothing
    ASSERT_NEAR(state, gap * std::pow(0.999, 3) - 1, 1e-12);
    s = {-0.02, -0.02, -0.02};
    ASSERT_TRUE((kSnow.project<double, 3>(kLame, s, state)));
    for (const double one : s) ASSERT_NEAR(one, 0.98 * 0.999 * std::cbrt(gap) - 1, 1e-12);
    ASSERT_NEAR(state, 0, 1e-12);
  }
  Principal<double, 3> sheared{0.03, 0, -0.02};   // drawn along one axis, pushed along another: that is flow until its volume is what it was
  ASSERT_TRUE((kSnow.project<double, 3>(kLame, sheared, state)));
  EXPECT_NEAR(sheared[0], kSnow.critical_stretch, 1e-15);
  EXPECT_EQ(sheared[1], 0);
  EXPECT_NEAR(sheared[2], 1 / (1 + kSnow.critical_stretch) - 1, 1e-12);
  EXPECT_NEAR(state, 1.03 * 0.98 - 1, 1e-12);
}

// A bar that is drawn gets thinner by itself: that is no push, and it breaks.
TEST(SolidPlasticity, SnowThatIsDrawnGivesWay) {
  const FixedCorotated elastic{kLame};
  Principal<double, 3> s{};
  double state = 0, most = 0, last = 0;
  for (int n = 0; n < 200; ++n) {
    const double drawn = (1 + s[0]) * 1.0005 - 1;
    const auto with_sides = [&](double side, double& j) {
      Principal<double, 3> trial{drawn, (1 + s[1]) * side - 1, (1 + s[2]) * side - 1};
      kSnow.project<double, 3>(kLame, trial, j);
      return trial;
    };
    double low = 0.99, high = 1.01;   // sides free of stress
    for (int step = 0; step < 60; ++step) {
      const double middle = 0.5 * (low + high);
      double j = state;
      (elastic.kirchhoff<double, 3>(with_sides(middle, j))[1] < 0 ? low : high) = middle;
    }
    s = with_sides(0.5 * (low + high), state);
    last = elastic.kirchhoff<double, 3>(s)[0] * kSnow.hardened(state);
    most = std::max(most, last);
  }
  EXPECT_GT(state, 0.08);
  EXPECT_LT(last, 0.5 * most);
}

// Moduli grow where gaps close: what is stored is not more for it, nor for any return near the box.
TEST(SolidPlasticity, SnowThatClosesItsGapsStoresNoMore) {
  std::mt19937 rng(24);
  std::uniform_real_distribution<double> strain(-0.03, 0.03);
  const Lame lame = Lame::of(1.4e5, 0.2);   // the preset's
  const FixedCorotated elastic{lame};
  double worst = 0;
  for (int n = 0; n < 1000000; ++n) {
    Principal<double, 3> s{strain(rng), strain(rng), strain(rng)};
    std::sort(s.begin(), s.end(), std::greater<>());
    double state = random_state(kSnow, rng);
    const double was = elastic.energy<double, 3>(s) * kSnow.hardened(state);
    if (!kSnow.project<double, 3>(lame, s, state)) continue;
    worst = std::max(worst, elastic.energy<double, 3>(s) * kSnow.hardened(state) / was);
  }
  EXPECT_LE(worst, 1.001);
}

TEST(SolidPlasticity, SnowHardensWhenItIsCompressedAndTheHardeningIsCapped) {
  Principal<double, 3> s{0, 0, -0.1};
  double state = 0;
  ASSERT_TRUE((kSnow.project<double, 3>(kLame, s, state)));
  EXPECT_NEAR(s[2], -kSnow.critical_compression, 1e-15);
  EXPECT_NEAR(state, 0.9 / 0.975 - 1, 1e-12);
  EXPECT_NEAR(kSnow.hardened(state), std::exp(-kSnow.hardening * state), 1e-9);
  EXPECT_FALSE(kSnow.is_capped(state));
  for (int n = 0; n < 1000; ++n) s = {0, 0, -0.5}, kSnow.project<double, 3>(kLame, s, state);
  EXPECT_NEAR(kSnow.hardened(state), kSnow.most_hardening, 1e-9);
  EXPECT_TRUE(kSnow.is_capped(state));
  for (int n = 0; n < 1000; ++n) s = {0.5, 0.5, 0.5}, kSnow.project<double, 3>(kLame, s, state);
  EXPECT_NEAR(kSnow.hardened(state), 1 / kSnow.most_hardening, 1e-9);
}

// Eight at a time in single precision: the same returns.
TEST(SolidPlasticity, LanesReturnAsDoublePrecisionDoes) {
  std::mt19937 rng(24);
  for (int n = 0; n < 2000; ++n) {
    const auto check = [&](const auto& law) {
      Principal<double, 3> s = random_stretch(rng);
      double state = random_state(law, rng);
      Principal<Lanes, 3> lanes;
      Lanes lane_state = Lanes(float(state));
      for (std::size_t i = 0; i < 3; ++i) lanes[i] = Lanes(float(s[i])), s[i] = double(lanes[i][0]);
      state = double(lane_state[0]);
      law.template project<double, 3>(kLame, s, state);
      law.template project<Lanes, 3>(kLame, lanes, lane_state);
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(double(lanes[i][2]), s[i], 3e-6 * std::max(1.0, std::abs(s[i])));
      EXPECT_NEAR(double(lane_state[2]), state, 3e-6 * std::max(1.0, std::abs(state)));
    };
    check(kMetal), check(kSand), check(kWetSand), check(kSnow);
  }
}
