#pragma once
// What the particles of a block bring to the grid, summed in an array of its own: P2G, but for the kernels of lanes.h.
#include <array>
#include <cstddef>
#include <vector>

#include "base/prefetch.h"
#include "sim/transfer/grid_transfer.h"
#include "sim/transfer/node_runs.h"
#include "sim/transfer/tensor.h"

namespace sim {

/// Place of each node of a stencil in a dense array, relative to the first.
template <int n, int D>
constexpr std::array<std::ptrdiff_t, std::size_t(int_power(n, D))> node_steps(const std::array<std::ptrdiff_t, D>& stride) {
  std::array<std::ptrdiff_t, std::size_t(int_power(n, D))> steps{};
  for (int node = 0; node < int(steps.size()); ++node)
    for (int a = D - 1, rest = node; a >= 0; --a, rest /= n) steps[node] += (rest % n) * stride[a];
  return steps;
}

template <class Basis, int D>
Cell<D> first_node(const Stencil<Basis, D>& s) {
  Cell<D> at;
  for (int a = 0; a < D; ++a) at[a] = s[a].base;
  return at;
}

/// What the particles of one block bring to the grid: its cells' nodes and those around that an n-node stencil reaches.
template <class Layout, int n>
class BlockSums {
 public:
  static constexpr int D = Layout::kDimension, kEdge = Lattice<D>::kBlock + n;
  using Real = typename Layout::Real;
  static constexpr std::array<std::ptrdiff_t, D> kStride = [] {
    std::array<std::ptrdiff_t, D> stride{};
    for (int a = 0; a < D; ++a) stride[a] = int_power(kEdge, D - 1 - a);
    return stride;
  }();
  static constexpr auto kSteps = node_steps<n, D>(kStride);

  static constexpr int kFields = Layout::kLattices + D;

  BlockSums(const Cell<D>& block, const Lattice<D>& lattice) : cells_(lattice.cells) {
    for (int a = 0; a < D; ++a) lower_[a] = block[a] * Lattice<D>::kBlock - 1;
  }

  template <class Basis>
  void add(const Particles<D, Real>& particles, std::size_t p, const std::vector<int>& place) {
    const ParticleStencils<Basis, Layout> stencils(particles.cell[p], particles.offset[p]);
    for (int l = 0; l < Layout::kLattices; ++l) {
      const Stencil<Basis, D> stencil = stencils.of(l);
      const Tensor<Real, n, D> w = weights<D>(stencil);
      const Cell<D> at = first_node<Basis, D>(stencil);
      std::ptrdiff_t first = 0;
      for (int a = 0; a < D; ++a) {
        const int from_lower = at[a] - lower_[a];   // too far: the particle's nearest node is the first of a periodic axis
        first += (from_lower + n > kEdge ? from_lower - cells_[a] : from_lower) * kStride[a];
      }
      for (std::size_t node = 0; node < w.size(); ++node) number(l, first + kSteps[node]) += w[node];
      for (int k = 0; k < Layout::kComponents; ++k) {
        const int component = Layout::component(l, k);
        const auto c = particles.component(p, component);
        Tensor<Real, n, D> value{};
        for (std::size_t r = 0; r < place.size(); ++r) value[place[r]] = c[r];
        evaluate<D>(stencil, value);
        for (std::size_t node = 0; node < w.size(); ++node) number(Layout::kLattices + component, first + kSteps[node]) += w[node] * value[node];
      }
    }
  }

  void clear() { sums_.fill(0); }
  /// All of it, as lanes::Scatter has it: kFields fields of kEdge^D numbers, or as many numbers of each node; and what may be written behind them. Not
  /// cleared.
  Real* data() { return sums_.data(); }

  /// Calls for the grid's fields, which blocks of a colour leave and come back to.
  static void prefetch(typename Layout::Grid& grid, const ActiveBlocks<D>& blocks, const Cell<D>& block) {
    const Fields field = fields_of(grid);
    blocks.template for_tile<kEdge>(block, [&](int, std::size_t at, auto) {
      base::prefetch(field[0] + at);
#pragma GCC unroll 6
      for (int f = 1; f < (kTogether ? 2 : kFields); ++f) base::prefetch(field[std::size_t(f)] + (kTogether ? std::size_t(D) * at : at));
    });
  }
  /// Adds to the grid's fields; what lies beyond a periodic side goes to the other one.
  void add_to(typename Layout::Grid& grid, const ActiveBlocks<D>& blocks, const Cell<D>& block) const {
    const Fields field = fields_of(grid);
    blocks.template for_tile<kEdge>(block, [&](int from, std::size_t to, auto count) {
      if constexpr (kTogether) {
        add_nodes<D>(&sums_[std::size_t(from * kFields)], count, field[0] + to, field[1] + std::size_t(D) * to);
      } else {
#pragma GCC unroll 6
        for (int f = 0; f < kFields; ++f) add_numbers(&sums_[std::size_t(f) * kSize + std::size_t(from)], count, field[std::size_t(f)] + to);
      }
    });
  }

 private:
  static constexpr std::size_t kSize = std::size_t(int_power(kEdge, D));
  Cell<D> lower_;                                              // the node at index 0
  Cell<D> cells_;                                              // of the domain
  static constexpr bool kTogether = Layout::kLattices == 1;    // the numbers of a node
  Real& number(int field, std::ptrdiff_t node) {
    return sums_[kTogether ? std::size_t(node * kFields + field) : std::size_t(field) * kSize + std::size_t(node)];
  }

  /// The grid's masses by lattice, and its momenta: by component, or of one lattice the first number of all.
  using Fields = std::array<Real*, std::size_t(kFields)>;
  static Fields fields_of(typename Layout::Grid& grid) {
    Fields field{};
    for (int l = 0; l < Layout::kLattices; ++l) field[std::size_t(l)] = Layout::mass(grid.mass, l).data();
    for (int c = 0; c < (kTogether ? 1 : D); ++c) field[std::size_t(Layout::kLattices + c)] = &Layout::at(grid.velocity, c, 0);
    return field;
  }

  std::array<Real, kFields * kSize + lanes::kTileSlack> sums_;   // masses by lattice, momenta by component
};

}  // namespace sim
