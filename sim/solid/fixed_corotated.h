#pragma once
// Fixed corotated elasticity [Stomakhin12]: Psi = mu sum (s_i - 1)^2 + lambda/2 (J - 1)^2. Stiff, and comes back from inversion; what
// is pressed to less than a third resists as Squeeze has it.
#include <string_view>

#include "sim/solid/laws.h"

namespace sim {

struct FixedCorotated {
  static constexpr std::string_view kName = "fixed_corotated";
  static constexpr bool kPrincipal = true;
  Lame lame;

  template <class T, int D>
  T energy(const Principal<T, D>& s) const {
    T squares = T(0);
    for (const T x : s) squares += x * x;
    const T j = product_change<T, D>(s);
    return constant<T>(lame.mu) * squares + constant<T>(lame.lambda / 2) * (j * j) + Squeeze<T>(lame, j).energy();
  }
  /// tau_i = 2 mu (s_i - 1) s_i + lambda (J - 1) J
  template <class T, int D>
  Principal<T, D> kirchhoff(const Principal<T, D>& s) const {
    const T j = product_change<T, D>(s), pressure = constant<T>(lame.lambda) * (j * (j + T(1))) + Squeeze<T>(lame, j).kirchhoff();
    Principal<T, D> tau;
    for (int i = 0; i < D; ++i) {
      const T x = s[std::size_t(i)];
      tau[std::size_t(i)] = constant<T>(2 * lame.mu) * (x * (x + T(1))) + pressure;
    }
    return tau;
  }
  /// d2Psi of the first term is at most 2 mu in any direction, |F^T n| at most the largest stretch, and J is affine along m n^T. lambda is not below 0.
  template <class T, int D>
  T stiffness(const Principal<T, D>& s) const {
    const T largest = larger(s[0] + T(1), T(0)), j = product_change<T, D>(s), volume = j + T(1);   // the first is the largest
    return constant<T>(2 * lame.mu) * (largest * largest) + constant<T>(lame.lambda) * (volume * volume) + Squeeze<T>(lame, j).stiffness();
  }
};

}  // namespace sim
