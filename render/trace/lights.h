#pragma once
// What shines by itself and is not met: areas, spheres, the sun, the sky, a picture of the surroundings. None blocks anything: light behind
// one adds to its own, and a ray that finds one instead of the other makes no noise.
#include <optional>
#include <vector>

#include "render/render.h"
#include "render/sampling/sampler.h"
#include "render/trace/environment.h"

namespace render::trace {

/// A direction drawn towards a light, from a point.
struct LightSample {
  Vec3f direction = Vec3f::UnitZ();
  float distance = 0;             // [m] to the light; infinite for what is far
  float density = 0;              // [1/sr]; 0: nothing to be seen there
  Vec3f radiance = Vec3f::Zero();
};
/// A light found along a ray.
struct LightHit {
  float distance, density;        // [m], [1/sr] that sample() would have had
  Vec3f radiance;
};

/// A rectangle that shines to the side its normal points to.
struct AreaLight {
  Vec3f middle, u, v;  // [m] half sides, orthogonal
  Vec3f normal;        // unit
  Vec3f radiance;
  float area;          // [m^2]
  LightSample sample(const Vec3f& from, sampling::Point) const;
  std::optional<LightHit> find(const Vec3f& from, const Vec3f& direction) const;
};

/// Shines outward. Directions are drawn evenly over the cone in which it is seen.
struct SphereLight {
  Vec3f middle;
  float radius;        // [m]
  Vec3f radiance;
  LightSample sample(const Vec3f& from, sampling::Point) const;
  std::optional<LightHit> find(const Vec3f& from, const Vec3f& direction) const;
};

/// A disc without distance.
struct Sun {
  Vec3f towards;       // unit, from the scene to the sun
  float cap;           // 1 - cosine of its angular radius
  Vec3f radiance;
  LightSample sample(const Vec3f& from, sampling::Point) const;
  std::optional<LightHit> find(const Vec3f& from, const Vec3f& direction) const;
};

/// From the horizon's colour to the zenith's, level at both ends so that no line is seen; below the horizon, the horizon's. As it is smooth,
/// the directions in which surfaces scatter find it best: it is not sampled as a light.
struct Sky {
  Vec3f zenith = Vec3f::Zero(), horizon = Vec3f::Zero();
  Vec3f radiance(const Vec3f& direction) const {
    const float height = std::clamp(direction.z(), 0.0f, 1.0f);
    return horizon + height * height * (3 - 2 * height) * (zenith - horizon);
  }
};

struct Lights {
  std::vector<AreaLight> areas;
  std::vector<SphereLight> spheres;
  std::vector<Sun> suns;
  std::vector<Environment> environments;
  Sky sky;

  /// Calls visit(light) for all that are sampled.
  template <class Visit>
  void each(const Visit& visit) const {
    for (const auto& light : areas) visit(light);
    for (const auto& light : spheres) visit(light);
    for (const auto& light : suns) visit(light);
    for (const auto& light : environments) visit(light);
  }
};

/// Reads the pictures that environments name, relative to `folder`. Throws base::Error (exit 2) when one cannot be used.
Lights make_lights(const std::vector<Light>&, const std::filesystem::path& folder);

}  // namespace render::trace
