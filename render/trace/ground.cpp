#include "render/trace/ground.h"

#include <cmath>

namespace render::trace {

// In the plane of `back` and up the backdrop is a floor, a quarter circle and a wall. The room in front of it is convex: a ray from
// within meets the first of the three that it meets on its own stretch.
Ground::Met Ground::meet_cyclorama(const Ray& ray, const Met& floor) const {
  const float s = (ray.origin.head<2>() - middle).dot(back) - bend_from, h = ray.origin.z() - z - bend;  // from the circle's middle
  const float ds = ray.direction.head<2>().dot(back), dh = ray.direction.z();
  Met met;
  if (floor.t < met.t && s + floor.t * ds <= 0) met = floor;
  const float a = ds * ds + dh * dh, b = s * ds + h * dh, c = s * s + h * h - bend * bend, root = b * b - a * c;
  if (a > 0 && root >= 0) {
    const float t = std::max(0.0f, (std::sqrt(root) - b) / a), at_s = s + t * ds, at_h = h + t * dh;
    if (t < met.t && at_s > 0 && at_h < 0) met = {t, (-at_s * Vec3f(back.x(), back.y(), 0) - at_h * Vec3f::UnitZ()).normalized()};
  }
  if (ds > 0) {
    const float t = std::max(0.0f, (bend - s) / ds);
    if (t < met.t && h + t * dh >= 0) met = {t, Vec3f(-back.x(), -back.y(), 0)};
  }
  return met;
}

}  // namespace render::trace
