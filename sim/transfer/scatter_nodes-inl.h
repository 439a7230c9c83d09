// P2G on nodes: the lanes of a vector are the nodes of a row along z, of each its mass and momenta.
#if defined(SIM_TRANSFER_SCATTER_NODES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_SCATTER_NODES_INL_H
#undef SIM_TRANSFER_SCATTER_NODES_INL_H
#else
#define SIM_TRANSFER_SCATTER_NODES_INL_H
#endif

#include "sim/transfer/scatter_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

/// What particles of one cell bring to nodes: vectors are nodes (i, j) of all k. A particle's coefficients C are a mode's three behind a mass, which is 1
/// for the constant mode and else 0; they go to the nodes along z, then along y, then along x. A stress adds its three columns, each with the slope of
/// the weights along its axis.
template <class S, bool stressed>
class SumsOnNodes {
  using P = Plane<S::n == 2 ? 2 : 4>;

 public:
  using Tile = PlainTile<S>;
  /// Of the three axes, in lines: weights, and behind three of them x; w times the weights; s; slopes times a factor [1/cell].
  static constexpr int kWeights = 0, kFirst = 1, kS = S::modes > 1 ? 2 : 1, kSlopes = S::modes > 2 ? 3 : kS, kRows = kSlopes + stressed;
  using Rows = StagedRows<kRows>;
  static constexpr std::uint32_t kReadAhead = 0;

  HWY_INLINE SumsOnNodes() : sums_() {}

  HWY_INLINE static void make_rows(const float* offset, const float*, float factor, float* HWY_RESTRICT to) {
    using Lines = Plane<4>;
    const AlongAxes<S::n, S::kind(0, 0), LinesOf::axes> along(Lines::whole_lines(offset));
    const Lines weights = along.weights();
    (S::n == 3 && S::modes > 1 ? weights.template with<0b1000>(along.x) : weights).store(to + 16 * kWeights);
    if constexpr (S::modes > 1) along.weighted_offsets(weights).store(to + 16 * kFirst);
    if constexpr (S::modes > 2) along.s().store(to + 16 * kS);
    if constexpr (stressed) (Lines::all(factor) * along.slopes()).store(to + 16 * kSlopes);
  }

  /// A particle by its number among the staged ones, its coefficients and its stress.
  HWY_INLINE void add(const Rows& rows, std::uint32_t at, const float* c, const float* stress) {
    P z[S::modes], along_y[S::n][3];
    z[0] = P::whole_lines(rows.row(kWeights, at) + 8);
    if constexpr (S::modes > 1) z[0] = z[0].without_fourth_line(), z[1] = P::whole_lines(rows.row(kFirst, at) + 8);
    if constexpr (S::modes > 2) z[2] = P::same_lines(rows.row(kS, at) + 8) * P::load(kOuterLess2Middle);
    const AtNodes<S::n, P> y = at_nodes(rows, at, 1), x = at_nodes(rows, at, 0);
    spread<S::n, S::count>(z, y, along_y, [&](int m, int a, int b) SIM_LANES_INLINED { return coefficients(c, kNumber<S::count>.of[b][a][m]); },
                           [&](auto b, P (&along_z)[3]) SIM_LANES_INLINED {
      if constexpr (stressed && b == 0) along_z[0] = fused(column<2>(stress), P::whole_lines(rows.row(kSlopes, at) + 8), along_z[0]);
    });
    if constexpr (stressed) {
      const P of_y = column<1>(stress) * z[0];
      const float* const slope_y = rows.row(kSlopes, at) + 4;
#pragma GCC unroll 3
      for (int j = 0; j < S::n; ++j) along_y[j][0] = fused(P::all(slope_y[j]), of_y, along_y[j][0]);
    }
    sums_.add(along_y, x);
    if constexpr (stressed) {
      const P of_x = column<0>(stress) * z[0];
      const float* const slope_x = rows.row(kSlopes, at);
#pragma GCC unroll 3
      for (int j = 0; j < S::n; ++j) {
        const P at_j = y.weight[j] * of_x;
#pragma GCC unroll 3
        for (int i = 0; i < S::n; ++i) sums_.add(j, i, P::all(slope_x[i]), at_j);
      }
    }
  }
  /// To the tile of a cell, by its coordinates in the block. A fourth node of a row gets zeros.
  HWY_INLINE void add_to(Tile& tile, const int (&cell)[3]) const {
    float* const first = tile.numbers + 4 * (Tile::place(cell) + S::first_place(0));
#pragma GCC unroll 3
    for (int i = 0; i < S::n; ++i)
#pragma GCC unroll 3
      for (int j = 0; j < S::n; ++j) sums_.at(j, i).add_to(first + 4 * (i * S::tile + j) * S::tile);
  }

 private:
  HWY_INLINE static AtNodes<S::n, P> at_nodes(const Rows& rows, std::uint32_t at, int axis) {
    AtNodes<S::n, P> r;
    const float* const weights = rows.row(kWeights, at) + 4 * axis;
#pragma GCC unroll 3
    for (int i = 0; i < S::n; ++i) r.weight[i] = P::all(weights[i]);
    if constexpr (S::modes > 1) r.x = S::n == 3 ? P::all(weights[3]) : r.weight[1];   // the linear kernel's x is a weight
    if constexpr (S::modes > 2) r.s = P::all(rows.row(kS, at)[4 * axis]);
    return r;
  }

  alignas(64) static constexpr float kOuterLess2Middle[16] = {1, 1, 1, 1, -2, -2, -2, -2, 1, 1, 1, 1};
  /// Of a mode, behind its mass. Four numbers are read, the first of them another mode's; before the constant mode there is none.
  HWY_INLINE static P coefficients(const float* c, int number) {
    if (number > 0) return P::same_lines(c + 3 * number - 1).without_first();
    const P one = P::all(1.0f);
    if constexpr (S::count > 1) return P::same_lines(c).moved_up().template with<0b0001>(one);
    else return one.template with<0b0010>(P::all(c[0])).template with<0b0100>(P::all(c[1])).template with<0b1000>(P::all(c[2]));
  }

  /// Of a stress, xx xy xz yy yz zz, behind a mass of 0.
  template <int axis>
  HWY_INLINE static P column(const float* stress) {
    const P first = P::same_lines(stress), last = P::same_lines(stress + 2);   // xx xy xz yy, xz yy yz zz
    if constexpr (axis == 0) return first.moved_up().without_first();
    else if constexpr (axis == 1) return last.moved_up().template with<0b0010>(first).without_first();
    else return last.template with<0b0010>(last.moved_up()).without_first();
  }

  Sums<S::n, S::count, P> sums_;
};

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
