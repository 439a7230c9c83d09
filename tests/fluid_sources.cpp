// Sources: who is born, when and where, and what the liquid around them sees.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "sim/fluid/sources.h"
#include "sim/simulation.h"
#include "sim/transfer/dimension.h"
#include "sim/watch.h"
#include "tests/threads.h"

namespace sim {
namespace {

using base::Vec3;

Source source(const base::Box& box, const Vec3& velocity) {
  Source s;
  s.name = "spout";
  s.shape.box = box;
  s.velocity = velocity;
  return s;
}

Body water(const base::Box& box, const Vec3& velocity = Vec3::Zero()) {
  Body body;
  body.name = "water";
  body.shape.box = box;
  body.velocity = velocity;
  return body;
}

/// A metre along x, 0.4 m along the others, in cells of 5 cm, with regular seeding in double precision.
Scene room(int dimension) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = dimension;
  o.domain = {Vec3::Zero(), dimension == 2 ? Vec3(1, 0.4, 0) : Vec3(1, 0.4, 0.4)};
  o.cell = 0.05;
  o.particles_per_cell = dimension == 2 ? 4 : 8;
  o.precision = Precision::double_precision;
  o.seeding = Seeding::regular;
  return scene;
}

/// A spout in the air without gravity: 0.2 m wide along every axis.
Scene jet(int dimension) {
  Scene scene = room(dimension);
  scene.options.volume_correction = 0;
  scene.options.pressure_tolerance = 1e-10;
  const Vec3 velocity = dimension == 2 ? Vec3(0.9, 0.07, 0) : Vec3(0.9, 0.07, -0.05);   // no wall is near
  scene.sources = {source({dimension == 2 ? Vec3(0.1, 0.1, 0) : Vec3(0.1, 0.1, 0.1), dimension == 2 ? Vec3(0.3, 0.3, 0) : Vec3(0.3, 0.3, 0.3)}, velocity)};
  return scene;
}

/// A pool 0.2 m deep into which a spout pours from above.
Scene tap(int dimension) {
  Scene scene = room(dimension);
  Options& o = scene.options;
  o.precision = Precision::single_precision, o.seeding = Seeding::jitter;
  o.domain.upper = dimension == 2 ? Vec3(1, 0.8, 0) : Vec3(1, 0.4, 0.8);
  const int up = dimension - 1;
  Vec3 top = o.domain.upper, lower = Vec3(0.4, 0.15, 0.15), upper = Vec3(0.55, 0.3, 0.3);
  top[up] = 0.2;
  lower[up] = 0.65, upper[up] = 0.75;
  if (dimension == 2) lower.z() = upper.z() = 0;
  scene.bodies = {water({Vec3::Zero(), top})};
  scene.sources = {source({lower, upper}, Vec3(0.3, 0, 0) - Vec3::Unit(up))};
  scene.effects = {{.acceleration = -9.81 * Vec3::Unit(up)}};
  return scene;
}

void advance(Simulation& simulation, int frames) {
  base::Ledger ledger;
  for (int f = 0; f < frames; ++f) simulation.advance(ledger, {});
}

// What comes in at one end goes out at the other, and what is between moves as the source does, although gravity and pressure would let it.
TEST(FluidSources, AChannelFlowsAsItsSourceDoes) {
  for (const int dimension : {2, 3})
    for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
      Scene scene = room(dimension);
      scene.options.boundary[0][1] = Side::open;
      scene.options.splitting = splitting;
      const Vec3 speed(0.5, 0, 0), end = scene.options.domain.upper;
      scene.sources = {source({Vec3::Zero(), Vec3(0.1, end.y(), end.z())}, speed)};
      scene.bodies = {water({Vec3(0.1, 0, 0), end})};   // at rest: it is pushed from the first step on
      const auto simulation = make_simulation(scene, 10);
      const std::int64_t column = simulation->totals().particles / 20;
      base::Ledger ledger;
      for (int f = 0; f < 8; ++f) {
        simulation->advance(ledger, {});
        const Totals t = simulation->totals();
        EXPECT_EQ(t.poured, column) << dimension;   // 0.05 m in a tenth of a second: a column of cells
        EXPECT_EQ(t.left, column) << dimension;
        EXPECT_NEAR(t.volume_drift.value(), 0, 0.0125);   // a quarter of a column: that near its end is known
      }
      const Frame frame = simulation->frame();
      ASSERT_EQ(std::int64_t(frame.id.size()), 20 * column);
      for (const base::Vec3f& v : frame.velocity) ASSERT_LE((v.cast<double>() - speed).norm(), 1e-5);
    }
}

