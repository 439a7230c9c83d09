// The watch of every run: each law is broken once, and told by name and place; a step that breaks one is done again; what breaks none keeps its bits.
#include "sim/watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim/blame.h"
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

std::function<void(State&)> with_coefficient(std::int64_t row, std::size_t number, double value) {
  return [=](State& s) { edit_reals(s, "coefficients", kSingle, [&](std::int64_t r, double* v) { if (r == row) v[number] = value; }); };
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
  const std::string solid = stopped_for_good(jelly(), with_coefficient(7, 0, kNone));
  const std::string liquid = stopped_for_good(water(), with_coefficient(7, 0, kNone));
  EXPECT_TRUE(says(solid, "frame 2: finite: p2g: particle 7 of body left, cell (")) << solid;
  EXPECT_TRUE(says(solid, "m, has no finite velocity, with all of the frame's steps 8 times as short too; well up to frame 1 (")) << solid;
  EXPECT_TRUE(says(liquid, "frame 2: finite: sort: particle 7 at cell (")) << liquid;
}

TEST(Watch, NamesAParticleThatGoesTooFar) {
  const std::string line = stopped_for_good(jelly(), [](State& s) {
    edit<double>(s, "limits", [](std::int64_t, double* v) { *v = 1e-3; });
    edit_reals(s, "coefficients", kSingle, [](std::int64_t r, double* v) { if (r < 40) v[0] = 1e7; });
  });
  EXPECT_TRUE(says(line, "motion: g2p: particle ") && says(line, " of body left, cell (")) << line;
}

namespace {

/// Two bodies in the middle of a step: forces are on the grid, and no particle knows of them.
struct HalfAStep {
  Scene scene = jelly(kDouble);
  Solids<2> solids{scene, Lattice<2>({20, 20}, {true, true})};
  std::vector<Group<2, double>> groups = seed_groups<2, double>(scene, solids);
  SolidStep<2, double> step{scene, solids};
  base::Ledger ledger;
  HalfAStep() {
    step.scatter(1e-3, groups, ledger);
    step.update(1e-3, base::Vec3(0, -9.81, 0), groups, ledger);
  }
};

/// What nodes and particles of two bodies hold after P2G, with a change to the particles in between.
std::string compared_after(const std::function<void(std::vector<Group<2, double>>&)>& change) {
  HalfAStep half;
  change(half.groups);
  MassAndMomentum particles;
  for (const auto& g : half.groups)
    for (std::size_t p = 0; p < g.particles.size(); ++p) {
      particles.mass.head<2>().array() += g.particles.mass;
      particles.momentum.head<2>() += g.particles.mass * g.particles.velocity(p);
    }
  EXPECT_GT(particles.mass.x(), 100);
  try {
    check_p2g(2, Places::nodes, {base::Vec3(half.step.scattered().mass, half.step.scattered().mass, 0), half.step.scattered().momentum}, particles,
              particles.mass.x(), /*single_precision=*/false);
  } catch (const Unstable& e) {
    return e.what();
  }
  return {};
}

}  // namespace

TEST(Watch, SeesParticlesThatDisappearAndMomentumThatComesOfNothing) {
  EXPECT_EQ(compared_after([](auto&) {}), "");
  const std::string mass = compared_after([](auto& groups) { groups[1].particles.cell.pop_back(), groups[1].particles.offset.pop_back(),
                                                            groups[1].particles.id.pop_back(); });
  EXPECT_TRUE(says(mass, "frame 2: mass: p2g: nodes hold ")) << mass;
  const std::string momentum = compared_after([](auto& groups) { groups[1].particles.component(3, 1)[0] += 1e-3; });
  EXPECT_TRUE(says(momentum, "frame 2: momentum: p2g: nodes have ") && says(momentum, "along y")) << momentum;
}

// The same as a run meets them: stress so large that what is left of its sum, which should be 0, is more than the bodies have.
TEST(Watch, StopsForMomentumThatStressMakes) {
  const std::string line = stopped_for_good(jelly(), [](State& s) { edit_reals(s, "stress", kSingle,
                                                                               [](std::int64_t r, double* v) { if (r == 11) v[0] = v[2] = 1e22; });
  });
  EXPECT_TRUE(says(line, "frame 2: momentum: p2g: nodes have ") && says(line, "; at the frame's start the largest is of particle ") &&
              says(line, "; well up to frame 1 (carry ")) << line;
}

