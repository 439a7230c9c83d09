#pragma once
// What each cell of the grid is in a step, and which faces between cells move.
#include <cstdint>
#include <vector>

#include "sim/colliders/solids.h"
#include "sim/transfer/order.h"

namespace sim {

enum class CellKind : std::uint8_t { air, liquid, solid };

/// Liquid where a particle is, solid where the solids say so (a solid cell never becomes liquid), air elsewhere: pressure 0.
template <int D>
std::vector<CellKind> classify_cells(const CellRanges&, const Solids<D>&);

}  // namespace sim
