#pragma once
// Eight particles side by side. The laws of solids are written once, for a number type T: `double`, one particle at a time, or
// Lanes, eight at a time in single precision. Every operation is IEEE's, lane by lane, so an instruction set changes no bit.
#include <immintrin.h>

#include <cmath>
#include <cstdint>
#include <cstring>

/// For the small functions that laws are made of: called, they pass a dozen vectors through memory each. Under the sanitizers, which look at
/// every access, the compiler chooses: all in one function is what takes it longest.
#ifdef __SANITIZE_ADDRESS__
#define SIM_INLINE inline
#else
#define SIM_INLINE [[gnu::always_inline]] inline
#endif

namespace sim {

struct Lanes {
  static constexpr int kWidth = 8;
  typedef float Native __attribute__((vector_size(32)));
  typedef std::int32_t Bits __attribute__((vector_size(32)));   // of a comparison: all bits set where it holds
  Native v;

  Lanes() = default;
  Lanes(float x) : v{x, x, x, x, x, x, x, x} {}
  explicit Lanes(Native n) : v(n) {}
  float operator[](int lane) const { return v[lane]; }
  void set(int lane, float x) { v[lane] = x; }

  friend Lanes operator+(Lanes a, Lanes b) { return Lanes(a.v + b.v); }
  friend Lanes operator-(Lanes a, Lanes b) { return Lanes(a.v - b.v); }
  friend Lanes operator*(Lanes a, Lanes b) { return Lanes(a.v * b.v); }
  friend Lanes operator/(Lanes a, Lanes b) { return Lanes(a.v / b.v); }
  friend Lanes operator-(Lanes a) { return Lanes(-a.v); }
  Lanes& operator+=(Lanes b) { return v += b.v, *this; }
  Lanes& operator-=(Lanes b) { return v -= b.v, *this; }
  Lanes& operator*=(Lanes b) { return v *= b.v, *this; }
  friend Bits operator<(Lanes a, Lanes b) { return a.v < b.v; }
  friend Bits operator>(Lanes a, Lanes b) { return a.v > b.v; }
  friend Bits operator<=(Lanes a, Lanes b) { return a.v <= b.v; }
  friend Bits operator>=(Lanes a, Lanes b) { return a.v >= b.v; }
};

/// The floating point type behind T, and how many particles T holds.
template <class T>
struct NumberTraits {
  using Real = T;
  using Mask = bool;
  static constexpr int kWidth = 1;
};
template <>
struct NumberTraits<Lanes> {
  using Real = float;
  using Mask = Lanes::Bits;
  static constexpr int kWidth = Lanes::kWidth;
};
template <class T>
using RealOf = typename NumberTraits<T>::Real;
template <class T>
using MaskOf = typename NumberTraits<T>::Mask;

inline double lane(double x, int) { return x; }
inline float lane(Lanes x, int i) { return x[i]; }
inline bool lane(bool m, int) { return m; }
inline bool lane(Lanes::Bits m, int i) { return m[i] != 0; }
inline void set_lane(double& x, int, double value) { x = value; }
inline void set_lane(Lanes& x, int i, float value) { x.set(i, value); }

inline double select(bool m, double yes, double no) { return m ? yes : no; }
inline Lanes select(Lanes::Bits m, Lanes yes, Lanes no) { return Lanes(m ? yes.v : no.v); }
inline bool both(bool a, bool b) { return a && b; }
inline Lanes::Bits both(Lanes::Bits a, Lanes::Bits b) { return a & b; }
inline bool either(bool a, bool b) { return a || b; }
inline Lanes::Bits either(Lanes::Bits a, Lanes::Bits b) { return a | b; }
inline bool any(bool m) { return m; }
inline bool any(Lanes::Bits m) { return _mm256_movemask_ps(reinterpret_cast<__m256>(m)) != 0; }
inline bool all(bool m) { return m; }
inline bool all(Lanes::Bits m) { return _mm256_movemask_ps(reinterpret_cast<__m256>(m)) == 0xff; }
inline bool none(bool m) { return !m; }
inline Lanes::Bits none(Lanes::Bits m) { return ~m; }

/// a b + c, rounded once.
inline double fused(double a, double b, double c) { return std::fma(a, b, c); }
inline Lanes fused(Lanes a, Lanes b, Lanes c) { return Lanes(_mm256_fmadd_ps(a.v, b.v, c.v)); }

inline double root(double x) { return std::sqrt(x); }
inline Lanes root(Lanes x) { return Lanes(_mm256_sqrt_ps(x.v)); }
template <class T>
SIM_INLINE T magnitude(T x) {
  return select(x < T(0), -x, x);
}
template <class T>
SIM_INLINE T larger(T a, T b) {
  return select(a > b, a, b);
}
template <class T>
SIM_INLINE T smaller(T a, T b) {
  return select(a < b, a, b);
}

/// log(1 + x) for x > -1, small x without cancellation.
inline double log_of_one_plus(double x) { return std::log1p(x); }
/// The same in single precision, |error| <= 2 ulp: the exponent is split off, atanh's series sums the rest, and what 1 + x lost to
/// rounding is put back in first order.
SIM_INLINE Lanes log_of_one_plus(Lanes x) {
  const Lanes u = Lanes(1) + x, lost = x - (u - Lanes(1));
  Lanes::Bits bits;
  std::memcpy(&bits, &u.v, sizeof bits);
  Lanes::Bits exponent = ((bits - 0x3f3504f3) >> 23);            // u = m 2^exponent with m in [1/sqrt 2, sqrt 2)
  bits -= exponent << 23;
  Lanes m, e;
  std::memcpy(&m.v, &bits, sizeof bits);
  e.v = __builtin_convertvector(exponent, Lanes::Native);
  const Lanes s = (m - Lanes(1)) / (m + Lanes(1)), s2 = s * s;   // log m = 2 atanh s, |s| <= .1716
  const Lanes series = s2 * (Lanes(0.666666666f) + s2 * (Lanes(0.4f) + s2 * (Lanes(0.285714f) + s2 * Lanes(0.2222f))));
  return e * Lanes(0.693359375f) + (Lanes(2) * s + (s * series + (e * Lanes(-2.12194440e-4f) + lost / u)));
}

/// exp(x) - 1, small x without cancellation; x is kept within [-80, 80].
inline double exp_minus_one(double x) { return std::expm1(std::fmin(std::fmax(x, -80.0), 80.0)); }
/// The same in single precision, |error| <= 2 ulp of exp(x) or of the result, whichever is larger.
SIM_INLINE Lanes exp_minus_one(Lanes x) {
  x = smaller(larger(x, Lanes(-80)), Lanes(80));
  const Lanes whole(_mm256_floor_ps(x.v * 1.44269504f + 0.5f));
  const Lanes r = (x - whole * Lanes(0.693359375f)) - whole * Lanes(-2.12194440e-4f);   // |r| <= .35
  const Lanes tail = Lanes(1.0f / 24) + r * (Lanes(1.0f / 120) + r * (Lanes(1.0f / 720) + r * Lanes(1.0f / 5040)));
  const Lanes rest = r + r * r * (Lanes(0.5f) + r * (Lanes(1.0f / 6) + r * tail));
  const Lanes::Bits bits = (__builtin_convertvector(whole.v, Lanes::Bits) + 127) << 23;
  Lanes power;                                                   // 2^whole
  std::memcpy(&power.v, &bits, sizeof bits);
  return power * rest + (power - Lanes(1));
}

}  // namespace sim
