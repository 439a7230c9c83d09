#pragma once
// How something rigid moves at one moment.
#include "base/vec.h"

namespace sim {

struct RigidMotion {
  base::Vec3 velocity = base::Vec3::Zero();  // [m/s] of the pivot
  base::Vec3 spin = base::Vec3::Zero();      // [rad/s]
  base::Vec3 pivot = base::Vec3::Zero();     // [m]; of what does not turn 0, so that motions which are the same compare equal
  /// [m/s] of the solid at a place [m].
  base::Vec3 at(const base::Vec3& place) const { return spin.isZero(0) ? velocity : base::Vec3(velocity + spin.cross(place - pivot)); }
  /// The same of an image of the solid, [m] away.
  RigidMotion moved(const base::Vec3& by) const { return spin.isZero(0) ? *this : RigidMotion{velocity, spin, pivot + by}; }
  bool rests() const { return velocity.isZero(0) && spin.isZero(0); }
  bool operator==(const RigidMotion&) const = default;
};

}  // namespace sim
