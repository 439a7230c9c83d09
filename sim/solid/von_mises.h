#pragma once
// Von Mises plasticity with linear isotropic hardening, on Hencky elasticity: |dev tau| <= sqrt(2/3) (yield + hardening a), a the
// equivalent plastic strain. The return along dev e is exact in logarithmic strain [Simo92]. In two dimensions dev is the plane's own.
#include <string_view>

#include "sim/solid/hencky.h"

namespace sim {

/// e less its mean, and its length.
template <class T, int D>
struct Deviator {
  T trace, length;
  Principal<T, D> part;
  explicit Deviator(const Principal<T, D>& e) {
    trace = sum<T, D>(e);
    const T mean = trace * constant<T>(1.0 / D);
    T squares = T(0);
    for (std::size_t i = 0; i < D; ++i) {
      part[i] = e[i] - mean;
      squares += part[i] * part[i];
    }
    length = root(squares);
  }
};

/// log s_i of a plastic solid, never below kLeastStretch: what was crushed further flows from there.
template <class T, int D>
Principal<T, D> held_strain(const Principal<T, D>& stretch) {
  Principal<T, D> e;
  for (std::size_t i = 0; i < D; ++i) e[i] = log_of_one_plus(larger(stretch[i], constant<T>(kLeastStretch - 1)));
  return e;
}

template <class T, int D>
MaskOf<T> is_crushed(const Principal<T, D>& stretch) {
  return stretch[D - 1] < constant<T>(kLeastStretch - 1);   // the last is the smallest
}

/// Yield in logarithmic strains brought to principal stretches.
template <class T, int D, class Yield>
MaskOf<T> project_stretches(const Yield& yield, const Lame& lame, Principal<T, D>& stretch, T& state) {
  Principal<T, D> e = held_strain<T, D>(stretch);
  const auto flows = yield.template flow<T, D>(lame, e, state);
  const auto changed = either(flows, is_crushed<T, D>(stretch));
  if (!any(changed)) return changed;
  for (std::size_t i = 0; i < D; ++i) stretch[i] = select(changed, exp_minus_one(e[i]), stretch[i]);
  return changed;
}

struct VonMises {
  static constexpr std::string_view kName = "von_mises";
  static constexpr bool kLogarithmic = true;   // its return is one of logarithmic strains: flow()
  using Elasticity = Hencky;
  double yield = 1e6, hardening = 0;   // [Pa]

  double radius() const { return std::sqrt(2.0 / 3) * yield; }

  /// Brings logarithmic strains back to the yield surface; `state` is a. Returns where that changed them.
  template <class T, int D>
  SIM_INLINE MaskOf<T> flow(const Lame& lame, Principal<T, D>& e, T& state) const {
    const Deviator<T, D> dev(e);
    const T limit = constant<T>(radius()) + constant<T>(std::sqrt(2.0 / 3) * hardening) * state;
    const T excess = constant<T>(2 * lame.mu) * dev.length - limit;
    const auto flows = excess > limit * constant<T>(kRounding<T>);
    if (!any(flows)) return flows;
    const T flow = select(flows, excess * constant<T>(1 / (2 * lame.mu + 2.0 / 3 * hardening)), T(0));
    const T keep = T(1) - flow / select(flows, dev.length, T(1));
    for (std::size_t i = 0; i < D; ++i) e[i] = select(flows, dev.trace * constant<T>(1.0 / D) + keep * dev.part[i], e[i]);
    state += constant<T>(std::sqrt(2.0 / 3)) * flow;
    return flows;
  }
  /// The same of principal stretches (s_i - 1), crushed ones too.
  template <class T, int D>
  MaskOf<T> project(const Lame& lame, Principal<T, D>& stretch, T& state) const {
    return project_stretches<T, D>(*this, lame, stretch, state);
  }
  /// How far outside the surface it is, over 2 mu [1]; not above 0 after project.
  template <class T, int D>
  T excess(const Lame& lame, const Principal<T, D>& stretch, T state) const {
    const Deviator<T, D> dev(held_strain<T, D>(stretch));
    return dev.length - (constant<T>(radius()) + constant<T>(std::sqrt(2.0 / 3) * hardening) * state) * constant<T>(1 / (2 * lame.mu));
  }

  /// Excess, relative to the limit, that rounding leaves after a return: not flow.
  template <class T>
  static constexpr double kRounding = sizeof(RealOf<T>) == 4 ? 2e-6 : 1e-12;
};

}  // namespace sim
