#pragma once
// How long a step is, and how long FLIP keeps what it has.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/vec.h"
#include "sim/scene.h"

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

/// [s] What is left of a frame, or until something changes in it: not what rounding parts the two by.
inline double left_until(double change, double left) { return change < left * (1 - 1e-9) ? change : left; }

inline constexpr double kFlipCells = 49.75;   // steps of half a cell keep .99

/// [s] in which FLIP decays to PIC: sim.flip_time, or as long as `speed` [m/s], or a fall through the domain if that is faster, takes for kFlipCells;
/// `otherwise` where nothing moves.
inline double flip_time(const Options& o, const base::Vec3& gravity, double speed, double otherwise) {
  const double fall = std::sqrt(2 * gravity.cwiseAbs().dot(o.domain.size())), fastest = std::max(fall, speed);
  return o.flip_time.value_or(fastest > 0 ? kFlipCells * o.cell / fastest : otherwise);
}

}  // namespace sim
