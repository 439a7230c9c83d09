// P2G: what particles have at the nodes along each axis, made for some of them ahead, whatever cells these are in; and what the modes of an axis
// bring to its nodes.
//
// Along an axis, with the particle at x from the middle of its stencil (basis.h) and coefficients c of the modes 1, w and g:
//   node i gets  w_i (c0 + (i - x) c1) + e_i s c2,   e = (1, -2, 1),   s = (1 - 4 x^2)^2 (3/4 - x^2) / 8,
// because g, times the weights, is orthogonal to 1 and to i: of three nodes that leaves one direction, e. With c0 - x c1 made once it is five
// multiply-adds where a row for each mode takes nine. No node's sum is a difference of others': a light node keeps its digits.
#if defined(SIM_TRANSFER_SCATTER_ROWS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_SCATTER_ROWS_INL_H
#undef SIM_TRANSFER_SCATTER_ROWS_INL_H
#else
#define SIM_TRANSFER_SCATTER_ROWS_INL_H
#endif

#include <utility>

#include "sim/transfer/lanes-inl.h"
#include "sim/transfer/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

/// Whose a vector's four lines of four numbers are: an axis' each, with a number a node; or a node's each, with a number an axis.
enum class LinesOf { axes, nodes };

/// A number for each node of a stencil: of the lower one, or of the upper one of a wide axis, a node further.
struct OfNodes {
  alignas(64) float lower[16], upper[16];
};
template <int n, LinesOf lines>
constexpr OfNodes of_nodes(float first, float middle, float last) {
  OfNodes r{};
  for (int axis = 0; axis < 4; ++axis)
    for (int k = 0; k < n; ++k) {
      constexpr bool nodes = lines == LinesOf::nodes;
      r.lower[nodes ? 4 * k + axis : 4 * axis + k] = k == 0 ? first : k == n - 1 ? last : middle;
      r.upper[nodes ? 4 * (k + 1) + axis : 4 * axis + k + 1] = k == 0 ? first : k == n - 1 ? last : middle;
    }
  return r;
}

/// Of a particle at x from the middle of its stencil: the weights are c (a + b x)^2 + d, of the linear kernel a + b x, their slope e x + f, the
/// mode w is node - x, and e as above.
template <int n, LinesOf lines>
struct NodeNumbers;
template <LinesOf lines>
struct NodeNumbers<2, lines> {
  static constexpr OfNodes node = of_nodes<2, lines>(0, 0, 1), a = of_nodes<2, lines>(1, 0, 0), b = of_nodes<2, lines>(-1, 0, 1);
};
template <LinesOf lines>
struct NodeNumbers<3, lines> {
  static constexpr OfNodes node = of_nodes<3, lines>(-1, 0, 1), a = of_nodes<3, lines>(0.5f, 0, 0.5f), b = of_nodes<3, lines>(-1, 1, 1),
                           c = of_nodes<3, lines>(0.5f, -1, 0.5f), d = of_nodes<3, lines>(0, 0.75f, 0), e = of_nodes<3, lines>(1, -2, 1),
                           f = of_nodes<3, lines>(-0.5f, 0, 0.5f);
};

/// What a particle has along axes of one kind.
template <int n, Axis axis, LinesOf lines>
struct AlongAxes {
  using P = Plane<4>;
  P t, x;

