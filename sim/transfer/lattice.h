#pragma once
// The domain as a lattice of cells. One index space serves cells, the faces of all axes and nodes: cell (i, j, k) is at the middle of
// [i, i+1) x ..., face (i, j, k) of axis a at the lower side of that cell, node (i, j, k) at its lower corner. Places are grouped into
// blocks of kBlock cells an axis; blocks.h stores fields on those that are active. Nothing here grows with the domain.
#include <array>
#include <cstddef>
#include <cstdint>

namespace sim {

template <int D>
using Cell = std::array<int, D>;

template <int D>
struct Lattice {
  static constexpr int kBlock = 4;           // cells along an edge of a block, the unit of storage, of scatter and of the canonical order
  static constexpr int kCellsPerBlock = D == 2 ? kBlock * kBlock : kBlock * kBlock * kBlock;
  static constexpr int kBefore = 1, kBehind = 2;   // places beyond a wall that a stencil of a particle inside may reach
  using Key = std::int64_t;                  // of blocks and cells: holds any domain of up to 1e17 cells, 1e9 along an axis

  Cell<D> cells{};                           // of the domain
  std::array<bool, D> periodic{};            // axes whose lower and upper side are one
  bool any_periodic = false;
  Cell<D> blocks{};                          // that hold the cells of the domain; the last one along an axis may be cut

  Lattice() = default;
  explicit Lattice(const Cell<D>& domain_cells, const std::array<bool, D>& periodic_axes = {}) : cells(domain_cells), periodic(periodic_axes) {
    for (int a = 0; a < D; ++a) {
      blocks[a] = (cells[a] + kBlock - 1) / kBlock, any_periodic = any_periodic || periodic[a];
      lowest_[a] = periodic[a] ? 0 : -1;
      highest_[a] = periodic[a] ? blocks[a] - 1 : (cells[a] + kBehind) / kBlock;
    }
  }
  /// The cell inside the domain that `at` is an image of, on periodic axes.
  Cell<D> wrapped(Cell<D> at) const {
    if (!any_periodic) return at;
    for (int a = 0; a < D; ++a)
      if (periodic[a] && (at[a] < 0 || at[a] >= cells[a])) at[a] = (at[a] % cells[a] + cells[a]) % cells[a];
    return at;
  }
  bool inside(const Cell<D>& at) const {
    for (int a = 0; a < D; ++a)
      if (at[a] < 0 || at[a] >= cells[a]) return false;
    return true;
  }
  /// Blocks along an axis that can hold places: the domain's and, beyond walls, those that stencils reach.
  int lowest_block(int axis) const { return lowest_[axis]; }
  int highest_block(int axis) const { return highest_[axis]; }

  static Cell<D> block_of(const Cell<D>& at) {
    Cell<D> block;
    for (int a = 0; a < D; ++a) block[a] = at[a] >> 2;   // rounds down below 0 too
    return block;
  }
  static int local_of(const Cell<D>& at) {
    int local = 0;
    for (int a = 0; a < D; ++a) local = local * kBlock + (at[a] & (kBlock - 1));
    return local;
  }
  /// Row-major over blocks from lowest to highest.
  Key block_key(const Cell<D>& block) const {
    Key key = 0;
    for (int a = 0; a < D; ++a) key = key * (highest_block(a) + 2) + (block[a] + 1);
    return key;
  }
  Cell<D> block_at(Key key) const {
    Cell<D> at;
    for (int a = D - 1; a >= 0; --a) {
      const Key extent = highest_block(a) + 2;
      at[a] = int(key % extent) - 1;
      key /= extent;
    }
    return at;
  }
  /// Canonical key of a cell: block first, then the cell in the block.
  Key key(const Cell<D>& at) const { return block_key(block_of(at)) * kCellsPerBlock + local_of(at); }
  Cell<D> cell_of_key(Key key) const { return cell_in(block_at(key / kCellsPerBlock), int(key % kCellsPerBlock)); }
  static Cell<D> cell_in(Cell<D> block, int local) {
    for (int a = D - 1; a >= 0; --a) {
      block[a] = block[a] * kBlock + local % kBlock;
      local /= kBlock;
    }
    return block;
  }
  /// The colour of a block, below kColours: blocks of one colour reach no common node, with stencils from one node before their cells to two
  /// behind. Two colours an axis are enough, unless the axis is periodic and its blocks do not alternate all around: then the last two have
  /// colours of their own.
  static constexpr std::size_t kColours = D == 2 ? 16 : 64;
  std::size_t colour(const Cell<D>& block) const {
    std::size_t colour = 0;
    for (int a = D - 1; a >= 0; --a) {
      const bool alternates = !periodic[a] || cells[a] % (2 * kBlock) == 0;
      const int from_end = blocks[a] - 1 - block[a];
      colour = colour * 4 + std::size_t(alternates || from_end > 1 ? block[a] % 2 : 3 - from_end);
    }
    return colour;
  }

 private:
  Cell<D> lowest_{}, highest_{};
};

}  // namespace sim