TEST(Watch, StopsForMomentumThatModesOfALiquidMake) {
  Scene scene = water();
  scene.options.kernel = Kernel::quadratic;   // whose slopes cancel to rounding; the linear one's exactly
  const std::string line = stopped_for_good(scene, with_coefficient(7, 2, 1e30));
  EXPECT_TRUE(says(line, "frame 2: momentum: p2g: faces across x have ") && says(line, "the largest is of particle 7 of body water, cell (")) << line;
}

TEST(Watch, NamesAPressureThatDoesNotConverge) {
  Scene scene = water();
  scene.options.cell = 0.005;   // so many cells that iterations solve it
  scene.options.pressure_tolerance = 1e-30;
  const std::string line = stopped_for_good(scene, [](State&) {});
  EXPECT_TRUE(says(line, "frame 2: pressure: ") && says(line, "iterations, asked 1e-30") &&
              says(line, "; well up to frame 1 (a larger sim.pressure_tolerance")) << line;
}

TEST(Watch, MeasuresWhatParticlesTakeBack) {
  HalfAStep half;
  const StepLimits limits = half.step.gather(1e-3, 0, half.groups, half.ledger);
  base::Vec3 momentum = base::Vec3::Zero();
  for (const auto& g : half.groups)
    for (std::size_t p = 0; p < g.particles.size(); ++p) momentum.head<2>() += g.particles.mass * g.particles.velocity(p);
  ASSERT_GT(momentum.norm(), 0.1);
  EXPECT_NEAR((limits.momentum - momentum).norm(), 0, 1e-12 * 100);
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
    step.scatter(particles, 1e-3, ledger);
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

// A film's energy is that of a part of a cell, to which a surface is known.
TEST(Watch, ComparesNoEnergyOfAFilmBelowWhatACellResolves) {
  for (const double thick : {0.01, 0.025, 0.05}) {
    Scene scene = tank(2, 0.05, {0.3, 0, 0}, {0.7, thick, 0});
    apply({Transfer::polypic, 0, Kernel::linear, Carry::fixed, kSingle}, scene.options);
    add_gravity(scene);
    Watch watch(scene, 24);
    base::Ledger ledger;
    for (int f = 0; f < 96; ++f) {
      watch.advance(ledger, {});
      ASSERT_EQ(watch.totals().retries, 0) << thick << " " << f;
    }
  }
}

// A first step as long as the frame, for a state that says nothing moves: half of it is short enough, and the rest of the frame is as ever.
TEST(Watch, GoesBackToTheStartOfAStepThatMovesAParticleTooFar) {
  Scene scene = jelly();
  scene.bodies[0].velocity = {3, 0, 0}, scene.bodies[1].velocity = {3, 0, 0};
  Watch watch(scene, 24);
  State state = watch.state();
  edit<double>(state, "limits", [](std::int64_t, double* v) { *v = 1e-3; });
  base::Ledger ledger;
  std::vector<std::uint64_t> hashes;
  for (int again = 0; again < 2; ++again) {
    watch.restore(state);
    watch.advance(ledger, {});
    EXPECT_EQ(watch.totals().retries, 2);
    hashes.push_back(watch.totals().state_hash);
    for (int f = 0; f < 3; ++f) {
      watch.advance(ledger, {});
      EXPECT_EQ(watch.totals().retries, 0);
    }
    EXPECT_NEAR(watch.totals().linear_momentum.x(), 3 * watch.totals().mass, 1e-3 * watch.totals().mass);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

// Counters, colliders and what the volume correction aims at included.
TEST(Watch, GoesBackWithinAFrameToTheBit) {
  Scene flip = jelly(), pushed = water(), full = jelly(kDouble), box = water();
  flip.bodies[0].transfer = "flip", flip.bodies[1].transfer = "polypic";
  pushed.colliders = {box_collider("piston", {-1, -1, 0}, {0.05, 2, 0}, {0.5, 0, 0})};
  box.bodies[0].shape.box = box.options.domain, box.options.splitting = Splitting::reflection;   // a motion knows the one before
  for (const Scene& scene : {flip, full, water(), pushed, box}) {
    const auto simulation = make_simulation(scene, 3);
    base::Ledger ledger;
    const auto two_steps = [&](double left) {
      for (int n = 0; n < 2; ++n) left = simulation->advance_step(left, ledger);
      return left;
    };
    const double left = simulation->advance_step(simulation->begin_frame(), ledger);
    ASSERT_GT(left, 0);
    const auto start = simulation->moment();
    const std::uint64_t before = simulation->totals().state_hash;
    const double rest = two_steps(left);
    const Totals once = simulation->totals();
    EXPECT_NE(once.state_hash, before);
    simulation->go_back(*start);
    EXPECT_EQ(simulation->totals().state_hash, before);
    EXPECT_EQ(two_steps(left), rest);
    const Totals twice = simulation->totals();
    EXPECT_EQ(twice.state_hash, once.state_hash);
    EXPECT_EQ(twice.substeps, once.substeps);
    EXPECT_EQ(twice.collider_work, once.collider_work);
    EXPECT_EQ(twice.pushed_out, once.pushed_out);
    EXPECT_EQ(twice.limited_modes, once.limited_modes);
    EXPECT_EQ(twice.pressure_iterations, once.pressure_iterations);
  }
}

// What stands in the sentence of a run that stops: law and figures, particle, body, cell and position, the last frame that was well, what to change.
TEST(Watch, NamesTheParticleThatStandsOut) {
  Scene scene = jelly();
  const auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  for (int f = 0; f < 4; ++f) simulation->advance(ledger, {});   // until they are stored in another order than that of their ids
  State state = simulation->state();
  const std::vector<double> id = reals(state, "id");
  edit_reals(state, "coefficients", kSingle, [&](std::int64_t r, double* v) { if (id[std::size_t(r)] == 150) v[0] = 7;
  if (id[std::size_t(r)] == 9) v[4] = -50; });
  edit_reals(state, "deformation", kSingle, [&](std::int64_t r, double* f) { if (r == 5) f[0] = -0.9; });
  simulation->restore(state);
  const auto who = [&](Suspect s) { return find_culprit(s, scene, *simulation); };
  EXPECT_TRUE(says(who(Suspect::fastest).text, "the fastest is particle 150 of body right, cell (1")) << who(Suspect::fastest).text;
  EXPECT_TRUE(says(who(Suspect::fastest).text, "m, 7 m/s") || says(who(Suspect::fastest).text, "m, 7.0")) << who(Suspect::fastest).text;
  EXPECT_EQ(who(Suspect::fastest).body, 1);
  EXPECT_TRUE(says(who(Suspect::largest_coefficient).text,
                   "the largest is of particle 9 of body left, cell (")) << who(Suspect::largest_coefficient).text;
  EXPECT_TRUE(says(who(Suspect::largest_coefficient).text, "50 m/s")) << who(Suspect::largest_coefficient).text;
  EXPECT_TRUE(says(who(Suspect::most_deformed).text, "the most deformed is particle 5 of body left, cell (") &&
              says(who(Suspect::most_deformed).text, "J = 0.1")) << who(Suspect::most_deformed).text;
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
// A tank upside down has no more energy to lose than one that stands.
TEST(Watch, CountsEnergyFromTheSideThatGravityPointsTo) {
  std::vector<double> starts;
  for (const double up : {-1.0, 1.0}) {
    Scene scene = tank(2, 0.05, {0, up < 0 ? 0 : 0.8, 0}, {1, up < 0 ? 0.2 : 1, 0});
    scene.options.domain = {base::Vec3::Zero(), base::Vec3(1, 1, 0)};
    scene.options.seeding = Seeding::regular;
    scene.effects = {{"gravity", {0, up * 9.81, 0}}};
    std::vector<double> memory;
    const Watch watch(scene, 24);
    ASSERT_TRUE(read_column<double>(watch.state(), "watch", 9, 1, memory));
    starts.push_back(memory[0]);
  }
  EXPECT_NEAR(starts[0], 200 * 9.81 * 0.1, 1e-6);   // mass, gravity and middle
  EXPECT_NEAR(starts[1], starts[0], 1e-6);
}

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
