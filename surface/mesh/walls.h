#pragma once
// Where a level set was cut flat: the mesher bevels the edge between a wall and the free surface by up to half a voxel, and the
// gradient there mixes both. Here the free surface is continued up to the wall, and vertices of the edge move onto it.
#include <openvdb/openvdb.h>

#include <optional>

#include "base/vec.h"

namespace surface::mesh {

/// The cut box in index space.
struct Walls {
  openvdb::Vec3d lower, upper;
};

/// From the metadata cut_lower and cut_upper [m]; none for a file that others made.
std::optional<Walls> walls_of(const openvdb::FloatGrid&);

/// A vertex in index space, the free surface's normal there or the wall's where only a wall is, and the walls it lies on:
/// bit 2 a for the lower wall of axis a, bit 2 a + 1 for the upper.
struct Vertex {
  openvdb::Vec3d position;
  base::Vec3f normal;
  std::uint8_t walls;
};

/// The outward normal of a wall that all four vertices of a quad lie on, given what their `walls` have in common.
base::Vec3f wall_normal(std::uint8_t common);

/// Level set seen from one thread.
class Level {
 public:
  Level(const openvdb::FloatGrid& grid, const std::optional<Walls>& walls)
      : values_(grid.getConstAccessor()), voxel_(float(grid.voxelSize()[0])), walls_(walls) {}
  Vertex vertex(const openvdb::Vec3d& x) const;

 private:
  float box(const openvdb::Coord&) const;
  bool is_moved(int axis, int side, const openvdb::Vec3d&) const;
  float value(const openvdb::Coord&) const;
  float value(const openvdb::Vec3d&) const;
  base::Vec3f gradient(const openvdb::Vec3d&) const;
  openvdb::FloatGrid::ConstAccessor values_;
  float voxel_;
  std::optional<Walls> walls_;
};

}  // namespace surface::mesh
