#include "sim/fluid/cells.h"

namespace sim {

template <int D>
std::vector<CellKind> classify_cells(const CellRanges& ranges, const Solids<D>& solids) {
  const Lattice<D>& lattice = solids.lattice;
  std::vector<CellKind> kind(lattice.size);
  for (std::size_t i = 0; i < lattice.size; ++i) kind[i] = solids.solid[i] ? CellKind::solid : CellKind::air;
  for (const std::uint32_t block : ranges.occupied)
    for (std::size_t key = block * Lattice<D>::kCellsPerBlock; key < (block + 1) * Lattice<D>::kCellsPerBlock; ++key) {
      if (ranges.begin[key] == ranges.begin[key + 1]) continue;
      CellKind& k = kind[std::size_t(lattice.index(lattice.cell_of_key(key)))];
      if (k == CellKind::air) k = CellKind::liquid;
    }
  return kind;
}

template std::vector<CellKind> classify_cells(const CellRanges&, const Solids<3>&);

}  // namespace sim
