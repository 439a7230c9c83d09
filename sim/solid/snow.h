#pragma once
// Snow [Stomakhin13]: fixed corotated; stretches stay within [1 - critical_compression, 1 + critical_stretch], and both Lame constants
// are exp(hardening (1 - Jp)) times those at rest, Jp the plastic change of volume. The exponent is capped: packed snow is ice, not more.
// Beyond the paper, snow that has been pulled apart (Jp > 1) gives that volume back before its own is pressed together, as sand does [Tampubolon17]:
// with a push and a pull in turn it would swell without end.
#include <string_view>

#include "sim/solid/fixed_corotated.h"

namespace sim {

struct Snow {
  static constexpr std::string_view kName = "snow";
  static constexpr bool kLogarithmic = false;
  using Elasticity = FixedCorotated;
  double critical_compression = 2.5e-2, critical_stretch = 7.5e-3;   // [1]
  double hardening = 10;                                             // [1]
  double most_hardening = 20;                                        // [1] factor on Young's modulus, both ways
  /// Jp stays in this range: beyond it snow is ice or spray, and the hardening has met its cap long before.
  static constexpr double kLeastVolume = 0.1, kMostVolume = 10;

  /// Holds principal stretches (s_i - 1) in their range; `state` is Jp - 1. Returns where that changed them.
  template <class T, int D>
  MaskOf<T> project(const Lame&, Principal<T, D>& stretch, T& state) const {
    const T low = constant<T>(-critical_compression), high = constant<T>(critical_stretch);
    const auto changed = either(either(stretch[0] > high, stretch[D - 1] < low), both(state > T(0), volume<T, D>(stretch) < T(1)));
    if (!any(changed)) return changed;
    T ratio = T(1);
    for (std::size_t i = 0; i < D; ++i) {
      const T held = smaller(larger(stretch[i], low), high);
      ratio *= larger(stretch[i] + T(1), constant<T>(kLeastVolume)) / (held + T(1));
      stretch[i] = held;
    }
    T plastic = smaller(larger((state + T(1)) * ratio, constant<T>(kLeastVolume)), constant<T>(kMostVolume));
    const auto closes = both(changed, both(plastic > T(1), volume<T, D>(stretch) < T(1)));
    if (any(closes)) give_back<T, D>(closes, stretch, plastic);
    state = select(changed, plastic - T(1), state);
    return changed;
  }
  /// Factor on the elastic energy.
  template <class T>
  T hardened(T state) const {
    const T cap = constant<T>(std::log(most_hardening));
    return exp_minus_one(smaller(larger(constant<T>(-hardening) * state, -cap), cap)) + T(1);
  }
  template <class T>
  MaskOf<T> is_capped(T state) const {
    return magnitude(constant<T>(hardening) * state) > constant<T>(std::log(most_hardening));
  }
  template <class T, int D>
  T excess(const Lame&, const Principal<T, D>& stretch, T) const {
    return larger(stretch[0] - constant<T>(critical_stretch), constant<T>(-critical_compression) - stretch[D - 1]);
  }

 private:
  template <class T, int D>
  static T volume(const Principal<T, D>& stretch) {
    T j = T(1);
    for (std::size_t i = 0; i < D; ++i) j *= stretch[i] + T(1);
    return j;
  }
  /// Closes gaps: as far as Jp is above 1 and the elastic volume below, along the axes that are pushed, each by the same part of its logarithmic strain.
  template <class T, int D>
  static void give_back(MaskOf<T> closes, Principal<T, D>& stretch, T& plastic) {
    Principal<T, D> pushed;
    T sum = T(0), pressed = T(0);
    for (std::size_t i = 0; i < D; ++i) {
      const T strain = log_of_one_plus(stretch[i]);
      pushed[i] = smaller(strain, T(0));
      sum -= pushed[i], pressed -= strain;
    }
    const T closed = smaller(log_of_one_plus(plastic - T(1)), larger(pressed, T(0)));
    const auto some = both(closes, sum > T(0));
    const T part = closed / select(some, sum, T(1));
    for (std::size_t i = 0; i < D; ++i) {
      const auto shut = both(some, pushed[i] < T(0));
      stretch[i] = select(shut, exp_minus_one((T(1) - part) * pushed[i]), stretch[i]);
    }
    plastic = select(some, plastic * (exp_minus_one(-closed) + T(1)), plastic);
  }
};

}  // namespace sim
