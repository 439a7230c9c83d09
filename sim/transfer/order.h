#pragma once
// Canonical order: block, cell in the block, id. Sums over particles in this order do not depend on how they came to be stored,
// on threads or on restarts.
#include <cstddef>
#include <vector>

#include "sim/transfer/particles.h"

namespace sim {

/// Where the particles of each cell and block begin, once they are in canonical order.
struct CellRanges {
  std::vector<std::uint32_t> begin;          // by canonical key; one more entry at the end
  std::vector<std::uint32_t> occupied;       // blocks that hold particles, ascending
};

/// Sorts the particles into canonical order. Every cell must lie inside the domain.
template <int D, class Real>
CellRanges sort_canonically(Particles<D, Real>&, const Lattice<D>&);

}  // namespace sim
