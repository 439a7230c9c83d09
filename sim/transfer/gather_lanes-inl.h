// G2P of eight particles of a cell at a time, one axis after the other.
//
// Along an axis the values v at a stencil's nodes give, with the particle at x from its middle (basis.h):
//   quadratic: the weighted mean m + x d + (1/4 + x^2) b, the modes d + (3 x - 4 x^3) b and b, the slope d + 2 x b,
//              of m = v1, d = (v2 - v0) / 2, b = (v0 - 2 v1 + v2) / 2
//   linear:    m + x d and d, of m = v0, d = v1 - v0
// None of m, d and b depends on the particle: the terms are made once for all cells, and a particle takes 3 multiply-adds of three in place of 9.
#if defined(SIM_TRANSFER_GATHER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_GATHER_LANES_INL_H
#undef SIM_TRANSFER_GATHER_LANES_INL_H
#else
#define SIM_TRANSFER_GATHER_LANES_INL_H
#endif

#include <algorithm>
#include <array>
#include <type_traits>

#include "base/past_caches.h"
#include "base/prefetch.h"
#include "sim/transfer/lanes-inl.h"
#include "sim/transfer/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

// --- what does not depend on particles ----------------------------------------------------------------------------------

/// The terms of a stencil's values v0, v1 (, v2) along an axis.
template <int n, class T>
HWY_INLINE void terms_of(T v0, T v1, T v2, T half, T (&term)[n]) {
  if constexpr (n == 2) {
    term[0] = v0, term[1] = v1 - v0;
  } else {
    term[0] = v1, term[1] = half * (v2 - v0), term[2] = half * ((v0 - v1) + (v2 - v1));
  }
}

/// Terms of one component, for the cells of a block: of the axes z and y for all of them, of x for a slab of 4 x 4 cells at a time.
template <class S, int l>
class Terms {
 public:
  static constexpr int kLattice = l, kEdge = Lattice<3>::kBlock, kCells = kEdge * kEdge;
  /// Of an axis: where lanes of a cell use two stencils, those of the lower one and then of the upper one.
  static constexpr int kX = S::n * (S::width(l, 0) - S::n + 1), kY = S::n * (S::width(l, 1) - S::n + 1), kZ = S::n * (S::width(l, 2) - S::n + 1);
  static constexpr int kTerms[3] = {kX, kY, kZ};

  HWY_INLINE explicit Terms(const float* HWY_RESTRICT tile) {
    alignas(64) float of_z[kZ][S::tile][S::tile][kEdge];
    for (int i = 0; i < S::tile; ++i)
      for (int j = 0; j < S::tile; ++j) {
        const float* const row = tile + (i * S::tile + j) * S::tile + S::first(l, 2) + 1;
        make<2, NodeLine>([&](int node) { return NodeLine{hn::LoadU(kLine, row + node)}; },
                        [&](int t, NodeLine term) { hn::Store(term.v, kLine, of_z[t][i][j]); });
      }
    for (int c = 0; c < kZ; ++c)
      for (int i = 0; i < S::tile; ++i)
        make<1, Slab>([&](int node) { return Slab::load(of_z[c][i][node + S::first(l, 1) + 1]); },
                      [&](int t, Slab term) { term.store(of_yz_[t][c][i]); });
  }
  /// Those of the cells [16 slab, 16 slab + 16).
  HWY_INLINE void make_slab(int slab) {
    for (int b = 0; b < kY; ++b)
      for (int c = 0; c < kZ; ++c)
        make<0, Slab>([&](int node) { return Slab::load(of_yz_[b][c][slab + node + S::first(l, 0) + 1]); },
                      [&](int t, Slab term) { term.store(of_xyz_[t][b][c]); });
  }
  /// Of the slab's cell number `cell`; the number of the term along each axis.
  HWY_INLINE float at(const std::array<int, 3>& term, int cell) const { return of_xyz_[term[0]][term[1]][term[2]][cell]; }

 private:
  using Slab = Plane<4>;
  /// One line of nodes.
  struct NodeLine {
    hn::Vec<Line> v;
    HWY_INLINE static NodeLine all(float x) { return {hn::Set(kLine, x)}; }
    HWY_INLINE friend NodeLine operator+(NodeLine a, NodeLine b) { return {hn::Add(a.v, b.v)}; }
    HWY_INLINE friend NodeLine operator-(NodeLine a, NodeLine b) { return {hn::Sub(a.v, b.v)}; }
    HWY_INLINE friend NodeLine operator*(NodeLine a, NodeLine b) { return {hn::Mul(a.v, b.v)}; }
  };
  /// Calls keep(number, term) for the terms of an axis whose nodes' values node(k) gives.
  template <int axis, class T, class Node, class Keep>
  HWY_INLINE static void make(const Node& node, const Keep& keep) {
    const T half = T::all(0.5f);
    constexpr int stencils = S::width(l, axis) - S::n + 1;
#pragma GCC unroll 2
    for (int upper = 0; upper < stencils; ++upper) {
      T term[S::n];
      terms_of<S::n, T>(node(upper), node(upper + 1), S::n == 3 ? node(upper + 2) : half, half, term);
#pragma GCC unroll 3
      for (int t = 0; t < S::n; ++t) keep(S::n * upper + t, term[t]);
    }
  }

