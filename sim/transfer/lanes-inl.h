// The bodies of lanes.h, compiled once for every instruction set by the files that include it (Highway's foreach_target).
#if defined(SIM_TRANSFER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_LANES_INL_H
#undef SIM_TRANSFER_LANES_INL_H
#else
#define SIM_TRANSFER_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <cstring>

#include "sim/transfer/lanes.h"
#include "sim/transfer/modes.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
constexpr int kLanes = 8;
using Lanes = hn::FixedTag<float, kLanes>;
using Half = hn::FixedTag<float, kLanes / 2>;
using V = hn::Vec<Lanes>;
constexpr Lanes kTag{};

// --- one axis ---------------------------------------------------------------------------------------------------------

/// Where lanes of one cell find their nodes along an axis: all at the same (shared), or some one node further (wide: a row has an entry more,
/// which is 0 for those that do not reach it).
enum class Axis { shared_node, shared_middle, shared_corner, wide_corner, wide_middle };

/// Rows of an axis for each lane: entry [mode][node].
template <int modes, int width>
struct Rows {
  V at[modes][width];
};

/// Weights, polynomials and functionals of the kernel with n nodes, as basis.h has them: here what a pass needs of them.
template <int n, int modes, bool dual>
HWY_INLINE void basis_rows(V x, V (&out)[modes][n]) {
  const V one = hn::Set(kTag, 1.0f), half = hn::Set(kTag, 0.5f), quarter = hn::Set(kTag, 0.25f);
  if constexpr (n == 2) {
    const V w0 = hn::Sub(one, x);
    out[0][0] = w0, out[0][1] = x;
    if constexpr (modes > 1) {
      if constexpr (dual) {
        out[1][0] = hn::Set(kTag, -1.0f), out[1][1] = one;
      } else {                                                  // weight times polynomial
        const V both = hn::Mul(w0, x);
        out[1][0] = hn::Neg(both), out[1][1] = both;
      }
    }
  } else {
    const V left = hn::Sub(half, x), right = hn::Add(half, x);
    const V w0 = hn::Mul(hn::Mul(left, left), half), w1 = hn::Sub(hn::Set(kTag, 0.75f), hn::Mul(x, x)), w2 = hn::Mul(hn::Mul(right, right), half);
    out[0][0] = w0, out[0][1] = w1, out[0][2] = w2;
    if constexpr (modes > 1) {
      const V scale = hn::Set(kTag, dual ? 4.0f : 1.0f);
      out[1][0] = hn::Mul(hn::Mul(scale, w0), hn::Sub(hn::Set(kTag, -1.0f), x));
      out[1][1] = hn::Mul(hn::Mul(scale, w1), hn::Neg(x));
      out[1][2] = hn::Mul(hn::Mul(scale, w2), hn::Sub(one, x));
    }
    if constexpr (modes > 2) {
      if constexpr (dual) {
        out[2][0] = half, out[2][1] = hn::Set(kTag, -1.0f), out[2][2] = half;
      } else {
        const V two_x = hn::Add(x, x), lower = hn::Sub(one, two_x), upper = hn::Add(one, two_x), product = hn::Mul(lower, upper);
        const V bend = hn::Mul(hn::Sub(hn::Set(kTag, 3.0f), hn::Mul(two_x, two_x)), quarter);
        out[2][0] = hn::Mul(w0, hn::Mul(hn::Mul(upper, upper), bend));
        out[2][1] = hn::Mul(w1, hn::Neg(hn::Mul(hn::Mul(product, product), quarter)));
        out[2][2] = hn::Mul(w2, hn::Mul(hn::Mul(lower, lower), bend));
      }
    }
  }
}

