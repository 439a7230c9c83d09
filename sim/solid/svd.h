#pragma once
// Singular value decomposition F = U diag(s) V^T of 2x2 and 3x3 matrices, many at a time and without branches: cyclic Jacobi on
// F^T F - I, then a QR decomposition of F V by Givens rotations [McAdams11]. U and V are proper rotations (det +1), s is in descending order
// of magnitude, and only the last one may be negative: it has the sign of det F.
#include "sim/solid/matrix.h"

namespace sim {

template <class T, int D>
struct Svd {
  Matrix<T, D> u, v;
  Principal<T, D> stretch;   // s_i - 1: exact to relative rounding where F is near a rotation
};

namespace detail {

template <class T>
T constant_of(double x) {
  return T(RealOf<T>(x));
}

/// Sweeps over all pairs until float or double is diagonal to rounding; convergence is quadratic.
template <class T, int D>
constexpr int kJacobiSweeps = D == 2 ? 1 : sizeof(RealOf<T>) == 4 ? 4 : 6;

/// Cosine and sine, with c^2 + s^2 = 1 to half the rounding that one division leaves: a dozen of them are multiplied.
template <class T>
struct Turn {
  T c, s;
  Turn(T cosine, T sine) {
    const T half_excess = T(0.5) * ((cosine * cosine - T(1)) + sine * sine);
    c = cosine - cosine * half_excess;
    s = sine - sine * half_excess;
  }
  static Turn by_tangent(T t) {
    const T c = T(1) / root(T(1) + t * t);
    return {c, t * c};
  }
};

/// Rotates columns p and q: (p, q) <- (c p - s q, s p + c q).
template <class T, int D>
SIM_INLINE void rotate_columns(Matrix<T, D>& a, int p, int q, const Turn<T>& turn) {
  for (int i = 0; i < D; ++i) {
    const T x = a(i, p), y = a(i, q);
    a(i, p) = fused(turn.c, x, -(turn.s * y));
    a(i, q) = fused(turn.s, x, turn.c * y);
  }
}

template <class T, int D>
SIM_INLINE void rotate_rows(Matrix<T, D>& a, int p, int q, const Turn<T>& turn) {
  for (int i = 0; i < D; ++i) {
    const T x = a(p, i), y = a(q, i);
    a(p, i) = fused(turn.c, x, -(turn.s * y));
    a(q, i) = fused(turn.s, x, turn.c * y);
  }
}

/// Tangent of the rotation, by at most 45 degrees, that diagonalises a symmetric 2x2 matrix: `off` is twice its element off the diagonal,
/// `gap` the second of those on it less the first.
template <class T>
SIM_INLINE T tangent(T off, T gap) {
  const T length = root(gap * gap + off * off) + magnitude(gap);
  return select(gap < T(0), -off, off) / select(length > T(0), length, T(1));
}

/// What is off the diagonal of a symmetric matrix whose largest entry is 1, and no more than rounding.
template <class T>
constexpr double kNegligible = sizeof(RealOf<T>) == 4 ? 3e-8 : 5e-17;

/// One Jacobi rotation, by at most 45 degrees, that makes s(p, q) zero; none where it is negligible, so that a lane's bits do not depend on how
/// long others take. Only the upper triangle of s is read and kept.
template <int p, int q, class T, int D>
SIM_INLINE void annihilate(Matrix<T, D>& s, Matrix<T, D>& v) {
  const T off = s(p, q), twice = off + off, gap = s(q, q) - s(p, p), size = magnitude(gap);
  const auto turns = magnitude(off) > constant_of<T>(kNegligible<T>), falls = gap < T(0);
  const T hypotenuse = root(fused(gap, gap, twice * twice)), wide = hypotenuse + size;
  const T inverse = T(1) / root(select(turns, fused(wide, wide, twice * twice), T(1)));
  const Turn<T> turn(select(turns, wide * inverse, T(1)), select(turns, select(falls, -twice, twice) * inverse, T(0)));
  const T half_change = T(0.5) * (hypotenuse - size), change = select(turns, select(falls, -half_change, half_change), T(0));
  s(p, p) -= change;
  s(q, q) += change;
  s(p, q) = select(turns, T(0), off);
  if constexpr (D == 3) {
    constexpr int r = 3 - p - q;
    T& in_p = r < p ? s(r, p) : s(p, r);
    T& in_q = r < q ? s(r, q) : s(q, r);
    const T x = in_p, y = in_q;
    in_p = fused(turn.c, x, -(turn.s * y));
    in_q = fused(turn.s, x, turn.c * y);
  }
  rotate_columns(v, p, q, turn);
}

/// Makes a symmetric s diagonal; returns the rotation v whose columns are its directions: v^T s v.
template <class T, int D>
SIM_INLINE Matrix<T, D> diagonalise(Matrix<T, D>& s) {
  Matrix<T, D> v = Matrix<T, D>::identity();
  for (int sweep = 0; sweep < kJacobiSweeps<T, D>; ++sweep) {
    T off = magnitude(s(0, 1));
    if constexpr (D == 3) off = larger(off, larger(magnitude(s(0, 2)), magnitude(s(1, 2))));
    if (!any(off > constant_of<T>(kNegligible<T>))) break;
    annihilate<0, 1>(s, v);
    if constexpr (D == 3) {
      annihilate<0, 2>(s, v);
      annihilate<1, 2>(s, v);
    }
  }
  return v;
}

/// Exchanges columns p and q where the second is longer, one of them turned round: what was a rotation stays one.
template <class T, int D>
SIM_INLINE void order_columns(Matrix<T, D>& b, Matrix<T, D>& v, Principal<T, D>& e, Principal<T, D>& length2, int p, int q) {
  const auto swaps = length2[std::size_t(p)] < length2[std::size_t(q)];
  const auto exchange = [&](Matrix<T, D>& a) {
    for (int i = 0; i < D; ++i) {
      const T x = a(i, p), y = a(i, q);
      a(i, p) = select(swaps, y, x);
      a(i, q) = select(swaps, -x, y);
    }
  };
  exchange(b), exchange(v);
  const auto exchange_numbers = [&](Principal<T, D>& a) {
    const T x = a[std::size_t(p)], y = a[std::size_t(q)];
    a[std::size_t(p)] = select(swaps, y, x);
    a[std::size_t(q)] = select(swaps, x, y);
  };
  exchange_numbers(e), exchange_numbers(length2);
}

/// Exchanges columns p and q of u where the second number is larger, one of them turned round.
template <class T, int D>
SIM_INLINE void order_columns(Matrix<T, D>& u, Principal<T, D>& e, int p, int q) {
  const T first = e[std::size_t(p)], second = e[std::size_t(q)];
  const auto swaps = first < second;
  e[std::size_t(p)] = select(swaps, second, first);
  e[std::size_t(q)] = select(swaps, first, second);
  for (int i = 0; i < D; ++i) {
    const T x = u(i, p), y = u(i, q);
    u(i, p) = select(swaps, y, x);
    u(i, q) = select(swaps, -x, y);
  }
}

/// Turns rows p and q so that b(q, p) is zero and b(p, p) is not negative. Where both are nothing but rounding, nothing turns.
template <class T, int D>
SIM_INLINE void eliminate(Matrix<T, D>& b, Matrix<T, D>& u, int p, int q) {
  const T a = b(p, p), z = b(q, p), length2 = a * a + z * z;
  const auto turns = length2 > T(1e-30);
  const T inverse = T(1) / root(select(turns, length2, T(1)));
  const Turn<T> turn(select(turns, a * inverse, T(1)), select(turns, -z * inverse, T(0)));
  rotate_rows(b, p, q, turn);
  rotate_columns(u, p, q, turn);
}

/// Squaring F loses what is smaller than its largest stretch by the root of rounding: the last two columns of the triangle b are made
/// orthogonal once more, from b itself. Not where `done`: small strains were found without squaring, and b knows less of them.
template <class T>
void settle(Matrix<T, 3>& b, Matrix<T, 3>& u, Matrix<T, 3>& v, MaskOf<T> done) {
  const T scale = larger(magnitude(b(1, 1)), magnitude(b(2, 2))), inverse = T(1) / select(scale > T(1e-12), scale, T(1));
  const T x = b(1, 1) * inverse, y = b(1, 2) * inverse, z = b(2, 2) * inverse;
  const auto turn = Turn<T>::by_tangent(select(done, T(0), tangent(T(2) * x * y, (y - x) * (y + x) + z * z)));
  rotate_columns(b, 1, 2, turn);
  rotate_columns(v, 1, 2, turn);
  eliminate(b, u, 1, 2);
}

}  // namespace detail

/// `g` is F - I. Backward error <= 1e-6 |F| in single, 1e-14 |F| in double precision.
template <class T, int D>
Svd<T, D> svd(const Matrix<T, D>& g) {
  Svd<T, D> out;
  Matrix<T, D> s = left_strain(g.transposed());   // F^T F - I
  const auto is_near = largest_entry(s) < T(0.3);
  const Matrix<T, D> far = gram(plus_identity(g));  // F^T F: where F is small, I would swallow its digits
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) s(i, k) = select(is_near, s(i, k), far(i, k));
  const T largest = largest_entry(s), scale = select(largest > T(0), largest, T(1)), inverse = T(1) / scale;
  for (auto& row : s.m)
    for (T& x : row) x = x * inverse;               // squares of the smallest strains must not underflow

