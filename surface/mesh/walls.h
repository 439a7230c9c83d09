#pragma once
// Where a level set was cut flat: the mesher bevels the edge between a wall and the free surface by up to half a voxel, and the
// gradient there mixes both. Here the free surface is continued up to the wall, and vertices of the edge move onto it.
#include <openvdb/openvdb.h>

#include <array>
#include <optional>

#include "base/vec.h"

namespace surface::mesh {

/// The cut box in index space.
struct Walls {
  openvdb::Vec3d lower, upper;
};

/// From the metadata cut_lower and cut_upper [m]; none for a file that others made.
std::optional<Walls> walls_of(const openvdb::FloatGrid&);

/// A vertex in index space and the free surface's normal there, or the wall's where it lies on a wall.
struct Vertex {
  openvdb::Vec3d position;
  base::Vec3f normal;
};

/// Level set seen from one thread.
class Level {
 public:
  Level(const openvdb::FloatGrid& grid, const std::optional<Walls>& walls) : values_(grid.getConstAccessor()), voxel_(float(grid.voxelSize()[0])), walls_(walls) {}
  Vertex vertex(const openvdb::Vec3d& x) const;

 private:
  float value(const openvdb::Coord&) const;
  float value(const openvdb::Vec3d&) const;
  base::Vec3f gradient(const openvdb::Vec3d&) const;
  openvdb::FloatGrid::ConstAccessor values_;
  float voxel_;
  std::optional<Walls> walls_;
};

}  // namespace surface::mesh
