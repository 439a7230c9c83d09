#pragma once
// St Venant-Kirchhoff elasticity with Hencky's logarithmic strain e_i = log s_i [Klar16]: Psi = mu sum e_i^2 + lambda/2 (sum e_i)^2.
// Plastic flow that keeps volume is a straight line in e. Below kLeastStretch the logarithm follows its tangent.
#include <string_view>

#include "sim/solid/laws.h"

namespace sim {

struct Hencky {
  static constexpr std::string_view kName = "hencky";
  static constexpr bool kPrincipal = true;
  Lame lame;

  template <class T, int D>
  T energy(const Principal<T, D>& s) const {
    T squares = T(0), trace = T(0);
    for (const T x : s) {
      const T e = LogStretch<T>(x).value;
      squares += e * e;
      trace += e;
    }
    return constant<T>(lame.mu) * squares + constant<T>(lame.lambda / 2) * (trace * trace);
  }
  /// tau_i = (2 mu e_i + lambda sum e) de_i/dlog s_i
  template <class T, int D>
  Principal<T, D> kirchhoff(const Principal<T, D>& s) const {
    Principal<T, D> e, rate, tau;
    for (std::size_t i = 0; i < D; ++i) {
      const LogStretch<T> log(s[i]);
      e[i] = log.value;
      rate[i] = log.rate;
    }
    const T volumetric = constant<T>(lame.lambda) * sum<T, D>(e);
    for (std::size_t i = 0; i < D; ++i) tau[i] = (constant<T>(2 * lame.mu) * e[i] + volumetric) * rate[i];
    return tau;
  }
  /// The same of logarithmic strains that no tangent has changed.
  template <class T, int D>
  Principal<T, D> kirchhoff_of_strain(const Principal<T, D>& e) const {
    const T volumetric = constant<T>(lame.lambda) * sum<T, D>(e);
    Principal<T, D> tau;
    for (std::size_t i = 0; i < D; ++i) tau[i] = fused(constant<T>(2 * lame.mu), e[i], volumetric);
    return tau;
  }
  /// Along one axis lambda + 2 mu - tau_i; across two, with r the ratio of their squared stretches, at most mu (2 + log r) + |tau|.
  template <class T, int D>
  T stiffness_of_strain(const Principal<T, D>& e) const {
    T high = e[0], low = e[0];
    for (std::size_t i = 1; i < D; ++i) high = larger(high, e[i]), low = smaller(low, e[i]);
    const T volumetric = constant<T>(lame.lambda) * sum<T, D>(e), two_mu = constant<T>(2 * lame.mu);
    const T stress = larger(magnitude(two_mu * high + volumetric), magnitude(two_mu * low + volumetric));
    return constant<T>(lame.lambda + 2 * lame.mu) + two_mu * (high - low) + stress;
  }
  template <class T, int D>
  T stiffness(const Principal<T, D>& s) const {
    Principal<T, D> e;
    T steepest = constant<T>(1);   // of the logarithm's slopes, over those of its argument: above 1 on its tangent, which an inverted body is on
    for (std::size_t i = 0; i < D; ++i) {
      const LogStretch<T> log(s[i]);
      e[i] = log.value;
      steepest = larger(steepest, magnitude(log.rate));
    }
    return stiffness_of_strain<T, D>(e) + constant<T>(lame.lambda + 2 * lame.mu) * (steepest * steepest - constant<T>(1));
  }
};

}  // namespace sim
