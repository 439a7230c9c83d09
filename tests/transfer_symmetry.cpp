// Results do not depend on which axis is called first, on where a scene lies, on how particles are stored or on the number of threads.
#include <cmath>
#include <map>
#include <set>

#include "tests/threads.h"
#include "tests/transfer_cases.h"

namespace sim {
namespace {

using namespace cases;

/// Random particles whose offsets are odd multiples of 1/128: a mirrored or shifted particle is exact.
template <int D, class Real>
Particles<D, Real> exact_particles(const Lattice<D>& lattice, std::size_t count, std::size_t modes, unsigned seed) {
  auto particles = random_particles<D, Real>(lattice, count, modes, seed);
  for (auto& offset : particles.offset)
    for (int a = 0; a < D; ++a) offset[a] = (2 * std::floor(offset[a] * 64) + 1) / 128;
  return particles;
}

/// The scene with axis a where axis to[a] was.
template <int D>
Cell<D> permuted(const Cell<D>& at, const std::array<int, D>& to) {
  Cell<D> result;
  for (int a = 0; a < D; ++a) result[a] = at[to[a]];
  return result;
}

/// What particles at random places bring back to the grid of a field.
template <class Layout>
auto filtered(const GridTransfer<Layout>& transfer, const ActiveBlocks<Layout::kDimension>& blocks, const typename Layout::Field& field,
              Particles<Layout::kDimension, double> particles) {
  const CellRanges ranges = sorted(particles, blocks.lattice());
  transfer.gather(blocks, field, nullptr, {}, particles);
  typename GridTransfer<Layout>::Grid grid;
  transfer.scatter(particles, ranges, blocks, grid);
  return grid;
}

/// Largest difference between the filtered field of a permuted scene and the permuted filtered field.
template <class Layout>
double permutation_defect(Layout, std::size_t count, const std::array<int, Layout::kDimension>& to) {
  constexpr int D = Layout::kDimension;
  const Lattice<D> lattice = lattice_of<D>(5);
  const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
  const GridTransfer<Layout> transfer(Kernel::quadratic, prefix<D>(Kernel::quadratic, count));
  const auto particles = exact_particles<D, double>(lattice, std::size_t(2 * int_power(5, D)), count, 3);
  const auto field = random_field<Layout>(blocks, 4);
  auto moved_particles = particles;
  auto moved_field = field;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    moved_particles.cell[p] = permuted<D>(particles.cell[p], to);
    for (int a = 0; a < D; ++a) moved_particles.offset[p][a] = particles.offset[p][to[a]];
  }
  const auto moved_index = [&](std::size_t i) { return std::size_t(blocks.index(permuted<D>(blocks.cell_at(i), to))); };
  for (int a = 0; a < D; ++a)
    for (const std::size_t i : places_of(blocks)) Layout::at(moved_field, a, moved_index(i)) = Layout::at(field, to[a], i);

