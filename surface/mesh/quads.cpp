#include "surface/mesh/quads.h"

#include <openvdb/tools/VolumeToMesh.h>

namespace surface::mesh {

Quads quads_of(const openvdb::FloatGrid& grid) {
  Quads result;
  std::vector<openvdb::Vec3I> triangles;
  openvdb::tools::volumeToMesh(grid, result.points, triangles, result.quads, /*isovalue=*/0.0, /*adaptivity=*/0.0);
  for (const openvdb::Vec3I& t : triangles) result.quads.emplace_back(t[0], t[1], t[2], t[2]);
  for (openvdb::Vec4I& q : result.quads)   // OpenVDB winds clockwise
    if (q[2] == q[3]) q = openvdb::Vec4I(q[2], q[1], q[0], q[0]);
    else q = openvdb::Vec4I(q[3], q[2], q[1], q[0]);
  return result;
}

}  // namespace surface::mesh
