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
void rotate_columns(Matrix<T, D>& a, int p, int q, const Turn<T>& turn) {
  for (int i = 0; i < D; ++i) {
    const T x = a(i, p), y = a(i, q);
    a(i, p) = turn.c * x - turn.s * y;
    a(i, q) = turn.s * x + turn.c * y;
  }
}

template <class T, int D>
void rotate_rows(Matrix<T, D>& a, int p, int q, const Turn<T>& turn) {
  for (int i = 0; i < D; ++i) {
    const T x = a(p, i), y = a(q, i);
    a(p, i) = turn.c * x - turn.s * y;
    a(q, i) = turn.s * x + turn.c * y;
  }
}

/// Tangent of the rotation, by at most 45 degrees, that diagonalises a symmetric 2x2 matrix: `off` is twice its element off the diagonal,
/// `gap` the second of those on it less the first.
template <class T>
T tangent(T off, T gap) {
  const T length = root(gap * gap + off * off) + magnitude(gap);
  return select(gap < T(0), -off, off) / select(length > T(0), length, T(1));
}

/// One Jacobi rotation that makes s(p, q) zero.
template <class T, int D>
void annihilate(Matrix<T, D>& s, Matrix<T, D>& v, int p, int q) {
  const T t = tangent(T(2) * s(p, q), s(q, q) - s(p, p));
  const auto turn = Turn<T>::by_tangent(t);
  rotate_columns(s, p, q, turn);
  rotate_rows(s, p, q, turn);
  rotate_columns(v, p, q, turn);
}

/// Exchanges columns p and q where the second is longer, one of them turned round: what was a rotation stays one.
template <class T, int D>
void order_columns(Matrix<T, D>& b, Matrix<T, D>& v, Principal<T, D>& e, Principal<T, D>& length2, int p, int q) {
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

/// Turns rows p and q so that b(q, p) is zero and b(p, p) is not negative. Where both are nothing but rounding, nothing turns.
template <class T, int D>
void eliminate(Matrix<T, D>& b, Matrix<T, D>& u, int p, int q) {
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

  out.v = Matrix<T, D>::identity();
  for (int sweep = 0; sweep < detail::kJacobiSweeps<T, D>; ++sweep)
    for (int p = 0; p < D - 1; ++p)
      for (int q = p + 1; q < D; ++q) detail::annihilate(s, out.v, p, q);

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

/// The rotation next to F (its polar rotation; where det F < 0 the one that leaves the smallest stretch negative).
template <class T, int D>
Matrix<T, D> polar_rotation(const Svd<T, D>& f) {
  return f.u * f.v.transposed();
}

}  // namespace sim
