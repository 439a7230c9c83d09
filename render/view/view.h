#pragma once
// The camera with every choice made: what the shot says, and the default view of the domain for the rest. Both renderers use it.
#include "render/render.h"

namespace render::view {

/// A lens or pinhole at `position`. right, up and forward are orthonormal; a point p is at image coordinates
/// x = p.right / p.forward / tan_x and y = p.up / p.forward / tan_y, both within [-1, 1] inside the picture.
struct View {
  base::Vec3 position, right, up, forward;
  double tan_x = 1, tan_y = 1;  // tangents of half the fields of view
  double lens = 0;              // [m] radius; 0: a pinhole
  double focus = 1;             // [m] from the lens to the plane that is sharp
};

/// `frame` counts from 1 and may lie between two frames.
View resolve(const Camera&, const base::Box& domain, std::int64_t width, std::int64_t height, double frame = 1);

}  // namespace render::view
