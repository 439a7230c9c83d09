// The projection as a whole: what it leaves, where multigrid gives up, liquid shut in without air.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/fluid/pressure.h"
#include "sim/random.h"
#include "sim/simulation.h"
#include "tests/poisson_cases.h"

namespace sim {
namespace {

using base::Vec3;

/// A tank under air in which a ball stands.
Scene tank() {
  Scene scene;
  scene.options.domain = {Vec3::Zero(), Vec3(32, 24, 28)};
  scene.options.cell = 1;
  Collider ball;
  ball.name = "ball";
  ball.shape.sphere = Shape::Sphere{Vec3(15.3, 11.2, 8.1), 5.2};
  scene.colliders = {ball};
  return scene;
}

struct Pool {
  ActiveBlocks<3> blocks;
  LiquidCells<3> cells;
};

/// A scene of cells of 1 m with water up to `level` cells above its floor.
Pool pool(const Scene& scene, int level) {
  const Vec3 edges = scene.options.domain.upper;
  const Lattice<3> lattice({int(edges.x()), int(edges.y()), int(edges.z())});
  const Solids<3> solids(scene, lattice);
  Pool p{ActiveBlocks<3>::whole(lattice), {}};
  p.cells.open.update(solids, p.blocks);
  p.cells.open_sides = solids.open;
  p.cells.kind.assign(p.blocks.size(), CellKind::solid);
  for (std::size_t i = 0; i < p.blocks.size(); ++i) {
    const Cell<3> at = p.blocks.cell_at(i);
    double open = 0;
    for (int a = 0; a < 3; ++a) {
      const std::ptrdiff_t above = p.blocks.neighbour(i, a, 1);
      open += double(p.cells.open(a, i)) + (above >= 0 ? double(p.cells.open(a, std::size_t(above))) : 0);
    }
    if (p.blocks.is_place(i) && open > 0) p.cells.kind[i] = at[2] >= level || !lattice.inside(at) ? CellKind::air : CellKind::liquid;
  }
  return p;
}

FaceField<3, double> noise(const Pool& p) {
  FaceField<3, double> v;
  for (std::size_t a = 0; a < 3; ++a) {
    v[a].resize(p.blocks.size());
    for (std::size_t i = 0; i < p.blocks.size(); ++i) v[a][i] = 2 * uniform(3, a, i) - 1;
  }
  return v;
}

/// Euclidean norm of the outflow of all liquid cells, without any of the projection's code.
double outflow(const Pool& p, const FaceField<3, double>& v) {
  double sum = 0;
  for (std::size_t i = 0; i < p.blocks.size(); ++i) {
    if (p.cells.kind[i] != CellKind::liquid) continue;
    double out = 0;
    for (int a = 0; a < 3; ++a) {
      const auto above = std::size_t(p.blocks.neighbour(i, a, 1));
      out += double(p.cells.open(a, above)) * v[std::size_t(a)][above] - double(p.cells.open(a, i)) * v[std::size_t(a)][i];
    }
    sum += out * out;
  }
  return std::sqrt(sum);
}

TEST(FluidPressure, LeavesTheDivergenceThatWasAskedForOfNoiseAndOfWeight) {
  const Pool p = pool(tank(), 22);
  for (const bool weight : {false, true}) {
    FaceField<3, double> start = noise(p);
    for (std::size_t a = 0; weight && a < 3; ++a) std::fill(start[a].begin(), start[a].end(), a == 2 ? -1.0 : 0.0);
    for (const double tolerance : {1e-2, 1e-4, 1e-6, 1e-9}) {
      FaceField<3, double> v = start;
      FaceMask<3> valid;
      const PressureReport report = Projection<3>().project(v, p.cells, p.blocks, tolerance, valid);
      const double before = outflow(p, start), after = outflow(p, v);
      ASSERT_GT(before, 10);
      EXPECT_GT(report.iterations, 0);
      EXPECT_LE(after, 1.01 * tolerance * before) << weight;
      EXPECT_GE(after, 1e-3 * tolerance * before) << weight;   // and no work beyond it
      EXPECT_NEAR(after / before, report.residual, 1e-2 * tolerance) << weight;
    }
  }
}

// What coarse levels take for a wall where the side is open, each cycle leaves to the next. The last tiles along each axis are not full.
TEST(FluidPressure, ASideThatIsOpenCostsAsManyCyclesWhicheverItIs) {
  for (const int axis : {0, 1, 2}) {
    std::array<int, 2> cycles{};
    for (const std::size_t side : {0u, 1u}) {
      Scene scene;
      scene.options.domain = {Vec3::Zero(), Vec3(42, 34, 26)};
      scene.options.cell = 1;
      scene.options.boundary[std::size_t(axis)][side] = Side::open;
      const Pool p = pool(scene, 26);
      FaceField<3, double> v = noise(p);
      FaceMask<3> valid;
      const PressureReport report = Projection<3>().project(v, p.cells, p.blocks, 1e-11, valid);
      EXPECT_LE(report.residual, 1.01e-11);
      cycles[side] = int(report.iterations);
    }
    EXPECT_GT(cycles[0], 3);
    EXPECT_NEAR(cycles[0], cycles[1], 2) << axis;
  }
}

/// Corridors one cell wide that double back: coarse cells see through their walls.
std::vector<Collider> walls(int count, double length) {
  std::vector<Collider> all;
  for (int i = 0; i < count; ++i) {
    Collider wall;
    wall.name = "wall " + std::to_string(i);
    const double at = 2 * i + 1;
    wall.shape.box = i % 2 ? base::Box{Vec3(at, -1, 0), Vec3(at + 1, length - 1, 0)} : base::Box{Vec3(at, 1, 0), Vec3(at + 1, length + 1, 0)};
    all.push_back(wall);
  }
  return all;
}

TEST(FluidPressure, GoesOnWithIncompleteCholeskyWhereCyclesDoNotDo) {
  constexpr int n = 65;
  DensePoisson<2> dense({n, n});
  dense.for_cells([&](const Cell<2>& at, std::size_t i) {
    const bool wall = at[0] % 2 == 1 && at[1] != (at[0] / 2 % 2 ? n - 1 : 0);
    dense.kind[i] = wall ? PoissonCell::solid : at[0] == 0 && at[1] == n - 1 ? PoissonCell::air : PoissonCell::unknown;
  });
  dense.open_faces();
  dense.set_noise();
  const PoissonProblem<2> problem = dense.problem();
  PoissonSolver<2> solver;
  const PoissonReport report = solver.solve(problem, 1e-8);
  EXPECT_TRUE(report.converged && report.fell_back);
  EXPECT_GT(report.iterations, kMostCycles);
  const double left = dense.norm(dense.residual(dense.gathered(problem, solver))) / dense.norm(dense.rhs);
  EXPECT_LE(left, 1.01e-8);
  EXPECT_NEAR(report.residual, left, 1e-10);
}

TEST(FluidPressure, CountsTheSolvesThatWentOnWithIncompleteCholesky) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = 2;
  o.domain = {Vec3::Zero(), Vec3(65, 66, 0)};
  o.cell = 1;
  o.particles_per_cell = 4;
  o.seeding = Seeding::regular;
  Body water;
  water.name = "water";
  water.shape.box = base::Box{Vec3::Zero(), Vec3(65, 64, 0)};
  scene.bodies = {water};
  scene.colliders = walls(32, 66);
  scene.effects = {Effect{.acceleration = Vec3(0.3, -1, 0)}};
  const auto simulation = make_simulation(scene, 10);
  base::Ledger ledger;
  simulation->advance(ledger, {});
  const Totals t = simulation->totals();
  EXPECT_GT(t.pressure_fallbacks, 0);
  EXPECT_GE(t.pressure_iterations, kMostCycles * t.pressure_fallbacks);
}

// Nothing can move: whatever the weight does to v*, the pressure takes back, to the solver's tolerance.
TEST(FluidPressure, HoldsWaterInAFullBoxWithEitherSplitting) {
  for (const int dimension : {2, 3})
    for (const Splitting splitting : {Splitting::lie, Splitting::reflection}) {
      Scene scene;
      Options& o = scene.options;
      o.dimension = dimension;
      o.domain = {Vec3::Zero(), dimension == 2 ? Vec3(1, 0.6, 0) : Vec3(0.6, 0.4, 0.5)};
      o.cell = 0.02;
      if (dimension == 3) o.cell = 0.05;
      o.particles_per_cell = dimension == 2 ? 4 : 8;
      o.splitting = splitting;
      o.volume_correction = 0;
      Body water;
      water.name = "water";
      water.shape.box = o.domain;
      scene.bodies = {water};
      scene.effects = {Effect{.acceleration = dimension == 2 ? Vec3(0, -9.81, 0) : Vec3(0, 0, -9.81)}};
      const auto simulation = make_simulation(scene, 24);
      base::Ledger ledger;
      for (int f = 0; f < 24; ++f) simulation->advance(ledger, {});
      const Totals t = simulation->totals();
      ASSERT_GT(t.substeps, 0);
      EXPECT_LE(t.max_speed, 1e-4 * std::sqrt(9.81 * 0.5)) << dimension;
      EXPECT_LE(t.imbalance.value(), 1e-9);
      EXPECT_EQ(t.splitting_fallbacks, 0);
    }
}

}  // namespace
}  // namespace sim
