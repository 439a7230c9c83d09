#pragma once
// All that a ray can meet or be lit by, with every choice of the shot made.
#include <algorithm>
#include <vector>

#include "render/render.h"
#include "render/trace/geometry.h"

namespace render::trace {

/// A rectangle that shines to the side its normal points to. It blocks nothing: the sky behind it adds to its light, and a ray that
/// finds one instead of the other makes no noise.
struct AreaLight {
  Vec3f middle, u, v;  // [m] half sides, orthogonal
  Vec3f normal;        // unit
  Vec3f radiance;
  float area;          // [m^2]
};

/// From the horizon's colour to the zenith's, level at both ends so that no line is seen; below the horizon, the horizon's.
struct Sky {
  Vec3f zenith = Vec3f::Zero(), horizon = Vec3f::Zero();
  Vec3f radiance(const Vec3f& direction) const {
    const float height = std::clamp(direction.z(), 0.0f, 1.0f);
    return horizon + height * height * (3 - 2 * height) * (zenith - horizon);
  }
};

/// The domain's floor, without end. Away from the domain it turns into the sky's horizon, so that no edge is seen.
struct Ground {
  Material material;
  float z;                      // [m]
  Eigen::Vector2f middle;       // [m]
  float solid_to, gone_from;    // [m] distances from the middle between which it fades
  float fade(const Vec3f& point) const {
    const float r = (point.head<2>() - middle).norm(), s = std::clamp((r - solid_to) / (gone_from - solid_to), 0.0f, 1.0f);
    return s * s * (3 - 2 * s);
  }
};

struct Scene {
  std::vector<Surface> surfaces;  // 0: the liquid
  std::vector<AreaLight> lights;
  Sky sky;
  Ground ground;
  int bounces;
  bool straight;                  // shadow rays go straight through dielectrics
  float offset;                   // [m] from a surface to the start of a ray that leaves it
};

/// Throws base::Error (exit 2) when a look that is named is not there.
Scene make_scene(const Setting&);

}  // namespace render::trace
