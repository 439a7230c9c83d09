// P2G of eight particles of a cell at a time: each lane adds to a node's sum of its own.
#if defined(SIM_TRANSFER_SCATTER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_SCATTER_LANES_INL_H
#undef SIM_TRANSFER_SCATTER_LANES_INL_H
#else
#define SIM_TRANSFER_SCATTER_LANES_INL_H
#endif

#include "sim/transfer/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

/// Adds weight times polynomial at the nodes: evaluation with rows that hold the weights.
template <int count, int modes, int tile, int wx, int wy, int wz>
HWY_INLINE void evaluate_onto(float* HWY_RESTRICT first, const Rows<modes, wx>& x, const Rows<modes, wy>& y, const Rows<modes, wz>& z,
                              const V (&c)[modes][modes][modes]) {
#pragma GCC unroll 4
  for (int i = 0; i < wx; ++i) {
    V plane[modes][modes];
#pragma GCC unroll 3
    for (int b = 0; b < modes; ++b)
#pragma GCC unroll 3
      for (int m = 0; m < modes; ++m) {
        if (!keeps<count>(0, b, m)) continue;
        V sum = hn::Mul(x.at[0][i], c[0][b][m]);
#pragma GCC unroll 3
        for (int a = 1; a < modes; ++a)
          if (keeps<count>(a, b, m)) sum = hn::MulAdd(x.at[a][i], c[a][b][m], sum);
        plane[b][m] = sum;
      }
#pragma GCC unroll 4
    for (int j = 0; j < wy; ++j) {
      V line[modes];
#pragma GCC unroll 3
      for (int m = 0; m < modes; ++m) {
        line[m] = hn::Mul(y.at[0][j], plane[0][m]);
#pragma GCC unroll 3
        for (int b = 1; b < modes; ++b)
          if (keeps<count>(0, b, m)) line[m] = hn::MulAdd(y.at[b][j], plane[b][m], line[m]);
      }
      float* HWY_RESTRICT node = first + (i * tile + j) * tile * kLanes;
#pragma GCC unroll 4
      for (int k = 0; k < wz; ++k) {
        V sum = hn::Load(kTag, node + k * kLanes);
#pragma GCC unroll 3
        for (int m = 0; m < modes; ++m) sum = hn::MulAdd(z.at[m][k], line[m], sum);
        hn::Store(sum, kTag, node + k * kLanes);
      }
    }
  }
}

template <class S, int l>
HWY_INLINE void scatter_lattice(const Batch<S>& batch, std::size_t cell_place, float* HWY_RESTRICT lanes) {
  constexpr int wx = S::width(l, 0), wy = S::width(l, 1), wz = S::width(l, 2);
  Rows<S::modes, wx> x;
  Rows<S::modes, wy> y;
  Rows<S::modes, wz> z;
  axis_rows<S::n, S::kind(l, 0), S::modes, false>(batch.t[0], x);
  axis_rows<S::n, S::kind(l, 1), S::modes, false>(batch.t[1], y);
  axis_rows<S::n, S::kind(l, 2), S::modes, false>(batch.t[2], z);
  const auto counts = hn::FirstN(kTag, std::size_t(batch.size));   // every product has a factor of x
  for (int m = 0; m < S::modes; ++m)
    for (int i = 0; i < wx; ++i) x.at[m][i] = hn::IfThenElseZero(counts, x.at[m][i]);
  const std::size_t first = std::size_t(std::ptrdiff_t(cell_place) + S::first_place(l)) * kLanes, field = std::size_t(S::padded) * kLanes;
  float* HWY_RESTRICT mass = lanes + std::size_t(l) * field + first;
#pragma GCC unroll 4
  for (int i = 0; i < wx; ++i)
#pragma GCC unroll 4
    for (int j = 0; j < wy; ++j) {
      const V w = hn::Mul(x.at[0][i], y.at[0][j]);
      float* HWY_RESTRICT node = mass + (i * S::tile + j) * S::tile * kLanes;
#pragma GCC unroll 4
      for (int k = 0; k < wz; ++k) hn::Store(hn::MulAdd(w, z.at[0][k], hn::Load(kTag, node + k * kLanes)), kTag, node + k * kLanes);
    }
  constexpr int components = S::faces ? 1 : 3;
  for (int k = 0; k < components; ++k) {
    const int component = S::faces ? l : k;
    V c[S::modes][S::modes][S::modes];
    load_component<S>(batch, component, c);
    evaluate_onto<S::count, S::modes, S::tile, wx, wy, wz>(lanes + std::size_t(S::lattices + component) * field + first, x, y, z, c);
  }
}

