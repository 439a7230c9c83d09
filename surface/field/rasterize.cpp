#include <array>
#include <cmath>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

using base::Vec3f;

/// Weighted sums over particles, one a voxel; positions from the block's first voxel.
struct Sums {
  alignas(32) std::array<float, kVoxels> weight, x, y, z, radius, nearest;   // nearest: squared distance
};

/// Adds a particle at `at` to the voxels within `search`.
void add(Sums& sums, const Vec3f& at, float radius, float search) {
  const float square = search * search, inverse = 1 / square;
  const auto first = [&](int a) { return std::max(0, int(std::ceil(at[a] - search))); };
  const auto last = [&](int a) { return std::min(kBlock - 1, int(std::floor(at[a] + search))); };
  alignas(32) float z2[kBlock];
  for (int k = 0; k < kBlock; ++k) z2[k] = (float(k) - at[2]) * (float(k) - at[2]);
  for (int i = first(0); i <= last(0); ++i)
    for (int j = first(1); j <= last(1); ++j) {
      const float xy2 = (float(i) - at[0]) * (float(i) - at[0]) + (float(j) - at[1]) * (float(j) - at[1]);
      if (xy2 >= square) continue;
      const int row = (i * kBlock + j) * kBlock;
      for (int k = 0; k < kBlock; ++k) {
        const float d2 = xy2 + z2[k], t = std::max(0.0f, 1 - d2 * inverse), w = t * t * t;
        sums.weight[row + k] += w;
        sums.x[row + k] += w * at[0];
        sums.y[row + k] += w * at[1];
        sums.z[row + k] += w * at[2];
        sums.radius[row + k] += w * radius;
        sums.nearest[row + k] = std::min(sums.nearest[row + k], d2);
      }
    }
}

float averaged_sphere(const Sums& sums, int voxel, float gap) {
  if (sums.weight[voxel] <= 1e-9f) return kFar;
  const float inverse = 1 / sums.weight[voxel];
  const Vec3f mean(sums.x[voxel] * inverse, sums.y[voxel] * inverse, sums.z[voxel] * inverse);
  const Vec3f here(float(voxel / (kBlock * kBlock)), float(voxel / kBlock % kBlock), float(voxel % kBlock));
  const float sphere = (here - mean).norm() - sums.radius[voxel] * inverse;
  return std::max(sphere, std::sqrt(sums.nearest[voxel]) - gap);
}

}  // namespace

Field rasterize(const Cloud& cloud, const Blocks& blocks, const Scale& scale) {
  Field field(blocks.count() * kVoxels);
  each_block(blocks, [&](std::size_t b) {
    Sums sums;
    for (auto* a : {&sums.weight, &sums.x, &sums.y, &sums.z, &sums.radius}) a->fill(0);
    sums.nearest.fill(kFar * kFar * kBlock * kBlock);
    const Vec3f origin = (blocks.coordinate[b] * kBlock).cast<float>();
    each_near(cloud, blocks.coordinate[b], scale.search, [&](std::uint32_t p) { add(sums, cloud.position[p] - origin, cloud.radius[p], scale.search); });
    for (int v = 0; v < kVoxels; ++v) field[b * kVoxels + std::size_t(v)] = averaged_sphere(sums, v, scale.gap);
  });
  return field;
}

}  // namespace surface::field
