#pragma once
// Light that arrives along a camera ray: unidirectional path tracing with next-event estimation.
//  - A diffuse surface samples each area light and, by cosine, its hemisphere; the two are combined by the power heuristic. The sky
//    is found by the hemisphere samples.
//  - The first dielectric that the camera sees is followed both ways (reflection and refraction), later ones at random by Fresnel.
//  - caustics = "straight": shadow rays go straight through dielectrics, tinted. Their light has then been counted, so an area light
//    that is found behind a dielectric after a diffuse surface is not added again. The sky is always found by refracted rays.
//  - A path that is still among dielectrics after `bounces` surfaces (a thin sheet leads light like a fibre) ends in the sky, as it
//    would have: biased, but not black.
//  - Radiance is divided by n^2 on its way into a medium and multiplied on its way out, so that a white furnace stays white.
#include "render/sampling/sampler.h"
#include "render/trace/scene.h"

namespace render::trace {

/// What the camera ray meets first.
struct FirstHit {
  bool found = false;
  float t = 0;                     // [m]
  Vec3f albedo = Vec3f::Zero();    // 1 of a dielectric
  Vec3f normal = Vec3f::Zero();    // shading normal, world
  Vec3f velocity = Vec3f::Zero();  // [m/s]
  int id = 0;                      // 0 nothing, 1 the ground, 2 + number of a surface
};

class Integrator {
 public:
  Integrator(const Scene& scene, const Geometry& geometry) : scene_(scene), geometry_(geometry) {}

  /// Radiance of one sample; dimensions from 1 of `points` are used.
  Vec3f radiance(const Ray& camera, const sampling::PixelSampler& points, std::uint32_t sample, FirstHit& first) const;

 private:
  /// What a ray flies through. A solid has precedence over the liquid that it displaces.
  struct Medium {
    bool liquid = false;
    int solid = -1;  // number of a dielectric surface, or -1
  };
  struct Path {
    Ray ray;
    Vec3f weight = Vec3f::Ones();
    Medium medium = {};
    int surfaces = 0;            // met so far
    int scattered = 0;           // of these, diffuse
    float density = 0;           // [1/sr] of the direction; 0 where it was not drawn from a density (camera, dielectric)
    float compression = 1;       // n^2 factors in weight
    std::uint32_t dimension = 1;
  };
  struct Work;  // one sample: result, points, branches waiting

  bool step(Path&, Work&) const;
  void pass_lights(const Path&, float t, Work&) const;
  bool meets_ground(Path&, float t, Work&) const;
  bool meets_surface(Path&, const Hit&, Work&) const;
  bool meets_diffuse(Path&, const Vec3f& point, const Vec3f& geometric, const Vec3f& shading, const Vec3f& color, Work&) const;
  bool meets_dielectric(Path&, const Vec3f& point, const Hit&, Work&) const;
  Vec3f direct(const AreaLight&, const Vec3f& from, const Vec3f& normal, float time, sampling::Point) const;
  const Material* material_in(const Medium& m) const;
  void absorb(Path&, float length) const;

  const Scene& scene_;
  const Geometry& geometry_;
};

}  // namespace render::trace
