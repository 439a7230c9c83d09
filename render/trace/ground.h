#pragma once
// What everything stands on: the domain's floor, without end, or a studio's backdrop.
#include <algorithm>
#include <limits>

#include "render/trace/geometry.h"

namespace render::trace {

/// A floor turns into the sky's horizon away from the domain, so that no edge is seen. A cyclorama is a floor that bends up behind the
/// domain, as the camera sees it, to a wall without end.
struct Ground {
  enum class Form { none, floor, cyclorama };
  Form form = Form::floor;
  Material material;
  float z = 0;                                             // [m]
  Eigen::Vector2f middle = Eigen::Vector2f::Zero();        // [m]
  float solid_to = 0, gone_from = 1;                       // [m] distances from the middle between which a floor fades
  Eigen::Vector2f back = Eigen::Vector2f::UnitY();         // unit; cyclorama
  float bend_from = 0, bend = 1;                           // [m] from the middle to where it bends, radius

  struct Met {
    float t = std::numeric_limits<float>::infinity();
    Vec3f normal = Vec3f::UnitZ();
  };
  /// Where a ray from above it meets it.
  Met meet(const Ray& ray) const {
    if (form == Form::none) return {};
    const Met floor{.t = ray.direction.z() < 0 ? std::max(0.0f, (z - ray.origin.z()) / ray.direction.z()) : Met{}.t};
    return form == Form::floor ? floor : meet_cyclorama(ray, floor);
  }
  /// Share of what is behind that shows.
  float fade(const Vec3f& point) const {
    if (form != Form::floor) return 0;
    const float r = (point.head<2>() - middle).norm(), s = std::clamp((r - solid_to) / (gone_from - solid_to), 0.0f, 1.0f);
    return s * s * (3 - 2 * s);
  }

 private:
  Met meet_cyclorama(const Ray&, const Met& floor) const;
};

}  // namespace render::trace
