#include "sim/transfer/blocks.h"

#include <bit>

#include "base/parallel.h"

namespace sim {

void KeyTable::build(const std::vector<std::int64_t>& ascending) {
  const std::size_t size = std::bit_ceil(2 * ascending.size() + 2);
  mask_ = size - 1;
  entries_.assign(size, Entry{});
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    std::size_t at = first(ascending[i]);
    while (entries_[at].place >= 0) at = (at + 1) & mask_;
    entries_[at] = {ascending[i], std::int32_t(i)};
  }
}

namespace {

/// Keys that have come up; grows with them.
class KeySet {
 public:
  explicit KeySet(std::size_t expected) : entries_(std::bit_ceil(2 * expected + 16), kNone) {}
  /// False when it was there.
  bool insert(std::int64_t key) {
    if (2 * ++count_ > entries_.size()) grow();
    return put(key);
  }

 private:
  static constexpr std::int64_t kNone = -1;
  bool put(std::int64_t key) {
    const std::size_t mask = entries_.size() - 1;
    for (std::size_t at = std::size_t((std::uint64_t(key) * 0x9e3779b97f4a7c15u) >> 32) & mask;; at = (at + 1) & mask) {
      if (entries_[at] == key) {
        --count_;
        return false;
      }
      if (entries_[at] != kNone) continue;
      entries_[at] = key;
      return true;
    }
  }
  void grow() {
    std::vector<std::int64_t> old(2 * entries_.size(), kNone);
    old.swap(entries_);
    for (const std::int64_t key : old)
      if (key != kNone) put(key);
  }
  std::vector<std::int64_t> entries_;
  std::size_t count_ = 0;
};

/// Calls body(block) for all blocks from `lower` to `upper`, both included.
template <int D, class Body>
void for_box(const Cell<D>& lower, const Cell<D>& upper, const Body& body) {
  for (int a = 0; a < D; ++a)
    if (lower[a] > upper[a]) return;
  Cell<D> at = lower;
  while (true) {
    body(at);
    int a = D - 1;
    while (a >= 0 && at[a] == upper[a]) at[a] = lower[a], --a;
    if (a < 0) return;
    ++at[a];
  }
}

/// The box of the cells of a block that hold particles, as places in it.
template <int D>
void occupied_box(const CellRanges& ranges, std::size_t block, Cell<D>& lower, Cell<D>& upper) {
  constexpr int per_block = Lattice<D>::kCellsPerBlock;
  lower.fill(Lattice<D>::kBlock), upper.fill(-1);
  for (int local = 0; local < per_block; ++local) {
    const std::size_t k = block * std::size_t(per_block) + std::size_t(local);
    if (ranges.begin[k] == ranges.begin[k + 1]) continue;
    const Cell<D> at = Lattice<D>::cell_in(Cell<D>{}, local);
    for (int a = 0; a < D; ++a) lower[a] = std::min(lower[a], at[a]), upper[a] = std::max(upper[a], at[a]);
  }
}

}  // namespace

template <int D>
ActiveBlocks<D> ActiveBlocks<D>::whole(const Lattice<D>& lattice) {
  ActiveBlocks blocks(lattice);
  Cell<D> lower, upper;
  for (int a = 0; a < D; ++a) lower[a] = lattice.lowest_block(a), upper[a] = lattice.highest_block(a);
  std::vector<std::int64_t> keys;
  for_box<D>(lower, upper, [&](const Cell<D>& block) { keys.push_back(lattice.block_key(block)); });
  blocks.activate(std::move(keys));
  return blocks;
}

template <int D>
void ActiveBlocks<D>::cover(const CellRanges& ranges, int depth) {
  std::vector<std::int64_t> keys;
  KeySet seen(2 * ranges.occupied.size());
  for (std::size_t b = 0; b < ranges.occupied.size(); ++b) {
    const Cell<D> block = lattice_.block_at(ranges.occupied[b]);
    Cell<D> lower, upper;
    occupied_box<D>(ranges, b, lower, upper);
    for (int a = 0; a < D; ++a) {
      lower[a] = (block[a] * kEdge + lower[a] - depth) >> 2;
      upper[a] = (block[a] * kEdge + upper[a] + depth) >> 2;
      // Around a periodic end the cut block counts as whole: a block more at most.
      if (lattice_.periodic[a] && lattice_.cells[a] % kEdge) --lower[a], ++upper[a];
      if (lattice_.periodic[a]) upper[a] = std::min(upper[a], lower[a] + lattice_.blocks[a] - 1);
      else lower[a] = std::max(lower[a], lattice_.lowest_block(a)), upper[a] = std::min(upper[a], lattice_.highest_block(a));
    }
    for_box<D>(lower, upper, [&](Cell<D> at) {
      for (int a = 0; a < D; ++a)
        while (lattice_.periodic[a] && (at[a] < 0 || at[a] >= lattice_.blocks[a])) at[a] += at[a] < 0 ? lattice_.blocks[a] : -lattice_.blocks[a];
      if (const std::int64_t key = lattice_.block_key(at); seen.insert(key)) keys.push_back(key);
    });
  }
  std::sort(keys.begin(), keys.end());
  if (keys != keys_) activate(std::move(keys));
}

template <int D>
void ActiveBlocks<D>::activate(std::vector<std::int64_t> keys) {
  keys_ = std::move(keys);
  table_.build(keys_);
  has_cut_ = false;
  for (int a = 0; a < D; ++a) has_cut_ = has_cut_ || (lattice_.periodic[a] && lattice_.cells[a] % kEdge);
  block_.resize(keys_.size());
  neighbours_.resize(keys_.size());
  base::parallel_chunks(keys_.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      block_[s] = lattice_.block_at(keys_[s]);
      for (int n = 0; n < kNeighbours; ++n) {
        Cell<D> at = block_[s];
        bool exists = true;
        for (int a = 0; a < D; ++a) {
          at[a] += n / kStep[a] % 3 - 1;
          if (lattice_.periodic[a]) at[a] = (at[a] + lattice_.blocks[a]) % lattice_.blocks[a];
          exists = exists && at[a] >= lattice_.lowest_block(a) && at[a] <= lattice_.highest_block(a);
        }
        neighbours_[s][std::size_t(n)] = exists ? table_.find(lattice_.block_key(at)) : -1;
      }
    }
  });
}

template class ActiveBlocks<2>;
template class ActiveBlocks<3>;

}  // namespace sim
