// G2P of eight particles of a cell at a time, one axis after the other.
#if defined(SIM_TRANSFER_GATHER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_GATHER_LANES_INL_H
#undef SIM_TRANSFER_GATHER_LANES_INL_H
#else
#define SIM_TRANSFER_GATHER_LANES_INL_H
#endif

#include "sim/transfer/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

/// Coefficients by [a][b][c] from node values: analysis. `count` products and, if asked, the three of second degree along one axis.
template <int count, int modes, bool gradient>
constexpr bool wanted(int a, int b, int c) {
  return a < modes && b < modes && c < modes && (keeps<count>(a, b, c) || (gradient && a * b == 0 && a * c == 0 && b * c == 0));
}

template <int count, bool gradient, int modes, int tile, int wx, int wy, int wz>
HWY_INLINE void analyse(const float* HWY_RESTRICT first, const Rows<modes, wx>& x, const Rows<modes, wy>& y, const Rows<modes, wz>& z,
                        V (&c)[modes][modes][modes]) {
  V plane[wx][modes][modes];
#pragma GCC unroll 4
  for (int i = 0; i < wx; ++i) {
    V line[wy][modes];
#pragma GCC unroll 4
    for (int j = 0; j < wy; ++j) {
      const float* HWY_RESTRICT node = first + (i * tile + j) * tile;
#pragma GCC unroll 3
      for (int m = 0; m < modes; ++m) line[j][m] = hn::Mul(z.at[m][0], hn::Set(kTag, node[0]));
#pragma GCC unroll 4
      for (int k = 1; k < wz; ++k) {
        const V value = hn::Set(kTag, node[k]);
#pragma GCC unroll 3
        for (int m = 0; m < modes; ++m) line[j][m] = hn::MulAdd(z.at[m][k], value, line[j][m]);
      }
    }
#pragma GCC unroll 3
    for (int m = 0; m < modes; ++m)
#pragma GCC unroll 3
      for (int b = 0; b < modes; ++b) {
        if (!wanted<count, modes, gradient>(0, b, m)) continue;
        V sum = hn::Mul(y.at[b][0], line[0][m]);
#pragma GCC unroll 4
        for (int j = 1; j < wy; ++j) sum = hn::MulAdd(y.at[b][j], line[j][m], sum);
        plane[i][b][m] = sum;
      }
  }
#pragma GCC unroll 3
  for (int m = 0; m < modes; ++m)
#pragma GCC unroll 3
    for (int b = 0; b < modes; ++b)
#pragma GCC unroll 3
      for (int a = 0; a < modes; ++a) {
        if (!wanted<count, modes, gradient>(a, b, m)) continue;
        V sum = hn::Mul(x.at[a][0], plane[0][b][m]);
#pragma GCC unroll 4
        for (int i = 1; i < wx; ++i) sum = hn::MulAdd(x.at[a][i], plane[i][b][m], sum);
        c[a][b][m] = sum;
      }
}

/// dN . v along each axis from coefficients: the derivative of the kernel is (dual of w) - x (1 - 4 x^2) (dual of g).
template <class S>
HWY_INLINE void store_gradient(const Batch<S>& batch, int component, const V (&c)[3][3][3], float* HWY_RESTRICT scratch) {
  const V one = hn::Set(kTag, 1.0f), half = hn::Set(kTag, 0.5f);
  const V of_w[3] = {c[1][0][0], c[0][1][0], c[0][0][1]}, of_g[3] = {c[2][0][0], c[0][2][0], c[0][0][2]};
  for (int a = 0; a < 3; ++a) {
    const V x = hn::IfThenElse(hn::Ge(batch.t[a], half), hn::Sub(batch.t[a], one), batch.t[a]), two_x = hn::Add(x, x);
    const V slope = hn::Mul(x, hn::Mul(hn::Sub(one, two_x), hn::Add(one, two_x)));
    hn::Store(hn::NegMulAdd(slope, of_g[a], of_w[a]), kTag, scratch + (3 * component + a) * kLanes);
  }
}

