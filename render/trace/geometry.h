#pragma once
// Everything that rays meet except the ground, in a bounding volume hierarchy: the liquid and the solid colliders. Metres, world.
#include <memory>
#include <vector>

#include "base/vec.h"
#include "sim/scene.h"
#include "surface/surface.h"

namespace render::trace {

using base::Vec3f;

struct Ray {
  Vec3f origin, direction;  // unit direction
};

/// A look as rays use it.
struct Material {
  bool dielectric = false;
  Vec3f color = Vec3f::Zero();       // diffuse albedo
  float ior = 1;                     // dielectric
  Vec3f absorption = Vec3f::Zero();  // [1/m] dielectric
};

/// Surfaces are numbered: the liquid is 0, collider i is i + 1.
struct Surface {
  Material material;
  sim::Shape shape = {};  // not of the liquid
};

struct Hit {
  float t;           // [m] along the ray
  Vec3f geometric;   // unit normals that point out of the surface
  Vec3f shading;
  int surface;
};

/// What a straight ray through dielectrics lets through.
struct Passage {
  Vec3f transmittance = Vec3f::Ones();  // 0 when something opaque is in the way
  int crossings = 0;
};

class Geometry {
 public:
  Geometry(const std::vector<Surface>&, int threads);
  ~Geometry();

  /// Replaces the liquid and builds the hierarchy, always by one thread: so its order, and with it which of two quads wins at their
  /// common edge, does not depend on the number of threads.
  void set_liquid(const surface::Mesh&);

  /// Nearest hit before `far`. `primary`: neighbouring calls have similar rays.
  bool intersect(const Ray&, float far, bool primary, Hit&) const;
  bool occluded(const Ray&, float far) const;
  /// As if dielectrics did not bend light: each crossing costs its Fresnel reflection, each length inside its absorption.
  Passage straight(const Ray&, float far) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render::trace
