#include <algorithm>
#include <cmath>
#include <optional>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

/// Distance at voxels from their neighbours', each axis giving the nearer of two: |grad d| = 1, upwind [Zhao05].
Row eikonal(const Row& x, const Row& y, const Row& z) {
  const Row a = x.min(y).min(z), c = x.max(y).max(z), b = x.min(y).max(x.max(y).min(z));   // a <= b <= c
  const Row one = a + 1;
  const Row two = 0.5f * (a + b + (2 - (a - b).square()).max(0.0f).sqrt());
  const Row sum = a + b + c, three = (sum + (sum * sum - 3 * (a * a + b * b + c * c - 1)).max(0.0f).sqrt()) / 3;
  return (one <= b).select(one, (two <= c).select(two, three));
}

/// Spreads the distance of the voxels that are `known` (1, else 0) to the others, whose sign is theirs already; up to kFar.
Field spread(const Blocks& blocks, Field distance, const Field& known, int passes) {
  Field next(distance.size());
  for (int pass = 0; pass < passes; ++pass) {
    each_block(blocks, [&](std::size_t b) {
      Padded d;
      load(blocks, distance, kDistance, b, d);
      for (int i = 1; i <= kBlock; ++i)
        for (int j = 1; j <= kBlock; ++j) {
          const std::size_t at = b * kVoxels + std::size_t(((i - 1) * kBlock + j - 1) * kBlock);
          const auto row = [&](int x, int y, int z) { return row_at(&d[x][y][z]); };
          const Row own = row(i, j, 1), sign = (own < 0).select(Row::Constant(-1), Row::Constant(1));
          const auto nearer = [&](const Row& below, const Row& above) -> Row { return (sign * below).min(sign * above).abs(); };
          const Row best =
              eikonal(nearer(row(i - 1, j, 1), row(i + 1, j, 1)), nearer(row(i, j - 1, 1), row(i, j + 1, 1)), nearer(row(i, j, 0), row(i, j, 2)));
          row_at(&next[at]) = (row_at(&known[at]) > 0).select(own, sign * own.abs().min(best));
        }
    });
    distance.swap(next);
  }
  return distance;
}

/// Distance to the plane through the crossings on the three axes: 1 / sqrt(sum 1 / t^2); none when no axis crosses.
std::optional<float> crossing_distance(const Padded& d, int i, int j, int k) {
  const float own = d[i][j][k];
  const auto nearer = [&](float a, float b) {
    float t = 2;   // fraction of a voxel; above 1: no crossing
    for (const float other : {a, b})
      if ((other < 0) != (own < 0)) t = std::min(t, own / (own - other));
    return t;
  };
  float sum = 0;
  for (const float t : {nearer(d[i - 1][j][k], d[i + 1][j][k]), nearer(d[i][j - 1][k], d[i][j + 1][k]), nearer(d[i][j][k - 1], d[i][j][k + 1])})
    if (t <= 1) sum += 1 / std::max(t * t, 1e-8f);
  if (!(sum > 0)) return {};
  return std::copysign(1 / std::sqrt(sum), own);
}

/// Distances spread in `passes` from the voxels where `near(d, i, j, k)` knows one; elsewhere it gives nothing.
template <class Near>
Field distance_from(const Blocks& blocks, const Field& field, int passes, const Near& near) {
  Field start(field.size());
  Field known(field.size());
  each_block(blocks, [&](std::size_t b) {
    Padded d;
    load(blocks, field, kDistance, b, d);
    for (int v = 0; v < kVoxels; ++v) {
      const std::size_t at = b * kVoxels + std::size_t(v);
      const int i = v / (kBlock * kBlock) + 1, j = v / kBlock % kBlock + 1, k = v % kBlock + 1;
      const std::optional<float> distance = near(d, i, j, k);
      known[at] = distance.has_value();
      start[at] = distance.value_or(std::copysign(kFar, d[i][j][k]));
    }
  });
  return spread(blocks, std::move(start), known, passes);
}

}  // namespace

Field distance_from_crossings(const Blocks& blocks, const Field& field) {
  constexpr int kPasses = 8;   // a diagonal step takes three
  return distance_from(blocks, field, kPasses, crossing_distance);
}

Field distance_from_slope(const Blocks& blocks, const Field& field) {
  constexpr float kSmooth = 2.2f;   // a vertex normal reads voxels up to two from the surface
  constexpr int kPasses = 4;        // from 2.2 to beyond the band
  return distance_from(blocks, field, kPasses, [](const Padded& d, int i, int j, int k) -> std::optional<float> {
    const Eigen::Vector3f slope(d[i + 1][j][k] - d[i - 1][j][k], d[i][j + 1][k] - d[i][j - 1][k], d[i][j][k + 1] - d[i][j][k - 1]);
    const float near = d[i][j][k] / std::clamp(slope.norm() / 2, 0.85f, 1.2f);   // outside this range phi is a ridge, not a slope
    if (!(std::fabs(near) < kSmooth)) return {};
    return near;
  });
}

}  // namespace surface::field
