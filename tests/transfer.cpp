// The transfer's exact identities and what it conserves, for every scheme of one code path.
#include "sim/transfer/mac_transfer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sim {
namespace {

constexpr double kCell = 0.1;   // [m]

template <int D>
Lattice<D> lattice_of(int edge) {
  Cell<D> cells;
  cells.fill(edge);
  return Lattice<D>(cells);
}

template <int D, class Real>
Particles<D, Real> random_particles(const Lattice<D>& lattice, std::size_t count, int modes, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1), velocity(-1, 1);
  Particles<D, Real> p;
  p.modes = modes;
  p.mass = 0.3;
  p.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    p.id[i] = std::int64_t(count - 1 - i);
    for (int a = 0; a < D; ++a) {
      p.cell[i][a] = int(uniform(random) * lattice.cells[a]);
      p.offset[i][a] = Real(std::min(uniform(random), 0.9999));
    }
  }
  for (Real& c : p.coefficients) c = Real(velocity(random));
  return p;
}

template <int D, class Real>
CellRanges sorted(Particles<D, Real>& particles, const Lattice<D>& lattice) {
  return CanonicalOrder<D, Real>().sort(particles, lattice);
}

template <int D, class Real>
FaceField<D, Real> random_field(const Lattice<D>& lattice, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> velocity(-1, 1);
  FaceField<D, Real> v;
  for (auto& component : v) {
    component.resize(lattice.size);
    for (Real& value : component) value = Real(velocity(random));
  }
  return v;
}

/// Largest difference between a random field and itself after G2P and P2G, over faces that a particle reaches.
template <int D, class Real>
double round_trip_loss(Transfer scheme, Kernel kernel, std::size_t count) {
  const Lattice<D> lattice = lattice_of<D>(6);
  const MacTransfer<D, Real> transfer(lattice, kernel, mode_set<D>(scheme, kernel, {}));
  Particles<D, Real> particles = random_particles<D, Real>(lattice, count, int(transfer.modes().size()), 1);
  const FaceField<D, Real> field = random_field<D, Real>(lattice, 2);
  const CellRanges ranges = sorted(particles, lattice);
  transfer.gather(field, nullptr, {}, particles);
  MacVelocity<D, Real> grid;
  transfer.scatter(particles, ranges, grid);
  double worst = 0;
  std::size_t reached = 0;
  for (int a = 0; a < D; ++a)
    for (std::size_t i = 0; i < lattice.size; ++i)
      if (double(grid.mass[a][i]) > 1e-3) worst = std::max(worst, double(std::abs(grid.velocity[a][i] - field[a][i]))), ++reached;
  EXPECT_GT(reached, std::size_t(D));
  return worst;
}

TEST(Transfer, FullModesLoseNothingInDouble) {
  for (const std::size_t count : {std::size_t(1), std::size_t(200), std::size_t(2000)}) {
    EXPECT_LE((round_trip_loss<2, double>(Transfer::polypic, Kernel::linear, count)), 1e-13);
    EXPECT_LE((round_trip_loss<2, double>(Transfer::polypic, Kernel::quadratic, count)), 1e-13);
    EXPECT_LE((round_trip_loss<3, double>(Transfer::polypic, Kernel::linear, count)), 1e-13);
    EXPECT_LE((round_trip_loss<3, double>(Transfer::polypic, Kernel::quadratic, count)), 1e-13);
  }
}

TEST(Transfer, FullModesLoseRoundOffInFloat) {
  for (const std::size_t count : {std::size_t(1), std::size_t(200), std::size_t(2000)}) {
    EXPECT_LE((round_trip_loss<3, float>(Transfer::polypic, Kernel::linear, count)), 2e-6);
    EXPECT_LE((round_trip_loss<3, float>(Transfer::polypic, Kernel::quadratic, count)), 2e-6);
  }
}

TEST(Transfer, ApicAndPicLoseWhatTheyCannotCarry) {
  EXPECT_GT((round_trip_loss<3, double>(Transfer::apic, Kernel::quadratic, 2000)), 0.3);
  EXPECT_GT((round_trip_loss<3, double>(Transfer::pic, Kernel::quadratic, 2000)), 0.3);
}

