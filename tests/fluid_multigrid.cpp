// The pressure's equations and their solver, against residuals that the tests compute themselves and solutions known in closed form.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "sim/fluid/multigrid.h"
#include "sim/fluid/poisson.h"
#include "sim/fluid/pressure.h"
#include "tests/poisson_cases.h"

namespace sim {
namespace {

/// A pool under air: `n` cells along each axis but a few of air on top; `closed`: up to the lid.
template <int D>
DensePoisson<D> pool(const Cell<D>& n, bool closed, const std::array<bool, D>& periodic = {}) {
  DensePoisson<D> dense(n, periodic);
  dense.for_cells([&](const Cell<D>& at, std::size_t i) {
    dense.kind[i] = !closed && at[D - 1] >= n[D - 1] - 3 ? PoissonCell::air : PoissonCell::unknown;
  });
  dense.open_faces();
  dense.set_noise();
  return dense;
}

/// A wavy surface with its distances, a ball cut out of the grid with the fractions of its faces, and noise.
template <int D>
DensePoisson<D> rough_pool(const Cell<D>& n, const std::array<bool, D>& periodic = {}) {
  DensePoisson<D> dense(n, periodic);
  const auto middle = [](const Cell<D>& at, std::size_t a) { return at[a] + 0.5; };
  const auto depth = [&](const Cell<D>& at) {   // [cells] under the surface
    double height = 0.6 * n[D - 1];
    for (std::size_t a = 0; a + 1 < D; ++a) height += 0.1 * n[D - 1] * std::sin(2 * M_PI * (a + 1) * middle(at, a) / n[a]);
    return height - middle(at, D - 1);
  };
  const auto from_ball = [&](const Cell<D>& at, int axis, double shift) {
    double r2 = 0;
    for (std::size_t a = 0; a < D; ++a) {
      const double d = middle(at, a) + (int(a) == axis ? shift : 0) - (a + 1 == D ? 0.25 : 0.5) * n[a];
      r2 += d * d;
    }
    return std::sqrt(r2) - 0.15 * n[0];
  };
  dense.for_cells([&](const Cell<D>& at, std::size_t i) {
    dense.kind[i] = from_ball(at, -1, 0) < -1 ? PoissonCell::solid : depth(at) < 0 ? PoissonCell::air : PoissonCell::unknown;
  });
  dense.open_faces();
  dense.for_cells([&](const Cell<D>& at, std::size_t i) {
    for (int a = 0; a < D; ++a) dense.face[std::size_t(a)][i] *= float(std::clamp(from_ball(at, a, -0.5) + 0.5, 0.0, 1.0));
  });
  dense.for_cells([&](const Cell<D>& at, std::size_t i) {
    float open = 0;
    for (int a = 0; a < D; ++a)
      for (int side = 0; side < 2; ++side) open += dense.face[std::size_t(a)][dense.across(at, a, side).face];
    if (open == 0) dense.kind[i] = PoissonCell::solid;
    if (dense.kind[i] != PoissonCell::unknown) return;
    for (int a = 0; a < D; ++a)
      for (int side = 0; side < 2; ++side) {
        const auto to = dense.across(at, a, side);
        if (dense.kind[to.cell] != PoissonCell::air) continue;
        Cell<D> other = at;
        other[std::size_t(a)] += side ? 1 : -1;
        const double theta = std::max(0.01, depth(at) / (depth(at) - depth(dense.wrapped(other))));
        dense.extra[i] += float(dense.face[std::size_t(a)][to.face] * (1 / theta - 1));
      }
  });
  dense.set_noise();
  return dense;
}

template <int D>
PoissonReport expect_solved(const DensePoisson<D>& dense, double tolerance, const char* what) {
  const PoissonProblem<D> problem = dense.problem();
  PoissonSolver<D> solver;
  const PoissonReport report = solver.solve(problem, tolerance);
  EXPECT_TRUE(report.converged) << what;
  EXPECT_FALSE(report.fell_back) << what;
  EXPECT_LE(report.iterations, 15) << what;
  const std::vector<double> x = dense.gathered(problem, solver);
  std::vector<double> r = dense.residual(x), b = dense.rhs;
  if (report.closed_components == 1) {   // what cannot be balanced is the mean
    double mean = 0;
    for (const double v : b) mean += v / double(report.unknowns);
    EXPECT_NEAR(report.imbalance, std::abs(mean), 1e-12 + 1e-9 * std::abs(mean)) << what;
    for (std::size_t i = 0; i < b.size(); ++i)
      if (dense.kind[i] == PoissonCell::unknown) b[i] -= mean, r[i] -= mean;
  }
  EXPECT_GT(dense.norm(b), 1) << what;
  EXPECT_LE(dense.norm(r), 1.001 * tolerance * dense.norm(b)) << what;
  EXPECT_NEAR(report.residual, dense.norm(r) / dense.norm(b), 1e-3 * tolerance) << what;
  return report;
}

TEST(Multigrid, SolvesAPoolInFewIterations) {
  for (const bool closed : {false, true}) {
    expect_solved(pool<3>({48, 40, 43}, closed), 1e-6, "3-D noise");
    expect_solved(pool<2>({150, 130}, closed), 1e-6, "2-D noise");
  }
  DensePoisson<3> deep = pool<3>({48, 40, 67}, false);
  deep.set_hydrostatic();
  expect_solved(deep, 1e-6, "3-D hydrostatic");
  DensePoisson<2> flat = pool<2>({150, 130}, false);
  flat.set_hydrostatic();
  expect_solved(flat, 1e-6, "2-D hydrostatic");
}

TEST(Multigrid, SolvesCutCellsUnderAWavySurface) {
  expect_solved(rough_pool<3>({50, 44, 61}), 1e-6, "3-D");
  expect_solved(rough_pool<2>({150, 131}), 1e-6, "2-D");
}

TEST(Multigrid, SolvesAroundPeriodicSidesWhereverTheyCutTiles) {
  for (const int n : {32, 33, 36, 39, 41, 50}) {
    expect_solved(rough_pool<3>({n, 41, 40}, {true, true, false}), 1e-6, "3-D open");
    expect_solved(pool<3>({n, 41, 21}, true, {true, true, true}), 1e-6, "3-D closed");
    expect_solved(pool<2>({3 * n, 2 * n + 1}, true, {true, true}), 1e-6, "2-D closed");
  }
}

// A periodic axis of few cells is one cell wide on the coarsest level: its own neighbour.
TEST(Multigrid, SolvesAroundAxesOfAFewCells) {
  expect_solved(pool<3>({64, 64, 8}, true, {true, true, true}), 1e-8, "a slab");
  expect_solved(pool<3>({4, 64, 64}, false, {true, false, false}), 1e-8, "a wall of water");
  expect_solved(pool<3>({96, 4, 48}, false, {false, true, false}), 1e-8, "across");
  expect_solved(pool<2>({1024, 8}, true, {false, true}), 1e-6, "a channel");
  expect_solved(pool<2>({2048, 4}, true, {true, true}), 1e-6, "a ring");
}

TEST(Multigrid, ReachesAsFarAsDoublesDo) { EXPECT_GT(expect_solved(pool<3>({24, 40, 43}, false), 1e-11, "1e-11").iterations, 8); }

TEST(Multigrid, ASurfaceThatGrazesCellMiddlesCostsLessThanTwiceAsMuch) {
  DensePoisson<3> plain = pool<3>({48, 48, 51}, false), grazing = plain;
  grazing.for_cells([&](const Cell<3>& at, std::size_t i) {
    const double theta = std::max(0.01, std::fmod(0.37 * at[0] + 0.71 * at[1], 1.0));
    if (grazing.kind[i] == PoissonCell::unknown && at[2] == 47) grazing.extra[i] = float(1 / theta - 1);
  });
  const auto iterations = expect_solved(plain, 1e-6, "plain").iterations;
  EXPECT_GT(iterations, 3);
  EXPECT_LE(expect_solved(grazing, 1e-6, "grazing").iterations, 2 * iterations);
}

TEST(Multigrid, AgreesWithAFactorisationOfTheSameEquations) {
  const DensePoisson<2> dense = rough_pool<2>({64, 60});
  std::vector<std::int32_t> number(dense.kind.size(), PoissonSystem::kNone);
  std::vector<std::size_t> cell;
  PoissonSystem system;
  system.dimension = 2;
  dense.for_cells([&](const Cell<2>&, std::size_t i) {
    if (dense.kind[i] == PoissonCell::unknown) number[i] = std::int32_t(cell.size()), cell.push_back(i);
  });
  std::vector<double> b;
  dense.for_cells([&](const Cell<2>& at, std::size_t i) {
    if (number[i] < 0) return;
    double diagonal = double(dense.extra[i]);
    auto& near = system.neighbour.emplace_back();
    auto& weight = system.weight.emplace_back();
    near.fill(PoissonSystem::kNone), weight.fill(0);
    for (int a = 0; a < 2; ++a)
      for (int side = 0; side < 2; ++side) {
        const auto to = dense.across(at, a, side);
        const double w = double(dense.face[std::size_t(a)][to.face]);
        diagonal += w;
        if (w > 0 && number[to.cell] >= 0) near[std::size_t(2 * a + side)] = number[to.cell], weight[std::size_t(2 * a + side)] = w;
      }
    system.diagonal.push_back(diagonal);
    b.push_back(dense.rhs[i]);
  });
  ASSERT_GT(cell.size(), std::size_t(kDirectUnknowns));
  std::vector<double> exact, iterated(cell.size(), 0.0);
  ASSERT_TRUE(solve_directly(system, b, exact).converged);
  ASSERT_TRUE(solve_iteratively(system, b, 1e-12, iterated).converged);
  PoissonSolver<2> solver;
  const PoissonProblem<2> problem = dense.problem();
  ASSERT_TRUE(solver.solve(problem, 1e-12).converged);
  const std::vector<double> x = dense.gathered(problem, solver);
  double most = 0;
  for (const double v : exact) most = std::max(most, std::abs(v));
  ASSERT_GT(most, 0.1);
  for (std::size_t u = 0; u < cell.size(); ++u) {
    EXPECT_NEAR(x[cell[u]], exact[u], 1e-9 * most);
    EXPECT_NEAR(iterated[u], exact[u], 1e-9 * most);
  }
}

// p = cos(r^2 / R^2) - cos 1 inside a ball of radius R that does not follow the grid, 0 on it: root of the mean square.
template <int D>
double error_of_a_ball(int n) {
  DensePoisson<D> dense([&] { Cell<D> cells; cells.fill(n); return cells; }());
  const double radius = 0.37 * n;
  const auto r2 = [&](const Cell<D>& at) {
    double sum = 0;
    for (std::size_t a = 0; a < D; ++a) sum += std::pow(at[a] + 0.5 - 0.503 * n, 2);
    return sum;
  };
  const auto exact = [&](const Cell<D>& at) { return std::cos(r2(at) / (radius * radius)) - std::cos(1.0); };
  dense.for_cells([&](const Cell<D>& at, std::size_t i) { dense.kind[i] = r2(at) < radius * radius ? PoissonCell::unknown : PoissonCell::air; });
  dense.open_faces();
  dense.for_cells([&](const Cell<D>& at, std::size_t i) {
    if (dense.kind[i] != PoissonCell::unknown) return;
    const double s = r2(at) / (radius * radius);   // Laplacian of cos(r^2 / R^2)
    dense.rhs[i] = (2 * D * std::sin(s) + 4 * s * std::cos(s)) / (radius * radius);
    for (int a = 0; a < D; ++a)
      for (int side = 0; side < 2; ++side) {
        const auto to = dense.across(at, a, side);
        if (dense.kind[to.cell] != PoissonCell::air) continue;
        // How far the ball's surface is along the axis.
        const double along = (side ? 1 : -1) * (at[std::size_t(a)] + 0.5 - 0.503 * n), off = r2(at) - along * along;
        const double theta = std::max(0.01, std::sqrt(radius * radius - off) - along);
        dense.extra[i] += float(1 / theta - 1);
      }
  });
  PoissonSolver<D> solver;
  const PoissonProblem<D> problem = dense.problem();
  EXPECT_TRUE(solver.solve(problem, 1e-9).converged);
  const std::vector<double> x = dense.gathered(problem, solver);
  double sum = 0, cells = 0;
  dense.for_cells([&](const Cell<D>& at, std::size_t i) {
    if (dense.kind[i] == PoissonCell::unknown) sum += std::pow(x[i] - exact(at), 2), cells += 1;
  });
  return std::sqrt(sum / cells);
}

TEST(Multigrid, PressureIsOfSecondOrderUpToACurvedFreeSurface) {
  const double flat[3] = {error_of_a_ball<2>(40), error_of_a_ball<2>(80), error_of_a_ball<2>(160)};
  const double round[3] = {error_of_a_ball<3>(24), error_of_a_ball<3>(48), error_of_a_ball<3>(96)};
  for (const auto& e : {flat, round}) {
    ASSERT_GT(e[2], 1e-8);
    EXPECT_GE(std::log2(e[0] / e[2]) / 2, 1.8) << e[0] << " " << e[1] << " " << e[2];
  }
}

// Two boxes full of water, an open pool, and cells shut in on all sides.
TEST(Multigrid, TakesClosedComponentsApartAndDropsCellsWithoutAFace) {
  DensePoisson<3> dense({40, 40, 40});
  dense.for_cells([&](const Cell<3>& at, std::size_t i) {
    const auto within = [&](int lower, int upper) { return at[0] >= lower && at[0] < upper && at[1] > 2 && at[1] < 37 && at[2] > 2 && at[2] < 37; };
    if (within(1, 11) || within(13, 20) || within(22, 38)) dense.kind[i] = PoissonCell::unknown;
    if (within(22, 38) && at[2] > 30) dense.kind[i] = PoissonCell::air;
    if (at == Cell<3>{39, 5, 5} || at == Cell<3>{39, 39, 39}) dense.kind[i] = PoissonCell::unknown;
  });
  dense.open_faces();
  dense.set_noise();
  const PoissonProblem<3> problem = dense.problem();
  PoissonSolver<3> solver;
  const PoissonReport report = solver.solve(problem, 1e-8);
  EXPECT_TRUE(report.converged && !report.fell_back);
  EXPECT_EQ(report.closed_components, 2);
  EXPECT_EQ(report.unknowns, std::count(dense.kind.begin(), dense.kind.end(), PoissonCell::unknown) - 2);
  const std::vector<double> x = dense.gathered(problem, solver);
  EXPECT_EQ(x[dense.index({39, 5, 5})], 0);
  double largest_mean = 0;
  for (const auto& [lower, upper] : {std::pair{1, 11}, {13, 20}}) {
    double pressure = 0, inflow = 0, cells = 0;
    dense.for_cells([&](const Cell<3>& at, std::size_t i) {
      if (dense.kind[i] == PoissonCell::unknown && at[0] >= lower && at[0] < upper) pressure += x[i], inflow += dense.rhs[i], cells += 1;
    });
    EXPECT_NEAR(pressure / cells, 0, 1e-9);
    ASSERT_GT(std::abs(inflow / cells), 1e-5);
    largest_mean = std::max(largest_mean, std::abs(inflow / cells));
  }
  EXPECT_NEAR(report.imbalance, largest_mean, 1e-12);
}

TEST(Multigrid, SolvesDropsAndSheetsThatNoCoarserLevelSees) {
  DensePoisson<3> dense({64, 64, 64});
  dense.for_cells([&](const Cell<3>& at, std::size_t i) {
    const bool drop = at[0] % 4 < 2 && at[1] % 4 < 2 && at[2] % 4 < 2, sheet = at[2] == 33;
    dense.kind[i] = drop || sheet ? PoissonCell::unknown : PoissonCell::air;
  });
  dense.open_faces();
  dense.set_noise();
  expect_solved(dense, 1e-8, "drops");
}

TEST(Multigrid, SmallSystemsAreFactorised) {
  const DensePoisson<3> dense = pool<3>({10, 10, 13}, false);
  const PoissonProblem<3> problem = dense.problem();
  PoissonSolver<3> solver;
  const PoissonReport report = solver.solve(problem, 1e-6);
  EXPECT_EQ(report.iterations, 0);
  EXPECT_EQ(report.unknowns, 1000);
  const std::vector<double> r = dense.residual(dense.gathered(problem, solver));
  EXPECT_LE(dense.norm(r), 1e-13 * dense.norm(dense.rhs));
}

TEST(Multigrid, HasTheSameBitsOnAnyNumberOfThreadsAndInAnyCall) {
  const DensePoisson<3> dense = rough_pool<3>({50, 44, 61}), other = pool<3>({32, 32, 40}, true);
  const PoissonProblem<3> problem = dense.problem();
  std::vector<double> first;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    PoissonSolver<3> solver;
    if (threads == 2) solver.solve(other.problem(), 1e-6);   // what a call leaves behind changes nothing
    solver.solve(problem, 1e-6);
    const std::vector<double> x = dense.gathered(problem, solver);
    if (first.empty()) first = x;
    EXPECT_TRUE(first == x) << threads;
  }
}

TEST(Multigrid, SaysThatARightHandSideIsNotFinite) {
  DensePoisson<3> dense = pool<3>({24, 24, 24}, false);
  dense.rhs[dense.index({3, 4, 5})] = std::nan("");
  PoissonSolver<3> solver;
  EXPECT_FALSE(solver.solve(dense.problem(), 1e-6).converged);
}

TEST(Multigrid, HoldsAtMostAHundredAndTwentyBytesAnUnknown) {
  const DensePoisson<3> dense = pool<3>({64, 64, 67}, false);
  PoissonSolver<3> solver;
  const PoissonReport report = solver.solve(dense.problem(), 1e-6);
  EXPECT_LE(double(solver.bytes()) / double(report.unknowns), 120);
  EXPECT_GT(double(solver.bytes()) / double(report.unknowns), 50);
}

}  // namespace
}  // namespace sim
