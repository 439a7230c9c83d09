#pragma once
// Sparse grids: fields live on the blocks of a lattice that are active, those around the particles. A field is a plain std::vector of
// ActiveBlocks::size() values at [slot * kCellsPerBlock + place in the block]; slots count the active blocks in ascending canonical key.
// Memory and time follow the particles, not the domain (the layout of SPGrid [Setaluri14], with a table of neighbours instead of pages).
//
// Periodic axes: a place exists once. Index n of such an axis (of n cells) is index 0; index(), neighbour() and the tiles wrap around.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "sim/transfer/lattice.h"

namespace sim {

/// Ascending keys -> their places in the list. An open-addressing table: a few words a key, whatever the keys are.
class KeyTable {
 public:
  void build(const std::vector<std::int64_t>& ascending);
  /// -1 when it is not there.
  std::int32_t find(std::int64_t key) const {
    if (entries_.empty()) return -1;
    for (std::size_t at = first(key);; at = (at + 1) & mask_)
      if (entries_[at].place < 0 || entries_[at].key == key) return entries_[at].place;
  }

 private:
  struct Entry {
    std::int64_t key = 0;
    std::int32_t place = -1;
  };
  std::size_t first(std::int64_t key) const { return std::size_t((std::uint64_t(key) * 0x9e3779b97f4a7c15u) >> 32) & mask_; }
  std::vector<Entry> entries_;
  std::size_t mask_ = 0;
};

/// Which place a particle belongs to: its cell, or the node nearest to it (on periodic axes the node's place in the domain). Lanes of one
/// batch share the nodes they reach if they belong together on the transfer's lattice.
enum class Home { cell, nearest_node };

/// Where the particles of each cell and block begin, once they are in canonical order.
struct CellRanges {
  Home home = Home::cell;                  // what "cell" means here
  std::vector<std::int64_t> occupied;      // keys of the blocks that hold particles, ascending
  std::vector<std::uint32_t> begin;        // by [place in occupied * kCellsPerBlock + cell in the block]; one more entry at the end
};

template <int D>
class ActiveBlocks {
 public:
  static constexpr int kEdge = Lattice<D>::kBlock, kCells = Lattice<D>::kCellsPerBlock;
  static constexpr int kNeighbours = D == 2 ? 9 : 27;     // itself included, row-major over -1, 0, 1 an axis
  static constexpr std::ptrdiff_t kAbsent = -1;           // the index of a place whose block is not active

  ActiveBlocks() = default;
  explicit ActiveBlocks(const Lattice<D>& lattice) : lattice_(lattice) {}
  /// All blocks of the lattice: for domains that are full anyway.
  static ActiveBlocks whole(const Lattice<D>&);
  /// The blocks with a place within `depth` places of an occupied cell, along every axis; what a stencil beyond a wall reaches included.
  /// Keeps what it has when the blocks are the same as before.
  void cover(const CellRanges&, int depth);

  const Lattice<D>& lattice() const { return lattice_; }
  std::size_t count() const { return keys_.size(); }
  std::size_t size() const { return keys_.size() * std::size_t(kCells); }   // of a field
  const std::vector<std::int64_t>& keys() const { return keys_; }           // ascending
  /// Coordinates of a block, in blocks.
  const Cell<D>& block(std::size_t slot) const { return block_[slot]; }
  std::int32_t slot(std::int64_t block_key) const { return table_.find(block_key); }
  /// Slots of the 3^D blocks around one, itself at kNeighbours / 2; -1 where none is active. Wraps around.
  const std::array<std::int32_t, std::size_t(kNeighbours)>& neighbours(std::size_t slot) const { return neighbours_[slot]; }