  const auto grid = filtered<Layout>(transfer, blocks, field, particles), moved = filtered<Layout>(transfer, blocks, moved_field, moved_particles);
  double worst = 0, largest = 0;
  for (int a = 0; a < D; ++a)
    for (const std::size_t i : places_of(blocks)) {
      worst = std::max(worst, std::abs(Layout::at(moved.velocity, a, moved_index(i)) - Layout::at(grid.velocity, to[a], i)));
      largest = std::max(largest, std::abs(Layout::at(grid.velocity, a, i)));
    }
  EXPECT_GT(largest, 0.1);
  return worst;
}

template <class Layout>
std::set<std::size_t> symmetric_prefixes(Layout layout) {
  constexpr int D = Layout::kDimension;
  std::array<int, D> swap, turn;
  for (int a = 0; a < D; ++a) swap[a] = a, turn[a] = (a + 1) % D;
  std::swap(swap[0], swap[1]);
  std::set<std::size_t> symmetric;
  for (std::size_t count = 1; count <= prefix<D>(Kernel::quadratic).size(); ++count) {
    const double defect = std::max(permutation_defect(layout, count, swap), permutation_defect(layout, count, turn));
    if (defect <= 1e-12) symmetric.insert(count);
    else EXPECT_GE(defect, 1e-3) << count;   // no middle ground
  }
  return symmetric;
}

TEST(Symmetry, AxesMayBePermutedForTheSymmetricPrefixesOnly) {
  using Set = std::set<std::size_t>;
  EXPECT_EQ(symmetric_prefixes(FaceLayout<2, double>{}), (Set{1, 3, 4, 6, 8, 9}));
  EXPECT_EQ(symmetric_prefixes(NodeLayout<2, double>{}), (Set{1, 3, 4, 6, 8, 9}));
  EXPECT_EQ(symmetric_prefixes(FaceLayout<3, double>{}), (Set{1, 4, 7, 8, 11, 14, 15, 24, 27}));
  EXPECT_EQ(symmetric_prefixes(NodeLayout<3, double>{}), (Set{1, 4, 7, 8, 11, 14, 15, 24, 27}));
}

/// Every mode is even or odd in each axis, so any prefix has a mirror image: velocities along the axis and modes odd in it change sign.
template <class Layout>
void expect_mirrored(Layout, Kernel kernel, std::size_t count, int axis) {
  constexpr int D = Layout::kDimension;
  const Lattice<D> lattice = lattice_of<D>(5);
  const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
  const GridTransfer<Layout> transfer(kernel, prefix<D>(kernel, count));
  auto particles = exact_particles<D, double>(lattice, std::size_t(2 * int_power(5, D)), count, 5);
  auto mirrored = particles;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    mirrored.cell[p][axis] = lattice.cells[axis] - 1 - particles.cell[p][axis];
    mirrored.offset[p][axis] = 1 - particles.offset[p][axis];
    for (int a = 0; a < D; ++a)
      for (std::size_t r = 0; r < count; ++r)
        if ((a == axis) != (transfer.modes()[r][axis] == 1)) mirrored.component(p, a)[r] *= -1;
  }
  const CellRanges ranges = sorted(particles, lattice), mirrored_ranges = sorted(mirrored, lattice);
  typename GridTransfer<Layout>::Grid grid, image;
  transfer.scatter(particles, ranges, blocks, grid);
  transfer.scatter(mirrored, mirrored_ranges, blocks, image);
  double largest = 0;
  for (int a = 0; a < D; ++a)
    for (const std::size_t i : places_of(blocks)) {
      const int l = lattice_of_component<Layout>(a);
      if (!(Layout::mass(grid.mass, l)[i] > 0)) continue;
      Cell<D> at = blocks.cell_at(i);
      at[axis] = lattice.cells[axis] - at[axis] - (Layout::centred(l, axis) ? 1 : 0);
      const auto j = std::size_t(blocks.index(at));
      ASSERT_NEAR(Layout::mass(image.mass, l)[j], Layout::mass(grid.mass, l)[i], 1e-13);
      ASSERT_NEAR(Layout::at(image.velocity, a, j), (a == axis ? -1 : 1) * Layout::at(grid.velocity, a, i), 1e-12) << count << " modes";
      largest = std::max(largest, std::abs(Layout::at(grid.velocity, a, i)));
    }
  EXPECT_GT(largest, 0.1);
}

TEST(Symmetry, MirroredParticlesGiveTheMirroredField) {
  for_layouts<double>([](auto layout) {
    constexpr int D = decltype(layout)::kDimension;
    for (const Kernel kernel : kKernels)
      for (std::size_t count = 1; count <= prefix<D>(kernel).size(); ++count)
        for (int axis = 0; axis < D; ++axis) expect_mirrored(layout, kernel, count, axis);
  });
}

/// The field after P2G and the coefficients after G2P of it.
template <class Layout>
struct Outcome {
  typename GridTransfer<Layout>::Grid grid;
  Particles<Layout::kDimension, typename Layout::Real> particles;
};

template <class Layout>
Outcome<Layout> outcome(const Lattice<Layout::kDimension>& lattice, Kernel kernel, Particles<Layout::kDimension, typename Layout::Real> particles) {
  const GridTransfer<Layout> transfer(kernel, prefix<Layout::kDimension>(kernel, std::size_t(particles.modes)));
  const auto blocks = ActiveBlocks<Layout::kDimension>::whole(lattice);
  const CellRanges ranges = sorted(particles, lattice);
  Outcome<Layout> o;
  transfer.scatter(particles, ranges, blocks, o.grid);
  transfer.gather(blocks, o.grid.velocity, nullptr, {}, particles);
  o.particles = std::move(particles);
  return o;
}

