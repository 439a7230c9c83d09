// Periodic sides: what leaves at one comes in at the other, and no place is different from another.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/fluid/poisson.h"
#include "sim/fluid/pressure.h"
#include "sim/fluid/seeding.h"
#include "sim/random.h"
#include "sim/simulation.h"
#include "tests/threads.h"

namespace sim {
namespace {

constexpr std::array kPeriodic{Side::periodic, Side::periodic};

/// A channel of 16 x 8 (x 8) cells of 0.1 m, open along x, full of liquid that moves at `velocity`.
Scene channel(int dimension, const base::Vec3& velocity) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = dimension;
  o.domain = {base::Vec3::Zero(), dimension == 2 ? base::Vec3(1.6, 0.8, 0) : base::Vec3(1.6, 0.8, 0.8)};
  o.cell = 0.1;
  o.boundary[0] = kPeriodic;
  o.particles_per_cell = dimension == 2 ? 4 : 8;
  Body all;
  all.name = "all";
  all.shape.box = o.domain;
  all.velocity = velocity;
  scene.bodies = {all};
  return scene;
}

TEST(PeriodicLiquid, CarriesAUniformFlowForEver) {
  for (const int dimension : {2, 3})
    for (const Kernel kernel : {Kernel::linear, Kernel::quadratic})
      for (const Transfer transfer : {Transfer::flip, Transfer::polypic}) {
        const base::Vec3 velocity = dimension == 2 ? base::Vec3(0.7, -0.3, 0) : base::Vec3(0.7, -0.3, 0.2);
        Scene scene = channel(dimension, velocity);
        for (int a = 0; a < dimension; ++a) scene.options.boundary[std::size_t(a)] = kPeriodic;
        scene.options.kernel = kernel, scene.options.transfer = transfer;
        scene.options.precision = Precision::double_precision;
        scene.options.volume_correction = 0;   // as a shot has it that is periodic on all sides
        const auto simulation = make_simulation(scene, 4);
        base::Ledger ledger;
        const Frame before = simulation->frame();
        for (int f = 0; f < 4; ++f) simulation->advance(ledger, {});
        const Totals t = simulation->totals();
        const Frame after = simulation->frame();
        EXPECT_NEAR((t.linear_momentum / t.mass - velocity).norm(), 0, 1e-13);
        EXPECT_NEAR(t.kinetic_energy, 0.5 * t.mass * velocity.squaredNorm(), 1e-12 * t.kinetic_energy);
        EXPECT_EQ(t.pushed_out, 0);
        int crossed = 0;
        for (std::size_t i = 0; i < after.position.size(); ++i)
          for (int a = 0; a < dimension; ++a) {
            const double length = scene.options.domain.size()[a], gone = double(after.position[i][a] - before.position[i][a]) - velocity[a];
            EXPECT_NEAR(gone / length, std::round(gone / length), 1e-6);
            EXPECT_TRUE(after.position[i][a] >= 0 && double(after.position[i][a]) <= length);
            crossed += std::abs(gone) > 0.5 * length;
          }
        EXPECT_GT(crossed, 100);
      }
}

/// A drop and a post under a stream, all moved by `cells` along x.
Scene moved_scene(int cells) {
  Scene scene = channel(2, base::Vec3(0.5, 0, 0));
  const base::Vec3 by(0.1 * cells, 0, 0);
  scene.options.seeding = Seeding::regular;
  scene.options.precision = Precision::double_precision;
  scene.bodies[0].shape.box = base::Box{base::Vec3(0.2, 0.3, 0) + by, base::Vec3(0.9, 0.7, 0) + by};
  Collider post;
  post.shape.sphere = Shape::Sphere{base::Vec3(1.05, 0.1, 0) + by, 0.16};
  scene.colliders = {post};
  scene.effects = {Effect{.acceleration = base::Vec3(0, -9.81, 0)}};
  return scene;
}

// The body and the post lie across the side in the moved scenes.
TEST(PeriodicLiquid, OfASceneMovedByWholeCellsIsMoved) {
  const auto still = make_simulation(moved_scene(0), 24);
  const Frame start = still->frame();
  ASSERT_EQ(start.position.size(), 7u * 4u * 4u);
  base::Ledger ledger;
  for (int f = 0; f < 12; ++f) still->advance(ledger, {});
  const Frame end = still->frame();
  float lowest = 1;
  for (const base::Vec3f& x : end.position) lowest = std::min(lowest, x.y());
  EXPECT_LT(lowest, 0.1f);   // it has met the floor, and the post on its way
  for (const int cells : {3, 10}) {
    const auto moved = make_simulation(moved_scene(cells), 24);
    const auto back = [&](const base::Vec3f& x) { return base::Vec3f(float(std::fmod(double(x.x()) - 0.1 * cells + 1.6, 1.6)), x.y(), 0); };
    const auto apart = [](const base::Vec3f& a, const base::Vec3f& b) {
      const double dx = std::abs(double(a.x() - b.x()));
      return std::hypot(std::min(dx, 1.6 - dx), double(a.y() - b.y()));
    };
    const Frame first = moved->frame();
    std::vector<std::size_t> twin;
    for (const base::Vec3f& x : start.position)
      for (std::size_t j = 0; j < first.position.size(); ++j)
        if (apart(back(first.position[j]), x) < 1e-3) twin.push_back(j);
    ASSERT_EQ(twin.size(), start.position.size());
    ASSERT_EQ(first.position.size(), start.position.size());
    for (int f = 0; f < 12; ++f) moved->advance(ledger, {});
    const Frame last = moved->frame();
    for (std::size_t i = 0; i < twin.size(); ++i) EXPECT_LT(apart(back(last.position[twin[i]]), end.position[i]), 1e-5) << cells << " " << i;
  }
}

// Around a side whose last block is one cell wide.
TEST(PeriodicLiquid, MovedAcrossASideOfAnyNumberOfCellsIsTheSame) {
  for (const int cells : {24, 25, 26, 27}) {
    std::vector<double> energies;
    for (const int first : {2, cells - 1}) {   // of twelve cells
      Scene scene;
      Options& o = scene.options;
      o.dimension = 2;
      o.cell = 1.0 / 16;
      o.domain = {base::Vec3::Zero(), base::Vec3(cells * o.cell, 2, 0)};
      o.boundary[0] = {Side::periodic, Side::periodic};
      o.seeding = Seeding::regular;
      o.precision = Precision::double_precision;
      Body water;
      water.name = "water";
      water.shape.box = base::Box{base::Vec3(first * o.cell, 0, 0), base::Vec3((first + 12) * o.cell, 12 * o.cell, 0)};
      scene.bodies = {water};
      scene.effects = {{.acceleration = base::Vec3(0, -9.81, 0)}};
      const auto simulation = make_simulation(scene, 24);
      base::Ledger ledger;
      for (int f = 0; f < 4; ++f) simulation->advance(ledger, {});
      energies.push_back(simulation->totals().kinetic_energy);
    }
    EXPECT_NEAR(energies[1], energies[0], 1e-9 * energies[0]) << cells;
  }
}

// Drag brakes the mean flow: that is no energy gained by the rest of it.
TEST(PeriodicLiquid, PastACylinderGoesOnReflecting) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = 2;
  o.cell = 1.0 / 32;
  o.domain = {base::Vec3::Zero(), base::Vec3(1, 0.5, 0)};
  for (int a : {0, 1}) o.boundary[std::size_t(a)] = {Side::periodic, Side::periodic};
  o.splitting = Splitting::reflection;
  Body water;
  water.name = "water";
  water.shape.box = o.domain;
  water.velocity = base::Vec3(1, 0, 0);
  scene.bodies = {water};
  Collider cylinder;
  cylinder.name = "cylinder";
  cylinder.shape.sphere = {base::Vec3(0.5, 0.25, 0), 0.08};
  scene.colliders = {cylinder};
  const auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  std::int64_t fallbacks = 0, steps = 0;
  for (int f = 0; f < 12; ++f) {
    simulation->advance(ledger, {});
    fallbacks += simulation->totals().splitting_fallbacks, steps += simulation->totals().substeps;
  }
  EXPECT_GT(steps, 12);
  EXPECT_LE(fallbacks, steps / 10);
}