template <class Basis>
void expect_dual(typename Basis::Real t, bool centred) {
  using Real = typename Basis::Real;
  const Basis b(3, t, centred);
  for (int r = 0; r < Basis::kNodes; ++r)
    for (int s = 0; s < Basis::kNodes; ++s) {
      Real product = 0, energy = 0;
      for (int i = 0; i < Basis::kNodes; ++i) {
        product += b.dual[r][i] * b.phi[s][i];
        energy += b.weight[i] * b.phi[r][i] * b.phi[s][i];
      }
      EXPECT_NEAR(product, r == s, 1e-14) << "t = " << t;
      EXPECT_NEAR(energy, r == s ? b.norm(r) : 0, 1e-14) << "t = " << t;
    }
}

// The Gram matrix is singular at half a cell; the dual rows are not.
TEST(Basis, DualRowsInvertTheModesAtEveryOffset) {
  const double ulp = 0x1p-53;
  for (const double t : {0.0, ulp, 0.25, 0.5 - ulp, 0.5, 0.5 + 2 * ulp, 0.7321, 1 - ulp})
    for (const bool centred : {false, true}) {
      expect_dual<LinearBasis<double>>(t, centred);
      expect_dual<QuadraticBasis<double>>(t, centred);
    }
}

TEST(Basis, ReproducesPositionsOnBothLattices) {
  for (const double t : {0.0, 0.1, 0.49, 0.5, 0.9}) {
    for (const bool centred : {false, true}) {
      const LinearBasis<double> l(3, t, centred);
      const QuadraticBasis<double> q(3, t, centred);
      const double shift = centred ? 0.5 : 0;
      double x_l = 0, x_q = 0;
      for (int i = 0; i < 2; ++i) x_l += l.weight[i] * (l.base + i + shift);
      for (int i = 0; i < 3; ++i) x_q += q.weight[i] * (q.base + i + shift);
      EXPECT_NEAR(x_l, 3 + t, 1e-14);
      EXPECT_NEAR(x_q, 3 + t, 1e-14);
    }
  }
}

template <int D, class Real>
void expect_momentum_kept(Transfer scheme, Kernel kernel, double tolerance) {
  const Lattice<D> lattice = lattice_of<D>(6);
  const MacTransfer<D, Real> transfer(lattice, kernel, mode_set<D>(scheme, kernel, {}));
  Particles<D, Real> particles = random_particles<D, Real>(lattice, 500, int(transfer.modes().size()), 3);
  const auto before = transfer.sums(particles, kCell);
  const double scale = particles.mass * double(particles.size());
  ASSERT_GT(before.linear_momentum.norm(), 1e-3 * scale);
  ASSERT_GT(before.angular_momentum.norm(), 1e-4 * scale);

  const CellRanges ranges = sorted(particles, lattice);
  MacVelocity<D, Real> grid;
  transfer.scatter(particles, ranges, grid);
  const auto on_grid = transfer.sums(grid, particles.mass, kCell);
  EXPECT_LE((on_grid.linear_momentum - before.linear_momentum).norm(), tolerance * scale);
  EXPECT_LE((on_grid.angular_momentum - before.angular_momentum).norm(), tolerance * scale);

  transfer.gather(grid.velocity, nullptr, {}, particles);
  const auto after = transfer.sums(particles, kCell);
  EXPECT_LE((after.linear_momentum - before.linear_momentum).norm(), tolerance * scale);
  if (transfer.modes().size() > 1) {
    EXPECT_LE((after.angular_momentum - before.angular_momentum).norm(), tolerance * scale);
  }
}

TEST(Transfer, KeepsLinearAndAngularMomentumBothWays) {
  for (const Kernel kernel : {Kernel::linear, Kernel::quadratic})
    for (const Transfer scheme : {Transfer::pic, Transfer::apic, Transfer::polypic}) {
      expect_momentum_kept<2, double>(scheme, kernel, 1e-14);
      expect_momentum_kept<3, double>(scheme, kernel, 1e-14);
      expect_momentum_kept<3, float>(scheme, kernel, 1e-7);
    }
}