  out.v = detail::diagonalise(s);
  Matrix<T, D> b = out.v + g * out.v;             // F V: its columns are orthogonal
  Principal<T, D> e, length2;
  for (int i = 0; i < D; ++i) {
    e[std::size_t(i)] = s(i, i) * scale;
    T sum = b(0, i) * b(0, i);
    for (int k = 1; k < D; ++k) sum += b(k, i) * b(k, i);
    length2[std::size_t(i)] = sum;
  }
  detail::order_columns(b, out.v, e, length2, 0, 1);
  if constexpr (D == 3) {
    detail::order_columns(b, out.v, e, length2, 0, 2);
    detail::order_columns(b, out.v, e, length2, 1, 2);
  }
  out.u = Matrix<T, D>::identity();
  for (int p = 0; p < D - 1; ++p)
    for (int q = p + 1; q < D; ++q) detail::eliminate(b, out.u, p, q);
  if constexpr (D == 3) detail::settle(b, out.u, out.v, is_near);

  // sqrt(1 + e) - 1 keeps the digits of small strains; where any is large the diagonal itself is as exact, and has the sign.
  for (int i = 0; i < D; ++i) {
    const T strain = e[std::size_t(i)];
    const T small = strain / (T(1) + root(larger(T(1) + strain, T(0))));
    out.stretch[std::size_t(i)] = select(both(is_near, b(i, i) > T(0)), small, b(i, i) - T(1));
  }
  return out;
}

