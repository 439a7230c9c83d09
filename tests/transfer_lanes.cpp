// The fast transfers against the plain ones: the same to round-off, and the same bits on every processor, for any number of threads and
// whatever the particles have been through.
#include "sim/transfer/lanes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include <tbb/global_control.h>

#include "base/past_caches.h"
#include "sim/instructions.h"
#include "sim/transfer/tiles.h"
#include "tests/transfer_cases.h"

namespace sim {
namespace {

using namespace cases;

/// How the particles lie: how many cells an edge, how many particles, and in how much of the domain.
struct Crowd {
  const char* name;
  int edge;
  std::size_t count;
  int corner;   // cells an edge of the part that they fill
  bool periodic;
};
constexpr Crowd kCrowds[] = {{"one particle", 9, 1, 9, false},     {"mostly single", 9, 200, 9, false},
                             {"partial batches", 9, 5000, 9, true}, {"overfull cells", 9, 2000, 3, false},
                             {"cut blocks", 6, 1500, 6, true},      {"whole blocks around", 8, 4000, 8, true},
                             {"a ring of one cell", 1, 30, 1, true}};

template <class Layout>
Particles<3, float> crowd_of(const Crowd& crowd, const Lattice<3>& lattice, std::size_t modes) {
  auto particles = random_particles<3, float>(lattice, crowd.count, modes, 17);
  const float edges[] = {0, 0.5f, std::nextafter(0.5f, 0.0f), std::nextafter(1.0f, 0.0f), 1e-7f};
  for (std::size_t p = 0; p < crowd.count; ++p)
    for (std::size_t a = 0; a < 3; ++a) {
      particles.cell[p][a] %= crowd.corner;
      if (p % 7 == a) particles.offset[p][Eigen::Index(a)] = edges[p % 5];
    }
  return particles;
}

template <class Layout>
struct Outcome {
  typename GridTransfer<Layout>::Grid grid;
  Particles<3, float> particles;
  std::vector<float> velocity, gradient;   // of a solid's gather, three numbers a particle, nine columns; else empty
};

/// What a solid's gather hands out.
template <class Layout>
void gather_as_solids_do(const CellRanges& ranges, const ActiveBlocks<3>& blocks, const typename Layout::Field& field, Outcome<Layout>& o) {
  constexpr int tile = Lattice<3>::kBlock + 3;
  constexpr std::size_t per_block = Lattice<3>::kCellsPerBlock;
  Particles<3, float> particles = o.particles;
  particles.settle();
  const std::size_t room = particles.size() + lanes::kMotionSlack;
  o.velocity.resize(3 * room), o.gradient.resize(9 * room);
  const lanes::MovingKernels kernels = lanes::nodes_quadratic_of_solids(particles.modes);
  for (std::size_t b = 0; b < ranges.occupied.size(); ++b) {
    std::array<float, 3 * tile * tile * tile> nodes{};
    load_tile<Layout, tile>(blocks, blocks.lattice().block_at(ranges.occupied[b]), field, nodes.data());
    kernels.gather({.begin = &ranges.begin[b * per_block], .offset = particles.offset.front().data(), .coefficients = particles.coefficients.data()},
                   nodes.data(), {.velocity = o.velocity.data(), .gradient = o.gradient.data(), .stride = room});
  }
  o.velocity.resize(3 * particles.size());
  EXPECT_EQ(particles.coefficients, o.particles.coefficients);
}

template <class Layout>
Outcome<Layout> outcome(const GridTransfer<Layout>& transfer, const ActiveBlocks<3>& blocks, const typename Layout::Field& field, bool flip,
                        Particles<3, float> particles) {
  Outcome<Layout> o;
  CanonicalOrder<3, float> order;
  const CellRanges ranges = order.sort(particles, blocks.lattice(), transfer.home());
  transfer.scatter(particles, ranges, blocks, o.grid);
  transfer.gather(ranges, blocks, field, &o.grid.velocity, {flip, 0.9}, particles);
  o.particles = std::move(particles);
  if constexpr (std::is_same_v<Layout, NodeLayout<3, float>>)
    if (transfer.kernel() == Kernel::quadratic && transfer.is_fast() && !flip) gather_as_solids_do(ranges, blocks, field, o);
  return o;
}

/// Of those that have a fast path, the set of as many modes.
std::vector<ModeIndex<3>> set_of(Kernel kernel, std::size_t count) {
  return count == 10 ? mode_set<3>(Transfer::polypic, kernel, {0, "quadratic"}) : prefix<3>(kernel, count);
}

/// Runs body(transfer by the fast path, by the plain one, flip) for all kernels and sets that have a fast path.
template <class Layout, class Body>
void for_fast_sets(const Body& body) {
  for (const Kernel kernel : kKernels)
    for (const std::size_t count : {1, 4, 8, 10, 27}) {
      if (kernel == Kernel::linear && count > 8) continue;
      SCOPED_TRACE(testing::Message() << name_of(kernel) << ", " << count << " modes");
      const GridTransfer<Layout> fast(kernel, set_of(kernel, count)), plain(kernel, set_of(kernel, count), Path::plain);
      ASSERT_TRUE(fast.is_fast() && !plain.is_fast());
      for (const bool flip : {false, true})
        if (!flip || count == 1) body(fast, plain, flip);
    }
}

template <class Layout>
void expect_equal_to_round_off(const Outcome<Layout>& fast, const Outcome<Layout>& plain, std::size_t modes) {
  constexpr float kEpsilon = 1.2e-7f;
  float heaviest = 0;
  for (int c = 0; c < 3; ++c) {
    const auto& mass = Layout::mass(fast.grid.mass, lattice_of_component<Layout>(c));
    const auto& expected = Layout::mass(plain.grid.mass, lattice_of_component<Layout>(c));
    for (std::size_t i = 0; i < mass.size(); ++i) {
      heaviest = std::max(heaviest, expected[i]);
      // Sums of positive numbers: relative to the sum itself, however light the place.
      ASSERT_NEAR(mass[i], expected[i], 40 * kEpsilon * expected[i] + 1e-37f);
      const float found = mass[i] * Layout::at(fast.grid.velocity, c, i), wanted = expected[i] * Layout::at(plain.grid.velocity, c, i);
      ASSERT_NEAR(found, wanted, 40 * kEpsilon * float(modes) * expected[i] + 1e-37f) << "mass " << expected[i];
    }
  }
  EXPECT_GT(heaviest, 0.01f);
  ASSERT_EQ(fast.particles.id, plain.particles.id);
  float largest = 0;
  for (std::size_t p = 0; p < plain.particles.size(); ++p)
    for (int a = 0; a < 3; ++a)
      for (std::size_t r = 0; r < modes; ++r) {
        const float wanted = plain.particles.component(p, a)[r];
        largest = std::max(largest, std::abs(wanted));
        ASSERT_NEAR(fast.particles.component(p, a)[r], wanted, 60 * kEpsilon * float(modes)) << p << ' ' << a << " mode " << r;
      }
  EXPECT_GT(largest, 0.01f);
}

template <class Layout>
void expect_fast_is_plain() {
  for (const Crowd& crowd : kCrowds) {
    SCOPED_TRACE(crowd.name);
    const Lattice<3> lattice = lattice_of<3>(crowd.edge, crowd.periodic);
    const auto blocks = ActiveBlocks<3>::whole(lattice);
    const auto field = random_field<Layout>(blocks, 5);
    for_fast_sets<Layout>([&](const auto& fast, const auto& plain, bool flip) {
      const auto particles = crowd_of<Layout>(crowd, lattice, fast.modes().size());
      const auto found = outcome(fast, blocks, field, flip, particles), wanted = outcome(plain, blocks, field, flip, particles);
      expect_equal_to_round_off<Layout>(found, wanted, fast.modes().size());
    });
  }
}

TEST(Lanes, FastEqualsPlainOnFaces) { expect_fast_is_plain<FaceLayout<3, float>>(); }

TEST(Lanes, FastEqualsPlainOnNodes) { expect_fast_is_plain<NodeLayout<3, float>>(); }

// Blocks without particles between others, and beyond walls where no block is active.
TEST(Lanes, FastEqualsPlainOnBlocksAroundParticlesOnly) {
  const Lattice<3> lattice = lattice_of<3>(40);
  auto particles = random_particles<3, float>(lattice, 300, 27, 23);
  CanonicalOrder<3, float> order;
  const auto modes = prefix<3>(Kernel::quadratic);
  const NodeTransfer<3, float> fast(Kernel::quadratic, modes), plain(Kernel::quadratic, modes, Path::plain);
  ActiveBlocks<3> blocks(lattice);
  blocks.cover(order.sort(particles, lattice, fast.home()), 2);
  ASSERT_LT(blocks.count(), ActiveBlocks<3>::whole(lattice).count());
  const auto field = random_field<NodeLayout<3, float>>(blocks, 6);
  expect_equal_to_round_off(outcome(fast, blocks, field, false, particles), outcome(plain, blocks, field, false, particles), 27);
}

// Rows of more particles than caches hold leave past these, in whole lines: none of a neighbour's may be touched, whichever block comes first.
template <class Layout, int n = 3>
void expect_rows_past_caches(int modes, const std::function<void(const lanes::Block&, const float* nodes)>& gather, Home home) {
  constexpr int tile = Lattice<3>::kBlock + n;
  const Lattice<3> lattice = lattice_of<3>(9);
  const auto blocks = ActiveBlocks<3>::whole(lattice);
  const auto field = random_field<Layout>(blocks, 5);
  auto particles = random_particles<3, float>(lattice, 3000, modes, 17);
  const CellRanges ranges = CanonicalOrder<3, float>().sort(particles, lattice, home);
  const auto gathered = [&](bool streams, bool backwards) {
    std::vector<float> rows(particles.coefficients.size() + 5, 7);   // not at the beginning of a line
    for (std::size_t k = 0; k < ranges.occupied.size(); ++k) {
      const std::size_t b = backwards ? ranges.occupied.size() - 1 - k : k;
      std::array<float, 3 * tile * tile * tile> nodes{};
      load_tile<Layout, tile>(blocks, lattice.block_at(ranges.occupied[b]), field, nodes.data());
      gather({.begin = &ranges.begin[b * Lattice<3>::kCellsPerBlock], .offset = particles.offset.front().data(), .coefficients = rows.data() + 5,
              .streams = streams}, nodes.data());
    }
    return rows;
  };
  const std::vector<float> expected = gathered(false, false);
  EXPECT_EQ(std::count(expected.begin(), expected.end(), 7.0f), 5);
  EXPECT_EQ(gathered(true, false), expected);
  EXPECT_EQ(gathered(true, true), expected);
}

TEST(Lanes, RowsPastTheCachesAreTheSame) {
  const auto plain = [](const lanes::Kernels& kernels) {
    return [kernels](const lanes::Block& block, const float* nodes) { kernels.gather(block, {.tile = nodes}); };
  };
  for (const int modes : {4, 8, 10, 27}) {
    expect_rows_past_caches<FaceLayout<3, float>>(modes, plain(modes > 8 ? lanes::faces_bent(modes) : lanes::faces_quadratic(modes)), Home::cell);
    expect_rows_past_caches<NodeLayout<3, float>>(modes, plain(modes > 8 ? lanes::nodes_bent(modes) : lanes::nodes_quadratic(modes)), Home::nearest_node);
    expect_rows_past_caches<NodeLayout<3, float>>(modes, [modes](const lanes::Block& block, const float* nodes) {
      std::vector<float> velocity(3 * 3100), gradient(9 * 3100);
      lanes::nodes_quadratic_of_solids(modes).gather(block, nodes, {.velocity = velocity.data(), .gradient = gradient.data(), .stride = 3100});
    }, Home::nearest_node);
    if (modes > 8) continue;
    expect_rows_past_caches<FaceLayout<3, float>, 2>(modes, plain(lanes::faces_linear(modes)), Home::cell);
    expect_rows_past_caches<NodeLayout<3, float>, 2>(modes, plain(lanes::nodes_linear(modes)), Home::cell);
  }
}

// What is called after each block finds the block's particles gathered, and all calls together every particle once.
TEST(Lanes, CallBackForEveryParticleOnceItIsGathered) {
  const Lattice<3> lattice = lattice_of<3>(17, true);
  const auto blocks = ActiveBlocks<3>::whole(lattice);
  const auto field = random_field<NodeLayout<3, float>>(blocks, 8);
  for (const Path path : {Path::fast, Path::plain}) {
    const NodeTransfer<3, float> transfer(Kernel::quadratic, prefix<3>(Kernel::quadratic, 4), path);
    auto particles = random_particles<3, float>(lattice, 5000, 4, 9);
    CanonicalOrder<3, float> order;
    const CellRanges ranges = order.sort(particles, lattice, transfer.home());
    std::vector<int> calls(particles.size(), 0);
    std::vector<float> seen(particles.size());
    transfer.gather(ranges, blocks, field, nullptr, {}, particles, [&](std::size_t b) {
      for (std::size_t p = ranges.begin[64 * b]; p < ranges.begin[64 * (b + 1)]; ++p) ++calls[p], seen[p] = particles.component(p, 2)[3];
    });
    for (std::size_t p = 0; p < particles.size(); ++p) {
      ASSERT_EQ(calls[p], 1);
      ASSERT_EQ(seen[p], particles.component(p, 2)[3]);
    }
  }
}

/// dv/dx by differences of the interpolated velocity.
TEST(Lanes, GradientsAreThoseOfTheInterpolatedVelocity) {
  using Layout = NodeLayout<3, float>;
  const Lattice<3> lattice = lattice_of<3>(7);
  const auto blocks = ActiveBlocks<3>::whole(lattice);
  const auto field = random_field<Layout>(blocks, 8);
  for (const std::size_t count : {1, 4, 8, 10, 27}) {
    const GridTransfer<Layout> transfer(Kernel::quadratic, set_of(Kernel::quadratic, count));
    const auto o = outcome(transfer, blocks, field, false, random_particles<3, float>(lattice, 400, count, 9, 1));
    const GridTransfer<NodeLayout<3, double>> exact(Kernel::quadratic, prefix<3>(Kernel::quadratic, 1));
    NodeField<3, double> exact_field(field.size());
    for (std::size_t i = 0; i < field.size(); ++i) exact_field[i] = field[i].cast<double>();
    double largest = 0;
    for (std::size_t p = 0; p < o.particles.size(); ++p)
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double kStep = 1e-5;
        Vec<3, double> side[2];
        for (const int s : {0, 1}) {
          Site<3, double> site{o.particles.cell[p], o.particles.offset[p].cast<double>()};
          site.move(Vec<3, double>::Unit(axis) * (s ? kStep : -kStep));
          side[s] = exact.velocity_at(blocks, exact_field, site);
        }
        const Vec<3, double> slope = (side[1] - side[0]) / (2 * kStep);
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(o.gradient[std::size_t(3 * c + axis) * (o.gradient.size() / 9) + p], slope[c], 2e-5);   // of a random field: of order 1
          ASSERT_EQ(o.velocity[3 * p + std::size_t(c)], o.particles.component(p, c)[0]);
        }
        largest = std::max(largest, slope.norm());
      }
    EXPECT_GT(largest, 1);
  }
}

