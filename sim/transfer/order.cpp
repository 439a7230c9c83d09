#include "sim/transfer/order.h"

#include <algorithm>
#include <cstring>

#include "base/parallel.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 16384;

template <class T>
void permute(std::vector<T>& values, const std::vector<std::uint32_t>& from, std::size_t row = 1) {
  std::vector<T> sorted(values.size());
  base::parallel_chunks(from.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) std::copy_n(&values[from[p] * row], row, &sorted[p * row]);
  });
  values.swap(sorted);
}

}  // namespace

template <int D, class Real>
CellRanges sort_canonically(Particles<D, Real>& particles, const Lattice<D>& lattice) {
  const std::size_t count = particles.size();
  std::vector<std::uint32_t> key(count);
  base::parallel_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) key[p] = std::uint32_t(lattice.key(particles.cell[p]));
  });

  CellRanges ranges;
  ranges.begin.assign(lattice.key_count() + 1, 0);
  for (std::size_t p = 0; p < count; ++p) ++ranges.begin[key[p] + 1];
  for (std::size_t k = 1; k < ranges.begin.size(); ++k) ranges.begin[k] += ranges.begin[k - 1];

  std::vector<std::uint32_t> from(count), next(ranges.begin.begin(), ranges.begin.end() - 1);
  for (std::size_t p = 0; p < count; ++p) from[next[key[p]]++] = std::uint32_t(p);
  base::parallel_chunks(lattice.key_count(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k)
      std::sort(from.begin() + ranges.begin[k], from.begin() + ranges.begin[k + 1],
                [&](std::uint32_t a, std::uint32_t b) { return particles.id[a] < particles.id[b]; });
  });

  permute(particles.cell, from);
  permute(particles.offset, from);
  permute(particles.id, from);
  permute(particles.coefficients, from, particles.row());

  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  for (std::size_t b = 0; b < lattice.block_count; ++b)
    if (ranges.begin[(b + 1) * per_block] > ranges.begin[b * per_block]) ranges.occupied.push_back(std::uint32_t(b));
  return ranges;
}

template CellRanges sort_canonically(Particles<2, float>&, const Lattice<2>&);
template CellRanges sort_canonically(Particles<3, float>&, const Lattice<3>&);
template CellRanges sort_canonically(Particles<2, double>&, const Lattice<2>&);
template CellRanges sort_canonically(Particles<3, double>&, const Lattice<3>&);

}  // namespace sim
