#pragma once
// The grid velocity where particles of a block are, or have got to: a dense copy of the field around the block, read by the places that particles ask
// for. For places that no batch shares, as those of motion.
#include <Eigen/Core>
#include <type_traits>
#include <utility>

#include "base/parallel.h"
#include "sim/transfer/grid_transfer.h"
#include "sim/transfer/tiles.h"

namespace sim {

/// Some places, by axis. Those behind `count` are places too, of nobody.
template <int D, class Real>
struct Sites {
  static constexpr std::size_t kMost = lanes::kMostPlaces;
  std::size_t count = 0;
  alignas(64) int cell[D][kMost]{};
  alignas(64) Real offset[D][kMost]{};

  void load(const Particles<D, Real>& particles, std::size_t begin, std::size_t end) {
    count = std::min(kMost, end - begin);
    for (std::size_t k = 0; k < count; ++k)
      for (int a = 0; a < D; ++a) cell[a][k] = particles.cell[begin + k][std::size_t(a)], offset[a][k] = particles.offset[begin + k][a];
  }
  Site<D, Real> operator[](std::size_t k) const {
    Site<D, Real> site;
    for (int a = 0; a < D; ++a) site.cell[std::size_t(a)] = cell[a][k], site.offset[a] = offset[a][k];
    return site;
  }
  void set(std::size_t k, const Site<D, Real>& site) {
    for (int a = 0; a < D; ++a) cell[a][k] = site.cell[std::size_t(a)], offset[a][k] = site.offset[a];
  }
};
/// A vector at each.
template <int D, class Real>
struct AtSites {
  alignas(64) Real value[D][lanes::kMostPlaces];
  Vec<D, Real> operator[](std::size_t k) const {
    Vec<D, Real> v;
    for (int a = 0; a < D; ++a) v[a] = value[a][k];
    return v;
  }
  void set(std::size_t k, const Vec<D, Real>& v) {
    for (int a = 0; a < D; ++a) value[a][k] = v[a];
  }
};

/// The field itself, for places of any block.
template <class Layout>
class FarField {
 public:
  static constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;

  FarField(const GridTransfer<Layout>& transfer, const ActiveBlocks<D>& blocks, const typename Layout::Field& field)
      : transfer_(transfer), blocks_(blocks), field_(field) {}
  /// [m/s]
  Vec<D, Real> at(const Site<D, Real>& site) const { return transfer_.velocity_at(blocks_, field_, site); }
  void velocities(const Sites<D, Real>& sites, AtSites<D, Real>& found) const {
    for (std::size_t k = 0; k < sites.count; ++k) found.set(k, at(sites[k]));
  }

 private:
  const GridTransfer<Layout>& transfer_;
  const ActiveBlocks<D>& blocks_;
  const typename Layout::Field& field_;
};

/// The field around a block: interpolates at sites in its cells and kReach cells around.
template <class Layout, class Weights>
class NearField {
 public:
  static constexpr int D = Layout::kDimension, n = Weights::kNodes;
  static constexpr int kReach = lanes::NearFaces::kReach, kBefore = kReach + 1, kEdge = Lattice<D>::kBlock + 2 * kReach + n;   // stencils begin a node before a cell
  using Real = typename Layout::Real;

  /// For so many particles.
  NearField(const GridTransfer<Layout>& transfer, const ActiveBlocks<D>& blocks, const Cell<D>& block, const typename Layout::Field& field, std::size_t particles)
      : far_(transfer, blocks, field) {
    for (int a = 0; a < D; ++a) {
      const int first = block[a] * Lattice<D>::kBlock;
      first_[a] = first - kBefore;
      cells_[a] = unsigned(std::min(Lattice<D>::kBlock, blocks.lattice().cells[a] - first) + 2 * kReach);
    }
    load_tile<Layout, kEdge, kBefore>(blocks, block, field, values_.data());
    if constexpr (kHasLanes) {
      near_.velocity = values_.data();
      if (particles >= kManyParticles) interpolation_ = transfer.interpolation();
    }
  }
  /// Of a cell as it is counted from the block, images beyond a periodic side not wrapped.
  bool covers(const Cell<D>& cell) const {
    bool inside = true;
    for (int a = 0; a < D; ++a) inside = inside && unsigned(cell[a] - first_[a] - 1) < cells_[a];
    return inside;
  }
  /// [m/s] at sites, covered or not.
  void velocities(const Sites<D, Real>& sites, AtSites<D, Real>& found) {
    if constexpr (kHasLanes)
      if (interpolation_) return by_lanes(sites, found);
    for (std::size_t k = 0; k < sites.count; ++k) {
      const Site<D, Real> site = sites[k];
      found.set(k, covers(site.cell) ? at(site) : far_.at(site));
    }
  }