template <class Layout>
void expect_same_bits(const Outcome<Layout>& a, const Outcome<Layout>& b) {
  EXPECT_EQ(a.grid.velocity, b.grid.velocity);
  EXPECT_EQ(a.grid.mass, b.grid.mass);
  EXPECT_EQ(a.particles.id, b.particles.id);
  EXPECT_EQ(a.particles.coefficients, b.particles.coefficients);
  EXPECT_EQ(a.velocity, b.velocity);
  EXPECT_EQ(a.gradient, b.gradient);
}

/// Calls make() with AVX2 only, then with all the processor has.
template <class Layout, class Make>
void expect_same_bits_on_all_processors(const Make& make) {
  lanes::allow_avx512(false);
  ASSERT_STREQ(instructions(), "avx2");
  const Outcome<Layout> narrow = make();
  lanes::allow_avx512(true);
  const Outcome<Layout> wide = make();
  expect_same_bits(narrow, wide);
}

template <class Layout>
void expect_bits() {
  const Lattice<3> lattice = lattice_of<3>(13, true);
  const auto blocks = ActiveBlocks<3>::whole(lattice);
  const auto field = random_field<Layout>(blocks, 5);
  for_fast_sets<Layout>([&](const auto& fast, const auto&, bool flip) {
    const auto particles = random_particles<3, float>(lattice, 12000, fast.modes().size(), 31);
    const auto make = [&] {   // a new transfer looks for its kernels again
      return outcome(GridTransfer<Layout>(fast.kernel(), fast.modes()), blocks, field, flip, particles);
    };
    expect_same_bits_on_all_processors<Layout>(make);
    const Outcome<Layout> all = make();
    for (const std::size_t threads : {1, 2, 4}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      expect_same_bits(all, make());
    }
  });
}

