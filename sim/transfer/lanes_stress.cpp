// The transfers of solids. P2G: what lanes_nodes_quadratic.cpp scatters, and with it the impulse of stress. The gradient of a weight has, like the
// modes, one factor an axis: it rides along, where a pass of its own costs as much as APIC.
#define HWY_TARGET_INCLUDE "sim/transfer/lanes_stress.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/gather_lanes-inl.h"
#include "sim/transfer/scatter_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
namespace {

template <class S>
void scatter_stressed_block(const Block& block, const Stresses& stresses, float* tile) {
  scatter_particles<S, true>(block, stresses.row, stresses.factor, tile);
}

/// G2P with the velocity and its gradient as rows of their own, while they are in registers: rows of coefficients are long.
template <class S, class Rows>
HWY_INLINE void gather_moving(const Block& block, std::uint32_t p, int size, int cell, const BlockTerms<S>& terms, const Motions& motions,
                              Rows& rows) {
  constexpr Half half{};
  float spare[3 * S::count + 4];
  HWY_ALIGN float scratch[12 * kLanes];
  prefetch_offsets(block, p + 64, kLanes);
  const Batch<S> batch(block, p, size, rows.begin(p), spare);
  gather_batch<S, true>(batch, cell, terms, nullptr, 0, scratch);
  rows.end(size);
  float* const row = motions.gradient + 9 * std::size_t(p);   // lanes that do not count write what the next batch writes over
#pragma GCC unroll 3
  for (int g = 0; g < 3; ++g) {   // nine are no multiple of four: the last two groups overlap
    const int from = g < 2 ? 4 * g : 5;
    V c[4];
    for (int k = 0; k < 4; ++k) c[k] = hn::Load(kTag, scratch + (from + k) * kLanes);
    transpose(c[0], c[1], c[2], c[3]);
    for (int l = 0; l < 4; ++l) {
      hn::StoreU(hn::LowerHalf(half, c[l]), half, row + 9 * l + from);
      hn::StoreU(hn::UpperHalf(half, c[l]), half, row + 9 * (l + 4) + from);
    }
  }
  const float* const v = scratch + 9 * kLanes;
  hn::StoreInterleaved3(hn::Load(kTag, v), hn::Load(kTag, v + kLanes), hn::Load(kTag, v + 2 * kLanes), kTag, motions.velocity + 3 * std::size_t(p));
}

template <class S, class Rows>
HWY_INLINE void gather_moving_into(const Block& block, const float* tile, const Motions& motions, Rows& rows) {
  constexpr int slab_cells = Lattice<3>::kBlock * Lattice<3>::kBlock;
  BlockTerms<S> terms(tile);
  for (int slab = 0; slab < Lattice<3>::kBlock; ++slab) {
    terms.make_slab(slab);
    for_batches(block, slab * slab_cells, (slab + 1) * slab_cells,
                [&](std::uint32_t p, int size, int cell) { gather_moving<S>(block, p, size, cell % slab_cells, terms, motions, rows); });
  }
  rows.finish();
}

template <class S>
void gather_moving_block(const Block& block, const float* tile, const Motions& motions) {
  if constexpr (S::count == 27) {
    if (block.streams) {
      RowsPastCaches<S> rows(block);
      return gather_moving_into<S>(block, tile, motions, rows);
    }
  }
  RowsInPlace<S> rows(block);
  gather_moving_into<S>(block, tile, motions, rows);
}

}  // namespace

MovingKernels find_moving(int modes) {
  switch (modes) {
    case 1: return {scatter_stressed_block<Shape<3, 1, false>>, gather_moving_block<Shape<3, 1, false>>};
    case 4: return {scatter_stressed_block<Shape<3, 4, false>>, gather_moving_block<Shape<3, 4, false>>};
    case 8: return {scatter_stressed_block<Shape<3, 8, false>>, gather_moving_block<Shape<3, 8, false>>};
    case 27: return {scatter_stressed_block<Shape<3, 27, false>>, gather_moving_block<Shape<3, 27, false>>};
  }
  return {};
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_moving);
MovingKernels nodes_quadratic_of_solids(int modes) { return HWY_DYNAMIC_DISPATCH(find_moving)(modes); }
}  // namespace sim::lanes
#endif