  alignas(64) float of_yz_[kY][kZ][S::tile][kCells];
  alignas(64) float of_xyz_[kX][kY][kZ][kCells];
};

// --- particles ----------------------------------------------------------------------------------------------------------

constexpr int kBend = 2, kDifference = 3, kResults = 4;   // of an axis: the mean, two modes of which the second is b, and d

/// Lanes along an axis: the factors of the terms.
template <int n, Axis axis>
struct Factors {
  V x, mean_of_b, mode_of_b;
  hn::Mask<Lanes> upper;

  HWY_INLINE explicit Factors(V t) {
    constexpr FromMiddle kShift = kFromMiddle<axis>;
    upper = hn::Ge(t, hn::Set(kTag, 0.5f));
    x = hn::Add(t, hn::IfThenElse(upper, hn::Set(kTag, kShift.upper), hn::Set(kTag, kShift.lower)));
    if constexpr (n == 3) {
      const V squared = hn::Mul(x, x);
      mean_of_b = hn::Add(squared, hn::Set(kTag, 0.25f));
      mode_of_b = hn::Mul(x, hn::NegMulAdd(hn::Set(kTag, 4.0f), squared, hn::Set(kTag, 3.0f)));
    }
  }
  /// A result from the terms; term(k) gives those of the lower stencil and then, on a wide axis, of the upper one.
  template <class Term>
  HWY_INLINE V result(int which, const Term& term) const {
    const auto own = [&](int k) {
      if constexpr (kIsWide<axis>) return hn::IfThenElse(upper, term(n + k), term(k));
      else return term(k);
    };
    if constexpr (n == 2) return which == 0 ? hn::MulAdd(x, own(1), own(0)) : own(1);
    else if (which == 0) return hn::MulAdd(mean_of_b, own(2), hn::MulAdd(x, own(1), own(0)));
    else if (which == 1) return hn::MulAdd(mode_of_b, own(2), own(1));
    else return own(which == kBend ? 2 : 1);
  }
  /// The derivative of the mean [1/cell], from d or from the first mode.
  HWY_INLINE V slope_from_difference(V d, V b) const { return hn::MulAdd(hn::Add(x, x), b, d); }
  HWY_INLINE V slope_from_mode(V mode, V b) const { return hn::MulAdd(hn::Sub(hn::Add(x, x), mode_of_b), b, mode); }
};

/// Whether the first mode along each axis is made of d and b contracted along the others, and with it the slope: in the set of 4 modes, where both
/// are far fewer than all three.
template <int n, int count>
constexpr bool kByDifference = n == 3 && count <= 4;

/// Whether a set of `count` modes wants a product of results; the gradient takes b, and d where that is kept, along one axis each.
template <int n, int count, bool gradient>
constexpr bool wants(const std::array<int, 3>& result) {
  const auto [a, b, c] = result;
  const int sum = a + b + c, most = std::max({a, b, c});
  const bool along_one = sum == most && sum > 0;
  if (along_one && kByDifference<n, count>) return most >= kBend && (gradient || count == 4);
  if (along_one && most == kBend) return kBends<count> || gradient;
  return most < kDifference && keeps<count>(a, b, c);
}

/// One axis after the other, and which results of the first, of the first two and of all three are wanted on the way.
struct Course {
  std::array<int, 3> axis;
  bool first[kResults]{}, two[kResults][kResults]{}, all[kResults][kResults][kResults]{};

  /// By axis what is given by its turn.
  constexpr std::array<int, 3> by_axis(int first_one, int second, int third) const {
    std::array<int, 3> of{};
    of[std::size_t(axis[0])] = first_one, of[std::size_t(axis[1])] = second, of[std::size_t(axis[2])] = third;
    return of;
  }
};
/// The wide axis of quadratic faces comes first: its terms are chosen lane by lane, once for every pair of terms of the others.
template <class S, int l, int count, bool gradient>
constexpr Course kCourse = [] {
  Course c{.axis = {2, 1, 0}};
  if (S::faces && S::n == 3 && l == 0) c.axis = {0, 2, 1};
  if (S::faces && S::n == 3 && l == 1) c.axis = {1, 2, 0};
  for (int i = 0; i < kResults; ++i)
    for (int j = 0; j < kResults; ++j)
      for (int k = 0; k < kResults; ++k)
        if (wants<S::n, count, gradient>(c.by_axis(i, j, k))) c.first[i] = c.two[i][j] = c.all[i][j][k] = true;
  return c;
}();

