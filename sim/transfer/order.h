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

/// Rows of so few numbers are moved by a sort.
bool has_short_rows(std::size_t row);
/// Bytes that sorting holds for a particle whose row has `row` numbers of `real` bytes: what the plan says of CanonicalOrder::bytes().
std::int64_t sort_bytes(std::int64_t dimension, std::int64_t real, std::int64_t row);

/// Sorts particles into canonical order. Holds the buffers between calls: fresh pages cost more than the sort.
template <int D, class Real>
class CanonicalOrder {
 public:
  /// Every cell must lie inside the domain. Rows of coefficients stay where they are, unless they are short: Particles::rows says where.
  CellRanges sort(Particles<D, Real>&, const Lattice<D>&, Home home = Home::cell);
  /// Moves what else there is a row of a particle as the last sort moved the particles.
  template <class T>
  void move_along(std::vector<T>& column, std::vector<T>& buffer, std::size_t row = 1) const;
  /// Held for these particles between calls, beside themselves: sort_bytes() for each.
  std::int64_t bytes(const Particles<D, Real>&) const;

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
