#pragma once
// The free surface, for the pressure: how far the middles of the cells beside it are from it.
#include <vector>

#include "sim/fluid/cells.h"
#include "sim/transfer/particles.h"

namespace sim {

/// Signed distance [cells] from the surface, below 0 in liquid cells and above 0 in air; right to a fraction of a cell where a liquid and an
/// air cell meet, of the right sign everywhere, 0 in solid cells. From distances to the nearest particle less the one that makes the surface
/// of regularly seeded particles lie where they end, averaged with weights 1, 2, 1 along every axis over cells that are not solid: a level
/// surface stays level beside walls too. A liquid cell that the average puts outside (a drop) is as near to the surface as can be.
template <int D, class Real>
class SurfaceDistance {
 public:
  /// `particles_along`: how many a full cell has along an edge.
  explicit SurfaceDistance(int particles_along);
  void update(const CellRanges&, const Particles<D, Real>&, const std::vector<CellKind>&, const ActiveBlocks<D>&, std::vector<float>& distance);
  /// [cells] from a particle in the topmost layer of still liquid to the surface, as this measures it.
  double radius() const { return radius_; }

 private:
  double radius_;
  std::vector<float> nearest_;
};

/// Distance from the middle of liquid cell to the surface, along the axis towards an air cell [cells]: at least kLeastTheta of them.
inline double theta(float liquid, float air) {
  constexpr double kLeastTheta = 1e-2;
  const double t = double(liquid) / (double(liquid) - double(air));
  return t < kLeastTheta ? kLeastTheta : t > 1 ? 1 : t;
}

}  // namespace sim
