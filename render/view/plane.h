#pragma once
// The plane z = 0 of a two-dimensional shot on its picture.
#include <cstdint>

#include "base/vec.h"

namespace render::view {

/// Metres to pixels, the same scale on both axes; y points up in the plane and down in the picture.
struct Plane {
  Eigen::Vector2d lower, upper;  // [m] the domain's corners
  Eigen::Vector2d corner;        // [pixels] where its lower corner is
  double scale = 1;              // [pixels/m]

  Eigen::Vector2d pixel(const Eigen::Vector2d& p) const {
    return {corner.x() + scale * (p.x() - lower.x()), corner.y() - scale * (p.y() - lower.y())};
  }
  Eigen::Vector2d place(const Eigen::Vector2d& q) const {
    return {lower.x() + (q.x() - corner.x()) / scale, lower.y() - (q.y() - corner.y()) / scale};
  }
  bool holds(const Eigen::Vector2d& p) const { return (p.array() >= lower.array()).all() && (p.array() < upper.array()).all(); }
};

/// The whole domain in the middle of the picture, as large as margins [pixels] left and right, above and below, allow.
Plane fit(const base::Box& domain, std::int64_t width, std::int64_t height, const Eigen::Vector2d& margin);

}  // namespace render::view
