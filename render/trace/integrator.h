#pragma once
// Light that arrives along a camera ray: unidirectional path tracing with next-event estimation.
//  - Surfaces that scatter (all but smooth mirrors and boundaries) and points of a scattering medium sample each light, and the direction in
//    which they go on; the two are combined by the power heuristic. The gradient sky is found by the latter alone.
//  - The first smooth dielectric that the camera sees is followed both ways (reflection and refraction), later ones at random by Fresnel.
//  - caustics = "straight": shadow rays go straight through dielectrics, tinted. What comes straight through has then been counted, so a light that
//    is found by mirrors and dielectrics after a surface that scatters is not added again; by reflection it had not been, and is left out. The
//    sky is always found by both.
//  - caustics = "none": shadow rays stop at dielectrics, and that light is left out all the same.
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
  bool is_held = false;            // drawn where it is at the frame's moment, all the time
  int id = 0;                      // 0 nothing, 1 the ground, 2 + number of a surface
  Vec3f guide_albedo = Vec3f::Zero(), guide_normal = Vec3f::Zero();  // what scatters first, as mirrors and dielectrics before it show it
};

class Integrator {
 public:
  Integrator(const Scene& scene, const Geometry& geometry) : scene_(scene), geometry_(geometry) {}

  /// The dielectrics that hold a point: what a camera under water is in.
  Media media_at(const Vec3f& point, float time) const;
  /// Radiance of one sample; `around` the camera. Dimensions from 1 of `points` are used.
  Vec3f radiance(const Ray& camera, Media around, const sampling::PixelSampler& points, std::uint32_t sample, FirstHit& first) const;

 private:
  struct Path {
    Ray ray;
    Vec3f weight = Vec3f::Ones();
    Media media = {};
    int surfaces = 0;            // met so far
    Vec3f from = Vec3f::Zero();  // where it last turned, or the camera: of there is `density`
    float flown = 0;             // [m] since then, to the last boundary that bends no light
    int flights = 0;             // steps so far: boundaries that are hidden and points in a medium count too
    int scattered = 0;           // surfaces that scatter, and points in a medium
    float density = 0;           // [1/sr] of the direction; 0 where it was not drawn from a density (camera, smooth)
    bool guided = false;         // the first thing that scatters has been met
    bool counted = false;        // the last surface that scatters has sampled the lights behind what came since
    float compression = 1;       // n^2 factors in weight
    std::uint32_t dimension = 1;
    /// Whether nothing has turned it since the camera.
    bool is_straight() const { return surfaces == 0 && scattered == 0; }
    void go(const Vec3f& origin, const Vec3f& direction) {
      ray.origin = from = origin;
      ray.direction = direction;
      flown = 0;
    }
  };
  struct Work;  // one sample: result, points, branches waiting
  struct Spot;  // where a path scatters

  bool step(Path&, Work&) const;
  bool flies_through(Path&, const Material&, float t, Work&) const;
  void add_lights(const Path&, float t, Work&) const;
  void add_background(const Path&, float share, Work&) const;
  bool meets_ground(Path&, const Ground::Met&, Work&) const;
  bool meets_surface(Path&, const Hit&, Work&) const;
  bool meets_opaque(Path&, const Spot&, const Material&, const Vec3f& color, Work&) const;
  bool meets_translucent(Path&, const Spot&, const Material&, const Vec3f& tint, int surface, Work&) const;
  bool meets_dielectric(Path&, const Vec3f& point, const Hit&, Work&) const;
  bool meets_rough_dielectric(Path&, const Spot&, const Boundary&, float alpha, float eta, Work&) const;
  bool walks(Path&, Spot&, const Material&, const Vec3f& tint, int surface, Work&) const;
  template <class Scatter>
  void light(const Path&, const Spot&, const Scatter&, bool dielectric, Work&) const;
  template <class Scatter>
  bool scatters(Path&, const Spot&, const Scatter&, Work&) const;
  Vec3f shadow(Media, const Ray&, float distance, bool straight, bool& crossed) const;
  bool survives(Path&, float choice) const;
  void guide(Path&, const Vec3f& albedo, const Vec3f& normal, Work&) const;
  void absorb(Path&, float length) const;

  const Scene& scene_;
  const Geometry& geometry_;
};

}  // namespace render::trace
