#pragma once
// How full of liquid cells near the surface are, by what P2G left on their faces: particles that cross a cell's side change it by little, where their
// count jumps.
#include <cstdint>
#include <vector>

#include "sim/fluid/surface_distance.h"
#include "sim/transfer/place_set.h"

namespace sim {

/// What faces carry over what they do in full liquid [1], of the cells near the surface; 0 elsewhere.
struct FaceFilling {
  std::vector<float> mean;       // of a cell's faces
  std::vector<float> on_walls;   // the most of its sides that are walls: 2 h - h^2 of a film h cells thick, where h is below 1
};

/// Of the cells that are not solid, in the blocks that are `near` the surface. `full` as in find_surface; `solid` are the cells of that kind.
template <int D, class Real>
FaceFilling face_filling(const FaceField<D, Real>& mass, double full, const LiquidCells<D>& cells, const PlaceSet<D>& solid, const std::vector<std::uint8_t>& near,
                         const ActiveBlocks<D>&);

}  // namespace sim
