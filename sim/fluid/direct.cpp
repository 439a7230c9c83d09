#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "sim/fluid/poisson.h"

namespace sim {
namespace {

/// CHOLMOD's workspace, finished when it leaves scope.
struct Workspace {
  cholmod_common common;
  Workspace() {
    cholmod_start(&common);
    common.print = 0;
  }
  ~Workspace() { cholmod_finish(&common); }
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;
};

/// Lower triangle, compressed columns, rows of a column ascending.
cholmod_sparse* lower_triangle(const PoissonSystem& system, cholmod_common& common) {
  const std::size_t n = system.size();
  cholmod_sparse* A = cholmod_allocate_sparse(n, n, n * std::size_t(1 + system.dimension), false, true, -1, CHOLMOD_REAL, &common);
  if (!A) throw std::bad_alloc();
  auto* start = static_cast<int*>(A->p);
  auto* row = static_cast<int*>(A->i);
  auto* value = static_cast<double*>(A->x);
  int entry = 0;
  for (std::size_t i = 0; i < n; ++i) {
    start[i] = entry;
    row[entry] = int(i), value[entry++] = system.diagonal[i];
    const int first = entry;
    for (int m = 0; m < 2 * system.dimension; ++m)
      if (const std::int32_t j = system.neighbour[i][m]; j > int(i)) row[entry] = j, value[entry++] = -1;
    std::sort(row + first, row + entry);
  }
  start[n] = entry;
  for (const auto& pocket : system.pockets) value[start[pocket.front()]] += 1;
  return A;
}

}  // namespace

SolveReport solve_directly(const PoissonSystem& system, const std::vector<double>& b, std::vector<double>& x) {
  const std::size_t n = system.size();
  Workspace w;
  cholmod_sparse* A = lower_triangle(system, w.common);
  cholmod_factor* L = cholmod_analyze(A, &w.common);
  SolveReport report;
  report.converged = L && cholmod_factorize(A, L, &w.common) && L->minor == n;
  if (report.converged) {
    cholmod_dense* rhs = cholmod_allocate_dense(n, 1, n, CHOLMOD_REAL, &w.common);
    std::copy(b.begin(), b.end(), static_cast<double*>(rhs->x));
    cholmod_dense* solution = cholmod_solve(CHOLMOD_A, L, rhs, &w.common);
    const auto* found = static_cast<const double*>(solution->x);
    x.assign(found, found + n);
    cholmod_free_dense(&rhs, &w.common);
    cholmod_free_dense(&solution, &w.common);
    std::vector<double> image(n);
    apply(system, x, image);
    double wrong = 0, scale = 0;
    for (std::size_t i = 0; i < n; ++i) wrong += (b[i] - image[i]) * (b[i] - image[i]), scale += b[i] * b[i];
    report.residual = scale > 0 ? std::sqrt(wrong / scale) : 0;
  }
  cholmod_free_factor(&L, &w.common);
  cholmod_free_sparse(&A, &w.common);
  return report;
}

}  // namespace sim
