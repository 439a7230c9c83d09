// The copy of the field around a block, which motion reads, against the interpolation it stands for.
#include "sim/transfer/near_field.h"

#include <atomic>

#include "tests/transfer_cases.h"

namespace sim {
namespace {

using namespace cases;

/// Particles are sorted, then move by up to `reach` cells an axis; each asks where it has got to. Images beyond a periodic side are not wrapped.
template <class Layout>
void expect_interpolation(int edge, bool periodic, double reach, bool sorts) {
  constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;
  SCOPED_TRACE(testing::Message() << D << "-D, " << Layout::kLattices << " lattices, " << edge << (periodic ? " cells around, reach " : " cells, reach ") << reach);
  const Lattice<D> lattice = lattice_of<D>(edge, periodic);
  auto particles = random_particles<D, Real>(lattice, 3000, 1, 17, periodic ? 0 : std::min(edge / 3, 5));
  const CellRanges ranges = sorts ? sorted(particles, lattice) : CellRanges{};
  ActiveBlocks<D> blocks = ActiveBlocks<D>::whole(lattice);
  if (sorts) blocks = ActiveBlocks<D>(lattice), blocks.cover(ranges, 3);
  const auto field = random_field<Layout>(blocks, 5);
  for (const Kernel kernel : kKernels) {
    const GridTransfer<Layout> transfer(kernel, prefix<D>(kernel, 1));
    std::atomic<std::size_t> asked = 0;
    std::atomic<double> largest = 0, worst = 0;
    const auto raise = [](std::atomic<double>& most, double value) {
      for (double old = most; old < value && !most.compare_exchange_weak(old, value);) {
      }
    };
    with_near_field(transfer, blocks, field, ranges, particles.size(), [&](std::size_t begin, std::size_t end, const auto& velocity_at) {
      std::mt19937 random{unsigned(begin)};
      std::uniform_real_distribution<double> step(-reach, reach);
      for (std::size_t p = begin; p < end; ++p) {
        Site<D, Real> site{particles.cell[p], particles.offset[p]};
        Vec<D, Real> away;
        for (int a = 0; a < D; ++a) away[a] = Real(step(random));
        site.move(away);
        const Vec<D, Real> wanted = transfer.velocity_at(blocks, field, site);
        raise(worst, double((velocity_at(site) - wanted).cwiseAbs().maxCoeff()));
        raise(largest, double(wanted.cwiseAbs().maxCoeff()));
      }
      asked += end - begin;
    });
    EXPECT_EQ(asked, particles.size());
    EXPECT_GT(largest, 0.1);
    EXPECT_LE(worst, 8 * double(std::numeric_limits<Real>::epsilon())) << name_of(kernel);
  }
}

template <class Layout>
void expect_interpolation_everywhere() {
  for (const double reach : {0.0, 0.9, 3.0})   // in place, within the copy, and beyond it
    for (const bool sorts : {true, false}) {
      expect_interpolation<Layout>(20, false, reach, sorts);
      for (const int edge : {4, 10, 13, 16}) expect_interpolation<Layout>(edge, true, reach, sorts);   // whole and cut blocks
    }
  expect_interpolation<Layout>(3, true, 0.9, true);
  expect_interpolation<Layout>(1, true, 0.9, true);
}

TEST(NearField, InterpolatesFacesAsTheTransferDoes) {
  expect_interpolation_everywhere<FaceLayout<3, float>>();
  expect_interpolation_everywhere<FaceLayout<2, float>>();
  expect_interpolation_everywhere<FaceLayout<3, double>>();
  expect_interpolation_everywhere<FaceLayout<2, double>>();
}

TEST(NearField, InterpolatesNodesAsTheTransferDoes) {
  expect_interpolation_everywhere<NodeLayout<3, float>>();
  expect_interpolation_everywhere<NodeLayout<2, double>>();
}

// Which sites the copy answers for: a cell around the block's, no more; fewer where the domain ends in the block.
TEST(NearField, CoversACellAroundItsBlock) {
  const Lattice<2> lattice = lattice_of<2>(10, true);
  const auto blocks = ActiveBlocks<2>::whole(lattice);
  const auto field = random_field<FaceLayout<2, float>>(blocks, 5);
  const NearField<FaceLayout<2, float>, QuadraticWeights<float>> whole(blocks, {1, 0}, field), cut(blocks, {2, 1}, field);
  EXPECT_TRUE(whole.covers({3, -1}) && whole.covers({8, 4}));
  EXPECT_FALSE(whole.covers({2, 0}) || whole.covers({9, 0}) || whole.covers({4, -2}) || whole.covers({4, 5}));
  EXPECT_TRUE(cut.covers({10, 3}));
  EXPECT_FALSE(cut.covers({11, 4}));
}

}  // namespace
}  // namespace sim
