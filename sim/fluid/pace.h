#pragma once
// How long a step of a liquid is.
#include <cmath>
#include <limits>

namespace sim {

/// [s] in which something that is `speed` [m/s] fast and falls freely with `gravity` [m/s^2] crosses `reach` [m].
inline double longest_step(double speed, double gravity, double reach) {
  return speed > 0 || gravity > 0 ? 2 * reach / (speed + std::sqrt(speed * speed + 4 * gravity * reach)) : std::numeric_limits<double>::infinity();
}

/// A step of at most what is left of a frame [s]; the rest is cut in two rather than leave a sliver.
inline double cut_to(double left, double dt) {
  if (dt >= left) return left;
  return 2 * dt > left ? left / 2 : dt;
}

}  // namespace sim
