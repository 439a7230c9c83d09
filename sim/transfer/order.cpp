#include "sim/transfer/order.h"

#include <algorithm>

#include "base/parallel.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 16384;

template <class T>
void permute(std::vector<T>& values, std::vector<T>& sorted, const std::vector<std::uint32_t>& from, std::size_t row = 1) {
  sorted.resize(values.size());
  base::parallel_chunks(from.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) std::copy_n(&values[from[p] * row], row, &sorted[p * row]);
  });
  values.swap(sorted);
}

void make_unique(std::vector<std::int64_t>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// The keys that occur, ascending. Particles of one block mostly follow each other.
std::vector<std::int64_t> distinct(const std::vector<std::int64_t>& keys) {
  auto found = base::ordered_reduce(keys.size(), kChunk, std::vector<std::int64_t>{}, [&](std::size_t begin, std::size_t end) {
    std::vector<std::int64_t> part;
    for (std::size_t p = begin; p < end; ++p)
      if (part.empty() || part.back() != keys[p]) part.push_back(keys[p]);
    make_unique(part);
    return part;
  }, [](std::vector<std::int64_t> all, const std::vector<std::int64_t>& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
  make_unique(found);
  return found;
}

}  // namespace

template <int D, class Real>
CellRanges CanonicalOrder<D, Real>::sort(Particles<D, Real>& particles, const Lattice<D>& lattice) {
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  const std::size_t count = particles.size();
  key_.resize(count), cell_.resize(count), from_.resize(count);
  base::parallel_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) key_[p] = lattice.block_key(Lattice<D>::block_of(particles.cell[p]));
  });
  CellRanges ranges;
  ranges.occupied = distinct(key_);
  table_.build(ranges.occupied);
  base::parallel_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      cell_[p] = std::uint32_t(std::size_t(table_.find(key_[p])) * per_block + std::size_t(Lattice<D>::local_of(particles.cell[p])));
  });

  const std::size_t cells = ranges.occupied.size() * per_block;
  ranges.begin.assign(cells + 1, 0);
  for (std::size_t p = 0; p < count; ++p) ++ranges.begin[cell_[p] + 1];
  for (std::size_t k = 1; k <= cells; ++k) ranges.begin[k] += ranges.begin[k - 1];

  next_.assign(ranges.begin.begin(), ranges.begin.end() - 1);
  for (std::size_t p = 0; p < count; ++p) from_[next_[cell_[p]]++] = std::uint32_t(p);
  base::parallel_chunks(cells, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      std::sort(from_.begin() + ranges.begin[k], from_.begin() + ranges.begin[k + 1],
                [&](std::uint32_t a, std::uint32_t b) { return particles.id[a] < particles.id[b]; });
  });

  permute(particles.cell, sorted_.cell, from_);
  permute(particles.offset, sorted_.offset, from_);
  permute(particles.id, sorted_.id, from_);
  permute(particles.coefficients, sorted_.coefficients, from_, particles.row());
  return ranges;
}

template class CanonicalOrder<2, float>;
template class CanonicalOrder<3, float>;
template class CanonicalOrder<2, double>;
template class CanonicalOrder<3, double>;

}  // namespace sim
