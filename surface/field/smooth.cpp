#include <algorithm>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

/// (1 2 1) / 4 along each axis.
Field binomial(const Blocks& blocks, const Field& field) {
  Field result(field.size());
  each_block(blocks, [&](std::size_t b) {
    Padded in;
    load(blocks, field, b, in);
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

}  // namespace

Field smooth(const Blocks& blocks, const Field& field, int passes, float limit) {
  Field once = field;
  for (int i = 0; i < passes; ++i) once = binomial(blocks, once);
  Field twice = once;
  for (int i = 0; i < passes; ++i) twice = binomial(blocks, twice);
  base::parallel_chunks(field.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) once[v] = std::clamp(2 * once[v] - twice[v], field[v] - limit, field[v] + limit);
  });
  return once;
}

}  // namespace surface::field
