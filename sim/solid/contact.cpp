#include "sim/solid/contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace sim {
namespace {

/// [cells] Nearer than that to a collider is on it, whatever rounding says of a face in a plane of nodes.
constexpr double kOnFace = 1e-6;
/// [cells] Deeper than a node lies that a particle reaches.
constexpr double kFarWay = 3;
/// [spacings of particles] Nearer than that to a solid a particle touches it. What sticks is held by all of the layer of particles that was seeded at it.
constexpr double reach_of(const Rubbing& solid) { return solid.contact == Contact::sticky ? 1 : 0.6; }

/// One of the contacts of a node, and what it has done to its velocity [m/s] so far.
template <int D, class Real>
struct Met {
  Rubbing solid;
  Vec<D, Real> normal, moves;                      // the latter the solid's own velocity [m/s]
  Real pushed = 0;                                 // along the normal
  Vec<D, Real> rubbed = Vec<D, Real>::Zero();      // across it, at most friction times that
};

/// The velocity that all contacts of a node together leave it with: each in turn, what it did before taken back where it was too much, until
/// nothing changes (projected Gauss-Seidel). The last has the last word: a wall's side, through which nothing may go.
template <int D, class Real>
Vec<D, Real> after_contacts(std::vector<Met<D, Real>>& met, Vec<D, Real> velocity) {
  constexpr int kSweeps = 60;
  const auto sticks = std::find_if(met.rbegin(), met.rend(), [](const auto& m) { return m.solid.contact == Contact::sticky; });
  if (sticks != met.rend()) {
    sticks->rubbed = sticks->moves - velocity;
    return sticks->moves;
  }
  Real fastest = velocity.norm();
  for (const Met<D, Real>& m : met) fastest = std::max(fastest, m.moves.norm());
  const Real still = fastest * 4 * std::numeric_limits<Real>::epsilon();
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    const Vec<D, Real> before = velocity;
    for (Met<D, Real>& m : met) {
      const Real outwards = (velocity - m.moves).dot(m.normal);
      const Real pushed = m.solid.contact == Contact::slip ? m.pushed - outwards : std::max(Real(0), m.pushed - outwards);
      velocity += (pushed - m.pushed) * m.normal;
      m.pushed = pushed;
      if (m.solid.contact == Contact::slip || m.solid.friction == 0) continue;
      const Vec<D, Real> seen = velocity - m.moves, along = seen - seen.dot(m.normal) * m.normal;
      Vec<D, Real> rubbed = m.rubbed - along;
      if (const Real most = Real(m.solid.friction) * m.pushed, size = rubbed.norm(); size > most) rubbed *= most / size;
      velocity += rubbed - m.rubbed;
      m.rubbed = rubbed;
    }
    if ((velocity - before).norm() <= still) break;
  }
  return velocity;
}

}  // namespace

template <int D>
NodeContacts<D>::NodeContacts(const Scene& scene, const Solids<D>& solids)
    : cell_(scene.options.cell), spacing_(std::pow(double(scene.options.particles_per_cell), -1.0 / D)), origin_(scene.options.domain.lower),
      solids_(solids) {
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
  place();
}

template <int D>
void NodeContacts<D>::place() {
  bodies_.clear();
  for (const Collider& collider : solids_.colliders())
    for (auto& [shape, motion] : solids_.placed(collider, cell_))   // what is as near as a particle reaches
      bodies_.push_back({std::move(shape), motion, {collider.contact, collider.friction}});
}

template <int D>
base::Vec3 NodeContacts<D>::normal(const std::vector<const Body*>& near, std::size_t k, const base::Vec3& at, const base::Vec3& velocity) const {
  const double on = kOnFace * cell_;
  const Shape& shape = near[k]->shape;
  base::Vec3 nearest;
  shape.distance(at, &nearest);
  if (!shape.box) return nearest;
  const auto leads_into_another = [&](const Shape::Face& face) {
    const base::Vec3 beyond = at + (face.depth + 2 * on) * face.normal;
    for (std::size_t other = 0; other < near.size(); ++other)
      if (other != k && near[other]->shape.distance(beyond) < -on) return true;
    return false;
  };
  std::array<Shape::Face, 3> ways_out;   // one an axis
  std::size_t count = 0;
  for (const auto& [lower, upper] : shape.faces(at)) {
    if (std::isinf(lower.depth)) continue;
    const bool by_lower = !leads_into_another(lower), by_upper = !leads_into_another(upper);
    if (by_lower && (!by_upper || lower.depth < upper.depth)) ways_out[count++] = lower;
    else if (by_upper) ways_out[count++] = upper;
  }
  double depth = std::numeric_limits<double>::infinity(), least = depth;
  for (std::size_t n = 0; n < count; ++n) depth = std::min(depth, ways_out[n].depth);
  if (depth > kFarWay * cell_) return nearest;   // in a corner of two: each stops what comes by its own face
  for (std::size_t n = 0; n < count; ++n) {
    if (ways_out[n].depth > depth + on) continue;
    const double outwards = velocity.dot(ways_out[n].normal), inwards = near[k]->rubbing.contact == Contact::slip ? std::abs(outwards) : -outwards;
    if (inwards < least) least = inwards, nearest = ways_out[n].normal;
  }
  return nearest;
}

