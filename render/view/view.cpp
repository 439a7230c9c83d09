#include "render/view/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace render::view {
namespace {

using base::Vec3;

constexpr double kMargin = 0.93;  // of the half picture that the domain may fill
const Vec3 kFrom = Vec3(0.42, -0.82, 0.40).normalized();  // from the middle of the domain to the camera, where none is given

Vec3 corner(const base::Box& box, int i) {
  return {(i & 1 ? box.upper : box.lower).x(), (i & 2 ? box.upper : box.lower).y(), (i & 4 ? box.upper : box.lower).z()};
}

void aim(View& v, const Vec3& forward, const Vec3& up) {
  v.forward = forward.normalized();
  Vec3 side = v.forward.cross(up);
  if (side.norm() < 1e-9 * up.norm()) side = v.forward.unitOrthogonal();  // looking straight along up: any roll will do
  v.right = side.normalized();
  v.up = v.right.cross(v.forward);
}

/// Least distance from `target` against the view direction at which all corners are inside the margins.
double fitting_distance(const View& v, const base::Box& domain, const Vec3& target) {
  double distance = 1e-3;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p = corner(domain, i) - target;
    const double across = std::max(std::abs(p.dot(v.right)) / (kMargin * v.tan_x), std::abs(p.dot(v.up)) / (kMargin * v.tan_y));
    distance = std::max(distance, across - p.dot(v.forward));
  }
  return distance;
}

}  // namespace

View resolve(const Camera& camera, const base::Box& domain, std::int64_t width, std::int64_t height) {
  View v;
  v.tan_y = std::tan(0.5 * camera.fov * std::numbers::pi / 180);
  v.tan_x = v.tan_y * static_cast<double>(width) / static_cast<double>(height);
  const Vec3 target = camera.target.value_or(0.5 * (domain.lower + domain.upper));
  if (camera.position) {
    v.position = *camera.position;
    const Vec3 sight = target - v.position;
    aim(v, sight.norm() > 1e-9 ? sight : Vec3(-kFrom), camera.up);
  } else {
    aim(v, -kFrom, camera.up);
    v.position = target + fitting_distance(v, domain, target) * kFrom;
  }
  return v;
}

}  // namespace render::view