/// The rows of lanes with offsets t in the cell.
template <int n, Axis axis, int modes, bool dual, int width>
HWY_INLINE void axis_rows(V t, Rows<modes, width>& rows) {
  const V half = hn::Set(kTag, 0.5f), one = hn::Set(kTag, 1.0f);
  const auto upper = hn::Ge(t, half);
  V x = t;
  if constexpr (axis == Axis::shared_middle) x = hn::Sub(t, half);
  if constexpr (axis == Axis::shared_node || axis == Axis::wide_corner) x = hn::IfThenElse(upper, hn::Sub(t, one), t);
  if constexpr (axis == Axis::wide_middle) x = hn::IfThenElse(upper, hn::Sub(t, half), hn::Add(t, half));
  if constexpr (width == n) {
    basis_rows<n, modes, dual>(x, rows.at);
  } else {
    V narrow[modes][n];
    basis_rows<n, modes, dual>(x, narrow);
#pragma GCC unroll 3
    for (int m = 0; m < modes; ++m) {
      rows.at[m][0] = hn::IfThenZeroElse(upper, narrow[m][0]);
#pragma GCC unroll 3
      for (int k = 1; k < n; ++k) rows.at[m][k] = hn::IfThenElse(upper, narrow[m][k - 1], narrow[m][k]);
      rows.at[m][n] = hn::IfThenElseZero(upper, narrow[m][n - 1]);
    }
  }
}

// --- shapes -----------------------------------------------------------------------------------------------------------

/// The products a particle carries, by their number: 1, 4, 8 or 27. All sets hold with a product every one below it.
template <int count>
constexpr bool keeps(int a, int b, int c) {
  if (count == 1) return a + b + c == 0;
  if (count == 4) return a + b + c <= 1;
  if (count == 8) return a <= 1 && b <= 1 && c <= 1;
  return true;
}

/// Nodes on one lattice (faces: one a component).
template <int n_, int count_, bool faces_>
struct Shape {
  static constexpr int n = n_, count = count_, tile = Lattice<3>::kBlock + n, places = tile * tile * tile;
  static constexpr int padded = (places + 3) / 4 * 4;
  static constexpr bool faces = faces_;
  static constexpr int modes = count == 1 ? 1 : count == 27 ? 3 : 2;   // of an axis
  static constexpr int lattices = faces ? 3 : 1, fields = lattices + 3;
  /// Of axis `axis` on lattice l.
  static constexpr Axis kind(int l, int axis) {
    if (!faces) return n == 3 ? Axis::shared_node : Axis::shared_corner;
    if (n == 3) return axis == l ? Axis::wide_corner : Axis::shared_middle;
    return axis == l ? Axis::shared_corner : Axis::wide_middle;
  }
  static constexpr int width(int l, int axis) { return n + (kind(l, axis) == Axis::wide_corner || kind(l, axis) == Axis::wide_middle); }
  /// First node of a cell's lanes, from the cell's own place in the tile.
  static constexpr int first(int l, int axis) { return kind(l, axis) == Axis::shared_corner ? 0 : -1; }
  static constexpr int first_place(int l) { return (first(l, 0) * tile + first(l, 1)) * tile + first(l, 2); }
};

// --- contractions, one axis at a time ---------------------------------------------------------------------------------

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

// --- particles <-> lanes ----------------------------------------------------------------------------------------------

/// r[l] holds four numbers of lane l and four of lane l + 4; afterwards number l of all eight lanes. Its own inverse.
HWY_INLINE void transpose(V& r0, V& r1, V& r2, V& r3) {
  const hn::Repartition<double, Lanes> pairs;
  const auto t0 = hn::BitCast(pairs, hn::InterleaveLower(kTag, r0, r1)), t1 = hn::BitCast(pairs, hn::InterleaveUpper(kTag, r0, r1));
  const auto t2 = hn::BitCast(pairs, hn::InterleaveLower(kTag, r2, r3)), t3 = hn::BitCast(pairs, hn::InterleaveUpper(kTag, r2, r3));
  r0 = hn::BitCast(kTag, hn::InterleaveLower(pairs, t0, t2)), r1 = hn::BitCast(kTag, hn::InterleaveUpper(pairs, t0, t2));
  r2 = hn::BitCast(kTag, hn::InterleaveLower(pairs, t1, t3)), r3 = hn::BitCast(kTag, hn::InterleaveUpper(pairs, t1, t3));
}

