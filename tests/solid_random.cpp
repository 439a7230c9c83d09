// Sixty scenes that nobody designed: bodies of random materials in random motion between random walls. They end well, or stop and say why.
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "sim/verify/random_scene.h"
#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

#ifdef __SANITIZE_ADDRESS__
constexpr int kFrames = 15;    // sanitized code takes ten times as long
#else
constexpr int kFrames = 100;
#endif

}  // namespace

TEST(SolidRandom, SixtyScenesEndWellOrStopAndSayWhy) {
  int stopped = 0;
  for (int number = 0; number < 60; ++number) {
    const auto simulation = make_simulation(verify::random_scene(number), 200);
    base::Ledger ledger;
    try {
      for (int frame = 0; frame < kFrames; ++frame) simulation->advance(ledger, {});
      const Totals now = simulation->totals();
      ASSERT_TRUE(std::isfinite(energy(now)) && now.linear_momentum.allFinite()) << number;
      for (const auto& x : simulation->frame().position) ASSERT_TRUE(x.allFinite()) << number;
    } catch (const base::Error& e) {
      ++stopped;
      EXPECT_EQ(e.complaint().code, base::Exit::unstable) << number << ": " << e.what();
      EXPECT_FALSE(e.complaint().message.empty());
      std::printf("scene %d stopped: %s\n", number, e.what());
    }
  }
  EXPECT_LE(stopped, 6);
}