// Whatever particles carry, and where the sides across go on at the other one: the same channel, without walls along it, at the pressure of none.
TEST(FluidSources, AChannelOfAnyTransferFlowsBetweenPeriodicSides) {
  for (const int dimension : {2, 3})
    for (const Transfer transfer : {Transfer::pic, Transfer::flip, Transfer::apic, Transfer::polypic})
      for (const Kernel kernel : {Kernel::linear, Kernel::quadratic}) {
        Scene scene = room(dimension);
        Options& o = scene.options;
        o.boundary[0][1] = Side::open;
        for (int a = 1; a < dimension; ++a) o.boundary[std::size_t(a)] = {Side::periodic, Side::periodic};
        o.transfer = transfer, o.kernel = kernel, o.write.pressure = true;
        const Vec3 speed(0.5, 0.31, 0), end = o.domain.upper;
        scene.sources = {source({Vec3::Zero(), Vec3(0.1, end.y(), end.z())}, speed)};
        scene.bodies = {water({Vec3(0.1, 0, 0), end}, speed)};
        const auto simulation = make_simulation(scene, 10);
        const std::int64_t column = simulation->totals().particles / 20;
        base::Ledger ledger;
        for (int f = 0; f < 4; ++f) {
          simulation->advance(ledger, {});
          ASSERT_EQ(simulation->totals().poured, column) << dimension << int(transfer) << int(kernel);
          ASSERT_EQ(simulation->totals().left, column) << dimension << int(transfer) << int(kernel);
        }
        const Frame frame = simulation->frame();
        for (const base::Vec3f& v : frame.velocity) ASSERT_LE((v.cast<double>() - speed).norm(), 1e-5) << dimension << int(transfer) << int(kernel);
        ASSERT_EQ(frame.pressure.size(), frame.id.size());
        for (const float p : frame.pressure) ASSERT_LE(std::abs(p), 0.1);   // 1000 v^2 / 2 is 170 Pa
      }
}

// Under a spout the pressure is what weight and jet make it, and of a particle born since the last pressure solve it is a number, too.
TEST(FluidSources, PressureIsWrittenOfAllThatAreThere) {
  for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
    Scene scene = tap(3);
    scene.options.splitting = splitting, scene.options.write.pressure = true;
    const auto simulation = make_simulation(scene, 24);
    base::Ledger ledger;
    double mean = 0;
    int falling = 0;
    for (int f = 0; f < 12; ++f) {
      simulation->advance(ledger, {});
      const Frame frame = simulation->frame();
      ASSERT_EQ(frame.pressure.size(), frame.id.size());
      double deep = 0, number = 0;
      for (std::size_t p = 0; p < frame.id.size(); ++p) {
        ASSERT_TRUE(std::isfinite(frame.pressure[p])) << frame.id[p];
        if (frame.position[p].z() < 0.05f) deep += double(frame.pressure[p]), ++number;
        const bool in_the_air = frame.position[p].z() > 0.4f && frame.position[p].z() < 0.6f;
        if (!in_the_air) continue;
        ++falling;
        EXPECT_LE(std::abs(frame.pressure[p]), 300) << frame.id[p];
      }
      mean += deep / number / 12;
    }
    EXPECT_GT(falling, 100);
    EXPECT_NEAR(mean, 1000 * 9.81 * 0.175, 170);   // of 1720 Pa, in the mean over splashes
  }
}