/// Eight particles: where their coefficients are, and which lanes count.
template <class S>
struct Batch {
  static constexpr int kRow = 3 * S::count;
  float* at[kLanes];
  V t[3];
  int size;

  HWY_INLINE Batch(const Block& block, std::uint32_t p, int lanes, bool through_rows, float* spare) : size(lanes) {
    for (int l = 0; l < kLanes; ++l) {
      const std::uint32_t q = p + std::uint32_t(l < lanes ? l : 0);
      at[l] = l < lanes || !spare ? block.coefficients + std::size_t(through_rows ? block.row[q] : q) * kRow : spare;
    }
    if (lanes == kLanes) {
      hn::LoadInterleaved3(kTag, block.offset + 3 * std::size_t(p), t[0], t[1], t[2]);
    } else {
      HWY_ALIGN float some[3 * kLanes] = {};
      std::memcpy(some, block.offset + 3 * std::size_t(p), sizeof(float) * 3 * std::size_t(lanes));
      hn::LoadInterleaved3(kTag, some, t[0], t[1], t[2]);
    }
  }

  HWY_INLINE void load4(int from, V& c0, V& c1, V& c2, V& c3) const {
    constexpr Half half{};
    c0 = hn::Combine(kTag, hn::LoadU(half, at[4] + from), hn::LoadU(half, at[0] + from));
    c1 = hn::Combine(kTag, hn::LoadU(half, at[5] + from), hn::LoadU(half, at[1] + from));
    c2 = hn::Combine(kTag, hn::LoadU(half, at[6] + from), hn::LoadU(half, at[2] + from));
    c3 = hn::Combine(kTag, hn::LoadU(half, at[7] + from), hn::LoadU(half, at[3] + from));
    transpose(c0, c1, c2, c3);
  }
  HWY_INLINE void store4(int from, V c0, V c1, V c2, V c3) const {
    constexpr Half half{};
    transpose(c0, c1, c2, c3);
    hn::StoreU(hn::LowerHalf(half, c0), half, at[0] + from), hn::StoreU(hn::UpperHalf(half, c0), half, at[4] + from);
    hn::StoreU(hn::LowerHalf(half, c1), half, at[1] + from), hn::StoreU(hn::UpperHalf(half, c1), half, at[5] + from);
    hn::StoreU(hn::LowerHalf(half, c2), half, at[2] + from), hn::StoreU(hn::UpperHalf(half, c2), half, at[6] + from);
    hn::StoreU(hn::LowerHalf(half, c3), half, at[3] + from), hn::StoreU(hn::UpperHalf(half, c3), half, at[7] + from);
  }
};

/// The first of each group of four modes of a component: groups of a row that is no multiple of four overlap.
template <int count>
constexpr int group_start(int group) {
  return 4 * group + 4 <= count ? 4 * group : count - 4;
}

template <int count, int modes>
HWY_INLINE V& coefficient(V (&c)[modes][modes][modes], int r) {
  const ModeIndex<3>& mode = kSupplementOrder3[r];
  return c[mode[0]][mode[1]][mode[2]];
}

template <class S>
HWY_INLINE void load_component(const Batch<S>& batch, int component, V (&c)[S::modes][S::modes][S::modes]) {
  if constexpr (S::count == 1) {
    HWY_ALIGN float one[kLanes];
    for (int l = 0; l < kLanes; ++l) one[l] = batch.at[l][component];
    c[0][0][0] = hn::Load(kTag, one);
  } else {
#pragma GCC unroll 7
    for (int g = 0; g < (S::count + 3) / 4; ++g) {
      constexpr auto start = group_start<S::count>;
      V c0, c1, c2, c3;
      batch.load4(component * S::count + start(g), c0, c1, c2, c3);
      coefficient<S::count>(c, start(g)) = c0, coefficient<S::count>(c, start(g) + 1) = c1;
      coefficient<S::count>(c, start(g) + 2) = c2, coefficient<S::count>(c, start(g) + 3) = c3;
    }
  }
}

