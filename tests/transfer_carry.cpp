// How coefficients are carried from step to step: the limiter makes no energy, keeps momentum and is idle at rest; what a carry does to waves
// on a lattice of particles.
#include "sim/transfer/carry.h"

#include <cmath>
#include <complex>

#include "tests/transfer_cases.h"

namespace sim {
namespace {

using namespace cases;

/// Half of the particles within 1e-1 to 1e-12 cells of where a norm vanishes or a stencil jumps.
template <int D, class Real>
void move_near_edges(std::vector<Vec<D, Real>>& offsets, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> exponent(-12, -1), sign(-1, 1);
  for (std::size_t p = 0; p < offsets.size(); p += 2)
    for (int a = 0; a < D; ++a) {
      const Real edge = p % 4 == 0 ? Real(0.5) : Real(0), near = edge + Real(std::copysign(std::pow(10, exponent(random)), sign(random)));
      offsets[p][a] = near < 0 ? std::min(near + 1, std::nextafter(Real(1), Real(0))) : near;
    }
}

/// Particles with somewhere else to have come from.
template <class Layout>
struct Move {
  static constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;
  Lattice<D> lattice = lattice_of<D>(5);
  ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
  GridTransfer<Layout> transfer;
  Particles<D, Real> particles;
  Departure<D, Real> from;
  typename GridTransfer<Layout>::Mass mass;

  Move(const std::vector<ModeIndex<D>>& modes, std::size_t count)
      : transfer(Kernel::quadratic, modes), particles(random_particles<D, Real>(lattice, count, modes.size(), 51)) {
    const auto other = random_particles<D, Real>(lattice, count, 1, 52);
    from = {other.cell, other.offset};
    move_near_edges<D, Real>(particles.offset, 53);
    move_near_edges<D, Real>(from.offset, 54);
    typename GridTransfer<Layout>::Grid grid;
    auto sortable = particles;
    const CellRanges ranges = sorted(sortable, lattice);
    transfer.scatter(sortable, ranges, blocks, grid);
    mass = grid.mass;
  }
};

/// Kinetic energy of a particle [J], with norms in long double at the offset that the transfer computes with.
template <class Layout>
long double energy(const std::vector<ModeIndex<Layout::kDimension>>& modes, const Particles<Layout::kDimension, typename Layout::Real>& particles, std::size_t p,
                   const Cell<Layout::kDimension>& cell, const Vec<Layout::kDimension, typename Layout::Real>& offset) {
  constexpr int D = Layout::kDimension;
  long double sum = 0;
  for (int a = 0; a < D; ++a) {
    const auto stencil = stencil_of<QuadraticBasis<typename Layout::Real>, Layout>(cell, offset, a);
    for (std::size_t r = 0; r < modes.size(); ++r) {
      long double norm = 1;
      for (int b = 0; b < D; ++b) {
        QuadraticBasis<long double> exact;
        exact.x = stencil[b].x;
        norm *= exact.norm(modes[r][b]);
      }
      const long double c = particles.component(p, a)[r];
      sum += 0.5L * particles.mass * c * c * norm;
    }
  }
  return sum;
}

template <class Layout>
void expect_no_energy_made(Layout, std::size_t count, long double tolerance) {
  constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;
  const auto modes = prefix<D>(Kernel::quadratic);
  Move<Layout> move(modes, count);
  const Particles<D, Real> before = move.particles;
  const std::int64_t scaled = move.transfer.limit({}, move.blocks, move.from, move.mass, Carry::limited, move.particles);
  EXPECT_GT(scaled, std::int64_t(count));
  long double worst = 0, worst_fixed = 0;
  std::int64_t changed = 0;
  for (std::size_t p = 0; p < count; ++p) {
    const long double then = energy<Layout>(modes, before, p, move.from.cell[p], move.from.offset[p]);
    const long double now = energy<Layout>(modes, move.particles, p, move.particles.cell[p], move.particles.offset[p]);
    const long double fixed = energy<Layout>(modes, before, p, move.particles.cell[p], move.particles.offset[p]);
    worst = std::max(worst, now / then - 1);
    worst_fixed = std::max(worst_fixed, fixed / then - 1);
  }
  for (std::size_t k = 0; k < before.coefficients.size(); ++k) changed += move.particles.coefficients[k] != before.coefficients[k];
  EXPECT_EQ(changed, scaled);
  EXPECT_LE(worst, tolerance);
  EXPECT_GT(worst_fixed, 0.1);   // what there was to prevent
}

TEST(Carry, TheLimiterMakesNoEnergy) {
  for_layouts<double>([](auto layout) { expect_no_energy_made(layout, 5000, 2e-15L); });
  for_layouts<float>([](auto layout) { expect_no_energy_made(layout, 5000, 4e-7L); });
}

// Modes with a g factor are orthogonal to 1 and w, so the grid's momenta do not notice that they were scaled.
TEST(Carry, TheLimiterKeepsMomentum) {
  for_layouts<double>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    const auto modes = prefix<D>(Kernel::quadratic);
    for (const Carry carry : {Carry::limited, Carry::hybrid}) {
      Move<Layout> move(modes, 300);
      auto limited = move.particles;
      ASSERT_GT(move.transfer.limit({}, move.blocks, move.from, move.mass, carry, limited), 0);
      for (std::size_t p = 0; p < limited.size(); ++p)
        for (int a = 0; a < D; ++a)
          for (std::size_t r = 0; r < modes.size(); ++r)
            if (bent_axes<D>(modes[r]) == 0) {
              ASSERT_EQ(limited.component(p, a)[r], move.particles.component(p, a)[r]);
            }
      const auto momenta = [&](Particles<D, double> particles) {
        const CellRanges ranges = sorted(particles, move.lattice);
        typename GridTransfer<Layout>::Grid grid;
        move.transfer.scatter(particles, ranges, move.blocks, grid);
        return move.transfer.sums(move.blocks, grid, particles.mass, kCell);
      };
      const auto fixed = momenta(move.particles), kept = momenta(limited);
      const double scale = limited.mass * double(limited.size());
      EXPECT_GT(fixed.angular_momentum.norm(), 1e-4 * scale);
      EXPECT_LE((kept.linear_momentum - fixed.linear_momentum).norm(), 1e-15 * scale);
      EXPECT_LE((kept.angular_momentum - fixed.angular_momentum).norm(), 1e-15 * scale);
    }
  });
}

