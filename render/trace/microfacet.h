#pragma once
// Rough boundaries as mirrors too small to see (GGX) [Walter07, Heitz14]. Directions are unit vectors away from the surface, in a frame whose z
// is the normal.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/vec.h"
#include "render/sampling/sampler.h"

namespace render::trace {

using base::Vec3f;

struct Ggx {
  float alpha;  // [1] rms slope of the facets

  /// Area of facets facing `h` per area of surface and solid angle.
  float facets(const Vec3f& h) const {
    const float square = alpha * alpha, c = h.z() * h.z() * (square - 1) + 1;
    return h.z() > 0 ? square / (std::numbers::pi_v<float> * c * c) : 0;
  }
  float lambda(const Vec3f& w) const {
    const float c2 = w.z() * w.z(), tan2 = std::max(0.0f, 1 - c2) / std::max(c2, 1e-12f);
    return 0.5f * (std::sqrt(1 + alpha * alpha * tan2) - 1);
  }
  /// Share of facets seen from w, and from both of two directions (height correlated).
  float masking(const Vec3f& w) const { return 1 / (1 + lambda(w)); }
  float shadowing(const Vec3f& a, const Vec3f& b) const { return 1 / (1 + lambda(a) + lambda(b)); }
  /// A facet as seen from w, above the surface: by a spherical cap [Dupuy23].
  Vec3f visible_normal(const Vec3f& w, sampling::Point u) const {
    const Vec3f seen = Vec3f(alpha * w.x(), alpha * w.y(), w.z()).normalized();
    const float phi = 2 * std::numbers::pi_v<float> * u.x, z = (1 - u.y) * (1 + seen.z()) - seen.z(), r = std::sqrt(std::max(0.0f, 1 - z * z));
    const Vec3f cap = Vec3f(r * std::cos(phi), r * std::sin(phi), z) + seen;
    return Vec3f(alpha * cap.x(), alpha * cap.y(), std::max(1e-6f, cap.z())).normalized();
  }
  /// [1/sr] density of visible_normal().
  float visible_density(const Vec3f& w, const Vec3f& h) const { return masking(w) * std::max(0.0f, w.dot(h)) * facets(h) / std::max(w.z(), 1e-6f); }
};

}  // namespace render::trace
