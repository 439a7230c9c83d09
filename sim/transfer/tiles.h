#pragma once
// Dense copies of what lies around one block, for passes that go through its particles.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <limits>

#include "sim/transfer/blocks.h"
#include "sim/transfer/node_runs.h"
#include "sim/transfer/tensor.h"

namespace sim {

/// Values of a field on a block's tile (ActiveBlocks::for_tile), kTile^D numbers for each component; what is not active stays as it is.
template <class Layout, int kTile, int kBefore = 1>
void load_tile(const ActiveBlocks<Layout::kDimension>& blocks, const Cell<Layout::kDimension>& block, const typename Layout::Field& field,
               typename Layout::Real* tile) {
  constexpr int D = Layout::kDimension, places = int_power(kTile, D);
  std::array<const typename Layout::Real*, std::size_t(Layout::kLattices)> values{};
  for (int l = 0; l < Layout::kLattices; ++l) values[std::size_t(l)] = &Layout::at(field, l, 0);
  blocks.template for_tile<kTile, kBefore>(block, [&](int to, std::size_t from, auto count) {
    if constexpr (Layout::kLattices == 1) {
      split_components<D>(values[0] + std::size_t(D) * from, count, tile + to, places);
    } else {
      for (int c = 0; c < D; ++c) std::memcpy(tile + c * places + to, values[std::size_t(c)] + from, std::size_t(count) * sizeof(*tile));
    }
  });
}

/// The least mass of a quadratic stencil, for all stencils of a block's particles: minima of three neighbours, one axis after the other.
template <class Layout>
class LeastMasses {
 public:
  static constexpr int D = Layout::kDimension, n = 3, kEdge = Lattice<D>::kBlock + n;
  using Real = typename Layout::Real;

  LeastMasses(const ActiveBlocks<D>& blocks, const Cell<D>& block, const typename Layout::Mass& mass) {
    for (int a = 0; a < D; ++a) first_[a] = block[a] * Lattice<D>::kBlock - 1;
    blocks.template for_tile<kEdge>(block, [&](int to, std::size_t from, auto count) {
      for (int l = 0; l < Layout::kLattices; ++l)
        for (int k = 0; k < count; ++k) least_[l][std::size_t(to + k)] = Layout::mass(mass, l)[from + std::size_t(k)];
    });
    for (auto& least : least_)
      for (std::size_t step = 1; step < kPlaces; step *= kEdge)
        for (std::size_t i = 0; i + 2 * step < kPlaces; ++i) least[i] = std::min({least[i], least[i + step], least[i + 2 * step]});
  }
  /// Of a stencil; -1 if it is none of the block's.
  template <class Weights>
  std::ptrdiff_t place(const Stencil<Weights, D>& stencil) const {
    std::ptrdiff_t place = 0;
    for (int a = 0; a < D; ++a) {
      const int at = stencil[a].base - first_[a];
      if (at < 0 || at > kEdge - n) return -1;
      place = place * kEdge + at;
    }
    return place;
  }
  Real at(int lattice, std::ptrdiff_t place) const { return least_[std::size_t(lattice)][std::size_t(place)]; }
  /// The least of all stencils that particles of a cell, or on one lattice of those nearest to a node, may have; `local` is its place in the block.
  Real at_home(Home home, int local) const {
    assert((home == Home::cell || Layout::kLattices == 1) && "the cells of a nearest node's particles are not known");
    const Cell<D> at = Lattice<D>::cell_in(Cell<D>{}, local);
    Real least = std::numeric_limits<Real>::max();
    for (int l = 0; l < Layout::kLattices; ++l)
      for (int upper = 0; upper < 1 << D; ++upper) {   // by axis: from the node at the cell's lower side on, and not from the one before
        std::size_t place = 0;
        bool one = true;   // on a middle, and around a nearest node, all have the lower one
        for (int a = 0; a < D; ++a) {
          const int up = upper >> a & 1;
          one = one && !(up && (home == Home::nearest_node || Layout::centred(l, a)));
          place = place * kEdge + std::size_t(at[a] + up);
        }
        if (one) least = std::min(least, least_[std::size_t(l)][place]);
      }
    return least;
  }

 private:
  static constexpr std::size_t kPlaces = std::size_t(int_power(kEdge, D));
  Cell<D> first_;                                                                    // of the stencil at place 0
  std::array<std::array<Real, kPlaces>, std::size_t(Layout::kLattices)> least_{};    // 0 where no block is active
};

}  // namespace sim
