#include "render/trace/camera.h"

#include <cmath>
#include <numbers>
#include <optional>

#include "render/trace/integrator.h"

namespace render::trace {
namespace {

using base::Vec3;

constexpr double kMoment = 1.0 / 64;  // [frames] over which motion is measured, to each side

bool same(const view::View& a, const view::View& b) {
  return a.position == b.position && a.forward == b.forward && a.right == b.right && a.up == b.up && a.tan_x == b.tan_x && a.tan_y == b.tan_y;
}

/// Picture coordinates from -1 to 1 of what lies along `way` from the camera; empty when it is behind.
std::optional<Eigen::Vector2d> projected(const view::View& v, const Vec3& way) {
  const double depth = way.dot(v.forward);
  if (!(depth > 1e-9 * way.norm())) return {};
  return Eigen::Vector2d(way.dot(v.right) / (depth * v.tan_x), way.dot(v.up) / (depth * v.tan_y));
}

/// Uniform in the unit disc; squares of u become wedges of it [Shirley97].
Eigen::Vector2f disc(sampling::Point u) {
  const float a = 2 * u.x - 1, b = 2 * u.y - 1;
  if (a == 0 && b == 0) return {0, 0};
  const bool wide = std::abs(a) > std::abs(b);
  const float r = wide ? a : b, eighth = std::numbers::pi_v<float> / 4;
  const float phi = wide ? eighth * (b / a) : 2 * eighth - eighth * (a / b);
  return {r * std::cos(phi), r * std::sin(phi)};
}

}  // namespace

Camera::Frustum Camera::frustum(const view::View& v) {
  return {v.position.cast<float>(), v.forward.cast<float>(), (v.tan_x * v.right).cast<float>(), (v.tan_y * v.up).cast<float>()};
}

Camera::Camera(const Setting& s, std::int64_t frame)
    : width_(static_cast<float>(s.options.width)), height_(static_cast<float>(s.options.height)), fps_(s.fps),
      half_exposure_(static_cast<float>(0.5 * s.camera.shutter / s.fps)), walls_(s.domain) {
  const auto moment = static_cast<double>(frame), half = 0.5 * s.camera.shutter;
  const auto view_at = [&](double at) { return view::resolve(s.camera, s.domain, s.options.width, s.options.height, at); };
  const view::View now = view_at(moment), opening = view_at(moment - half), closing = view_at(moment + half);
  before_ = view_at(moment - kMoment);
  after_ = view_at(moment + kMoment);
  moves_ = !same(opening, now) || !same(now, closing);
  travels_ = !same(before_, after_);
  open_ = frustum(opening);
  close_ = frustum(closing);
  lens_ = static_cast<float>(now.lens);
  focus_ = static_cast<float>(now.focus);
}

Camera::Frustum Camera::at(float time) const {
  if (!moves_) return open_;
  const float rest = 1 - time;
  return {rest * open_.position + time * close_.position, rest * open_.forward + time * close_.forward, rest * open_.right + time * close_.right,
          rest * open_.up + time * close_.up};
}

Ray Camera::ray(float x, float y, sampling::Point lens, float time) const {
  const float a = 2 * x / width_ - 1, b = 1 - 2 * y / height_;
  const Frustum f = at(time);
  const Vec3f way = f.forward + a * f.right + b * f.up;  // to one metre in front
  if (lens_ == 0) return {f.position, way / way.norm(), time};
  const Eigen::Vector2f at_lens = lens_ * disc(lens);
  const Vec3f side = at_lens.x() * f.right.normalized() + at_lens.y() * f.up.normalized();
  return {f.position + side, (focus_ * way - side).normalized(), time};
}

float Camera::depth(const Ray& ray, float t) const { return t * ray.direction.dot(at(ray.time).forward); }

Eigen::Vector2f Camera::motion(const Ray& ray, const FirstHit& first) const {
  if (!travels_ && first.velocity.isZero(0)) return {0, 0};
  const Vec3 direction = ray.direction.cast<double>(), velocity = first.velocity.cast<double>();
  const Vec3 seen = ray.origin.cast<double>() + static_cast<double>(first.t) * direction;
  const double later = first.is_held ? 0 : static_cast<double>((2 * ray.time - 1) * half_exposure_);
  const Vec3 point = seen - later * velocity;  // at the frame's moment
  const Vec3 step = kMoment / fps_ * velocity;
  const auto from = projected(before_, first.found ? Vec3(point - step - before_.position) : direction);
  const auto to = projected(after_, first.found ? Vec3(point + step - after_.position) : direction);
  if (!from || !to) return {0, 0};
  const Eigen::Vector2d half_picture(0.5 * static_cast<double>(width_), 0.5 * static_cast<double>(height_));
  return ((*to - *from).cwiseProduct(half_picture) / (2 * kMoment)).cast<float>();
}

}  // namespace render::trace
