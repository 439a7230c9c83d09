#pragma once
// The sum of the scene's gravity effects [m/s^2]; zero when it names none.
#include "sim/scene.h"

namespace sim {

inline base::Vec3 gravity(const Scene& scene) {
  base::Vec3 g = base::Vec3::Zero();
  for (const Effect& effect : scene.effects)
    if (effect.kind == "gravity") g += effect.acceleration;
  return g;
}

}  // namespace sim
