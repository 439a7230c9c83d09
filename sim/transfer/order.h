#pragma once
// Canonical order: block, cell in the block, id; for transfers to nodes the nearest node in place of the cell. Sums over particles in this
// order do not depend on how they came to be stored, on threads or on restarts.
#include <algorithm>
#include <array>
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
  static constexpr std::size_t kParts = 4;   // of the particles, that are counted on their own; the order does not depend on it

  /// Gives every particle its cell in `cell_`, numbered by `keys_` (keys of blocks, in no order) and the cell in the block, and counts them.
  void find_cells(const Particles<D, Real>&, const Lattice<D>&, Home);
  /// counts_ become places in the order: where each part's particles of a cell begin.
  CellRanges add_up(Home);

  std::vector<std::int64_t> keys_;                      // of blocks that particles were in at the last sort, ascending; then of new ones
  KeyTable table_;                                      // of those of the last sort
  std::vector<std::uint32_t> cell_;                     // of each particle
  std::vector<std::uint32_t> from_;                     // of each place in the order, who comes there; a vector's worth more
  std::array<std::vector<std::uint32_t>, kParts> counts_;   // of each cell
  Particles<D, Real> sorted_;
};

template <int D, class Real>
template <class T>
void CanonicalOrder<D, Real>::move_along(std::vector<T>& column, std::vector<T>& buffer, std::size_t row) const {
  buffer.resize(column.size());
  base::parallel_chunks(cell_.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) std::copy_n(&column[from_[p] * row], row, &buffer[p * row]);
  });
  column.swap(buffer);
}

}  // namespace sim
