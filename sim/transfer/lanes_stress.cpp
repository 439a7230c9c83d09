// The transfers of solids, eight particles at a time. P2G: what lanes_nodes_quadratic.cpp scatters, and with it the impulse of stress. The gradient of a weight
// has, like the modes, one factor an axis: it rides along the contractions, and costs a multiply-add a node where a pass of its own costs as much
// as APIC.
#define HWY_TARGET_INCLUDE "sim/transfer/lanes_stress.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/gather_lanes-inl.h"
#include "sim/transfer/scatter_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
namespace {

/// Slopes of the weights along an axis [1/cell]: x - 1/2, -2 x, x + 1/2.
struct Slopes {
  V at[3];
  HWY_INLINE Slopes(V t) {
    const V half = hn::Set(kTag, 0.5f), x = hn::IfThenElse(hn::Ge(t, half), hn::Sub(t, hn::Set(kTag, 1.0f)), t);
    at[0] = hn::Sub(x, half), at[1] = hn::Mul(hn::Set(kTag, -2.0f), x), at[2] = hn::Add(x, half);
  }
};

/// Stress of the lanes' particles times the factor: xx xy xz yy yz zz.
struct LaneStress {
  V tau[6];
  template <class S>
  HWY_INLINE LaneStress(const Batch<S>& batch, const Stresses& stresses, const Block& block, std::uint32_t p) {
    constexpr Half half{};
    const float* at[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      const std::uint32_t q = p + std::uint32_t(l < batch.size ? l : 0);
      at[l] = stresses.row + 6 * std::size_t(block.row ? block.row[q] : q);
    }
#pragma GCC unroll 2
    for (int from = 0; from < 4; from += 2) {   // six are no multiple of four: two groups that overlap
      V c[4];
      for (int l = 0; l < 4; ++l) c[l] = hn::Combine(kTag, hn::LoadU(half, at[l + 4] + from), hn::LoadU(half, at[l] + from));
      transpose(c[0], c[1], c[2], c[3]);
      for (int k = 0; k < 4; ++k) tau[from + k] = c[k];
    }
    const V factor = hn::Set(kTag, stresses.factor);
    for (V& x : tau) x = hn::Mul(factor, x);
  }
};

/// Adds the polynomial and the stress row (tx, ty, tz) of one component at the nodes.
template <int count, int modes, int tile>
HWY_INLINE void evaluate_with_stress(float* HWY_RESTRICT first, const Rows<modes, 3>& x, const Rows<modes, 3>& y, const Rows<modes, 3>& z,
                                     const Slopes& sx, const Slopes& sy, const Slopes& sz, const V (&c)[modes][modes][modes], V tx, V ty, V tz) {
  // The product of both other weights carries the slope along z, and APIC's slope of the velocity along z with it.
  V along[3];
  for (int k = 0; k < 3; ++k) {
    along[k] = hn::Mul(sz.at[k], tz);
    if constexpr (count == 4) along[k] = hn::MulAdd(z.at[1][k], c[0][0][1], along[k]);
  }
  constexpr int lines = count == 4 ? 1 : modes;   // of z that have a polynomial of their own
#pragma GCC unroll 3
  for (int i = 0; i < 3; ++i) {
    V plane[modes][modes];
#pragma GCC unroll 3
    for (int b = 0; b < modes; ++b)
#pragma GCC unroll 3
      for (int m = 0; m < lines; ++m) {
        if (!keeps<count>(0, b, m)) continue;
        V sum = hn::Mul(x.at[0][i], c[0][b][m]);
#pragma GCC unroll 3
        for (int a = 1; a < modes; ++a)
          if (keeps<count>(a, b, m)) sum = hn::MulAdd(x.at[a][i], c[a][b][m], sum);
        plane[b][m] = sum;
      }
    plane[0][0] = hn::MulAdd(sx.at[i], tx, plane[0][0]);
    const V in_y = hn::Mul(x.at[0][i], ty);
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      V line[lines];
#pragma GCC unroll 3
      for (int m = 0; m < lines; ++m) {
        line[m] = hn::Mul(y.at[0][j], plane[0][m]);
#pragma GCC unroll 3
        for (int b = 1; b < modes; ++b)
          if (keeps<count>(0, b, m)) line[m] = hn::MulAdd(y.at[b][j], plane[b][m], line[m]);
      }
      line[0] = hn::MulAdd(sy.at[j], in_y, line[0]);
      const V both = hn::Mul(x.at[0][i], y.at[0][j]);
      float* HWY_RESTRICT node = first + (i * tile + j) * tile * kLanes;
#pragma GCC unroll 3
      for (int k = 0; k < 3; ++k) {
        V sum = hn::Load(kTag, node + k * kLanes);
#pragma GCC unroll 3
        for (int m = 0; m < lines; ++m) sum = hn::MulAdd(z.at[m][k], line[m], sum);
        hn::Store(hn::MulAdd(both, along[k], sum), kTag, node + k * kLanes);
      }
    }
  }
}

