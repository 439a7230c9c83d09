#pragma once
// Laws that a run must keep, and how one that it broke is told.
#include <cstdint>
#include <string>

#include "base/error.h"
#include "base/vec.h"

namespace sim {

/// A law that did not hold, and where.
struct Violation {
  std::string law;         // "finite", "mass", "momentum", "energy", "coefficients", "volume", "motion", "step", "pressure"
  std::string what;
  std::string remedy;      // what to change
  int body = -1;           // number in the scene from 0; -1: not one alone
  std::string where = {};  // particle, body, cell and position, where `what` does not say it
  std::int64_t since = 0;  // first frame that was not well any more; 0: not known
};

/// A violation in a frame, exit 3: "frame 12: energy: 3.1 J where 2 J were left; the fastest is particle 7 of body left, cell (3, 4), (0.31, 0.42, 0)
/// m;
/// well up to frame 8".
class Unstable : public base::Error {
 public:
  Unstable(std::int64_t frame, Violation);
  const Violation& violation() const { return violation_; }
  std::int64_t frame() const { return frame_; }

 private:
  std::int64_t frame_;
  Violation violation_;
};

/// Mass [kg] and momentum [kg m/s] of all particles or of the whole grid. Faces have a mass for each axis, nodes the same for all.
struct MassAndMomentum {
  base::Vec3 mass = base::Vec3::Zero(), momentum = base::Vec3::Zero();
};

enum class Places { nodes, faces };

/// What P2G must keep: weights sum to 1 and their gradients to 0, so that no mode but the constant has momentum, and no stress moves the whole.
/// Momentum is compared within the rounding of `scale` [kg m/s]. What is `crowded`, so many times as dense as it was seeded, has longer sums and more
/// rounding. Throws Unstable "mass", "momentum".
void check_p2g(std::int64_t frame, Places, const MassAndMomentum& grid, const MassAndMomentum& particles, double scale, bool single_precision,
               double crowded = 1);

}  // namespace sim
