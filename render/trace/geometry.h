#pragma once
// Everything that rays meet except the ground, in a bounding volume hierarchy: the liquid, solid bodies and colliders. Metres, world.
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "base/vec.h"
#include "render/files/mesh.h"
#include "render/render.h"
#include "render/trace/material.h"
#include "sim/scene.h"
#include "surface/surface.h"

namespace render::trace {

struct Ray {
  Vec3f origin, direction;  // unit direction
  float time = 0.5f;        // [1] from 0, when the shutter opens, to 1, when it closes; every ray of a path has that of its camera ray
};

/// How the grains of a body differ from balls of its material.
struct GrainStyle {
  float size = 1;       // [1] in radii of the cloud
  float variation = 0;  // [1] of brightness, to each side
};

/// Surfaces are numbered: the liquid, or solids with one surface around them, is 0, collider i is i + 1, then come the pieces of the set and the
/// bodies, each as grains or as a mesh of its own; the last of the bodies stands for all beyond it.
struct Surface {
  Material material;
  bool is_body = false;
  bool flows = false;                   // of a body: a liquid
  std::vector<sim::Shape> shapes = {};  // of a collider: boxes, spheres or meshes, with its images across periodic sides
  sim::RigidMotion motion = {};         // of a collider, which is drawn where it is at the frame's moment
  std::optional<GrainStyle> grains = {};
  std::shared_ptr<const files::Triangles> mesh = {};  // [m] of a set piece, or of `shapes` that are meshes
};

struct Hit {
  float t;           // [m] along the ray
  Vec3f geometric;   // unit normals that point out of the surface
  Vec3f shading;
  int surface;
  Vec3f tint = Vec3f::Ones();       // of the material's colour: a grain's own shade
  std::uint32_t primitive = 0;      // quad or grain of the surface, and where on it
  float u = 0, v = 0;
};

/// For how long a frame is exposed. Things go straight on at their velocity meanwhile.
struct Exposure {
  float half = 0;        // [s] from the shutter's opening to the frame's moment, and from there to its closing
  base::Box walls = {};  // [m] what lies on one of these glides along it, and nothing passes through; empty: none

  /// Where a point is `later` [s] than the frame's moment.
  Vec3f moved(const Vec3f& point, const Vec3f& velocity, float later) const;
};

/// Dielectric surfaces that a straight ray goes through, in any order.
struct Crossings {
  static constexpr int kMost = 32;
  struct One {
    float t, cosine;  // [m], of the ray to the outward normal: below 0 it enters
    int surface;
  };
  std::array<One, kMost> list;
  int count = 0;
};

class Geometry {
 public:
  Geometry(const std::vector<Surface>&, int threads);
  ~Geometry();

  /// Replaces the liquid and the grains (which must outlive all queries) and builds the hierarchy. Its order decides which of two
  /// quads wins at their common edge, and follows from the number of slots for building threads: one for a mesh alone, a fixed
  /// number with grains, however many threads there are to fill them.
  void set_frame(const surface::Mesh&, const Grains&, const Exposure&);
  /// The same with a mesh a body.
  void set_bodies(const std::vector<surface::Mesh>&, const Grains&, const Exposure&);

  /// Nearest hit before `far`. `primary`: neighbouring calls have similar rays.
  bool intersect(const Ray&, float far, bool primary, Hit&) const;
  /// As if dielectrics did not bend light. False when something opaque is in the way, or more surfaces than are counted.
  bool straight(const Ray&, float far, Crossings&) const;
  /// [m/s] of what was hit, at the place [m] where it was hit.
  Vec3f velocity(const Hit&, const Vec3f& place) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace render::trace
