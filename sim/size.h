#pragma once
// How large a scene will be, before anything of it is allocated.
#include <cstdint>
#include <vector>

#include "sim/scene.h"

namespace sim {

struct Size {
  double particles = 0;   // expected: the seeding's boxes whose middles lie in a body and in no collider, and what sources hold at the start
  double cells = 0;       // of the domain
};

/// The largest number of equal parts that every edge of the domain can be cut into so that each part is a whole number of cells.
std::int64_t common_parts(const Options&);

/// Looks at most at some millions of places: of a larger scene at a coarser pattern, which is off by a share of a body's surface.
Size size_of(const Scene&);

/// Particles at a time [s], where none leaves.
double particles_at(double time, const Scene&);

/// [m^3/s] that each source pours while it acts: of whole cells. In two dimensions of a slab one metre deep.
std::vector<double> flows(const Scene&);

/// Steps from one frame to the next while the fastest particle gets from `before` to `after` [m/s]; of solids, in which sound goes as fast as at
/// rest:
/// what is pressed or hardened needs more.
double steps_in_frame(const Scene&, double fps, double before, double after);

}  // namespace sim