template <class S>
HWY_INLINE void store_component(const Batch<S>& batch, int component, V (&c)[S::modes][S::modes][S::modes]) {
#pragma GCC unroll 7
  for (int g = 0; g < (S::count + 3) / 4; ++g) {
    constexpr auto start = group_start<S::count>;
    batch.store4(component * S::count + start(g), coefficient<S::count>(c, start(g)), coefficient<S::count>(c, start(g) + 1),
                 coefficient<S::count>(c, start(g) + 2), coefficient<S::count>(c, start(g) + 3));
  }
}

// --- P2G --------------------------------------------------------------------------------------------------------------

template <class S, int l>
HWY_INLINE void scatter_lattice(const Batch<S>& batch, std::size_t cell_place, float* HWY_RESTRICT lanes) {
  constexpr int wx = S::width(l, 0), wy = S::width(l, 1), wz = S::width(l, 2);
  Rows<S::modes, wx> x;
  Rows<S::modes, wy> y;
  Rows<S::modes, wz> z;
  axis_rows<S::n, S::kind(l, 0), S::modes, false>(batch.t[0], x);
  axis_rows<S::n, S::kind(l, 1), S::modes, false>(batch.t[1], y);
  axis_rows<S::n, S::kind(l, 2), S::modes, false>(batch.t[2], z);
  if (batch.size < kLanes) {
    const auto counts = hn::FirstN(kTag, std::size_t(batch.size));
    for (int m = 0; m < S::modes; ++m)
      for (int i = 0; i < wx; ++i) x.at[m][i] = hn::IfThenElseZero(counts, x.at[m][i]);
  }
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
      hn::Store(hn::Add(hn::LowerHalf(half, sum), hn::UpperHalf(half, sum)), half, sums);
      const int last = place + 4 <= S::places ? 4 : S::places - place;
      std::memcpy(tile + f * S::places + place, sums, sizeof(float) * std::size_t(last));
    }
}

/// Calls body(first particle, lanes, place in the tile) for the batches of a block, cell by cell.
template <class S, class Body>
HWY_INLINE void for_batches(const Block& block, Body& body) {
  constexpr int edge = Lattice<3>::kBlock;
  for (int local = 0; local < Lattice<3>::kCellsPerBlock; ++local) {
    const std::uint32_t end = block.begin[local + 1];
    std::uint32_t p = block.begin[local];
    if (p == end) continue;
    const int i = local / (edge * edge) + 1, j = local / edge % edge + 1, k = local % edge + 1;
    const std::size_t place = std::size_t((i * S::tile + j) * S::tile + k);
    for (; p < end; p += kLanes) body(p, int(end - p < kLanes ? end - p : kLanes), place);
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

// --- G2P --------------------------------------------------------------------------------------------------------------

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

template <class S, bool gradient>
struct GatherBatch {
  const Block& block;
  const Gathering& g;
  HWY_INLINE void operator()(std::uint32_t p, int size, std::size_t place) const {
    float spare[3 * S::count + 4];
    HWY_ALIGN float scratch[gradient ? 9 * kLanes : kLanes];
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

template <int n, bool faces>
Kernels find(int modes) {
  switch (modes) {
    case 1: return {scatter_block<Shape<n, 1, faces>>, gather_block<Shape<n, 1, faces>>};
    case 4: return {scatter_block<Shape<n, 4, faces>>, gather_block<Shape<n, 4, faces>>};
    case 8: return {scatter_block<Shape<n, 8, faces>>, gather_block<Shape<n, 8, faces>>};
    case 27:
      if constexpr (n == 3) return {scatter_block<Shape<n, 27, faces>>, gather_block<Shape<n, 27, faces>>};
      break;
  }
  return {};
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
