#include "sim/fluid/cells.h"

#include "base/parallel.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 256;   // blocks

// No two cells of which this changes one are neighbours: their order does not matter.
template <int D>
void fill_gaps(std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  const auto is_gap = [&](std::size_t i) {
    bool wet = false;
    for (int a = 0; a < D; ++a) {
      const CellKind below = value_at(kind, blocks.neighbour(i, a, 0), CellKind::air);
      const CellKind above = value_at(kind, blocks.neighbour(i, a, 1), CellKind::air);
      if (below == CellKind::air || above == CellKind::air) return false;
      wet = wet || below == CellKind::liquid || above == CellKind::liquid;
    }
    return wet;
  };
  const auto find = [&](std::size_t begin, std::size_t end) {
    std::vector<std::size_t> gaps;
    for (std::size_t i = begin; i < end; ++i)
      if (kind[i] == CellKind::air && is_gap(i)) gaps.push_back(i);
    return gaps;
  };
  const auto append = [](std::vector<std::size_t> all, const std::vector<std::size_t>& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  };
  const auto gaps = base::ordered_reduce(kind.size(), kChunk * Lattice<D>::kCellsPerBlock, std::vector<std::size_t>{}, find, append);
  for (const std::size_t i : gaps) kind[i] = CellKind::liquid;
}

}  // namespace

template <int D>
std::vector<CellKind> classify_cells(const CellRanges& ranges, const ActiveBlocks<D>& blocks, const Solids<D>& solids, bool free_surface) {
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  std::vector<CellKind> kind(blocks.size());
  const CellKind open = free_surface ? CellKind::air : CellKind::liquid;
  base::parallel_chunks(blocks.count(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const auto solid = solids.solid_cells(blocks.block(slot));
      for (std::size_t local = 0; local < per_block; ++local) kind[slot * per_block + local] = solid[local] ? CellKind::solid : open;
    }
  });
  if (!free_surface) return kind;
  base::parallel_chunks(ranges.occupied.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const auto first = std::size_t(blocks.slot(ranges.occupied[b])) * per_block;
      for (std::size_t local = 0; local < per_block; ++local) {
        const bool empty = ranges.begin[b * per_block + local] == ranges.begin[b * per_block + local + 1];
        CellKind& k = kind[first + local];
        if (!empty && k == CellKind::air) k = CellKind::liquid;
      }
    }
  });
  fill_gaps(kind, blocks);
  return kind;
}

template std::vector<CellKind> classify_cells(const CellRanges&, const ActiveBlocks<2>&, const Solids<2>&, bool);
template std::vector<CellKind> classify_cells(const CellRanges&, const ActiveBlocks<3>&, const Solids<3>&, bool);

}  // namespace sim