/// What eight particles of a cell want of a component, by results along x, y and z.
struct Results {
  V at[kResults][kResults][kResults];
  V slope[3];
};

/// What is made of results along an axis: the mode, the slope.
template <class S, int count, bool gradient, int axis, class F>
HWY_INLINE void finish_axis(const F& factors, Results& r) {
  const auto along = [&](int which) -> V& { return r.at[axis == 0 ? which : 0][axis == 1 ? which : 0][axis == 2 ? which : 0]; };
  if constexpr (kByDifference<S::n, count>) {
    if constexpr (count == 4) along(1) = hn::MulAdd(factors.mode_of_b, along(kBend), along(kDifference));
    if constexpr (gradient) r.slope[axis] = factors.slope_from_difference(along(kDifference), along(kBend));
  } else if constexpr (gradient) {
    r.slope[axis] = factors.slope_from_mode(along(1), along(kBend));
  }
}

template <class S, int l, int count, bool gradient>
HWY_INLINE void analyse(const Terms<S, l>& terms, int cell, const V (&t)[3], Results& r) {
  constexpr const Course& course = kCourse<S, l, count, gradient>;
  constexpr int P = course.axis[0], Q = course.axis[1], R = course.axis[2], kQ = Terms<S, l>::kTerms[Q], kR = Terms<S, l>::kTerms[R];
  const Factors<S::n, S::kind(l, P)> first(t[P]);
  const Factors<S::n, S::kind(l, Q)> second(t[Q]);
  const Factors<S::n, S::kind(l, R)> third(t[R]);
  V of_first[kResults][kQ][kR], of_two[kResults][kResults][kR];
#pragma GCC unroll 4
  for (int v = 0; v < kQ; ++v)
#pragma GCC unroll 4
    for (int w = 0; w < kR; ++w)
#pragma GCC unroll 4
      for (int i = 0; i < kResults; ++i)
        if (course.first[i]) of_first[i][v][w] = first.result(i, [&](int u) { return hn::Set(kTag, terms.at(course.by_axis(u, v, w), cell)); });
#pragma GCC unroll 4
  for (int w = 0; w < kR; ++w)
#pragma GCC unroll 4
    for (int i = 0; i < kResults; ++i)
#pragma GCC unroll 4
      for (int j = 0; j < kResults; ++j)
        if (course.two[i][j]) of_two[i][j][w] = second.result(j, [&](int v) { return of_first[i][v][w]; });
#pragma GCC unroll 4
  for (int i = 0; i < kResults; ++i)
#pragma GCC unroll 4
    for (int j = 0; j < kResults; ++j)
#pragma GCC unroll 4
      for (int k = 0; k < kResults; ++k)
        if (course.all[i][j][k]) {
          const auto [a, b, c] = course.by_axis(i, j, k);
          r.at[a][b][c] = third.result(k, [&](int w) { return of_two[i][j][w]; });
        }
  finish_axis<S, count, gradient, P>(first, r), finish_axis<S, count, gradient, Q>(second, r), finish_axis<S, count, gradient, R>(third, r);
}

/// Rows from their numbers: long ones eight at a time, what is left and short ones by fours, of which the last may overlap.
template <class S>
HWY_INLINE void store_rows(const Batch<S>& batch, const V (&number)[S::kRow]) {
  constexpr int kEights = S::kRow < kLongRow ? 0 : S::kRow / 8 * 8;
#pragma GCC unroll 10
  for (int from = 0; from < kEights; from += 8) batch.store8(from, number + from);
#pragma GCC unroll 8
  for (int from = kEights; from < S::kRow; from += 4) {
    const int first = from + 4 <= S::kRow ? from : S::kRow - 4;
    batch.store4(first, number + first);
  }
}

/// The terms of all components of a block.
template <class S>
struct BlockTerms {
  static constexpr int l1 = S::faces ? 1 : 0, l2 = S::faces ? 2 : 0;
  Terms<S, 0> x;
  Terms<S, l1> y;
  Terms<S, l2> z;

  HWY_INLINE explicit BlockTerms(const float* tile) : x(tile), y(tile + S::places), z(tile + 2 * S::places) {}
  HWY_INLINE void make_slab(int slab) { x.make_slab(slab), y.make_slab(slab), z.make_slab(slab); }
  /// Calls body(component, its terms).
  template <class Body>
  HWY_INLINE void for_components(const Body& body) const {
    body(0, x), body(1, y), body(2, z);
  }
};

