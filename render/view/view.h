#pragma once
// The camera with every choice made: what the shot says, and the default view of the domain for the rest. Both renderers use it.
#include "render/render.h"

namespace render::view {

/// A pinhole at `position`. right, up and forward are orthonormal; a point p is at image coordinates
/// x = p.right / p.forward / tan_x and y = p.up / p.forward / tan_y, both within [-1, 1] inside the picture.
struct View {
  base::Vec3 position, right, up, forward;
  double tan_x = 1, tan_y = 1;  // tangents of half the fields of view
};

View resolve(const Camera&, const base::Box& domain, std::int64_t width, std::int64_t height);

}  // namespace render::view
