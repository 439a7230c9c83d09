#pragma once
// All that a ray can meet or be lit by, with every choice of the shot made.
#include <algorithm>
#include <vector>

#include "render/render.h"
#include "render/trace/bsdf.h"
#include "render/trace/geometry.h"
#include "render/trace/ground.h"
#include "render/trace/lights.h"
#include "render/trace/media.h"

namespace render::trace {

/// Light through dielectrics, after a surface that scatters.
enum class Caustics {
  straight,  // shadow rays go straight through, tinted
  path,      // found by chance
  none       // left out: dielectrics cast full shadows, but for the sky
};

/// Which samples count: those drawn towards lights, those drawn as surfaces scatter, or both by the power heuristic. Pictures use both.
enum class Strategy { both, lights, scattering };

struct Scene {
  std::vector<Surface> surfaces;  // 0: the liquid
  std::vector<int> rank;          // of each surface among media; -1 where it is no dielectric
  std::vector<int> surface_of;    // of each rank
  std::vector<RoughBoundary> rough;  // of every pair that can meet
  Lights lights;
  Ground ground;
  int bounces = 32;
  Caustics caustics = Caustics::straight;
  Strategy strategy = Strategy::both;
  float least_offset = 0;         // [m]

  /// [m] From a point of a surface to the start of a ray that leaves it.
  float offset(const Vec3f& point) const { return std::max(least_offset, 2e-6f * point.cwiseAbs().maxCoeff()); }
  /// The dielectric that is there, or none: air.
  const Material* medium(Media m) const {
    return m.inside == 0 ? nullptr : &surfaces[static_cast<std::size_t>(surface_of[static_cast<std::size_t>(m.top())])].material;
  }
  float ior(Media m) const {
    const Material* material = medium(m);
    return material ? material->ior : 1;
  }
  /// The boundary from index 1 to eta, which may be stored the other way round (`back`).
  const RoughBoundary& rough_boundary(float alpha, float eta, bool& back) const;
};

/// Throws base::Error (exit 2) when a look that is named is not there, or a picture cannot be read.
Scene make_scene(const Setting&);

}  // namespace render::trace