// A jet that nothing acts on is a cut-out of a lattice that moves: no particle is born twice or missed, whatever the way the flow takes through cells.
TEST(FluidSources, AFreeJetIsACutOutOfALatticeThatMoves) {
  for (const int dimension : {2, 3}) {
    const Scene scene = jet(dimension);
    const auto simulation = make_simulation(scene, 10);
    const double side = std::pow(4.0, dimension - 1), start = std::pow(4.0, dimension) * double(scene.options.particles_per_cell);
    ASSERT_EQ(double(simulation->totals().particles), start);
    advance(*simulation, 5);
    const Frame frame = simulation->frame();
    const Vec3 velocity = scene.sources[0].velocity;
    const double rate = velocity.cwiseAbs().sum() / scene.options.cell * side * double(scene.options.particles_per_cell);   // [1/s]
    EXPECT_NEAR(double(frame.id.size()), start + 0.5 * rate, 2 * side) << dimension;
    std::map<std::vector<long>, int> seen;
    for (std::size_t p = 0; p < frame.id.size(); ++p) {
      const Vec3 seed = (frame.position[p].cast<double>() - frame.time * velocity) / (scene.options.cell / 2);   // [places of the lattice]
      std::vector<long> place;
      for (int a = 0; a < dimension; ++a) {
        place.push_back(std::lround(seed[a] - 0.5));
        ASSERT_NEAR(seed[a] - 0.5, double(place.back()), 1e-4);
      }
      ASSERT_EQ(++seen[place], 1);
    }
  }
}

TEST(FluidSources, WhoIsBornDoesNotDependOnTheLengthOfSteps) {
  const auto at_the_end = [](double cfl) {
    Scene scene = jet(3);
    scene.options.seeding = Seeding::jitter;
    scene.options.cfl = cfl;
    Source later = scene.sources[0];
    later.name = "later", later.shape.box = base::Box{Vec3(0.7, 0.1, 0.1), Vec3(0.8, 0.2, 0.2)}, later.velocity = Vec3(-0.2, 0, 0.4), later.start = 0.13;
    scene.sources.push_back(later);
    scene.options.boundary = {{{Side::open, Side::open}, {Side::open, Side::open}, {Side::open, Side::open}}};
    const auto simulation = make_simulation(scene, 10);
    advance(*simulation, 3);
    return simulation->frame();
  };
  const Frame a = at_the_end(1), b = at_the_end(0.23);
  ASSERT_GT(a.id.size(), 1000u);
  ASSERT_EQ(a.id, b.id);
  const Shape spout = jet(3).sources[0].shape;
  int inside = 0;   // what has left it feels pressure, in which chance has a part
  for (std::size_t p = 0; p < a.id.size(); ++p) {
    if (spout.distance(a.position[p].cast<double>()) > -1e-3) continue;
    ++inside;
    ASSERT_LE((a.position[p] - b.position[p]).norm(), 1e-6f) << a.id[p];
  }
  EXPECT_GT(inside, 400);
}

// Rows of a lattice that moves along the diagonal meet the periodic side exactly, where the two images round differently.
TEST(FluidSources, ARowThatMeetsAPeriodicSideIsBornOnce) {
  Scene scene = room(2);
  scene.options.boundary[1] = {Side::periodic, Side::periodic};
  constexpr std::size_t kRows = 16;
  for (const double speed : {0.3, 0.7, 1.1}) {
    scene.sources = {source({Vec3(0.1, 0, 0), Vec3(0.3, 0.4, 0)}, Vec3(speed, speed, 0))};
    const Solids<2> solids(scene, lattice_of<2>(scene.options));
    const Sources<2> sources(scene, solids);
    const double layer = 0.5 * scene.options.cell / speed;   // [s]
    for (int n = 1; n <= 40; ++n) EXPECT_EQ(sources.pour(0, (n - 1) * layer, n * layer).size(), kRows) << n << " of " << speed;
  }
}

