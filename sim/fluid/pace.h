#pragma once
// How long a step of a liquid is.
#include <cmath>

namespace sim {

/// [s] in which something that is `speed` [m/s] fast and falls freely with `gravity` [m/s^2] crosses `reach` [m]; at most `left` [s], and the rest of a
/// frame is cut in two rather than leave a sliver.
inline double longest_step(double speed, double gravity, double reach, double left) {
  const double dt = speed > 0 || gravity > 0 ? 2 * reach / (speed + std::sqrt(speed * speed + 4 * gravity * reach)) : left;
  if (dt >= left) return left;
  return 2 * dt > left ? left / 2 : dt;
}

}  // namespace sim
