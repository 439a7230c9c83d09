// The liquid as a whole: what it conserves, on any number of threads, and its known solutions.
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "sim/fluid/poisson.h"
#include "sim/fluid/pressure.h"
#include "sim/simulation.h"
#include "tests/threads.h"
#include "tests/transfer_cases.h"

namespace sim {
namespace {

Scene tank(double cell) {
  Scene scene;
  scene.options.domain = {base::Vec3(0, 0, 0), base::Vec3(1, 0.5, 0.5)};
  scene.options.cell = cell;
  Body column;
  column.name = "column";
  column.shape.box = base::Box{base::Vec3(0, 0, 0), base::Vec3(0.4, 0.5, 0.4)};
  scene.bodies = {column};
  Collider post;
  post.name = "post";
  post.shape.box = base::Box{base::Vec3(0.6, 0.15, 0), base::Vec3(0.7, 0.35, 0.2)};
  scene.colliders = {post};
  scene.effects = {Effect{}};
  return scene;
}

Totals run(const Scene& scene, int frames, std::vector<Totals>* history = nullptr) {
  auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  if (history) history->push_back(simulation->totals());
  for (int f = 0; f < frames; ++f) {
    EXPECT_TRUE(simulation->advance(ledger, {}));
    if (history) history->push_back(simulation->totals());
  }
  return simulation->totals();
}

TEST(Liquid, DamBreakNeverGainsEnergy) {
  for (const Transfer transfer : {Transfer::pic, Transfer::flip, Transfer::apic, Transfer::polypic})
    for (const Kernel kernel : {Kernel::linear, Kernel::quadratic}) {
      Scene scene = tank(0.05);
      scene.options.transfer = transfer;
      scene.options.kernel = kernel;
      std::vector<Totals> history;
      run(scene, 24, &history);
      const double start = history.front().kinetic_energy + history.front().potential_energy;
      ASSERT_GT(start, 100);
      double peak_motion = 0;
      for (const Totals& t : history) {
        EXPECT_LE(t.kinetic_energy + t.potential_energy, 1.005 * start) << "transfer " << int(transfer) << " kernel " << int(kernel) << " t = " << t.time;
        EXPECT_EQ(t.mass, history.front().mass);
        peak_motion = std::max(peak_motion, t.kinetic_energy);
      }
      EXPECT_GT(peak_motion, 0.1 * start);
    }
}

TEST(Liquid, NeverGainsEnergyWithAnyNumberOfModes) {
  for (const Kernel kernel : {Kernel::linear, Kernel::quadratic})
    for (std::int64_t modes = 1; modes <= (kernel == Kernel::linear ? 8 : 27); ++modes) {
      Scene scene = tank(0.1);
      scene.options.kernel = kernel;
      scene.options.modes.count = modes;
      scene.options.precision = modes % 2 ? Precision::double_precision : Precision::single_precision;
      std::vector<Totals> history;
      run(scene, 10, &history);
      const double start = history.front().potential_energy;
      ASSERT_GT(start, 100);
      for (const Totals& t : history) EXPECT_LE(t.kinetic_energy + t.potential_energy, 1.005 * start) << "kernel " << int(kernel) << " modes " << modes;
      EXPECT_GT(history.back().kinetic_energy, 0.1 * start);
    }
}

TEST(Liquid, HasTheSameBitsOnAnyNumberOfThreads) {
  std::uint64_t hash[3];
  for (int i = 0; i < 3; ++i) {
    hash[i] = on_threads(1 << i, [] { return run(tank(0.05), 4).state_hash; });
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_EQ(hash[0], hash[2]);
  Scene other = tank(0.05);
  other.options.seed = 2;
  EXPECT_NE(run(other, 4).state_hash, hash[0]);
}

TEST(Liquid, FallsFreelyBeforeItLands) {
  Scene scene = tank(0.05);
  scene.colliders.clear();
  scene.bodies[0].shape.box = base::Box{base::Vec3(0.3, 0.2, 0.3), base::Vec3(0.5, 0.4, 0.45)};
  const Totals t = run(scene, 2);
  const double fallen = 9.81 * 2 / 24.0;
  EXPECT_NEAR(t.linear_momentum.z() / t.mass, -fallen, 1e-5 * fallen);
  EXPECT_NEAR(t.linear_momentum.head<2>().norm() / t.mass, 0, 1e-6);
}

// Level water on cell boundaries is in discrete equilibrium: what moves is what the solver left, 1e-6 of g dt.
TEST(Liquid, StillWaterStaysStill) {
  Scene scene = tank(0.05);
  scene.colliders.clear();
  scene.bodies[0].shape.box = base::Box{base::Vec3(0, 0, 0), base::Vec3(1, 0.5, 0.25)};
  scene.options.seeding = Seeding::regular;
  const Totals t = run(scene, 24);
  ASSERT_GT(t.substeps, 0);
  EXPECT_LE(t.max_speed, 1e-4 * std::sqrt(9.81 * 0.25));
}

TEST(Liquid, SeedsTheVolumeOfItsBodiesWithoutTheColliders) {
  Scene scene = tank(0.05);
  const auto full = make_simulation(scene, 24);
  EXPECT_EQ(full->totals().particles, 8 * 8 * 10 * 8);
  EXPECT_NEAR(full->totals().mass, 1000 * 0.4 * 0.5 * 0.4, 1e-9);
  scene.colliders[0].shape.box = base::Box{base::Vec3(0.2, 0.2, 0), base::Vec3(0.3, 0.3, 0.2)};
  EXPECT_EQ(make_simulation(scene, 24)->totals().particles, 8 * (8 * 10 * 8 - 2 * 2 * 4));
  scene.bodies[0].velocity = base::Vec3(1, 2, 3);
  const Totals t = make_simulation(scene, 24)->totals();
  EXPECT_NEAR((t.linear_momentum / t.mass - scene.bodies[0].velocity).norm(), 0, 1e-12);
}

TEST(Liquid, ASceneWithoutAParticleIsTheUsersMistake) {
  Scene scene = tank(0.05);
  scene.bodies[0].shape.box = base::Box{base::Vec3(5, 5, 5), base::Vec3(6, 6, 6)};
  EXPECT_THROW(make_simulation(scene, 24), base::Error);
}

TEST(Liquid, StaysInsideWallsAndOutsideColliders) {
  const Scene scene = tank(0.05);
  auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  for (int f = 0; f < 16; ++f) simulation->advance(ledger, {});
  const Frame frame = simulation->frame();
  bool reached = false;
  for (const base::Vec3f& x : frame.position) {
    const base::Vec3 at = x.cast<double>();
    EXPECT_TRUE((at.array() >= -1e-6).all() && (at.array() <= scene.options.domain.upper.array() + 1e-6).all());
    EXPECT_GE(scene.colliders[0].shape.distance(at), -1e-6);
    reached = reached || at.x() > 0.7;
  }
  EXPECT_TRUE(reached);
}

TEST(Liquid, LedgerHasExactlyThePassesOfAStep) {
  auto simulation = make_simulation(tank(0.05), 24);
  base::Ledger ledger;
  simulation->advance(ledger, {});
  std::string names;
  for (const auto& [name, cost] : ledger.passes()) {
    names += name + " ";
    EXPECT_GT(cost.calls, 0);
  }
  EXPECT_EQ(names, "advect collide extrapolate forces g2p p2g pressure sort sums volume ");
}

TEST(Liquid, AsksBetweenStepsWhetherToStop) {
  auto simulation = make_simulation(tank(0.05), 24);
  base::Ledger ledger;
  EXPECT_FALSE(simulation->advance(ledger, [] { return true; }));
}

/// A liquid block of `edge` cells with walls on all sides but, if `open`, the top.
LiquidCells<3> pool(const ActiveBlocks<3>& blocks, bool open) {
  LiquidCells<3> cells;
  cells.open.update(Solids<3>(Scene{}, blocks.lattice()), blocks);
  std::vector<CellKind>& kind = cells.kind;
  kind.assign(blocks.size(), CellKind::solid);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Cell<3> at = blocks.cell_at(i);
    if (blocks.lattice().inside(at)) kind[i] = open && at[2] == blocks.lattice().cells[2] - 1 ? CellKind::air : CellKind::liquid;
  }
  return cells;
}

TEST(Pressure, LeavesNoDivergence) {
  for (const int edge : {8, 24}) {   // the first is solved directly, the second by iteration
    for (const bool open : {true, false}) {
      const auto blocks = ActiveBlocks<3>::whole(Lattice<3>({edge, edge, edge}));
      FaceField<3, double> v = cases::random_field<FaceLayout<3, double>>(blocks, 1);
      FaceMask<3> valid;
      const PressureReport report = Projection<3>().project(v, pool(blocks, open), blocks, 1e-10, valid);
      EXPECT_EQ(report.iterations == 0, report.unknowns <= kDirectUnknowns);
      EXPECT_EQ(report.closed_pockets, open ? 0 : 1);
      EXPECT_LE(report.max_divergence, 1e-8) << "edge " << edge << " open " << open;
    }
  }
}

TEST(Pressure, BothSolversGiveTheSameField) {
  PoissonSystem system;
  const int n = 12;
  system.neighbour.resize(n * n);
  system.diagonal.assign(n * n, 4);
  system.dimension = 2;
  for (int i = 0; i < n * n; ++i) {
    system.neighbour[i].fill(PoissonSystem::kNone);
    if (i >= n) system.neighbour[i][0] = i - n;
    if (i + n < n * n) system.neighbour[i][1] = i + n;
    if (i % n > 0) system.neighbour[i][2] = i - 1;
    if (i % n < n - 1) system.neighbour[i][3] = i + 1;
  }
  std::vector<double> b(n * n), x(n * n, 0.0), y(n * n, 0.0);
  for (int i = 0; i < n * n; ++i) b[i] = std::sin(double(i));
  EXPECT_LE(solve_directly(system, b, x).residual, 1e-13);
  const SolveReport report = solve_iteratively(system, b, 1e-12, y);
  EXPECT_TRUE(report.converged);
  EXPECT_GT(report.iterations, 3);
  for (int i = 0; i < n * n; ++i) EXPECT_NEAR(x[i], y[i], 1e-11);
}

TEST(Shape, DistanceHasItsNormalsAndSigns) {
  Shape box, ball;
  box.box = base::Box{base::Vec3(0, 0, 0), base::Vec3(2, 2, 2)};
  ball.sphere = Shape::Sphere{base::Vec3(1, 1, 1), 1};
  base::Vec3 n;
  EXPECT_NEAR(box.distance(base::Vec3(3, 3, 1), &n), std::sqrt(2.0), 1e-15);
  EXPECT_NEAR((n - base::Vec3(1, 1, 0).normalized()).norm(), 0, 1e-15);
  EXPECT_NEAR(box.distance(base::Vec3(1, 1, 0.25), &n), -0.25, 1e-15);
  EXPECT_EQ(n, base::Vec3(0, 0, -1));
  EXPECT_NEAR(ball.distance(base::Vec3(1, 1, 3), &n), 1, 1e-15);
  EXPECT_EQ(n, base::Vec3(0, 0, 1));
  EXPECT_NEAR(ball.distance(base::Vec3(1, 1, 1), &n), -1, 1e-15);
  EXPECT_NEAR(n.norm(), 1, 1e-15);
}

TEST(Extrapolation, IsExactForAConstantAndStopsAtItsDepth) {
  const auto blocks = ActiveBlocks<3>::whole(Lattice<3>({8, 8, 8}));
  FaceField<3, double> v;
  FaceMask<3> valid;
  for (int a = 0; a < 3; ++a) v[a].assign(blocks.size(), 7), valid[a].assign(blocks.size(), 0);
  const auto at = [&](int i) { return std::size_t(blocks.index({i, 4, 4})); };
  v[0][at(1)] = 2;
  valid[0][at(1)] = 1;
  extrapolate(v, valid, blocks, 3);
  EXPECT_EQ(v[0][at(2)], 2);
  EXPECT_EQ(v[0][at(4)], 2);
  EXPECT_EQ(v[0][at(5)], 0);
}

}  // namespace
}  // namespace sim
