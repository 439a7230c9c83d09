#include "sim/fluid/cells.h"

#include <algorithm>

#include "base/parallel.h"
#include "sim/transfer/images.h"

namespace sim {
namespace {

// No two cells of which this changes one are neighbours: their order does not matter.
template <int D>
void fill_gaps(std::vector<CellKind>& kind, const Lattice<D>& lattice) {
  const bool has_images = std::any_of(lattice.periodic.begin(), lattice.periodic.end(), [](bool p) { return p; });
  const auto is_gap = [&](std::size_t i) {
    bool wet = false;
    for (int a = 0; a < D; ++a) {
      const CellKind below = kind[i - std::size_t(lattice.stride[a])], above = kind[i + std::size_t(lattice.stride[a])];
      if (below == CellKind::air || above == CellKind::air) return false;
      wet = wet || below == CellKind::liquid || above == CellKind::liquid;
    }
    return wet;
  };
  base::parallel_chunks(kind.size(), 65536, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (kind[i] != CellKind::air || (has_images && !lattice.inside(lattice.cell_at(std::ptrdiff_t(i))))) continue;
      if (is_gap(i)) kind[i] = CellKind::liquid;
    }
  });
}

}  // namespace

template <int D>
std::vector<CellKind> classify_cells(const CellRanges& ranges, const Solids<D>& solids, bool free_surface) {
  const Lattice<D>& lattice = solids.lattice;
  std::vector<CellKind> kind(lattice.size);
  const CellKind open = free_surface ? CellKind::air : CellKind::liquid;
  for (std::size_t i = 0; i < lattice.size; ++i) kind[i] = solids.solid[i] ? CellKind::solid : open;
  if (!free_surface) return kind;
  for (const std::uint32_t block : ranges.occupied)
    for (std::size_t key = block * Lattice<D>::kCellsPerBlock; key < (block + 1) * Lattice<D>::kCellsPerBlock; ++key) {
      if (ranges.begin[key] == ranges.begin[key + 1]) continue;
      CellKind& k = kind[std::size_t(lattice.index(lattice.cell_of_key(key)))];
      if (k == CellKind::air) k = CellKind::liquid;
    }
  fill_images(kind, lattice);
  fill_gaps(kind, lattice);
  fill_images(kind, lattice);
  return kind;
}

template std::vector<CellKind> classify_cells(const CellRanges&, const Solids<2>&, bool);
template std::vector<CellKind> classify_cells(const CellRanges&, const Solids<3>&, bool);

}  // namespace sim
