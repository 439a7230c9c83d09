#pragma once
// Where particles start: every cell is cut into particles_per_cell equal boxes with one place each. A place belongs to the first body that
// holds it, and to none where a collider is.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/random.h"
#include "sim/scene.h"
#include "sim/transfer/lattice.h"
#include "sim/transfer/particles.h"

namespace sim {

/// Places along an edge of a cell.
template <int D>
int places_along_edge(const Options& o) {
  return int(std::lround(std::pow(double(o.particles_per_cell), 1.0 / D)));
}

inline bool any_holds(const std::vector<Shape>& shapes, const base::Vec3& at) {
  return std::any_of(shapes.begin(), shapes.end(), [&](const Shape& shape) { return shape.distance(at) < 0; });
}

/// Row-major over the domain: what the jitter counts by.
template <int D>
std::int64_t number_of(const Cell<D>& at, const Lattice<D>& lattice) {
  std::int64_t number = 0;
  for (int a = 0; a < D; ++a) number = number * lattice.cells[a] + at[a];
  return number;
}
template <int D>
Cell<D> cell_of(std::int64_t number, const Lattice<D>& lattice) {
  Cell<D> at;
  for (int a = D - 1; a >= 0; number /= lattice.cells[a], --a) at[a] = int(number % lattice.cells[a]);
  return at;
}

template <int D, class Real>
struct SeedPlace {
  Vec<D, Real> offset;   // [cells] within its cell
  base::Vec3 at;         // [m]
};

/// Place `sub` of a cell, in 0 .. particles_per_cell - 1; `edge` of them along an edge.
template <int D, class Real>
SeedPlace<D, Real> seed_place(const Options& o, int edge, const Cell<D>& cell, std::int64_t number, int sub) {
  SeedPlace<D, Real> place;
  place.at = o.domain.lower;
  for (int a = D - 1, rest = sub; a >= 0; --a, rest /= edge) {
    const double within = o.seeding == Seeding::regular ? 0.5 : uniform(std::uint64_t(o.seed), std::uint64_t(number), std::uint64_t(sub * D + a));
    // The largest float below 1 keeps an offset that rounds up inside its cell.
    place.offset[a] = std::min(Real((rest % edge + within) / edge), std::nextafter(Real(1), Real(0)));
    place.at[a] += o.cell * (cell[a] + double(place.offset[a]));
  }
  return place;
}

/// Cells from the first to the last corner, both included, among which are all with a place in the shape.
template <int D>
struct CellRange {
  Cell<D> lower, upper;
};
/// Nothing when the shape's bounds lie outside the domain.
template <int D>
std::optional<CellRange<D>> cells_around(const Shape&, const Options&, const Lattice<D>&);

/// Numbers of the cells around any of the shapes, ascending.
template <int D>
std::vector<std::int64_t> cells_around(const std::vector<Shape>&, const Options&, const Lattice<D>&);

}  // namespace sim
