#pragma once
// Small matrices of particles' deformation, for a number type T of lanes.h. A deformation gradient F is held as its displacement
// gradient F - I: at small strain F itself would keep only the digits that I leaves.
#include <array>

#include "sim/solid/lanes.h"

namespace sim {

/// A number a principal direction.
template <class T, int D>
using Principal = std::array<T, std::size_t(D)>;

template <class T, int D>
struct Matrix {
  std::array<std::array<T, D>, D> m;   // [row][column]
  T& operator()(int r, int c) { return m[std::size_t(r)][std::size_t(c)]; }
  const T& operator()(int r, int c) const { return m[std::size_t(r)][std::size_t(c)]; }
  static Matrix zero() {
    Matrix a;
    for (auto& row : a.m) row.fill(T(0));
    return a;
  }
  static Matrix identity() {
    Matrix a = zero();
    for (int i = 0; i < D; ++i) a(i, i) = T(1);
    return a;
  }
  Matrix transposed() const {
    Matrix t;
    for (int i = 0; i < D; ++i)
      for (int k = 0; k < D; ++k) t(i, k) = (*this)(k, i);
    return t;
  }
};

template <class T, int D>
SIM_INLINE Matrix<T, D> operator+(const Matrix<T, D>& a, const Matrix<T, D>& b) {
  Matrix<T, D> s;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) s(i, k) = a(i, k) + b(i, k);
  return s;
}

template <class T, int D>
SIM_INLINE Matrix<T, D> operator*(const Matrix<T, D>& a, const Matrix<T, D>& b) {
  Matrix<T, D> p;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) {
      p(i, k) = a(i, 0) * b(0, k);
      for (int j = 1; j < D; ++j) p(i, k) = fused(a(i, j), b(j, k), p(i, k));
    }
  return p;
}

/// I + a, and back.
template <class T, int D>
SIM_INLINE Matrix<T, D> plus_identity(Matrix<T, D> a) {
  for (int i = 0; i < D; ++i) a(i, i) += T(1);
  return a;
}

/// (I + a)(I + b) - I.
template <class T, int D>
SIM_INLINE Matrix<T, D> composed(const Matrix<T, D>& a, const Matrix<T, D>& b) {
  return a + (b + a * b);
}

/// u diag(d) v^T.
template <class T, int D>
SIM_INLINE Matrix<T, D> from_principal(const Matrix<T, D>& u, const Principal<T, D>& d, const Matrix<T, D>& v) {
  Matrix<T, D> scaled;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) scaled(i, k) = u(i, k) * d[std::size_t(k)];
  return scaled * v.transposed();
}

template <class T, int D>
SIM_INLINE T determinant(const Matrix<T, D>& a) {
  if constexpr (D == 2) return a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0);
  else
    return a(0, 0) * (a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1)) + (a(0, 1) * (a(1, 2) * a(2, 0) - a(1, 0) * a(2, 2)) +
                                                                a(0, 2) * (a(1, 0) * a(2, 1) - a(1, 1) * a(2, 0)));
}

/// det(I + g) - 1 without cancellation.
template <class T, int D>
SIM_INLINE T volume_change(const Matrix<T, D>& g) {
  if constexpr (D == 2) return (g(0, 0) + g(1, 1)) + determinant(g);
  else {
    const T minors = (g(0, 0) * g(1, 1) - g(0, 1) * g(1, 0)) + ((g(0, 0) * g(2, 2) - g(0, 2) * g(2, 0)) + (g(1, 1) * g(2, 2) - g(1, 2) * g(2, 1)));
    return ((g(0, 0) + g(1, 1)) + g(2, 2)) + (minors + determinant(g));
  }
}

/// F F^T - I from F - I.
template <class T, int D>
SIM_INLINE Matrix<T, D> left_strain(const Matrix<T, D>& g) {
  Matrix<T, D> s;
  for (int i = 0; i < D; ++i)
    for (int k = i; k < D; ++k) {
      T sum = g(i, k) + g(k, i);
      for (int j = 0; j < D; ++j) sum = fused(g(i, j), g(k, j), sum);
      s(i, k) = s(k, i) = sum;
    }
  return s;
}

/// a^T a.
template <class T, int D>
SIM_INLINE Matrix<T, D> gram(const Matrix<T, D>& a) {
  Matrix<T, D> s;
  for (int i = 0; i < D; ++i)
    for (int k = i; k < D; ++k) {
      T sum = a(0, i) * a(0, k);
      for (int j = 1; j < D; ++j) sum = fused(a(j, i), a(j, k), sum);
      s(i, k) = s(k, i) = sum;
    }
  return s;
}

/// The largest magnitude in a symmetric matrix.
template <class T, int D>
SIM_INLINE T largest_entry(const Matrix<T, D>& a) {
  T largest = T(0);
  for (int i = 0; i < D; ++i)
    for (int k = i; k < D; ++k) largest = larger(largest, magnitude(a(i, k)));
  return largest;
}

/// trace(F^T F) - D from F - I.
template <class T, int D>
SIM_INLINE T stretch_excess(const Matrix<T, D>& g) {
  T sum = T(0);
  for (int i = 0; i < D; ++i) {
    sum += T(2) * g(i, i);
    for (int k = 0; k < D; ++k) sum += g(i, k) * g(i, k);
  }
  return sum;
}

/// product(1 + s_i) - 1 without cancellation.
template <class T, int D>
SIM_INLINE T product_change(const Principal<T, D>& s) {
  T j = s[0] + s[1] + s[0] * s[1];
  if constexpr (D == 3) j = j + s[2] + j * s[2];
  return j;
}

}  // namespace sim