// A processor with AVX-512 runs other code than one without; both, on any number of threads, give the same.
TEST(Lanes, GiveTheSameBitsOnFacesWithAvx2AndAvx512OnAnyNumberOfThreads) { expect_bits<FaceLayout<3, float>>(); }

TEST(Lanes, GiveTheSameBitsOnNodesWithAvx2AndAvx512OnAnyNumberOfThreads) { expect_bits<NodeLayout<3, float>>(); }

/// Particles that have moved and been sorted again and again, against the same particles stored by id.
template <class Layout>
void expect_no_memory() {
  const Lattice<3> lattice = lattice_of<3>(11, true);
  const auto blocks = ActiveBlocks<3>::whole(lattice);
  const auto field = random_field<Layout>(blocks, 5);
  const GridTransfer<Layout> transfer(Kernel::quadratic, prefix<3>(Kernel::quadratic));
  auto particles = random_particles<3, float>(lattice, 6000, 27, 41);
  CanonicalOrder<3, float> order;
  std::mt19937 random(42);
  std::uniform_real_distribution<float> step(-0.7f, 0.7f);
  for (int sorts = 0; sorts < 5; ++sorts) {
    order.sort(particles, lattice, sorts % 2 ? Home::cell : transfer.home());   // rows stay behind, and stay behind again
    for (std::size_t p = 0; p < particles.size(); ++p) {
      Site<3, float> site{particles.cell[p], particles.offset[p]};
      site.move(Vec<3, float>(step(random), step(random), step(random)));
      particles.cell[p] = lattice.wrapped(site.cell), particles.offset[p] = site.offset;
    }
  }
  ASSERT_FALSE(particles.rows.empty());
  Particles<3, float> fresh;
  fresh.modes = particles.modes, fresh.mass = particles.mass;
  fresh.resize(particles.size());
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const auto to = std::size_t(particles.id[p]);
    fresh.id[to] = particles.id[p], fresh.cell[to] = particles.cell[p], fresh.offset[to] = particles.offset[p];
    std::copy_n(&particles.coefficients[particles.row_of(p) * particles.row()], particles.row(), &fresh.coefficients[to * fresh.row()]);
  }
  expect_same_bits(outcome(transfer, blocks, field, false, particles), outcome(transfer, blocks, field, false, fresh));
}

