#include "render/view/plane.h"

#include <algorithm>

namespace render::view {

Plane fit(const base::Box& domain, std::int64_t width, std::int64_t height, const Eigen::Vector2d& margin) {
  Plane plane{.lower = domain.lower.head<2>(), .upper = domain.upper.head<2>(), .corner = {}, .scale = 1};
  const Eigen::Vector2d picture(static_cast<double>(width), static_cast<double>(height)), size = plane.upper - plane.lower;
  plane.scale = std::max((picture - 2 * margin).cwiseQuotient(size).minCoeff(), 1e-9);
  plane.corner = 0.5 * Eigen::Vector2d(picture.x() - plane.scale * size.x(), picture.y() + plane.scale * size.y());
  return plane;
}

}  // namespace render::view