  Cell<D> cell_at(std::size_t index) const { return Lattice<D>::cell_in(block_[index / kCells], int(index % kCells)); }
  /// Index of a place, of an image that of its place; kAbsent where no block is active.
  std::ptrdiff_t index(const Cell<D>& at) const {
    const Cell<D> place = lattice_.wrapped(at), block = Lattice<D>::block_of(place);
    for (int a = 0; a < D; ++a)
      if (block[a] < lattice_.lowest_block(a) || block[a] > lattice_.highest_block(a)) return kAbsent;
    const std::int32_t found = slot(lattice_.block_key(block));
    return found < 0 ? kAbsent : std::ptrdiff_t(found) * kCells + Lattice<D>::local_of(place);
  }
  /// False for what a cut block has behind the end of a periodic axis: storage that is no place and that nothing reads.
  bool is_place(std::size_t index) const {
    if (!has_cut_) return true;
    const Cell<D> at = cell_at(index);
    for (int a = 0; a < D; ++a)
      if (lattice_.periodic[a] && at[a] >= lattice_.cells[a]) return false;
    return true;
  }
  /// The place before (side 0) or after (1) along an axis; kAbsent where no block is active.
  std::ptrdiff_t neighbour(std::size_t index, int axis, int side) const {
    return has_cut_ ? neighbour_of<true>(index, axis, side) : neighbour_of<false>(index, axis, side);
  }
  /// Calls body(neighbour), and neighbour(index, axis, side) is the above: for sweeps, which then ask once whether any block is cut.
  template <class Body>
  void with_neighbour(const Body& body) const {
    if (has_cut_) body([this](std::size_t index, int axis, int side) { return neighbour_of<true>(index, axis, side); });
    else body([this](std::size_t index, int axis, int side) { return neighbour_of<false>(index, axis, side); });
  }
  /// Whether `is_place` is true of all.
  bool all_places() const { return !has_cut_; }
  /// The slot of the block before (side 0) or after (1) one along an axis; -1 where none is active.
  std::int32_t neighbour_block(std::size_t slot, int axis, int side) const {
    return neighbours_[slot][std::size_t(kNeighbours / 2 + (side ? kStep[axis] : -kStep[axis]))];
  }
  /// The last place of a block along an axis.
  int last_of(std::size_t slot, int axis) const {
    const bool cut = has_cut_ && lattice_.periodic[axis] && block_[slot][axis] == lattice_.blocks[axis] - 1;
    return cut ? (lattice_.cells[axis] - 1) % kEdge : kEdge - 1;
  }
  /// Index of each of n^D places from `first` on, last axis fastest; kAbsent where no block is active.
  template <int n>
  auto places(const Cell<D>& first) const;
  /// Index of each of the 3^D places around one, itself in the middle.
  std::array<std::ptrdiff_t, std::size_t(kNeighbours)> places_around(std::size_t index) const;
  /// The tile of a block: its places, kBefore before and kTile - kEdge - kBefore behind along every axis, as a dense array of kTile^D, last axis
  /// fastest. Calls body(place in the tile, index, count) for the runs of places that are active; a cut block has as many behind its last place.
  /// `count` is a constant (std::integral_constant) where nothing is cut.
  template <int kTile, int kBefore = 1, class Body>
  void for_tile(const Cell<D>& block, const Body& body) const;

 private:
  static constexpr std::array<int, D> kStep = [] {        // in the list of neighbours
    std::array<int, D> step{};
    for (int a = D - 1, s = 1; a >= 0; --a, s *= 3) step[std::size_t(a)] = s;
    return step;
  }();
  template <bool kMayBeCut>
  std::ptrdiff_t neighbour_of(std::size_t index, int axis, int side) const {
    const int shift = 2 * (D - 1 - axis), local = int(index % kCells), at = local >> shift & (kEdge - 1);
    const std::size_t slot = index / kCells;
    const auto last = [&](std::size_t s) {
      if constexpr (kMayBeCut) return last_of(s, axis);
      else return kEdge - 1;
    };
    if (side ? at < last(slot) : at > 0) return std::ptrdiff_t(index) + (side ? 1 << shift : -(1 << shift));
    const std::int32_t other = neighbour_block(slot, axis, side);
    if (other < 0) return kAbsent;
    const int to = side ? 0 : last(std::size_t(other));
    return std::ptrdiff_t(other) * kCells + (local & ~((kEdge - 1) << shift)) + (to << shift);
  }
  /// Whether places [first, first + n) along an axis lie in blocks as if the axis had no end.
  bool runs_on(int axis, int first, int n) const {
    return !lattice_.periodic[axis] || lattice_.cells[axis] % kEdge == 0 || (first >= 0 && first + n <= lattice_.cells[axis]);
  }
  void activate(std::vector<std::int64_t> keys);