 private:
  static constexpr bool kHasLanes = D == 3 && n == 3 && Layout::kLattices == 3 && std::is_same_v<Real, float>;   // with the linear kernel they are no faster
  static constexpr std::size_t kManyParticles = 64;                     // for fewer putting together takes longer than it saves
  static constexpr int kPlaces = int_power(kEdge, D), kLine = 4;
  using Line = Eigen::Array<Real, kLine, 1>;                            // a line of nodes and what follows it, which is not used
  struct Nothing {};

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

  void by_lanes(const Sites<D, Real>& sites, AtSites<D, Real>& found) {
    lanes::Places places;
    places.count = sites.count, places.offset = sites.offset;
    bool far = false;
    for (std::size_t k = 0; k < places.count; ++k) {
      bool covered = true;
      unsigned cell = 0;
      for (int a = 0; a < D; ++a) {
        const unsigned along = unsigned(sites.cell[a][k] - first_[a] - 1);
        covered = covered & (along < cells_[a]);
        cell = cell * lanes::NearFaces::kCells + along;
      }
      places.cell[k] = covered ? cell : 0;
      far = far | !covered;
    }
    for (std::size_t k = places.count; k % 4; ++k) places.cell[k] = 0;
    interpolation_(near_, places, found.value);
    for (std::size_t k = 0; far && k < sites.count; ++k)
      if (const Site<D, Real> site = sites[k]; !covers(site.cell)) found.set(k, far_.at(site));
  }

  FarField<Layout> far_;                                                // for sites that are not covered
  Cell<D> first_;                                                       // the node at index 0
  std::array<unsigned, D> cells_;                                       // that are covered along each axis
  std::array<Real, std::size_t(D * kPlaces + kLine - n)> values_{};     // by component; 0 where no block is active
  lanes::Interpolate interpolation_ = nullptr;                          // null: plainly
  [[no_unique_address]] std::conditional_t<kHasLanes, lanes::NearFaces, Nothing> near_;
};

/// Calls body(begin, end, near) for the particles of a block, number `b` of those occupied, with the NearField of the block. Particles must be stored
/// in the order that `ranges` is of, though they may have moved since.
template <class Layout, class Body>
void in_near_field(const GridTransfer<Layout>& transfer, const ActiveBlocks<Layout::kDimension>& blocks, const typename Layout::Field& field,
                   const CellRanges& ranges, std::size_t b, const Body& body) {
  constexpr std::size_t per_block = Lattice<Layout::kDimension>::kCellsPerBlock;
  const auto in = [&](auto weights) {
    const std::size_t begin = ranges.begin[b * per_block], end = ranges.begin[(b + 1) * per_block];
    NearField<Layout, decltype(weights)> near(transfer, blocks, blocks.lattice().block_at(ranges.occupied[b]), field, end - begin);
    body(begin, end, near);
  };
  if (transfer.kernel() == Kernel::linear) in(LinearWeights<typename Layout::Real>{});
  else in(QuadraticWeights<typename Layout::Real>{});
}

/// The same for all particles, in parallel; with empty ranges, for particles in any order, of the field itself.
template <class Layout, class Body>
void with_near_field(const GridTransfer<Layout>& transfer, const ActiveBlocks<Layout::kDimension>& blocks, const typename Layout::Field& field,
                     const CellRanges& ranges, std::size_t particles, const Body& body) {
  if (ranges.occupied.empty()) {
    const FarField<Layout> far(transfer, blocks, field);
    base::parallel_chunks(particles, 4096, [&](std::size_t begin, std::size_t end) { body(begin, end, far); });
    return;
  }
  base::parallel_chunks(ranges.occupied.size(), 1, [&](std::size_t b, std::size_t) { in_near_field(transfer, blocks, field, ranges, b, body); });
}

}  // namespace sim
