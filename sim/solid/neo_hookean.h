#pragma once
// Stable neo-Hookean elasticity [Smith18]: Psi = mu/2 (I_C - 3) + lambda/2 (J - a)^2 - mu/2 log(I_C + 1), a = 1 + 3/4 mu/lambda, with
// the constants that make it Hooke's law at small strain: mu = 4/3 mu_Lame, lambda = lambda_Lame + 5/6 mu_Lame. Smooth through
// inversion, no decomposition of F; and what is pressed to less than a third resists as Squeeze has it. In two dimensions I_C = |F|^2 + 1 (plane
// strain).
#include <string_view>

#include "sim/solid/laws.h"

namespace sim {

struct NeoHookean {
  static constexpr std::string_view kName = "neo_hookean";
  static constexpr bool kPrincipal = false;
  Lame lame;
  double mu() const { return 4.0 / 3 * lame.mu; }
  double lambda() const { return lame.lambda + 5.0 / 6 * lame.mu; }

  /// With i = I_C - 3 and j = J - 1, the value at rest taken off: mu/2 i + lambda/2 j^2 - 3/4 mu j - mu/2 log(1 + i/4).
  template <class T, int D>
  T energy(const Matrix<T, D>& g) const {
    const T i = stretch_excess(g), j = volume_change(g);
    return constant<T>(mu() / 2) * (i - log_of_one_plus(i * T(0.25))) + j * (constant<T>(lambda() / 2) * j - constant<T>(0.75 * mu())) +
           Squeeze<T>(lame, j).energy();
  }
  /// tau = mu (1 - 1/(I_C + 1)) F F^T + (lambda (J - 1) - 3/4 mu) J I, with what cancels at rest taken out by hand.
  template <class T, int D>
  Matrix<T, D> kirchhoff(const Matrix<T, D>& g) const {
    const T i = stretch_excess(g), j = volume_change(g), bend = i / (T(16) + T(4) * i);   // 1 - 1/(4 + i) = 3/4 + bend
    Matrix<T, D> tau = left_strain(g);
    const T share = constant<T>(mu()) * (T(0.75) + bend);
    for (auto& row : tau.m)
      for (T& x : row) x *= share;
    const T diagonal = constant<T>(mu()) * bend + (constant<T>(lambda()) * j * (j + T(1)) - constant<T>(0.75 * mu()) * j) + Squeeze<T>(lame, j).kirchhoff();
    for (int a = 0; a < D; ++a) tau(a, a) += diagonal;
    return tau;
  }
  /// Along H = m n^T F: mu (1 - 1/(I_C+1)) |H|^2 + 2 mu (F:H)^2 / (I_C+1)^2 + lambda J^2, (F:H)^2 <= I_C |H|^2 and |H| <= the largest stretch,
  /// whose square is at most 1 + |F F^T - I|.
  template <class T, int D>
  T stiffness(const Matrix<T, D>& g) const {
    const Matrix<T, D> b = left_strain(g);
    T rows = T(0);
    for (int i = 0; i < D; ++i) {
      T row = T(0);
      for (int k = 0; k < D; ++k) row += magnitude(b(i, k));
      rows = larger(rows, row);
    }
    const T ic = stretch_excess(g) + T(3), one_more = ic + T(1), j = volume_change(g), volume = j + T(1);
    const T factor = (ic + T(2) * ic / one_more) / one_more;
    return constant<T>(mu()) * (factor * (T(1) + rows)) + constant<T>(lambda()) * (volume * volume) + Squeeze<T>(lame, j).stiffness();
  }
};

}  // namespace sim
