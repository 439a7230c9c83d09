#pragma once
// The free surface, for the pressure: how far the middles of the cells beside it are from it.
#include <vector>

#include "sim/fluid/cells.h"

namespace sim {

/// Signed distance [cells] from the surface, below 0 in liquid cells and above 0 in air, where a liquid and an air cell meet; elsewhere -1
/// and 1, and 0 in solid cells. The surface is where cells are half full: their filling averaged with weights 1, 2, 1
/// along every axis over cells that are not solid. So level liquid stays level, beside walls too, however its particles lie, and at any
/// height its surface is right to 0.04 cells. A liquid cell that the average puts outside (a drop, a thin sheet) stays liquid, as near to
/// the surface as can be.
template <int D>
std::vector<float> surface_distance(const std::vector<float>& filling, const std::vector<CellKind>&, const ActiveBlocks<D>&);

/// What a projection is about: cells, the surface between them (empty: halfway to air, that is at its cells' middles), and open faces.
template <int D>
struct LiquidCells {
  std::vector<CellKind> kind;
  std::vector<float> distance;       // [cells] as of surface_distance
  OpenFaces<D> open;
  std::array<std::array<bool, 2>, std::size_t(D)> open_sides{};   // of the domain: beyond them is air
};

/// Particles of every cell over `full` [1].
template <int D>
std::vector<float> cell_filling(const CellRanges&, const ActiveBlocks<D>&, double full);

/// How much denser than `aim` the liquid's inside is: of cells around which no cell meets air and none is cut by a collider; 0 elsewhere. The
/// same average, kept within kMostExcess.
inline constexpr double kMostExcess = 0.5;
template <int D>
std::vector<float> excess_filling(const std::vector<float>& filling, double aim, const LiquidCells<D>&, const ActiveBlocks<D>&);

/// From the middle of a liquid cell to the surface, over the way to that of the air cell beside it: at least kLeastTheta.
inline double theta(float liquid, float air) {
  constexpr double kLeastTheta = 1e-2;
  const double t = double(liquid) / (double(liquid) - double(air));
  return t < kLeastTheta ? kLeastTheta : t > 1 ? 1 : t;
}

}  // namespace sim
