// The watch of every run: each law is broken once, and told by name; what breaks none keeps its bits.
#include "sim/watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"
#include "sim/solid/seeding.h"
#include "sim/solid/step.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim {
namespace {

using namespace verify;

const Material kJelly{.model = Elasticity::neo_hookean, .density = 1000, .young = 1e4, .poisson = 0.3};

Scene jelly(Precision precision = kSingle) {
  Scene scene = open_scene(2, 1, 0.05);
  apply({Transfer::polypic, 0, Kernel::quadratic, Carry::hybrid, precision}, scene.options);
  scene.bodies = {ball({0.3, 0.5, 0}, 0.15, kJelly), ball({0.7, 0.5, 0}, 0.15, kJelly)};
  scene.bodies[0].name = "left", scene.bodies[1].name = "right";
  scene.bodies[0].velocity = {1, 0, 0}, scene.bodies[1].velocity = {-1, 0.2, 0};
  return scene;
}

Scene water() {
  Scene scene = tank(2, 0.05, base::Vec3::Zero(), {0.4, 0.4, 0});
  apply({Transfer::polypic, 0, Kernel::linear, Carry::fixed, kSingle, Splitting::reflection}, scene.options);
  add_gravity(scene);
  return scene;
}

/// What a frame is stopped with after a change to the state it starts from; empty where it is not.
std::string stopped(const Scene& scene, const std::function<void(State&)>& change, std::int64_t* retries = nullptr) {
  Watch watch(scene, 24);
  base::Ledger ledger;
  watch.advance(ledger, {});
  State state = watch.state();
  change(state);
  watch.simulation().restore(state);   // behind its back: it knows the state before
  try {
    watch.advance(ledger, {});
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::unstable);
    return e.what();
  }
  if (retries) *retries = watch.totals().retries;
  return {};
}

bool says(const std::string& line, const std::string& part) { return line.find(part) != std::string::npos; }

std::function<void(State&)> with_coefficient(std::int64_t row, std::size_t mode, double value) {
  return [=](State& s) { edit_reals(s, "coefficients", kSingle, [&](std::int64_t r, double* v) { if (r == row) v[mode] = value; }); };
}

/// The same with every change kept: the watch starts from the changed state, so going back does not help.
std::string stopped_for_good(const Scene& scene, const std::function<void(State&)>& change) {
  Watch watch(scene, 24);
  State state = watch.state();
  change(state);
  watch.restore(state);
  base::Ledger ledger;
  try {
    for (int f = 0; f < 3; ++f) watch.advance(ledger, {});
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::unstable);
    return e.what();
  }
  return {};
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

}  // namespace

// The fault is in the simulation's memory alone: the frame's start is good, and the frame done again has the bits it should have.
TEST(Watch, GoesBackToTheFramesStartAndCountsIt) {
  for (const Scene& scene : {jelly(), water()}) {
    std::int64_t retries = 0;
    EXPECT_EQ(stopped(scene, with_coefficient(7, 0, kNone), &retries), "");
    EXPECT_EQ(retries, 1);
  }
}

TEST(Watch, NamesTheParticleThatIsNotFinite) {
  const std::string solid = stopped_for_good(jelly(), with_coefficient(7, 0, kNone)), liquid = stopped_for_good(water(), with_coefficient(7, 0, kNone));
  EXPECT_TRUE(says(solid, "frame 2: finite: p2g: particle 7 of body left has no finite velocity, with steps 8 times as short too")) << solid;
  EXPECT_TRUE(says(liquid, "frame 2: finite: sort: particle 7 at cell (")) << liquid;
}

TEST(Watch, NamesAParticleThatGoesTooFar) {
  const std::string line = stopped_for_good(jelly(), [](State& s) {
    edit<double>(s, "limits", [](std::int64_t, double* v) { *v = 1e-3; });
    edit_reals(s, "coefficients", kSingle, [](std::int64_t r, double* v) { if (r < 40) v[0] = 1e7; });
  });
  EXPECT_TRUE(says(line, "motion: g2p: particle ") && says(line, " of body left, cell (")) << line;
}