TEST(FluidSources, AnyNumberOfThreadsAndARestartGiveTheSameBits) {
  for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
    Scene scene = tap(3);
    scene.options.splitting = splitting;
    const auto hash = [&](int threads) {
      return on_threads(threads, [&] {
        const auto simulation = make_simulation(scene, 24);
        advance(*simulation, 6);
        return simulation->totals().state_hash;
      });
    };
    const std::uint64_t one = hash(1);
    EXPECT_EQ(one, hash(2));
    EXPECT_EQ(one, hash(4));
    const auto first = make_simulation(scene, 24), second = make_simulation(scene, 24);
    advance(*first, 3);
    second->restore(first->state());
    EXPECT_EQ(second->totals().particles, first->totals().particles);
    advance(*second, 3);
    EXPECT_EQ(one, second->totals().state_hash);
  }
}

// A step taken back takes back who was born in it: they come again with the same numbers.
TEST(FluidSources, GoingBackUndoesBirths) {
  for (const Transfer transfer : {Transfer::flip, Transfer::polypic}) {
    Scene scene = tap(3);
    scene.options.transfer = transfer, scene.options.write.pressure = true;
    const auto hash = [&](bool goes_back) {
      const auto simulation = make_simulation(scene, 24);
      base::Ledger ledger;
      std::int64_t undone = 0;
      for (int f = 0; f < 4; ++f) {
        for (double left = simulation->begin_frame(); left > 0;) {
          if (goes_back) {
            const auto before = simulation->moment();
            const std::int64_t particles = simulation->totals().particles;
            for (double rest = left; rest > 0;) rest = simulation->advance_step(rest, ledger);   // to the frame's end
            undone += simulation->totals().particles - particles;
            simulation->go_back(*before);
            EXPECT_EQ(simulation->totals().particles, particles);
          }
          left = simulation->advance_step(left, ledger);
        }
        simulation->end_frame(ledger);
      }
      EXPECT_EQ(undone > 0, goes_back);
      return simulation->totals().state_hash;
    };
    EXPECT_EQ(hash(false), hash(true)) << int(transfer);
  }
}

TEST(FluidSources, OneThatBeginsLaterAndEndsGivesWhatItsTimeAllows) {
  Scene scene = jet(2);
  scene.bodies = {water({Vec3(0.8, 0.3, 0), Vec3(0.9, 0.4, 0)})};
  scene.sources[0].velocity = Vec3(0.5, 0, 0);
  scene.sources[0].start = 0.15, scene.sources[0].end = 0.45;
  const auto simulation = make_simulation(scene, 10);
  const std::int64_t before = simulation->totals().particles;
  EXPECT_EQ(before, 16);
  std::vector<std::int64_t> poured;
  base::Ledger ledger;
  for (int f = 0; f < 6; ++f) simulation->advance(ledger, {}), poured.push_back(simulation->totals().poured);
  EXPECT_EQ(poured[0], 0);
  EXPECT_EQ(poured[5], 0);
  // 16 cells of its own, and 0.15 m of a flow 4 cells wide: a step that has begun when it should has not poured before.
  EXPECT_EQ(simulation->totals().particles, before + 4 * (16 + 12));
  int moving = 0;
  for (const base::Vec3f& v : simulation->frame().velocity) moving += v.x() > 0.4f;
  EXPECT_EQ(moving, 4 * (16 + 12));   // all of it moves on, also what was in it at its end
}

// A tap that is opened twice is two sources of one shape.
TEST(FluidSources, TwoOfOneShapePourOneAfterTheOther) {
  Scene scene = jet(2);
  scene.sources[0].velocity = Vec3(0.5, 0, 0);
  scene.sources.push_back(scene.sources[0]);
  scene.sources[0].end = 0.1, scene.sources[1].start = 0.5, scene.sources[1].name = "again";
  const auto simulation = make_simulation(scene, 10);
  advance(*simulation, 6);
  EXPECT_EQ(simulation->totals().particles, 4 * (2 * 16 + 4 + 4));
}

