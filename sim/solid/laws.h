#pragma once
// What every law of elasticity here is: isotropic, a density of energy Psi per rest volume as a function of the deformation gradient F,
// and the Kirchhoff stress tau = dPsi/dF F^T (V sigma = V0 tau) [PolyPIC S5]. In two dimensions it is that of plane strain.
//
// A law in principal stretches (kPrincipal) is given s_i - 1, the others F - I. Each has, for T of lanes.h and D = 2, 3:
//   energy(f)      [J/m^3]   0 at rest
//   kirchhoff(f)   [Pa]      principal values, or a symmetric matrix
//   stiffness(f)   [Pa]      not less than rho0 c^2 of any plane wave on top of the deformation: m_i m_k F_jJ n_j F_lL n_l d2Psi/dF_iJ dF_kL
//                            for unit m, n
// Energy is linear in a factor `hardening`, which plasticity may set.
#include "sim/solid/svd.h"

namespace sim {

/// Lame's constants [Pa] of an isotropic solid.
struct Lame {
  double mu = 0, lambda = 0;
  static Lame of(double young, double poisson) {
    return {young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))};
  }
};

/// A constant of a law as T's numbers.
template <class T>
T constant(double x) {
  return T(RealOf<T>(x));
}

/// Below this stretch laws with a logarithm go on along its tangent: energy stays finite, and what was turned inside out comes back.
inline constexpr double kLeastStretch = 0.1;

/// log of a principal stretch, and d log / d log s: 1, less where the tangent has taken over.
template <class T>
struct LogStretch {
  T value, rate;
  explicit LogStretch(T stretch) {
    const T least = constant<T>(kLeastStretch), below = (stretch + T(1)) - least;
    const auto follows_tangent = below < T(0);
    value = select(follows_tangent, constant<T>(std::log(kLeastStretch)) + below / least,
                   log_of_one_plus(larger(stretch, constant<T>(kLeastStretch - 1))));
    rate = select(follows_tangent, (stretch + T(1)) / least, T(1));
  }
};

/// What keeps a volume from vanishing, for laws whose own energy stays finite there: energy k/2 log(J / kSqueezed)^2 where J is below kSqueezed, k being
/// the bulk modulus, and its tangent below kLeastVolume. F changes by factors, so that a body pressed to a point would stay one: no stress of a finite energy
/// pushes it back. Constant where J is not above 0: what was turned inside out has the law's own way back.
template <class T>
class Squeeze {
 public:
  static constexpr double kSqueezed = 0.3, kLeastVolume = 1e-6;

  /// j = J - 1
  Squeeze(const Lame& lame, T j) : bulk_(constant<T>(lame.lambda + 2.0 / 3 * lame.mu)), volume_(j + T(1)) {
    const T log = log_of_one_plus(larger(volume_, constant<T>(kLeastVolume)) * constant<T>(1 / kSqueezed) - T(1));
    log_ = select(volume_ < constant<T>(kSqueezed), log, T(0));
  }
  T energy() const { return bulk_ * log_ * (constant<T>(0.5) * log_ + (share() - T(1))); }
  /// Of every axis.
  T kirchhoff() const { return bulk_ * log_ * share(); }
  /// J^2 d2Psi/dJ2
  T stiffness() const { return select(T(0) < volume_, select(log_ < T(0), bulk_ * (T(1) - log_), T(0)), T(0)); }

 private:
  /// Of kLeastVolume, below it.
  T share() const { return smaller(larger(volume_, T(0)) * constant<T>(1 / kLeastVolume), T(1)); }

  T bulk_, volume_, log_;
};

template <class T, int D>
T sum(const Principal<T, D>& p) {
  T s = p[0] + p[1];
  if constexpr (D == 3) s += p[2];
  return s;
}

/// Energy and stress of any law from F - I.
template <class Law, class T, int D>
T energy_of(const Law& law, const Matrix<T, D>& g) {
  if constexpr (Law::kPrincipal) return law.template energy<T, D>(svd(g).stretch);
  else return law.template energy<T, D>(g);
}
template <class Law, class T, int D>
Matrix<T, D> kirchhoff_of(const Law& law, const Matrix<T, D>& g) {
  if constexpr (Law::kPrincipal) {
    const Svd<T, D> f = svd(g);
    return from_principal(f.u, law.template kirchhoff<T, D>(f.stretch), f.u);
  } else return law.template kirchhoff<T, D>(g);
}
template <class Law, class T, int D>
T stiffness_of(const Law& law, const Matrix<T, D>& g) {
  if constexpr (Law::kPrincipal) return law.template stiffness<T, D>(svd(g).stretch);
  else return law.template stiffness<T, D>(g);
}

}  // namespace sim
