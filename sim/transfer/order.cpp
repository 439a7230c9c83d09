#include "sim/transfer/order.h"

#include <hwy/highway.h>

#include <array>
#include <limits>
#include <type_traits>
#include <utility>

#include "base/past_caches.h"
#include "base/prefetch.h"

namespace sim {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
constexpr int kLanes = 8;
using Numbers = hn::FixedTag<std::int32_t, kLanes>;
constexpr Numbers kNumbers{};

constexpr std::size_t kShortRow = 8;   // numbers: as cheap to move as to look up

/// The place a particle belongs to.
template <int D, class Real>
Cell<D> home_of(const Particles<D, Real>& particles, std::size_t p, const Lattice<D>& lattice, Home home) {
  Cell<D> at = particles.cell[p];
  if (home == Home::cell) return at;
  for (int a = 0; a < D; ++a) {
    at[a] += particles.offset[p][a] >= Real(0.5);
    at[a] -= lattice.cells[a] & -int(lattice.periodic[a] && at[a] == lattice.cells[a]);   // no branch: it would go wrong too often
  }
  return at;
}

/// Where eight particles belong: cells in their blocks, and blocks as coordinates from `origin` on, cut into the three lowest bits of each, `slot`,
/// and ten more, `tag`; the tag is -1 where that does not hold them.
struct EightHomes {
  static constexpr int kLow = 3, kHigh = 10;   // bits
  alignas(32) std::array<std::int32_t, kLanes> local, slot, tag;

  /// The block that has `block` in the middle of what is held.
  template <int D>
  static Cell<D> origin(Cell<D> block) {
    for (int& b : block) b -= 1 << (kLow + kHigh - 1);
    return block;
  }
  template <int D, class Real>
  EightHomes(const Particles<D, Real>& particles, std::size_t p, const Lattice<D>& lattice, Home home, const std::type_identity_t<Cell<D>>& origin) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Cell<D> at = home_of(particles, p + lane, lattice, home), block = Lattice<D>::block_of(at);
      local[lane] = Lattice<D>::local_of(at);
      slot[lane] = tag[lane] = 0;
      int all = 0;
      for (int a = 0; a < D; ++a) {
        const int from_origin = block[a] - origin[a];
        slot[lane] = slot[lane] << kLow | (from_origin & ((1 << kLow) - 1));
        tag[lane] = tag[lane] << kHigh | (from_origin >> kLow & ((1 << kHigh) - 1));
        all |= from_origin;
      }
      if (all >> (kLow + kHigh)) tag[lane] = -1;
    }
  }
  EightHomes(const Particles<3, float>& particles, std::size_t p, const Lattice<3>& lattice, Home home, const Cell<3>& origin) {
    hn::Vec<Numbers> at[3];
    hn::LoadInterleaved3(kNumbers, particles.cell[p].data(), at[0], at[1], at[2]);
    if (home == Home::nearest_node) {
      constexpr hn::FixedTag<float, kLanes> real{};
      hn::Vec<decltype(real)> offset[3];
      hn::LoadInterleaved3(real, particles.offset[p].data(), offset[0], offset[1], offset[2]);
      for (int a = 0; a < 3; ++a) {
        at[a] = hn::Sub(at[a], hn::VecFromMask(kNumbers, hn::RebindMask(kNumbers, hn::Ge(offset[a], hn::Set(real, 0.5f)))));   // a mask is -1
        if (lattice.periodic[a]) at[a] = hn::IfThenZeroElse(hn::Eq(at[a], hn::Set(kNumbers, lattice.cells[a])), at[a]);
      }
    }
    const auto low = hn::Set(kNumbers, (1 << kLow) - 1), cell = hn::Set(kNumbers, Lattice<3>::kBlock - 1);
    hn::Vec<Numbers> locals = hn::Zero(kNumbers), slots = locals, tags = locals, all = locals;
    for (int a = 0; a < 3; ++a) {
      const auto from_origin = hn::Sub(hn::ShiftRight<2>(at[a]), hn::Set(kNumbers, origin[a]));
      locals = hn::Or(hn::ShiftLeft<2>(locals), hn::And(at[a], cell));
      slots = hn::Or(hn::ShiftLeft<kLow>(slots), hn::And(from_origin, low));
      tags = hn::Or(hn::ShiftLeft<kHigh>(tags), hn::ShiftRight<kLow>(from_origin));
      all = hn::Or(all, from_origin);
    }
    tags = hn::IfThenElse(hn::Eq(hn::ShiftRight<kLow + kHigh>(all), hn::Zero(kNumbers)), tags, hn::Set(kNumbers, -1));
    hn::Store(locals, kNumbers, local.data()), hn::Store(slots, kNumbers, slot.data()), hn::Store(tags, kNumbers, tag.data());
  }
};

