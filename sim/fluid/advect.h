#pragma once
// Particles move with the projected grid velocity; walls and colliders keep them out.
#include "sim/colliders/solids.h"
#include "sim/transfer/mac_transfer.h"

namespace sim {

/// Explicit motion over dt [s] in a field that stands still: the midpoint rule, x += dt v(x + dt/2 v(x)), or three stages of third order
/// [Ralston62]. Who leaves through a periodic side comes in at the other; who leaves through a wall is push_out's. Particles whose order
/// `ranges` still is, though some may have moved since, go a block at a time; with empty ranges they may lie in any. Returns the longest way of a
/// particle [cells].
template <int D, class Real>
double advect(const MacTransfer<D, Real>&, const ActiveBlocks<D>&, const FaceField<D, Real>& velocity, double dt, Advection, const Solids<D>&,
            const CellRanges& ranges, Particles<D, Real>&);

/// What a displacement did to some particles: the sum of their ways [cells], and what their kinetic energies gained, per mass [m^2/s^2].
template <int D>
struct Shift {
  Vec<D, double> by = Vec<D, double>::Zero();
  double kinetic = 0;
};

/// Moves the particles of a block, number `block` of those occupied, by a displacement [cells] that is no motion: velocities become the polynomials'
/// at the new places, c_1 += C . shift.
template <int D, class Real>
Shift<D> shift(const MacTransfer<D, Real>&, const ActiveBlocks<D>&, const FaceField<D, Real>& displacement, const Solids<D>&,
           const CellRanges& ranges, std::size_t block, Particles<D, Real>&);

struct Contacts {
  std::int64_t pushed_out = 0;      // particles that had to be moved
  std::int64_t dropped_modes = 0;   // those moved by more than a quarter cell, whose modes that bend (a g factor) are set to 0
};

/// Moves every particle out of walls and colliders; its constant modes lose what led into them. `modes` are the coefficients'.
template <int D, class Real>
Contacts push_out(const Solids<D>&, const std::vector<ModeIndex<D>>& modes, Particles<D, Real>&);

/// Removes particles that are outside the domain, as they are after an open side, and what `departure` (which may be empty) knows of them.
/// Returns how many. The others keep their order.
template <int D, class Real>
std::int64_t remove_outside(const Lattice<D>&, Particles<D, Real>&, Departure<D, Real>& departure);

}  // namespace sim
