#pragma once
// What a closed surface of triangles encloses. In: triangles that any program made. Out: whether a place is inside.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/vec.h"

namespace sim {

class ClosedMesh {
 public:
  using Triangle = std::array<std::uint32_t, 3>;
  /// Corners at the same place are one. `objection` says afterwards what is wrong with it; one that is objected to encloses nothing.
  ClosedMesh(const std::vector<base::Vec3f>& corners, const std::vector<Triangle>& triangles, double scale, const base::Vec3& translate);

  /// Empty, or why it encloses nothing: an edge with a triangle on one side only, or with two that turn the same way.
  const std::string& objection() const { return objection_; }
  /// Whether the surface winds around a place: pieces that overlap are one, a piece turned inside out is a hole in what holds it. Places within
  /// rounding of the surface are on either side of it.
  bool inside(const base::Vec3& at) const;
  const base::Box& bounds() const { return bounds_; }
  std::size_t triangles() const { return triangles_.size(); }
  /// Corners of a triangle [m], counter-clockwise seen from outside.
  std::array<base::Vec3, 3> triangle(std::size_t t) const {
    const Triangle& c = triangles_[t];
    return {corners_[c[0]], corners_[c[outward_ > 0 ? 1 : 2]], corners_[c[outward_ > 0 ? 2 : 1]]};
  }

 private:
  void check_edges();
  void sort_into_columns();
  std::array<int, 2> column_of(const base::Vec3& at) const;

  std::vector<base::Vec3> corners_;       // [m]
  std::vector<Triangle> triangles_;
  base::Box bounds_;
  int outward_ = 1;        // -1: its triangles point inwards
  std::string objection_;
  // Columns along z over a square pattern of x and y, and the triangles over each.
  std::array<int, 2> columns_{1, 1};
  std::vector<std::uint32_t> begin_, over_;
};

}  // namespace sim
