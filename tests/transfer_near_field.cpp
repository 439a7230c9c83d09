// The copy of the field around a block, which motion reads, against the interpolation it stands for.
#include "sim/transfer/near_field.h"

#include "tests/transfer_cases.h"

namespace sim {
namespace {

using namespace cases;

/// What a transfer interpolates where particles have got to: they are sorted, then move by up to `reach` cells an axis. Images beyond a periodic side
/// are not wrapped.
template <class Layout>
struct Asked {
  static constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;
  std::vector<Site<D, Real>> sites;
  std::vector<Vec<D, Real>> found;

  Asked(const GridTransfer<Layout>& transfer, const ActiveBlocks<D>& blocks, const typename Layout::Field& field, const CellRanges& ranges,
        const Particles<D, Real>& particles, double reach) : sites(particles.size()), found(particles.size(), Vec<D, Real>::Constant(1e9)) {
    with_near_field(transfer, blocks, field, ranges, particles.size(), [&](std::size_t begin, std::size_t end, auto& near) {
      std::mt19937 random{unsigned(begin)};
      std::uniform_real_distribution<double> step(-reach, reach);
      Sites<D, Real> some;
      AtSites<D, Real> velocities;
      for (; begin < end; begin += some.count) {
        some.load(particles, begin, end);
        for (std::size_t k = 0; k < some.count; ++k) {
          Site<D, Real> site = some[k];
          Vec<D, Real> away;
          for (int a = 0; a < D; ++a) away[a] = Real(step(random));
          site.move(away);
          some.set(k, site);
          sites[begin + k] = site;
        }
        near.velocities(some, velocities);
        for (std::size_t k = 0; k < some.count; ++k) found[begin + k] = velocities[k];
      }
    });
  }
};

template <class Layout>
void expect_interpolation(int edge, bool periodic, double reach, bool sorts) {
  constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;
  SCOPED_TRACE(testing::Message() << D << "-D, " << Layout::kLattices << " lattices, " << edge << (periodic ? " cells around, reach " : " cells, reach ") << reach);
  const Lattice<D> lattice = lattice_of<D>(edge, periodic);
  auto particles = random_particles<D, Real>(lattice, 6000, 1, 17, periodic ? 0 : std::min(edge / 3, 5));
  const CellRanges ranges = sorted(particles, lattice);
  ActiveBlocks<D> blocks(lattice);
  blocks.cover(ranges, 3);
  const auto field = random_field<Layout>(blocks, 5);
  for (const Kernel kernel : kKernels)
    for (const Path path : {Path::fast, Path::plain}) {
      const GridTransfer<Layout> transfer(kernel, prefix<D>(kernel, 1), path);
      const Asked<Layout> asked(transfer, blocks, field, sorts ? ranges : CellRanges{}, particles, reach);
      double largest = 0, worst = 0;
      for (std::size_t p = 0; p < particles.size(); ++p) {
        const Vec<D, Real> wanted = transfer.velocity_at(blocks, field, asked.sites[p]);
        largest = std::max(largest, double(wanted.cwiseAbs().maxCoeff()));
        worst = std::max(worst, double((asked.found[p] - wanted).cwiseAbs().maxCoeff()));
      }
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

TEST(NearField, GivesTheSameBitsWithBothInstructionSets) {
  using Layout = FaceLayout<3, float>;
  const Lattice<3> lattice = lattice_of<3>(13, false);
  auto particles = random_particles<3, float>(lattice, 3000, 1, 17, 3);
  const CellRanges ranges = sorted(particles, lattice);
  ActiveBlocks<3> blocks(lattice);
  blocks.cover(ranges, 3);
  const auto field = random_field<Layout>(blocks, 5);
  std::vector<std::vector<Vec<3, float>>> found;
  for (const bool allowed : {false, true}) {
    lanes::allow_avx512(allowed);
    const MacTransfer<3, float> transfer(Kernel::quadratic, prefix<3>(Kernel::quadratic, 1));
    ASSERT_TRUE(transfer.interpolation());
    found.push_back(Asked<Layout>(transfer, blocks, field, ranges, particles, 0.9).found);
  }
  EXPECT_EQ(found[0], found[1]);
}

// Which sites the copy answers for: a cell around the block's, no more; fewer where the domain ends in the block.
TEST(NearField, CoversACellAroundItsBlock) {
  const Lattice<2> lattice = lattice_of<2>(10, true);
  const auto blocks = ActiveBlocks<2>::whole(lattice);
  const auto field = random_field<FaceLayout<2, float>>(blocks, 5);
  const MacTransfer<2, float> transfer(Kernel::quadratic, prefix<2>(Kernel::quadratic, 1));
  const NearField<FaceLayout<2, float>, QuadraticWeights<float>> whole(transfer, blocks, {1, 0}, field, 1), cut(transfer, blocks, {2, 1}, field, 1);
  EXPECT_TRUE(whole.covers({3, -1}) && whole.covers({8, 4}));
  EXPECT_FALSE(whole.covers({2, 0}) || whole.covers({9, 0}) || whole.covers({4, -2}) || whole.covers({4, 5}));
  EXPECT_TRUE(cut.covers({10, 3}));
  EXPECT_FALSE(cut.covers({11, 4}));
}

}  // namespace
}  // namespace sim