// Without a change on the grid FLIP with keep = 1 leaves a particle as it was.
TEST(Transfer, FlipKeepsWhatTheGridDidNotChange) {
  const Lattice<3> lattice = lattice_of<3>(6);
  const MacTransfer<3, double> transfer(lattice, Kernel::linear, mode_set<3>(Transfer::flip, Kernel::linear, {}));
  Particles<3, double> particles = random_particles<3, double>(lattice, 300, 1, 5);
  const CellRanges ranges = sorted(particles, lattice);
  MacVelocity<3, double> grid;
  transfer.scatter(particles, ranges, grid);
  const std::vector<double> before = particles.coefficients;
  transfer.gather(grid.velocity, &grid.velocity, {true, 1.0}, particles);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(particles.coefficients[i], before[i], 1e-14);
  transfer.gather(grid.velocity, &grid.velocity, {true, 0.0}, particles);
  double change = 0;
  for (std::size_t i = 0; i < before.size(); ++i) change = std::max(change, std::abs(particles.coefficients[i] - before[i]));
  EXPECT_GT(change, 0.1);
}

TEST(Modes, FollowTheCorrectedOrder) {
  const auto modes = ordered_modes<3>(2);
  ASSERT_EQ(modes.size(), 27u);
  EXPECT_EQ(modes[5], (ModeIndex<3>{1, 0, 1}));
  EXPECT_EQ(modes[6], (ModeIndex<3>{0, 1, 1}));
  EXPECT_EQ(modes[12], (ModeIndex<3>{2, 0, 2}));
  EXPECT_EQ(modes[13], (ModeIndex<3>{0, 2, 2}));
  EXPECT_EQ(mode_set<3>(Transfer::polypic, Kernel::quadratic, {0, "quadratic"}).size(), 10u);
  EXPECT_EQ(mode_set<3>(Transfer::polypic, Kernel::quadratic, {0, "multilinear"}).size(), 8u);
  EXPECT_EQ(mode_set<3>(Transfer::polypic, Kernel::linear, {}).size(), 8u);
  EXPECT_EQ(mode_set<3>(Transfer::apic, Kernel::linear, {}).size(), 4u);
  EXPECT_EQ(mode_set<2>(Transfer::polypic, Kernel::quadratic, {}).size(), 9u);
}

TEST(Order, IsCanonicalWhateverTheHistory) {
  const Lattice<3> lattice = lattice_of<3>(9);
  Particles<3, float> a = random_particles<3, float>(lattice, 3000, 4, 7), b = a;
  for (std::size_t i = 0, j = b.size() - 1; i < j; ++i, --j) {
    std::swap(b.cell[i], b.cell[j]), std::swap(b.offset[i], b.offset[j]), std::swap(b.id[i], b.id[j]);
    std::swap_ranges(&b.coefficients[i * b.row()], &b.coefficients[i * b.row()] + b.row(), &b.coefficients[j * b.row()]);
  }
  ASSERT_NE(a.id, b.id);
  sorted(a, lattice);
  sorted(b, lattice);
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.coefficients, b.coefficients);
  for (std::size_t i = 1; i < a.size(); ++i) {
    const std::size_t before = lattice.key(a.cell[i - 1]), here = lattice.key(a.cell[i]);
    ASSERT_TRUE(before < here || (before == here && a.id[i - 1] < a.id[i]));
  }
}

TEST(Site, AnOffsetThatRoundsToOneIsTheNextCell) {
  Site<3, float> site{{4, 4, 4}, Vec<3, float>(0, 0, 0)};
  site.move(Vec<3, float>(-1e-12f, 0, 0));
  EXPECT_GE(site.offset[0], 0);
  EXPECT_LT(site.offset[0], 1);
  EXPECT_EQ(site.cell[0], 4);
}

}  // namespace
}  // namespace sim