/// Coefficients in the order of ids.
template <int D, class Real>
std::vector<Real> by_id(const Particles<D, Real>& particles) {
  std::vector<Real> sorted(particles.coefficients.size());
  for (std::size_t p = 0; p < particles.size(); ++p)
    std::copy_n(&particles.coefficients[p * particles.row()], particles.row(), &sorted[std::size_t(particles.id[p]) * particles.row()]);
  return sorted;
}

template <class Layout>
void expect_same_bits(const Outcome<Layout>& a, const Outcome<Layout>& b) {
  EXPECT_EQ(a.grid.velocity, b.grid.velocity);
  EXPECT_EQ(a.grid.mass, b.grid.mass);
  EXPECT_EQ(a.particles.id, b.particles.id);
  EXPECT_EQ(a.particles.coefficients, b.particles.coefficients);
}

// Two blocks are eight cells: colours and the order of cells within a block stay as they are, so sums keep their order. The velocities
// that a particle brings back hold every bit of the sums around it.
TEST(Symmetry, AShiftByEightCellsOrSixteenKeepsTheBits) {
  for_layouts<float>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    const Lattice<D> lattice = lattice_of<D>(D == 2 ? 32 : 24);
    const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
    for (const Kernel kernel : kKernels) {
      auto particles = random_particles<D, float>(lattice, 1500, prefix<D>(kernel).size(), 7, D == 2 ? 8 : 6);
      for (auto& cell : particles.cell)
        for (int a = 0; a < D; ++a) cell[a] = cell[a] % 9;
      const std::vector<float> here = by_id(outcome<Layout>(lattice, kernel, particles).particles);
      for (const int shift : {8, 16}) {
        if (shift + 9 > lattice.cells[0]) continue;
        auto there = particles;
        for (auto& cell : there.cell) cell[0] += shift, cell[D - 1] += 8;
        EXPECT_EQ(here, by_id(outcome<Layout>(lattice, kernel, there).particles)) << shift;
      }
    }
  });
}

TEST(Symmetry, AShiftAroundPeriodicSidesKeepsTheBits) {
  for_layouts<float>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    const Lattice<D> lattice = lattice_of<D>(D == 2 ? 24 : 16, true);
    const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
    for (const Kernel kernel : kKernels) {
      const auto particles = random_particles<D, float>(lattice, D == 2 ? 2000 : 8000, prefix<D>(kernel).size(), 8);
      const Outcome<Layout> here = outcome<Layout>(lattice, kernel, particles);
      auto shifted = particles;
      for (auto& cell : shifted.cell) {
        cell[0] += 8, cell[D - 1] += 8;
        cell = lattice.wrapped(cell);
      }
      const Outcome<Layout> there = outcome<Layout>(lattice, kernel, shifted);
      EXPECT_EQ(by_id(here.particles), by_id(there.particles));
      std::size_t compared = 0;
      for (const std::size_t i : places_of(blocks)) {
        Cell<D> at = blocks.cell_at(i);
        at[0] += 8, at[D - 1] += 8;
        const auto j = std::size_t(blocks.index(at));
        for (int a = 0; a < D; ++a) {
          ASSERT_EQ(Layout::at(here.grid.velocity, a, i), Layout::at(there.grid.velocity, a, j));
          ++compared;
        }
      }
      EXPECT_EQ(compared, D * std::size_t(int_power(lattice.cells[0], D)));
    }
  });
}

TEST(Symmetry, AnyNumberOfThreadsGivesTheSameBits) {
  for_layouts<float>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    for (const Kernel kernel : kKernels)
      for (const bool periodic : {false, true}) {
        const Lattice<D> lattice = lattice_of<D>(D == 2 ? 45 : 21, periodic);   // no whole number of blocks
        const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
        const auto particles = random_particles<D, float>(lattice, 10000, prefix<D>(kernel).size(), 9);
        const auto with_threads = [&](int threads) { return on_threads(threads, [&] { return outcome<Layout>(lattice, kernel, particles); }); };
        const Outcome<Layout> one = with_threads(1);
        expect_same_bits(one, with_threads(2));
        expect_same_bits(one, with_threads(4));
      }
  });
}