// Where nothing moved no bit changes, on the edges of stencils neither.
TEST(Carry, AllCarriesAreOneAtRest) {
  for_layouts<float>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    for (const Carry carry : {Carry::fixed, Carry::limited, Carry::hybrid}) {
      Move<Layout> move(prefix<D>(Kernel::quadratic), 500);
      for (std::size_t p = 0; p < 100; ++p) move.particles.offset[p].setConstant(p % 2 ? 0.5f : 0.0f);
      const auto before = move.particles.coefficients;
      EXPECT_EQ(move.transfer.limit({}, move.blocks, {move.particles.cell, move.particles.offset}, move.mass, carry, move.particles), 0);
      EXPECT_EQ(move.particles.coefficients, before);
    }
  });
}

TEST(Carry, FixedLeavesEverythingAsItIs) {
  Move<FaceLayout<3, float>> move(prefix<3>(Kernel::quadratic), 500);
  const auto before = move.particles.coefficients;
  EXPECT_EQ(move.transfer.limit({}, move.blocks, {}, {}, Carry::fixed, move.particles), 0);
  EXPECT_EQ(move.particles.coefficients, before);
}

// In the middle of a crowd hybrid is fixed, at its rim it is limited; which is which is decided by the masses where the particle came from,
// on the lattice of each component.
TEST(Carry, HybridLimitsBesideLightPlacesOnly) {
  for_layouts<double>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    Move<Layout> move(prefix<D>(Kernel::quadratic), 400);
    for (auto& cell : move.from.cell) cell[0] %= 3;   // the crowd lies on one side
    auto crowd = random_particles<D, double>(move.lattice, std::size_t(8 * int_power(5, D)), move.transfer.modes().size(), 61);
    for (auto& cell : crowd.cell) cell[0] %= 3;
    const CellRanges ranges = sorted(crowd, move.lattice);
    typename GridTransfer<Layout>::Grid grid;
    move.transfer.scatter(crowd, ranges, move.blocks, grid);

    auto limited = move.particles, hybrid = move.particles;
    move.transfer.limit({}, move.blocks, move.from, grid.mass, Carry::limited, limited);
    move.transfer.limit({}, move.blocks, move.from, grid.mass, Carry::hybrid, hybrid);
    std::size_t inside = 0, rim = 0, mixed = 0;
    for (std::size_t p = 0; p < hybrid.size(); ++p) {
      int light_components = 0;
      for (int a = 0; a < D; ++a) {
        const auto stencil = stencil_of<QuadraticBasis<double>, Layout>(move.from.cell[p], move.from.offset[p], a);
        bool light = false;
        for (int node = 0; node < int_power(3, D); ++node) {
          Cell<D> at;
          for (int b = 0, rest = node; b < D; ++b, rest /= 3) at[b] = stencil[b].base + rest % 3;
          light |= Layout::mass(grid.mass, lattice_of_component<Layout>(a))[std::size_t(move.blocks.index(at))] < 0.05;
        }
        const auto expected = (light ? limited : move.particles).component(p, a), found = hybrid.component(p, a);
        for (std::size_t r = 0; r < found.size(); ++r) ASSERT_EQ(found[r], expected[r]) << p << ' ' << a;
        ++(light ? rim : inside);
        light_components += light;
      }
      mixed += light_components > 0 && light_components < D;
    }
    EXPECT_GT(inside, 30u);
    EXPECT_GT(rim, 30u);
    EXPECT_EQ(mixed > 0, Layout::kLattices > 1);
  });
}