/// Coefficients of a batch, and what `keep_more(component, results)` takes of them.
template <class S, bool gradient, class Keep>
HWY_INLINE void gather_batch(const Batch<S>& batch, int cell, const BlockTerms<S>& terms, const BlockTerms<S>* before, float keep,
                             const Keep& keep_more) {
  V row[S::kRow];
  terms.for_components([&](int component, const auto& own) SIM_LANES_INLINED {
    Results r;
    analyse<S, std::remove_cvref_t<decltype(own)>::kLattice, S::count, gradient>(own, cell, batch.t, r);
    if constexpr (S::count == 1) {
      HWY_ALIGN float one[kLanes];
      hn::Store(r.at[0][0][0], kTag, one);
      if (before) {
        Results old;
        old.at[0][0][0] = hn::Zero(kTag);
        before->for_components([&](int c, const auto& its) {
          if (c == component) analyse<S, std::remove_cvref_t<decltype(its)>::kLattice, 1, false>(its, cell, batch.t, old);
        });
        HWY_ALIGN float then[kLanes];
        hn::Store(old.at[0][0][0], kTag, then);
        for (int lane = 0; lane < batch.size; ++lane) one[lane] += keep * (batch.at[lane][component] - then[lane]);
      }
      for (int lane = 0; lane < batch.size; ++lane) batch.at[lane][component] = one[lane];
    } else {
#pragma GCC unroll 27
      for (int number = 0; number < S::count; ++number) {
        const auto [a, b, c] = kModes<S::count>[std::size_t(number)];
        row[3 * number + component] = r.at[a][b][c];
      }
    }
    keep_more(component, r);
  });
  if constexpr (S::count > 1) store_rows<S>(batch, row);
}

/// Calls for the rows that are written a few batches later: a batch writes a piece of each of eight rows, which hardware does not take for a stream,
/// and stores to lines that are far fill the store queue.
template <class S>
HWY_INLINE void prefetch_written(const Block& block, std::uint32_t p) {
  constexpr std::uint32_t kBatchesAhead = 4 * kLanes;
  if constexpr (S::count < 8) return;   // short rows fill their lines at once
  const char* const row = reinterpret_cast<const char*>(block.coefficients + std::size_t(p + kBatchesAhead) * Batch<S>::kRow);
#pragma GCC unroll 8
  for (std::size_t byte = 0; byte < kLanes * sizeof(float) * Batch<S>::kRow; byte += 64) base::prefetch(row + byte);
}

/// Rows of a block as they are written: where they belong, or past the caches.
template <class S>
class RowsInPlace {
 public:
  HWY_INLINE explicit RowsInPlace(const Block& block) : block_(block) {}
  /// Where those from particle p on are written; then how many were.
  HWY_INLINE float* begin(std::uint32_t p) {
    prefetch_written<S>(block_, p);
    return block_.coefficients + std::size_t(p) * S::kRow;
  }
  HWY_INLINE void end(int) {}
  HWY_INLINE void finish() {}

 private:
  const Block& block_;
};
template <class S>
class RowsPastCaches {
 public:
  HWY_INLINE explicit RowsPastCaches(const Block& block) : rows_(block.coefficients + std::size_t(block.begin[0]) * S::kRow) {}
  HWY_INLINE float* begin(std::uint32_t) { return rows_.next(); }
  HWY_INLINE void end(int count) { rows_.put(count * S::kRow); }
  HWY_INLINE void finish() { rows_.finish(); }

 private:
  base::PastCaches<kLanes * S::kRow> rows_;
};

template <class S, class Rows>
HWY_INLINE void gather_particles(const Block& block, const Gathering& g, BlockTerms<S>& terms, BlockTerms<S>* before, Rows& rows) {
  constexpr int slab_cells = Lattice<3>::kBlock * Lattice<3>::kBlock;
  for (int slab = 0; slab < Lattice<3>::kBlock; ++slab) {
    terms.make_slab(slab);
    if (before) before->make_slab(slab);
    for_batches(block, slab * slab_cells, (slab + 1) * slab_cells, [&](std::uint32_t p, int size, int cell) {
      float spare[3 * S::count + 4];
      prefetch_offsets(block, p + 64, kLanes);
      const Batch<S> batch(block, p, size, rows.begin(p), spare);
      gather_batch<S, false>(batch, cell % slab_cells, terms, before, g.keep, [](int, const Results&) SIM_LANES_INLINED {});
      rows.end(size);
    });
  }
  rows.finish();
}

template <class S>
void gather_block(const Block& block, const Gathering& g) {
  BlockTerms<S> terms(g.tile);
  if constexpr (S::count >= 4) {
    if (block.streams) {
      RowsPastCaches<S> rows(block);
      return gather_particles<S>(block, g, terms, nullptr, rows);
    }
  }
  RowsInPlace<S> rows(block);
  if constexpr (S::count == 1) {
    if (g.before) {
      BlockTerms<S> before(g.before);
      return gather_particles<S>(block, g, terms, &before, rows);
    }
  }
  gather_particles<S>(block, g, terms, nullptr, rows);
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
