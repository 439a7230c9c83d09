// The transfers against the definition, computed the slow way: Q from the polynomials of the supplement, c = (Q^T M Q)^-1 Q^T M v, and at
// offsets where Q^T M Q is singular its limit Q^-1 v. Scatter against a loop over particles and nodes.
#include <Eigen/LU>
#include <cmath>

#include "tests/transfer_cases.h"

namespace sim {
namespace {

using namespace cases;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// One axis of a particle: the modes at the nodes as printed, and the weights. `x` from the left node (linear) or the middle one.
struct Axis {
  Matrix q;        // node, mode
  Vector weight;
  int base = 0;
};

Axis axis_of(Kernel kernel, int cell, double t, bool centred) {
  const double place = centred ? t - 0.5 : t;   // in nodes of the lattice, from that of the cell
  Axis axis;
  if (kernel == Kernel::linear) {
    axis.base = cell + int(std::floor(place));
    const double x = place - std::floor(place);
    axis.q = Matrix{{1, -x}, {1, 1 - x}};
    axis.weight = Vector{{1 - x, x}};
    return axis;
  }
  const int nearest = place >= 0.5 ? 1 : 0;
  axis.base = cell + nearest - 1;
  const double x = place - nearest;
  axis.q = Matrix(3, 3);
  axis.weight = Vector{{(0.5 - x) * (0.5 - x) / 2, 0.75 - x * x, (0.5 + x) * (0.5 + x) / 2}};
  for (int i = 0; i < 3; ++i) {
    const double w = i - 1 - x;
    axis.q.row(i) << 1, w, w * w - x * (1 - 4 * x * x) * w - 0.25;
  }
  return axis;
}

/// One component of a particle: all nodes of the stencil, one mode a column.
template <int D>
struct Dense {
  std::array<Axis, D> axis;
  Matrix q;
  Vector weight;
  std::vector<Cell<D>> node;
};

template <class Layout>
auto dense(Kernel kernel, const std::vector<ModeIndex<Layout::kDimension>>& modes, const Cell<Layout::kDimension>& cell, const auto& offset,
           int component) {
  constexpr int D = Layout::kDimension;
  Dense<D> dense;
  for (int a = 0; a < D; ++a)
    dense.axis[a] = axis_of(kernel, cell[a], double(offset[a]), Layout::centred(lattice_of_component<Layout>(component), a));
  const int n = int(dense.axis[0].weight.size()), nodes = int_power(n, D);
  dense.q = Matrix::Ones(nodes, int(modes.size()));
  dense.weight = Vector::Ones(nodes);
  for (int i = 0; i < nodes; ++i) {
    Cell<D> at;
    for (int a = D - 1, rest = i; a >= 0; --a, rest /= n) {
      const int k = rest % n;
      at[a] = dense.axis[a].base + k;
      dense.weight[i] *= dense.axis[a].weight[k];
      for (std::size_t r = 0; r < modes.size(); ++r) dense.q(i, int(r)) *= dense.axis[a].q(k, modes[r][a]);
    }
    dense.node.push_back(at);
  }
  return dense;
}

template <class Layout>
Vector values_at(const std::vector<Cell<Layout::kDimension>>& nodes, const typename Layout::Field& field,
                 const ActiveBlocks<Layout::kDimension>& blocks, int component) {
  Vector v(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) v[int(i)] = double(Layout::at(field, component, std::size_t(blocks.index(nodes[i]))));
  return v;
}

template <class Layout>
void expect_gathers_least_squares(Layout, Kernel kernel, const std::vector<ModeIndex<Layout::kDimension>>& modes, unsigned seed) {
  constexpr int D = Layout::kDimension;
  const Lattice<D> lattice = lattice_of<D>(6);
  const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
  const GridTransfer<Layout> transfer(kernel, modes);
  auto particles = random_particles<D, double>(lattice, 40, modes.size(), seed);
  const auto field = random_field<Layout>(blocks, seed + 1);
  transfer.gather(blocks, field, nullptr, {}, particles);
  for (std::size_t p = 0; p < particles.size(); ++p)
    for (int a = 0; a < D; ++a) {
      const auto d = dense<Layout>(kernel, modes, particles.cell[p], particles.offset[p], a);
      const Vector v = values_at<Layout>(d.node, field, blocks, a);
      const Matrix weighted = d.weight.asDiagonal() * d.q;
      const Matrix gram = weighted.transpose() * d.q;
      const Vector c = gram.fullPivLu().solve(weighted.transpose() * v);
      // What the slow way loses where a norm is small: the sum it divides by it has an error of some ulps.
      const double tolerance = 1e-14 / gram.diagonal().minCoeff() + 1e-14;
      for (std::size_t r = 0; r < modes.size(); ++r)
        ASSERT_NEAR(particles.component(p, a)[r], c[int(r)], tolerance) << name_of(kernel) << " mode " << r << " of " << modes.size();
    }
}

TEST(BruteForce, GathersTheLeastSquaresFitOfEverySet) {
  for_layouts<double>([](auto layout) {
    constexpr int D = decltype(layout)::kDimension;
    for (const Kernel kernel : kKernels) {
      const std::size_t full = prefix<D>(kernel).size();
      for (std::size_t count = 1; count <= full; ++count)
        expect_gathers_least_squares(layout, kernel, prefix<D>(kernel, count), unsigned(count));
      expect_gathers_least_squares(layout, kernel, prefix<D>(kernel), 99);
      expect_gathers_least_squares(layout, kernel, mode_set<D>(Transfer::polypic, kernel, {0, "quadratic"}), 98);
    }
  });
}

/// Places where a kernel changes its stencil or a norm vanishes, and their neighbours; two of no note.
template <class Real>
std::vector<Real> degenerate_offsets() {
  const Real half = Real(0.5), one = Real(1);
  return {Real(0), std::numeric_limits<Real>::epsilon(), std::nextafter(half, Real(0)), half, std::nextafter(half, one), std::nextafter(one, Real(0)), Real(0.29), Real(0.83)};
}

/// At every combination of degenerate offsets the coefficients are those of the interpolating polynomial, Q^-1 v: the limit of the fit.
template <class Layout>
void expect_interpolates_at_degenerate_offsets(Layout, Kernel kernel, double tolerance) {
  constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;
  const Lattice<D> lattice = lattice_of<D>(6);
  const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
  const auto modes = prefix<D>(kernel);
  const GridTransfer<Layout> transfer(kernel, modes);
  const auto field = random_field<Layout>(blocks, 7);
  const std::vector<Real> offsets = degenerate_offsets<Real>();
  const int count = int(offsets.size());
  auto particles = random_particles<D, Real>(lattice, std::size_t(int_power(count, D)), modes.size(), 3);
  for (std::size_t p = 0; p < particles.size(); ++p)
    for (int a = 0, rest = int(p); a < D; ++a, rest /= count) particles.offset[p][a] = offsets[std::size_t(rest % count)];
  transfer.gather(blocks, field, nullptr, {}, particles);
  for (std::size_t p = 0; p < particles.size(); ++p)
    for (int a = 0; a < D; ++a) {
      const auto d = dense<Layout>(kernel, modes, particles.cell[p], particles.offset[p], a);
      const Vector v = values_at<Layout>(d.node, field, blocks, a);
      const Vector c = d.q.partialPivLu().solve(v);
      for (std::size_t r = 0; r < modes.size(); ++r)
        ASSERT_NEAR(double(particles.component(p, a)[r]), c[int(r)], tolerance) << name_of(kernel) << " mode " << r << " at " << particles.offset[p].transpose();
    }
}

TEST(BruteForce, InterpolatesWhereTheFitIsSingular) {
  for (const Kernel kernel : kKernels) {
    for_layouts<double>([&](auto layout) { expect_interpolates_at_degenerate_offsets(layout, kernel, 1e-12); });
    for_layouts<float>([&](auto layout) { expect_interpolates_at_degenerate_offsets(layout, kernel, 2e-5); });
  }
}

// Beside a light node g is small there and its weight too: the expanded polynomial would cancel, the factorised one keeps its digits.
TEST(BruteForce, GKeepsItsDigitsBesideLightNodes) {
  for (const float from_edge : {1e-1f, 1e-2f, 1e-3f, 1e-4f, 1e-5f, 1e-6f})
    for (const float t : {from_edge, 1 - from_edge}) {
      const QuadraticBasis<float> b(0, t, true);
      QuadraticBasis<long double> exact(0, (long double)(b.x) + 0.5L, true);
      ASSERT_EQ(exact.x, b.x);
      for (int i = 0; i < 3; ++i) {
        ASSERT_NE(exact.phi[2][i], 0);
        EXPECT_NEAR(double(b.phi[2][i] / exact.phi[2][i]), 1, 1e-6) << "t = " << t;   // some ulps of float
      }
    }
}

/// Masses and momenta of every place, a loop over particles and nodes; images of periodic sides are one place.
template <class Layout>
void expect_scatters_the_sum(Layout, Kernel kernel, const Lattice<Layout::kDimension>& lattice) {
  constexpr int D = Layout::kDimension;
  const auto modes = prefix<D>(kernel);
  const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
  const GridTransfer<Layout> transfer(kernel, modes);
  auto particles = random_particles<D, double>(lattice, 300, modes.size(), 11);
  for (std::size_t p = 0; p < particles.size(); ++p)   // both sides are reached
    if (p % 4 == 0) particles.cell[p].fill(p % 8 == 0 ? 0 : lattice.cells[0] - 1);
  const CellRanges ranges = sorted(particles, lattice);
  typename GridTransfer<Layout>::Grid grid;
  transfer.scatter(particles, ranges, blocks, grid);

  std::vector<std::vector<double>> mass(D, std::vector<double>(blocks.size())), momentum = mass;
  for (std::size_t p = 0; p < particles.size(); ++p)
    for (int a = 0; a < D; ++a) {
      const auto d = dense<Layout>(kernel, modes, particles.cell[p], particles.offset[p], a);
      const Vector v = d.q * Eigen::Map<const Vector, 0, Eigen::InnerStride<D>>(&particles.component(p, a)[0], Eigen::Index(modes.size()));
      for (std::size_t i = 0; i < d.node.size(); ++i) {
        const auto at = std::size_t(blocks.index(d.node[i]));
        mass[a][at] += d.weight[int(i)];
        momentum[a][at] += d.weight[int(i)] * v[int(i)];
      }
    }
  std::size_t reached = 0;
  for (int a = 0; a < D; ++a)
    for (const std::size_t i : places_of(blocks)) {
      const double found = Layout::mass(grid.mass, lattice_of_component<Layout>(a))[i];
      ASSERT_NEAR(found, mass[a][i], 1e-12);
      ASSERT_NEAR(found * Layout::at(grid.velocity, a, i), momentum[a][i], 1e-12);   // three hundred terms of order 1
      reached += found > 0;
    }
  EXPECT_GT(reached, places_of(blocks).size() / 8);
}

TEST(BruteForce, ScattersTheSumOverParticles) {
  for_layouts<double>([](auto layout) {
    constexpr int D = decltype(layout)::kDimension;
    for (const Kernel kernel : kKernels) expect_scatters_the_sum(layout, kernel, lattice_of<D>(7));
  });
}

// Any number of cells: blocks that are cut, odd numbers of blocks, stencils that meet themselves.
TEST(BruteForce, ScattersAroundPeriodicSides) {
  for_layouts<double>([](auto layout) {
    constexpr int D = decltype(layout)::kDimension;
    for (const Kernel kernel : kKernels)
      for (const int edge : {1, 3, 4, 5, 8, 9, 12, 13}) {
        SCOPED_TRACE(edge);
        if (D == 2 || edge < 9) expect_scatters_the_sum(layout, kernel, lattice_of<D>(edge, true));
      }
    const Lattice<D> around = lattice_of<D>(6, true);
    std::array<bool, D> all_but_x = around.periodic;
    all_but_x[0] = false;
    expect_scatters_the_sum(layout, Kernel::quadratic, Lattice<D>(around.cells, all_but_x));
  });
}

/// The velocity at a site is the constant mode that a particle there would gather.
TEST(BruteForce, InterpolatesWithTheKernelsWeights) {
  for_layouts<double>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    const Lattice<D> lattice = lattice_of<D>(6);
    const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
    const auto field = random_field<Layout>(blocks, 5);
    for (const Kernel kernel : kKernels) {
      const GridTransfer<Layout> transfer(kernel, prefix<D>(kernel, 1));
      const auto particles = random_particles<D, double>(lattice, 100, 1, 6);
      for (std::size_t p = 0; p < particles.size(); ++p) {
        const Vec<D, double> v = transfer.velocity_at(blocks, field, {particles.cell[p], particles.offset[p]});
        for (int a = 0; a < D; ++a) {
          const auto d = dense<Layout>(kernel, transfer.modes(), particles.cell[p], particles.offset[p], a);
          ASSERT_NEAR(v[a], d.weight.dot(values_at<Layout>(d.node, field, blocks, a)), 1e-15 * 8);
        }
      }
    }
  });
}

}  // namespace
}  // namespace sim
