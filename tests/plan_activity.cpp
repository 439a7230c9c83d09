// Only what is occupied is looked at, and what stands still is looked at once.
#include <gtest/gtest.h>

#include <algorithm>

#include "sim/fluid/open_faces.h"

namespace {

using namespace sim;

/// The blocks around one cell.
ActiveBlocks<3> around(const Lattice<3>& lattice, const Cell<3>& at) {
  CellRanges ranges;
  ranges.occupied = {lattice.block_key(Lattice<3>::block_of(at))};
  ranges.begin.assign(std::size_t(Lattice<3>::kCellsPerBlock) + 1, 1);   // one particle, in that cell
  std::fill_n(ranges.begin.begin(), Lattice<3>::local_of(at) + 1, 0u);
  ActiveBlocks<3> blocks(lattice);
  blocks.cover(ranges, 4);
  return blocks;
}

Scene room_with_ball() {
  Scene scene;
  scene.options.domain = {base::Vec3(0, 0, 0), base::Vec3(3.2, 1.6, 1.6)};
  scene.options.cell = 0.1;
  Collider ball;
  ball.shape.sphere = Shape::Sphere{base::Vec3(0.83, 0.81, 0.79), 0.85};
  scene.colliders = {ball};
  return scene;
}

}  // namespace

// The collider is taken away before the second update: where blocks were before, its cuts are still known; only new blocks ask.
TEST(PlanActivity, AStaticColliderCutsABlockOnce) {
  const Scene scene = room_with_ball();
  const Lattice<3> lattice({32, 16, 16});
  Solids<3> solids(scene, lattice);
  const ActiveBlocks<3> before = around(lattice, {8, 8, 8}), after = around(lattice, {12, 8, 8});
  OpenFaces<3> open, fresh;
  open.update(solids, before);
  fresh.update(solids, after);
  solids.shapes.clear();
  open.update(solids, after);
  std::size_t kept = 0, asked = 0;
  for (std::size_t slot = 0; slot < after.count(); ++slot) {
    if (fresh.is_open(slot)) continue;
    const bool was_there = before.slot(after.keys()[slot]) >= 0;
    EXPECT_EQ(open.is_open(slot), !was_there);
    for (std::size_t i = slot * 64; i < slot * 64 + 64 && was_there; ++i)
      for (int a = 0; a < 3; ++a) EXPECT_EQ(open(a, i), fresh(a, i));
    ++(was_there ? kept : asked);
  }
  EXPECT_GT(kept, 0u);
  EXPECT_GT(asked, 0u);
}

TEST(PlanActivity, WithoutAColliderNothingIsStoredOfOne) {
  Scene scene = room_with_ball();
  scene.colliders.clear();
  const Lattice<3> lattice({32, 16, 16});
  const Solids<3> solids(scene, lattice);
  EXPECT_TRUE(solids.shapes.empty());
  const ActiveBlocks<3> blocks = around(lattice, {16, 8, 8});   // away from the walls
  OpenFaces<3> open;
  open.update(solids, blocks);
  for (std::size_t slot = 0; slot < blocks.count(); ++slot) EXPECT_TRUE(open.is_open(slot)) << slot;
}