TEST(Lanes, DoNotRememberHowParticlesCameToBeStored) {
  expect_no_memory<FaceLayout<3, float>>();
  expect_no_memory<NodeLayout<3, float>>();
}

TEST(Rows, FollowTheirParticlesThroughSortsAndSettle) {
  const Lattice<3> lattice = lattice_of<3>(9);
  auto particles = random_particles<3, float>(lattice, 500, 8, 3);
  const auto row_of = [&](std::size_t p) {
    std::array<float, 24> row;
    std::copy_n(&particles.coefficients[particles.row_of(p) * row.size()], row.size(), row.begin());
    return row;
  };
  std::vector<std::array<float, 24>> of_id(500);
  for (std::size_t p = 0; p < 500; ++p) of_id[std::size_t(particles.id[p])] = row_of(p);
  CanonicalOrder<3, float> order;
  const auto expect_own = [&] {
    for (std::size_t p = 0; p < 500; ++p) ASSERT_EQ(row_of(p), of_id[std::size_t(particles.id[p])]);
  };
  order.sort(particles, lattice);
  ASSERT_FALSE(particles.rows.empty());
  expect_own();
  order.sort(particles, lattice, Home::nearest_node);
  expect_own();
  particles.settle();
  ASSERT_TRUE(particles.rows.empty());
  expect_own();
}

