// How the watch goes back, with a simulation that says what it is told to.
#include <gtest/gtest.h>

#include <limits>

#include "sim/moment.h"
#include "sim/verify/scenes.h"
#include "sim/watch.h"

namespace sim {
namespace {

using namespace verify;

/// Whose totals nobody asks.
Scene jelly() {
  Scene scene = open_scene(2, 1, 0.05);
  scene.bodies = {ball({0.5, 0.5, 0}, 0.15, {.model = Elasticity::neo_hookean, .density = 1000, .young = 1e4, .poisson = 0.3})};
  return scene;
}

bool says(const std::string& line, const std::string& part) { return line.find(part) != std::string::npos; }

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A simulation of four steps a frame, whose totals are what it is told; who goes back gets what they were.
class Told final : public Simulation {
 public:
  struct Step {
    std::int64_t frame;
    double left;          // [1] of the frame, before it
    Restraint restraint;
  };
  Totals now;
  std::vector<Step> steps;   // all that were begun
  std::function<void(Totals&, const Step&)> change = [](Totals&, const Step&) {};

  double begin_frame() override { return 1; }
  double advance_step(double left, base::Ledger&) override {
    steps.push_back({frame_ + 1, left, restraint_});
    change(now, steps.back());
    return left - 0.25 / (1 << restraint_.halvings);
  }
  void end_frame(base::Ledger&) override { ++frame_; }
  std::unique_ptr<Moment> moment() const override { return keep_moment(std::tie(now)); }
  void go_back(const Moment& m) override { put_back(m, std::tie(now)); }
  void restrain(const Restraint& r) override { restraint_ = r; }
  Frame frame() const override { return {}; }
  Totals totals() const override { return now; }
  State state() const override { return {.frame = frame_, .columns = {make_column<double>("energy", std::vector<double>{now.kinetic_energy}, 1)}}; }
  void restore(const State& s) override {
    now = start;
    now.kinetic_energy = reals(s, "energy").at(0);
    frame_ = s.frame;
  }
  Totals start;

