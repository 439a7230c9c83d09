#pragma once
// Directions and shares of light at a smooth boundary, and directions around a normal.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/vec.h"
#include "render/sampling/sampler.h"

namespace render::trace {

using base::Vec3f;

/// Reflected share of unpolarised light [PBRT4 9.3]. `cos_i` in [0, 1] on the side light comes from, eta = n_t / n_i.
/// 1 at total reflection; then `cos_t` is 0.
inline float fresnel(float cos_i, float eta, float& cos_t) {
  const float sin2_t = std::max(0.0f, 1 - cos_i * cos_i) / (eta * eta);
  if (sin2_t >= 1) {
    cos_t = 0;
    return 1;
  }
  cos_t = std::sqrt(1 - sin2_t);
  const float parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t), across = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
  return 0.5f * (parallel * parallel + across * across);
}

/// Mirror image of a travelling direction; `n` faces the light, cos_i = -d . n.
inline Vec3f reflect(const Vec3f& d, const Vec3f& n, float cos_i) { return d + 2 * cos_i * n; }

/// Snell: the direction on the other side, with cos_t from fresnel().
inline Vec3f refract(const Vec3f& d, const Vec3f& n, float cos_i, float cos_t, float eta) { return d / eta + (cos_i / eta - cos_t) * n; }

/// A basis about a normal, without a branch on which axis is longest [Duff17].
struct Frame {
  Vec3f s, t, n;
  explicit Frame(const Vec3f& normal) : n(normal) {
    const float sign = std::copysign(1.0f, n.z()), p = -1 / (sign + n.z()), q = n.x() * n.y() * p;
    s = Vec3f(1 + sign * n.x() * n.x() * p, sign * q, -sign * n.x());
    t = Vec3f(q, sign + n.y() * n.y() * p, -n.y());
  }
  Vec3f world(const Vec3f& local) const { return local.x() * s + local.y() * t + local.z() * n; }
  Vec3f local(const Vec3f& world) const { return {world.dot(s), world.dot(t), world.dot(n)}; }
};

/// Direction about z with density cos / pi.
inline Vec3f cosine_direction(sampling::Point u) {
  // Polar, not concentric: sky and total reflection depend on the height above the horizon first, which u.x alone then stratifies.
  const float r = std::sqrt(u.x), phi = 2 * std::numbers::pi_v<float> * u.y;
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(0.0f, 1 - u.x))};
}

/// Direction about z with uniform density over the cap of height `height`: all directions at 2.
inline Vec3f cap_direction(float height, sampling::Point u) {
  const float below = height * u.x, z = 1 - below, r = std::sqrt(std::max(0.0f, below * (2 - below))), phi = 2 * std::numbers::pi_v<float> * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

}  // namespace render::trace
