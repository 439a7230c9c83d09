#pragma once
// Drucker-Prager plasticity of grains, on Hencky elasticity [Klar16]: no stress beyond the cone |dev e| <= -(d lambda + 2 mu)/(2 mu) a tr e,
// a = sqrt(2/3) 2 sin phi/(3 - sin phi). Flow keeps volume; at the tip grains part. What volume they gain there is kept and given back
// before they push again [Tampubolon17]: else sand that is shaken swells. Cohesion c moves the tip to the mean stress c cot phi.
#include <string_view>

#include "sim/solid/von_mises.h"

namespace sim {

struct DruckerPrager {
  static constexpr std::string_view kName = "drucker_prager";
  static constexpr bool kLogarithmic = true;
  using Elasticity = Hencky;
  double friction_angle = 0.5;   // [rad] phi
  double cohesion = 0;           // [Pa]
  /// Volume gained beyond this [log] is forgotten: grains so far apart have parted for good.
  static constexpr double kMostGain = 4;

  double slope() const {
    const double s = std::sin(friction_angle);
    return std::sqrt(2.0 / 3) * 2 * s / (3 - s);
  }
  /// tr e at the tip.
  template <int D>
  double tip(const Lame& lame) const {
    return cohesion > 0 ? cohesion / std::tan(friction_angle) / (lame.lambda + 2 * lame.mu / D) : 0;
  }

  /// Brings logarithmic strains back into the cone; `state` is the volume gained [log]. Returns where that changed them.
  template <class T, int D>
  SIM_INLINE MaskOf<T> flow(const Lame& lame, Principal<T, D>& e, T& state) const {
    const Deviator<T, D> dev(e);
    const T top = constant<T>(tip<D>(lame));
    const auto pushed = dev.trace < T(0);                                    // what was gained is given back before it bears
    const T volume = select(pushed, dev.trace + state, dev.trace), ceiling = select(pushed, T(0), top);
    const T kept = smaller(volume, ceiling);                                 // of the trace
    const T limit = constant<T>(cone<D>(lame)) * (top - kept);
    const auto slides = dev.length > limit * constant<T>(1 + VonMises::kRounding<T>);
    const auto changed = either(either(slides, both(pushed, state > T(0))), dev.trace > top);
    if (!any(changed)) return changed;
    const T keep = select(slides, limit / select(slides, dev.length, T(1)), T(1));
    for (std::size_t i = 0; i < D; ++i) e[i] = select(changed, kept * constant<T>(1.0 / D) + keep * dev.part[i], e[i]);
    const T gained = larger(volume - ceiling, T(0)) + select(pushed, T(0), state);
    state = smaller(gained, constant<T>(kMostGain));
    return changed;
  }
  /// The same of principal stretches (s_i - 1), crushed ones too.
  template <class T, int D>
  MaskOf<T> project(const Lame& lame, Principal<T, D>& stretch, T& state) const {
    return project_stretches<T, D>(*this, lame, stretch, state);
  }
  /// How far outside the cone it is [1]; not above 0 after project.
  template <class T, int D>
  T excess(const Lame& lame, const Principal<T, D>& stretch, T) const {
    const Deviator<T, D> dev(held_strain<T, D>(stretch));
    const T room = constant<T>(tip<D>(lame)) - dev.trace;
    return larger(dev.length - constant<T>(cone<D>(lame)) * room, -room);
  }

 private:
  template <int D>
  double cone(const Lame& lame) const {
    return (D * lame.lambda + 2 * lame.mu) / (2 * lame.mu) * slope();
  }
};

}  // namespace sim
