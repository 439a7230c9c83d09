// Which cells the surface makes liquid, the field that it leaves beside them, and what a shift of particles leaves of their velocities.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/fluid/advect.h"
#include "sim/fluid/pressure.h"
#include "sim/transfer/order.h"
#include "tests/transfer_cases.h"

namespace sim {
namespace {

/// A square tank of 24 cells an edge with water up to the middle, four particles a cell in rows; `particles_in` says how many of them a cell has.
class Pool {
 public:
  static constexpr int kCells = 24, kLevel = 12, kFull = 4;
  template <class ParticlesIn>
  explicit Pool(const ParticlesIn& particles_in) : lattice_({kCells, kCells}), solids_(Scene{}, lattice_), blocks(ActiveBlocks<2>::whole(lattice_)) {
    Particles<2, double> particles;
    for (int i = 0; i < kCells; ++i)
      for (int j = 0; j < kCells; ++j)
        for (int n = 0; n < particles_in(i, j); ++n) {
          particles.cell.push_back({i, j});
          particles.offset.push_back({n % 2 ? 0.75 : 0.25, n / 2 ? 0.75 : 0.25});
          particles.id.push_back(std::int64_t(particles.id.size()));
        }
    particles.mass = 1;
    particles.coefficients.assign(2 * particles.size(), 0.0);
    const CellRanges ranges = CanonicalOrder<2, double>().sort(particles, lattice_, Home::cell);
    const MacTransfer<2, double> transfer(Kernel::linear, mode_set<2>(Transfer::pic, Kernel::linear, {}));
    transfer.scatter(particles, ranges, blocks, grid_);
    cells.open.update(solids_, blocks);
    cells.kind = classified = classify_cells(ranges, blocks, solids_, cells.open, true);
    find_surface(grid_.mass, cell_filling(ranges, blocks, kFull), kFull, cells, blocks);
  }
  static int level(int, int j) { return j < kLevel ? kFull : 0; }
  std::size_t at(int i, int j) const { return std::size_t(blocks.index({i, j})); }
  bool is_liquid(int i, int j) const { return cells.kind[at(i, j)] == CellKind::liquid; }
  bool is_film(int i, int j) const { return cells.film_at(at(i, j)) > 0; }
  bool is_thin(int i, int j) const { return std::count(cells.thin.begin(), cells.thin.end(), at(i, j)) == 1; }

 private:
  Lattice<2> lattice_;
  Solids<2> solids_;
  MacVelocity<2, double> grid_;

