#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>
#include <vector>

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
  std::vector<std::pair<int, double>> column;
  for (std::size_t i = 0; i < n; ++i) {
    start[i] = entry;
    row[entry] = int(i), value[entry++] = system.diagonal[i];
    column.clear();
    for (int m = 0; m < 2 * system.dimension; ++m)
      if (const std::int32_t j = system.neighbour[i][m]; j > int(i)) column.push_back({j, -system.link(i, m)});
    std::sort(column.begin(), column.end());
    for (std::size_t m = 0; m < column.size(); ++m)
      if (m > 0 && column[m].first == column[m - 1].first) value[entry - 1] += column[m].second;   // two links around a short axis
      else row[entry] = column[m].first, value[entry++] = column[m].second;
  }
  start[n] = entry;
  for (const auto& pocket : system.pockets) value[start[pocket.front()]] *= 2;
  return A;
}

}  // namespace

struct CholeskyFactor::Parts {
  mutable Workspace w;
  cholmod_factor* L = nullptr;
  std::size_t size = 0;
  ~Parts() { cholmod_free_factor(&L, &w.common); }
};

CholeskyFactor::CholeskyFactor(const PoissonSystem& system) : parts_(std::make_unique<Parts>()) {
  cholmod_common& common = parts_->w.common;
  parts_->size = system.size();
  cholmod_sparse* A = lower_triangle(system, common);
  parts_->L = cholmod_analyze(A, &common);
  const bool factorised = parts_->L && cholmod_factorize(A, parts_->L, &common) && parts_->L->minor == parts_->size;
  if (!factorised) cholmod_free_factor(&parts_->L, &common);
  cholmod_free_sparse(&A, &common);
}

CholeskyFactor::~CholeskyFactor() = default;

bool CholeskyFactor::whole() const { return parts_->L != nullptr; }

void CholeskyFactor::solve(const std::vector<double>& b, std::vector<double>& x) const {
  cholmod_common& common = parts_->w.common;
  cholmod_dense* rhs = cholmod_allocate_dense(parts_->size, 1, parts_->size, CHOLMOD_REAL, &common);
  if (!rhs) throw std::bad_alloc();
  std::copy(b.begin(), b.end(), static_cast<double*>(rhs->x));
  cholmod_dense* solution = cholmod_solve(CHOLMOD_A, parts_->L, rhs, &common);
  if (!solution) throw std::bad_alloc();
  const auto* found = static_cast<const double*>(solution->x);
  x.assign(found, found + parts_->size);
  cholmod_free_dense(&rhs, &common);
  cholmod_free_dense(&solution, &common);
}

SolveReport solve_directly(const PoissonSystem& system, const std::vector<double>& b, std::vector<double>& x) {
  const std::size_t n = system.size();
  const CholeskyFactor factor(system);
  SolveReport report;
  report.converged = factor.whole();
  if (!report.converged) return report;
  factor.solve(b, x);
  std::vector<double> image(n);
  apply(system, x, image);
  double wrong = 0, scale = 0;
  for (std::size_t i = 0; i < n; ++i) wrong += (b[i] - image[i]) * (b[i] - image[i]), scale += b[i] * b[i];
  report.residual = scale > 0 ? std::sqrt(wrong / scale) : 0;
  return report;
}

}  // namespace sim
