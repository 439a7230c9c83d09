#include <algorithm>
#include <cmath>

#include "surface/field/level_set.h"

namespace surface::field {
namespace {

constexpr double kApart = 1.75;       // [cells] between a liquid's surface and that of what stands in it, at most
constexpr float kInto = 0.75;           // [voxels] that a liquid's surface meets a solid's below it: where both crossed at a flat angle their seam would be ragged
constexpr float kBeyond = 0.5f;       // [voxels] that each of two liquids goes beyond the middle between them
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

/// Fills a field with what `value(voxel of the field, block, voxel of the block)` gives.
template <class Value>
Field made_of(const Blocks& blocks, const Value& value) {
  Field field(blocks.count() * kVoxels);
  each_block(blocks, [&](std::size_t b) {
    for (std::size_t v = 0; v < std::size_t(kVoxels); ++v) field[b * kVoxels + v] = value(b * kVoxels + v, b, v);
  });
  return field;
}

/// [voxels] From walls and colliders, no more than kFar.
float from_walls(const Room& room, const Lattice& lattice, const base::Vec3& voxel) {
  const base::Vec3 place = lattice.origin + lattice.voxel * voxel;
  double least = kFar * lattice.voxel;
  for (int a = 0; a < 3; ++a) {
    if (room.periodic[std::size_t(a)]) continue;
    if (room.walls[std::size_t(a)][0]) least = std::min(least, place[a] - room.domain.lower[a]);
    if (room.walls[std::size_t(a)][1]) least = std::min(least, room.domain.upper[a] - place[a]);
  }
  for (const Solid& solid : room.solids) least = std::min(least, solid.shape.distance(place));
  return std::max(-kFar, float(least / lattice.voxel));
}

}  // namespace

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

Field wet(const Blocks& blocks, const Field& own, const std::vector<Neighbour>& neighbours, const Room& room, const Lattice& lattice) {
  Field wetted = own;
  const auto meet = [&](const std::vector<Neighbour>& bodies, float further, const auto& limit) {
    const float radius = (std::min(float(kApart * room.cell / lattice.voxel), kWetReach - further) + further) / 2;
    const Field others = nearest_of(blocks, bodies, further);
    bool is_near = false;
    for (std::size_t i = 0; i < own.size() && !is_near; ++i) is_near = others[i] < 2 * radius && own[i] < kWetReach;
    if (!is_near) return;
    // What a ball of that radius cannot enter from outside of all of them.
    Field closed = distance_from_crossings(blocks, made_of(blocks, [&](std::size_t i, std::size_t b, std::size_t v) {
      float firm = std::min(own[i], others[i]);
      if (own[i] < kFar && others[i] < kFar) firm = std::min(firm, from_walls(room, lattice, voxel_of(blocks, b, v).cast<double>()));
      return firm - radius;
    }));
    for (int n = 0; n < kSmoothings; ++n) closed = binomial(blocks, closed, kDistance);
    wetted = made_of(blocks, [&](std::size_t i, std::size_t, std::size_t) {
      if (others[i] >= kFar) return wetted[i];
      return std::min(wetted[i], std::max({closed[i] + radius + kBlur, others[i] - 2 * radius, limit(own[i], others[i])}));
    });
  };
  std::vector<Neighbour> solid;
  for (const Neighbour& n : neighbours) {
    if (n.is_liquid) meet({n}, 0, [](float mine, float other) { return (mine - other) / 2 - kBeyond; });
    else solid.push_back(n);
  }
  if (!solid.empty()) meet(solid, kInto, [](float mine, float) { return mine - kWetReach; });
  return wetted;
}

}  // namespace surface::field
