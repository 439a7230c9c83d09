#include "sim/transfer/order.h"

#include <array>

namespace sim {
namespace {

constexpr std::size_t kChunk = 16384;
constexpr std::size_t kParts = 4;      // that count on their own; the order does not depend on it
constexpr std::size_t kShortRow = 8;   // numbers: as cheap to move as to look up

/// The last keys seen and what was found for them: particles of one block mostly follow each other, and its neighbours come again.
template <class Value>
class Recent {
 public:
  /// What find(key) gives, from memory where possible.
  template <class Find>
  Value operator()(std::int64_t key, const Find& find) {
    Entry& e = entries_[std::size_t(key) % entries_.size()];
    if (e.key != key) e = {key, find(key)};
    return e.value;
  }

 private:
  struct Entry {
    std::int64_t key = -1;
    Value value{};
  };
  std::array<Entry, 64> entries_{};
};

void make_unique(std::vector<std::int64_t>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// Fills `keys` with key_of(p) for all p and returns those that occur, ascending.
template <class KeyOf>
std::vector<std::int64_t> distinct(std::vector<std::int64_t>& keys, const KeyOf& key_of) {
  auto found = base::ordered_reduce(keys.size(), kChunk, std::vector<std::int64_t>{}, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int64_t> part;
    Recent<bool> seen;
    for (std::size_t p = begin; p < end; ++p) {
      keys[p] = key_of(p);
      seen(keys[p], [&](std::int64_t key) {
        part.push_back(key);
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

/// Sorts a few particles by id. By rank: no branch depends on the ids.
void sort_by_id(std::uint32_t* from, std::size_t count, const std::vector<std::int64_t>& id) {
  constexpr std::size_t kFew = 32;
  if (count > kFew) {
    std::sort(from, from + count, [&](std::uint32_t a, std::uint32_t b) { return id[a] < id[b]; });
    return;
  }
  std::array<std::int64_t, kFew> ids;
  std::array<std::uint32_t, kFew> sorted;
  for (std::size_t i = 0; i < count; ++i) ids[i] = id[from[i]];
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t rank = 0;
    for (std::size_t j = 0; j < count; ++j) rank += ids[j] < ids[i];
    sorted[rank] = from[i];
  }
  std::copy_n(sorted.begin(), count, from);
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
  ranges.occupied = distinct(key_, [&](std::size_t p) { return lattice.block_key(Lattice<D>::block_of(place_of(p))); });
  table_.build(ranges.occupied);

  const std::size_t cells = ranges.occupied.size() * per_block, part = (count + kParts - 1) / kParts;
  counts_.assign(kParts * cells, 0);
  base::parallel_chunks(count, std::max<std::size_t>(part, 1), [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const counts = counts_.data() + begin / part * cells;
    Recent<std::size_t> first;
    for (std::size_t p = begin; p < end; ++p) {
      const std::size_t block = first(key_[p], [&](std::int64_t key) { return std::size_t(table_.find(key)) * per_block; });
      cell_[p] = std::uint32_t(block + std::size_t(Lattice<D>::local_of(place_of(p))));
      ++counts[cell_[p]];
    }
  });
  add_up(counts_, cells, ranges.begin);
  base::parallel_chunks(count, std::max<std::size_t>(part, 1), [&](std::size_t begin, std::size_t end) {
    std::uint32_t* const next = counts_.data() + begin / part * cells;
    for (std::size_t p = begin; p < end; ++p) from_[next[cell_[p]]++] = std::uint32_t(p);
  });
  base::parallel_chunks(cells, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) sort_by_id(&from_[ranges.begin[k]], ranges.begin[k + 1] - ranges.begin[k], particles.id);
  });

  move_along(particles.cell, sorted_.cell);
  move_along(particles.offset, sorted_.offset);
  move_along(particles.id, sorted_.id);
  if (particles.row() <= kShortRow) {
    move_along(particles.coefficients, sorted_.coefficients, particles.row());
  } else if (particles.rows.empty()) {
    particles.rows = from_;
  } else {
    move_along(particles.rows, sorted_.rows);
  }
  return ranges;
}

template class CanonicalOrder<2, float>;
template class CanonicalOrder<3, float>;
template class CanonicalOrder<2, double>;
template class CanonicalOrder<3, double>;

}  // namespace sim
