#pragma once
// Symmetric positive definite systems of the five- or seven-point Laplacian over numbered cells, and their two solvers.
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace sim {

/// Row i: diagonal[i] x_i - sum over neighbours weight x_j = b_i. Neighbours of axis a are neighbour[i][2a] (lower) and [2a + 1] (upper);
/// kNone where the other side is solid (no term) or air (a term in the diagonal only). Symmetric. Numbers ascend along each axis, but
/// for links around a periodic side.
struct PoissonSystem {
  static constexpr std::int32_t kNone = -1;
  int dimension = 3;
  std::vector<std::array<std::int32_t, 6>> neighbour;
  std::vector<double> diagonal;
  std::vector<std::array<double, 6>> weight;   // of each neighbour's term, symmetric; empty: all 1
  /// Components without air, members ascending: the constants on each are null vectors, and b must sum to 0 there.
  std::vector<std::vector<std::int32_t>> pockets;
  std::size_t size() const { return diagonal.size(); }
  double link(std::size_t i, int n) const { return weight.empty() ? 1 : weight[i][std::size_t(n)]; }
};

struct SolveReport {
  std::int64_t iterations = 0;
  double residual = 0;   // relative to |b|
  bool converged = true;
};

/// y = A x.
void apply(const PoissonSystem&, const std::vector<double>& x, std::vector<double>& y);

/// Removes the mean over each pocket.
void remove_constants(const PoissonSystem&, std::vector<double>& values);

/// Conjugate gradients from x, preconditioned with MIC(0) [Bridson15 ch 5.4] in independent ranges of rows of fixed length; links between
/// ranges and around periodic sides are left out of it. Constants on pockets are projected out of the iterates.
SolveReport solve_iteratively(const PoissonSystem&, const std::vector<double>& b, double tolerance, std::vector<double>& x);

/// Notes the components that touch no air in `pockets`.
void find_closed_pockets(PoissonSystem&);

/// Sparse Cholesky factorisation (CHOLMOD), single-threaded. In each pocket the first unknown is pinned to 0.
class CholeskyFactor {
 public:
  explicit CholeskyFactor(const PoissonSystem&);
  ~CholeskyFactor();
  CholeskyFactor(const CholeskyFactor&) = delete;
  CholeskyFactor& operator=(const CholeskyFactor&) = delete;
  bool whole() const;   // whether the factorisation went through
  void solve(const std::vector<double>& b, std::vector<double>& x) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Factorises, solves, and measures the residual.
SolveReport solve_directly(const PoissonSystem&, const std::vector<double>& b, std::vector<double>& x);

}  // namespace sim
