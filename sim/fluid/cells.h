#pragma once
// What each cell of the grid is in a step, and which faces between cells move.
#include <cstdint>
#include <vector>

#include "sim/colliders/solids.h"
#include "sim/transfer/blocks.h"

namespace sim {

enum class CellKind : std::uint8_t { air, liquid, solid };

/// Of every place of the active blocks. Solid where the solids say so (a solid cell never becomes liquid); liquid where a particle is, and in
/// a cell without one whose neighbours across all faces are liquid or solid: a gap between particles, which must not draw liquid in as the
/// air above a surface does. Air elsewhere, and where no block is active: pressure 0. Without a free surface all that is not solid is liquid.
template <int D>
std::vector<CellKind> classify_cells(const CellRanges&, const ActiveBlocks<D>&, const Solids<D>&, bool free_surface = true);

}  // namespace sim
