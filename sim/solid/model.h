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

template <class T, int D>
Matrix<T, D> select(MaskOf<T> m, const Matrix<T, D>& yes, const Matrix<T, D>& no) {
  Matrix<T, D> chosen;
  for (std::size_t i = 0; i < D; ++i)
    for (std::size_t k = 0; k < D; ++k) chosen.m[i][k] = select(m, yes.m[i][k], no.m[i][k]);
  return chosen;
}

/// U and the stretches of any F: by the half decomposition where it holds, which costs a third of the whole.
template <class T, int D>
LeftStretch<T, D> any_left_stretch(const Matrix<T, D>& g) {
  const auto moderate = is_moderate(g);
  if (all(moderate)) return left_stretch(g);
  const Svd<T, D> whole = svd(g);
  if (!any(moderate)) return {whole.u, whole.stretch};
  LeftStretch<T, D> f = left_stretch(g);   // a lane's bits do not depend on the others'
  f.u = select<T, D>(moderate, f.u, whole.u);
  for (std::size_t i = 0; i < D; ++i) f.stretch[i] = select(moderate, f.stretch[i], whole.stretch[i]);
  return f;
}

/// No plasticity.
template <class Law>
struct Elastic {
  Law law;
  template <class T, int D>
  Response<T, D> respond(const Matrix<T, D>& change, Deformation<T, D>& p) const {
    p.gradient = composed(change, p.gradient);
    if constexpr (Law::kPrincipal) {
      const LeftStretch<T, D> f = any_left_stretch(p.gradient);
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
  /// Drops that are further apart than this have parted: J counts no further. What counted less would push before it is together again.
  static constexpr double kMostVolume = 54.6;   // e^4, as sand's
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
    const auto moderate = is_moderate(p.gradient);
    if (all(moderate)) return respond_to_moderate<T, D>(p);
    Deformation<T, D> other = p;
    Response<T, D> r = respond_to_any<T, D>(other);
    if (any(moderate)) {   // a lane's bits do not depend on the others'
      const Response<T, D> near = respond_to_moderate<T, D>(p);
      other.gradient = select<T, D>(moderate, p.gradient, other.gradient), other.state = select(moderate, p.state, other.state);
      r = {select<T, D>(moderate, near.stress, r.stress), select(moderate, near.stiffness, r.stiffness),
           either(both(moderate, near.held), both(none(moderate), r.held))};
    }
    p = other;
    return r;
  }
  template <int D>
  double energy(const Deformation<double, D>& p) const {
    const double psi = energy_of(law, p.gradient);
    if constexpr (std::is_same_v<Yield, Snow>) return psi * yield.hardened(p.state);
    return psi;
  }

 private:
  /// p after the trial step, with F = U diag(s) V^T of any kind. Stretches after it: U diag(s') V^T.
  template <class T, int D>
  Response<T, D> respond_to_any(Deformation<T, D>& p) const {
    Svd<T, D> f = svd(p.gradient);
    const auto crushed = is_crushed<T, D>(f.stretch);
    const Principal<T, D> trial = f.stretch;
    const auto flows = yield.template project<T, D>(law.lame, f.stretch, p.state);
    if (any(flows)) {
      // As what it was plus U diag(change) V^T: lanes that do not flow keep their bits.
      Principal<T, D> difference;
      for (std::size_t i = 0; i < D; ++i) difference[i] = select(flows, f.stretch[i] - trial[i], T(0));
      p.gradient = p.gradient + from_principal(f.u, difference, f.v);
    }
    return hardened<T, D>(p, f.u, law.template kirchhoff<T, D>(f.stretch), law.template stiffness<T, D>(f.stretch), crushed);
  }
  /// The same where is_moderate: s' = (1 + r) s, and F' = (I + U diag(r) U^T) F needs no V.
  template <class T, int D>
  Response<T, D> respond_to_moderate(Deformation<T, D>& p) const {
    const LeftStretch<T, D> f = left_stretch(p.gradient);
    Principal<T, D> s = f.stretch, ratio;
    if constexpr (Yield::kLogarithmic) {
      Principal<T, D> e;
      for (std::size_t i = 0; i < D; ++i) e[i] = log_of_one_plus(s[i]);
      const Principal<T, D> trial = e;
      const auto flows = yield.template flow<T, D>(law.lame, e, p.state);
      if (any(flows)) {
        for (std::size_t i = 0; i < D; ++i) ratio[i] = select(flows, exp_minus_one(e[i] - trial[i]), T(0));
        p.gradient = composed(from_principal(f.u, ratio, f.u), p.gradient);
      }
      return hardened<T, D>(p, f.u, law.template kirchhoff_of_strain<T, D>(e), law.template stiffness_of_strain<T, D>(e), T(0) > T(0));
    } else {
      const auto flows = yield.template project<T, D>(law.lame, s, p.state);
      if (any(flows)) {
        for (std::size_t i = 0; i < D; ++i) ratio[i] = select(flows, (s[i] - f.stretch[i]) / (T(1) + f.stretch[i]), T(0));
        p.gradient = composed(from_principal(f.u, ratio, f.u), p.gradient);
      }
      return hardened<T, D>(p, f.u, law.template kirchhoff<T, D>(s), law.template stiffness<T, D>(s), T(0) > T(0));
    }
  }
  template <class T, int D>
  Response<T, D> hardened(const Deformation<T, D>& p, const Matrix<T, D>& u, Principal<T, D> tau, T stiffness, MaskOf<T> held) const {
    if constexpr (std::is_same_v<Yield, Snow>) {
      const T factor = yield.hardened(p.state);
      for (T& x : tau) x *= factor;
      stiffness *= factor;
      held = either(held, yield.is_capped(p.state));
    }
    return {from_principal(u, tau, u), stiffness, held};
  }
};

using Model =
    std::variant<Elastic<FixedCorotated>, Elastic<NeoHookean>, Elastic<Hencky>, Liquid, Plastic<VonMises>, Plastic<DruckerPrager>, Plastic<Snow>>;

template <class Law>
inline constexpr bool kYields = false;
template <class Yield>
inline constexpr bool kYields<Plastic<Yield>> = true;

inline bool is_plastic(const Model& model) {
  return std::visit([]<class Law>(const Law&) { return kYields<Law>; }, model);
}

}  // namespace sim