/// Half of the decomposition, where strains are moderate: F F^T = U diag(s^2) U^T without V and without the triangle.
template <class T, int D>
struct LeftStretch {
  Matrix<T, D> u;            // det +1
  Principal<T, D> stretch;   // s_i - 1, in descending order
};

/// Where left_stretch holds: stretches between .3 and 1.4, and F is no reflection.
template <class T, int D>
SIM_INLINE MaskOf<T> is_moderate(const Matrix<T, D>& g) {
  return both(largest_entry(left_strain(g)) < T(0.3), volume_change(g) > T(-1));
}

/// `g` is F - I. Backward error <= 1e-6 in single, 1e-14 in double precision, of the largest strain.
template <class T, int D>
SIM_INLINE LeftStretch<T, D> left_stretch(const Matrix<T, D>& g) {
  LeftStretch<T, D> out;
  Matrix<T, D> s = left_strain(g);                  // F F^T - I
  const T largest = largest_entry(s), scale = select(largest > T(0), largest, T(1)), inverse = T(1) / scale;
  for (int i = 0; i < D; ++i)
    for (int k = i; k < D; ++k) s(i, k) = s(i, k) * inverse;
  out.u = detail::diagonalise(s);
  Principal<T, D> e;
  for (int i = 0; i < D; ++i) e[std::size_t(i)] = s(i, i) * scale;
  detail::order_columns(out.u, e, 0, 1);
  if constexpr (D == 3) {
    detail::order_columns(out.u, e, 0, 2);
    detail::order_columns(out.u, e, 1, 2);
  }
  for (std::size_t i = 0; i < D; ++i) out.stretch[i] = e[i] / (T(1) + root(larger(T(1) + e[i], T(0))));
  return out;
}

/// The rotation next to F (its polar rotation; where det F < 0 the one that leaves the smallest stretch negative).
template <class T, int D>
Matrix<T, D> polar_rotation(const Svd<T, D>& f) {
  return f.u * f.v.transposed();
}

}  // namespace sim