// A stencil that reaches across a periodic side finds the masses there in the images.
TEST(Carry, HybridSeesAcrossPeriodicSides) {
  for_layouts<double>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    const Lattice<D> lattice = lattice_of<D>(8, true);
    const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
    const GridTransfer<Layout> transfer(Kernel::quadratic, prefix<D>(Kernel::quadratic));
    auto particles = random_particles<D, double>(lattice, std::size_t(8 * int_power(8, D)), transfer.modes().size(), 71);
    for (std::size_t p = 0; p < particles.size(); ++p)   // every cell alike: nothing is light
      for (int a = 0, rest = int(p / 8); a < D; ++a, rest /= 8) particles.cell[p][a] = rest % 8, particles.offset[p][a] = (p >> a & 1) ? 0.3 : 0.8;
    const CellRanges ranges = sorted(particles, lattice);
    typename GridTransfer<Layout>::Grid grid;
    transfer.scatter(particles, ranges, blocks, grid);
    const Departure<D, double> from{particles.cell, particles.offset};
    for (auto& offset : particles.offset) offset.array() += 0.17;
    EXPECT_EQ(transfer.limit({}, blocks, from, grid.mass, Carry::hybrid, particles), 0);
    EXPECT_GT(transfer.limit({}, blocks, from, grid.mass, Carry::limited, particles), 0);
  });
}

// Block by block, with masses looked up in a copy, hybrid does what it does particle by particle; whole blocks and cut ones, sides or none.
TEST(Carry, HybridGoesByBlocksToTheSameBits) {
  for_layouts<float>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    for (const bool periodic : {false, true})
      for (const int edge : {8, 10, 13})
        for (const bool own : {false, true}) {
          const Lattice<D> lattice = lattice_of<D>(edge, periodic);
          const GridTransfer<Layout> transfer(Kernel::quadratic, prefix<D>(Kernel::quadratic));
          const Home home = own ? transfer.home() : Home::cell;
          auto particles = random_particles<D, float>(lattice, D == 2 ? 60 : 700, transfer.modes().size(), 81);
          for (auto& cell : particles.cell) cell[0] %= edge / 2;   // a crowd with rims
          const CellRanges ranges = CanonicalOrder<D, float>().sort(particles, lattice, home);
          ActiveBlocks<D> blocks(lattice);
          blocks.cover(ranges, 2);
          typename GridTransfer<Layout>::Grid grid;
          transfer.scatter(particles, ranges, blocks, grid);
          const Departure<D, float> from{particles.cell, particles.offset};
          for (auto& offset : particles.offset) offset.array() = (offset.array() + 0.17f).min(0.999f);
          auto alone = particles;
          const std::int64_t scaled = transfer.limit(ranges, blocks, from, grid.mass, Carry::hybrid, particles);
          EXPECT_GT(scaled, 0);
          EXPECT_EQ(scaled, transfer.limit({}, blocks, from, grid.mass, Carry::hybrid, alone));
          EXPECT_EQ(particles.coefficients, alone.coefficients);
        }
  });
}