TEST(Symmetry, AnyOrderOfStorageGivesTheSameBits) {
  for_layouts<float>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    const Lattice<D> lattice = lattice_of<D>(9);
    const ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
    const auto particles = random_particles<D, float>(lattice, 3000, prefix<D>(Kernel::quadratic, 4).size(), 10);
    auto shuffled = particles;
    std::vector<std::size_t> order(particles.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), std::mt19937(11));
    for (std::size_t i = 0; i < order.size(); ++i) {
      shuffled.cell[i] = particles.cell[order[i]], shuffled.offset[i] = particles.offset[order[i]], shuffled.id[i] = particles.id[order[i]];
      std::copy_n(&particles.coefficients[order[i] * particles.row()], particles.row(), &shuffled.coefficients[i * particles.row()]);
    }
    ASSERT_NE(shuffled.id, particles.id);
    expect_same_bits(outcome<Layout>(lattice, Kernel::quadratic, particles), outcome<Layout>(lattice, Kernel::quadratic, shuffled));
  });
}

TEST(Symmetry, CanonicalOrderIsBlockThenCellThenId) {
  const Lattice<3> lattice = lattice_of<3>(9);
  auto particles = random_particles<3, float>(lattice, 3000, 4, 7);
  const CellRanges ranges = sorted(particles, lattice);
  for (std::size_t i = 1; i < particles.size(); ++i) {
    const std::size_t before = lattice.key(particles.cell[i - 1]), here = lattice.key(particles.cell[i]);
    ASSERT_TRUE(before < here || (before == here && particles.id[i - 1] < particles.id[i]));
    ASSERT_EQ(lattice.cell_of_key(here), particles.cell[i]);
  }
  EXPECT_EQ(ranges.begin.back(), particles.size());
}

// Blocks of a colour are scattered at the same time: no node may be in reach of two of them, around periodic sides neither.
TEST(Symmetry, BlocksOfOneColourReachNoCommonNode) {
  constexpr int block = Lattice<2>::kBlock;
  for (int edge = 1; edge <= 40; ++edge)
    for (const bool periodic : {false, true}) {
      const Lattice<2> lattice({edge, 1}, {periodic, false});
      const ActiveBlocks<2> blocks = ActiveBlocks<2>::whole(lattice);
      std::map<std::pair<std::size_t, int>, int> reached_by;   // colour, node: the block
      for (int b = 0; b < lattice.blocks[0]; ++b) {
        const std::size_t colour = lattice.colour({b, 0});
        ASSERT_LT(colour, Lattice<2>::kColours);
        for (int node = b * block - 1; node <= std::min((b + 1) * block, edge) + 1; ++node)
          ASSERT_EQ((reached_by.try_emplace({colour, lattice.wrapped({node, 0})[0]}, b).first->second), b) << edge << " cells";
      }
    }
}

TEST(Site, AnOffsetThatRoundsToOneIsTheNextCell) {
  Site<3, float> site{{4, 4, 4}, Vec<3, float>(0, 0, 0)};
  site.move(Vec<3, float>(-1e-12f, 0, 0));
  EXPECT_EQ(site.offset[0], 0);
  EXPECT_EQ(site.cell[0], 4);
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
  EXPECT_EQ(mode_set<2>(Transfer::polypic, Kernel::quadratic, {0, "quadratic"}).size(), 6u);
  EXPECT_EQ(mode_set<3>(Transfer::polypic, Kernel::linear, {}).size(), 8u);
  EXPECT_EQ(mode_set<3>(Transfer::apic, Kernel::linear, {}).size(), 4u);
  EXPECT_EQ(mode_set<2>(Transfer::polypic, Kernel::quadratic, {}).size(), 9u);
  EXPECT_EQ(mode_set<3>(Transfer::polypic, Kernel::quadratic, {13, ""}).size(), 13u);
}

}  // namespace
}  // namespace sim
