#include "render/view/view.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "render/view/keys.h"

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

/// `fallback`, unless keys name the quantity.
template <class Value, class Fallback>
Fallback keyed(const std::vector<CameraKey>& keys, std::optional<Value> CameraKey::*quantity, double frame, const Fallback& fallback) {
  std::vector<Key<Value>> named;
  for (const CameraKey& key : keys)
    if (key.*quantity) named.push_back({key.frame, *(key.*quantity)});
  return named.empty() ? fallback : Fallback(curve(named, frame));
}

constexpr double kFieldOfView = 35;   // [degrees] of a camera that says none

/// [degrees] The least field of view of all frames.
double narrowest(const Camera& camera) {
  double least = camera.fov.value_or(kFieldOfView);
  bool is_keyed = false;
  for (const CameraKey& key : camera.keys)
    if (key.fov) least = is_keyed ? std::min(least, *key.fov) : *key.fov, is_keyed = true;
  return least;
}

/// The camera without its keys, as they have it at `frame`.
Camera at_frame(Camera camera, double frame) {
  camera.position = keyed(camera.keys, &CameraKey::position, frame, camera.position);
  camera.target = keyed(camera.keys, &CameraKey::target, frame, camera.target);
  camera.fov = keyed(camera.keys, &CameraKey::fov, frame, std::optional(camera.fov.value_or(kFieldOfView)));
  camera.focus = keyed(camera.keys, &CameraKey::focus, frame, camera.focus);
  return camera;
}

/// Thin lens: the film at a distance s behind it has the field of view, 1 / f = 1 / s + 1 / focus, and the opening is f / N wide.
double lens_radius(const Camera& camera, const View& v) {
  if (!camera.aperture) return 0;
  const double s = 0.5 * camera.sensor / v.tan_y;
  return 0.5 / (*camera.aperture * (1 / s + 1 / v.focus));
}

constexpr int kTurns = 64;  // directions from which a turntable's default view shows the whole domain

}  // namespace

View resolve(const Camera& given, const base::Box& domain, std::int64_t width, std::int64_t height, double frame) {
  const Camera camera = at_frame(given, frame);
  View v;
  const auto open = [&](double fov) {
    v.tan_y = std::tan(0.5 * fov * std::numbers::pi / 180);
    v.tan_x = v.tan_y * static_cast<double>(width) / static_cast<double>(height);
  };
  const Vec3 target = camera.target.value_or(0.5 * (domain.lower + domain.upper));
  const auto turned = [&](const Vec3& arm, double turns) {
    return Vec3(Eigen::AngleAxisd(2 * std::numbers::pi * turns, camera.up.normalized()) * arm);
  };
  Vec3 arm = kFrom, sight = -kFrom;
  if (camera.position) {
    arm = *camera.position - target;
    if (arm.norm() > 1e-9) sight = -arm;
  } else {
    double distance = 0;
    open(narrowest(given));   // for all frames: else the camera would go back while the lens zooms in
    for (int i = 0; i < (camera.turntable ? kTurns : 1); ++i) {
      aim(v, -turned(kFrom, static_cast<double>(i) / kTurns), camera.up);
      distance = std::max(distance, fitting_distance(v, domain, target));
    }
    arm *= distance;
  }
  open(*camera.fov);
  v.position = camera.position.value_or(target + arm);
  if (camera.turntable) {
    arm = turned(arm, camera.turntable->revolutions * (frame - 1) / camera.turntable->frames);
    v.position = target + arm;
    sight = arm.norm() > 1e-9 ? Vec3(-arm) : sight;
  }
  aim(v, sight, camera.up);
  v.focus = camera.focus.value_or(std::max((target - v.position).dot(v.forward), 1e-3));
  v.lens = lens_radius(camera, v);
  return v;
}

}  // namespace render::view
