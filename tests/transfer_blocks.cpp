// Sparse storage: which blocks are active, who neighbours whom, and that neither memory nor results know how large the domain is.
#include <map>
#include <set>

#include "sim/colliders/solids.h"
#include "sim/random.h"
#include "sim/transfer/place_set.h"
#include "tests/transfer_cases.h"

namespace sim {
namespace {

using namespace cases;

template <int D>
Cell<D> moved(Cell<D> at, int axis, int by) {
  at[std::size_t(axis)] += by;
  return at;
}

template <int D>
void expect_neighbours(const ActiveBlocks<D>& blocks) {
  for (const std::size_t i : places_of(blocks)) {
    const Cell<D> at = blocks.cell_at(i);
    ASSERT_EQ(blocks.index(at), std::ptrdiff_t(i));
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1})
        ASSERT_EQ(blocks.neighbour(i, a, side), blocks.index(moved<D>(at, a, side ? 1 : -1))) << at[0] << ' ' << at[1] << " axis " << a;
  }
}

// Any number of cells, cut blocks and rings of a single cell included.
TEST(Blocks, NeighboursAreThePlacesBesideAroundPeriodicSidesToo) {
  for (const bool periodic : {false, true}) {
    for (int edge = 1; edge <= 13; ++edge) expect_neighbours(ActiveBlocks<2>::whole(lattice_of<2>(edge, periodic)));
    for (const int edge : {1, 3, 4, 6}) expect_neighbours(ActiveBlocks<3>::whole(lattice_of<3>(edge, periodic)));
  }
}

template <int D>
void expect_sets(const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(ActiveBlocks<D>::kCells);
  std::vector<std::uint8_t> kind(blocks.size());   // where there is no place, too
  for (std::size_t i = 0; i < kind.size(); ++i) kind[i] = std::uint8_t(3 * uniform(7, i, 0));
  const PlaceSet<D> ones(blocks, kind, std::uint8_t{1});
  PlaceSet<D> same(blocks);
  for (std::size_t i = 0; i < kind.size(); ++i)
    if (kind[i] == 1 && blocks.is_place(i)) same.insert(i);
  for (std::size_t slot = 0; slot < blocks.count(); ++slot) {
    ASSERT_EQ(ones[slot], same[slot]);
    std::array<std::uint8_t, per_block> flags;
    write_flags(ones[slot], per_block, flags.data());
    PlaceBits any = 0;
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1}) any |= ones.beside(blocks, slot, a, side);
    EXPECT_EQ(ones.beside(blocks, slot), any);
    for (std::size_t k = 0; k < per_block; ++k) {
      const std::size_t i = slot * per_block + k;
      const bool is_place = blocks.is_place(i);
      ASSERT_EQ(PlaceSet<D>::places(blocks, slot) >> k & 1, is_place);
      ASSERT_EQ(ones.has(i), is_place && kind[i] == 1);
      ASSERT_EQ(flags[k], ones.has(i));
      for (int a = 0; a < D && is_place; ++a)
        for (const int side : {0, 1}) {
          const std::ptrdiff_t j = blocks.neighbour(i, a, side);
          ASSERT_EQ(ones.beside(blocks, slot, a, side) >> k & 1, j >= 0 && kind[std::size_t(j)] == 1) << "axis " << a << " side " << side;
        }
    }
  }
}

TEST(Blocks, WhatLiesBesideASetIsBesideOneOfItsPlaces) {
  for (const bool periodic : {false, true}) {
    for (int edge = 1; edge <= 13; ++edge) expect_sets(ActiveBlocks<2>::whole(lattice_of<2>(edge, periodic)));
    for (const int edge : {1, 3, 4, 6, 9}) expect_sets(ActiveBlocks<3>::whole(lattice_of<3>(edge, periodic)));
  }
}

template <int D, int n>
void expect_places(const ActiveBlocks<D>& blocks) {
  const Lattice<D>& lattice = blocks.lattice();
  Cell<D> first;
  first.fill(-1);
  while (true) {
    const auto found = blocks.template places<n>(first);
    for (int k = 0; k < int(found.size()); ++k) {
      Cell<D> at = first;
      for (int a = D - 1, rest = k; a >= 0; --a, rest /= n) at[std::size_t(a)] += rest % n;
      ASSERT_EQ(found[std::size_t(k)], blocks.index(at));
    }
    int a = D - 1;
    while (a >= 0 && first[std::size_t(a)] == lattice.cells[std::size_t(a)] - 1) first[std::size_t(a)] = -1, --a;
    if (a < 0) return;
    ++first[std::size_t(a)];
  }
}

TEST(Blocks, AStencilsPlacesAreThoseOfItsNodes) {
  for (const bool periodic : {false, true})
    for (int edge = 1; edge <= 13; ++edge) {
      expect_places<2, 2>(ActiveBlocks<2>::whole(lattice_of<2>(edge, periodic)));
      expect_places<2, 3>(ActiveBlocks<2>::whole(lattice_of<2>(edge, periodic)));
      if (edge < 7) expect_places<3, 3>(ActiveBlocks<3>::whole(lattice_of<3>(edge, periodic)));
    }
}

