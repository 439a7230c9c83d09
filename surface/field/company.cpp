#include <algorithm>
#include <cmath>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

constexpr Absent kDensity = {0, 1};

/// Particles in each voxel's cube, over what a full body has.
Field count(const Cloud& cloud, const Blocks& blocks, const Scale& scale) {
  Field density(blocks.count() * kVoxels, 0);
  const float one = scale.spacing * scale.spacing * scale.spacing;
  for (const base::Vec3f& x : cloud.position) {   // in order: sums of equal numbers, a few milliseconds
    const Index3 v = (x.array() + 0.5f).floor().cast<int>();
    const std::int32_t b = blocks.directory.at(Index3(v[0] >> 3, v[1] >> 3, v[2] >> 3));
    if (b >= 0) density[std::size_t(b) * kVoxels + std::size_t((v[0] & 7) * kRows + (v[1] & 7) * kBlock + (v[2] & 7))] += one;
  }
  return density;
}

}  // namespace

std::vector<float> company(const Cloud& cloud, const Blocks& blocks, const Scale& scale) {
  // The variance of (1 - s^2)^3 is search^2 / 11 an axis, that of a binomial pass 1/2.
  const int passes = std::max(1, static_cast<int>(std::lround(scale.search * scale.search * 2 / 11)));
  Field density = count(cloud, blocks, scale);
  for (int i = 0; i < passes; ++i) density = binomial(blocks, density, kDensity);
  // Next to a lone particle only its own share is left; a sheet one particle thick has 0.3, the surface of a body 0.5.
  const float lone = float(scale.spacing * scale.spacing * scale.spacing / std::pow(M_PI * passes, 1.5)), many = 0.45f;
  std::vector<float> result(cloud.count());
  base::parallel_chunks(cloud.count(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const Index3 v = (cloud.position[p].array() + 0.5f).floor().cast<int>();
      const std::int32_t b = blocks.directory.at(Index3(v[0] >> 3, v[1] >> 3, v[2] >> 3));
      const float d = b >= 0 ? density[std::size_t(b) * kVoxels + std::size_t((v[0] & 7) * kRows + (v[1] & 7) * kBlock + (v[2] & 7))]
                      : b == kWater ? 1.0f : 0.0f;
      const float t = std::clamp((d - lone) / (many - lone), 0.0f, 1.0f);
      result[p] = t * t * (3 - 2 * t);
    }
  });
  return result;
}

}  // namespace surface::field
