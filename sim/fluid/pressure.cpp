#include "sim/fluid/pressure.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/fluid/poisson.h"
#include "sim/transfer/images.h"

namespace sim {
namespace {

/// Liquid cells in ascending lattice index; number[cell] is the unknown or kNone, of an image that of its cell.
struct Numbering {
  std::vector<std::uint32_t> cell;
  std::vector<std::int32_t> number;
};

template <int D>
Numbering number_cells(const std::vector<CellKind>& kind, const Lattice<D>& lattice) {
  Numbering n;
  n.number.assign(kind.size(), PoissonSystem::kNone);
  for (std::size_t i = 0; i < kind.size(); ++i) {
    if (kind[i] != CellKind::liquid || !lattice.inside(lattice.cell_at(std::ptrdiff_t(i)))) continue;
    // A liquid cell shut in by solids on all sides has no face that moves: nothing to solve.
    bool moves = false;
    for (int a = 0; a < D; ++a)
      moves = moves || kind[i - std::size_t(lattice.stride[a])] != CellKind::solid || kind[i + std::size_t(lattice.stride[a])] != CellKind::solid;
    if (!moves) continue;
    n.number[i] = std::int32_t(n.cell.size());
    n.cell.push_back(std::uint32_t(i));
  }
  fill_images(n.number, lattice);
  return n;
}

template <int D>
PoissonSystem build_system(const Numbering& n, const std::vector<CellKind>& kind, const Lattice<D>& lattice) {
  PoissonSystem s;
  s.dimension = D;
  s.neighbour.resize(n.cell.size());
  s.diagonal.resize(n.cell.size());
  base::parallel_chunks(n.cell.size(), 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      s.neighbour[i].fill(PoissonSystem::kNone);
      double open = 0;
      for (int a = 0; a < D; ++a)
        for (int side = 0; side < 2; ++side) {
          const std::size_t other = n.cell[i] + std::size_t(side ? lattice.stride[a] : -lattice.stride[a]);
          if (kind[other] == CellKind::solid) continue;
          open += 1;
          s.neighbour[i][2 * a + side] = n.number[other];
        }
      s.diagonal[i] = open;
    }
  });
  return s;
}

/// Net outflow of every unknown's cell [m/s].
template <int D, class Real>
std::vector<double> outflow(const FaceField<D, Real>& v, const Numbering& n, const Lattice<D>& lattice) {
  std::vector<double> out(n.cell.size());
  base::parallel_chunks(n.cell.size(), 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      for (int a = 0; a < D; ++a) sum += double(v[a][n.cell[i] + std::size_t(lattice.stride[a])]) - double(v[a][n.cell[i]]);
      out[i] = sum;
    }
  });
  return out;
}

/// Notes the components of liquid that touch no air.
void find_pockets(PoissonSystem& s) {
  std::vector<std::int32_t> stack, members;
  std::vector<std::uint8_t> seen(s.size(), 0);
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
      for (const std::int32_t j : s.neighbour[std::size_t(i)]) {
        if (j < 0) continue;
        linked += 1;
        if (!seen[std::size_t(j)]) seen[std::size_t(j)] = 1, stack.push_back(j);
      }
      touches_air = touches_air || linked < s.diagonal[std::size_t(i)];
    }
    if (touches_air) continue;
    std::sort(members.begin(), members.end());
    s.pockets.push_back(members);
  }
}

/// Solid faces get the solid's velocity, 0. A face is valid when liquid touches it.
template <int D, class Real>
void hold_solids(FaceField<D, Real>& v, const std::vector<CellKind>& kind, const Lattice<D>& lattice, FaceMask<D>& valid) {
  for (int a = 0; a < D; ++a) {
    valid[a].assign(lattice.size, 0);
    const auto s = std::size_t(lattice.stride[a]);
    base::parallel_chunks(lattice.size - s, 65536, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = s + begin; i < s + end; ++i) {
        const CellKind below = kind[i - s], above = kind[i];
        if (below == CellKind::solid || above == CellKind::solid) v[a][i] = 0;
        valid[a][i] = below == CellKind::liquid || above == CellKind::liquid;
      }
    });
  }
}

/// v -= difference of pressure across every face that moves and that liquid touches.
template <int D, class Real>
void subtract_gradient(FaceField<D, Real>& v, const std::vector<CellKind>& kind, const Numbering& n, const std::vector<double>& p,
                       const Lattice<D>& lattice) {
  const auto pressure = [&](std::size_t cell) { return n.number[cell] >= 0 ? p[std::size_t(n.number[cell])] : 0.0; };
  for (int a = 0; a < D; ++a) {
    const auto s = std::size_t(lattice.stride[a]);
    base::parallel_chunks(lattice.size - s, 65536, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = s + begin; i < s + end; ++i) {
        if (kind[i - s] == CellKind::solid || kind[i] == CellKind::solid) continue;
        if (kind[i - s] == CellKind::liquid || kind[i] == CellKind::liquid) v[a][i] = Real(double(v[a][i]) - (pressure(i) - pressure(i - s)));
      }
    });
  }
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

}  // namespace

template <int D, class Real>
PressureReport project(FaceField<D, Real>& velocity, const std::vector<CellKind>& kind, const Lattice<D>& lattice, double tolerance,
                       FaceMask<D>& valid) {
  hold_solids<D, Real>(velocity, kind, lattice, valid);
  fill_images(velocity, lattice);   // the outermost of the arrays have no neighbour to be judged by
  fill_images(valid, lattice);
  const Numbering n = number_cells<D>(kind, lattice);
  PressureReport report;
  report.unknowns = std::int64_t(n.cell.size());
  if (n.cell.empty()) return report;

  // Unknowns are p dt / (rho h) [m/s]: the equations need neither density nor time step.
  PoissonSystem system = build_system<D>(n, kind, lattice);
  std::vector<double> b = outflow<D, Real>(velocity, n, lattice);
  for (double& v : b) v = -v;
  if (!std::isfinite(largest(b)))
    throw base::Error({.code = base::Exit::unstable, .message = "pressure: the velocity before the projection is not finite"});
  find_pockets(system);
  remove_constants(system, b);
  report.closed_pockets = std::int64_t(system.pockets.size());

  std::vector<double> p(n.cell.size(), 0.0);
  const bool direct = report.unknowns <= kDirectUnknowns;
  const SolveReport solved = direct ? solve_directly(system, b, p) : solve_iteratively(system, b, tolerance, p);
  report.iterations = solved.iterations;
  report.residual = solved.residual;
  if (!solved.converged)
    throw base::Error({.code = base::Exit::unstable,
                       .message = fmt::format("pressure: {} unknowns, residual {:.3g} after {} iterations, asked {:.3g}", report.unknowns,
                                              solved.residual, solved.iterations, tolerance)});
  subtract_gradient<D, Real>(velocity, kind, n, p, lattice);
  fill_images(velocity, lattice);
  report.max_divergence = largest(outflow<D, Real>(velocity, n, lattice));
  return report;
}

template PressureReport project(FaceField<2, float>&, const std::vector<CellKind>&, const Lattice<2>&, double, FaceMask<2>&);
template PressureReport project(FaceField<2, double>&, const std::vector<CellKind>&, const Lattice<2>&, double, FaceMask<2>&);
template PressureReport project(FaceField<3, float>&, const std::vector<CellKind>&, const Lattice<3>&, double, FaceMask<3>&);
template PressureReport project(FaceField<3, double>&, const std::vector<CellKind>&, const Lattice<3>&, double, FaceMask<3>&);

}  // namespace sim
