#pragma once
// Canonical order: block, cell in the block, id. Sums over particles in this order do not depend on how they came to be stored,
// on threads or on restarts.
#include <cstddef>
#include <vector>

#include "sim/transfer/blocks.h"
#include "sim/transfer/particles.h"

namespace sim {

/// Sorts particles into canonical order. Holds the buffers between calls: fresh pages cost more than the sort.
template <int D, class Real>
class CanonicalOrder {
 public:
  /// Every cell must lie inside the domain.
  CellRanges sort(Particles<D, Real>&, const Lattice<D>&);

 private:
  std::vector<std::int64_t> key_;                      // of each particle's block
  std::vector<std::uint32_t> cell_, from_, next_;      // of each particle: its cell among those of the occupied blocks
  KeyTable table_;
  Particles<D, Real> sorted_;
};

}  // namespace sim
