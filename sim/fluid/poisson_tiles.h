#pragma once
// The equations of the pressure, tile by tile, as a grid of any kind hands them to the solver: which cells are unknown, how much of each
// face is open, and how near the free surface is. Lengths in cells.
//
//   sum over faces f of w_f (x_i - x_j)  +  extra_i x_i  =  rhs_i,      x_j = 0 where j is air
//
// w_f is the open fraction of the face between i and j [1]. Air at the distance theta below one cell [Gibou02] adds
// extra = w_f (1 / theta - 1) to the term w_f that it has anyway.
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "sim/transfer/lattice.h"

namespace sim {

/// A cube of cells, the unit of storage and of work. The last axis runs fastest: along it lie lanes, then come rows and, in three
/// dimensions, planes.
template <int D>
struct Tile {
  static constexpr int kEdge = D == 2 ? 16 : 8;
  static constexpr int kPlanes = D == 3 ? kEdge : 1;
  static constexpr int kCells = kPlanes * kEdge * kEdge;
  static constexpr int kFaces = kCells / kEdge * (kEdge + 1);   // of one axis, upper ones of the last cells included
  static constexpr int cell(int plane, int row, int lane) { return (plane * kEdge + row) * kEdge + lane; }
  /// The lower face of a cell along an axis; the upper one is that of the next cell, which may be kEdge.
  template <int axis>
  static constexpr int face(int plane, int row, int lane) {
    return (plane * (kEdge + (axis == D - 2 ? 1 : 0)) + row) * (kEdge + (axis == D - 1 ? 1 : 0)) + lane;
  }
};

enum class PoissonCell : std::uint8_t { air, unknown, solid };

template <int D>
struct PoissonTile {
  template <class Number>
  using PerCell = std::array<Number, std::size_t(Tile<D>::kCells)>;
  PerCell<PoissonCell> kind;                                                    // cells outside the domain: solid
  std::array<std::array<float, std::size_t(Tile<D>::kFaces)>, std::size_t(D)> face;   // [1] w; read where a side is unknown; 0 towards a solid
  PerCell<float> extra;                                                         // [1] read where unknown
  PerCell<double> rhs;                                                          // read where unknown
};

template <int D>
struct PoissonProblem {
  Cell<D> cells{};                       // of the domain
  std::array<bool, D> periodic{};
  std::vector<Cell<D>> tiles;            // coordinates, in tiles, of all that may hold unknowns; ascending, no two the same
  /// What a tile that is not listed holds; also asked for tiles outside the domain.
  std::function<PoissonCell(const Cell<D>& tile)> elsewhere;
  /// Fills one tile. Called from several threads; a face that two tiles share must get the same number from both.
  std::function<void(const Cell<D>& tile, PoissonTile<D>&)> fill;
};

}  // namespace sim
