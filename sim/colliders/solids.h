#pragma once
// The solids of a scene: the walls of the domain and the colliders in it, which may move. A cell is solid when its middle is inside;
// particles are kept out of the shapes themselves. Periodic and open sides are no walls. Nothing is stored by cell: whoever asks, asks the
// shapes.
#include <algorithm>
#include <bitset>
#include <vector>

#include "sim/scene.h"
#include "sim/transfer/particles.h"

namespace sim {

/// A box that stands on a wall goes on behind it: the side in the wall is no way out. So does one that spans a periodic axis.
/// One that turns goes on along its axis alone.
Collider continued_through_walls(Collider, const Options&);
/// [m] Of its thinnest part; of a box that goes on along an axis without end, across the others.
double thickness(const Shape&, int dimension);
/// Whether contact at the grid's nodes finds it: it is a cell thick, as it goes on through walls, and has a node; at all times.
bool is_met_by_nodes(const Collider&, const Options&);

/// A particle as solids meet it.
template <int D, class Real>
struct Moving {
  Site<D, Real> site;
  Vec<D, Real> velocity;              // [m/s]
  double work = 0;                    // [J/kg] that solids which move have done on it
};

template <int D>
struct Solids {
  std::vector<Shape> shapes;          // world metres, where they are now; images across periodic sides included
  std::vector<RigidMotion> motions;   // of each, from now on
  base::Vec3 origin;                  // [m] lower corner of the domain
  double cell = 1;                    // [m]
  Lattice<D> lattice;
  std::array<std::array<bool, 2>, std::size_t(D)> open{};   // sides that nothing closes, by axis

  /// As they are at t = 0.
  Solids(const Scene&, const Lattice<D>&);

  /// [m] What lies `on` [cells] along each axis from a cell's lower corner.
  base::Vec3 place_in(const Cell<D>& at, double on) const {
    base::Vec3 place = origin;
    for (int a = 0; a < D; ++a) place[a] += (at[a] + on) * cell;
    return place;
  }

  /// To where the colliders are at a time [s].
  void move_to(double time);
  double time() const { return time_; }
  /// Of the fastest place of a collider that moves at some time [m/s]; 0 when none does.
  double speed() const { return speed_; }
  /// [s] When a collider begins to move or stops next, after a time.
  double next_change(double time) const;
  /// At t = 0, continued through the walls that they stand on.
  const std::vector<Collider>& colliders() const { return colliders_; }
  struct Placed {
    Shape shape;
    RigidMotion motion;
  };
  /// One of the colliders where it is now, and images of it that come nearer to a periodic side than `margin` [m].
  std::vector<Placed> placed(const Collider&, double margin) const;
  /// [cells] that a collider moves in a step.
  double longest_way() const { return options_.cfl; }

  /// Outside the domain, and not straight out of an open side.
  bool behind_wall(const Cell<D>& at) const {
    for (std::size_t a = 0; a < std::size_t(D); ++a)
      if ((at[a] < 0 && !open[a][0]) || (at[a] >= lattice.cells[a] && !open[a][1])) return true;
    return false;
  }
  /// Inside a solid or behind a wall; of an image what its cell is.
  bool solid(const Cell<D>&) const;
  /// The same for all cells of a block. Shapes that are farther from its middle than its corners, or hold all of it, are asked once.
  std::bitset<std::size_t(Lattice<D>::kCellsPerBlock)> solid_cells(const Cell<D>& block) const;

  /// Whether there is anything to be kept out of, or to leave through: a collider or a side that is not periodic.
  bool any() const {
    for (int a = 0; a < D; ++a)
      if (!lattice.periodic[std::size_t(a)]) return true;
    return !shapes.empty();
  }

  /// Whether nothing can touch a particle of this cell: no collider is there, and no side of the domain beside it.
  bool is_far_inside(const Cell<D>& at) const {
    for (std::size_t a = 0; a < std::size_t(D); ++a)
      if (at[a] <= 0 || at[a] >= lattice.cells[a] - 1) return false;
    return std::none_of(reaches_.begin(), reaches_.end(), [&](const Reach& reach) { return reach.holds(at); });
  }

  /// Moves a particle to the nearest place outside all solids and within the walls, across periodic sides where it left through one;
  /// what its velocity had towards a solid that it was pushed out of, beyond the solid's own, is lost. Returns how far it was pushed [cells].
  template <class Real>
  double push_out(Moving<D, Real>&) const;

  /// Whether a collider is so thin that what moves as far as a step may could come out of it on the other side.
  bool has_thin() const { return !thin_.empty(); }
  /// Ends a particle's way in a step of `dt` [s] where it comes into a thin collider, for push_out to go on from.
  template <class Real>
  void stop_in_thin(const Site<D, Real>& from, double dt, Site<D, Real>& to) const;

 private:
  std::vector<Collider> colliders_;
  Options options_;
  double time_ = 0;                   // [s]
  double speed_ = 0;                  // [m/s]
  /// The cells from which a particle may touch a shape.
  struct Reach {
    Cell<D> first, last;
    Reach(const Shape&, const Solids&);
    bool holds(const Cell<D>& at) const {
      for (std::size_t a = 0; a < std::size_t(D); ++a)
        if (at[a] < first[a] || at[a] > last[a]) return false;
      return true;
    }
  };
  std::vector<Reach> reaches_;        // of each of `shapes`
  struct Thin {
    Placed solid;                     // as in `shapes`, and images that a particle may come to before it is back in the domain
    double thickness;                 // [m]
  };
  std::vector<Thin> thin_;
};

}  // namespace sim
