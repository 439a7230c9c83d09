#include <array>

#include "surface/field/footprint.h"
#include "surface/field/level_set.h"

namespace surface::field {
namespace {

using base::Vec3f;

/// Weighted sums over particles at each voxel; positions from the block's first voxel.
struct Sums {
  std::array<Row, kRows> weight, x, y, z, company, nearest;   // nearest: squared distance
  Sums() {
    for (auto* rows : {&weight, &x, &y, &z, &company}) rows->fill(Row::Zero());
    nearest.fill(Row::Constant(1e6f));
  }
};

/// Adds a particle at `at` to the voxels within `search`.
void add(Sums& sums, const Vec3f& at, float company, float search) {
  const float inverse = 1 / (search * search);
  each_row_within(at, search, [&](std::size_t row, float xy2, const Row& z2) {
    const Row d2 = z2 + xy2, w = weight_within(d2, inverse);
    sums.weight[row] += w;
    sums.x[row] += w * at[0];
    sums.y[row] += w * at[1];
    sums.z[row] += w * at[2];
    sums.company[row] += w * company;
    sums.nearest[row] = sums.nearest[row].min(d2);
  });
}

Row averaged_sphere(const Sums& sums, std::size_t row, const Row& inverse, const Scale& scale) {
  const Row x = sums.x[row] * inverse - float(row / kBlock), y = sums.y[row] * inverse - float(row % kBlock);
  const Row z = sums.z[row] * inverse - Row::LinSpaced(0, kBlock - 1);
  const Row company = sums.company[row] * inverse, nearest = sums.nearest[row].sqrt();
  const Row radius = scale.lone + (scale.radius - scale.lone) * company;
  const Row sphere = (x * x + y * y + z * z).sqrt() - radius;
  const Row least = nearest - (scale.lone + (scale.gap - scale.lone) * company), most = nearest - scale.lone + 2 * scale.lone * company;
  return (sums.weight[row] > 1e-9f).select(sphere.min(most).max(least).min(kFar), Row::Constant(kFar));
}

}  // namespace

Spheres rasterize(const Cloud& cloud, const std::vector<float>& company, const Blocks& blocks, const Scale& scale) {
  Spheres result = {Field(blocks.count() * kVoxels), Field(blocks.count() * kVoxels)};
  each_block(blocks, [&](std::size_t b) {
    Sums sums;
    const Vec3f origin = (blocks.coordinate[b] * kBlock).cast<float>();
    each_near(cloud, blocks.coordinate[b], scale.search, [&](std::uint32_t p) { add(sums, cloud.position[p] - origin, company[p], scale.search); });
    for (std::size_t r = 0; r < kRows; ++r) {
      const std::size_t at = b * kVoxels + r * kBlock;
      const Row inverse = 1 / sums.weight[r].max(1e-9f);
      row_at(&result.surface[at]) = averaged_sphere(sums, r, inverse, scale);
      row_at(&result.limit[at]) = scale.limit * (sums.company[r] * inverse).square().square();
    }
  });
  return result;
}

}  // namespace surface::field
