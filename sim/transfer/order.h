#pragma once
// Canonical order: block, cell in the block, id; for transfers to nodes the nearest node in place of the cell. Sums over particles in this
// order do not depend on how they came to be stored, on threads or on restarts.
#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/parallel.h"
#include "sim/transfer/blocks.h"
#include "sim/transfer/particles.h"

namespace sim {

/// Sorts particles into canonical order. Holds the buffers between calls: fresh pages cost more than the sort.
template <int D, class Real>
class CanonicalOrder {
 public:
  /// Every cell must lie inside the domain. Rows of coefficients stay where they are, unless they are short: Particles::rows says where.
  CellRanges sort(Particles<D, Real>&, const Lattice<D>&, Home home = Home::cell);
  /// Moves what else there is a row of a particle as the last sort moved the particles.
  template <class T>
  void move_along(std::vector<T>& column, std::vector<T>& buffer, std::size_t row = 1) const;

 private:
  std::vector<std::int64_t> key_;            // of each particle's cell
  std::vector<std::uint32_t> cell_;          // of each particle, its cell among those of the occupied blocks
  std::vector<std::uint32_t> from_;          // of each place in the order, who comes there
  std::vector<std::uint32_t> counts_;        // of each part and cell
  KeyTable table_;
  Particles<D, Real> sorted_;
};

template <int D, class Real>
template <class T>
void CanonicalOrder<D, Real>::move_along(std::vector<T>& column, std::vector<T>& buffer, std::size_t row) const {
  buffer.resize(column.size());
  base::parallel_chunks(from_.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) std::copy_n(&column[from_[p] * row], row, &buffer[p * row]);
  });
  column.swap(buffer);
}

}  // namespace sim
