#pragma once
// Deformations for the tests of solid laws.
#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "sim/solid/laws.h"

namespace solid_test {

template <int D>
using Dense = Eigen::Matrix<double, D, D>;

template <int D>
sim::Matrix<double, D> displacement_gradient(const Dense<D>& f) {
  sim::Matrix<double, D> g;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) g(i, k) = f(i, k) - (i == k);
  return g;
}

template <int D>
Dense<D> dense(const sim::Matrix<double, D>& m) {
  Dense<D> out;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) out(i, k) = m(i, k);
  return out;
}

template <int D>
Dense<D> random_matrix(std::mt19937& rng) {
  std::uniform_real_distribution<double> u(-1, 1);
  Dense<D> a;
  for (double& x : a.reshaped()) x = u(rng);
  return a;
}

template <int D>
Dense<D> random_rotation(std::mt19937& rng) {
  const Eigen::HouseholderQR<Dense<D>> qr(random_matrix<D>(rng));
  Dense<D> q = qr.householderQ();
  if (q.determinant() < 0) q.col(0) *= -1;
  return q;
}

/// A rotation times stretches between `low` and `high`.
template <int D>
Dense<D> random_deformation(std::mt19937& rng, double low = 0.5, double high = 1.6) {
  std::uniform_real_distribution<double> u(low, high);
  Eigen::Matrix<double, D, 1> s;
  for (double& x : s.reshaped()) x = u(rng);
  return random_rotation<D>(rng) * s.asDiagonal() * random_rotation<D>(rng);
}

}  // namespace solid_test