  Lattice<D> lattice_;
  bool has_cut_ = false;                                  // a periodic axis is no whole number of blocks
  std::vector<std::int64_t> keys_;
  std::vector<Cell<D>> block_;
  std::vector<std::array<std::int32_t, std::size_t(kNeighbours)>> neighbours_;
  KeyTable table_;
};

/// The value at an index that may be kAbsent.
template <class Value>
Value value_at(const std::vector<Value>& field, std::ptrdiff_t index, Value absent) {
  return index < 0 ? absent : field[std::size_t(index)];
}

template <int D>
template <int n>
auto ActiveBlocks<D>::places(const Cell<D>& first) const {
  constexpr int rows = D == 2 ? n : n * n;
  std::array<std::ptrdiff_t, std::size_t(rows * n)> found;
  const Cell<D> start = lattice_.wrapped(first), block = Lattice<D>::block_of(start);
  bool plain = true;
  for (int a = 0; a < D; ++a) plain = plain && runs_on(a, start[a], n) && block[a] >= lattice_.lowest_block(a) && block[a] <= lattice_.highest_block(a);
  const std::int32_t own = plain ? slot(lattice_.block_key(block)) : -1;
  if (own < 0) {
    for (int k = 0; k < rows * n; ++k) {
      Cell<D> at = start;
      for (int a = D - 1, rest = k; a >= 0; --a, rest /= n) at[a] += rest % n;
      found[std::size_t(k)] = index(at);
    }
    return found;
  }
  std::array<std::array<int, std::size_t(n)>, D> step, local;   // of each coordinate: its part of the neighbour's number and of the place in it
  for (int a = 0; a < D; ++a)
    for (int k = 0; k < n; ++k) {
      const int at = start[a] + k;
      step[a][std::size_t(k)] = at >> 2 > block[a] ? kStep[a] : 0;
      local[a][std::size_t(k)] = (at & (kEdge - 1)) << (2 * (D - 1 - a));
    }
  for (int k = 0; k < rows * n; ++k) {
    int other = kNeighbours / 2, place = 0;
    for (int a = D - 1, rest = k; a >= 0; --a, rest /= n) other += step[a][std::size_t(rest % n)], place += local[a][std::size_t(rest % n)];
    const std::int32_t s = neighbours_[std::size_t(own)][std::size_t(other)];
    found[std::size_t(k)] = s < 0 ? kAbsent : std::ptrdiff_t(s) * kCells + place;
  }
  return found;
}

template <int D>
auto ActiveBlocks<D>::places_around(std::size_t index) const -> std::array<std::ptrdiff_t, std::size_t(kNeighbours)> {
  if (has_cut_) {
    Cell<D> lower = cell_at(index);
    for (int& c : lower) --c;
    return places<3>(lower);
  }
  struct Around {
    std::uint8_t other, place;   // in the list of neighbours, and in that block
  };
  static constexpr auto kAround = [] {
    std::array<std::array<Around, std::size_t(kNeighbours)>, std::size_t(kCells)> all{};
    for (int local = 0; local < kCells; ++local)
      for (int n = 0; n < kNeighbours; ++n) {
        int other = kNeighbours / 2, place = 0;
        for (int a = D - 1, rest = n; a >= 0; --a, rest /= 3) {
          const int shift = 2 * (D - 1 - a), at = (local >> shift & (kEdge - 1)) + rest % 3 - 1;
          other += at < 0 ? -kStep[std::size_t(a)] : at >= kEdge ? kStep[std::size_t(a)] : 0;
          place += (at & (kEdge - 1)) << shift;
        }
        all[std::size_t(local)][std::size_t(n)] = {std::uint8_t(other), std::uint8_t(place)};
      }
    return all;
  }();
  const auto& neighbours = neighbours_[index / kCells];
  const auto& around = kAround[index % kCells];
  std::array<std::ptrdiff_t, std::size_t(kNeighbours)> found;
  for (std::size_t n = 0; n < found.size(); ++n) {
    const std::int32_t s = neighbours[around[n].other];
    found[n] = s < 0 ? kAbsent : std::ptrdiff_t(s) * kCells + around[n].place;
  }
  return found;
}

template <int D>
template <int kTile, int kBefore, class Body>
void ActiveBlocks<D>::for_tile(const Cell<D>& block, const Body& body) const {
  constexpr int kAfter = kTile - kEdge - kBefore;
  static_assert(kBefore <= kEdge && kAfter <= kEdge);
  Cell<D> lower, reach;
  bool plain = true, cut = false;
  for (int a = 0; a < D; ++a) {
    lower[a] = block[a] * kEdge - kBefore;
    reach[a] = std::min(kEdge, lattice_.cells[a] - block[a] * kEdge) + kTile - kEdge;
    plain = plain && runs_on(a, lower[a], reach[a]);
    cut = cut || reach[a] < kTile;
  }
  const std::int32_t own = slot(lattice_.block_key(block));
  const bool in_blocks = plain && own >= 0;
  constexpr int kRows = D == 2 ? kTile : kTile * kTile;
  struct Row {
    int other, local;   // in the list of neighbours, and of the first place in the block
  };
  constexpr auto kRow = [] {
    std::array<Row, std::size_t(kRows)> rows{};
    for (int row = 0; row < kRows; ++row) {
      Row& r = rows[std::size_t(row)] = {kNeighbours / 2, 0};
      for (int a = D - 2, rest = row; a >= 0; rest /= kTile, --a) {
        const int k = rest % kTile;
        r.other += (k < kBefore ? -1 : k >= kBefore + kEdge ? 1 : 0) * kStep[std::size_t(a)];
        r.local += ((k - kBefore) & (kEdge - 1)) << (2 * (D - 1 - a));
      }
    }
    return rows;
  }();
  for (int row = 0; row < kRows; ++row) {
    const int tile = row * kTile;
    if (cut && (row % kTile >= reach[D - 2] || row / kTile >= (D == 2 ? 1 : reach[0]))) continue;
    if (!in_blocks) {
      Cell<D> at = lower;
      for (int a = D - 2, rest = row; a >= 0; rest /= kTile, --a) at[a] += rest % kTile;
      for (int k = 0; k < reach[D - 1]; ++k, ++at[D - 1])
        if (const std::ptrdiff_t i = index(at); i >= 0) body(tile + k, std::size_t(i), std::integral_constant<int, 1>{});
      continue;
    }
    const Row& r = kRow[std::size_t(row)];
    const std::int32_t* const line = &neighbours_[std::size_t(own)][std::size_t(r.other)];
    const auto run = [&](int from, int part, int start, auto count) {
      if (line[part] >= 0) body(tile + from, std::size_t(line[part]) * kCells + std::size_t(r.local + start), count);
    };
    run(0, -1, kEdge - kBefore, std::integral_constant<int, kBefore>{});
    if (reach[D - 1] == kTile) {
      run(kBefore, 0, 0, std::integral_constant<int, kEdge>{});
      run(kBefore + kEdge, 1, 0, std::integral_constant<int, kAfter>{});
    } else {
      run(kBefore, 0, 0, std::min(kEdge, reach[D - 1] - kBefore));
      if (reach[D - 1] > kBefore + kEdge) run(kBefore + kEdge, 1, 0, reach[D - 1] - kBefore - kEdge);
    }
  }
}

}  // namespace sim