template <int D>
bool NodeContacts<D>::is_near(const Cell<D>& block) const {
  constexpr int edge = Lattice<D>::kBlock;
  for (const Side& side : sides_)
    if (side.has(block[side.axis] * edge + (side.upper ? edge + 1 : -1))) return true;
  base::Vec3 middle = origin_;
  for (int a = 0; a < D; ++a) middle[a] += cell_ * (block[a] * edge + edge / 2.0);
  const double reach = cell_ * (edge / 2.0 + 1.5) * std::sqrt(double(D));
  return std::any_of(bodies_.begin(), bodies_.end(), [&](const Body& body) { return body.shape.distance(middle) <= reach; });
}

template <int D>
bool NodeContacts<D>::touches(const Site<D, double>& at) const {
  for (const Side& side : sides_) {
    const double far = at.cell[side.axis] - side.node + at.offset[side.axis];
    if ((side.upper ? -far : far) < reach_of(side.rubbing) * spacing_) return true;
  }
  base::Vec3 place = origin_;
  for (int a = 0; a < D; ++a) place[a] += cell_ * (at.cell[a] + at.offset[a]);
  return std::any_of(bodies_.begin(), bodies_.end(), [&](const Body& body) { return body.shape.distance(place) < reach_of(body.rubbing) * spacing_ * cell_; });
}

template <int D>
template <class Real>
double NodeContacts<D>::apply(const Cell<D>& block, PlaceBits touched, const Real* mass, Vec<D, Real>* velocity) const {
  if (touched == 0) return 0;
  constexpr int edge = Lattice<D>::kBlock, count = Lattice<D>::kCellsPerBlock;
  const double reach = cell_ * edge * std::sqrt(double(D)) / 2;   // from the middle of the nodes to the farthest
  base::Vec3 middle = origin_;
  for (int a = 0; a < D; ++a) middle[a] += cell_ * (block[a] * edge + (edge - 1) / 2.0);
  std::vector<const Body*> near;
  for (const Body& body : bodies_)
    if (body.shape.distance(middle) <= reach) near.push_back(&body);
  std::vector<const Side*> sides;
  for (const Side& side : sides_)
    if (side.has(block[side.axis] * edge + (side.upper ? edge - 1 : 0))) sides.push_back(&side);
  if (near.empty() && sides.empty()) return 0;
  double work = 0;
  std::vector<Met<D, Real>> met;
  for (int i = 0; i < count; ++i) {
    if (!(touched >> i & 1)) continue;
    const Cell<D> node = Lattice<D>::cell_in(block, i);
    base::Vec3 at = origin_, moves = base::Vec3::Zero();
    for (int a = 0; a < D; ++a) at[a] += cell_ * node[a], moves[a] = double(velocity[i][a]);
    met.clear();
    for (std::size_t k = 0; k < near.size(); ++k) {
      if (near[k]->shape.distance(at) >= kOnFace * cell_) continue;
      const base::Vec3 own = near[k]->motion.at(at);
      met.push_back({near[k]->rubbing, normal(near, k, at, moves - own).template head<D>().template cast<Real>(), own.template head<D>().template cast<Real>()});
    }
    for (const Side* side : sides)
      if (side->has(node[side->axis])) met.push_back({side->rubbing, Vec<D, Real>::Unit(side->axis) * Real(side->upper ? -1 : 1), Vec<D, Real>::Zero()});
    if (met.empty()) continue;
    if (met.size() > 1) {
      velocity[i] = after_contacts<D, Real>(met, velocity[i]);
      for (const Met<D, Real>& m : met) work += double(mass[i]) * double((m.pushed * m.normal + m.rubbed).dot(m.moves));
    } else if (met[0].moves.isZero(0)) {
      velocity[i] = after_contact<D, Real>(met[0].solid, met[0].normal, velocity[i]);
    } else {
      const Vec<D, Real> before = velocity[i];
      velocity[i] = met[0].moves + after_contact<D, Real>(met[0].solid, met[0].normal, before - met[0].moves);
      work += double(mass[i]) * double((velocity[i] - before).dot(met[0].moves));
    }
  }
  return work;
}

template class NodeContacts<2>;
template class NodeContacts<3>;
template double NodeContacts<2>::apply(const Cell<2>&, PlaceBits, const float*, Vec<2, float>*) const;
template double NodeContacts<2>::apply(const Cell<2>&, PlaceBits, const double*, Vec<2, double>*) const;
template double NodeContacts<3>::apply(const Cell<3>&, PlaceBits, const float*, Vec<3, float>*) const;
template double NodeContacts<3>::apply(const Cell<3>&, PlaceBits, const double*, Vec<3, double>*) const;

}  // namespace sim
