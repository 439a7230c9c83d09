#include "sim/transfer/order.h"

#include <hwy/highway.h>

#include <array>
#include <limits>
#include <utility>

namespace sim {
namespace {

constexpr std::size_t kAhead = 48;     // particles whose data are called for before they are needed
constexpr std::size_t kShortRow = 8;   // numbers: as cheap to move as to look up

/// Numbers of blocks that were looked up last: particles of one block mostly follow each other, and its neighbours come again.
template <int D>
class RecentBlocks {
 public:
  /// What find(key) gives, from memory where possible.
  template <class Find>
  std::int32_t operator()(const Cell<D>& block, std::int64_t key, const Find& find) {
    unsigned place = 0;
    for (int a = 0; a < D; ++a) place = place << 3 | (unsigned(block[a]) & 7);
    Entry& e = entries_[place];
    if (e.key != key) e = {key, find(key)};
    return e.number;
  }

 private:
  struct Entry {
    std::int64_t key = -1;
    std::int32_t number = -1;
  };
  std::array<Entry, std::size_t(D == 2 ? 64 : 512)> entries_{};
};

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

/// The cell of a particle that belongs to `place`: home_of, backwards.
template <int D, class Real>
Cell<D> cell_of(Cell<D> place, const Vec<D, Real>& offset, const Lattice<D>& lattice, Home home) {
  if (home == Home::cell) return place;
  for (int a = 0; a < D; ++a) {
    place[a] -= offset[a] >= Real(0.5);
    place[a] += lattice.cells[a] & place[a] >> 31;   // below 0 on a periodic axis only
  }
  return place;
}

/// How many of `ids`, in groups of eight, are smaller than `own`. Written for the vector unit: compilers unroll the loop into branches.
std::size_t count_below(const std::int32_t* ids, std::size_t count, std::int32_t own) {
  namespace hn = hwy::HWY_NAMESPACE;
  constexpr hn::FixedTag<std::int32_t, 8> tag{};
  std::size_t below = 0;
  for (std::size_t g = 0; g < count; g += 8) below += hn::CountTrue(tag, hn::Lt(hn::Load(tag, ids + g), hn::Set(tag, own)));
  return below;
}

/// Calls place(k, particle) for the particles of a cell, k their number by id. Few are ranked by counting: no branch depends on ids.
template <class Place>
void place_by_id(std::uint32_t* from, std::size_t count, const std::vector<std::int64_t>& id, const Place& place) {
  constexpr std::size_t kFew = 32;
  constexpr std::int64_t kLast = std::numeric_limits<std::int32_t>::max();
  if (count <= kFew) {
    alignas(32) std::array<std::int32_t, kFew> ids;
    std::array<std::uint32_t, kFew> own;
    ids.fill(std::int32_t(kLast));
    std::int64_t largest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      own[i] = from[i];
      largest = std::max(largest, id[own[i]]);
      ids[i] = std::int32_t(id[own[i]]);
    }
    if (largest < kLast) {
      for (std::size_t i = 0; i < count; ++i) place(count_below(ids.data(), count, ids[i]), own[i]);
      return;
    }
  }
  std::sort(from, from + count, [&](std::uint32_t a, std::uint32_t b) { return id[a] < id[b]; });
  for (std::size_t i = 0; i < count; ++i) place(i, from[i]);
}

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
    RecentBlocks<D> recent;
    for (std::size_t p = begin; p < end; ++p) {
      const Cell<D> at = home_of(particles, p, lattice, home), block = Lattice<D>::block_of(at);
      const std::int64_t key = lattice.block_key(block);
      const std::int32_t number = recent(block, key, [&](std::int64_t k) { return table_.find(k); });
      if (number < 0) {
        unknown.push_back({std::uint32_t(p), key});
      } else {
        cell_[p] = std::uint32_t(number) * std::uint32_t(per_block) + std::uint32_t(Lattice<D>::local_of(at));
        ++counts[cell_[p]];
      }
    }
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
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  const std::size_t count = particles.size(), part = std::max<std::size_t>((count + kParts - 1) / kParts, 1);
  cell_.resize(count), from_.resize(count);
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
  const std::size_t cells = ranges.occupied.size() * per_block;
  base::parallel_chunks(cells, 16 * per_block, [&](std::size_t begin, std::size_t end) {
    std::size_t ahead = ranges.begin[begin];
    Cell<D> block{};
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t first = ranges.begin[k], last = ranges.begin[k + 1];
      if (k % per_block == 0) block = lattice.block_at(ranges.occupied[k / per_block]);
      for (const std::size_t until = std::min<std::size_t>(last + kAhead, count); ahead < until; ++ahead) {   // where they come from is no pattern
        const std::size_t q = from_[ahead];
        __builtin_prefetch(&particles.id[q]), __builtin_prefetch(&particles.offset[q]);
      }
      if (first == last) continue;
      const Cell<D> place = Lattice<D>::cell_in(block, int(k % per_block));
      place_by_id(from_.data() + first, last - first, particles.id, [&](std::size_t k_in_cell, std::uint32_t q) {
        const std::size_t p = first + k_in_cell;
        from_[p] = q;
        const Vec<D, Real> offset = particles.offset[q];
        sorted_.cell[p] = cell_of<D, Real>(place, offset, lattice, home), sorted_.offset[p] = offset, sorted_.id[p] = particles.id[q];
        if (!moves_rows) sorted_.rows[p] = std::uint32_t(particles.row_of(q));
      });
    }
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
  const auto rows = std::int64_t(std::min(std::max(particles.rows.capacity(), sorted_.rows.capacity()), from_.size()) * sizeof(std::uint32_t));
  return bytes_of(cell_) + bytes_of(from_) + bytes_of(sorted_.cell) + bytes_of(sorted_.offset) + bytes_of(sorted_.id) + bytes_of(sorted_.coefficients) + rows;
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