TEST(PeriodicLiquid, HasTheSameBitsOnAnyNumberOfThreads) {
  std::uint64_t hash[3];
  for (int i = 0; i < 3; ++i) {
    Scene scene = channel(3, base::Vec3(1, 0, 0));
    scene.options.boundary[1] = kPeriodic;
    scene.options.cell = 0.05;
    scene.bodies[0].shape.box = base::Box{base::Vec3::Zero(), base::Vec3(0.5, 0.8, 0.4)};
    scene.effects = {Effect{}};
    hash[i] = on_threads(1 << i, [&] {
      const auto simulation = make_simulation(scene, 24);
      base::Ledger ledger;
      for (int f = 0; f < 4; ++f) simulation->advance(ledger, {});
      return simulation->totals().state_hash;
    });
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_EQ(hash[0], hash[2]);
}

// A flow leaves some cells without a particle; in a box that was full they are no air, so nothing falls into them.
TEST(PeriodicLiquid, ThatFillsItsBoxHasNoSurface) {
  Scene scene = channel(2, base::Vec3(1, 0, 0));
  scene.options.particles_per_cell = 1;
  scene.options.precision = Precision::double_precision;
  Body slow = scene.bodies[0];
  slow.name = "slow";
  slow.velocity = base::Vec3::Zero();
  slow.shape.box = base::Box{base::Vec3::Zero(), base::Vec3(0.8, 0.4, 0)};
  scene.bodies.insert(scene.bodies.begin(), slow);
  scene.effects = {Effect{.acceleration = base::Vec3(0, -9.81, 0)}};
  const auto simulation = make_simulation(scene, 4);
  const Totals start = simulation->totals();
  base::Ledger ledger;
  std::size_t fewest = 128;
  for (int f = 0; f < 6; ++f) {
    simulation->advance(ledger, {});
    const Totals t = simulation->totals();
    EXPECT_LT(t.kinetic_energy, start.kinetic_energy);
    EXPECT_NEAR(t.potential_energy, start.potential_energy, 0.01 * start.potential_energy);
    std::vector<char> filled(128, 0);
    for (const base::Vec3f& x : simulation->frame().position) filled[std::size_t(std::min(7.f, x.y() / 0.1f)) * 16 + std::size_t(std::min(15.f, x.x() / 0.1f))] = 1;
    fewest = std::min(fewest, std::size_t(std::count(filled.begin(), filled.end(), 1)));
  }
  EXPECT_LT(fewest, 120u);
}

template <int D>
FaceField<D, double> noise(const ActiveBlocks<D>& blocks) {
  FaceField<D, double> v;
  for (std::size_t a = 0; a < std::size_t(D); ++a) {
    v[a].resize(blocks.size());
    for (std::size_t i = 0; i < blocks.size(); ++i) v[a][i] = 2 * uniform(7, a, i) - 1;
  }
  return v;
}

TEST(PeriodicPressure, LeavesNoDivergence) {
  for (const int edge : {6, 14}) {   // the first is solved directly, the second by iteration
    for (const int axes : {1, 2, 3}) {
      const Lattice<3> lattice({edge, edge, edge}, {true, axes > 1, axes > 2});
      const auto blocks = ActiveBlocks<3>::whole(lattice);
      LiquidCells<3> cells;
      cells.open.update(Solids<3>(Scene{}, lattice), blocks);
      std::vector<CellKind>& kind = cells.kind;
      kind.assign(blocks.size(), CellKind::solid);
      for (std::size_t i = 0; i < blocks.size(); ++i)
        if (lattice.inside(blocks.cell_at(i))) kind[i] = CellKind::liquid;
      FaceField<3, double> v = noise(blocks);
      FaceMask<3> valid;
      const PressureReport report = Projection<3>().project(v, cells, blocks, 1e-10, valid);
      EXPECT_EQ(report.unknowns, edge * edge * edge);
      EXPECT_EQ(report.iterations == 0, report.unknowns <= kDirectUnknowns);
      EXPECT_LT(report.iterations, 60);
      EXPECT_EQ(report.closed_pockets, 1);
      EXPECT_LE(report.max_divergence, 1e-8) << edge << " cells, " << axes << " axes";
      // What flows in through one side is what flows out at the other.
      EXPECT_EQ(v[0][std::size_t(blocks.index({edge, 2, 3}))], v[0][std::size_t(blocks.index({0, 2, 3}))]);
    }
  }
}

// A projection changes nothing the second time, and a flow without divergence it does not change at all.
TEST(PeriodicPressure, KeepsWhatHasNoDivergence) {
  const auto blocks = ActiveBlocks<2>::whole(Lattice<2>({12, 8}, {true, true}));
  LiquidCells<2> cells;
  cells.open.update(Solids<2>(Scene{}, blocks.lattice()), blocks);
  cells.kind.assign(blocks.size(), CellKind::liquid);
  FaceField<2, double> v = noise(blocks);
  FaceMask<2> valid;
  Projection<2>().project(v, cells, blocks, 1e-10, valid);
  const FaceField<2, double> once = v;
  Projection<2>().project(v, cells, blocks, 1e-10, valid);
  double size = 0;
  for (std::size_t a = 0; a < 2; ++a)
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      EXPECT_NEAR(v[a][i], once[a][i], 1e-13);
      size = std::max(size, std::abs(v[a][i]));
    }
  EXPECT_GT(size, 0.1);
}

