#include <algorithm>
#include <array>
#include <cmath>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

using base::Vec3f;

struct Sums {
  alignas(32) std::array<float, kVoxels> weight, x, y, z;
  std::array<bool, kBlock * kBlock> row;   // whether a row holds voxels of the band
};

/// Weights (1 - s^2)^3 / (s^2 + 1/50): the nearest particles count most, and a voxel further out still has some.
void add(Sums& sums, const Vec3f& at, const Vec3f& velocity, float search) {
  const float square = search * search, inverse = 1 / square;
  const auto first = [&](int a) { return std::max(0, int(std::ceil(at[a] - search))); };
  const auto last = [&](int a) { return std::min(kBlock - 1, int(std::floor(at[a] + search))); };
  for (int i = first(0); i <= last(0); ++i)
    for (int j = first(1); j <= last(1); ++j) {
      if (!sums.row[std::size_t(i * kBlock + j)]) continue;
      const float xy2 = (float(i) - at[0]) * (float(i) - at[0]) + (float(j) - at[1]) * (float(j) - at[1]);
      if (xy2 >= square) continue;
      const int row = (i * kBlock + j) * kBlock;
      for (int k = 0; k < kBlock; ++k) {
        const float s2 = (xy2 + (float(k) - at[2]) * (float(k) - at[2])) * inverse, t = std::max(0.0f, 1 - s2), w = t * t * t / (s2 + 0.02f);
        sums.weight[row + k] += w;
        sums.x[row + k] += w * velocity[0];
        sums.y[row + k] += w * velocity[1];
        sums.z[row + k] += w * velocity[2];
      }
    }
}

}  // namespace

std::vector<Vec3f> velocity(const Cloud& cloud, const Blocks& blocks, const Field& distance, float band) {
  std::vector<Vec3f> result(distance.size(), Vec3f::Zero());
  const float search = band + 2;   // a voxel of the band is within `band` of the surface, and that near its particles
  each_block(blocks, [&](std::size_t b) {
    const float* d = distance.data() + b * kVoxels;
    Sums sums;
    bool any = false;
    for (int r = 0; r < kBlock * kBlock; ++r) {
      sums.row[std::size_t(r)] = std::any_of(d + r * kBlock, d + (r + 1) * kBlock, [&](float x) { return std::fabs(x) < band; });
      any = any || sums.row[std::size_t(r)];
    }
    if (!any) return;
    for (auto* a : {&sums.weight, &sums.x, &sums.y, &sums.z}) a->fill(0);
    const Vec3f origin = (blocks.coordinate[b] * kBlock).cast<float>();
    each_near(cloud, blocks.coordinate[b], search, [&](std::uint32_t p) { add(sums, cloud.position[p] - origin, cloud.velocity[p], search); });
    for (int v = 0; v < kVoxels; ++v)
      if (std::fabs(d[v]) < band && sums.weight[v] > 0) result[b * kVoxels + std::size_t(v)] = Vec3f(sums.x[v], sums.y[v], sums.z[v]) / sums.weight[v];
  });
  return result;
}

}  // namespace surface::field
