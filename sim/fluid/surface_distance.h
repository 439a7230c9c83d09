#pragma once
// The free surface, for the pressure: how far the middles of the cells beside it are from it.
#include <vector>

#include "sim/fluid/cells.h"

namespace sim {

/// Signed distance [cells] from the surface, below 0 in liquid cells and above 0 in air, where a liquid and an air cell meet; elsewhere -1
/// and 1, and 0 in solid cells. The surface is where cells are half full: of their particles over `full`, averaged with weights 1, 2, 1
/// along every axis over cells that are not solid. So level liquid stays level, beside walls too, however its particles lie, and at any
/// height its surface is right to 0.04 cells. A liquid cell that the average puts outside (a drop, a thin sheet) stays liquid, as near to
/// the surface as can be.
template <int D>
std::vector<float> surface_distance(const CellRanges&, const std::vector<CellKind>&, const ActiveBlocks<D>&, double full);

/// From the middle of a liquid cell to the surface, over the way to that of the air cell beside it: at least kLeastTheta.
inline double theta(float liquid, float air) {
  constexpr double kLeastTheta = 1e-2;
  const double t = double(liquid) / (double(liquid) - double(air));
  return t < kLeastTheta ? kLeastTheta : t > 1 ? 1 : t;
}

}  // namespace sim