// Momentum is measured on the nodes against what particles had when they gathered.
TEST(Watch, SeesParticlesThatDisappearAndMomentumThatComesOfNothing) {
  Scene scene = jelly(kDouble);
  const Solids<2> solids(scene, Lattice<2>({20, 20}, {true, true}));
  auto groups = seed_groups<2, double>(scene, solids);
  SolidStep<2, double> step(scene, solids);
  base::Ledger ledger;
  step.scatter(1e-3, groups, ledger);
  step.update(1e-3, base::Vec3(0, -9.81, 0), ledger);
  double mass = 0;
  base::Vec3 momentum = base::Vec3::Zero();
  for (const auto& g : groups)
    for (std::size_t p = 0; p < g.particles.size(); ++p) mass += g.particles.mass, momentum.head<2>() += g.particles.mass * g.particles.velocity(p);
  ASSERT_GT(mass, 100);
  EXPECT_NEAR(step.scattered().mass, mass, 1e-12 * mass);
  EXPECT_NEAR((step.scattered().momentum - momentum).norm(), 0, 1e-12 * mass);
  const StepLimits limits = step.gather(1e-3, 0, groups, ledger);
  momentum.setZero();
  for (const auto& g : groups)
    for (std::size_t p = 0; p < g.particles.size(); ++p) momentum.head<2>() += g.particles.mass * g.particles.velocity(p);
  EXPECT_NEAR((limits.momentum - momentum).norm(), 0, 1e-12 * mass);
  EXPECT_LT(limits.least_volume, 1);
  EXPECT_GT(limits.most_volume, limits.least_volume);
}

TEST(Watch, SumsFacesOfALiquidAsItsParticles) {
  for (const Kernel kernel : {Kernel::linear, Kernel::quadratic}) {
    Scene scene = water();
    scene.options.kernel = kernel;
    const Lattice<2> lattice({20, 10});
    const Solids<2> solids(scene, lattice);
    FluidStep<2, float> step(scene.options, solids, true);
    auto particles = seed_particles<2, float>(scene, lattice, solids, int(step.transfer().modes().size()));
    base::Vec3 sum = base::Vec3::Zero();
    for (std::size_t p = 0; p < particles.size(); ++p) {
      particles.component(p, 0)[0] = float(1 + p % 7), particles.component(p, 1)[0] = -2;
      sum += base::Vec3(1 + double(p % 7), -2, 0);
    }
    base::Ledger ledger;
    step.scatter(particles, ledger);
    const double n = double(particles.size());
    ASSERT_GT(n, 200);
    EXPECT_NEAR(step.scattered_sums().mass[0], n, 1e-5 * n);
    EXPECT_NEAR(step.scattered_sums().mass[1], n, 1e-5 * n);
    EXPECT_NEAR((step.scattered_sums().momentum - sum).norm(), 0, 1e-5 * sum.norm());
  }
}

TEST(Watch, SeesEnergyThatNobodyGave) {
  const auto strain = [](State& s) { edit_reals(s, "deformation", kSingle, [](std::int64_t, double* f) { f[0] = 0.8; }); };
  Watch watch(jelly(), 24);
  base::Ledger ledger;
  watch.advance(ledger, {});
  State state = watch.state();
  strain(state);
  watch.restore(state);   // with the memory of less
  try {
    watch.advance(ledger, {});
    FAIL() << "it went on";
  } catch (const base::Error& e) {
    EXPECT_TRUE(says(e.what(), "frame 3: energy: ") && says(e.what(), "elastic ")) << e.what();
  }
}

namespace {

/// A simulation that says what it is told to: totals of the frames after the first, each as often as the frame is done.
class Told final : public Simulation {
 public:
  std::vector<Totals> frames;
  std::vector<Restraint> restraints;   // of each advance
  std::size_t at = 0;
  std::function<void(Totals&, const Restraint&)> change = [](Totals&, const Restraint&) {};

  bool advance(base::Ledger&, const std::function<bool()>&) override {
    restraints.push_back(restraint_);
    ++at;
    change(frames[at], restraint_);
    return true;
  }
  void restrain(const Restraint& r) override { restraint_ = r; }
  Frame frame() const override { return {}; }
  Totals totals() const override { return frames[at]; }
  State state() const override { return {.frame = std::int64_t(at) + 1, .columns = {}}; }
  void restore(const State& s) override { at = std::size_t(s.frame) - 1; }

 private:
  Restraint restraint_;
};

Totals quiet() {
  Totals t;
  t.particles = 100, t.mass = 10, t.kinetic_energy = 4, t.elastic_energy = 1, t.max_speed = 1, t.largest_coefficient = 2, t.least_volume = 0.9, t.most_volume = 1.1;
  return t;
}

/// What a frame with one change is stopped with.
std::string told(const std::function<void(Totals&)>& change) {
  auto simulation = std::make_unique<Told>();
  simulation->frames.assign(3, quiet());
  simulation->change = [&](Totals& t, const Restraint&) { change(t); };
  Told& kept = *simulation;
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  try {
    watch.advance(ledger, {});
    EXPECT_EQ(kept.restraints.size(), 1u);
  } catch (const base::Error& e) {
    EXPECT_EQ(kept.restraints.size(), std::size_t(1 + Watch::kMostRetries));
    EXPECT_EQ(e.complaint().code, base::Exit::unstable);
    return e.what();
  }
  return {};
}

}  // namespace

