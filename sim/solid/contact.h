#pragma once
// What walls and colliders do to the velocity of grid nodes.
#include <vector>

#include "sim/colliders/solids.h"
#include "sim/scene.h"
#include "sim/transfer/place_set.h"

namespace sim {

/// A wall or collider as a node meets it.
struct Rubbing {
  Contact contact = Contact::separating;
  double friction = 0;   // [1]
};

/// The velocity a node in contact with a solid is left with, both as the solid sees it. `normal` points out of the solid. Sticky: none. Slip: what is along the solid. Separating: the
/// same when it moves inwards, less what Coulomb's friction takes, at most friction times the change along the normal; else as it is.
template <int D, class Real>
Vec<D, Real> after_contact(const Rubbing& solid, const Vec<D, Real>& normal, const Vec<D, Real>& velocity) {
  if (solid.contact == Contact::sticky) return Vec<D, Real>::Zero();
  const Real outward = velocity.dot(normal);
  if (solid.contact == Contact::separating && outward >= 0) return velocity;
  const Vec<D, Real> along = velocity - outward * normal;
  if (solid.contact == Contact::slip || solid.friction == 0) return along;
  const Real speed = along.norm(), taken = Real(solid.friction) * -outward;
  return speed > taken ? Vec<D, Real>(along * ((speed - taken) / speed)) : Vec<D, Real>(Vec<D, Real>::Zero());
}

/// The solids of a scene, for nodes. A node is in contact with a side of the domain when it lies on it or beyond, with a collider when it
/// lies on it or in it, and a particle that touches a solid reaches it: one that is nearer to the solid than six tenths of the spacing of particles, or all
/// of it where it is sticky. A body that falls would else be stopped by nodes of the floor that it only reaches, a cell above it. Of a box a node meets
/// the nearest face that does not lead into another collider; on an edge, the one that it moves into the least.
template <int D>
class NodeContacts {
 public:
  /// `solids` must outlive it.
  NodeContacts(const Scene&, const Solids<D>& solids);
  /// To where the colliders are.
  void follow() {
    if (solids_.speed() > 0) place();
  }
  bool empty() const { return sides_.empty() && bodies_.empty(); }
  /// Corrects the velocities of nodes of one block, in place: of those that a particle which touches a solid reaches. Returns what colliders that move
  /// have done on them: the change of momentum times the collider's velocity, in units of `mass` m^2/s^2.
  template <class Real>
  double apply(const Cell<D>& block, PlaceBits touched, const Real* mass, Vec<D, Real>* velocity) const;
  /// Whether anything nearest to a node of a block can touch a solid.
  bool is_near(const Cell<D>& block) const;
  /// Whether a particle touches a solid.
  bool touches(const Site<D, double>&) const;

 private:
  struct Side {
    int axis = 0, node = 0;        // contact at and beyond this node
    bool upper = false;
    Rubbing rubbing;
    bool has(int at) const { return upper ? at >= node : at <= node; }
  };
  struct Body {
    Shape shape;
    RigidMotion motion;
    Rubbing rubbing;
  };
  void place();
  /// The outward normal that a node at a place, which lies on or in near[k], meets with a velocity [m/s] that near[k] sees.
  base::Vec3 normal(const std::vector<const Body*>& near, std::size_t k, const base::Vec3& at, const base::Vec3& velocity) const;

  double cell_ = 1;
  double spacing_ = 1;   // [cells] of particles as seeded
  base::Vec3 origin_ = base::Vec3::Zero();
  const Solids<D>& solids_;
  std::vector<Side> sides_;
  std::vector<Body> bodies_;   // where they are now
};

}  // namespace sim
