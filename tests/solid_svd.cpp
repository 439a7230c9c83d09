// The decompositions under every solid law: backward errors on random, degenerate and inverted matrices, both precisions, both dimensions.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <bit>
#include <cmath>
#include <random>

#include "sim/solid/svd.h"

namespace {

using namespace sim;

template <int D>
using Dense = Eigen::Matrix<double, D, D>;

/// Matrices of every kind a particle can meet, by number.
template <int D>
Dense<D> sample(int number, std::mt19937& rng) {
  std::uniform_real_distribution<double> u(-1, 1);
  Dense<D> noise;
  for (double& x : noise.reshaped()) x = u(rng);
  const Dense<D> near = Dense<D>::Identity() + std::pow(10, 4 * u(rng) - 4) * noise;
  switch (number % 9) {
    case 0: return Dense<D>::Identity() + 0.5 * noise;
    case 1: return near;
    case 2: return Dense<D>::Zero();
    case 3: return noise.col(0) * noise.row(0);                               // rank 1
    case 4: { Dense<D> f = noise; f.col(0) = 2 * f.col(D - 1); return f; }    // rank D - 1
    case 5: { Dense<D> f = near; f.row(0) *= -1; return f; }                  // inverted
    case 6: return Eigen::JacobiSVD<Dense<D>>(noise, Eigen::ComputeFullU).matrixU() * 0.7;   // equal stretches
    case 7: { Dense<D> f; for (double& x : f.reshaped()) x = u(rng) * std::pow(10, 2 * u(rng)); return f; }
    default: return Dense<D>::Identity();
  }
}

struct Worst {
  double rebuilt = 0, orthogonal = 0, determinant = 0, stretches = 0, order = 0;
};

template <class T, int D>
Worst worst_of(int count) {
  constexpr int W = NumberTraits<T>::kWidth;
  std::mt19937 rng(7);
  Worst worst;
  for (int n = 0; n < count; n += W) {
    Matrix<T, D> g;
    std::array<Dense<D>, std::size_t(W)> exact;
    for (int l = 0; l < W; ++l) {
      const Dense<D> f = sample<D>(n + l, rng);
      for (int i = 0; i < D; ++i)
        for (int k = 0; k < D; ++k) {
          set_lane(g(i, k), l, RealOf<T>(f(i, k) - (i == k)));
          exact[std::size_t(l)](i, k) = double(lane(g(i, k), l)) + (i == k);
        }
    }
    const Svd<T, D> out = svd(g);
    for (int l = 0; l < W; ++l) {
      const Dense<D>& f = exact[std::size_t(l)];
      Dense<D> u, v;
      Eigen::Matrix<double, D, 1> s;
      for (int i = 0; i < D; ++i) {
        s[i] = 1 + double(lane(out.stretch[std::size_t(i)], l));
        for (int k = 0; k < D; ++k) u(i, k) = lane(out.u(i, k), l), v(i, k) = lane(out.v(i, k), l);
      }
      const double scale = std::max(1.0, f.norm());
      worst.rebuilt = std::max(worst.rebuilt, (u * s.asDiagonal() * v.transpose() - f).norm() / scale);
      worst.orthogonal = std::max({worst.orthogonal, (u.transpose() * u - Dense<D>::Identity()).cwiseAbs().maxCoeff(),
                                   (v.transpose() * v - Dense<D>::Identity()).cwiseAbs().maxCoeff()});
      worst.determinant = std::max({worst.determinant, std::abs(u.determinant() - 1), std::abs(v.determinant() - 1)});
      worst.stretches = std::max(worst.stretches, (Eigen::JacobiSVD<Dense<D>>(f).singularValues() - s.cwiseAbs()).cwiseAbs().maxCoeff() / scale);
      for (int i = 1; i < D; ++i) worst.order = std::max(worst.order, (std::abs(s[i]) - s[i - 1]) / scale);
      if (f.determinant() > 1e-4 * scale) {
        EXPECT_GT(s[D - 1], 0);
      }
      if (f.determinant() < -1e-4 * scale) {
        EXPECT_LT(s[D - 1], 0);
      }
    }
  }
  return worst;
}

template <class T, int D>
void expect_accurate(double tolerance) {
  const Worst w = worst_of<T, D>(90000);
  EXPECT_LT(w.rebuilt, tolerance);
  EXPECT_LT(w.orthogonal, tolerance);
  EXPECT_LT(w.determinant, tolerance);
  EXPECT_LT(w.stretches, tolerance);
  EXPECT_LT(w.order, tolerance);
}

}  // namespace

