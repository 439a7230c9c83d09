#pragma once
// Symmetric positive definite systems of the five- or seven-point Laplacian over numbered cells, and their two solvers.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace sim {

/// Row i: diagonal[i] x_i - sum over neighbours x_j = b_i. Neighbours of axis a are neighbour[i][2a] (lower) and [2a + 1] (upper);
/// kNone where the other side is solid (no term) or air (a term in the diagonal only). Symmetric; numbers ascend along each axis.
struct PoissonSystem {
  static constexpr std::int32_t kNone = -1;
  int dimension = 3;
  std::vector<std::array<std::int32_t, 6>> neighbour;
  std::vector<double> diagonal;
  std::size_t size() const { return diagonal.size(); }
};

struct SolveReport {
  std::int64_t iterations = 0;
  double residual = 0;   // relative to |b|
  bool converged = true;
};

/// y = A x.
void apply(const PoissonSystem&, const std::vector<double>& x, std::vector<double>& y);

/// Conjugate gradients from x, preconditioned with MIC(0) [Bridson15 ch 5.4] in independent ranges of rows of fixed length.
SolveReport solve_iteratively(const PoissonSystem&, const std::vector<double>& b, double tolerance, std::vector<double>& x);

/// Sparse Cholesky factorisation (CHOLMOD), single-threaded.
SolveReport solve_directly(const PoissonSystem&, const std::vector<double>& b, std::vector<double>& x);

}  // namespace sim
