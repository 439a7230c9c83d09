#pragma once
// Inside of the integrator: what one sample holds, and how a point at which light scatters is lit.
#include <array>
#include <limits>

#include "render/trace/integrator.h"
#include "render/trace/optics.h"

namespace render::trace {

inline constexpr int kBranches = 2;                         // most paths that wait at a time
inline constexpr std::uint32_t kDimensionsAtSurface = 3;    // light, direction, choice
inline constexpr std::uint32_t kReflectionDimensions = 16;  // from where the reflected branch draws
inline constexpr std::uint32_t kDimensionsOfLight = 4096;   // from one light to the next
inline constexpr float kFar = std::numeric_limits<float>::infinity();
inline constexpr float kPi = std::numbers::pi_v<float>;

struct Integrator::Work {
  const sampling::PixelSampler& points;
  std::uint32_t sample;
  FirstHit& first;
  Vec3f sum = Vec3f::Zero();
  std::array<Path, kBranches> waiting = {};
  int count = 0;
};

/// A point of a surface, seen from the side that `geometric` and the frame's z point to.
struct Integrator::Spot {
  Vec3f point, geometric;
  Frame frame;
  Vec3f out;     // to where the path came from, in the frame
  Media below = {};  // of light that comes through it
};

/// Share of a sample of density p where another technique would have had density q: the power heuristic, or all or nothing. As a ratio:
/// what is far away on a floor without end sees a light under densities whose squares no float holds.
inline float power_share(float p, float q) { return 1 / (1 + (q / p) * (q / p)); }
inline float share_of_light(Strategy s, float p, float q) { return s == Strategy::both ? power_share(p, q) : s == Strategy::lights ? 1.0f : 0.0f; }
inline float share_of_scattering(Strategy s, float p, float q) {
  return s == Strategy::both ? power_share(p, q) : s == Strategy::scattering ? 1.0f : 0.0f;
}

/// Adds what each light gives directly. `dielectric`: the spot is a boundary that light can cross, and shadow rays stop at the next one.
template <class Scatter>
void Integrator::light(const Path& path, const Spot& spot, const Scatter& scatter, bool dielectric, Work& work) const {
  if (scene_.strategy == Strategy::scattering) return;
  std::uint32_t dimension = path.dimension;
  const bool straight = !dielectric && scene_.caustics == Caustics::straight;
  scene_.lights.each([&](const auto& source) {
    const sampling::Point u = work.points.point(work.sample, dimension);
    dimension += kDimensionsOfLight;
    const LightSample to = source.sample(spot.point, u);
    if (!(to.density > 0 && to.density < kFar)) return;
    const Vec3f in = spot.frame.local(to.direction);
    const float height = to.direction.dot(spot.geometric);
    if ((in.z() > 0) != (height > 0)) return;
    const Vec3f value = scatter.value(in);
    if (!(value.maxCoeff() > 0)) return;
    Ray shadow_ray = path.ray;
    shadow_ray.origin = spot.point + std::copysign(scene_.offset(spot.point), height) * spot.geometric;
    shadow_ray.direction = to.direction;
    bool crossed = false;
    const Vec3f through = shadow(height > 0 ? path.media : spot.below, shadow_ray, to.distance, straight, crossed);
    if (!(through.maxCoeff() > 0)) return;
    // Across dielectrics no other technique counts it.
    const float share = crossed ? 1 : share_of_light(scene_.strategy, to.density, scatter.density(in));
    work.sum += path.weight.cwiseProduct(value).cwiseProduct(through).cwiseProduct(to.radiance) * (share / to.density);
  });
}

/// Goes on in a direction that the surface chooses. Its light has been added.
template <class Scatter>
bool Integrator::scatters(Path& path, const Spot& spot, const Scatter& scatter, Work& work) const {
  const Scattered s = scatter.sample(work.points.point(work.sample, path.dimension + 1), work.points.point(work.sample, path.dimension + 2).y);
  if (!(s.weight.maxCoeff() > 0)) return false;
  path.weight = path.weight.cwiseProduct(s.weight);
  if (!survives(path, work.points.point(work.sample, path.dimension + 2).x)) return false;
  path.dimension += kDimensionsAtSurface;
  const Vec3f direction = spot.frame.world(s.direction).normalized();
  const float height = direction.dot(spot.geometric);
  if ((height > 0) != (s.direction.z() > 0)) return false;
  path.density = s.density;
  path.go(spot.point + std::copysign(scene_.offset(spot.point), height) * spot.geometric, direction);
  return true;
}

}  // namespace render::trace
