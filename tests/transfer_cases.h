#pragma once
// What the tests of the transfers share: random particles and fields, on faces and on nodes.
#include <gtest/gtest.h>

#include <random>

#include "sim/transfer/mac_transfer.h"
#include "sim/transfer/node_transfer.h"

namespace sim::cases {

inline constexpr double kCell = 0.1;   // [m]
inline constexpr Kernel kKernels[] = {Kernel::linear, Kernel::quadratic};

template <int D>
Lattice<D> lattice_of(int edge, bool periodic = false) {
  Cell<D> cells;
  cells.fill(edge);
  std::array<bool, D> around;
  around.fill(periodic);
  return Lattice<D>(cells, around);
}

/// The first `count` modes of a kernel's order; all of them when 0.
template <int D>
std::vector<ModeIndex<D>> prefix(Kernel kernel, std::size_t count = 0) {
  std::vector<ModeIndex<D>> modes = ordered_modes<D>(kernel == Kernel::linear ? 1 : 2);
  if (count > 0) modes.resize(count);
  return modes;
}

/// Particles in the cells [margin, cells - margin), ids descending, coefficients in [-1, 1) m/s.
template <int D, class Real>
Particles<D, Real> random_particles(const Lattice<D>& lattice, std::size_t count, std::size_t modes, unsigned seed, int margin = 0) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1), velocity(-1, 1);
  Particles<D, Real> p;
  p.modes = int(modes);
  p.mass = 0.3;
  p.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    p.id[i] = std::int64_t(count - 1 - i);
    for (int a = 0; a < D; ++a) {
      p.cell[i][a] = margin + int(uniform(random) * (lattice.cells[a] - 2 * margin));
      p.offset[i][a] = Real(std::min(uniform(random), 0.9999));
    }
  }
  for (Real& c : p.coefficients) c = Real(velocity(random));
  return p;
}

/// Indices of all places: a field has a value at each, and nothing else counts.
template <int D>
std::vector<std::size_t> places_of(const ActiveBlocks<D>& blocks) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (blocks.is_place(i)) places.push_back(i);
  return places;
}

template <int D, class Real>
CellRanges sorted(Particles<D, Real>& particles, const Lattice<D>& lattice) {
  return CanonicalOrder<D, Real>().sort(particles, lattice);
}

/// A field of numbers in [-1, 1).
template <class Layout>
typename Layout::Field random_field(const ActiveBlocks<Layout::kDimension>& blocks, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> velocity(-1, 1);
  typename Layout::Field field;
  Layout::clear(field, blocks.size());
  for (int c = 0; c < Layout::kDimension; ++c)
    for (const std::size_t i : places_of(blocks)) Layout::at(field, c, i) = typename Layout::Real(velocity(random));
  return field;
}

/// The lattice that carries a component.
template <class Layout>
constexpr int lattice_of_component(int component) {
  return component / Layout::kComponents;
}

/// The stencil that a particle has for a component.
template <class Basis, class Layout>
Stencil<Basis, Layout::kDimension> stencil_of(const Cell<Layout::kDimension>& cell, const auto& offset, int component) {
  Stencil<Basis, Layout::kDimension> s;
  for (int a = 0; a < Layout::kDimension; ++a)
    s[a] = Basis(cell[a], typename Basis::Real(offset[a]), Layout::centred(lattice_of_component<Layout>(component), a));
  return s;
}

/// Calls body with a tag of each layout: faces and nodes, 2-D and 3-D.
template <class Real, class Body>
void for_layouts(const Body& body) {
  const auto named = [&](const char* name, auto layout) {
    SCOPED_TRACE(name);
    body(layout);
  };
  named("faces 2-D", FaceLayout<2, Real>{});
  named("faces 3-D", FaceLayout<3, Real>{});
  named("nodes 2-D", NodeLayout<2, Real>{});
  named("nodes 3-D", NodeLayout<3, Real>{});
}

inline const char* name_of(Kernel kernel) { return kernel == Kernel::linear ? "linear" : "quadratic"; }

}  // namespace sim::cases