template <class S, int l, bool gradient>
HWY_INLINE void gather_lattice(const Batch<S>& batch, std::size_t cell_place, const Gathering& g, float* HWY_RESTRICT scratch) {
  constexpr int wx = S::width(l, 0), wy = S::width(l, 1), wz = S::width(l, 2), modes = gradient ? 3 : S::modes;
  Rows<modes, wx> x;
  Rows<modes, wy> y;
  Rows<modes, wz> z;
  axis_rows<S::n, S::kind(l, 0), modes, true>(batch.t[0], x);
  axis_rows<S::n, S::kind(l, 1), modes, true>(batch.t[1], y);
  axis_rows<S::n, S::kind(l, 2), modes, true>(batch.t[2], z);
  const std::size_t first = std::size_t(std::ptrdiff_t(cell_place) + S::first_place(l));
  constexpr int components = S::faces ? 1 : 3;
  for (int k = 0; k < components; ++k) {
    const int component = S::faces ? l : k;
    const std::size_t field = std::size_t(component) * S::places + first;
    V c[modes][modes][modes];
    analyse<S::count, gradient, modes, S::tile, wx, wy, wz>(g.tile + field, x, y, z, c);
    if constexpr (S::count == 1) {
      HWY_ALIGN float one[kLanes];
      hn::Store(c[0][0][0], kTag, one);
      if (g.before) {
        HWY_ALIGN float then[kLanes];
        analyse<1, false, modes, S::tile, wx, wy, wz>(g.before + field, x, y, z, c);
        hn::Store(c[0][0][0], kTag, then);
        for (int lane = 0; lane < batch.size; ++lane) one[lane] += g.keep * (batch.at[lane][component] - then[lane]);
      }
      for (int lane = 0; lane < batch.size; ++lane) batch.at[lane][component] = one[lane];
    } else if constexpr (modes == S::modes) {
      store_component<S>(batch, component, c);
    } else {
      V kept[S::modes][S::modes][S::modes];
      for (int r = 0; r < S::count; ++r) coefficient<S::count>(kept, r) = coefficient<S::count>(c, r);
      store_component<S>(batch, component, kept);
    }
    if constexpr (gradient) store_gradient<S>(batch, component, c, scratch);
  }
}

/// Calls for the rows that are written two batches later: a batch writes a piece of each of eight rows, which hardware does not take for a stream,
/// and stores to lines that are far fill the store queue.
template <class S>
HWY_INLINE void prefetch_written(const Block& block, std::uint32_t p) {
  constexpr std::uint32_t kAhead = 2 * kLanes;
  if constexpr (S::count < 8) return;   // short rows fill their lines at once
  const char* const row = reinterpret_cast<const char*>(block.coefficients + std::size_t(p + kAhead) * Batch<S>::kRow);
#pragma GCC unroll 8
  for (std::size_t byte = 0; byte < kLanes * sizeof(float) * Batch<S>::kRow; byte += 64) __builtin_prefetch(row + byte, 1);
}

template <class S, bool gradient>
struct GatherBatch {
  const Block& block;
  const Gathering& g;
  HWY_INLINE void operator()(std::uint32_t p, int size, std::size_t place) const {
    float spare[3 * S::count + 4];
    HWY_ALIGN float scratch[gradient ? 9 * kLanes : kLanes];
    prefetch_written<S>(block, p);
    const Batch<S> batch(block, p, size, false, spare);
    gather_lattice<S, 0, gradient>(batch, place, g, scratch);
    if constexpr (S::faces) {
      gather_lattice<S, 1, false>(batch, place, g, scratch);
      gather_lattice<S, 2, false>(batch, place, g, scratch);
    }
    if constexpr (gradient)
      for (int lane = 0; lane < size; ++lane)
        for (int k = 0; k < 9; ++k) g.gradient[9 * (std::size_t(p) + std::size_t(lane)) + std::size_t(k)] = scratch[k * kLanes + lane];
  }
};

template <class S>
void gather_block(const Block& block, const Gathering& g) {
  if constexpr (!S::faces && S::n == 3) {
    if (g.gradient) {
      GatherBatch<S, true> body{block, g};
      for_batches<S>(block, body);
      return;
    }
  }
  GatherBatch<S, false> body{block, g};
  for_batches<S>(block, body);
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
