#pragma once
// The solids of a scene: the walls of the domain and the colliders that stand in it. Voxelised once (a cell is solid when its
// middle is inside); particles are kept out of the shapes themselves.
#include <cstdint>
#include <vector>

#include "sim/scene.h"
#include "sim/transfer/particles.h"

namespace sim {

template <int D>
struct Solids {
  std::vector<Shape> shapes;          // world metres
  base::Vec3 origin;                  // [m] lower corner of the domain
  double cell = 1;                    // [m]
  Lattice<D> lattice;
  std::vector<std::uint8_t> solid;    // by lattice index: 1 inside a solid or outside the domain

  Solids(const Scene&, const Lattice<D>&);

  /// Moves a site to the nearest place outside all solids and inside the domain. Returns whether it had to.
  template <class Real>
  bool push_out(Site<D, Real>&) const;
};

}  // namespace sim