  /// From its offsets along the axes, each at all nodes.
  HWY_INLINE explicit AlongAxes(P offset) : t(offset) {
    constexpr FromMiddle kShift = kFromMiddle<axis>;
    if constexpr (kShift.upper == kShift.lower) x = t + P::all(kShift.lower);
    else x = t + P::chosen(t, P::all(kShift.upper), P::all(kShift.lower));
  }
  HWY_INLINE P of(const OfNodes& number) const {
    if constexpr (kIsWide<axis>) return P::chosen(t, P::load(number.upper), P::load(number.lower));
    else return P::load(number.lower);
  }
  HWY_INLINE P weights() const {
    const P root = fused(of(Number::b), x, of(Number::a));
    if constexpr (n == 2) return root;
    else return fused(of(Number::c) * root, root, of(Number::d));
  }
  /// The mode w times the weights.
  HWY_INLINE P weighted_offsets(P weights) const { return weights * (of(Number::node) - x); }
  HWY_INLINE P slopes() const { return fused(of(Number::e), x, of(Number::f)); }
  /// s, and s e.
  HWY_INLINE P s() const {
    const P one = P::all(1.0f), two_x = x + x, product = (one - two_x) * (one + two_x);
    return product * product * fused(P::all(-0.125f) * x, x, P::all(0.09375f));
  }
  HWY_INLINE P s_e() const { return of(Number::e) * s(); }

 private:
  using Number = NodeNumbers<n, lines>;
};

/// Rows of the next particles of a block, of 16 numbers each: `rows` for each particle, of kMost_ particles.
template <int rows, int kMost_ = 64>
class StagedRows {
 public:
  static constexpr int kMost = kMost_;

  HWY_INLINE StagedRows() {}   // not cleared

  /// Calls make_one(particle, offset, row 0) for particles [first, end) of all; of an offset four numbers can be read.
  template <class Make>
  HWY_INLINE void make(const Block& block, std::uint32_t first, std::uint32_t end, const Make& make_one) {
    const std::uint32_t last = block.begin[Lattice<3>::kCellsPerBlock] - 1;
    for (std::uint32_t p = first; p < end; ++p) {
      const float* offset = block.offset + 3 * std::size_t(p);
      float alone[4] = {};
      if (p == last) offset = static_cast<const float*>(std::memcpy(alone, offset, 3 * sizeof(float)));
      make_one(p, offset, rows_[p - first][0]);
    }
  }
  /// Of particle `at` of those.
  HWY_INLINE const float* row(int number, std::uint32_t at) const { return rows_[at][number]; }

 private:
  alignas(64) float rows_[kMost][rows][16];
};

/// What particles of a block bring to nodes or faces, as Scatter has it.
template <class S>
struct PlainTile {
  float* numbers;

  HWY_INLINE explicit PlainTile(float* tile) : numbers(tile) { std::memset(tile, 0, sizeof(float) * std::size_t(S::fields * S::places + kTileSlack)); }
  /// Of a cell, by its coordinates in the block.
  HWY_INLINE static std::ptrdiff_t place(const int (&cell)[3]) { return ((cell[0] + 1) * S::tile + cell[1] + 1) * S::tile + cell[2] + 1; }
  HWY_INLINE void finish() {}
};

/// The numbers of products among a particle's coefficients.
template <int count>
constexpr auto kNumber = [] {
  struct {
    int of[3][3][3];
  } number{};
  for (int r = 0; r < count; ++r) number.of[kModes<count>[r][0]][kModes<count>[r][1]][kModes<count>[r][2]] = r;
  return number;
}();

/// How many modes of an axis a set keeps beside mode `other` of another axis.
template <int count>
constexpr int modes_beside(int other) {
  int modes = 0;
  while (modes < 3 && keeps<count>(modes, other, 0)) ++modes;
  return modes;
}

/// Calls body(std::integral_constant) for 0 .. n - 1.
template <int n, class Body>
HWY_INLINE void for_each_number(const Body& body) {
  [&]<int... i>(std::integer_sequence<int, i...>) SIM_LANES_INLINED { (body(std::integral_constant<int, i>{}), ...); }(std::make_integer_sequence<int, n>{});
}

/// A particle's numbers along an axis: weights of its n nodes, x, and s of the sets that have the mode g.
template <int n, class P>
struct AtNodes {
  P weight[n], x, s;