TEST(SolidSvd, EightAtATimeIsRightToSingleRoundingOnRandomAndDegenerateMatrices) {
  expect_accurate<Lanes, 3>(1e-6);
  expect_accurate<Lanes, 2>(1e-6);
}

TEST(SolidSvd, InDoublePrecisionIsRightToItsRounding) {
  expect_accurate<double, 3>(1e-14);
  expect_accurate<double, 2>(1e-14);
}

// F = I + g with g of 1e-6: the strain keeps six of its own digits, not those that the I in F leaves.
TEST(SolidSvd, KeepsTheDigitsOfSmallStrains) {
  Matrix<Lanes, 3> g = Matrix<Lanes, 3>::zero();
  const double angle = 0.3, strain[3] = {3e-6, 1e-6, -2e-6};
  Dense<3> turn = Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 2).normalized()).toRotationMatrix();
  const Dense<3> exact = turn * Eigen::Vector3d(strain[0], strain[1], strain[2]).asDiagonal() * turn.transpose();
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) g(i, k) = Lanes(float(exact(i, k)));
  const Svd<Lanes, 3> out = svd(g);
  std::array<double, 3> found{};
  for (int i = 0; i < 3; ++i) found[std::size_t(i)] = double(out.stretch[std::size_t(i)][5]);
  std::sort(found.begin(), found.end());
  EXPECT_NEAR(found[0], -2e-6, 1e-11);
  EXPECT_NEAR(found[1], 1e-6, 1e-11);
  EXPECT_NEAR(found[2], 3e-6, 1e-11);
}

// A rotation is its own polar rotation, and a symmetric stretch does not change it.
TEST(SolidSvd, PolarRotationIsTheNearestRotation) {
  const Dense<3> turn = Eigen::AngleAxisd(2.0, Eigen::Vector3d(2, -1, 3).normalized()).toRotationMatrix();
  const Dense<3> f = turn * Eigen::Vector3d(1.4, 1, 0.6).asDiagonal();
  Matrix<double, 3> g;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) g(i, k) = f(i, k) - (i == k);
  const Matrix<double, 3> r = polar_rotation(svd(g));
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(r(i, k), turn(i, k), 1e-14);
}

// Lanes do not know each other: what is beside a matrix changes no bit of its decomposition.
TEST(SolidSvd, LanesAreIndependent) {
  std::mt19937 rng(3);
  Matrix<Lanes, 3> mixed;
  for (int l = 0; l < 8; ++l) {
    const Dense<3> f = sample<3>(l, rng);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) mixed(i, k).set(l, float(f(i, k) - (i == k)));
  }
  const Svd<Lanes, 3> together = svd(mixed);
  for (int l = 0; l < 8; ++l) {
    Matrix<Lanes, 3> alone;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) alone(i, k) = Lanes(mixed(i, k)[l]);
    const Svd<Lanes, 3> same = svd(alone);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(std::bit_cast<int>(same.stretch[i][0]), std::bit_cast<int>(together.stretch[i][l]));
  }
}

TEST(SolidSvd, LogarithmAndExponentialOfLanesAreRightToTwoUlps) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> u(-1, 1);
  double log_error = 0, exp_error = 0;
  for (int i = 0; i < 300000; ++i) {
    const float x = i % 2 ? float(std::pow(10, 6 * u(rng)) - (i % 3 == 0 ? 0.9 : 0)) : float(0.99 * u(rng));
    const float y = float(u(rng) * std::pow(10, 1.4 - 2 * (i % 4)));
    if (!(x > -1) || x == 0 || y == 0) continue;
    const double log = std::log1p(double(x)), exp = std::expm1(double(y));
    log_error = std::max(log_error, std::abs(double(log_of_one_plus(Lanes(x))[3]) - log) / std::abs(log));
    exp_error = std::max(exp_error, std::abs(double(exp_minus_one(Lanes(y))[6]) - exp) / std::abs(exp));
  }
  EXPECT_LT(log_error, 2.4e-7);
  EXPECT_LT(exp_error, 2.4e-7);
}
