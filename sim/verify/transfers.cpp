// Transfers and pressure by themselves: places where a stencil changes, fields that go to particles and back, orders of convergence.
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/fluid/pressure.h"
#include "sim/random.h"
#include "sim/transfer/mac_transfer.h"
#include "sim/transfer/node_transfer.h"
#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim::verify {
namespace {

const char* name_of(Kernel kernel) { return kernel == Kernel::linear ? "linear" : "quadratic"; }

template <int D>
VerifyCase transfer_case(const std::string& name, Kernel kernel, const std::string& transfer) {
  VerifyCase c;
  c.name = name + "/" + std::to_string(D) + "d/" + transfer + "/" + name_of(kernel);
  c.dimension = D;
  c.transfer = transfer, c.kernel = name_of(kernel), c.integrator = "any";
  return c;
}

template <int D>
std::string full_set(Kernel kernel) { return "polypic" + std::to_string(int_power(kernel == Kernel::linear ? 2 : 3, D)); }

template <int D>
Lattice<D> box_of(int edge, bool periodic) {
  Cell<D> cells;
  std::array<bool, D> around;
  for (int a = 0; a < D; ++a) cells[a] = edge, around[std::size_t(a)] = periodic;
  return Lattice<D>(cells, around);
}

/// The value at w of one-dimensional mode n about x, as docs/transfers.md gives it, and no code of the transfer's.
double mode_at(Kernel kernel, int n, double x, double w) {
  if (n < 2 || kernel == Kernel::linear) return n == 0 ? 1 : w;
  const auto lx = static_cast<long double>(x), lw = static_cast<long double>(w);
  return double(lw * lw - lx * (1 - 4 * lx * lx) * lw - 0.25L);
}

/// Particles on nodes, faces, half cells and an ulp beside them: the full set's polynomial is the one through the nodes of its stencil.
template <int D>
VerifyCase edge_offsets(Kernel kernel) {
  VerifyCase c = transfer_case<D>("on_an_edge", kernel, full_set<D>(kernel));
  c.expect = "the polynomial meets the nodes of its stencil to the tolerance, of velocities up to 1";
  c.tolerance = 1e-12;
  c.source = "case 1";
  c.run = [=] {
    const Lattice<D> lattice = box_of<D>(8, true);
    const auto blocks = ActiveBlocks<D>::whole(lattice);
    NodeField<D, double> field(blocks.size());
    for (std::size_t i = 0; i < field.size(); ++i)
      for (int a = 0; a < D; ++a) field[i][a] = 2 * uniform(7, i, std::uint64_t(a)) - 1;
    const NodeTransfer<D, double> transfer(kernel, mode_set<D>(Transfer::polypic, kernel, {}));
    const double ulp = std::numeric_limits<double>::epsilon() / 4;
    const double offsets[] = {0, 4e-17, ulp, 0.25, 0.5 - ulp, 0.5, 0.5 + 2 * ulp, 1 - 2 * ulp};
    Particles<D, double> p;
    p.modes = int(transfer.modes().size());
    for (int n = 0; n < int_power(8, D); ++n) {
      Cell<D> cell;
      Vec<D, double> offset;
      for (int a = 0, rest = n; a < D; ++a, rest /= 8) cell[a] = 3 + a, offset[a] = offsets[rest % 8];
      p.cell.push_back(cell), p.offset.push_back(offset), p.id.push_back(n);
    }
    p.coefficients.resize(p.size() * p.row());
    transfer.gather(blocks, field, nullptr, {}, p);
    const int nodes = kernel == Kernel::linear ? 2 : 3;
    double most = 0;
    for (std::size_t k = 0; k < p.size(); ++k)
      for (int node = 0; node < int_power(nodes, D); ++node) {
        Cell<D> at;
        std::array<double, D> x, w;
        for (int a = 0, rest = node; a < D; ++a, rest /= nodes) {
          const bool upper = kernel == Kernel::quadratic && p.offset[k][a] >= 0.5;
          const int base = p.cell[k][a] + int(upper) - int(kernel == Kernel::quadratic);
          x[std::size_t(a)] = p.offset[k][a] - upper;
          at[a] = (base + rest % nodes) % 8;
          w[std::size_t(a)] = (base + rest % nodes) - p.cell[k][a] - p.offset[k][a];
        }
        for (int component = 0; component < D; ++component) {
          double value = 0;
          for (std::size_t r = 0; r < transfer.modes().size(); ++r) {
            double product = p.component(k, component)[r];
            for (int a = 0; a < D; ++a) product *= mode_at(kernel, transfer.modes()[r][std::size_t(a)], x[std::size_t(a)], w[std::size_t(a)]);
            value += product;
          }
          most = worse(most, std::abs(value - field[std::size_t(blocks.index(at))][component]));
        }
      }
    CaseOutcome found;
    found.value = most;
    found.outcome = say("%zu places, off by %.1e at most", p.size(), most);
    return found;
  };
  return c;
}

/// Grid -> particles -> grid without motion.
template <int D, class Real>
VerifyCase round_trip(Kernel kernel) {
  const bool exact = sizeof(Real) == 8;
  VerifyCase c = transfer_case<D>("round_trip", kernel, full_set<D>(kernel));
  c.name += exact ? "/double" : "/single";
  c.expect = "the grid has its field back to the tolerance, of velocities up to 1";
  c.tolerance = exact ? 1e-13 : 2e-6;
  c.source = "docs/transfers.md, conservation";
  c.run = [=] {
    const Lattice<D> lattice = box_of<D>(8, true);
    const auto blocks = ActiveBlocks<D>::whole(lattice);
    FaceField<D, Real> field;
    for (int a = 0; a < D; ++a) {
      field[std::size_t(a)].resize(blocks.size());
      for (std::size_t i = 0; i < blocks.size(); ++i) field[std::size_t(a)][i] = Real(2 * uniform(9, i, std::uint64_t(a)) - 1);
    }
    const MacTransfer<D, Real> transfer(kernel, mode_set<D>(Transfer::polypic, kernel, {}));
    Particles<D, Real> p;
    p.modes = int(transfer.modes().size()), p.mass = 1;
    for (int n = 0; n < 4 * int_power(8, D); ++n) {
      Cell<D> cell;
      Vec<D, Real> offset;
      for (int a = 0; a < D; ++a) cell[a] = int(8 * uniform(3, std::uint64_t(n), std::uint64_t(a))),
          offset[a] = std::min(Real(uniform(4, std::uint64_t(n), std::uint64_t(a))), Real(0.999999));
      p.cell.push_back(cell), p.offset.push_back(offset), p.id.push_back(n);
    }
    p.coefficients.resize(p.size() * p.row());
    CanonicalOrder<D, Real> order;
    CellRanges ranges = order.sort(p, lattice, transfer.home());
    transfer.gather(ranges, blocks, field, nullptr, {}, p);
    MacVelocity<D, Real> grid;
    ranges = order.sort(p, lattice, transfer.home());
    transfer.scatter(p, ranges, blocks, grid);
    double most = 0;
    std::size_t compared = 0;
    for (std::size_t a = 0; a < D; ++a)
      for (std::size_t i = 0; i < blocks.size(); ++i)
        if (double(grid.mass[a][i]) > 1e-3) most = worse(most, std::abs(double(grid.velocity[a][i]) - double(field[a][i]))), ++compared;
    CaseOutcome found;
    found.value = most;
    found.outcome = say("%zu faces, off by %.1e at most", compared, most);
    if (compared < std::size_t(D * int_power(8, D)) / 2) found.broken.push_back("hardly any face was reached");
    return found;
  };
  return c;
}

double slope(const std::array<double, 3>& error) { return std::log2(error[0] / error[2]) / 2; }

CaseOutcome ordered(const std::array<double, 3>& error) {
  CaseOutcome found;
  const double order = slope(error);
  found.value = order > 0 && std::isfinite(order) ? 1.8 / order : std::numeric_limits<double>::infinity();
  found.outcome = say("errors %.2e %.2e %.2e, order %.2f", error[0], error[1], error[2], order);
  return found;
}

/// Velocities that particles get from a smooth field on three grids.
template <int D>
VerifyCase transfer_order(Kernel kernel) {
  VerifyCase c = transfer_case<D>("order_of_transfer", kernel, "any");
  c.expect = "order of the error in the cell at least 1.8 (value: 1.8 over the order)";
  c.tolerance = 1;
  c.source = "case 24";
  c.run = [=] {
    std::array<double, 3> error{};
    for (std::size_t level = 0; level < 3; ++level) {
      const int n = 8 << level;
      const Lattice<D> lattice = box_of<D>(n, true);
      const auto blocks = ActiveBlocks<D>::whole(lattice);
      const auto exact = [&](int component, const std::array<double, D>& x) {
        double v = 1;
        for (int a = 0; a < D; ++a) v *= a == component ? std::sin(2 * M_PI * x[std::size_t(a)] / n) : std::cos(2 * M_PI * x[std::size_t(a)] / n);
        return v;
      };
      FaceField<D, double> field;
      for (int component = 0; component < D; ++component) {
        field[std::size_t(component)].resize(blocks.size());
        for (std::size_t i = 0; i < blocks.size(); ++i) {
          const Cell<D> at = blocks.cell_at(i);
          std::array<double, D> x;
          for (int a = 0; a < D; ++a) x[std::size_t(a)] = at[a] + (a == component ? 0 : 0.5);
          field[std::size_t(component)][i] = exact(component, x);
        }
      }
      const MacTransfer<D, double> transfer(kernel, mode_set<D>(Transfer::pic, kernel, {}));
      for (int k = 0; k < 500; ++k) {
        Site<D, double> site;
        std::array<double, D> x;
        for (int a = 0; a < D; ++a) {
          x[std::size_t(a)] = n * uniform(5, std::uint64_t(k), std::uint64_t(a));
          site.cell[a] = int(x[std::size_t(a)]), site.offset[a] = x[std::size_t(a)] - site.cell[a];
        }
        const Vec<D, double> v = transfer.velocity_at(blocks, field, site);
        for (int component = 0; component < D; ++component) error[level] = worse(error[level], std::abs(v[component] - exact(component, x)));
      }
    }
    return ordered(error);
  };
  return c;
}

template <int D>
LiquidCells<D> full_box(const ActiveBlocks<D>& blocks, const Solids<D>& solids) {
  LiquidCells<D> cells;
  cells.open.update(solids, blocks);
  cells.kind.assign(blocks.size(), CellKind::solid);
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (blocks.lattice().inside(blocks.cell_at(i))) cells.kind[i] = CellKind::liquid;
  return cells;
}

/// A field without divergence between walls, and a gradient added to it: the projection takes the gradient away.
template <int D>
VerifyCase pressure_order() {
  VerifyCase c = law_case("order_of_pressure", D, "case 24: v = curl psi + grad phi, psi = sin^2 sin, phi = cos cos (cos)");
  c.expect = "order of the error in the cell at least 1.8 (value: 1.8 over the order)";
  c.tolerance = 1;
  c.run = [=] {
    std::array<double, 3> error{};
    for (std::size_t level = 0; level < 3; ++level) {
      const int n = (D == 2 ? 16 : 8) << level;
      const auto blocks = ActiveBlocks<D>::whole(box_of<D>(n, false));
      const Scene none;
      const Solids<D> solids(none, blocks.lattice());
      const LiquidCells<D> cells = full_box<D>(blocks, solids);
      FaceField<D, double> field, exact;
      for (int a = 0; a < D; ++a) {
        field[std::size_t(a)].resize(blocks.size()), exact[std::size_t(a)].resize(blocks.size());
        for (std::size_t i = 0; i < blocks.size(); ++i) {
          const Cell<D> at = blocks.cell_at(i);
          std::array<double, 3> x{};
          for (int b = 0; b < D; ++b) x[std::size_t(b)] = M_PI * (at[b] + (b == a ? 0 : 0.5)) / n;
          const double along = a == 0 ? std::pow(std::sin(x[0]), 2) * std::cos(x[1]) : a == 1 ? -std::sin(2 * x[0]) * std::sin(x[1]) : 0;
          double gradient = -1;
          for (int b = 0; b < D; ++b) gradient *= b == a ? std::sin(x[std::size_t(b)]) : std::cos(x[std::size_t(b)]);
          exact[std::size_t(a)][i] = along;
          field[std::size_t(a)][i] = along + gradient;
        }
      }
      FaceMask<D> valid;
      Projection<D>().project(field, cells, blocks, 1e-10, valid);
      for (int a = 0; a < D; ++a)
        for (std::size_t i = 0; i < blocks.size(); ++i)
          if (valid[std::size_t(a)][i]) error[level] = std::max(error[level], std::abs(field[std::size_t(a)][i] - exact[std::size_t(a)][i]));
    }
    return ordered(error);
  };
  return c;
}

/// A level surface that comes nearer and nearer to the middles of the last liquid cells.
template <int D>
VerifyCase thin_surface() {
  VerifyCase c = law_case("surface_at_a_cells_middle", D, "case 18");
  c.expect = "iterations with a quarter of the surface 1e-12 cells above the middles of cells, at most twice those with all of it "
             "half a cell above; velocities finite";
  c.tolerance = 2;
  c.run = [=] {
    const int n = D == 2 ? 64 : 24;
    const auto blocks = ActiveBlocks<D>::whole(box_of<D>(n, false));
    const Scene none;
    const Solids<D> solids(none, blocks.lattice());
    const auto iterations = [&](double theta, int every, double& fastest) {
      LiquidCells<D> cells = full_box<D>(blocks, solids);
      const double level = 0.75 * n - 0.5;   // of the middles of the last row of liquid
      cells.distance.assign(blocks.size(), 0);
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        const double height = blocks.cell_at(i)[D - 1] + 0.5;
        int column = 0;
        for (int a = 0; a < D - 1; ++a) column += blocks.cell_at(i)[a];
        cells.distance[i] = float(height - level - (column % every == 0 ? theta : 0.5));
        if (cells.kind[i] == CellKind::liquid && height > 0.75 * n) cells.kind[i] = CellKind::air;
      }
      FaceField<D, double> field;
      for (int a = 0; a < D; ++a) {
        field[std::size_t(a)].resize(blocks.size());
        for (std::size_t i = 0; i < blocks.size(); ++i) field[std::size_t(a)][i] = 2 * uniform(2, i, std::uint64_t(a)) - 1;
      }
      FaceMask<D> valid;
      const PressureReport report = Projection<D>().project(field, cells, blocks, 1e-6, valid);
      for (int a = 0; a < D; ++a)
        for (std::size_t i = 0; i < blocks.size(); ++i)
          if (valid[std::size_t(a)][i]) fastest = std::max(fastest, std::isfinite(field[std::size_t(a)][i]) ? std::abs(field[std::size_t(a)][i])
                                                           : 1e300);
      return double(report.iterations);
    };
    double fastest = 0, fastest_thin = 0;
    const double usual = iterations(0.5, 1, fastest), thin = iterations(1e-12, 4, fastest_thin), all_thin = iterations(1e-12, 1, fastest_thin);
    CaseOutcome found;
    found.value = thin / usual;
    found.outcome = say("%.0f iterations against %.0f (%.0f where all of the surface is there), fastest face %.2f against %.2f", thin, usual,
                        all_thin, fastest_thin, fastest);
    if (!(fastest_thin < 1e3)) found.broken.push_back("the pressure tears the surface");
    if (usual < 1) found.broken.push_back("nothing was iterated");
    return found;
  };
  return c;
}

}  // namespace

void add_transfer_cases(std::vector<VerifyCase>& all) {
  for (const Kernel kernel : {Kernel::linear, Kernel::quadratic}) {
    all.push_back(edge_offsets<2>(kernel));
    all.push_back(edge_offsets<3>(kernel));
    all.push_back(round_trip<2, float>(kernel));
    all.push_back(round_trip<2, double>(kernel));
    all.push_back(round_trip<3, float>(kernel));
    all.push_back(round_trip<3, double>(kernel));
    all.push_back(transfer_order<2>(kernel));
    all.push_back(transfer_order<3>(kernel));
  }
  all.push_back(pressure_order<2>());
  all.push_back(pressure_order<3>());
  all.push_back(thin_surface<2>());
  all.push_back(thin_surface<3>());
}

}  // namespace sim::verify
