#pragma once
// The free surface, for the pressure: how far the middles of the cells beside it are from it.
#include <vector>

#include "sim/fluid/cells.h"
#include "sim/transfer/mac_transfer.h"

namespace sim {

/// What a projection is about: cells, the surface between them (empty: halfway to air, that is at its cells' middles), and open faces.
template <int D>
struct LiquidCells {
  std::vector<CellKind> kind;
  std::vector<float> distance;       // [cells] as find_surface sets it
  std::vector<std::uint8_t> film;    // the axes along which a liquid cell lies between a solid and air, a bit each; 0: no film; empty: there is none
  std::vector<std::size_t> thin;     // air cells whose particles fly as they did: their faces keep the velocity that P2G and forces gave them
  OpenFaces<D> open;
  std::array<std::array<bool, 2>, std::size_t(D)> open_sides{};   // of the domain: beyond them is air
  /// Of a cell, as `film` has it.
  int film_at(std::size_t i) const { return film.empty() ? 0 : film[i]; }
};

/// The free surface: `distance` of all cells, and of `kind` (as classify_cells has it) the last word on cells at the surface.
///
/// Distance [cells] is signed, below 0 in liquid cells and above 0 in air, where a liquid and an air cell meet; elsewhere -1 and 1, and 0 in solid
/// cells. The surface is where cells are half full: their filling averaged with weights 1, 2, 1 along every axis, a solid being the mirror image of
/// what is on this side; a film, between a solid and air, is as thick as the averages of its column are in sum. A cell's filling is what P2G left on
/// its faces over what it leaves there in full liquid: particles that cross a cell's side change it by little, where their count jumps. So level
/// liquid stays level, beside walls too, at any height and however its particles lie.
///
/// Which cells are liquid the average has a say in, both ways. An air cell that it puts well inside is liquid: a gap that chance left between
/// particles, and no bubble that a splash took in. A cell with particles that it puts outside is air, if beside it is liquid that is inside: what is
/// in it lies on top of that liquid, and is no part of it yet. A drop or a thin sheet, of which the average finds no inside, stays liquid, as near to
/// the surface as can be.
///
/// Nor is it liquid, three cells from air or nearer, where particles (`count` of cell_filling) are fewer than chance explains, in a cell and in the
/// liquid cells beside it: spray, and foam that a splash has left. An incompressible cell would keep it as thin as it is and give it the room of liquid.
template <int D, class Real>
void find_surface(const FaceField<D, Real>& mass, const std::vector<float>& count, double full, LiquidCells<D>& cells, const ActiveBlocks<D>&);

/// Particles of every cell over `full` [1].
template <int D>
std::vector<float> cell_filling(const CellRanges&, const ActiveBlocks<D>&, double full);

/// How much denser than `aim` the liquid's inside is: of cells around which no cell meets air and none is cut by a collider. The same average, kept
/// within kMostExcess. Of cells that a collider cuts what particles piled up there, by more than kByChance over what has room, at most kMostPiled:
/// where a wall narrows, those that come along it are pushed together, and pressure would move each as if it were alone. 0 elsewhere.
inline constexpr double kMostExcess = 0.5, kByChance = 0.5, kMostPiled = 2;
template <int D>
std::vector<float> excess_filling(const std::vector<float>& filling, double aim, const LiquidCells<D>&, const ActiveBlocks<D>&);

/// From the middle of a liquid cell to the surface, over the way to that of the air cell beside it: at least kLeastTheta.
inline double theta(float liquid, float air) {
  constexpr double kLeastTheta = 1e-2;
  const double t = double(liquid) / (double(liquid) - double(air));
  return t < kLeastTheta ? kLeastTheta : t > 1 ? 1 : t;
}

}  // namespace sim
