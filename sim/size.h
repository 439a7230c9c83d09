#pragma once
// How large a scene will be, before anything of it is allocated.
#include "sim/scene.h"

namespace sim {

struct Size {
  double particles = 0;   // expected: the seeding's boxes whose middles lie in a body and in no collider
  double cells = 0;       // of the domain
};

/// Looks at most at some millions of places: of a larger scene at a coarser pattern, which is off by a share of a body's surface.
Size size_of(const Scene&);

}  // namespace sim