/// Numbers of blocks that were looked up last: particles of one block mostly follow each other, and its neighbours come again.
template <int D>
class RecentBlocks {
 public:
  bool has(std::int32_t slot, std::int32_t tag) const { return entries_[std::size_t(slot)].tag == tag; }
  /// The cells of eight particles, numbered block by block; false, and no cells, where not all blocks are known.
  bool find(const EightHomes& homes, std::array<std::uint32_t, kLanes>& cell) const {
    bool all = true;
#pragma GCC unroll 8
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Entry& e = entries_[std::size_t(homes.slot[lane])];
      all = all & (e.tag == homes.tag[lane]);
      cell[lane] = e.number * std::uint32_t(Lattice<D>::kCellsPerBlock) + std::uint32_t(homes.local[lane]);
    }
    return all;
  }
  std::uint32_t number(std::int32_t slot) const { return entries_[std::size_t(slot)].number; }
  void set(std::int32_t slot, std::int32_t tag, std::int32_t number) { entries_[std::size_t(slot)] = {tag, std::uint32_t(number)}; }

 private:
  struct Entry {
    std::int32_t tag = -2;
    std::uint32_t number = 0;
  };
  std::array<Entry, std::size_t(D == 2 ? 64 : 512)> entries_{};
};

constexpr std::size_t kFew = 16;   // particles of a cell that are ranked by counting: no branch depends on ids

/// Sorts `count` <= kFew particles of a cell by their ids, of which no two are equal. kFew ids are read, and `sorted` may be written a place behind
/// them.
void rank(const std::uint32_t* from, const std::int32_t* ids, std::size_t count, std::uint32_t* sorted) {
  const auto last = hn::Set(kNumbers, std::numeric_limits<std::int32_t>::max());
  const auto lower = hn::IfThenElse(hn::FirstN(kNumbers, count), hn::LoadU(kNumbers, ids), last);
  const auto upper = hn::IfThenElse(hn::FirstN(kNumbers, std::max<std::size_t>(count, kLanes) - kLanes), hn::LoadU(kNumbers, ids + kLanes), last);
  for (std::size_t g = 0; g < count; g += 4)   // by fours: counts differ less
    for (std::size_t i = g; i < g + 4; ++i) {
      const auto own = hn::Set(kNumbers, ids[i]);
      const std::size_t below = hn::CountTrue(kNumbers, hn::Lt(lower, own)) + hn::CountTrue(kNumbers, hn::Lt(upper, own));
      sorted[i < count ? below : count] = from[i < count ? i : 0];   // what lies behind may be another thread's
    }
}

/// Sorts the particles of a block cell by cell; `begin` as in CellRanges.
class ByIds {
 public:
  template <std::size_t cells>
  void sort(const std::uint32_t* from, const std::uint32_t* begin, const std::int64_t* id, std::integral_constant<std::size_t, cells>) {
    const std::size_t held = begin[cells] - begin[0];
    if (sorted.size() < held + kFew) sorted.resize(held + kFew), ids_.resize(held + kFew);
    std::int64_t all = 0;
    for (std::size_t k = 0; k < held; ++k) {   // long before a vector of them is read: it would wait for them
      const std::int64_t own = id[from[k]];
      all |= own;
      ids_[k] = std::int32_t(own);
    }
    const bool short_ids = all < std::numeric_limits<std::int32_t>::max();
    for (std::size_t c = 0; c < cells; ++c) {
      const std::size_t at = begin[c] - begin[0], count = begin[c + 1] - begin[c];
      if (count <= kFew && short_ids) {
        rank(from + at, &ids_[at], count, &sorted[at]);
      } else {
        std::copy_n(from + at, count, &sorted[at]);
        std::sort(&sorted[at], &sorted[at] + count, [&](std::uint32_t a, std::uint32_t b) { return id[a] < id[b]; });
      }
    }
  }

  std::vector<std::uint32_t> sorted;   // the block's particles, and room

 private:
  std::vector<std::int32_t> ids_;
};