TEST(Rows, OfOtherColumnsMoveAlong) {
  const Lattice<2> lattice = lattice_of<2>(20);
  auto particles = random_particles<2, double>(lattice, 1000, 1, 3);
  std::vector<std::int64_t> twice, buffer;
  for (const std::int64_t id : particles.id) twice.push_back(id), twice.push_back(-id);
  CanonicalOrder<2, double> order;
  order.sort(particles, lattice);
  order.move_along(twice, buffer, 2);
  for (std::size_t p = 0; p < particles.size(); ++p) ASSERT_TRUE(twice[2 * p] == particles.id[p] && twice[2 * p + 1] == -particles.id[p]);
}

// Crowded and nearly empty cells, blocks far apart, ids that 32 bits do not hold.
TEST(Order, IsOfBlocksCellsAndIds) {
  const Lattice<3> lattice({300000, 300000, 300000}, {false, true, false});
  for (const std::int64_t far : {std::int64_t(1), std::int64_t(1) << 40}) {
    const Home home = far == 1 ? Home::nearest_node : Home::cell;
    auto particles = random_particles<3, float>(lattice_of<3>(12), 4000, 1, 3);
    std::mt19937 rng(7);
    for (std::size_t p = 0; p < particles.size(); ++p) {
      particles.id[p] = std::int64_t(p * 7919 % 4001) * far;
      for (int& cell : particles.cell[p]) cell = p % 4 == 0 ? cell % 2 : p % 4 == 3 ? int(rng() % 300000) : cell;
      if (p % 4 == 2) particles.cell[p][1 + p / 4 % 2] += p / 4 % 2 ? 8192 * 4 : 8 * 4;   // far enough to be taken for each other, cut to ten bits
    }
    const auto all = particles;
    CanonicalOrder<3, float> order;
    for (int round = 0; round < 3; ++round) {   // the second finds the blocks of the first
      const CellRanges ranges = order.sort(particles, lattice, home);
      ASSERT_EQ(ranges.begin.back(), all.size());
      const auto place_of = [&](std::size_t p) {
        Cell<3> place = particles.cell[p];
        for (int a = 0; a < 3; ++a) place[std::size_t(a)] += home == Home::nearest_node && particles.offset[p][a] >= 0.5f;
        return lattice.key(lattice.wrapped(place));
      };
      for (std::size_t b = 0; b < ranges.occupied.size(); ++b)
        for (std::size_t c = 0; c < 64; ++c)
          for (std::size_t p = ranges.begin[64 * b + c]; p < ranges.begin[64 * b + c + 1]; ++p) {
            ASSERT_EQ(place_of(p), ranges.occupied[b] * 64 + std::int64_t(c));
            ASSERT_TRUE(p == ranges.begin[64 * b + c] || particles.id[p - 1] < particles.id[p]);
          }
      std::map<std::int64_t, Cell<3>> cell_of;
      for (std::size_t p = 0; p < all.size(); ++p) cell_of[all.id[p]] = all.cell[p];
      for (std::size_t p = 0; p < all.size(); ++p) ASSERT_EQ(particles.cell[p], cell_of.at(particles.id[p]));
    }
  }
}