  /// What coefficients of an axis' modes bring to its nodes i: at[i][where].
  template <int modes, int where>
  HWY_INLINE void spread(const P (&c)[3], P (&at)[n][3]) const {
    P u[n];
    unweighted<modes>(c, u);
    if constexpr (modes == 3) {
      const P d = s * c[2];
      at[0][where] = fused(weight[0], u[0], d), at[1][where] = fused_less(weight[1], u[1], d + d), at[2][where] = fused(weight[2], u[2], d);
    } else {
#pragma GCC unroll 3
      for (int i = 0; i < n; ++i) at[i][where] = weight[i] * u[i];
    }
  }
  /// The same, added; what is e's is added to a sum of its own.
  template <int modes>
  HWY_INLINE void add(const P (&c)[3], P (&to)[n], P& of_e) const {
    P u[n];
    unweighted<modes>(c, u);
#pragma GCC unroll 3
    for (int i = 0; i < n; ++i) to[i] = fused(weight[i], u[i], to[i]);
    if constexpr (modes == 3) of_e = fused(s, c[2], of_e);
  }

 private:
  template <int modes>
  HWY_INLINE void unweighted(const P (&c)[3], P (&u)[n]) const {
    constexpr int middle = n == 3;   // the node x is counted from
    if constexpr (modes == 1) {
#pragma GCC unroll 3
      for (int i = 0; i < n; ++i) u[i] = c[0];
    } else {
      u[middle] = less_product(c[0], x, c[1]);
      if constexpr (n == 3) u[0] = u[1] - c[1];
      u[middle + 1] = u[middle] + c[1];
    }
  }
};

/// What particles bring to the nodes (i, j) across a vector's own axis, of modes kept in a set.
template <int n, int count, class P>
class Sums {
 public:
  static constexpr int kModesOfAxis = modes_beside<count>(0);

  HWY_INLINE Sums() {
#pragma GCC unroll 3
    for (int i = 0; i < n; ++i) {
      of_e_[i] = P::zero();
#pragma GCC unroll 3
      for (int j = 0; j < n; ++j) sum_[i][j] = P::zero();
    }
  }
  /// What is at the nodes i along the first axis, by the other one's modes.
  HWY_INLINE void add(const P (&c)[n][3], const AtNodes<n, P>& along_second) {
#pragma GCC unroll 3
    for (int i = 0; i < n; ++i) along_second.template add<kModesOfAxis>(c[i], sum_[i], of_e_[i]);
  }
  HWY_INLINE void add(int i, int j, P a, P b) { sum_[i][j] = fused(a, b, sum_[i][j]); }
  HWY_INLINE P at(int i, int j) const {
    if constexpr (kModesOfAxis < 3) return sum_[i][j];
    else return j == 1 ? sum_[i][j] - (of_e_[i] + of_e_[i]) : sum_[i][j] + of_e_[i];
  }

 private:
  P sum_[n][n], of_e_[n];
};

/// Coefficients of all modes, coefficient(m, a, b), to the places of a vector along its own axis, where modes m are own[m], and to the nodes i of the
/// first axis, its modes being a: at[i][b]. more(b, of[a]) may add to what is along the own axis.
template <int n, int count, class P, int modes, class Coefficient, class More>
HWY_INLINE void spread(const P (&own)[modes], const AtNodes<n, P>& along_first, P (&at)[n][3], const Coefficient& coefficient, const More& more) {
  for_each_number<modes>([&](auto b) SIM_LANES_INLINED {
    P along_own[3];
    for_each_number<modes_beside<count>(b)>([&](auto a) SIM_LANES_INLINED {
      for_each_number<modes>([&](auto m) SIM_LANES_INLINED {
        if constexpr (!keeps<count>(m, a, b)) return;
        else if constexpr (m == 0) along_own[a] = coefficient(m, a, b) * own[m];
        else along_own[a] = fused(coefficient(m, a, b), own[m], along_own[a]);
      });
    });
    more(b, along_own);
    along_first.template spread<modes_beside<count>(b), b>(along_own, at);
  });
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
