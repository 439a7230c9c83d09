#pragma once
// From a scene's options, known when the program runs, to dimension and precision of the templates.
#include <cmath>
#include <type_traits>

#include "sim/scene.h"
#include "sim/transfer/lattice.h"

namespace sim {

/// Calls body(<2 or 3>, Real{}) with the dimension and the precision that the options name.
template <class Body>
auto with_numbers(const Options& o, const Body& body) {
  using Two = std::integral_constant<int, 2>;
  using Three = std::integral_constant<int, 3>;
  if (o.precision == Precision::double_precision) return o.dimension == 2 ? body(Two{}, double{}) : body(Three{}, double{});
  return o.dimension == 2 ? body(Two{}, float{}) : body(Three{}, float{});
}

/// The cells of the domain.
template <int D>
Lattice<D> lattice_of(const Options& o) {
  Cell<D> cells;
  std::array<bool, D> periodic;
  for (int a = 0; a < D; ++a) cells[a] = int(std::lround(o.domain.size()[a] / o.cell)), periodic[std::size_t(a)] = o.periodic(a);
  return Lattice<D>(cells, periodic);
}

}  // namespace sim
