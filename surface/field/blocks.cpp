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

void load(const Blocks& blocks, const Field& field, const Absent& absence, std::size_t b, Padded& out) {
  const float *near[3][3][3];
  float absent[3][3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        const std::int32_t n = blocks.directory.at(blocks.coordinate[b] + Index3(i - 1, j - 1, k - 1));
        near[i][j][k] = n >= 0 ? field.data() + std::size_t(n) * kVoxels : nullptr;
        absent[i][j][k] = n == kWater ? absence.water : absence.air;
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

Field binomial(const Blocks& blocks, const Field& field, const Absent& absence) {
  Field result(field.size());
  each_block(blocks, [&](std::size_t b) {
    Padded in;
    load(blocks, field, absence, b, in);
    float along_z[kPadded][kPadded][kBlock], along_yz[kPadded][kBlock][kBlock];
    for (int i = 0; i < kPadded; ++i)
      for (int j = 0; j < kPadded; ++j)
        for (int k = 0; k < kBlock; ++k) along_z[i][j][k] = 0.25f * (in[i][j][k] + in[i][j][k + 2]) + 0.5f * in[i][j][k + 1];
    for (int i = 0; i < kPadded; ++i)
      for (int j = 0; j < kBlock; ++j)
        for (int k = 0; k < kBlock; ++k) along_yz[i][j][k] = 0.25f * (along_z[i][j][k] + along_z[i][j + 2][k]) + 0.5f * along_z[i][j + 1][k];
    float* out = result.data() + b * kVoxels;
    for (int i = 0; i < kBlock; ++i)
      for (int j = 0; j < kBlock; ++j)
        for (int k = 0; k < kBlock; ++k) *out++ = 0.25f * (along_yz[i][j][k] + along_yz[i + 2][j][k]) + 0.5f * along_yz[i + 1][j][k];
  });
  return result;
}

}  // namespace surface::field
