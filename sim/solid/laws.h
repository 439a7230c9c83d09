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