template <int D>
void expect_places_around(const ActiveBlocks<D>& blocks) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!blocks.is_place(i)) continue;
    const auto found = blocks.places_around(i);
    for (int k = 0; k < int(found.size()); ++k) {
      Cell<D> at = blocks.cell_at(i);
      for (int a = D - 1, rest = k; a >= 0; --a, rest /= 3) at[std::size_t(a)] += rest % 3 - 1;
      ASSERT_EQ(found[std::size_t(k)], blocks.index(at)) << i;
    }
  }
}

template <int D>
void expect_places_around_some() {
  ActiveBlocks<D> some(lattice_of<D>(24));   // with absent ones around
  Cell<D> one, other;
  one.fill(1), other.fill(4), other[0] = 3;
  CellRanges ranges;
  ranges.occupied = {some.lattice().block_key(one), some.lattice().block_key(other)};
  for (std::uint32_t p = 0; p <= 2 * Lattice<D>::kCellsPerBlock; ++p) ranges.begin.push_back(p);
  some.cover(ranges, 3);
  expect_places_around(some);
}

TEST(Blocks, PlacesAroundOneAreThoseBeside) {
  for (const bool periodic : {false, true})
    for (const int edge : {1, 4, 6, 8, 12}) {
      expect_places_around(ActiveBlocks<2>::whole(lattice_of<2>(edge, periodic)));
      expect_places_around(ActiveBlocks<3>::whole(lattice_of<3>(edge, periodic)));
    }
  expect_places_around_some<2>();
  expect_places_around_some<3>();
}

/// Every place that a stencil of a particle in the block may reach is in the tile, at its place.
template <int D, int n>
void expect_tiles(const ActiveBlocks<D>& blocks) {
  constexpr int edge = Lattice<D>::kBlock, tile = edge + n;
  const Lattice<D>& lattice = blocks.lattice();
  for (std::size_t slot = 0; slot < blocks.count(); ++slot) {
    const Cell<D> block = blocks.block(slot);
    bool in_domain = true;
    std::size_t expected = 1;
    for (int a = 0; a < D; ++a) {
      in_domain = in_domain && block[std::size_t(a)] >= 0 && block[std::size_t(a)] < lattice.blocks[std::size_t(a)];
      expected *= std::size_t(std::min(edge, lattice.cells[std::size_t(a)] - edge * block[std::size_t(a)]) + n);
    }
    if (!in_domain) continue;
    std::map<int, std::ptrdiff_t> found;
    blocks.template for_tile<tile>(block, [&](int place, std::size_t index, auto count) {
      for (int k = 0; k < count; ++k) ASSERT_TRUE(found.emplace(place + k, std::ptrdiff_t(index) + k).second);
    });
    ASSERT_EQ(found.size(), expected);
    for (const auto& [place, index] : found) {
      Cell<D> at = block;
      for (int a = D - 1, rest = place; a >= 0; --a, rest /= tile) at[std::size_t(a)] = edge * block[std::size_t(a)] - 1 + rest % tile;
      ASSERT_EQ(index, blocks.index(at));
    }
  }
}

TEST(Blocks, TilesHoldWhatStencilsReach) {
  for (const bool periodic : {false, true})
    for (int edge = 1; edge <= 13; ++edge) {
      expect_tiles<2, 2>(ActiveBlocks<2>::whole(lattice_of<2>(edge, periodic)));
      expect_tiles<2, 3>(ActiveBlocks<2>::whole(lattice_of<2>(edge, periodic)));
      if (edge < 7) expect_tiles<3, 3>(ActiveBlocks<3>::whole(lattice_of<3>(edge, periodic)));
    }
}

/// Exactly the blocks with a place within `depth` of an occupied cell, but perhaps one more around a cut block.
template <int D>
void expect_covered(const Lattice<D>& lattice, int depth) {
  auto particles = random_particles<D, float>(lattice, 1, 1, unsigned(lattice.cells[0] + depth));
  const CellRanges ranges = sorted(particles, lattice);
  ActiveBlocks<D> blocks(lattice);
  blocks.cover(ranges, depth);
  const ActiveBlocks<D> all = ActiveBlocks<D>::whole(lattice);
  std::set<std::int64_t> near;
  for (const std::size_t i : places_of(all))
    for (const Cell<D>& cell : particles.cell) {
      const Cell<D> at = all.cell_at(i);
      bool within = true;
      for (std::size_t a = 0; a < std::size_t(D); ++a) {
        int away = std::abs(at[a] - cell[a]);
        if (lattice.periodic[a]) away = std::min(away, lattice.cells[a] - away);
        within = within && away <= depth;
      }
      if (within) near.insert(all.keys()[i / std::size_t(all.kCells)]);
    }
  std::size_t covered = 0;
  for (const std::int64_t key : near) covered += blocks.slot(key) >= 0;
  EXPECT_EQ(covered, near.size());
  const bool is_cut = lattice.periodic[0] && lattice.cells[0] % Lattice<D>::kBlock;
  if (!is_cut) {
    EXPECT_EQ(blocks.count(), near.size()) << lattice.cells[0] << " cells, depth " << depth;
  }
  EXPECT_TRUE(std::is_sorted(blocks.keys().begin(), blocks.keys().end()));
}