/// Sets the cells of a cell's particles, `count` from `first` on. Up to `room` may be written: what comes behind is set later.
template <int D>
void fill_cells(const Cell<D>& cell, std::size_t count, std::size_t room, Cell<D>* first) {
  if constexpr (D == 3) {
    if (count <= kFew && room >= kFew) {
      alignas(32) static constexpr std::array<std::int32_t, 24> kAxis{0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2};
      const auto x = hn::Set(kNumbers, cell[0]), y = hn::Set(kNumbers, cell[1]), z = hn::Set(kNumbers, cell[2]);
      for (std::size_t part = 0; part < 3; ++part) {
        const auto axis = hn::Load(kNumbers, kAxis.data() + part * kLanes);
        const auto row = hn::IfThenElse(hn::Eq(axis, hn::Zero(kNumbers)), x, hn::IfThenElse(hn::Eq(axis, hn::Set(kNumbers, 1)), y, z));
        for (std::size_t eight = 0; eight < kFew; eight += kLanes) hn::StoreU(row, kNumbers, first[eight].data() + part * kLanes);
      }
      return;
    }
  }
  std::fill_n(first, count, cell);
}

/// Places of particles become their cells: home_of, backwards.
template <int D, class Real>
void cells_of_homes(std::size_t count, const Vec<D, Real>* offset, const Lattice<D>& lattice, bool at_lower_side, Cell<D>* cell) {
  std::int32_t* const at = cell->data();
  const Real* const x = offset->data();
  for (std::size_t i = 0; i < count * std::size_t(D); ++i) at[i] -= x[i] >= Real(0.5);
  if (!at_lower_side) return;
  for (std::size_t p = 0; p < count; ++p)
    for (int a = 0; a < D; ++a)
      if (lattice.periodic[a] && cell[p][a] < 0) cell[p][a] += lattice.cells[a];
}

/// Moves particles to their places, block after block.
template <int D, class Real>
class BlockMover {
 public:
  /// Blocks before `end_block`; `source` says of each place, within its cell in no order, who comes there, and in order once its block has moved.
  /// Rows are numbered by `rows`, or as the particles were where there are none.
  BlockMover(const Particles<D, Real>& before, const std::uint32_t* rows, Particles<D, Real>& after, std::uint32_t* source, const Lattice<D>& lattice,
             const CellRanges& ranges, std::size_t end_block)
      : ids_(before.id.data()), offsets_(before.offset.data()), rows_(rows), after_(after), source_(source), lattice_(lattice), ranges_(ranges),
        last_(ranges.begin[end_block * kPerBlock] - 1),
        streams_(before.size() * (sizeof(Cell<D>) + sizeof(std::int64_t) + sizeof(Vec<D, Real>)) > base::kHeldByCaches) {}

  void move(std::size_t b) {
    const std::uint32_t* const begin_of = &ranges_.begin[b * kPerBlock];
    const std::size_t first = begin_of[0], held = begin_of[kPerBlock] - first;
    by_ids_.sort(source_ + first, begin_of, ids_, std::integral_constant<std::size_t, kPerBlock>{});
    if (streams_ && cells_.size() < held) cells_.resize(held), moved_ids_.resize(held);
    Cell<D>* const cell = streams_ ? cells_.data() : &after_.cell[first];
    std::int64_t* const id = streams_ ? moved_ids_.data() : &after_.id[first];
    const Cell<D> block = lattice_.block_at(ranges_.occupied[b]);
    for (std::size_t k = 0; k < kPerBlock; ++k) {
      const std::size_t at = begin_of[k] - first;
      fill_cells<D>(Lattice<D>::cell_in(block, int(k)), begin_of[k + 1] - begin_of[k], held - at, cell + at);
    }
    move_columns(first, held, id);
    if (ranges_.home == Home::nearest_node) {
      const bool at_lower_side = std::any_of(block.begin(), block.end(), [](int at) { return at == 0; });
      cells_of_homes<D, Real>(held, &after_.offset[first], lattice_, at_lower_side, cell);
    }
    if (streams_) {   // nobody reads them before the transfers are done
      base::copy_past_caches(&after_.cell[first], cell, held * sizeof(Cell<D>));
      base::copy_past_caches(&after_.id[first], id, held * sizeof(std::int64_t));
    }
  }

 private:
  static constexpr std::size_t kPerBlock = Lattice<D>::kCellsPerBlock;

