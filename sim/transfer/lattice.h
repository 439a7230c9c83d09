#pragma once
// The dense background grid. One index space serves cells and the faces of all axes: cell (i, j, k) is at the middle of
// [i, i+1) x ..., face (i, j, k) of axis a at the lower side of that cell. A ring of kPad cells lies around the domain, so that no
// stencil of a particle inside the domain leaves the arrays.
#include <array>
#include <cstddef>

namespace sim {

template <int D>
using Cell = std::array<int, D>;

template <int D>
struct Lattice {
  static constexpr int kPad = 3;
  static constexpr int kBlock = 4;           // cells along an edge of a block, the unit of scatter and of the canonical order
  Cell<D> cells{};                           // of the domain
  std::array<std::ptrdiff_t, D> extent{};    // of the arrays: cells + ring + one more face
  std::array<std::ptrdiff_t, D> stride{};
  std::array<bool, D> periodic{};            // axes whose lower and upper side are one
  std::size_t size = 0;
  Cell<D> blocks{};
  std::size_t block_count = 1;

  Lattice() = default;
  explicit Lattice(const Cell<D>& domain_cells, const std::array<bool, D>& periodic_axes = {}) : cells(domain_cells), periodic(periodic_axes) {
    size = 1;
    for (int a = D - 1; a >= 0; --a) {
      extent[a] = cells[a] + 2 * kPad + 1;
      stride[a] = std::ptrdiff_t(size);
      size *= std::size_t(extent[a]);
      blocks[a] = (cells[a] + kBlock - 1) / kBlock;
      block_count *= std::size_t(blocks[a]);
    }
  }
  std::ptrdiff_t index(const Cell<D>& at) const {
    std::ptrdiff_t i = 0;
    for (int a = 0; a < D; ++a) i += (at[a] + kPad) * stride[a];
    return i;
  }
  Cell<D> cell_at(std::ptrdiff_t index) const {
    Cell<D> at;
    for (int a = 0; a < D; ++a) at[a] = int(index / stride[a] % extent[a]) - kPad;
    return at;
  }
  /// The cell inside the domain that `at` is an image of, on periodic axes.
  Cell<D> wrapped(Cell<D> at) const {
    for (int a = 0; a < D; ++a)
      if (periodic[a]) at[a] = (at[a] % cells[a] + cells[a]) % cells[a];
    return at;
  }
  bool inside(const Cell<D>& at) const {
    for (int a = 0; a < D; ++a)
      if (at[a] < 0 || at[a] >= cells[a]) return false;
    return true;
  }
  static constexpr std::size_t kCellsPerBlock = [] {
    std::size_t n = 1;
    for (int a = 0; a < D; ++a) n *= kBlock;
    return n;
  }();
  /// Canonical key of a cell: block first, then the cell in the block.
  std::size_t key(const Cell<D>& at) const {
    std::size_t block = 0, local = 0;
    for (int a = 0; a < D; ++a) {
      block = block * std::size_t(blocks[a]) + std::size_t(at[a] / kBlock);
      local = local * kBlock + std::size_t(at[a] % kBlock);
    }
    return block * kCellsPerBlock + local;
  }
  /// Coordinates of a block, in blocks.
  Cell<D> block_at(std::size_t block) const {
    Cell<D> at;
    for (int a = D - 1; a >= 0; --a) {
      at[a] = int(block % std::size_t(blocks[a]));
      block /= std::size_t(blocks[a]);
    }
    return at;
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
  /// The cell of a key.
  Cell<D> cell_of_key(std::size_t key) const {
    Cell<D> at = block_at(key / kCellsPerBlock);
    std::size_t local = key % kCellsPerBlock;
    for (int a = D - 1; a >= 0; --a) {
      at[a] = at[a] * kBlock + int(local % kBlock);
      local /= kBlock;
    }
    return at;
  }
  std::size_t key_count() const { return block_count * kCellsPerBlock; }
};

}  // namespace sim