 private:
  Restraint restraint_;
  std::int64_t frame_ = 1;
};

Totals quiet() {
  Totals t;
  t.particles = 100, t.mass = 10, t.kinetic_energy = 4, t.elastic_energy = 1, t.max_speed = 1, t.largest_coefficient = 2, t.least_volume = 0.9,
      t.most_volume = 1.1;
  return t;
}

std::unique_ptr<Told> told_simulation(std::function<void(Totals&, const Told::Step&)> change) {
  auto simulation = std::make_unique<Told>();
  simulation->now = simulation->start = quiet();
  simulation->change = std::move(change);
  return simulation;
}

/// What a frame with one change is stopped with.
std::string told(const std::function<void(Totals&)>& change) {
  auto simulation = told_simulation([&](Totals& t, const Told::Step&) { t = quiet(), change(t); });
  const Told& kept = *simulation;
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  try {
    watch.advance(ledger, {});
    EXPECT_EQ(kept.steps.size(), 4u);
  } catch (const base::Error& e) {
    // the frame; its first step and thrice again; the frame at an eighth
    EXPECT_EQ(kept.steps.size(), std::size_t(4 + 1 + Watch::kMostRetries + 8 * 4)) << e.what();
    EXPECT_EQ(e.complaint().code, base::Exit::unstable);
    return e.what();
  }
  return {};
}

}  // namespace

TEST(WatchRetries, NamesEachLawThatATotalBreaks) {
  EXPECT_EQ(told([](Totals&) {}), "");
  EXPECT_TRUE(says(told([](Totals& t) { t.kinetic_energy = kNone; }), "frame 2: finite: "));
  EXPECT_TRUE(says(told([](Totals& t) { t.max_speed = kNone; }), "frame 2: finite: "));
  EXPECT_TRUE(says(told([](Totals& t) { t.linear_momentum.y() = kNone; }), "frame 2: finite: "));
  EXPECT_TRUE(says(told([](Totals& t) { t.particles = 99; }), "frame 2: mass: 99 particles, where 100 were and 0 have left"));
  EXPECT_EQ(told([](Totals& t) { t.particles = 99, t.left = 1; }), "");
  EXPECT_TRUE(says(told([](Totals& t) { t.kinetic_energy = 7; }), "frame 2: energy: 8 J (kinetic 7, potential 0, elastic 1), where 5 J were left"));
  EXPECT_EQ(told([](Totals& t) { t.kinetic_energy = 5; }), "");                            // a third more than 5 is what it may swing by
  EXPECT_EQ(told([](Totals& t) { t.kinetic_energy = 7, t.collider_work = 3; }), "");       // who is pushed may gain
  EXPECT_EQ(told([](Totals& t) { t.kinetic_energy = 7, t.gravity_work = 3; }), "");
  EXPECT_TRUE(says(told([](Totals& t) { t.kinetic_energy = 7, t.gravity_work = -3; }), "frame 2: energy: "));
  EXPECT_TRUE(says(told([](Totals& t) { t.largest_coefficient = 2e5; }), "frame 2: coefficients: one of 2e+05 m/s"));
  EXPECT_EQ(told([](Totals& t) { t.largest_coefficient = 2e4; }), "");
  EXPECT_TRUE(says(told([](Totals& t) { t.most_volume = 2e6; }), "frame 2: volume: volume ratios from 0.9 to 2e+06"));
  EXPECT_TRUE(says(told([](Totals& t) { t.least_volume = kNone; }), "frame 2: volume: "));
}

// The step that breaks a law is shorter; then modes are restrained too. The next has its length, and what was restrained stays so.
TEST(WatchRetries, RestrainsTheStepThatBreaksALawAndNoOther) {
  auto simulation = told_simulation([](Totals& t, const Told::Step& s) { if (s.left == 0.5 && s.restraint.modes < 1) t.kinetic_energy = 40; });
  const Told& kept = *simulation;
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  watch.advance(ledger, {});
  EXPECT_EQ(watch.totals().retries, 3);   // to the frame's start once, to the third step's start twice
  EXPECT_EQ(watch.totals().kinetic_energy, 4);
  watch.advance(ledger, {});
  EXPECT_EQ(watch.totals().retries, 0);
  struct Expected {
    double left;
    int halvings, modes;
  };
  const std::vector<Expected> expected = {{1, 0, 0}, {.75, 0, 0}, {.5, 0, 0}, {.25, 0, 0},                                       // as ever
                                          {1, 0, 0}, {.75, 0, 0}, {.5, 0, 0}, {.5, 1, 0}, {.5, 2, 1}, {.4375, 0, 1}, {.1875, 0, 1},   // again
                                          {1, 0, 1}, {.75, 0, 1}, {.5, 0, 1}, {.25, 0, 1}};
  ASSERT_EQ(kept.steps.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_EQ(kept.steps[k].left, expected[k].left) << k;
    EXPECT_EQ(kept.steps[k].restraint.halvings, expected[k].halvings) << k;
    EXPECT_EQ(kept.steps[k].restraint.modes, expected[k].modes) << k;
  }
}

// What a step's start is too late for: the frame from its start, every step as short as can be. A first step that is too long makes the third wrong.
TEST(WatchRetries, DoesAllOfAFrameAgainWhereAStepIsNotToBeSaved) {
  auto simulation = told_simulation([](Totals& t, const Told::Step& s) {
    if (s.left == 1) t.elastic_energy = s.restraint.halvings < 3 ? 1.1 : 1;   // breaks no law yet
    if (s.left <= 0.5) t.kinetic_energy = t.elastic_energy > 1 ? 40 : 4;
  });
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  watch.advance(ledger, {});
  EXPECT_EQ(watch.totals().retries, 1 + Watch::kMostRetries + 1);
  EXPECT_EQ(watch.totals().kinetic_energy, 4);
  EXPECT_EQ(watch.totals().elastic_energy, 1);
}

TEST(WatchRetries, GoesBackAStatedNumberOfTimesAndThenStops) {
  auto simulation = told_simulation([](Totals& t, const Told::Step& s) { t.kinetic_energy = s.restraint.halvings < 3 ? 40 : 4; });
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  try {
    for (int f = 0; f < 50; ++f) watch.advance(ledger, {});
    FAIL() << "it went on";
  } catch (const base::Error& e) {
    EXPECT_TRUE(says(e.what(), "frame 2: energy: 41 J") && says(e.what(), "after going back 48 times")) << e.what();
  }
}

// Frames without a break that were done again have been in trouble since the first of them.
TEST(WatchRetries, SaysSinceWhichFrameItGoesBack) {
  auto simulation = told_simulation([](Totals& t, const Told::Step& s) {
    const bool bad = s.frame == 3 || s.frame == 6 || s.frame == 7 || s.frame == 8;
    t.largest_coefficient = s.frame == 8 || (bad && s.restraint.halvings == 0 && s.left == 1) || (bad && s.left < 1 && t.largest_coefficient > 2)
        ? 2e5 : 2;
  });
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  try {
    for (int f = 0; f < 50; ++f) watch.advance(ledger, {});
    FAIL() << "it went on";
  } catch (const Unstable& e) {
    EXPECT_EQ(e.frame(), 8);
    EXPECT_EQ(e.violation().since, 6);
    EXPECT_TRUE(says(e.what(), "frame 8: coefficients: one of 2e+05 m/s") && says(e.what(), "; well up to frame 5 (carry ")) << e.what();
  }
}

}  // namespace sim
