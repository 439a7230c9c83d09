#pragma once
// Small vectors shared by all folders. Lengths in metres unless a declaration says otherwise.
#include <Eigen/Core>
#include <Eigen/Geometry>   // cross products

namespace base {

using Vec3 = Eigen::Vector3d;
using Vec3f = Eigen::Vector3f;

/// Axis-aligned box; lower <= upper in every component when valid.
struct Box {
  Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();
  Vec3 size() const { return upper - lower; }
};

}  // namespace base