/// How a carry changes the coefficients of one axis: {1, w, g} at the offset before, to be evaluated at the offset now.
enum class OneAxis { fixed, limited, reexpanded };

/// Gain of a wave of phase theta a cell over P2G(now) . carry . G2P(before), one particle in every cell, all at the same offset.
template <class Basis>
double gain(double theta, const Basis& before, const Basis& now, OneAxis carry) {
  constexpr int n = Basis::kNodes;
  std::array<std::complex<double>, n> wave, c{};
  for (int i = 0; i < n; ++i) wave[i] = std::polar(1.0, theta * i);
  for (int a = 0; a < n; ++a)
    for (int i = 0; i < n; ++i) c[a] += before.dual[a][i] * wave[i];
  if constexpr (n == 3) {
    if (carry == OneAxis::limited) c[2] *= limited_factor(root_norm_of_g(before.x), root_norm_of_g(now.x));
    // The polynomial g of before, written with the g of now, leaves a multiple of w.
    const auto slope = [](double x) { return x * (1 - 4 * x * x); };
    if (carry == OneAxis::reexpanded) c[1] += c[2] * (slope(now.x) - slope(before.x));
  }
  std::complex<double> sum = 0;
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < n; ++a) sum += now.weight[i] * now.phi[a][i] * c[a] * std::conj(wave[i]);
  return std::abs(sum);
}

struct Growth {
  double one_step = 0;   // largest gain
  double cycle = 0;      // largest gain a step over any closed cycle of up to eight offsets
};

/// From the gains between `states` offsets, [before * states + now]: the best cycles by max-plus powers.
void accumulate(const std::vector<double>& gains, std::size_t states, Growth& growth) {
  std::vector<double> step(gains.size()), path;
  for (std::size_t k = 0; k < gains.size(); ++k) {
    growth.one_step = std::max(growth.one_step, gains[k]);
    step[k] = std::log(std::max(gains[k], 1e-300));
  }
  path = step;
  for (int length = 1; length <= 8; ++length) {
    for (std::size_t i = 0; i < states; ++i) growth.cycle = std::max(growth.cycle, std::exp(path[i * states + i] / length));
    std::vector<double> longer(gains.size(), -1e300);
    for (std::size_t i = 0; i < states; ++i)
      for (std::size_t k = 0; k < states; ++k)
        for (std::size_t j = 0; j < states; ++j) longer[i * states + j] = std::max(longer[i * states + j], path[i * states + k] + step[k * states + j]);
    path = longer;
  }
}

template <class Basis>
Growth growth_of(OneAxis carry) {
  constexpr int states = 48, waves = 24;
  std::vector<Basis> bases;
  for (int k = 0; k < states; ++k) bases.emplace_back(0, double(k) / states, false);
  Growth growth;
  for (int wave = 1; wave <= waves; ++wave) {
    std::vector<double> gains;
    for (const Basis& before : bases)
      for (const Basis& now : bases) gains.push_back(gain(M_PI * wave / waves, before, now, carry));
    accumulate(gains, states, growth);
  }
  return growth;
}

// What is one step's gain need not add up: the worst pair of offsets of the linear kernel is x = 0 and 1/4, whose way back damps.
TEST(Carry, FixedCarryHasNoGrowingCycles) {
  const Growth linear = growth_of<LinearBasis<double>>(OneAxis::fixed), quadratic = growth_of<QuadraticBasis<double>>(OneAxis::fixed);
  EXPECT_NEAR(linear.one_step, 1.25, 1e-12);
  EXPECT_LE(linear.cycle, 1 + 1e-14);
  EXPECT_GT(quadratic.one_step, 1.1);
  EXPECT_LT(quadratic.one_step, 1.12);
  EXPECT_LE(quadratic.cycle, 1 + 1e-14);
}

TEST(Carry, LimitedCarryNeverGrows) {
  const Growth growth = growth_of<QuadraticBasis<double>>(OneAxis::limited);
  EXPECT_LE(growth.one_step, 1 + 1e-14);
  EXPECT_GE(growth.cycle, 1 - 1e-14);   // and keeps what stays where it is
}

