#pragma once
// The voxels of a block that a particle reaches, row by row: what the weighted means over particles share.
#include <algorithm>
#include <cmath>

#include "surface/field/blocks.h"

namespace surface::field {

/// Calls body(row, xy2, z2) for the rows within `search` [voxels] of a particle at `at` (from the block's first voxel): the squared
/// distances are xy2 + z2, one a voxel.
template <class Body>
void each_row_within(const base::Vec3f& at, float search, const Body& body) {
  const float square = search * search;
  const auto first = [&](int a) { return std::max(0, int(std::ceil(at[a] - search))); };
  const auto last = [&](int a) { return std::min(kBlock - 1, int(std::floor(at[a] + search))); };
  const Row z2 = (Row::LinSpaced(0, kBlock - 1) - at[2]).square();
  const int first_y = first(1), last_y = last(1), last_x = last(0);
  for (int i = first(0); i <= last_x; ++i)
    for (int j = first_y; j <= last_y; ++j) {
      const float xy2 = (float(i) - at[0]) * (float(i) - at[0]) + (float(j) - at[1]) * (float(j) - at[1]);
      if (xy2 < square) body(std::size_t(i * kBlock + j), xy2, z2);
    }
}

/// (1 - s^2)^3 of the squared distances, 0 from `search` on.
inline Row weight_within(const Row& square_distance, float inverse_square_search) {
  const Row t = (1 - square_distance * inverse_square_search).max(0.0f);
  return t * t * t;
}

}  // namespace surface::field
