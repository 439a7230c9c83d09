#include "sim/colliders/solids.h"

#include <algorithm>

namespace sim {
namespace {

/// Particles stop this far from a wall or collider [cells]: on the wall itself they would sit on the edge of two cells.
constexpr double kSkin = 1e-3;

/// A box that stands on a wall goes on behind it: the side in the wall is no way out.
Shape continued_through_walls(Shape shape, const base::Box& domain, double cell) {
  if (!shape.box) return shape;
  const base::Vec3 size = domain.size();
  for (int a = 0; a < 3; ++a) {
    if (shape.box->lower[a] < domain.lower[a] + 1e-6 * cell) shape.box->lower[a] -= size[a];
    if (shape.box->upper[a] > domain.upper[a] - 1e-6 * cell) shape.box->upper[a] += size[a];
  }
  return shape;
}

}  // namespace

template <int D>
Solids<D>::Solids(const Scene& scene, const Lattice<D>& grid)
    : origin(scene.options.domain.lower), cell(scene.options.cell), lattice(grid), solid(grid.size, 1) {
  for (const Collider& collider : scene.colliders)
    shapes.push_back(continued_through_walls(collider.shape, scene.options.domain, cell));
  for (std::size_t i = 0; i < lattice.size; ++i) {
    const Cell<D> at = lattice.cell_at(std::ptrdiff_t(i));
    if (!lattice.inside(at)) continue;
    base::Vec3 middle = origin;
    for (int a = 0; a < D; ++a) middle[a] += (at[a] + 0.5) * cell;
    solid[i] = std::any_of(shapes.begin(), shapes.end(), [&](const Shape& s) { return s.distance(middle) < 0; });
  }
}

template <int D>
template <class Real>
bool Solids<D>::push_out(Site<D, Real>& site) const {
  bool pushed = false;
  const auto keep_inside = [&] {
    for (int a = 0; a < D; ++a) {
      const Real low = Real(kSkin), high = 1 - Real(kSkin);
      if (site.cell[a] < 0 || (site.cell[a] == 0 && site.offset[a] < low)) site.cell[a] = 0, site.offset[a] = low, pushed = true;
      const int last = lattice.cells[a] - 1;
      if (site.cell[a] > last || (site.cell[a] == last && site.offset[a] > high)) site.cell[a] = last, site.offset[a] = high, pushed = true;
    }
  };
  keep_inside();
  // A second pass settles a particle that leaves one collider into another; what is still inside then is the next step's.
  for (int pass = 0; pass < 2; ++pass)
    for (const Shape& shape : shapes) {
      base::Vec3 at = origin, normal;
      for (int a = 0; a < D; ++a) at[a] += (double(site.cell[a]) + double(site.offset[a])) * cell;
      const double depth = kSkin * cell - shape.distance(at, &normal);
      if (depth <= 0) continue;
      Vec<D, Real> step;
      for (int a = 0; a < D; ++a) step[a] = Real(normal[a] * depth / cell);
      site.move(step);
      pushed = true;
      keep_inside();
    }
  return pushed;
}

template struct Solids<3>;
template bool Solids<3>::push_out(Site<3, float>&) const;
template bool Solids<3>::push_out(Site<3, double>&) const;

}  // namespace sim
