#include <algorithm>
#include <cmath>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

constexpr float kInto = 1;            // [voxels] that a liquid's surface meets a solid's below it: where both crossed at a flat angle their seam would be ragged
constexpr float kMost = kFar - 1;     // [voxels] that a liquid reaches out
constexpr float kOver = 0.5f;         // [voxels] that two liquids overlap
constexpr float kBlur = 0.15f;        // [voxels] by which what is closed may be off where nothing was to be closed
constexpr int kSmoothings = 2;        // of what is closed

/// The distances of a body at the voxels of another one's block.
struct Seen {
  const float* values;   // none: all are `everywhere`
  float everywhere;
  float operator[](std::size_t v) const { return values ? values[v] : everywhere; }
};

Seen seen_at(const Index3& coordinate, const Neighbour& of) {
  const std::int32_t entry = of.blocks->directory.at(coordinate);
  if (entry >= 0) return {of.distance->data() + std::size_t(entry) * kVoxels, 0};
  return {nullptr, entry == kWater ? kDistance.water : kDistance.air};
}

/// The least of the distances of some bodies at the voxels of `blocks`, plus `further`.
Field nearest_of(const Blocks& blocks, const std::vector<Neighbour>& bodies, float further) {
  Field nearest(blocks.count() * kVoxels, kFar);
  each_block(blocks, [&](std::size_t b) {
    for (const Neighbour& body : bodies) {
      const Seen seen = seen_at(blocks.coordinate[b], body);
      for (std::size_t v = 0; v < std::size_t(kVoxels); ++v) nearest[b * kVoxels + v] = std::min(nearest[b * kVoxels + v], seen[v] + further);
    }
  });
  return nearest;
}

/// What a ball of that radius [voxels] cannot enter from outside of both `a` and `b`.
Field closed(const Blocks& blocks, const Field& a, const Field& b, float radius) {
  Field grown(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) grown[i] = std::min(a[i], b[i]) - radius;
  grown = distance_from_crossings(blocks, grown);
  for (float& d : grown) d += radius;
  for (int i = 0; i < kSmoothings; ++i) grown = binomial(blocks, grown, kDistance);
  return grown;
}

}  // namespace

void wet(const Blocks& blocks, const std::vector<Neighbour>& neighbours, float apart, Field& distance) {
  const Field dry = distance;
  const auto meet = [&](const std::vector<Neighbour>& bodies, float further, const auto& limit) {
    const float radius = (std::min(apart, kMost - further) + further) / 2;
    const Field others = nearest_of(blocks, bodies, further);
    bool is_near = false;
    for (std::size_t i = 0; i < dry.size() && !is_near; ++i) is_near = dry[i] + others[i] < 2 * radius;
    if (!is_near) return;
    const Field filled = closed(blocks, dry, others, radius);
    for (std::size_t i = 0; i < dry.size(); ++i)
      distance[i] = std::min(distance[i], std::max({filled[i] + kBlur, others[i] - 2 * radius, limit(dry[i], others[i])}));
  };
  std::vector<Neighbour> solid;
  for (const Neighbour& n : neighbours) {
    if (n.is_liquid) meet({n}, 0, [](float own, float other) { return (own - other) / 2 - kOver; });
    else solid.push_back(n);
  }
  if (!solid.empty()) meet(solid, kInto, [](float own, float) { return own - kMost; });
}

}  // namespace surface::field
