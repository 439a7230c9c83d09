// The transfers of solids. P2G: what lanes_nodes_*.cpp scatter, and with it the impulse of stress. The gradient of a weight has, like the
// modes, one factor an axis: it rides along, where a pass of its own costs as much as APIC.
#if defined(SIM_TRANSFER_STRESS_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_STRESS_LANES_INL_H
#undef SIM_TRANSFER_STRESS_LANES_INL_H
#else
#define SIM_TRANSFER_STRESS_LANES_INL_H
#endif

#include "base/prefetch.h"
#include "sim/transfer/gather_lanes-inl.h"
#include "sim/transfer/scatter_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

template <class S>
void scatter_stressed_block(const Block& block, const Stresses& stresses, float* tile) {
  scatter_particles<S, true>(block, stresses.row, stresses.factor, tile);
}

HWY_INLINE void prefetch_wanted(const Wanted& wanted, std::uint32_t p, int size) {
  if (!wanted.rows) return;
  for (std::uint32_t q = p; q < p + std::uint32_t(size); ++q) {
    const char* const row = wanted.rows + wanted.bytes * (wanted.row ? wanted.row[q] : q);
    base::prefetch(row), base::prefetch(row + wanted.bytes - 1);
  }
}

/// G2P with the velocity and its gradient beside the coefficients, while they are in registers: rows of these are long.
template <class S, class Rows>
HWY_INLINE void gather_moving(const Block& block, std::uint32_t p, int size, int cell, const BlockTerms<S>& terms, const Motions& motions,
                              Rows& rows) {
  float spare[3 * S::count + 4];
  V velocity[3];
  prefetch_offsets(block, p + 64, kLanes);
  prefetch_wanted(motions.wanted, p, size);
  const Batch<S> batch(block, p, size, rows.begin(p), spare);
  gather_batch<S, true>(batch, cell, terms, nullptr, 0, [&](int component, const Results& r) SIM_LANES_INLINED {
    velocity[component] = r.at[0][0][0];
    float* const column = motions.gradient + std::size_t(3 * component) * motions.stride + p;   // lanes that do not count: the next batch's place
    for (int a = 0; a < 3; ++a) hn::StoreU(r.slope[a], kTag, column + std::size_t(a) * motions.stride);
  });
  rows.end(size);
  hn::StoreInterleaved3(velocity[0], velocity[1], velocity[2], kTag, motions.velocity + 3 * std::size_t(p));
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
  if constexpr (S::count >= 4) {
    if (block.streams) {
      RowsPastCaches<S> rows(block);
      return gather_moving_into<S>(block, tile, motions, rows);
    }
  }
  RowsInPlace<S> rows(block);
  gather_moving_into<S>(block, tile, motions, rows);
}

/// Those of the first of some sets that has `set` modes.
template <int count, int... more>
MovingKernels find_moving(int set) {
  if (set == count) return {scatter_stressed_block<Shape<3, count, false>>, gather_moving_block<Shape<3, count, false>>};
  if constexpr (sizeof...(more) > 0) return find_moving<more...>(set);
  else return {};
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