template <class S>
struct StressedBatch {
  const Block& block;
  const Stresses& stresses;
  float* lanes;

  HWY_INLINE void operator()(std::uint32_t p, int size, std::size_t place) const {
    if (block.row) prefetch(p);
    const Batch<S> batch(block, p, size, block.row != nullptr, nullptr);
    const LaneStress stress(batch, stresses, block, p);
    Rows<S::modes, 3> x, y, z;
    axis_rows<3, Axis::shared_node, S::modes, false>(batch.t[0], x);
    axis_rows<3, Axis::shared_node, S::modes, false>(batch.t[1], y);
    axis_rows<3, Axis::shared_node, S::modes, false>(batch.t[2], z);
    Slopes sx(batch.t[0]), sy(batch.t[1]), sz(batch.t[2]);
    const auto counts = hn::FirstN(kTag, std::size_t(size));   // every product has a factor of x
    for (int i = 0; i < 3; ++i) {
      for (int m = 0; m < S::modes; ++m) x.at[m][i] = hn::IfThenElseZero(counts, x.at[m][i]);
      sx.at[i] = hn::IfThenElseZero(counts, sx.at[i]);
    }
    const std::size_t first = std::size_t(std::ptrdiff_t(place) + S::first_place(0)) * kLanes, field = std::size_t(S::padded) * kLanes;
    float* HWY_RESTRICT mass = lanes + first;
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j) {
        const V w = hn::Mul(x.at[0][i], y.at[0][j]);
        float* HWY_RESTRICT node = mass + (i * S::tile + j) * S::tile * kLanes;
#pragma GCC unroll 3
        for (int k = 0; k < 3; ++k) hn::Store(hn::MulAdd(w, z.at[0][k], hn::Load(kTag, node + k * kLanes)), kTag, node + k * kLanes);
      }
    constexpr int rows[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
#pragma GCC unroll 3
    for (int k = 0; k < 3; ++k) {
      V c[S::modes][S::modes][S::modes];
      load_component<S>(batch, k, c);
      evaluate_with_stress<S::count, S::modes, S::tile>(lanes + std::size_t(1 + k) * field + first, x, y, z, sx, sy, sz, c, stress.tau[rows[k][0]],
                                                        stress.tau[rows[k][1]], stress.tau[rows[k][2]]);
    }
  }

 private:
  HWY_INLINE void prefetch(std::uint32_t p) const {
    prefetch_rows<S>(block, p);
    const std::uint32_t end = block.begin[Lattice<3>::kCellsPerBlock], first = p + 2 * kLanes, last = first + kLanes < end ? first + kLanes : end;
    for (std::uint32_t q = first; q < last; ++q) __builtin_prefetch(stresses.row + 6 * std::size_t(block.row[q]));
  }
};

template <class S>
void scatter_stressed_block(const Block& block, const Stresses& stresses, float* tile) {
  alignas(64) float lanes[std::size_t(S::fields) * S::padded * kLanes];
  std::memset(lanes, 0, sizeof lanes);
  StressedBatch<S> body{block, stresses, lanes};
  for_batches<S>(block, body);
  reduce<S>(lanes, tile);
}

/// G2P with the velocity and its gradient as rows of their own, while they are in registers: rows of coefficients are long.
template <class S>
struct MovingGather {
  const Block& block;
  const float* tile;
  const Motions& motions;
  HWY_INLINE void operator()(std::uint32_t p, int size, std::size_t place) const {
    constexpr Half half{};
    float spare[3 * S::count + 4], spare_row[12], spare_velocity[4];
    HWY_ALIGN float scratch[9 * kLanes];
    prefetch_written<S>(block, p);
    const Batch<S> batch(block, p, size, false, spare);
    gather_lattice<S, 0, true>(batch, place, {.tile = tile}, scratch);
    float *row[kLanes], *velocity[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      row[l] = l < size ? motions.gradient + 9 * (std::size_t(p) + std::size_t(l)) : spare_row;
      velocity[l] = l < size ? motions.velocity + 3 * (std::size_t(p) + std::size_t(l)) : spare_velocity;
    }
#pragma GCC unroll 3
    for (int g = 0; g < 3; ++g) {   // nine are no multiple of four: the last two groups overlap
      const int from = g < 2 ? 4 * g : 5;
      V c[4];
      for (int k = 0; k < 4; ++k) c[k] = hn::Load(kTag, scratch + (from + k) * kLanes);
      transpose(c[0], c[1], c[2], c[3]);
      for (int l = 0; l < 4; ++l) hn::StoreU(hn::LowerHalf(half, c[l]), half, row[l] + from), hn::StoreU(hn::UpperHalf(half, c[l]), half, row[l + 4] + from);
    }
    for (int l = 0; l < kLanes; ++l)
      for (int c = 0; c < 3; ++c) velocity[l][c] = batch.at[l][c * S::count];
  }
};

template <class S>
void gather_moving_block(const Block& block, const float* tile, const Motions& motions) {
  MovingGather<S> body{block, tile, motions};
  for_batches<S>(block, body);
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
