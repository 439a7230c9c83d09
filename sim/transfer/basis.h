#pragma once
// The one-dimensional rows from which every transfer is built as a tensor product over the axes [PolyPIC S1, S2].
//
// Lengths in cells. A particle is an integer cell and an offset t in [0, 1) in it. A lattice is `centred` on an axis where its
// nodes lie at the middles of cells (pressure; the other two axes of a velocity face), else its nodes lie on cell corners.
// w_i = node_i - particle. For node values v, coefficient a is c_a = dual[a] . v; the polynomial's node values are
// sum_a c_a phi[a]; dual[a] . phi[b] = (a == b) at every offset, the degenerate ones included, because no row divides by a
// norm that can vanish. norm(a) = <phi_a, phi_a> under the weights: energy of mode a is 1/2 m c_a^2 norm(a).
#include <array>

namespace sim {

template <class Real, int n>
using Row = std::array<Real, n>;

/// The nodes that a linear hat reaches, and their weights. No branch depends on a particle's place: such branches go wrong half of the time.
template <class Number>
struct LinearWeights {
  using Real = Number;
  static constexpr int kNodes = 2;
  int base;                          // left node
  Real x;                            // in [0, 1] from it
  Row<Real, 2> weight;

  LinearWeights() = default;
  LinearWeights(int cell, Real t, bool centred) {
    const Real half = Real(1) / Real(2);
    const bool lower = t < half;
    base = cell - int(centred && lower);
    x = centred ? t + (lower ? half : -half) : t;
    weight = {1 - x, x};
  }
};

/// Linear hat: two nodes, modes 1 and w.
template <class Number>
struct LinearBasis : LinearWeights<Number> {
  using Real = Number;
  using Weights = LinearWeights<Number>;
  using Weights::weight, Weights::x;
  std::array<Row<Real, 2>, 2> phi, dual;

  LinearBasis() = default;
  LinearBasis(int cell, Real t, bool centred) : Weights(cell, t, centred) {
    phi = {Row<Real, 2>{1, 1}, Row<Real, 2>{-x, 1 - x}};
    dual = {weight, Row<Real, 2>{-1, 1}};
  }
  Real norm(int mode) const { return mode == 0 ? Real(1) : x * (1 - x); }
};

/// The same of a quadratic B-spline.
template <class Number>
struct QuadraticWeights {
  using Real = Number;
  static constexpr int kNodes = 3;
  int base;                          // leftmost of the three nodes
  Real x;                            // in [-1/2, 1/2] from the middle node
  Row<Real, 3> weight;

  QuadraticWeights() = default;
  QuadraticWeights(int cell, Real t, bool centred) {
    const Real half = Real(1) / Real(2);
    const bool upper = !centred && t >= half;
    base = cell - int(!upper);
    x = t - (centred ? half : Real(upper));
    const Real left = half - x, right = half + x;
    weight = {left * left * half, 3 * half * half - x * x, right * right * half};
  }
};

/// Quadratic B-spline: three nodes, modes 1, w and g = w^2 - x (1 - 4 x^2) w - 1/4.
template <class Number>
struct QuadraticBasis : QuadraticWeights<Number> {
  using Real = Number;
  using Weights = QuadraticWeights<Number>;
  using Weights::weight, Weights::x;
  std::array<Row<Real, 3>, 3> phi, dual;

  QuadraticBasis() = default;
  QuadraticBasis(int cell, Real t, bool centred) : Weights(cell, t, centred) {
    const Real half = Real(1) / Real(2), quarter = half * half;
    const Real two_x = 2 * x, four_x2 = two_x * two_x;
    // g at its nodes, factorised: the expanded polynomial cancels where a node is light.
    const Real lower = 1 - two_x, upper = 1 + two_x, bend = (3 - four_x2) * quarter, product = lower * upper;
    phi = {Row<Real, 3>{1, 1, 1}, Row<Real, 3>{-1 - x, -x, 1 - x},
           Row<Real, 3>{upper * upper * bend, -product * product * quarter, lower * lower * bend}};
    dual = {weight, Row<Real, 3>{4 * weight[0] * phi[1][0], 4 * weight[1] * phi[1][1], 4 * weight[2] * phi[1][2]},
            Row<Real, 3>{half, -1, half}};
  }
  Real norm(int mode) const {
    const Real quarter = Real(1) / Real(4);
    if (mode == 0) return Real(1);
    if (mode == 1) return quarter;
    const Real product = (1 - 2 * x) * (1 + 2 * x);
    return product * product * (3 - 4 * x * x) * quarter * quarter;
  }
};

}  // namespace sim
