#include "sim/fluid/pressure.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/fluid/poisson.h"

namespace sim {
namespace {

/// Liquid cells in ascending index; number[cell] is the unknown or kNone.
struct Numbering {
  std::vector<std::uint32_t> cell;
  std::vector<std::int32_t> number;
};

CellKind kind_of(const std::vector<CellKind>& kind, std::ptrdiff_t cell) {
  return value_at(kind, cell, CellKind::air);
}

template <int D>
Numbering number_cells(const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  Numbering n;
  n.number.assign(kind.size(), PoissonSystem::kNone);
  for (std::size_t i = 0; i < kind.size(); ++i) {
    if (kind[i] != CellKind::liquid || !blocks.is_place(i)) continue;
    // A liquid cell shut in by solids on all sides has no face that moves: nothing to solve.
    bool moves = false;
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1}) moves = moves || kind_of(kind, blocks.neighbour(i, a, side)) != CellKind::solid;
    if (!moves) continue;
    n.number[i] = std::int32_t(n.cell.size());
    n.cell.push_back(std::uint32_t(i));
  }
  return n;
}

template <int D>
PoissonSystem build_system(const Numbering& n, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
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
          const std::ptrdiff_t other = blocks.neighbour(n.cell[i], a, side);
          if (kind_of(kind, other) == CellKind::solid) continue;
          open += 1;
          s.neighbour[i][2 * a + side] = value_at(n.number, other, PoissonSystem::kNone);
        }
      s.diagonal[i] = open;
    }
  });
  return s;
}

/// Net outflow of every unknown's cell [m/s].
template <int D, class Real>
std::vector<double> outflow(const FaceField<D, Real>& v, const Numbering& n, const ActiveBlocks<D>& blocks) {
  std::vector<double> out(n.cell.size());
  base::parallel_chunks(n.cell.size(), 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      for (int a = 0; a < D; ++a) sum += double(value_at(v[a], blocks.neighbour(n.cell[i], a, 1), Real(0))) - double(v[a][n.cell[i]]);
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
void hold_solids(FaceField<D, Real>& v, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks, FaceMask<D>& valid) {
  for (int a = 0; a < D; ++a) {
    valid[a].resize(blocks.size());
    base::parallel_chunks(blocks.size(), 65536, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const CellKind below = kind_of(kind, blocks.neighbour(i, a, 0)), above = kind[i];
        if (below == CellKind::solid || above == CellKind::solid) v[a][i] = 0;
        valid[a][i] = below == CellKind::liquid || above == CellKind::liquid;
      }
    });
  }
}

/// v -= difference of pressure across every face that moves and that liquid touches.
template <int D, class Real>
void subtract_gradient(FaceField<D, Real>& v, const std::vector<CellKind>& kind, const Numbering& n, const std::vector<double>& p,
                       const ActiveBlocks<D>& blocks) {
  const auto pressure = [&](std::ptrdiff_t cell) {
    const std::int32_t number = value_at(n.number, cell, PoissonSystem::kNone);
    return number >= 0 ? p[std::size_t(number)] : 0.0;
  };
  for (int a = 0; a < D; ++a)
    base::parallel_chunks(blocks.size(), 65536, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::ptrdiff_t lower = blocks.neighbour(i, a, 0);
        const CellKind below = kind_of(kind, lower), above = kind[i];
        if (below == CellKind::solid || above == CellKind::solid) continue;
        if (below == CellKind::liquid || above == CellKind::liquid) v[a][i] = Real(double(v[a][i]) - (pressure(std::ptrdiff_t(i)) - pressure(lower)));
      }
    });
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

}  // namespace

template <int D, class Real>
PressureReport project(FaceField<D, Real>& velocity, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks, double tolerance,
                       FaceMask<D>& valid) {
  hold_solids<D, Real>(velocity, kind, blocks, valid);
  const Numbering n = number_cells<D>(kind, blocks);
  PressureReport report;
  report.unknowns = std::int64_t(n.cell.size());
  if (n.cell.empty()) return report;

  // Unknowns are p dt / (rho h) [m/s]: the equations need neither density nor time step.
  PoissonSystem system = build_system<D>(n, kind, blocks);
  std::vector<double> b = outflow<D, Real>(velocity, n, blocks);
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
  subtract_gradient<D, Real>(velocity, kind, n, p, blocks);
  report.max_divergence = largest(outflow<D, Real>(velocity, n, blocks));
  return report;
}

template PressureReport project(FaceField<2, float>&, const std::vector<CellKind>&, const ActiveBlocks<2>&, double, FaceMask<2>&);
template PressureReport project(FaceField<2, double>&, const std::vector<CellKind>&, const ActiveBlocks<2>&, double, FaceMask<2>&);
template PressureReport project(FaceField<3, float>&, const std::vector<CellKind>&, const ActiveBlocks<3>&, double, FaceMask<3>&);
template PressureReport project(FaceField<3, double>&, const std::vector<CellKind>&, const ActiveBlocks<3>&, double, FaceMask<3>&);

}  // namespace sim