/// Sums of eight lanes for every place, in one order: (0 + 4) + (1 + 5) + ((2 + 6) + (3 + 7)).
template <class S>
HWY_INLINE void reduce(const float* HWY_RESTRICT lanes, float* HWY_RESTRICT tile) {
  constexpr Half half{};
  HWY_ALIGN float sums[kLanes];
  for (int f = 0; f < S::fields; ++f)
    for (int place = 0; place < S::padded; place += 4) {
      const float* HWY_RESTRICT from = lanes + (std::size_t(f) * S::padded + std::size_t(place)) * kLanes;
      V r[4];
      for (int q = 0; q < 4; ++q) r[q] = hn::Load(kTag, from + q * kLanes);
      transpose(r[0], r[1], r[2], r[3]);   // r[l]: lanes l and l + 4 of the four places
      const V sum = hn::Add(hn::Add(r[0], r[1]), hn::Add(r[2], r[3]));
      const auto totals = hn::Add(hn::LowerHalf(half, sum), hn::UpperHalf(half, sum));
      if (place + 4 <= S::places) {
        hn::StoreU(totals, half, tile + f * S::places + place);
        continue;
      }
      hn::Store(totals, half, sums);
      std::memcpy(tile + f * S::places + place, sums, sizeof(float) * (S::places % 4));
    }
}

/// Calls for the rows of the batches to come: they lie where the last sort left them, and no hardware guesses that.
template <class S>
HWY_INLINE void prefetch_rows(const Block& block, std::uint32_t p) {
  constexpr std::uint32_t kAhead = 2 * kLanes;
  const std::uint32_t end = block.begin[Lattice<3>::kCellsPerBlock], first = p + kAhead, last = first + kLanes < end ? first + kLanes : end;
  for (std::uint32_t q = first; q < last; ++q) {
    const char* const row = reinterpret_cast<const char*>(block.coefficients + std::size_t(block.row[q]) * Batch<S>::kRow);
#pragma GCC unroll 6
    for (std::size_t byte = 0; byte < sizeof(float) * Batch<S>::kRow; byte += 64) __builtin_prefetch(row + byte);
    __builtin_prefetch(row + sizeof(float) * Batch<S>::kRow - 1);
  }
}

template <class S>
struct ScatterBatch {
  const Block& block;
  float* lanes;
  HWY_INLINE void operator()(std::uint32_t p, int size, std::size_t place) const {
    if (block.row) prefetch_rows<S>(block, p);
    const Batch<S> batch(block, p, size, block.row != nullptr, nullptr);
    scatter_lattice<S, 0>(batch, place, lanes);
    if constexpr (S::faces) {
      scatter_lattice<S, 1>(batch, place, lanes);
      scatter_lattice<S, 2>(batch, place, lanes);
    }
  }
};

template <class S>
void scatter_block(const Block& block, float* tile) {
  alignas(64) float lanes[std::size_t(S::fields) * S::padded * kLanes];
  if (block.row)
    for (std::uint32_t q = block.begin[0]; q < block.begin[Lattice<3>::kCellsPerBlock] && q < block.begin[0] + 2 * kLanes; ++q)
      __builtin_prefetch(block.coefficients + std::size_t(block.row[q]) * Batch<S>::kRow);
  std::memset(lanes, 0, sizeof lanes);
  ScatterBatch<S> body{block, lanes};
  for_batches<S>(block, body);
  reduce<S>(lanes, tile);
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