TEST(PeriodicPressure, BothSolversGiveTheSameFieldOnARing) {
  constexpr int n = 40;
  PoissonSystem system;
  system.dimension = 2;
  system.diagonal.assign(n * n, 4);
  system.neighbour.resize(n * n);
  std::vector<std::int32_t> all;
  for (int i = 0; i < n * n; ++i) {
    const int row = i / n * n;
    system.neighbour[std::size_t(i)] = {(i + n * n - n) % (n * n), (i + n) % (n * n), row + (i + n - 1) % n, row + (i + 1) % n, -1, -1};
    all.push_back(i);
  }
  system.pockets = {all};
  std::vector<double> b(n * n), x(n * n, 0.0), y(n * n, 0.0);
  for (int i = 0; i < n * n; ++i) b[std::size_t(i)] = std::sin(double(i));
  remove_constants(system, b);
  EXPECT_LE(solve_directly(system, b, x).residual, 1e-12);
  const SolveReport report = solve_iteratively(system, b, 1e-12, y);
  EXPECT_TRUE(report.converged);
  EXPECT_LT(report.iterations, 80);
  remove_constants(system, x);
  double size = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(x[i], y[i], 1e-10);
    size = std::max(size, std::abs(x[i]));
  }
  EXPECT_GT(size, 0.1);
}

