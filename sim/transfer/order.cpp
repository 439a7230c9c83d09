#include "sim/transfer/order.h"

#include <array>
#include <limits>

namespace sim {
namespace {

constexpr std::size_t kChunk = 16384;
constexpr std::size_t kParts = 4;      // that count on their own; the order does not depend on it
constexpr std::size_t kAhead = 48;     // particles whose data are called for before they are needed
constexpr std::size_t kShortRow = 8;   // numbers: as cheap to move as to look up

/// The last keys seen and what was found for them: particles of one block mostly follow each other, and its neighbours come again.
template <class Value>
class Recent {
 public:
  /// What find(key) gives, from memory where possible.
  template <class Find>
  Value operator()(std::int64_t key, const Find& find) {
    Entry& e = entries_[std::size_t((std::uint64_t(key) * 0x9e3779b97f4a7c15u) >> 56)];
    if (e.key != key) e = {key, find(key)};
    return e.value;
  }

 private:
  struct Entry {
    std::int64_t key = -1;
    Value value{};
  };
  std::array<Entry, 256> entries_{};
};

void make_unique(std::vector<std::int64_t>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// Fills `keys` with key_of(p) for all p, cells' keys, and returns those of the blocks that occur, ascending.
template <int D, class KeyOf>
std::vector<std::int64_t> occupied_blocks(std::vector<std::int64_t>& keys, const KeyOf& key_of) {
  auto found = base::ordered_reduce(keys.size(), kChunk, std::vector<std::int64_t>{}, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int64_t> part;
    Recent<bool> seen;
    for (std::size_t p = begin; p < end; ++p) {
      keys[p] = key_of(p);
      seen(keys[p] / Lattice<D>::kCellsPerBlock, [&](std::int64_t block) {
        part.push_back(block);
        return true;
      });
    }
    make_unique(part);
    return part;
  }, [](std::vector<std::int64_t> all, const std::vector<std::int64_t>& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
  make_unique(found);
  return found;
}

/// counts[part * cells + cell] becomes where the part's particles of the cell begin, and begin[cell] where the cell's do.
void add_up(std::vector<std::uint32_t>& counts, std::size_t cells, std::vector<std::uint32_t>& begin) {
  begin.resize(cells + 1);
  std::vector<std::uint32_t> starts{0};   // of chunks of cells
  for (const std::uint32_t sum : base::ordered_reduce(cells, kChunk, std::vector<std::uint32_t>{}, [&](std::size_t first, std::size_t last) {
         std::uint32_t sum = 0;
         for (std::size_t part = 0; part < kParts; ++part)
           for (std::size_t c = first; c < last; ++c) sum += counts[part * cells + c];
         return std::vector<std::uint32_t>{sum};
       }, [](std::vector<std::uint32_t> all, const std::vector<std::uint32_t>& one) {
         all.push_back(one.front());
         return all;
       }))
    starts.push_back(starts.back() + sum);
  base::parallel_chunks(cells, kChunk, [&](std::size_t first, std::size_t last) {
    std::uint32_t at = starts[first / kChunk];
    for (std::size_t c = first; c < last; ++c) {
      begin[c] = at;
      for (std::size_t part = 0; part < kParts; ++part) {
        std::uint32_t& count = counts[part * cells + c];
        const std::uint32_t next = at + count;
        count = at;
        at = next;
      }
    }
  });
  begin[cells] = starts.back();
}

/// Calls place(k, particle) for the particles of a cell, k their number by id. Few are ranked in a loop of fixed length: no branch depends on ids.
template <class Place>
void place_by_id(std::uint32_t* from, std::size_t count, const std::vector<std::int64_t>& id, const Place& place) {
  constexpr std::size_t kFew = 16;
  constexpr std::int64_t kShort = std::numeric_limits<std::int32_t>::max();
  bool is_short = count <= kFew;
  if (is_short) {
    std::array<std::int32_t, kFew> ids;
    std::array<std::uint32_t, kFew> own;
    ids.fill(std::int32_t(kShort));
    for (std::size_t i = 0; i < count; ++i) {
      own[i] = from[i];
      is_short = is_short && id[own[i]] < kShort;
      ids[i] = std::int32_t(id[own[i]]);
    }
    if (is_short) {
      for (std::size_t i = 0; i < count; ++i) {
        std::int32_t rank = 0;
        for (std::size_t j = 0; j < kFew; ++j) rank += ids[j] < ids[i];
        place(std::size_t(rank), own[i]);
      }
      return;
    }
  }
  std::sort(from, from + count, [&](std::uint32_t a, std::uint32_t b) { return id[a] < id[b]; });
  for (std::size_t i = 0; i < count; ++i) place(i, from[i]);
}

}  // namespace

template <int D, class Real>
CellRanges CanonicalOrder<D, Real>::sort(Particles<D, Real>& particles, const Lattice<D>& lattice, Home home) {
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  const std::size_t count = particles.size();
  const auto place_of = [&](std::size_t p) {
    Cell<D> at = particles.cell[p];
    if (home == Home::cell) return at;
    for (int a = 0; a < D; ++a) at[a] += particles.offset[p][a] >= Real(0.5);
    return lattice.wrapped(at);
  };
  CellRanges ranges;
  ranges.home = home;
  key_.resize(count), cell_.resize(count), from_.resize(count);
  ranges.occupied = occupied_blocks<D>(key_, [&](std::size_t p) { return lattice.key(place_of(p)); });
  table_.build(ranges.occupied);

  const std::size_t cells = ranges.occupied.size() * per_block, part = (count + kParts - 1) / kParts;
  counts_.assign(kParts * cells, 0);
  base::parallel_chunks(count, std::max<std::size_t>(part, 1), [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const counts = counts_.data() + begin / part * cells;
    Recent<std::size_t> first;
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t block = first(key_[p] / std::int64_t(per_block), [&](std::int64_t key) { return std::size_t(table_.find(key)) * per_block; });
      cell_[p] = std::uint32_t(block + std::size_t(key_[p]) % per_block);
      ++counts[cell_[p]];
    }
  });
  add_up(counts_, cells, ranges.begin);
  base::parallel_chunks(count, std::max<std::size_t>(part, 1), [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const next = counts_.data() + begin / part * cells;
    for (std::size_t p = begin; p < end; ++p) from_[next[cell_[p]]++] = std::uint32_t(p);
  });
  // The cell of a particle whose nearest node this is.
  const auto cell_below = [&](Cell<D> node, const Vec<D, Real>& offset) {
    for (int a = 0; a < D; ++a)
      if (offset[a] >= Real(0.5)) --node[a];
    return lattice.wrapped(node);
  };
  const bool moves_rows = has_short_rows(particles.row());
  if (particles.rows.empty()) particles.rows.swap(sorted_.rows);   // its storage serves again
  sorted_.cell.resize(count), sorted_.offset.resize(count), sorted_.id.resize(count), sorted_.rows.resize(moves_rows ? 0 : count);
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
      const Cell<D> cell = Lattice<D>::cell_in(block, int(k % per_block));
      place_by_id(from_.data() + first, last - first, particles.id, [&](std::size_t k_in_cell, std::uint32_t q) {
        const std::size_t p = first + k_in_cell;
        from_[p] = q;
        sorted_.cell[p] = cell, sorted_.offset[p] = particles.offset[q], sorted_.id[p] = particles.id[q];
        if (home != Home::cell) sorted_.cell[p] = cell_below(cell, particles.offset[q]);
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
  const auto bytes_of = [](const auto& column) { return std::int64_t(column.capacity() * sizeof(column[0])); };
  return bytes_of(key_) + bytes_of(cell_) + bytes_of(from_) + bytes_of(sorted_.cell) + bytes_of(sorted_.offset) + bytes_of(sorted_.id) +
         bytes_of(sorted_.rows) + bytes_of(sorted_.coefficients) + bytes_of(particles.rows);
}

bool has_short_rows(std::size_t row) { return row <= kShortRow; }

std::int64_t sort_bytes(std::int64_t dimension, std::int64_t real, std::int64_t row) {
  const std::int64_t numbers = sizeof(std::int64_t) + 2 * sizeof(std::uint32_t), moved = dimension * (sizeof(int) + real) + sizeof(std::int64_t);
  return numbers + moved + (has_short_rows(std::size_t(row)) ? row * real : std::int64_t(sizeof(std::uint32_t)));
}

template class CanonicalOrder<2, float>;
template class CanonicalOrder<3, float>;
template class CanonicalOrder<2, double>;
template class CanonicalOrder<3, double>;

}  // namespace sim
