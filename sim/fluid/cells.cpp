#include "sim/fluid/cells.h"

namespace sim {

template <int D>
std::vector<CellKind> classify_cells(const CellRanges& ranges, const Solids<D>& solids) {
  const Lattice<D>& lattice = solids.lattice;
  std::vector<CellKind> kind(lattice.size);
  for (std::size_t i = 0; i < lattice.size; ++i) kind[i] = solids.solid[i] ? CellKind::solid : CellKind::air;
  for (const std::uint32_t block : ranges.occupied) {
    Cell<D> corner;
    std::size_t rest = block;
    for (int a = D - 1; a >= 0; --a) {
      corner[a] = int(rest % std::size_t(lattice.blocks[a])) * Lattice<D>::kBlock;
      rest /= std::size_t(lattice.blocks[a]);
    }
    for (std::size_t local = 0; local < Lattice<D>::kCellsPerBlock; ++local) {
      const std::size_t key = block * Lattice<D>::kCellsPerBlock + local;
      if (ranges.begin[key] == ranges.begin[key + 1]) continue;
      Cell<D> at = corner;
      std::size_t within = local;
      for (int a = D - 1; a >= 0; --a) {
        at[a] += int(within % Lattice<D>::kBlock);
        within /= Lattice<D>::kBlock;
      }
      CellKind& k = kind[std::size_t(lattice.index(at))];
      if (k == CellKind::air) k = CellKind::liquid;
    }
  }
  return kind;
}

template std::vector<CellKind> classify_cells(const CellRanges&, const Solids<3>&);

}  // namespace sim
