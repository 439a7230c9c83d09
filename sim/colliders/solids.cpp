#include "sim/colliders/solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "sim/drawn_shape.h"

namespace sim {
namespace {

/// Particles stop this far from a wall or collider [cells]: on the wall itself they would sit on the edge of two cells.
constexpr double kSkin = 1e-3;

template <class Real>
void stop_at_wall(Real& velocity, Real outward) {
  if (velocity * outward < 0) velocity = 0;
}

}  // namespace

double thickness(const Shape& shape, int dimension) {
  if (shape.sphere) return 2 * shape.sphere->radius;
  if (shape.mesh) return shape.mesh->distances->thickness();
  double least = std::numeric_limits<double>::infinity();
  for (int a = 0; a < dimension; ++a)
    if (const double size = shape.box->upper[a] - shape.box->lower[a]; size > 0) least = std::min(least, size);
  return least;
}

Collider continued_through_walls(Collider collider, const Options& o) {
  Shape& shape = collider.shape;
  if (!shape.box || shape.turn) return collider;
  if (!collider.spin.isZero(0)) collider.pivot = collider.pivot_at_start();
  const base::Vec3 size = o.domain.size();
  for (int a = 0; a < o.dimension; ++a) {
    if (!collider.spin.isZero(0) && collider.spin.cross(base::Vec3::Unit(a)).norm() > 1e-9 * collider.spin.norm()) continue;
    const bool lower = shape.box->lower[a] < o.domain.lower[a] + 1e-6 * o.cell, upper = shape.box->upper[a] > o.domain.upper[a] - 1e-6 * o.cell;
    const bool wall = !o.periodic(a);
    if (lower && (wall || upper)) shape.box->lower[a] -= size[a];
    if (upper && (wall || lower)) shape.box->upper[a] += size[a];
  }
  return collider;
}

bool is_met_by_nodes(const Collider& collider, const Options& o) {
  const Shape shape = continued_through_walls(collider, o).shape;
  const double least = thickness(shape, o.dimension);
  if (least < o.cell * (1 - 1e-6)) return false;
  if (shape.box && !shape.turn && collider.spin.isZero(0)) return true;
  if (least >= std::sqrt(double(o.dimension)) * o.cell * (1 + 1e-6)) return true;   // the ball in its middle holds a node wherever it lies
  if (collider.moves()) return false;
  const base::Box bounds = shape.bounds();
  std::array<std::int64_t, 3> first{}, last{};
  for (int a = 0; a < o.dimension; ++a) {
    first[std::size_t(a)] = std::int64_t(std::ceil((bounds.lower[a] - o.domain.lower[a]) / o.cell));
    last[std::size_t(a)] = std::int64_t(std::floor((bounds.upper[a] - o.domain.lower[a]) / o.cell));
  }
  for (std::int64_t x = first[0]; x <= last[0]; ++x)
    for (std::int64_t y = first[1]; y <= last[1]; ++y)
      for (std::int64_t z = first[2]; z <= last[2]; ++z)
        if (shape.distance(o.domain.lower + o.cell * base::Vec3(double(x), double(y), double(z))) <= 0) return true;
  return false;
}

Shape drawn_shape_at(double time, const Collider& collider, const Options& o) {
  Shape drawn = shape_at(time, collider, o);
  if (!drawn.box) return drawn;
  const base::Box met = *shape_at(time, continued_through_walls(collider, o), o).box;
  for (int a = 0; a < o.dimension; ++a) {
    if (o.periodic(a)) continue;
    drawn.box->lower[a] = std::min(drawn.box->lower[a], std::max(met.lower[a], o.domain.lower[a]));
    drawn.box->upper[a] = std::max(drawn.box->upper[a], std::min(met.upper[a], o.domain.upper[a]));
  }
  return drawn;
}

template <int D>
Solids<D>::Solids(const Scene& scene, const Lattice<D>& grid)
    : origin(scene.options.domain.lower), cell(scene.options.cell), lattice(grid), colliders_(scene.colliders), options_(scene.options) {
  for (std::size_t a = 0; a < std::size_t(D); ++a)
    for (std::size_t side = 0; side < 2; ++side) open[a][side] = options_.boundary[a][side] == Side::open;
  for (Collider& collider : colliders_) collider = continued_through_walls(collider, options_), speed_ = std::max(speed_, collider.speed());
  move_to(0);
}

template <int D>
void Solids<D>::move_to(double time) {
  time_ = time;
  shapes.clear(), motions.clear(), reaches_.clear(), thin_.clear();
  const double way = options_.cfl * cell;   // [m] that a particle crosses in a step, and a collider
  for (const Collider& collider : colliders_) {
    for (Placed& solid : placed(collider, 1e-6 * cell)) {
      reaches_.emplace_back(solid.shape, *this);
      shapes.push_back(std::move(solid.shape)), motions.push_back(solid.motion);
    }
    // Thicker ones push back to the side that a particle came from.
    if (const double thin = thickness(collider.shape, D); thin < 1.999 * way)
      for (Placed& solid : placed(collider, 2 * way)) thin_.push_back({std::move(solid), thin});
  }
}

template <int D>
auto Solids<D>::placed(const Collider& collider, double margin) const -> std::vector<Placed> {
  const RigidMotion motion = motion_at(time_, collider, options_);
  std::vector<Placed> all;
  for (Image& image : images_of(shape_at(time_, collider, options_), options_, margin)) all.push_back({std::move(image.shape), motion.moved(image.by)});
  return all;
}

template <int D>
Solids<D>::Reach::Reach(const Shape& shape, const Solids& solids) {
  constexpr double kMost = 1e9;   // [cells] farther than any domain goes
  const base::Box bounds = shape.bounds();
  for (int a = 0; a < D; ++a) {
    const bool endless = (shape.box && !shape.turn && shape.box->lower[a] == shape.box->upper[a]) || (shape.mesh && !shape.mesh->solid);
    const auto in_cells = [&](double at) { return std::clamp(std::floor((at - solids.origin[a]) / solids.cell), -kMost, kMost); };
    // A cell more: distances of meshes are interpolated, and what is this near counts as touching.
    first[std::size_t(a)] = endless ? -int(kMost) : int(in_cells(bounds.lower[a])) - 1;
    last[std::size_t(a)] = endless ? int(kMost) : int(in_cells(bounds.upper[a])) + 1;
  }
}

template <int D>
double Solids<D>::next_change(double time) const {
  double next = std::numeric_limits<double>::infinity();
  for (const Collider& c : colliders_)
    for (const double change : {c.start, c.end.value_or(next)})
      if (c.moves() && change > time * (1 + 1e-12)) next = std::min(next, change);
  return next;
}

template <int D>
bool Solids<D>::solid(const Cell<D>& place) const {
  const Cell<D> at = lattice.wrapped(place);
  if (behind_wall(at)) return true;
  if (shapes.empty()) return false;
  const base::Vec3 middle = place_in(at, 0.5);
  return std::any_of(shapes.begin(), shapes.end(), [&](const Shape& s) { return s.distance(middle) < 0; });
}

template <int D>
auto Solids<D>::solid_cells(const Cell<D>& block) const -> std::bitset<std::size_t(Lattice<D>::kCellsPerBlock)> {
  std::bitset<std::size_t(Lattice<D>::kCellsPerBlock)> solid;
  bool inside = true;                                          // the domain
  base::Vec3 centre = origin;
  for (int a = 0; a < D; ++a) {
    inside = inside && block[a] >= 0 && (block[a] + 1) * Lattice<D>::kBlock <= lattice.cells[a];
    centre[a] += (block[a] + 0.5) * Lattice<D>::kBlock * cell;
  }
  const double far = 0.5 * Lattice<D>::kBlock * std::sqrt(double(D)) * cell;
  const auto near = [&](const Shape& s) { return std::abs(s.distance(centre)) <= far; };
  if (inside && std::none_of(shapes.begin(), shapes.end(), near)) {
    if (std::any_of(shapes.begin(), shapes.end(), [&](const Shape& s) { return s.distance(centre) < 0; })) solid.set();
    return solid;
  }
  for (int local = 0; local < Lattice<D>::kCellsPerBlock; ++local) {
    const Cell<D> at = Lattice<D>::cell_in(block, local);
    solid[std::size_t(local)] = this->solid(at);
  }
  return solid;
}

template <int D>
template <class Real>
double Solids<D>::push_out(Moving<D, Real>& particle) const {
  Site<D, Real>& site = particle.site;
  double pushed = 0;
  const auto keep_inside = [&] {
    site.cell = lattice.wrapped(site.cell);
    for (int a = 0; a < D; ++a) {
      const Real low = Real(kSkin), high = 1 - Real(kSkin);
      const int last = lattice.cells[a] - 1;
      const double below = double(low) - site.cell[a] - double(site.offset[a]), above = site.cell[a] - last + double(site.offset[a]) - double(high);
      const auto axis = std::size_t(a);
      if (below <= 0 && above <= 0) continue;   // nearly all; asked first, before what kind of side it is
      if (lattice.periodic[a]) continue;
      if (below > 0 && !open[axis][0]) site.cell[a] = 0, site.offset[a] = low, pushed += below, stop_at_wall(particle.velocity[a], Real(1));
      if (above > 0 && !open[axis][1]) site.cell[a] = last, site.offset[a] = high, pushed += above, stop_at_wall(particle.velocity[a], Real(-1));
    }
  };
  keep_inside();
  // A second pass settles a particle that leaves one collider into another; what is still inside then is the next step's.
  for (int pass = 0; pass < 2; ++pass)
    for (std::size_t s = 0; s < shapes.size(); ++s) {
      if (!reaches_[s].holds(site.cell)) continue;
      base::Vec3 at = origin, normal;
      for (int a = 0; a < D; ++a) at[a] += (double(site.cell[a]) + double(site.offset[a])) * cell;
      const double depth = kSkin * cell - shapes[s].distance(at, &normal);
      if (depth <= 0) continue;
      Vec<D, Real> outward;
      for (int a = 0; a < D; ++a) outward[a] = Real(normal[a]);
      const auto solid = Real(motions[s].at(at).dot(normal));
      const Real inwards = std::min(Real(0), particle.velocity.dot(outward) - solid);
      particle.velocity -= inwards * outward;
      particle.work -= double(inwards) * double(solid);
      site.move(outward * Real(depth / cell));
      pushed += depth / cell;
      keep_inside();
    }
  return pushed;
}

template <int D>
template <class Real>
void Solids<D>::stop_in_thin(const Site<D, Real>& from, double dt, Site<D, Real>& to) const {
  base::Vec3 start = origin, end = origin;
  for (int a = 0; a < D; ++a) {
    start[a] += (double(from.cell[a]) + double(from.offset[a])) * cell;
    end[a] += (double(to.cell[a]) + double(to.offset[a])) * cell;
  }
  for (const Thin& thin : thin_) {
    const Shape& shape = thin.solid.shape;
    const base::Vec3 first = start + dt * thin.solid.motion.at(start), way = end - first;   // as one who moves with the collider sees it
    const double length = way.norm();
    if (length == 0 || shape.distance(first) > length || shape.distance(first) < 0) continue;
    const int looks = int(std::ceil(4 * length / thin.thickness)) + 1;
    for (int n = 1; n <= looks; ++n) {
      double outside = double(n - 1) / looks, inside = double(n) / looks;
      if (shape.distance(first + inside * way) >= 0) continue;
      for (int halvings = 0; halvings < 30; ++halvings) {
        const double middle = (outside + inside) / 2;
        (shape.distance(first + middle * way) < 0 ? inside : outside) = middle;
      }
      Vec<D, Real> back;
      for (int a = 0; a < D; ++a) back[a] = Real((inside - 1) * way[a] / cell);
      to.move(back);
      end = first + inside * way;
      break;
    }
  }
}

template struct Solids<2>;
template struct Solids<3>;
template void Solids<2>::stop_in_thin(const Site<2, float>&, double, Site<2, float>&) const;
template void Solids<2>::stop_in_thin(const Site<2, double>&, double, Site<2, double>&) const;
template void Solids<3>::stop_in_thin(const Site<3, float>&, double, Site<3, float>&) const;
template void Solids<3>::stop_in_thin(const Site<3, double>&, double, Site<3, double>&) const;
template double Solids<2>::push_out(Moving<2, float>&) const;
template double Solids<2>::push_out(Moving<2, double>&) const;
template double Solids<3>::push_out(Moving<3, float>&) const;
template double Solids<3>::push_out(Moving<3, double>&) const;

}  // namespace sim