  void move_columns(std::size_t first, std::size_t held, std::int64_t* __restrict id) {
    const std::uint32_t* const __restrict sorted = by_ids_.sorted.data();
    Vec<D, Real>* const __restrict offset = &after_.offset[first];
    std::uint32_t* const __restrict source = source_ + first;
    const std::int64_t* const ids = ids_;
    const Vec<D, Real>* const offsets = offsets_;
    for (std::size_t k = 0; k < held; ++k) {
      const std::size_t next = source_[std::min(first + held + k, last_)];   // of the next block: where they come from is no pattern
      base::prefetch(ids + next), base::prefetch(offsets + next);
      source[k] = sorted[k];
      offset[k] = offsets[sorted[k]], id[k] = ids[sorted[k]];
    }
    if (after_.rows.empty()) return;
    for (std::size_t k = 0; k < held; ++k) after_.rows[first + k] = rows_ ? rows_[sorted[k]] : sorted[k];
  }

  const std::int64_t* ids_;
  const Vec<D, Real>* offsets_;
  const std::uint32_t* rows_;
  Particles<D, Real>& after_;
  std::uint32_t* source_;
  const Lattice<D>& lattice_;
  const CellRanges& ranges_;
  std::size_t last_;
  bool streams_;
  ByIds by_ids_;
  std::vector<Cell<D>> cells_;
  std::vector<std::int64_t> moved_ids_;
};

}  // namespace

template <int D, class Real>
void CanonicalOrder<D, Real>::find_cells(const Particles<D, Real>& particles, const Lattice<D>& lattice, Home home) {
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  const std::size_t count = particles.size(), part = std::max<std::size_t>((count + kParts - 1) / kParts, 1), known = keys_.size();
  struct New {
    std::uint32_t particle;
    std::int64_t key;
  };
  std::array<std::vector<New>, kParts> found;
  for (auto& counts : counts_) counts.clear();
  base::parallel_chunks(count, part, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& counts = counts_[begin / part];
    std::vector<New>& unknown = found[begin / part];
    counts.assign(known * per_block, 0);
    if (begin == end) return;
    RecentBlocks<D> recent;
    const Cell<D> origin = EightHomes::origin<D>(Lattice<D>::block_of(home_of(particles, begin, lattice, home)));
    const auto set = [&](std::size_t p, std::uint32_t number, std::int32_t local) {
      cell_[p] = number * std::uint32_t(per_block) + std::uint32_t(local);
      ++counts[cell_[p]];
    };
    const auto look_up = [&](std::size_t p) {
      const Cell<D> at = home_of(particles, p, lattice, home);
      const std::int64_t key = lattice.block_key(Lattice<D>::block_of(at));
      const std::int32_t number = table_.find(key);
      if (number < 0) unknown.push_back({std::uint32_t(p), key});
      else set(p, std::uint32_t(number), Lattice<D>::local_of(at));
      return number;
    };
    std::size_t p = begin;
    for (; p + kLanes <= end; p += kLanes) {
      const EightHomes homes(particles, p, lattice, home, origin);
      if (std::array<std::uint32_t, kLanes> cell; recent.find(homes, cell)) {
        std::copy_n(cell.begin(), kLanes, &cell_[p]);
#pragma GCC unroll 8
        for (std::size_t lane = 0; lane < kLanes; ++lane) ++counts[cell[lane]];
        continue;
      }
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const std::int32_t slot = homes.slot[lane], tag = homes.tag[lane];
        if (recent.has(slot, tag)) set(p + lane, recent.number(slot), homes.local[lane]);
        else if (const std::int32_t number = look_up(p + lane); number >= 0 && tag >= 0) recent.set(slot, tag, number);
      }
    }
    for (; p < end; ++p) look_up(p);
  });
  std::vector<std::int64_t> fresh;
  for (const auto& unknown : found)
    for (const New& n : unknown)
      if (fresh.empty() || fresh.back() != n.key) fresh.push_back(n.key);
  std::sort(fresh.begin(), fresh.end());
  fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
  keys_.insert(keys_.end(), fresh.begin(), fresh.end());
  base::parallel_chunks(kParts, 1, [&](std::size_t i, std::size_t) {
    counts_[i].resize(keys_.size() * per_block, 0);
    for (const New& n : found[i]) {
      const auto number = known + std::size_t(std::lower_bound(fresh.begin(), fresh.end(), n.key) - fresh.begin());
      const Cell<D> at = home_of(particles, n.particle, lattice, home);
      cell_[n.particle] = std::uint32_t(number * per_block) + std::uint32_t(Lattice<D>::local_of(at));
      ++counts_[i][cell_[n.particle]];
    }
  });
}

