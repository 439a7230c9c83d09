// The pressure's equations under a free surface, solved to 1e-6 from nothing, with the hierarchy's set-up: the multigrid of the program, and
// Eigen's conjugate gradients with an incomplete Cholesky factorisation in natural order on the same equations.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include <chrono>
#include <string>

#include "sim/fluid/multigrid.h"
#include "tests/poisson_cases.h"

namespace bench {
namespace {

using namespace sim;

constexpr double kTolerance = 1e-6;

/// A tank of edge x edge x depth cells of liquid, two of air above.
DensePoisson<3> tank(int edge, int depth, bool noise) {
  DensePoisson<3> dense({edge, edge, depth + 2});
  dense.for_cells([&](const Cell<3>& at, std::size_t i) { dense.kind[i] = at[2] < depth ? PoissonCell::unknown : PoissonCell::air; });
  dense.open_faces();
  if (noise) dense.set_noise();
  else dense.set_hydrostatic();
  return dense;
}

void multigrid(benchmark::State& state, int edge, int depth, bool noise) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  const DensePoisson<3> dense = tank(edge, depth, noise);
  const PoissonProblem<3> problem = dense.problem();
  PoissonSolver<3> solver;
  PoissonReport report = solver.solve(problem, kTolerance);
  double total = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    report = solver.solve(problem, kTolerance);
    total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  const auto unknowns = double(report.unknowns);
  state.counters["seconds"] = total / double(state.iterations());
  state.counters["ns_per_unknown"] = 1e9 * total / double(state.iterations()) / unknowns;
  state.counters["iterations"] = double(report.iterations);
  state.counters["residual"] = report.residual;
  state.counters["unknowns"] = unknowns;
  state.counters["bytes_per_unknown"] = double(solver.bytes()) / unknowns;
}

void eigen(benchmark::State& state, int edge, int depth, bool noise) {
  const DensePoisson<3> dense = tank(edge, depth, noise);
  std::vector<int> number(dense.kind.size(), -1);
  int unknowns = 0;
  dense.for_cells([&](const Cell<3>&, std::size_t i) {
    if (dense.kind[i] == PoissonCell::unknown) number[i] = unknowns++;
  });
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd b(unknowns);
  dense.for_cells([&](const Cell<3>& at, std::size_t i) {
    if (number[i] < 0) return;
    double diagonal = 0;
    for (int a = 0; a < 3; ++a)
      for (int side = 0; side < 2; ++side) {
        const auto to = dense.across(at, a, side);
        const double w = double(dense.face[std::size_t(a)][to.face]);
        diagonal += w;
        if (w > 0 && number[to.cell] >= 0) entries.emplace_back(number[i], number[to.cell], -w);
      }
    entries.emplace_back(number[i], number[i], diagonal);
    b[number[i]] = dense.rhs[i];
  });
  Eigen::SparseMatrix<double> A(unknowns, unknowns);
  A.setFromTriplets(entries.begin(), entries.end());
  double total = 0, iterations = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    using Preconditioner = Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<int>>;
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower, Preconditioner> cg;
    cg.setTolerance(kTolerance);
    cg.setMaxIterations(2000);
    cg.compute(A);
    const Eigen::VectorXd x = cg.solve(b);
    benchmark::DoNotOptimize(x.data());
    total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    iterations = double(cg.iterations());
  }
  state.counters["seconds"] = total / double(state.iterations());
  state.counters["ns_per_unknown"] = 1e9 * total / double(state.iterations()) / double(unknowns);
  state.counters["iterations"] = iterations;
}

const int kRegistered = [] {
  struct Size {
    const char* name;
    int edge, depth;
  };
  for (const bool noise : {true, false})
    for (const Size& size : {Size{"260000", 64, 64}, Size{"2070000", 128, 126}}) {
      const std::string name = std::string("poisson/") + (noise ? "noise/" : "hydrostatic/") + size.name;
      benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& s) { multigrid(s, size.edge, size.depth, noise); })
          ->Unit(benchmark::kMillisecond);
      benchmark::RegisterBenchmark((name + "/eigen_ic").c_str(), [=](benchmark::State& s) { eigen(s, size.edge, size.depth, noise); })
          ->Unit(benchmark::kMillisecond)
          ->Iterations(1);
    }
  return 0;
}();

}  // namespace
}  // namespace bench
