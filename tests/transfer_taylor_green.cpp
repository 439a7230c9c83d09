// The decay of Taylor-Green vortices under the usual splitting: what each scheme loses (tests/taylor_green.h).
#include "tests/taylor_green.h"

namespace sim::taylor_green {
namespace {

// Other seeds change these numbers by up to 0.003, and they are rounded to 0.001.
constexpr double kTolerance = 0.005;

void expect_on_wide_vortices(const Scheme& scheme, double energy_5, double energy_20, double error_5) {
  const std::vector<Decay> found = decay(scheme, 1, {5, 20});
  EXPECT_NEAR(found[0].energy, energy_5, kTolerance) << scheme.name;
  EXPECT_NEAR(found[0].error, error_5, kTolerance) << scheme.name;
  EXPECT_NEAR(found[1].energy, energy_20, kTolerance) << scheme.name;
}

TEST(TaylorGreen, WideVorticesLoseMostWithPic) { expect_on_wide_vortices(kPic, .349, .018, .410); }

// All of these lose what the splitting of motion and pressure costs.
TEST(TaylorGreen, WideVorticesOfFlip) { expect_on_wide_vortices(kFlip, .873, .642, .068); }
TEST(TaylorGreen, WideVorticesOfApic) { expect_on_wide_vortices(kApic, .892, .680, .058); }
TEST(TaylorGreen, WideVorticesOfFourModes) { expect_on_wide_vortices(kPoly4, .895, .692, .057); }
TEST(TaylorGreen, WideVorticesOfNineModes) { expect_on_wide_vortices(kPoly9, .892, .680, .058); }

TEST(TaylorGreen, KeepsOfNarrowVorticesWhatTheModesHold) {
  for (const auto& [scheme, energy] : {std::pair{kFlip, .171}, {kApic, .140}, {kPoly4, .273}, {kPoly6, .421}, {kPoly9, .455}, {kLinear4, .408}})
    EXPECT_NEAR(decay(scheme, 8, {1}).front().energy, energy, kTolerance) << scheme.name;
}

}  // namespace
}  // namespace sim::taylor_green
