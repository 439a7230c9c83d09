#pragma once
// Particles at t = 0: every cell is cut into particles_per_cell equal boxes with one particle each, kept where a body is and no collider,
// and moved out of the skin of walls and colliders.
#include "sim/colliders/solids.h"
#include "sim/scene.h"
#include "sim/transfer/particles.h"

namespace sim {

/// Ids count from 0 in cell order. The first body that holds a place owns it. Coefficients: the body's velocity in mode 0.
template <int D, class Real>
Particles<D, Real> seed_particles(const Scene&, const Lattice<D>&, const Solids<D>&, int modes);

}  // namespace sim