// The order is by nearest node, then id, when that is asked; nodes on a periodic side are one.
TEST(Order, GoesByTheNearestNodeIfAsked) {
  for (const bool periodic : {false, true}) {
    const Lattice<3> lattice = lattice_of<3>(9, periodic);
    auto particles = random_particles<3, float>(lattice, 3000, 1, 7);
    const CellRanges ranges = CanonicalOrder<3, float>().sort(particles, lattice, Home::nearest_node);
    const auto node_of = [&](std::size_t p) {
      Cell<3> node = particles.cell[p];
      for (int a = 0; a < 3; ++a) node[std::size_t(a)] += particles.offset[p][a] >= 0.5f;
      return lattice.key(lattice.wrapped(node));
    };
    for (std::size_t p = 1; p < particles.size(); ++p) {
      const auto before = node_of(p - 1), here = node_of(p);
      ASSERT_TRUE(before < here || (before == here && particles.id[p - 1] < particles.id[p]));
    }
    for (std::size_t k = 0; k + 1 < ranges.begin.size(); ++k)
      for (std::size_t p = ranges.begin[k]; p < ranges.begin[k + 1]; ++p)
        ASSERT_EQ(node_of(p), ranges.occupied[k / 64] * 64 + std::int64_t(k % 64));
  }
}

