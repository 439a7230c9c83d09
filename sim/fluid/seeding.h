#pragma once
// Particles of a liquid at t = 0, where sim/seeding.h says, moved out of the skin of walls and colliders.
#include "sim/colliders/solids.h"
#include "sim/scene.h"
#include "sim/transfer/particles.h"

namespace sim {

/// Ids count from 0 in cell order. Coefficients: the body's velocity in mode 0.
template <int D, class Real>
Particles<D, Real> seed_particles(const Scene&, const Lattice<D>&, const Solids<D>&, int modes);

}  // namespace sim
