#include "surface/field/blocks.h"

#include <cstring>

namespace surface::field {
namespace {

/// Where a row of the padded block comes from along one axis: neighbour (-1, 0, 1) and index within it.
struct Source {
  int block, index;
};
Source source(int padded) {
  if (padded == 0) return {-1, kBlock - 1};
  if (padded == kPadded - 1) return {1, 0};
  return {0, padded - 1};
}

}  // namespace

void load(const Blocks& blocks, const Field& field, std::size_t b, Padded& out) {
  const float *near[3][3][3];
  float absent[3][3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        const std::int32_t n = blocks.directory.at(blocks.coordinate[b] + Index3(i - 1, j - 1, k - 1));
        near[i][j][k] = n >= 0 ? field.data() + std::size_t(n) * kVoxels : nullptr;
        absent[i][j][k] = n == kWater ? -kFar : kFar;
      }
  for (int x = 0; x < kPadded; ++x)
    for (int y = 0; y < kPadded; ++y) {
      const Source sx = source(x), sy = source(y);
      const int row = (sx.index * kBlock + sy.index) * kBlock;
      const auto* blocks_z = near[sx.block + 1][sy.block + 1];
      const auto* absent_z = absent[sx.block + 1][sy.block + 1];
      float* to = out[x][y].data();
      to[0] = blocks_z[0] ? blocks_z[0][row + kBlock - 1] : absent_z[0];
      if (blocks_z[1]) std::memcpy(to + 1, blocks_z[1] + row, kBlock * sizeof(float));
      else std::fill(to + 1, to + 1 + kBlock, absent_z[1]);
      to[kPadded - 1] = blocks_z[2] ? blocks_z[2][row] : absent_z[2];
    }
}

}  // namespace surface::field