TEST(PeriodicExtrapolation, ReachesAcrossTheSide) {
  const auto blocks = ActiveBlocks<2>::whole(Lattice<2>({8, 6}, {true, false}));
  FaceField<2, double> v;
  FaceMask<2> valid;
  for (std::size_t a = 0; a < 2; ++a) v[a].assign(blocks.size(), 7), valid[a].assign(blocks.size(), 0);
  const auto at = [&](int i, int j) { return std::size_t(blocks.index({i, j})); };
  v[0][at(7, 3)] = 2;
  valid[0][at(7, 3)] = 1;
  extrapolate(v, valid, blocks, 3);
  EXPECT_EQ(v[0][at(0, 3)], 2);
  EXPECT_EQ(v[0][at(2, 3)], 2);
  EXPECT_EQ(v[0][at(-1, 3)], 2);   // the image of face 7
  EXPECT_EQ(v[0][at(8, 3)], 2);    // of face 0
  EXPECT_EQ(v[0][at(3, 3)], 0);
  EXPECT_EQ(v[0][at(0, 5)], 2);
}

TEST(PeriodicScene, HoldsBodiesAndCollidersAcrossItsSides) {
  Scene scene = channel(2, base::Vec3::Zero());
  scene.bodies[0].shape.box = base::Box{base::Vec3(1.4, 0.2, 0), base::Vec3(1.9, 0.4, 0)};
  EXPECT_EQ(make_simulation(scene, 24)->totals().particles, 5 * 2 * 4);
  Collider post;
  post.shape.box = base::Box{base::Vec3(-0.2, 0, 0), base::Vec3(0.1, 0.8, 0)};
  scene.colliders = {post};
  const Solids<2> solids(scene, Lattice<2>({16, 8}, {true, false}));
  const auto solid = [&](int x) { return solids.solid({x, 3}); };
  EXPECT_TRUE(solid(0) && solid(15) && solid(14) && solid(-1) && solid(16));
  EXPECT_FALSE(solid(1) || solid(13) || solid(17));
  EXPECT_EQ(make_simulation(scene, 24)->totals().particles, 2 * 2 * 4);
}

}  // namespace
}  // namespace sim
