#pragma once
// What a material does to the particles it is made of in a step: F -> (I + dt grad v) F, back to the yield surface, stress. One type a pair of
// elasticity and plasticity; a step chooses among them once a group of particles.
#include <variant>

#include "sim/solid/drucker_prager.h"
#include "sim/solid/fixed_corotated.h"
#include "sim/solid/hencky.h"
#include "sim/solid/neo_hookean.h"
#include "sim/solid/snow.h"
#include "sim/solid/tait.h"
#include "sim/solid/von_mises.h"

namespace sim {

/// A particle's deformation: F - I of the elastic part, and what its plasticity remembers (0 at rest).
template <class T, int D>
struct Deformation {
  Matrix<T, D> gradient;
  T state;
};

/// Stress [Pa] (Kirchhoff), stiffness [Pa] as in laws.h, and what was held back: where a law met the end of its range.
template <class T, int D>
struct Response {
  Matrix<T, D> stress;
  T stiffness;
  MaskOf<T> held;
};

/// No plasticity.
template <class Law>
struct Elastic {
  Law law;
  template <class T, int D>
  Response<T, D> respond(const Matrix<T, D>& change, Deformation<T, D>& p) const {
    p.gradient = composed(change, p.gradient);
    if constexpr (Law::kPrincipal) {
      const Svd<T, D> f = svd(p.gradient);
      return {from_principal(f.u, law.template kirchhoff<T, D>(f.stretch), f.u), law.template stiffness<T, D>(f.stretch), T(0) > T(0)};
    } else {
      return {law.template kirchhoff<T, D>(p.gradient), law.template stiffness<T, D>(p.gradient), T(0) > T(0)};
    }
  }
  /// [J/m^3] of rest volume.
  template <int D>
  double energy(const Deformation<double, D>& p) const {
    return energy_of(law, p.gradient);
  }
};

/// A liquid keeps J - 1 alone, in `state`: F would shear without end.
struct Liquid {
  Tait law;
  /// Drops that are further apart than this have parted: J counts no further.
  static constexpr double kMostVolume = 2;
  template <class T, int D>
  Response<T, D> respond(const Matrix<T, D>& change, Deformation<T, D>& p) const {
    const T j = volume_change(change);
    const T volume = p.state + j + p.state * j;
    const auto parted = volume > constant<T>(kMostVolume - 1), crushed = volume < constant<T>(kLeastStretch - 1);
    p.state = larger(smaller(volume, constant<T>(kMostVolume - 1)), constant<T>(kLeastStretch - 1));
    Response<T, D> r{Matrix<T, D>::zero(), law.stiffness_of_volume(p.state), either(parted, crushed)};
    for (int a = 0; a < D; ++a) r.stress(a, a) = -law.pressure(p.state) * (p.state + T(1));
    return r;
  }
  template <int D>
  double energy(const Deformation<double, D>& p) const {
    return law.energy_of_volume(p.state);
  }
};

/// Yield is a law of principal stretches with the elasticity it stands on.
template <class Yield>
struct Plastic {
  using Law = typename Yield::Elasticity;
  Law law;
  Yield yield;
  template <class T, int D>
  Response<T, D> respond(const Matrix<T, D>& change, Deformation<T, D>& p) const {
    p.gradient = composed(change, p.gradient);
    Svd<T, D> f = svd(p.gradient);
    auto held = is_crushed<T, D>(f.stretch);
    const Principal<T, D> trial = f.stretch;
    const auto flows = yield.template project<T, D>(law.lame, f.stretch, p.state);
    if (any(flows)) {
      // U diag(s) V^T - I as what it was plus U diag(change) V^T: lanes that do not flow keep their bits.
      Principal<T, D> difference;
      for (std::size_t i = 0; i < D; ++i) difference[i] = select(flows, f.stretch[i] - trial[i], T(0));
      p.gradient = p.gradient + from_principal(f.u, difference, f.v);
    }
    Principal<T, D> tau = law.template kirchhoff<T, D>(f.stretch);
    T stiffness = law.template stiffness<T, D>(f.stretch);
    if constexpr (std::is_same_v<Yield, Snow>) {
      const T factor = yield.hardened(p.state);
      for (T& x : tau) x *= factor;
      stiffness *= factor;
      held = either(held, yield.is_capped(p.state));
    }
    return {from_principal(f.u, tau, f.u), stiffness, held};
  }
  template <int D>
  double energy(const Deformation<double, D>& p) const {
    const double psi = energy_of(law, p.gradient);
    if constexpr (std::is_same_v<Yield, Snow>) return psi * yield.hardened(p.state);
    return psi;
  }
};

using Model =
    std::variant<Elastic<FixedCorotated>, Elastic<NeoHookean>, Elastic<Hencky>, Liquid, Plastic<VonMises>, Plastic<DruckerPrager>, Plastic<Snow>>;

}  // namespace sim
