#pragma once
// The level set of a collider that is a mesh: signed distances on a sparse grid, computed once and by whoever needs them first.
//
// Exact distances at points `spacing` apart, kBand of them deep on either side of the surface, in bricks; linear between the points. Bricks that are
// farther from it keep the distance of their middle alone.
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/vec.h"
#include "sim/closed_mesh.h"

namespace sim {

class MeshDistance {
 public:
  /// For cells of `cell` [m], with points on corners and middles of the cells of a grid that has one at `origin` [m]; closer where the mesh is thinner
  /// than they are apart. Nothing is asked outside of `within` [m] but whether it is inside the mesh. `objection` says afterwards what is wrong: one that is
  /// objected to has no distances.
  MeshDistance(std::shared_ptr<const ClosedMesh>, double cell, const base::Vec3& origin, const base::Box& within);

  /// Empty, or why there are none: walls too thin for the cells, or too many bricks.
  const std::string& objection() const { return objection_; }
  /// Computes them, the first time. Until then `distance` has their sign and is no more than they are. Not to be called while others ask for distances.
  void prepare() const;
  /// [m] Below 0 inside; within kBand points of the surface the distance, farther off no more than it. `normal` (when given) points away from the nearest
  /// place of the surface, as far as that is known, and is of length 1.
  double distance(const base::Vec3& at, base::Vec3* normal) const;
  /// [m] What the mesh is at least as thick as nearly everywhere: a power of two of cells, eight at the most.
  double thickness() const { return thickness_; }
  /// The part of its surface [1] under which there is less than half a cell, or less than points are apart.
  double part_too_thin() const { return part_too_thin_; }

 private:
  static constexpr int kEdge = 8, kPoints = kEdge + 1;   // of a brick: intervals and points along an edge
  static constexpr int kBand = 8;                        // [points]
  static constexpr std::size_t kPerBrick = std::size_t(kPoints) * kPoints * kPoints;
  /// A brick away from the surface.
  struct Far {
    float distance;       // [m] of its middle
    base::Vec3f normal;   // there
  };

  void compute() const;
  double linear(const float* points, const base::Vec3& in_brick, base::Vec3* normal) const;
  base::Vec3 middle_of(std::int64_t brick) const;

  std::shared_ptr<const ClosedMesh> mesh_;
  std::string objection_;
  base::Vec3 lower_ = base::Vec3::Zero();  // [m] lower corner of the bricks
  double spacing_ = 0, thickness_ = 0;     // [m]
  double part_too_thin_ = 0;               // [1]
  std::array<std::int64_t, 3> bricks_{};   // along each axis
  mutable std::once_flag is_computed_;
  mutable std::vector<std::int32_t> brick_;   // of each: place in points_, or below 0 the one in far_, counted down from -1; empty until computed
  mutable std::vector<float> points_;         // [m] kPerBrick each, last axis fastest
  mutable std::vector<Far> far_;
};

}  // namespace sim