TEST(Blocks, CoverWhatIsNearParticlesAndNoMore) {
  for (const bool periodic : {false, true})
    for (const int edge : {1, 4, 7, 16, 33, 50})
      for (const int depth : {0, 2, 5, 9}) {
        expect_covered<2>(lattice_of<2>(edge, periodic), depth);
        if (edge < 20) expect_covered<3>(lattice_of<3>(edge, periodic), depth);
      }
}

// A thousand million cells along each axis but one: nothing is allocated for those without particles, and what is found is what is found
// in a small domain.
TEST(Blocks, ADomainOfAnySizeCostsWhatItsParticlesCost) {
  for_layouts<float>([](auto layout) {
    using Layout = decltype(layout);
    constexpr int D = Layout::kDimension;
    const auto outcome = [](const Lattice<D>& lattice, int shift, std::size_t& size) {
      auto particles = random_particles<D, float>(lattice_of<D>(16), 2000, prefix<D>(Kernel::quadratic).size(), 3);
      for (auto& cell : particles.cell)
        for (int a = 0; a < 2; ++a) cell[std::size_t(a)] += shift;
      const CellRanges ranges = sorted(particles, lattice);
      ActiveBlocks<D> blocks(lattice);
      blocks.cover(ranges, 2);
      const GridTransfer<Layout> transfer(Kernel::quadratic, prefix<D>(Kernel::quadratic));
      typename GridTransfer<Layout>::Grid grid;
      transfer.scatter(particles, ranges, blocks, grid);
      transfer.gather(blocks, grid.velocity, nullptr, {}, particles);
      size = blocks.size();
      return particles.coefficients;
    };
    Cell<D> far;
    far.fill(48);
    far[0] = far[1] = D == 2 ? 300000000 : 90000000;
    std::size_t small = 0, large = 0;
    const auto near = outcome(lattice_of<D>(48), 16, small), away = outcome(Lattice<D>(far), 80000000, large);
    EXPECT_EQ(near, away);
    EXPECT_EQ(small, large);
    EXPECT_LE(small, std::size_t(int_power(16 + 16, D)));
  });
}

// A block is asked as a whole where no shape comes near; that must not be seen.
TEST(Solids, OfABlockAreThoseOfItsCells) {
  Scene scene;
  scene.options.domain = {base::Vec3(-1, 0, 2), base::Vec3(2, 1.8, 4.6)};
  scene.options.cell = 0.1;
  scene.options.boundary[0] = {Side::periodic, Side::periodic};
  Collider post, ball;
  post.shape.box = base::Box{base::Vec3(-0.4, 0.2, 2), base::Vec3(1.1, 1.5, 3.5)};
  ball.shape.sphere = Shape::Sphere{base::Vec3(1.7, 1, 4), 0.55};
  scene.colliders = {post, ball};
  const Lattice<3> lattice({30, 18, 26}, {true, false, false});
  const Solids<3> solids(scene, lattice);
  const auto blocks = ActiveBlocks<3>::whole(lattice);
  std::size_t inside = 0, full = 0;
  for (std::size_t slot = 0; slot < blocks.count(); ++slot) {
    const auto found = solids.solid_cells(blocks.block(slot));
    full += found.all();
    for (int local = 0; local < Lattice<3>::kCellsPerBlock; ++local) {
      const Cell<3> at = Lattice<3>::cell_in(blocks.block(slot), local);
      if (!blocks.is_place(slot * 64 + std::size_t(local))) continue;
      ASSERT_EQ(found[std::size_t(local)], solids.solid(at)) << at[0] << ' ' << at[1] << ' ' << at[2];
      inside += lattice.inside(at) && found[std::size_t(local)];
    }
  }
  EXPECT_GT(inside, 3000u);
  EXPECT_LT(inside, 6000u);
  EXPECT_GT(full, 10u);
}

TEST(Blocks, KeysAreOrderedAndComeBack) {
  const Lattice<3> lattice({13, 200000000, 7}, {true, false, false});
  std::int64_t last = -1;
  for (const int x : {0, 5, 12})
    for (const int y : {-1, 0, 5, 199999999, 200000001})
      for (const int z : {-1, 3, 4, 8}) {
        const std::int64_t key = lattice.key({x, y, z});
        EXPECT_EQ(lattice.cell_of_key(key), (Cell<3>{x, y, z}));
        EXPECT_GE(key / Lattice<3>::kCellsPerBlock, last);   // row-major over blocks
        last = key / Lattice<3>::kCellsPerBlock;
      }
  KeyTable table;
  table.build({-5, 3, 1000000007, 1LL << 60});
  EXPECT_EQ(table.find(1LL << 60), 3);
  EXPECT_EQ(table.find(-5), 0);
  EXPECT_EQ(table.find(4), -1);
}

}  // namespace
}  // namespace sim
