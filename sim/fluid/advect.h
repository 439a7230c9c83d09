#pragma once
// Particles move with the projected grid velocity; walls and colliders keep them out.
#include "sim/colliders/solids.h"
#include "sim/transfer/mac_transfer.h"

namespace sim {

/// Explicit midpoint (RK2) over dt [s]: x += dt v(x + dt/2 v(x)). Cells stay inside the domain's ring of faces; push_out settles the rest.
template <int D, class Real>
void advect(const MacTransfer<D, Real>&, const FaceField<D, Real>& velocity, double dt, const Solids<D>&, Particles<D, Real>&);

/// Moves every particle out of walls and colliders; returns how many had to be. Coefficients stay as they are.
template <int D, class Real>
std::int64_t push_out(const Solids<D>&, Particles<D, Real>&);

}  // namespace sim
