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

/// Sorts particles into canonical order. Holds the buffers between calls: fresh pages cost more than the sort.
template <int D, class Real>
class CanonicalOrder {
 public:
  /// Every cell must lie inside the domain.
  CellRanges sort(Particles<D, Real>&, const Lattice<D>&);

 private:
  std::vector<std::uint32_t> key_, from_, next_;
  Particles<D, Real> sorted_;
};

}  // namespace sim
