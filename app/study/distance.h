#pragma once
// How far apart two frames of the same shot lie, whatever particles and cells each was made of.
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/frame.h"
#include "sim/scene.h"
#include "surface/surface.h"

namespace app {

/// Particles seen along fixed directions: what transport distances are computed from. Every particle counts the same.
class Projections {
 public:
  Projections(const sim::Frame&, std::int64_t dimension);
  /// Sliced Wasserstein distance of order 1 [Bonneel15], in metres: the mean over the directions of the one-dimensional transport distance, scaled so
  /// that a cloud that is moved by d lies d away. 0 where either holds no particle.
  double distance(const Projections& other) const;

 private:
  std::int64_t dimension_;
  std::vector<std::vector<float>> sorted_;   // [m] by direction
};

/// Vorticity on a grid of edge `cell` [m], from the particles' velocities spread linearly over it, by central differences; only where cells are a
/// quarter full.
class VorticityGrid {
 public:
  VorticityGrid(const sim::Frame&, const sim::Options& seeded, double cell);
  /// Root of the sum of squares of the difference over that of this one; where only one has a value, the other counts as 0. Empty where this one
  /// has no vorticity at all.
  std::optional<double> distance(const VorticityGrid& other) const;

 private:
  std::vector<base::Vec3> curl_;             // [1/s]
  std::vector<char> known_;
};

/// Mean distance [m] of the vertices of each surface to the other, both ways: to the tangent plane of the nearest vertex, or to the vertex where it
/// is farther than `reach` [m], some voxels. Empty where either has no vertex.
std::optional<double> surface_distance(const surface::Mesh&, const surface::Mesh&, double reach);

}  // namespace app