TEST(Watch, NamesEachLawThatATotalBreaks) {
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

// Shorter steps first; then the carry; then the modes. What was restrained stays so, and the next frame's steps are as long as ever.
TEST(Watch, RestrainsMoreEachTimeAndKeepsWhatHelped) {
  auto simulation = std::make_unique<Told>();
  simulation->frames.assign(9, quiet());
  simulation->change = [](Totals& t, const Restraint& r) { t.kinetic_energy = r.modes < 1 ? 40 : 4; };
  Told& kept = *simulation;
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  watch.advance(ledger, {});
  EXPECT_EQ(watch.totals().retries, 2);
  watch.advance(ledger, {});
  EXPECT_EQ(watch.totals().retries, 0);
  const std::vector<std::pair<int, int>> expected = {{0, 0}, {1, 0}, {2, 1}, {0, 1}};
  ASSERT_EQ(kept.restraints.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_EQ(std::pair(kept.restraints[k].halvings, kept.restraints[k].modes), expected[k]) << k;
}

TEST(Watch, DoesFramesAgainAStatedNumberOfTimesAndThenStops) {
  auto simulation = std::make_unique<Told>();
  simulation->frames.assign(60, quiet());
  simulation->change = [](Totals& t, const Restraint& r) { t.kinetic_energy = r.halvings < 3 ? 40 : 4; };
  Watch watch(jelly(), 24, std::move(simulation));
  base::Ledger ledger;
  std::int64_t retries = 0;
  try {
    for (int f = 0; f < 50; ++f) watch.advance(ledger, {}), retries += watch.totals().retries;
    FAIL() << "it went on";
  } catch (const base::Error& e) {
    EXPECT_EQ(retries, Watch::kMostRetriesOfARun);
    EXPECT_TRUE(says(e.what(), "after 24 frames done again")) << e.what();
  }
}

TEST(Watch, NamesACollapseOfSteps) {
  Scene scene = jelly();
  scene.bodies[0].solid.young = 1e20;
  EXPECT_TRUE(says(stopped_for_good(scene, [](State&) {}), "step: sound asks for a step of"));
  Scene fast = water();
  fast.options.boundary[0] = {Side::periodic, Side::periodic};
  fast.bodies[0].velocity = {1e7, 0, 0};
  EXPECT_TRUE(says(stopped_for_good(fast, [](State&) {}), "step: motion asks for a step of"));
}

TEST(Watch, ChangesNoBitOfWhatBreaksNoLaw) {
  for (const Scene& scene : {jelly(), jelly(kDouble), water()}) {
    Watch watched(scene, 24);
    const auto alone = make_simulation(scene, 24);
    base::Ledger ledger;
    for (int f = 0; f < 6; ++f) {
      watched.advance(ledger, {}), alone->advance(ledger, {});
      EXPECT_EQ(watched.totals().state_hash, alone->totals().state_hash);
      EXPECT_EQ(watched.totals().retries, 0);
    }
  }
}

// Its memory goes with the state: a run that goes on from a checkpoint decides as one that never stopped.
TEST(Watch, GoesOnFromItsStateWithWhatItRemembers) {
  Watch whole(water(), 24), rest(water(), 24);
  base::Ledger ledger;
  for (int f = 0; f < 3; ++f) whole.advance(ledger, {});
  rest.restore(whole.state());
  for (int f = 0; f < 3; ++f) whole.advance(ledger, {}), rest.advance(ledger, {});
  EXPECT_EQ(whole.totals().state_hash, rest.totals().state_hash);
  const Column *a = whole.state().find("watch"), *b = rest.state().find("watch");
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->bytes, b->bytes);
}

TEST(Watch, CountsTheWorkOfCollidersAndOfGravityAlongPeriodicAxes) {
  Scene scene = tank(2, 0.05, base::Vec3::Zero(), {1, 0.5, 0});
  scene.options.boundary = {std::array{Side::periodic, Side::periodic}, std::array{Side::periodic, Side::periodic}, scene.options.boundary[2]};
  scene.options.precision = kDouble;
  scene.effects = {{"gravity", {2, 0, 0}}};
  Watch watch(scene, 10);
  base::Ledger ledger;
  double work = 0;
  for (int f = 0; f < 5; ++f) watch.advance(ledger, {}), work += watch.totals().gravity_work;
  EXPECT_NEAR(watch.totals().kinetic_energy, 0.5 * watch.totals().mass * 1, 1e-6 * watch.totals().mass);   // a for half a second
  EXPECT_NEAR(work, watch.totals().kinetic_energy, 1e-6 * work);
}

}  // namespace sim