template <int D, class Real>
CellRanges CanonicalOrder<D, Real>::add_up(Home home) {
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  CellRanges ranges;
  ranges.home = home;
  std::vector<std::uint32_t> held(keys_.size(), 0), order;   // particles of each block; blocks with some, by key
  base::parallel_chunks(keys_.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (const auto& counts : counts_)
      for (std::size_t c = begin * per_block; c < end * per_block; ++c) held[c / per_block] += counts[c];
  });
  for (std::size_t b = 0; b < keys_.size(); ++b)
    if (held[b]) order.push_back(std::uint32_t(b));
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return keys_[a] < keys_[b]; });
  std::vector<std::uint32_t> first{0};
  for (const std::uint32_t b : order) ranges.occupied.push_back(keys_[b]), first.push_back(first.back() + held[b]);
  ranges.begin.resize(order.size() * per_block + 1);
  ranges.begin.back() = first.back();
  base::parallel_chunks(order.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      std::uint32_t at = first[k];
      for (std::size_t c = 0; c < per_block; ++c) {
        ranges.begin[k * per_block + c] = at;
        for (auto& counts : counts_) at += std::exchange(counts[order[k] * per_block + c], at);
      }
    }
  });
  return ranges;
}

template <int D, class Real>
CellRanges CanonicalOrder<D, Real>::sort(Particles<D, Real>& particles, const Lattice<D>& lattice, Home home) {
  const std::size_t count = particles.size(), part = std::max<std::size_t>((count + kParts - 1) / kParts, 1);
  cell_.resize(count), from_.resize(count + kFew);
  find_cells(particles, lattice, home);
  CellRanges ranges = add_up(home);
  base::parallel_chunks(count, part, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const next = counts_[begin / part].data();
    for (std::size_t p = begin; p < end; ++p) from_[next[cell_[p]]++] = std::uint32_t(p);
  });
  keys_ = ranges.occupied;
  table_.build(keys_);

  const bool moves_rows = has_short_rows(particles.row());
  if (particles.rows.empty()) particles.rows.swap(sorted_.rows), particles.rows.clear();   // its storage serves again
  sorted_.cell.resize(count), sorted_.offset.resize(count), sorted_.id.resize(count), sorted_.rows.resize(moves_rows ? 0 : count);
  const std::uint32_t* const rows = particles.rows.empty() ? nullptr : particles.rows.data();
  base::parallel_chunks(ranges.occupied.size(), 16, [&](std::size_t begin, std::size_t end) {
    BlockMover<D, Real> mover(particles, rows, sorted_, from_.data(), lattice, ranges, end);
    for (std::size_t b = begin; b < end; ++b) mover.move(b);
    base::written_past_caches();
  });
  particles.cell.swap(sorted_.cell), particles.offset.swap(sorted_.offset), particles.id.swap(sorted_.id);
  if (moves_rows) move_along(particles.coefficients, sorted_.coefficients, particles.row());
  else particles.rows.swap(sorted_.rows);
  return ranges;
}

template <int D, class Real>
std::int64_t CanonicalOrder<D, Real>::bytes(const Particles<D, Real>& particles) const {
  const auto bytes_of = [](const auto& column) { return std::int64_t(column.size() * sizeof(column[0])); };
  // Rows lie here or with the particles; a gather empties them, but their storage stays.
  const auto rows = std::int64_t(std::min(std::max(particles.rows.capacity(), sorted_.rows.capacity()), cell_.size()) * sizeof(std::uint32_t));
  return 2 * bytes_of(cell_) + bytes_of(sorted_.cell) + bytes_of(sorted_.offset) + bytes_of(sorted_.id) + bytes_of(sorted_.coefficients) + rows;
}

bool has_short_rows(std::size_t row) { return row <= kShortRow; }

std::int64_t sort_bytes(std::int64_t dimension, std::int64_t real, std::int64_t row) {
  const std::int64_t numbers = 2 * sizeof(std::uint32_t), moved = dimension * (sizeof(int) + real) + sizeof(std::int64_t);
  return numbers + moved + (has_short_rows(std::size_t(row)) ? row * real : std::int64_t(sizeof(std::uint32_t)));
}

template class CanonicalOrder<2, float>;
template class CanonicalOrder<3, float>;
template class CanonicalOrder<2, double>;
template class CanonicalOrder<3, double>;

}  // namespace sim
