#pragma once
// The solids of a scene: the walls of the domain and the colliders that stand in it. A cell is solid when its middle is inside;
// particles are kept out of the shapes themselves. Periodic sides are no walls. Nothing is stored by cell: whoever asks, asks the shapes.
#include <bitset>
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

  Solids(const Scene&, const Lattice<D>&);

  /// Inside a solid or behind a wall; of an image what its cell is.
  bool solid(const Cell<D>&) const;
  /// The same for all cells of a block. Shapes that are farther from its middle than its corners, or hold all of it, are asked once.
  std::bitset<std::size_t(Lattice<D>::kCellsPerBlock)> solid_cells(const Cell<D>& block) const;

  /// Whether there is anything to be kept out of: a collider or a wall.
  bool any() const {
    for (int a = 0; a < D; ++a)
      if (!lattice.periodic[std::size_t(a)]) return true;
    return !shapes.empty();
  }

  /// Moves a particle to the nearest place outside all solids and inside the domain, across periodic sides where it left through one;
  /// what its velocity had towards a solid that it was pushed out of is lost. Returns how far it was pushed [cells].
  template <class Real>
  double push_out(Moving<D, Real>&) const;
};

}  // namespace sim
