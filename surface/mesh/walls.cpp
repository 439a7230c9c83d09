#include "surface/mesh/walls.h"

#include <algorithm>
#include <cmath>

namespace surface::mesh {
namespace {

using base::Vec3f;
using openvdb::Coord;
using openvdb::Vec3d;

constexpr double kOn = 1e-3;   // [voxels] nearer than this is on the wall

/// Weights of the eight voxels around x, visited as visit(voxel, weight).
template <class Visit>
void interpolate(const Vec3d& x, const Visit& visit) {
  const Coord base = Coord::floor(x);
  const Vec3d t = x - base.asVec3d();
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k)
        visit(base.offsetBy(i, j, k), float((i ? t[0] : 1 - t[0]) * (j ? t[1] : 1 - t[1]) * (k ? t[2] : 1 - t[2])));
}

}  // namespace

std::optional<Walls> walls_of(const openvdb::FloatGrid& grid) {
  const auto lower = grid.getMetadata<openvdb::Vec3DMetadata>("cut_lower"), upper = grid.getMetadata<openvdb::Vec3DMetadata>("cut_upper");
  if (!lower || !upper) return std::nullopt;
  return Walls{grid.worldToIndex(lower->value()), grid.worldToIndex(upper->value())};
}

/// [voxels] within a voxel of a wall the cut hides the free surface: continued in a straight line from further inside.
float Level::value(const Coord& c) const {
  if (walls_)
    for (int a = 0; a < 3; ++a) {
      const int inward = c[a] - walls_->lower[a] < 1 - kOn ? 1 : walls_->upper[a] - c[a] < 1 - kOn ? -1 : 0;
      if (inward == 0 || walls_->upper[a] - walls_->lower[a] < 8) continue;
      Coord one = c, two = c;
      one[a] += inward, two[a] += 2 * inward;
      return 2 * value(one) - value(two);
    }
  return values_.getValue(c) / voxel_;
}

float Level::value(const Vec3d& x) const {
  float sum = 0;
  interpolate(x, [&](const Coord& c, float weight) { sum += weight * value(c); });
  return sum;
}

/// Central differences at the eight voxels around x, interpolated: continuous from voxel to voxel. On the ridge inside a sheet
/// the differences are short and say little; the square of their length leaves them out.
Vec3f Level::gradient(const Vec3d& x) const {
  Vec3f sum = Vec3f::Zero();
  interpolate(x, [&](const Coord& c, float weight) {
    const Vec3f difference(value(c.offsetBy(1, 0, 0)) - value(c.offsetBy(-1, 0, 0)), value(c.offsetBy(0, 1, 0)) - value(c.offsetBy(0, -1, 0)),
                           value(c.offsetBy(0, 0, 1)) - value(c.offsetBy(0, 0, -1)));
    sum += weight * difference.squaredNorm() * difference;
  });
  return sum;
}

Vertex Level::vertex(const Vec3d& x) const {
  std::array<bool, 3> beside = {};   // less than a voxel from a wall
  Vec3d moved = x, outward(0.0);
  bool edge = false;
  for (int a = 0; walls_ && a < 3; ++a)
    for (const double at : {walls_->lower[a], walls_->upper[a]}) {
      const double off = std::fabs(x[a] - at);
      if (off >= 1) continue;
      beside[std::size_t(a)] = true;
      outward[a] = at == walls_->lower[a] ? -1 : 1;
      edge = edge || off > kOn;
      moved[a] = at;
    }
  const Vec3f wall = Vec3f(float(outward[0]), float(outward[1]), float(outward[2])).stableNormalized();
  if (!edge) return {x, outward == Vec3d(0.0) ? gradient(x).stableNormalized() : wall};
  const float inside = value(moved);
  if (inside < -1.5f) return {moved, wall};   // walls meet here, under water
  const Vec3f normal = gradient(moved).stableNormalized();
  const Vec3d along(beside[0] ? 0 : normal[0], beside[1] ? 0 : normal[1], beside[2] ? 0 : normal[2]);
  if (along.lengthSqr() < 0.1) return {x, normal};   // the surface runs along the wall: there is no edge to find
  moved -= along * std::clamp(double(inside) / along.lengthSqr(), -0.75, 0.75);
  for (int a = 0; a < 3; ++a) moved[a] = std::clamp(moved[a], walls_->lower[a], walls_->upper[a]);
  return {moved, normal};
}

}  // namespace surface::mesh
