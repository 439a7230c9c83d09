#include <algorithm>
#include <cmath>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

using base::Vec3;
using base::Vec3f;

constexpr float kApart = 0.5f;      // [voxels] from the plane that a solid has in the side
constexpr float kLook = 0.75f;      // [voxels] behind it the solid is asked for
constexpr float kSeen = 4;          // [voxels] the band and a voxel: further off the cut is not written

/// A side of the domain and the shapes that reach it.
struct Side {
  int axis;
  float outward;   // 1, -1
  float at;        // [voxels]
  std::vector<const sim::Shape*> shapes;
};

std::vector<Side> sides_with_solids(const Room& room, const Lattice& lattice) {
  std::vector<Side> sides;
  for (int axis = 0; axis < 3; ++axis)
    for (const float outward : {-1.0f, 1.0f}) {
      if (axis == 2 && outward < 0) continue;   // the floor, where all of the cut lies lower
      const double plane = (outward < 0 ? room.domain.lower : room.domain.upper)[axis], near = kTouches * lattice.voxel;
      Side side = {axis, outward, float((plane - lattice.origin[axis]) / lattice.voxel), {}};
      for (const Solid& solid : room.solids)
        if (const base::Box bounds = solid.shape.bounds(); bounds.lower[axis] <= plane + near && bounds.upper[axis] >= plane - near)
          side.shapes.push_back(&solid.shape);
      if (!side.shapes.empty()) sides.push_back(std::move(side));
    }
  return sides;
}

/// [voxels] How far out of the domain the cut lies beside voxel x. It grows with the depth in the solid, from nothing at its edge.
float shift(const Side& side, const Lattice& lattice, Vec3f x) {
  x[side.axis] = side.at;
  const Vec3 place = lattice.origin + lattice.voxel * x.cast<double>(), outward = side.outward * lattice.voxel * Vec3::Unit(side.axis);
  float in = 0, out = 0;
  for (const sim::Shape* shape : side.shapes) {
    if (shape->distance(place) > kTouches * lattice.voxel) continue;
    in = std::max(in, float(-shape->distance(place - kLook * outward) / lattice.voxel));
    out = std::max(out, float(-shape->distance(place + kLook * outward) / lattice.voxel));
  }
  return in > 0 ? -std::min(in, kApart) : std::min(out, kApart);
}

}  // namespace

void cut(const Blocks& blocks, const Room& room, const Lattice& lattice, float below, const Field* others, Field& distance) {
  const Vec3f lower(0, 0, -below), upper = (room.domain.size() / lattice.voxel).cast<float>();
  const std::vector<Side> sides = sides_with_solids(room, lattice);
  each_block(blocks, [&](std::size_t b) {
    for (std::size_t v = 0; v < std::size_t(kVoxels); ++v) {
      const Vec3f x = voxel_of(blocks, b, v).cast<float>();
      float& d = distance[b * kVoxels + v];
      Vec3f low = lower, high = upper;
      for (const Side& side : sides) {
        if (d > kSeen || std::fabs(x[side.axis] - side.at) > kSeen) continue;
        const float by = shift(side, lattice, x);
        if (side.outward < 0) low[side.axis] -= by;
        else high[side.axis] += by;
      }
      if (others) {
        const float in = std::clamp(kApart * (1 - (*others)[b * kVoxels + v]), 0.0f, kApart);
        low += Vec3f(in, in, 0), high.array() -= in;   // but at the floor, where nothing is seen
      }
      const Vec3f q = (low - x).cwiseMax(x - high);
      const float box = q.cwiseMax(0).norm() + std::min(0.0f, q.maxCoeff());
      d = std::min(std::max(d, box), kFar);
    }
  });
}

}  // namespace surface::field
