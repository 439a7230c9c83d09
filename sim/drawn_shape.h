#pragma once
// What there is to be seen of a collider.
#include "sim/scene.h"

namespace sim {

/// The collider's shape at a time [s], in world metres. A box that stood on a wall of the domain at t = 0 and has moved off it goes on to that wall,
/// as it does for the liquid (docs/shot.md).
Shape drawn_shape_at(double time, const Collider&, const Options&);

}  // namespace sim
