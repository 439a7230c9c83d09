#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "sim/fluid/poisson.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 8192;       // of vector operations and sums
constexpr std::size_t kRange = 24576;      // rows of one independent factorisation: fixed, so the bits do not follow the threads
constexpr std::int64_t kMostIterations = 2000;

using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  return base::ordered_reduce(a.size(), kChunk, 0.0, [&](std::size_t begin, std::size_t end) {
    double s = 0;
    for (std::size_t i = begin; i < end; ++i) s += a[i] * b[i];
    return s;
  }, [](double s, double t) { return s + t; });
}

/// Modified incomplete Cholesky without fill: keeps row sums, so low frequencies are caught [Bridson15 fig 5.4].
class IncompleteCholesky {
 public:
  explicit IncompleteCholesky(const PoissonSystem& system) : system_(system), inverse_root_(system.size()) {
    constexpr double kModified = 0.97, kSafety = 0.25;
    for_ranges([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        double e = system_.diagonal[i];
        for (int a = 0; a < system_.dimension; ++a) {
          const std::int32_t j = lower(i, a, begin);
          if (j < 0) continue;
          const double link = system_.link(i, 2 * a), r2 = link * inverse_root_[j] * inverse_root_[j];
          e -= link * r2;
          for (int b = 0; b < system_.dimension; ++b) {
            const std::int32_t k = upper(std::size_t(j), b, end);
            if (b != a && k >= 0) e -= kModified * r2 * system_.link(std::size_t(j), 2 * b + 1);
          }
        }
        if (e < kSafety * system_.diagonal[i]) e = system_.diagonal[i];
        inverse_root_[i] = 1 / std::sqrt(e);
      }
    });
  }

  /// z = (L L^T)^-1 r, each range by itself.
  void apply_inverse(const Vector& r, Vector& z) const {
    for_ranges([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        double t = r[i];
        for (int a = 0; a < system_.dimension; ++a)
          if (const std::int32_t j = lower(i, a, begin); j >= 0) t += system_.link(i, 2 * a) * inverse_root_[j] * z[j];
        z[i] = t * inverse_root_[i];
      }
      for (std::size_t i = end; i-- > begin;) {
        double t = z[i];
        for (int a = 0; a < system_.dimension; ++a)
          if (const std::int32_t j = upper(i, a, end); j >= 0) t += system_.link(i, 2 * a + 1) * inverse_root_[i] * z[j];
        z[i] = t * inverse_root_[i];
      }
    });
  }

 private:
  std::int32_t lower(std::size_t i, int axis, std::size_t begin) const {
    const std::int32_t j = system_.neighbour[i][2 * axis];
    return j >= 0 && std::size_t(j) >= begin && std::size_t(j) < i ? j : PoissonSystem::kNone;
  }
  std::int32_t upper(std::size_t i, int axis, std::size_t end) const {
    const std::int32_t j = system_.neighbour[i][2 * axis + 1];
    return j >= 0 && std::size_t(j) < end && std::size_t(j) > i ? j : PoissonSystem::kNone;
  }
  template <class Body>
  void for_ranges(const Body& body) const {
    base::parallel_chunks(system_.size(), kRange, body);
  }

  const PoissonSystem& system_;
  Vector inverse_root_;   // 1 / L_ii
};

}  // namespace

void apply(const PoissonSystem& system, const Vector& x, Vector& y) {
  base::parallel_chunks(system.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = system.diagonal[i] * x[i];
      for (int n = 0; n < 2 * system.dimension; ++n)
        if (const std::int32_t j = system.neighbour[i][n]; j >= 0) sum -= system.link(i, n) * x[j];
      y[i] = sum;
    }
  });
}

void find_closed_pockets(PoissonSystem& s) {
  std::vector<std::int32_t> stack, members;
  std::vector<std::uint8_t> seen(s.size(), 0);
  s.pockets.clear();
  for (std::size_t start = 0; start < s.size(); ++start) {
    if (seen[start]) continue;
    bool touches_air = false;
    members.clear();
    stack.assign(1, std::int32_t(start));
    seen[start] = 1;
    while (!stack.empty()) {
      const std::int32_t i = stack.back();
      stack.pop_back();
      members.push_back(i);
      double linked = 0;
      for (int n = 0; n < 2 * s.dimension; ++n) {
        const std::int32_t j = s.neighbour[std::size_t(i)][std::size_t(n)];
        if (j < 0) continue;
        linked += s.link(std::size_t(i), n);
        if (!seen[std::size_t(j)]) seen[std::size_t(j)] = 1, stack.push_back(j);
      }
      // Weights are floats, and their sums in double exact enough that only air leaves more than this.
      touches_air = touches_air || linked < s.diagonal[std::size_t(i)] * (1 - 1e-9);
    }
    if (touches_air) continue;
    std::sort(members.begin(), members.end());
    s.pockets.push_back(members);
  }
}

void remove_constants(const PoissonSystem& system, Vector& values) {
  for (const auto& pocket : system.pockets) {
    const double sum = base::ordered_reduce(pocket.size(), kChunk, 0.0, [&](std::size_t begin, std::size_t end) {
      double s = 0;
      for (std::size_t m = begin; m < end; ++m) s += values[std::size_t(pocket[m])];
      return s;
    }, [](double s, double t) { return s + t; });
    const double mean = sum / double(pocket.size());
    for (const std::int32_t i : pocket) values[std::size_t(i)] -= mean;
  }
}

SolveReport solve_iteratively(const PoissonSystem& system, const Vector& b, double tolerance, Vector& x) {
  const std::size_t n = system.size();
  SolveReport report;
  const double scale = std::sqrt(dot(b, b));
  if (scale == 0) {
    std::fill(x.begin(), x.end(), 0.0);
    return report;
  }
  const IncompleteCholesky preconditioner(system);
  Vector r(n), z(n), direction(n), image(n);
  apply(system, x, image);
  for (std::size_t i = 0; i < n; ++i) r[i] = b[i] - image[i];
  report.residual = std::sqrt(dot(r, r)) / scale;
  double rho = 0;
  while (!(report.residual <= tolerance) && report.iterations < kMostIterations) {
    preconditioner.apply_inverse(r, z);
    remove_constants(system, z);
    const double rho_new = dot(r, z), beta = report.iterations ? rho_new / rho : 0;
    rho = rho_new;
    base::parallel_chunks(n, kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) direction[i] = z[i] + beta * direction[i];
    });
    apply(system, direction, image);
    const double alpha = rho / dot(direction, image);
    base::parallel_chunks(n, kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        x[i] += alpha * direction[i];
        r[i] -= alpha * image[i];
      }
    });
    report.residual = std::sqrt(dot(r, r)) / scale;
    ++report.iterations;
  }
  report.converged = report.residual <= tolerance;
  return report;
}

}  // namespace sim
