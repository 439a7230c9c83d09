#pragma once
// The solids of a scene: the walls of the domain and the colliders that stand in it. Voxelised once (a cell is solid when its
// middle is inside); particles are kept out of the shapes themselves. Periodic sides are no walls.
#include <cstdint>
#include <vector>

#include "sim/scene.h"
#include "sim/transfer/particles.h"

namespace sim {

/// A particle as solids meet it.
template <int D, class Real>
struct Moving {
  Site<D, Real> site;
  Vec<D, Real> velocity;              // [m/s]
};

template <int D>
struct Solids {
  std::vector<Shape> shapes;          // world metres; images across periodic sides included
  base::Vec3 origin;                  // [m] lower corner of the domain
  double cell = 1;                    // [m]
  Lattice<D> lattice;
  std::vector<std::uint8_t> solid;    // by lattice index: 1 inside a solid or behind a wall

  Solids(const Scene&, const Lattice<D>&);

  /// Moves a particle to the nearest place outside all solids and inside the domain, across periodic sides where it left through one;
  /// what its velocity had towards a solid that it was pushed out of is lost. Returns how far it was pushed [cells].
  template <class Real>
  double push_out(Moving<D, Real>&) const;
};

}  // namespace sim