// The step ends where a source begins, and goes by its speed from there on: the jet meets the plate in front of it.
TEST(FluidSources, OneThatBeginsWithinAFrameJumpsOverNothing) {
  Scene scene = room(2);
  scene.options.seeding = Seeding::jitter;
  scene.bodies = {water({Vec3(0, 0, 0), Vec3(0.1, 0.1, 0)})};
  scene.sources = {source({Vec3(0.1, 0.15, 0), Vec3(0.2, 0.25, 0)}, Vec3(10, 0, 0))};
  scene.sources[0].start = 0.02;
  Collider plate;
  plate.name = "plate", plate.shape.box = base::Box{Vec3(0.35, 0, 0), Vec3(0.4, 0.4, 0)};
  scene.colliders = {plate};
  const auto simulation = make_simulation(scene, 20);
  advance(*simulation, 1);
  const Totals t = simulation->totals();
  EXPECT_GE(t.substeps, 6);   // 0.3 m in cells of 0.05
  EXPECT_GT(t.poured, 16);
  for (const base::Vec3f& x : simulation->frame().position) ASSERT_LT(x.x(), 0.351f);
}

// What a lid covers, or stands behind one, is no source while it does: nothing is pressed together.
TEST(FluidSources, ALidThatSlidesUnderATapShutsIt) {
  Scene scene = tap(2);
  scene.sources[0].velocity = Vec3(0, -1, 0);
  Collider lid;
  lid.name = "lid", lid.shape.box = base::Box{Vec3(-0.6, 0.55, 0), Vec3(0.2, 0.65, 0)}, lid.velocity = Vec3(0.4, 0, 0);
  scene.colliders = {lid};
  const auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  std::int64_t most = 0, shut = 0;
  for (int f = 0; f < 60; ++f) {   // under it from 0.5 s to 2 s
    simulation->advance(ledger, {});
    const Totals t = simulation->totals();
    most = std::max(most, t.poured), shut += t.poured == 0;
    EXPECT_TRUE(f <= 24 || f >= 44 || t.poured == 0) << f;
  }
  EXPECT_GT(most, 10);
  EXPECT_GE(shut, 20);
  EXPECT_LT(shut, 45);
  const Frame frame = simulation->frame();
  int inside = 0;
  for (const base::Vec3f& x : frame.position) inside += scene.sources[0].shape.distance(x.cast<double>()) < 0;
  EXPECT_LE(inside, 6 * scene.options.particles_per_cell * 3 / 2);
}

// What a spring lifts, the source lifts: energy that the watch does not mind, in pools of any depth.
TEST(FluidSources, ASpringPoursUpwardsUnderTheWatch) {
  for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
    Scene scene = tap(2);
    scene.options.splitting = splitting;
    scene.bodies.clear();
    scene.sources = {source({Vec3(0.4, 0, 0), Vec3(0.6, 0.2, 0)}, Vec3(0, 0.4, 0))};
    Watch watch(scene, 24, make_simulation(scene, 24));
    base::Ledger ledger;
    std::int64_t retries = 0;
    for (int f = 0; f < 120; ++f) watch.advance(ledger, {}), retries += watch.totals().retries;
    EXPECT_EQ(retries, 0);
    EXPECT_GT(watch.totals().volume, 0.4);
  }
}

// What each pass adds to the energy is, with births, the change of the whole.
TEST(FluidSources, TheAuditAddsUp) {
  for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
    Scene scene = tap(2);
    scene.options.precision = Precision::double_precision;
    scene.options.splitting = splitting, scene.options.audit = true;
    const auto simulation = make_simulation(scene, 24);
    base::Ledger ledger;
    for (int f = 0; f < 12; ++f) {
      const double before = simulation->totals().energy();
      simulation->advance(ledger, {});
      const Totals t = simulation->totals();
      double sum = 0;
      for (const auto& [stage, change] : t.energy_changes) sum += change;
      ASSERT_TRUE(t.energy_changes.contains("source"));
      EXPECT_GT(t.poured_energy, 10);
      EXPECT_NEAR(sum, t.energy() - before, 1e-9 * t.energy());
    }
  }
}

