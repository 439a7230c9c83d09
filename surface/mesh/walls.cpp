#include "surface/mesh/walls.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace surface::mesh {
namespace {

using base::Vec3f;
using openvdb::Coord;
using openvdb::Vec3d;

constexpr double kOn = 1e-3;       // [voxels] nearer than this is on the wall
constexpr float kHidden = 3;       // [voxels] the band: further from a wall nothing is hidden
constexpr float kShown = 0.01f;    // [voxels] a value this far above the box's own is the free surface's

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

/// [voxels] The cut box's own distance.
float Level::box(const Coord& c) const {
  const Vec3d x = c.asVec3d(), q = openvdb::math::maxComponent(walls_->lower - x, x - walls_->upper);
  return float(openvdb::math::maxComponent(q, Vec3d(0.0)).length() + std::min(0.0, std::max({q[0], q[1], q[2]})));
}

/// [voxels] Near a wall the cut hides the free surface; it is continued from the first voxels inwards that show it.
float Level::value(const Coord& c) const {
  const float own = values_.getValue(c) / voxel_;
  if (!walls_ || box(c) < -kHidden || (own > box(c) + kShown && box(c) < -1 + kOn)) return own;
  Coord inward;
  for (int a = 0; a < 3; ++a) inward[a] = c[a] - walls_->lower[a] < 1 - kOn ? 1 : walls_->upper[a] - c[a] < 1 - kOn ? -1 : 0;
  if (inward == Coord(0)) return own;
  for (int step = 1; step <= int(kHidden); ++step) {
    const Coord at(c[0] + step * inward[0], c[1] + step * inward[1], c[2] + step * inward[2]), next = at + inward;
    const float v = values_.getValue(at) / voxel_, w = values_.getValue(next) / voxel_;
    if (v <= box(at) + kShown) continue;
    return step == 1 && w > box(next) + kShown ? 2 * v - w : v;
  }
  return -kHidden;
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

/// Whether a solid moves the cut out of the wall beside x: behind the wall, where the free surface is out of the way, the values then run beside the box's own.
bool Level::is_moved(int axis, int side, const Vec3d& x) const {
  Coord behind = Coord::floor(x), further(0);
  behind[axis] = side == 0 ? int(std::ceil(walls_->lower[axis] - kOn)) - 1 : int(std::floor(walls_->upper[axis] + kOn)) + 1;
  further[axis] = side == 0 ? -1 : 1;
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  for (int i = 0; i < 4; ++i) {
    Coord at = behind;
    at[b] += i / 2, at[c] += i % 2;
    const float off = values_.getValue(at) / voxel_ - box(at), next = values_.getValue(at + further) / voxel_ - box(at + further);
    if (off < -kShown || (off > kShown && std::fabs(next - off) < kShown)) return true;
  }
  return false;
}

Vertex Level::vertex(const Vec3d& x) const {
  std::array<bool, 3> beside = {};   // in the mesher's cell that the wall cuts or bounds
  std::uint8_t on = 0;
  Vec3d moved = x, outward(0.0);
  Vec3f solid = Vec3f::Zero();   // outwards, into what moves the cut
  bool edge = false;
  for (int a = 0; walls_ && a < 3; ++a)
    for (int side = 0; side < 2; ++side) {
      const double at = side == 0 ? walls_->lower[a] : walls_->upper[a], off = std::fabs(x[a] - at);
      const bool in_cell = side == 0 ? x[a] < std::floor(at + kOn) + 1 - kOn : x[a] > std::ceil(at - kOn) - 1 + kOn;
      if (!in_cell) continue;
      if (is_moved(a, side, x)) {
        solid[a] = side == 0 ? -1 : 1;
        continue;
      }
      beside[std::size_t(a)] = true;
      on = static_cast<std::uint8_t>(on | 1 << (2 * a + side));
      outward[a] = side == 0 ? -1 : 1;
      edge = edge || off > kOn;
      moved[a] = at;
    }
  const Vec3f wall = Vec3f(float(outward[0]), float(outward[1]), float(outward[2])).stableNormalized();
  if (!edge && on == 0 && solid != Vec3f::Zero() && value(x) < -1) return {x, solid.normalized(), 0};
  if (!edge) return {moved, on == 0 ? gradient(x).stableNormalized() : wall, on};
  const float inside = value(moved);
  if (inside < -1) return {moved, wall, on};   // walls meet here, under water
  const Vec3f normal = gradient(moved).stableNormalized();
  const Vec3d along(beside[0] ? 0 : normal[0], beside[1] ? 0 : normal[1], beside[2] ? 0 : normal[2]);
  if (along.lengthSqr() < 0.1) return {x, normal, 0};   // the surface runs along the wall: there is no edge to find
  moved -= along * std::clamp(double(inside) / along.lengthSqr(), -0.75, 0.75);
  for (int a = 0; a < 3; ++a) moved[a] = std::clamp(moved[a], walls_->lower[a], walls_->upper[a]);
  return {moved, normal, on};
}

base::Vec3f wall_normal(std::uint8_t common) {
  Vec3f normal = Vec3f::Zero();
  const int bit = std::countr_zero(common);
  normal[bit / 2] = bit % 2 == 0 ? -1.0f : 1.0f;
  return normal;
}

}  // namespace surface::mesh