 public:
  ActiveBlocks<2> blocks;
  LiquidCells<2> cells;
  std::vector<CellKind> classified;   // before the surface had a say
};

TEST(FluidSurface, AGapBetweenParticlesIsLiquidAndABubbleIsNot) {
  const auto is_gap = [](int i, int j) { return j == 5 && (i == 8 || i == 9); };
  const auto is_bubble = [](int i, int j) { return (i >= 14 && i < 19 && j >= 3 && j < 8) || (i >= 3 && i < 5 && j >= 4 && j < 6); };
  const Pool pool([&](int i, int j) { return is_gap(i, j) || is_bubble(i, j) ? 0 : Pool::level(i, j); });
  ASSERT_EQ(pool.classified[pool.at(8, 5)], CellKind::air);
  EXPECT_TRUE(pool.is_liquid(8, 5) && pool.is_liquid(9, 5));
  EXPECT_EQ(pool.cells.distance[pool.at(9, 5)], -1);
  EXPECT_FALSE(pool.is_liquid(16, 5) || pool.is_liquid(15, 4) || pool.is_liquid(3, Pool::kLevel));
  EXPECT_FALSE(pool.is_liquid(3, 4) || pool.is_liquid(4, 5));
}

TEST(FluidSurface, FewParticlesAreThinLiquidAndAFullDropIsNot) {
  const auto is_foam = [](int i, int j) { return i >= 8 && i < 15 && j >= 5 && j < Pool::kLevel; };
  const Pool pool([&](int i, int j) { return is_foam(i, j) || (i == 4 && j == 20) ? 1 : i == 18 && j == 20 ? Pool::kFull : Pool::level(i, j); });
  ASSERT_EQ(pool.classified[pool.at(11, 9)], CellKind::liquid);
  EXPECT_TRUE(pool.is_thin(11, 9) && pool.is_thin(10, 10) && pool.is_thin(4, 20));
  EXPECT_FALSE(pool.is_liquid(11, 9) || pool.is_liquid(4, 20));
  EXPECT_TRUE(pool.is_liquid(18, 20) && pool.is_liquid(11, 1) && pool.is_liquid(2, 9) && pool.is_liquid(7, 9));
  EXPECT_EQ(pool.cells.distance[pool.at(11, 10)], 1);
}

TEST(FluidSurface, ThinLiquidIsTheSameWhereverTheGridsBlocksBegin) {
  const auto thin_cells = [](int up) {
    const Pool pool([&](int i, int j) {
      const bool is_foam = i >= 8 && i < 15 && j >= 3 + up && j < Pool::kLevel + up;
      return is_foam ? 1 : j < Pool::kLevel + up ? Pool::kFull : 0;
    });
    std::vector<std::pair<int, int>> thin;
    for (int i = 0; i < Pool::kCells; ++i)
      for (int j = up; j < Pool::kCells; ++j)
        if (pool.is_thin(i, j)) thin.emplace_back(i, j - up);
    return thin;
  };
  const auto thin = thin_cells(0);
  EXPECT_EQ(std::ranges::min(thin, {}, &std::pair<int, int>::second).second, Pool::kLevel - 4) << "three below the top row, which is air by its average";
  for (const int up : {1, 2, 3}) EXPECT_EQ(thin_cells(up), thin) << up;
}

// A cell's own average, and its mirror image in the solid, find the surface of a film too low; the sum of the column does not.
TEST(FluidSurface, AFilmIsAsThickAsItsColumnUpToTheWalls) {
  for (const int level : {1, 2}) {
    const Pool pool([&](int, int j) { return j < level ? Pool::kFull : 0; });
    for (int i = 0; i < Pool::kCells; ++i) {
      ASSERT_TRUE(pool.is_liquid(i, level - 1) && !pool.is_liquid(i, level)) << level << " " << i;
      EXPECT_NEAR(theta(pool.cells.distance[pool.at(i, level - 1)], pool.cells.distance[pool.at(i, level)]), 0.5, 1e-6) << level << " " << i;
      EXPECT_EQ(pool.is_film(i, 0), level == 1);
    }
  }
}

// What lies on a solid is liquid, and no foam, as long as it covers it; beside a wall the top of deep liquid is no film.
TEST(FluidSurface, HalfACellOnTheFloorIsAFilmAndTheTopOfDeepLiquidBesideAWallIsNone) {
  const Pool half([](int, int j) { return j == 0 ? Pool::kFull / 2 : 0; });
  const Pool quarter([](int, int j) { return j == 0 ? Pool::kFull / 4 : 0; });
  for (int i = 0; i < Pool::kCells; ++i) {
    EXPECT_TRUE(half.is_film(i, 0) && !half.is_thin(i, 0)) << i;
    EXPECT_TRUE(quarter.is_thin(i, 0)) << i;
  }
  const Pool heap([](int i, int j) { return Pool::level(i, j) || (i == 0 && j == Pool::kLevel) ? Pool::kFull : 0; });
  EXPECT_TRUE(heap.is_liquid(0, Pool::kLevel) && !heap.is_liquid(1, Pool::kLevel));
  EXPECT_FALSE(heap.is_film(0, Pool::kLevel));
}

// What is in it flies: its faces are valid, and no pressure changes those between two of its cells.
TEST(FluidSurface, ThinLiquidKeepsItsVelocity) {
  const Pool pool([](int i, int j) { return i >= 8 && i < 15 && j >= 5 && j < Pool::kLevel ? 1 : Pool::level(i, j); });
  const FaceField<2, double> before = cases::random_field<FaceLayout<2, double>>(pool.blocks, 1);
  FaceField<2, double> v = before;
  FaceMask<2> valid;
  const PressureReport report = Projection<2>().project(v, pool.cells, pool.blocks, 1e-10, valid);
  EXPECT_LE(report.max_divergence, 1e-7);
  for (std::size_t a = 0; a < 2; ++a) {
    EXPECT_EQ(valid[a][pool.at(11, 10)], 1);
    EXPECT_EQ(v[a][pool.at(11, 10)], before[a][pool.at(11, 10)]);
    EXPECT_NE(v[a][pool.at(4, 6)], before[a][pool.at(4, 6)]);
  }
}

/// What a pool with a step in its surface has in the air beside it: the field after a projection, extrapolated, and after its outflow was carried on.
struct Outside {
  FaceMask<2> valid;
  FaceField<2, double> before, after;
  static bool is_step(int i) { return i > 5 && i < 12; }
  static int first_air(int i) { return Pool::kLevel + int(is_step(i)); }
  const Pool pool{[](int i, int j) { return j == Pool::kLevel && is_step(i) ? Pool::kFull : Pool::level(i, j); }};
  explicit Outside(FaceField<2, double> v) {
    Projection<2>().project(v, pool.cells, pool.blocks, 1e-10, valid);
    extrapolate(v, valid, pool.blocks, 4);
    before = after = v;
    carry_on_outflow(after, valid, pool.cells, pool.blocks);
  }
  double outflow(const FaceField<2, double>& f, int i, int j) const {
    return f[0][pool.at(i + 1, j)] - f[0][pool.at(i, j)] + f[1][pool.at(i, j + 1)] - f[1][pool.at(i, j)];
  }
  double fastest(const FaceField<2, double>& f, int i, int j) const {
    return std::max({std::abs(f[0][pool.at(i + 1, j)]), std::abs(f[0][pool.at(i, j)]), std::abs(f[1][pool.at(i, j + 1)]), std::abs(f[1][pool.at(i, j)])});
  }
};

TEST(FluidSurface, AirBesideLiquidHasNoOutflowEither) {
  const Pool pool(Pool::level);
  const Outside air(cases::random_field<FaceLayout<2, double>>(pool.blocks, 1));
  double most = 0;
  int cut = 0;
  for (int i = 1; i < Pool::kCells - 1; ++i) {
    const int j = Outside::first_air(i);
    ASSERT_FALSE(air.pool.is_liquid(i, j));
    const double before = air.outflow(air.before, i, j), after = air.outflow(air.after, i, j);
    most = std::max(most, std::abs(before));
    if (std::abs(after) < 1e-12) continue;
    ++cut;   // by the bound: its outer face is as fast as the fastest was
    EXPECT_LE(std::abs(after), std::abs(before)) << i;
    EXPECT_EQ(std::abs(air.after[1][air.pool.at(i, j + 1)]), air.fastest(air.before, i, j)) << i;
  }
  EXPECT_GT(most, 0.1);
  EXPECT_LT(cut, Pool::kCells / 2);
  for (std::size_t a = 0; a < 2; ++a)   // liquid keeps its field
    for (std::size_t i = 0; i < pool.blocks.size(); ++i) EXPECT_TRUE(!air.valid[a][i] || air.after[a][i] == air.before[a][i]);
}

TEST(FluidSurface, WhatAirCarriesOnMakesNoFaceFaster) {
  const Pool pool(Pool::level);
  int full = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Outside air(cases::random_field<FaceLayout<2, double>>(pool.blocks, seed));
    for (int i = 1; i < Pool::kCells - 1; ++i) {
      const int j = Outside::first_air(i);
      const double most = air.fastest(air.before, i, j);
      EXPECT_LE(air.fastest(air.after, i, j), most) << i;
      full += std::abs(air.after[1][air.pool.at(i, j + 1)]) == most && air.after[1][air.pool.at(i, j + 1)] != air.before[1][air.pool.at(i, j + 1)];
    }
  }
  EXPECT_GT(full, 4);   // the bound was met
}

// A field that is linear in the place is what APIC knows: a particle that has been shifted has the field's velocity there.
TEST(FluidShift, LeavesTheVelocityOfTheNewPlace) {
  const Lattice<3> lattice({9, 9, 9});
  const auto blocks = ActiveBlocks<3>::whole(lattice);
  const Solids<3> solids(Scene{}, lattice);
  const Vec<3, double> by(0.25, -0.125, 0.3);
  const auto velocity = [](int c, const Vec<3, double>& x) { return 0.3 * c + (1 + c) * x[0] - 0.7 * x[1] + (2 - c) * x[2]; };
  FaceField<3, double> field, displacement;
  for (int c = 0; c < 3; ++c) {
    field[std::size_t(c)].resize(blocks.size()), displacement[std::size_t(c)].assign(blocks.size(), by[c]);
    for (const std::size_t i : cases::places_of(blocks)) {
      const Cell<3> at = blocks.cell_at(i);
      Vec<3, double> x;
      for (int a = 0; a < 3; ++a) x[a] = at[std::size_t(a)] + (a == c ? 0 : 0.5);
      field[std::size_t(c)][i] = velocity(c, x);
    }
  }
  for (const Kernel kernel : {Kernel::linear, Kernel::quadratic}) {
    const MacTransfer<3, double> transfer(kernel, cases::prefix<3>(kernel, 4));
    auto particles = cases::random_particles<3, double>(lattice, 200, 4, 3, 2);
    const CellRanges ranges = CanonicalOrder<3, double>().sort(particles, lattice);
    transfer.gather(ranges, blocks, field, nullptr, {}, particles);
    const auto before = particles;
    for (std::size_t b = 0; b < ranges.occupied.size(); ++b) shift(transfer, blocks, displacement, solids, ranges, b, particles);
    for (std::size_t p = 0; p < particles.size(); ++p) {
      ASSERT_LE((particles.place(p) - before.place(p) - by).cwiseAbs().maxCoeff(), 1e-12);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(particles.component(p, c)[0], velocity(c, particles.place(p)), 1e-11);
    }
  }
}

}  // namespace
}  // namespace sim
