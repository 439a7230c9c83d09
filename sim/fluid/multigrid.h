#pragma once
// The pressure's equations, solved by conjugate gradients in double precision with a float multigrid V-cycle as preconditioner
// [McAdams10], without a matrix. A level's cells are twice as wide as the ones below; the smoother is a Chebyshev polynomial of degree 2
// in D^-1 A, before and after, so that the cycle is symmetric; the coarsest level is factorised with CHOLMOD. Closed components (no air)
// are solved in the complement of the constants, on every level. The same bits on any number of threads.
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sim/fluid/poisson_tiles.h"

namespace sim {

struct PoissonReport {
  std::int64_t unknowns = 0;
  std::int64_t iterations = 0;         // of conjugate gradients; 0 when solved directly
  double residual = 0;                 // [1] |b - A x| / |b|, Euclidean norm, computed anew from x in double
  std::int64_t closed_components = 0;
  double imbalance = 0;                // largest mean of the right-hand side over a closed component, taken off it
  bool fell_back = false;              // more than kMostCycles: went on with incomplete Cholesky
  bool converged = true;
};

inline constexpr std::int64_t kMostCycles = 30, kDirectUnknowns = 1500;

template <int D>
class PoissonSolver {
 public:
  PoissonSolver();
  ~PoissonSolver();
  PoissonSolver(PoissonSolver&&) noexcept;
  PoissonSolver& operator=(PoissonSolver&&) noexcept;

  /// Solves to a relative residual of `tolerance`, from zero. Systems of at most kDirectUnknowns are factorised. Levels that
  /// the next call has, too, keep what they have allocated. A right-hand side that is not finite gives converged = false.
  PoissonReport solve(const PoissonProblem<D>&, double tolerance);
  /// x of a tile, the n-th of PoissonProblem::tiles; means nothing in cells that are not unknown.
  std::span<const double> solution(std::size_t n) const;
  /// Bytes held.
  std::int64_t bytes() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace sim
