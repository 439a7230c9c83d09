#include <array>
#include <cmath>
#include <utility>

#include "surface/field/footprint.h"
#include "surface/field/level_set.h"

namespace surface::field {
namespace {

using base::Vec3f;

struct Sums {
  std::array<Row, kRows> weight, x, y, z;
  std::array<bool, kRows> wanted;   // rows that hold voxels of the band
  Sums() {
    for (auto* rows : {&weight, &x, &y, &z}) rows->fill(Row::Zero());
  }
};

void add(Sums& sums, const Vec3f& at, const Vec3f& velocity, float search) {
  const float inverse = 1 / (search * search);
  each_row_within(at, search, [&](std::size_t row, float xy2, const Row& z2) {
    if (!sums.wanted[row]) return;
    const Row w = weight_within(z2 + xy2, inverse);
    sums.weight[row] += w;
    sums.x[row] += w * velocity[0];
    sums.y[row] += w * velocity[1];
    sums.z[row] += w * velocity[2];
  });
}

/// Velocity where a particle is near, and where it is: 1, else 0.
struct Known {
  std::array<Field, 3> component;
  Field here;
};

Known near_particles(const Cloud& cloud, const Blocks& blocks, const Field& distance, float band, float search) {
  Known known;
  for (Field* f : {&known.component[0], &known.component[1], &known.component[2], &known.here}) f->assign(distance.size(), 0);
  each_block(blocks, [&](std::size_t b) {
    Sums sums;
    bool any = false;
    for (std::size_t r = 0; r < kRows; ++r) any |= sums.wanted[r] = (row_at(&distance[b * kVoxels + r * kBlock]).abs() < band).any();
    if (!any) return;
    const Vec3f origin = (blocks.coordinate[b] * kBlock).cast<float>();
    each_near(cloud, blocks.coordinate[b], search, [&](std::uint32_t p) { add(sums, cloud.position[p] - origin, cloud.velocity[p], search); });
    for (std::size_t r = 0; r < kRows; ++r) {
      const std::size_t at = b * kVoxels + r * kBlock;
      const Row weight = sums.weight[r], inverse = (weight > 0).select(1 / weight, Row::Zero());
      row_at(&known.component[0][at]) = sums.x[r] * inverse;
      row_at(&known.component[1][at]) = sums.y[r] * inverse;
      row_at(&known.component[2][at]) = sums.z[r] * inverse;
      row_at(&known.here[at]) = (weight > 0).cast<float>();
    }
  });
  return known;
}

/// Mean of the 3^3 voxels around (i, j, k) that are known, if any is.
bool mean_of_known(const Padded (&component)[3], const Padded& here, int i, int j, int k, Vec3f& mean) {
  float n = 0;
  Vec3f sum = Vec3f::Zero();
  for (int x = i - 1; x <= i + 1; ++x)
    for (int y = j - 1; y <= j + 1; ++y)
      for (int z = k - 1; z <= k + 1; ++z)
        if (here[x][y][z] == 1) {
          sum += Vec3f(component[0][x][y][z], component[1][x][y][z], component[2][x][y][z]);
          n += 1;
        }
  if (n > 0) mean = sum / n;
  return n > 0;
}

/// Gives the voxels of the band that no particle reaches the mean of their neighbours; one layer.
Known grown(const Blocks& blocks, const Known& known, const Field& distance, float band) {
  Known next = known;
  each_block(blocks, [&](std::size_t b) {
    Padded component[3], here;
    bool loaded = false;
    for (int v = 0; v < kVoxels; ++v) {
      const std::size_t at = b * kVoxels + std::size_t(v);
      if (known.here[at] == 1 || std::fabs(distance[at]) >= band) continue;
      if (!loaded) {
        for (std::size_t a = 0; a < 3; ++a) load(blocks, known.component[a], {0, 0}, b, component[a]);
        load(blocks, known.here, {0, 0}, b, here);
        loaded = true;
      }
      Vec3f mean;
      if (!mean_of_known(component, here, v / kRows + 1, v / kBlock % kBlock + 1, v % kBlock + 1, mean)) continue;
      for (int a = 0; a < 3; ++a) next.component[std::size_t(a)][at] = mean[a];
      next.here[at] = 1;
    }
  });
  return next;
}

}  // namespace

std::array<Field, 3> velocity(const Cloud& cloud, const Blocks& blocks, const Field& distance, float band, const Scale& scale) {
  Known known = near_particles(cloud, blocks, distance, band, scale.search);
  for (float reached = scale.search; reached < scale.furthest + band; ++reached) known = grown(blocks, known, distance, band);
  return std::move(known.component);
}

}  // namespace surface::field