// The energy of a g mode, c^2 D, stays as it is unless D grew, whatever the axes: a limiter that took more would pass for safe.
TEST(Carry, TheLimiterTakesNoMoreThanItMust) {
  std::mt19937 random(81);
  std::uniform_real_distribution<double> offset(0, 1);
  for (int k = 0; k < 1000; ++k)
    for (int axes = 1; axes <= 3; ++axes) {
      double then = 1, now = 1, energy_then = 1, energy_now = 1;
      for (int a = 0; a < axes; ++a) {
        const QuadraticBasis<double> before(0, offset(random), true), after(0, offset(random), true);
        then *= root_norm_of_g(before.x), now *= root_norm_of_g(after.x);
        energy_then *= before.norm(2), energy_now *= after.norm(2);
      }
      const double f = limited_factor(then, now);
      ASSERT_NEAR(f * f * energy_now / std::min(energy_then, energy_now), 1, 1e-12);
    }
}

// Why it is not offered: cycles that grow, and spin that comes from nowhere.
TEST(Carry, ReexpandingGrows) {
  const Growth growth = growth_of<QuadraticBasis<double>>(OneAxis::reexpanded);
  EXPECT_GT(growth.cycle, 1 + 8e-4);
  EXPECT_LT(growth.cycle, 1 + 1e-3);
  EXPECT_GT(growth.one_step, 1.2);
}

/// Gain of a wave in the plane with all nine modes, a g of both axes limited by the product of the axes.
double plane_gain(const std::array<double, 2>& theta, const Stencil<QuadraticBasis<double>, 2>& before, const Stencil<QuadraticBasis<double>, 2>& now, bool limited) {
  Tensor<double, 3, 2> part[2];   // real, imaginary
  for (int i = 0; i < 9; ++i) {
    const auto wave = std::polar(1.0, theta[0] * (i / 3) + theta[1] * (i % 3));
    part[0][i] = wave.real(), part[1][i] = wave.imag();
  }
  const auto w = weights<2>(now);
  std::complex<double> sum = 0;
  for (int k = 0; k < 2; ++k) {
    analyse<2>(before, part[k]);
    for (const ModeIndex<2>& mode : ordered_modes<2>(2)) {
      double then = 1, here = 1;
      for (int a = 0; a < 2; ++a)
        if (mode[a] == 2) then *= root_norm_of_g(before[a].x), here *= root_norm_of_g(now[a].x);
      if (limited) part[k][std::size_t(tensor_place<3, 2>(mode))] *= limited_factor(then, here);
    }
    evaluate<2>(now, part[k]);
    for (int i = 0; i < 9; ++i)
      sum += w[i] * part[k][i] * (k == 0 ? std::complex<double>(1, 0) : std::complex<double>(0, 1)) * std::polar(1.0, -theta[0] * (i / 3) - theta[1] * (i % 3));
  }
  return std::abs(sum);
}

TEST(Carry, LimitedCarryNeverGrowsInThePlane) {
  const double offsets[] = {0, 0.11, 0.26, 0.4, 0.499, 0.5, 0.73, 0.93};
  std::vector<Stencil<QuadraticBasis<double>, 2>> stencils;
  for (const double x : offsets)
    for (const double y : offsets) stencils.push_back({QuadraticBasis<double>(0, x, false), QuadraticBasis<double>(0, y, true)});
  Growth limited, fixed;
  for (int u = 0; u <= 3; ++u)
    for (int v = 0; v <= 3; ++v) {
      std::vector<double> gains, fixed_gains;
      for (const auto& before : stencils)
        for (const auto& now : stencils) {
          gains.push_back(plane_gain({M_PI * u / 3, M_PI * v / 3}, before, now, true));
          fixed_gains.push_back(plane_gain({M_PI * u / 3, M_PI * v / 3}, before, now, false));
        }
      accumulate(gains, stencils.size(), limited);
      accumulate(fixed_gains, stencils.size(), fixed);
    }
  EXPECT_LE(limited.one_step, 1 + 1e-14);
  EXPECT_GT(fixed.one_step, 1.1);
  EXPECT_LE(fixed.cycle, 1 + 1e-14);
}

}  // namespace
}  // namespace sim