// Then what has been sorted is written past the caches.
TEST(Order, IsTheSameOfMoreThanCachesHold) {
  const Lattice<3> lattice = lattice_of<3>(50);
  const std::size_t count = base::kHeldByCaches / 32 + 1234;
  auto particles = random_particles<3, float>(lattice, count, 1, 3);
  for (std::size_t p = 0; p < count; ++p) particles.id[p] = std::int64_t(p * 7919 % count);
  for (const Home home : {Home::cell, Home::nearest_node}) {
    std::vector<Site<3, float>> site_of(count);
    for (std::size_t p = 0; p < count; ++p) site_of[std::size_t(particles.id[p])] = {particles.cell[p], particles.offset[p]};
    const CellRanges ranges = CanonicalOrder<3, float>().sort(particles, lattice, home);
    const auto place_of = [&](std::size_t p) {
      Cell<3> place = particles.cell[p];
      for (int a = 0; a < 3; ++a) place[std::size_t(a)] += home == Home::nearest_node && particles.offset[p][a] >= 0.5f;
      return lattice.key(place);
    };
    std::size_t wrong = 0;
    for (std::size_t k = 0; k + 1 < ranges.begin.size(); ++k)
      for (std::size_t p = ranges.begin[k]; p < ranges.begin[k + 1]; ++p) {
        const Site<3, float>& own = site_of[std::size_t(particles.id[p])];
        wrong += place_of(p) != ranges.occupied[k / 64] * 64 + std::int64_t(k % 64);
        wrong += p > ranges.begin[k] && particles.id[p - 1] >= particles.id[p];
        wrong += own.cell != particles.cell[p] || own.offset != particles.offset[p];
      }
    EXPECT_EQ(wrong, 0u);
  }
}

}  // namespace
}  // namespace sim