// Water under the level: it rises by what is poured, none of it is drawn into the spout from behind, and the spout stays as full as it was.
TEST(FluidSources, ASpoutUnderWaterDrawsNothingIn) {
  for (const int dimension : {2, 3}) {
    Scene scene = tap(dimension);
    const int up = dimension - 1;
    const Vec3 lower = dimension == 2 ? Vec3(0.4, 0.05, 0) : Vec3(0.4, 0.15, 0.05), upper = dimension == 2 ? Vec3(0.55, 0.15, 0) : Vec3(0.55, 0.25, 0.15);
    scene.sources = {source({lower, upper}, Vec3(0.4, 0, 0))};
    const auto simulation = make_simulation(scene, 24);
    const Totals start = simulation->totals();
    const std::int64_t held = (dimension == 2 ? 6 : 12) * scene.options.particles_per_cell;
    std::int64_t poured = 0;
    base::Ledger ledger;
    for (int f = 0; f < 36; ++f) simulation->advance(ledger, {}), poured += simulation->totals().poured;
    const Totals t = simulation->totals();
    ASSERT_GT(poured, 3 * held);
    EXPECT_EQ(t.particles, start.particles + poured);
    EXPECT_LE(std::abs(*t.volume_drift), 0.02) << dimension;
    const Frame frame = simulation->frame();
    std::int64_t inside = 0, foreign = 0;
    for (std::size_t p = 0; p < frame.id.size(); ++p) {
      const Vec3 x = frame.position[p].cast<double>();
      if (scene.sources[0].shape.distance(x) >= 0) continue;
      ++inside;
      foreign += frame.id[p] < start.particles;
      EXPECT_NEAR(frame.velocity[p].x(), 0.4, 1e-5);
      EXPECT_NEAR(frame.velocity[p][up], 0, 1e-5);
    }
    EXPECT_NEAR(double(inside), double(held), 0.1 * double(held)) << dimension;
    EXPECT_LE(foreign, held / 20);
  }
}

// The watch counts what comes, and its energy: a run is not stopped for it, and reflection goes on.
TEST(FluidSources, ATapFillsAPoolUnderTheWatch) {
  for (const int dimension : {2, 3})
    for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
      Scene scene = tap(dimension);
      scene.options.splitting = splitting;
      Watch watch(scene, 24, make_simulation(scene, 24));
      base::Ledger ledger;
      std::int64_t poured = 0, fallbacks = 0, steps = 0, retries = 0;
      const double before = double(watch.totals().particles);
      double drift = 0;   // in the mean of the second half: in a splash of so few cells it goes from -1 % to 12 %, in the mean 2 to 7 % (3-D 2 to 4 %)
      for (int f = 0; f < 48; ++f) {
        watch.advance(ledger, {});
        const Totals& t = watch.totals();
        ASSERT_TRUE(t.volume_drift);
        EXPECT_LE(std::abs(*t.volume_drift), 0.2) << dimension;
        if (f >= 24) drift += *t.volume_drift / 24;
        poured += t.poured, fallbacks += t.splitting_fallbacks, steps += t.substeps, retries += t.retries;
      }
      const Totals& t = watch.totals();
      EXPECT_EQ(double(t.particles), before + double(poured));
      EXPECT_GT(double(poured), 0.1 * before);
      EXPECT_EQ(retries, 0) << dimension;
      EXPECT_LE(fallbacks, steps / 10) << dimension;
      EXPECT_LE(t.max_speed, 6) << dimension;
      EXPECT_LE(std::abs(drift), dimension == 2 ? 0.09 : 0.05) << dimension;
    }
}

}  // namespace
}  // namespace sim
