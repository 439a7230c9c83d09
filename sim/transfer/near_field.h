#pragma once
// The grid velocity where particles of a block are, or have got to: a dense copy of the field around the block, read a line of nodes at a
// time. For whoever asks particle by particle at places that no batch shares, as motion does.
#include <Eigen/Core>
#include <utility>

#include "base/parallel.h"
#include "sim/transfer/grid_transfer.h"
#include "sim/transfer/tiles.h"

namespace sim {

/// The field around a block: interpolates at sites in its cells and kReach cells around.
template <class Layout, class Weights>
class NearField {
 public:
  static constexpr int D = Layout::kDimension, n = Weights::kNodes;
  static constexpr int kReach = 1, kBefore = kReach + 1, kEdge = Lattice<D>::kBlock + 2 * kReach + n;   // stencils begin a node before a cell
  using Real = typename Layout::Real;

  NearField(const ActiveBlocks<D>& blocks, const Cell<D>& block, const typename Layout::Field& field) {
    for (int a = 0; a < D; ++a) {
      const int first = block[a] * Lattice<D>::kBlock;
      first_[a] = first - kBefore;
      cells_[a] = unsigned(std::min(Lattice<D>::kBlock, blocks.lattice().cells[a] - first) + 2 * kReach);
    }
    load_tile<Layout, kEdge, kBefore>(blocks, block, field, values_.data());
  }
  /// Of a cell as it is counted from the block, images beyond a periodic side not wrapped.
  bool covers(const Cell<D>& cell) const {
    bool inside = true;
    for (int a = 0; a < D; ++a) inside = inside && unsigned(cell[a] - first_[a] - 1) < cells_[a];
    return inside;
  }
  /// [m/s] at a site that is covered.
  [[gnu::always_inline]] Vec<D, Real> at(const Site<D, Real>& site) const {
    const ParticleStencils<Weights, Layout> stencils(site.cell, site.offset);
    Vec<D, Real> v;
#pragma GCC unroll 3
    for (int l = 0; l < Layout::kLattices; ++l) {
      const auto along = [&](int a) -> const Weights& { return Layout::centred(l, a) ? stencils.middle[a] : stencils.corner[a]; };
      int first = 0;
#pragma GCC unroll 3
      for (int a = 0; a < D; ++a) first = first * kEdge + along(a).base - first_[a];
#pragma GCC unroll 3
      for (int k = 0; k < Layout::kComponents; ++k) {
        const Real* const nodes = &values_[std::size_t(Layout::component(l, k) * kPlaces + first)];
        Line sum = Line::Zero();
#pragma GCC unroll 3
        for (int i = 0; i < n; ++i) {
          if constexpr (D == 2) {
            sum += along(0).weight[i] * Eigen::Map<const Line>(nodes + i * kEdge);
          } else {
            Line plane = along(1).weight[0] * Eigen::Map<const Line>(nodes + i * kEdge * kEdge);
#pragma GCC unroll 3
            for (int j = 1; j < n; ++j) plane += along(1).weight[j] * Eigen::Map<const Line>(nodes + (i * kEdge + j) * kEdge);
            sum += along(0).weight[i] * plane;
          }
        }
        Real& value = v[Layout::component(l, k)] = 0;
#pragma GCC unroll 3
        for (int m = 0; m < n; ++m) value += along(D - 1).weight[m] * sum[m];
      }
    }
    return v;
  }

 private:
  static constexpr int kPlaces = int_power(kEdge, D), kLine = 4;
  using Line = Eigen::Array<Real, kLine, 1>;                            // a line of nodes and what follows it, which is not used
  Cell<D> first_;                                                       // the node at index 0
  std::array<unsigned, D> cells_;                                       // that are covered along each axis
  std::array<Real, std::size_t(D * kPlaces + kLine - n)> values_{};     // by component; 0 where no block is active
};

/// Calls body(begin, end, velocity) for the particles of a block, number `b` of those occupied; velocity(site) is the field [m/s], from a copy of it
/// where it can be. Particles must be stored in the order that `ranges` is of, though they may have moved since.
template <class Layout, class Body>
void in_near_field(const GridTransfer<Layout>& transfer, const ActiveBlocks<Layout::kDimension>& blocks, const typename Layout::Field& field,
                   const CellRanges& ranges, std::size_t b, const Body& body) {
  constexpr std::size_t per_block = Lattice<Layout::kDimension>::kCellsPerBlock;
  const auto in = [&](auto weights) {
    const NearField<Layout, decltype(weights)> near(blocks, blocks.lattice().block_at(ranges.occupied[b]), field);
    body(ranges.begin[b * per_block], ranges.begin[(b + 1) * per_block],
         [&](const auto& site) { return near.covers(site.cell) ? near.at(site) : transfer.velocity_at(blocks, field, site); });
  };
  if (transfer.kernel() == Kernel::linear) in(LinearWeights<typename Layout::Real>{});
  else in(QuadraticWeights<typename Layout::Real>{});
}

/// The same for all blocks. Empty ranges: no order, and no copies.
template <class Layout, class Body>
void with_near_field(const GridTransfer<Layout>& transfer, const ActiveBlocks<Layout::kDimension>& blocks, const typename Layout::Field& field,
                     const CellRanges& ranges, std::size_t particles, const Body& body) {
  if (ranges.occupied.empty()) {
    base::parallel_chunks(particles, 4096, [&](std::size_t begin, std::size_t end) {
      body(begin, end, [&](const auto& site) { return transfer.velocity_at(blocks, field, site); });
    });
    return;
  }
  base::parallel_chunks(ranges.occupied.size(), 1, [&](std::size_t b, std::size_t) { in_near_field(transfer, blocks, field, ranges, b, body); });
}

}  // namespace sim
