#pragma once
// A weakly compressible liquid after Tait [Becker07]: pressure p = K/n (J^-n - 1) where it is compressed, nothing where it is not:
// drops part without a pull. Only J counts; particles keep J - 1 alone.
#include <string_view>

#include "sim/solid/laws.h"

namespace sim {

struct Tait {
  static constexpr std::string_view kName = "tait";
  static constexpr bool kPrincipal = false;
  double bulk = 2e5;                       // [Pa] K
  static constexpr double kExponent = 7;   // n of water
  /// Laws go on along a tangent below this J, like the logarithms of others.
  static constexpr double kLeastVolume = 0.5;

  /// Of j = J - 1: Psi = K/n (J^(1-n)/(n-1) + J - n/(n-1)).
  template <class T>
  T energy_of_volume(T j) const {
    const T held = clamped(j), below = larger(held - j, T(0)), volume = held + T(1), v2 = volume * volume, v6 = v2 * v2 * v2;
    const T value = constant<T>(bulk / kExponent) * ((T(1) / v6 - T(7)) * constant<T>(1.0 / 6) + volume);
    return value + below * (pressure_at(held) + constant<T>(0.5) * below * slope_at(held));
  }
  /// p [Pa]
  template <class T>
  T pressure(T j) const {
    const T held = clamped(j);
    return pressure_at(held) + larger(held - j, T(0)) * slope_at(held);
  }
  /// rho0 c^2 = J^2 Psi'' [Pa]; nothing where it is not compressed, so at least K is said: it may be compressed next.
  template <class T>
  T stiffness_of_volume(T j) const {
    const T held = clamped(j), volume = smaller(j, T(0)) + T(1);
    return larger(slope_at(held) * (volume * volume), constant<T>(bulk));
  }

  template <class T, int D>
  T energy(const Matrix<T, D>& g) const {
    return energy_of_volume(volume_change(g));
  }
  template <class T, int D>
  Matrix<T, D> kirchhoff(const Matrix<T, D>& g) const {
    const T j = volume_change(g), pull = -pressure(j) * (j + T(1));
    Matrix<T, D> tau = Matrix<T, D>::zero();
    for (int a = 0; a < D; ++a) tau(a, a) = pull;
    return tau;
  }
  template <class T, int D>
  T stiffness(const Matrix<T, D>& g) const {
    return stiffness_of_volume(volume_change(g));
  }

 private:
  template <class T>
  static T clamped(T j) {
    return smaller(larger(j, constant<T>(kLeastVolume - 1)), T(0));
  }
  template <class T>
  T pressure_at(T j) const {   // j in the law's own range
    return constant<T>(bulk / kExponent) * exp_minus_one(constant<T>(-kExponent) * log_of_one_plus(j));
  }
  template <class T>
  T slope_at(T j) const {      // -dp/dJ
    const T inverse = T(1) / (j + T(1)), i2 = inverse * inverse, i4 = i2 * i2;
    return constant<T>(bulk) * (i4 * i4);
  }
};

}  // namespace sim
