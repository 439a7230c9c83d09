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

}  // namespace

template <int D, class Real>
CellRanges CanonicalOrder<D, Real>::sort(Particles<D, Real>& particles, const Lattice<D>& lattice) {
  const std::size_t count = particles.size();
  key_.resize(count), from_.resize(count);
  base::parallel_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) key_[p] = std::uint32_t(lattice.key(particles.cell[p]));
  });

  CellRanges ranges;
  ranges.begin.assign(lattice.key_count() + 1, 0);
  for (std::size_t p = 0; p < count; ++p) ++ranges.begin[key_[p] + 1];
  for (std::size_t k = 1; k < ranges.begin.size(); ++k) ranges.begin[k] += ranges.begin[k - 1];

  next_.assign(ranges.begin.begin(), ranges.begin.end() - 1);
  for (std::size_t p = 0; p < count; ++p) from_[next_[key_[p]]++] = std::uint32_t(p);
  base::parallel_chunks(lattice.key_count(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      std::sort(from_.begin() + ranges.begin[k], from_.begin() + ranges.begin[k + 1],
                [&](std::uint32_t a, std::uint32_t b) { return particles.id[a] < particles.id[b]; });
  });

  permute(particles.cell, sorted_.cell, from_);
  permute(particles.offset, sorted_.offset, from_);
  permute(particles.id, sorted_.id, from_);
  permute(particles.coefficients, sorted_.coefficients, from_, particles.row());

  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  for (std::size_t b = 0; b < lattice.block_count; ++b)
    if (ranges.begin[(b + 1) * per_block] > ranges.begin[b * per_block]) ranges.occupied.push_back(std::uint32_t(b));
  return ranges;
}

template class CanonicalOrder<2, float>;
template class CanonicalOrder<3, float>;
template class CanonicalOrder<2, double>;
template class CanonicalOrder<3, double>;

}  // namespace sim
