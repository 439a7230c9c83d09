#pragma once
// How surfaces scatter. Directions are unit vectors away from the surface in a frame whose z is the normal, on the side that is looked
// from. Values include the cosine of the incident direction; densities are per solid angle. A smooth reflection has no value and
// density 0: only sample() finds it. Every value obeys Helmholtz reciprocity, and a white surface returns all light.
#include "render/sampling/sampler.h"
#include "render/trace/material.h"

namespace render::trace {

struct Scattered {
  Vec3f direction = Vec3f::UnitZ();
  Vec3f weight = Vec3f::Zero();  // value / density; 0: absorbed
  float density = 0;             // [1/sr]; 0: smooth
};

/// Conductor: facets that are mirrors of tinted reflectance [Kutz21], and the light that meets several of them.
/// Coated: a dielectric coat, and below it a diffuse body whose light the coat partly throws back into it. Translucent: what of that
/// comes out of the body, with the colour the walk in it gave; without the coat's own reflection.
class Reflector {
 public:
  /// `color` stands in place of the material's.
  Reflector(const Material& material, const Vec3f& color, const Vec3f& out);
  Vec3f value(const Vec3f& in) const;
  float density(const Vec3f& in) const;
  Scattered sample(sampling::Point u, float choice) const;

 private:
  Vec3f facets(const Vec3f& in) const;
  Vec3f body(const Vec3f& in) const;
  Vec3f reflectance(float cosine) const;
  const Material& material_;
  Vec3f color_, out_;
  float facet_share_;  // of samples
};

/// Share of light that a coat reflects towards `cosine`.
float coat_share(const Material&, float cosine);

/// The tables of a rough dielectric boundary for light that comes from either side.
struct RoughBoundary {
  float alpha, eta;         // eta = n_t / n_i for light that comes from the first side
  Albedo first, second;
};
RoughBoundary make_rough_boundary(float alpha, float eta);

/// A rough boundary between two dielectrics [Walter07] and light that meets several facets. Values are for radiance: what is transmitted
/// has been divided by eta^2.
class RoughDielectric {
 public:
  /// `back`: light comes from the second side of the boundary.
  RoughDielectric(const RoughBoundary& boundary, bool back, const Vec3f& out);
  Vec3f value(const Vec3f& in) const { return Vec3f::Constant(share(in)); }
  float density(const Vec3f& in) const;
  Scattered sample(sampling::Point u, float choice) const;

 private:
  float share(const Vec3f& in) const;
  const Albedo &here_, &there_;
  float alpha_, eta_;
  Vec3f out_;
  float lost_;       // 1 - albedo of single scattering: what meets several facets
  float reflected_;  // of that
};

}  // namespace render::trace
