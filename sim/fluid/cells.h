#pragma once
// What each cell of the active blocks is in a step.
#include <cstdint>
#include <vector>

#include "sim/fluid/open_faces.h"

namespace sim {

enum class CellKind : std::uint8_t { air, liquid, solid };

/// Solid where no face is open; liquid where a particle is. Without a particle a cell is liquid too when its neighbours across all open
/// faces are: a gap between particles, which must not draw liquid in as the air above a surface does. So is one whose middle a collider
/// covers, when more of its neighbours outside the collider are liquid than air: particles seldom find what is left of it. Air elsewhere:
/// pressure 0. Without a free surface all that is not solid is liquid. The blocks must cover the particles.
template <int D>
std::vector<CellKind> classify_cells(const CellRanges&, const ActiveBlocks<D>&, const Solids<D>&, const OpenFaces<D>&, bool free_surface = true);

}  // namespace sim
