#include "sim/solid/contact.h"

#include <cmath>

namespace sim {
namespace {

/// [cells] Nearer than that to a collider is on it, whatever rounding says of a face in a plane of nodes.
constexpr double kOnFace = 1e-6;

}  // namespace

template <int D>
NodeContacts<D>::NodeContacts(const Scene& scene) : cell_(scene.options.cell), origin_(scene.options.domain.lower) {
  const Options& o = scene.options;
  const auto contact_of = [](sim::Side side) {
    return side == sim::Side::sticky ? Contact::sticky : side == sim::Side::slip ? Contact::slip : Contact::separating;
  };
  for (int a = 0; a < D; ++a) {
    if (o.periodic(a)) continue;
    const int cells = int(std::lround(o.domain.size()[a] / o.cell));
    sides_.push_back({a, 0, false, {contact_of(o.boundary[std::size_t(a)][0]), o.wall_friction}});
    sides_.push_back({a, cells, true, {contact_of(o.boundary[std::size_t(a)][1]), o.wall_friction}});
  }
  for (const Collider& collider : scene.colliders)
    for (const Shape& shape : with_images(continued_through_walls(collider.shape, o), o)) bodies_.push_back({shape, {collider.contact, collider.friction}});
}

template <int D>
template <class Real>
void NodeContacts<D>::apply(const Cell<D>& block, Vec<D, Real>* velocity) const {
  constexpr int edge = Lattice<D>::kBlock, count = Lattice<D>::kCellsPerBlock;
  // Colliders first: what lies on a wall too may then not be pushed through it.
  const double reach = cell_ * edge * std::sqrt(double(D)) / 2;   // from the middle of the nodes to the farthest
  base::Vec3 middle = origin_;
  for (int a = 0; a < D; ++a) middle[a] += cell_ * (block[a] * edge + (edge - 1) / 2.0);
  for (const Body& body : bodies_) {
    if (body.shape.distance(middle) > reach) continue;
    for (int i = 0; i < count; ++i) {
      const Cell<D> node = Lattice<D>::cell_in(block, i);
      base::Vec3 at = origin_, normal;
      for (int a = 0; a < D; ++a) at[a] += cell_ * node[a];
      if (body.shape.distance(at, &normal) >= kOnFace * cell_) continue;
      const Vec<D, Real> outward = normal.head<D>().template cast<Real>();
      velocity[i] = after_contact<D, Real>(body.rubbing, outward, velocity[i]);
    }
  }
  for (const Side& side : sides_) {
    const int first = block[side.axis] * edge;
    if (side.upper ? first + edge - 1 < side.node : first > side.node) continue;
    const Vec<D, Real> outward = Vec<D, Real>::Unit(side.axis) * Real(side.upper ? -1 : 1);
    for (int i = 0; i < count; ++i) {
      const int at = Lattice<D>::cell_in(block, i)[side.axis];
      if (side.upper ? at >= side.node : at <= side.node) velocity[i] = after_contact<D, Real>(side.rubbing, outward, velocity[i]);
    }
  }
}

template class NodeContacts<2>;
template class NodeContacts<3>;
template void NodeContacts<2>::apply(const Cell<2>&, Vec<2, float>*) const;
template void NodeContacts<2>::apply(const Cell<2>&, Vec<2, double>*) const;
template void NodeContacts<3>::apply(const Cell<3>&, Vec<3, float>*) const;
template void NodeContacts<3>::apply(const Cell<3>&, Vec<3, double>*) const;

}  // namespace sim
