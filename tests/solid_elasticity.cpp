// Laws of elasticity against their own energy, against Hooke at small strain, and against what rotation may not change.
#include <gtest/gtest.h>

#include "sim/solid/fixed_corotated.h"
#include "sim/solid/hencky.h"
#include "sim/solid/neo_hookean.h"
#include "sim/solid/tait.h"
#include "tests/solid_matrices.h"

namespace {

using namespace sim;
using namespace solid_test;

const Lame kLame = Lame::of(3e5, 0.35);

/// Calls check(law, name) for every law, in D dimensions.
template <class Check>
void for_all_laws(const Check& check) {
  check(FixedCorotated{kLame}, "fixed_corotated");
  check(NeoHookean{kLame}, "neo_hookean");
  check(Hencky{kLame}, "hencky");
  check(Tait{2e5}, "tait");
}

template <int D, class Law>
double energy(const Law& law, const Dense<D>& f) {
  return energy_of(law, displacement_gradient<D>(f));
}
template <int D, class Law>
Dense<D> kirchhoff(const Law& law, const Dense<D>& f) {
  return dense<D>(kirchhoff_of(law, displacement_gradient<D>(f)));
}

/// dPsi/dF by central differences of fourth order.
template <int D, class Law>
Dense<D> energy_gradient(const Law& law, const Dense<D>& f) {
  constexpr double h = 2e-4;
  Dense<D> p;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) {
      const auto at = [&](double step) {
        Dense<D> moved = f;
        moved(i, k) += step;
        return energy<D>(law, moved);
      };
      p(i, k) = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    }
  return p;
}

/// A kink of the law is within reach of the differences: their order is lost there.
template <int D, class Law>
bool is_kink(const Law&, const Dense<D>& f) {
  const Eigen::Matrix<double, D, 1> s = Eigen::JacobiSVD<Dense<D>>(f).singularValues();
  if constexpr (std::is_same_v<Law, Tait>) return std::abs(f.determinant() - 1) < 2e-2 || std::abs(f.determinant() - Tait::kLeastVolume) < 2e-2;
  if constexpr (std::is_same_v<Law, Hencky>) return std::abs(s[D - 1] - kLeastStretch) < 2e-2;
  return false;
}

template <int D>
void expect_stress_is_energy_gradient(double low, double high) {
  std::mt19937 rng(11);
  for (int n = 0; n < 200; ++n) {
    const Dense<D> f = random_deformation<D>(rng, low, high);
    for_all_laws([&](const auto& law, const char* name) {
      if (is_kink<D>(law, f)) return;
      const Dense<D> tau = kirchhoff<D>(law, f), expected = energy_gradient<D>(law, f) * f.transpose();
      EXPECT_LT((tau - expected).norm(), 1e-6 * std::max(expected.norm(), 3e5)) << name << " D " << D << "\n" << f;
    });
  }
}

}  // namespace

TEST(SolidElasticity, StressIsTheGradientOfTheEnergy) {
  expect_stress_is_energy_gradient<3>(0.55, 1.6);
  expect_stress_is_energy_gradient<2>(0.55, 1.6);
}

// det F < 0 for about half of them. Fixed corotated has a crease where two stretches cancel: those are left out.
TEST(SolidElasticity, StressIsTheGradientOfTheEnergyThroughInversion) {
  std::mt19937 rng(12);
  int checked = 0;
  for (int n = 0; n < 300; ++n) {
    Dense<3> f = random_deformation<3>(rng, 0.3, 1.4);
    if (n % 2) f.row(0) *= -1;
    const Eigen::Vector3d s = Eigen::JacobiSVD<Dense<3>>(f).singularValues();
    if (s[1] - s[2] < 0.15) continue;
    ++checked;
    for_all_laws([&](const auto& law, const char* name) {
      if (is_kink<3>(law, f)) return;
      const Dense<3> tau = kirchhoff<3>(law, f), expected = energy_gradient<3>(law, f) * f.transpose();
      EXPECT_LT((tau - expected).norm(), 2e-6 * std::max(expected.norm(), 3e5)) << name << "\n" << f;
    });
  }
  EXPECT_GT(checked, 100);
}

TEST(SolidElasticity, RestHasNeitherEnergyNorStress) {
  for_all_laws([](const auto& law, const char* name) {
    EXPECT_EQ(energy<3>(law, Dense<3>::Identity()), 0) << name;
    EXPECT_EQ(kirchhoff<3>(law, Dense<3>::Identity()).norm(), 0) << name;
    std::mt19937 rng(2);
    const Dense<3> turn = random_rotation<3>(rng);
    EXPECT_LT(kirchhoff<3>(law, turn).norm(), 1e-9) << name;   // of moduli of 3e5
    EXPECT_GT(energy<3>(law, 0.9 * turn), 1) << name;          // a zero would pass anything
  });
}

// Psi(R F) = Psi(F) = Psi(F R), tau(R F) = R tau(F) R^T, tau(F R) = tau(F).
TEST(SolidElasticity, RotationOfSpaceAndOfTheMaterialChangesNothingElse) {
  std::mt19937 rng(13);
  for (int n = 0; n < 100; ++n) {
    const Dense<3> f = random_deformation<3>(rng), r = random_rotation<3>(rng);
    for_all_laws([&](const auto& law, const char* name) {
      const double psi = energy<3>(law, f);
      const Dense<3> tau = kirchhoff<3>(law, f);
      const double scale = std::max(3e5, tau.norm());
      EXPECT_NEAR(energy<3>(law, r * f), psi, 1e-12 * scale) << name;
      EXPECT_NEAR(energy<3>(law, f * r), psi, 1e-12 * scale) << name;
      EXPECT_LT((kirchhoff<3>(law, r * f) - r * tau * r.transpose()).norm(), 1e-12 * scale) << name;
      EXPECT_LT((kirchhoff<3>(law, f * r) - tau).norm(), 1e-12 * scale) << name;
      EXPECT_LT((tau - tau.transpose()).norm(), 1e-12 * scale) << name;
    });
  }
}

// tau -> 2 mu e + lambda tr e, to first order in e.
TEST(SolidElasticity, SmallStrainIsHookesLaw) {
  std::mt19937 rng(14);
  const Dense<3> noise = random_matrix<3>(rng), strain = 1e-6 * (noise + noise.transpose());
  const Dense<3> hooke = 2 * kLame.mu * strain + kLame.lambda * strain.trace() * Dense<3>::Identity();
  ASSERT_GT(hooke.norm(), 0.1);
  const Dense<3> f = Dense<3>::Identity() + strain;
  EXPECT_LT((kirchhoff<3>(FixedCorotated{kLame}, f) - hooke).norm(), 1e-5 * hooke.norm());
  EXPECT_LT((kirchhoff<3>(NeoHookean{kLame}, f) - hooke).norm(), 1e-5 * hooke.norm());
  EXPECT_LT((kirchhoff<3>(Hencky{kLame}, f) - hooke).norm(), 1e-5 * hooke.norm());
}

// Two dimensions are plane strain: the same numbers as a third axis that does not move.
TEST(SolidElasticity, TwoDimensionsArePlaneStrain) {
  std::mt19937 rng(15);
  const Dense<2> f = random_deformation<2>(rng, 0.7, 1.3);
  Dense<3> embedded = Dense<3>::Identity();
  embedded.topLeftCorner<2, 2>() = f;
  for_all_laws([&](const auto& law, const char* name) {
    EXPECT_NEAR(energy<2>(law, f), energy<3>(law, embedded), 1e-8) << name;
    EXPECT_LT((kirchhoff<2>(law, f) - Dense<2>(kirchhoff<3>(law, embedded).template topLeftCorner<2, 2>())).norm(), 1e-7) << name;
  });
}

// V sigma = V0 tau: the Cauchy stress of a block pulled along x is the force on its end over the area it has now.
TEST(SolidElasticity, KirchhoffStressIsCauchyStressTimesTheChangeOfVolume) {
  const Hencky law{kLame};
  const Dense<3> f = Eigen::Vector3d(1.3, 0.9, 0.8).asDiagonal();
  const double step = 1e-6, area = 0.9 * 0.8;   // of a unit cube, now
  Dense<3> longer = f;
  longer(0, 0) += step;
  const double force = (energy<3>(law, longer) - energy<3>(law, f)) / step;
  const double cauchy = kirchhoff<3>(law, f)(0, 0) / f.determinant();
  EXPECT_NEAR(cauchy * area, force, 1e-4 * std::abs(force));
}

// stiffness >= second derivative of the energy along every rank-one change m (F^T n)^T: rho0 c^2 of that wave.
TEST(SolidElasticity, StiffnessBoundsEveryPlaneWave) {
  std::mt19937 rng(16);
  std::uniform_real_distribution<double> u(-1, 1);
  double tightest = 0;
  for (int n = 0; n < 2000; ++n) {
    const Dense<3> f = random_deformation<3>(rng, n % 2 ? 0.3 : 0.9, n % 2 ? 1.9 : 1.1);
    Eigen::Vector3d m(u(rng), u(rng), u(rng)), wave(u(rng), u(rng), u(rng));
    m.normalize(), wave.normalize();
    const Dense<3> along = m * (f.transpose() * wave).transpose();
    for_all_laws([&](const auto& law, const char* name) {
      if (is_kink<3>(law, f)) return;
      constexpr double h = 1e-4;
      const double curvature = (energy<3>(law, f + h * along) - 2 * energy<3>(law, f) + energy<3>(law, f - h * along)) / (h * h);
      const double bound = stiffness_of(law, displacement_gradient<3>(f));
      EXPECT_LT(curvature, bound * 1.0001 + 10) << name << "\n" << f;
      tightest = std::max(tightest, curvature / bound);
    });
  }
  EXPECT_GT(tightest, 0.9);   // no idle bound
}

// Hencky's energy is convex along rank-one changes while all stretches are within [.2116, e^(1/3)] [Bruhns01], whatever Poisson's ratio, and
// beyond that no longer everywhere: pulled along one axis to e, along all three to exp((lambda + 2 mu)/(3 lambda + 2 mu)).
TEST(SolidElasticity, HenckysLawIsEllipticUpToTheCubeRootOfEAndNotFarBeyond) {
  std::mt19937 rng(18);
  std::uniform_real_distribution<double> u(-1, 1), stretch(0.2117, 1.3955);
  for (const double poisson : {0.0, 0.3, 0.45}) {
    const Hencky law{Lame::of(1, poisson)};
    const auto curvature = [&](const Dense<3>& f, const Eigen::Vector3d& m, const Eigen::Vector3d& n) {
      constexpr double h = 1e-3;
      const Dense<3> along = m * (f.transpose() * n).transpose();
      return (energy<3>(law, f + h * along) - 2 * energy<3>(law, f) + energy<3>(law, f - h * along)) / (h * h);
    };
    double least = 1;
    for (int k = 0; k < 20000; ++k) {
      const Dense<3> f = Eigen::Vector3d(stretch(rng), stretch(rng), stretch(rng)).asDiagonal();
      const Eigen::Vector3d m(u(rng), u(rng), u(rng)), n(u(rng), u(rng), u(rng));
      least = std::min(least, curvature(f, m.normalized(), n.normalized()));
    }
    EXPECT_GT(least, 0) << poisson;
    EXPECT_LT(least, 0.2) << poisson;   // near the edge of the domain little is left
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
    const auto at_edge = [&](double edge, const Dense<3>& below, const Dense<3>& above) {
      EXPECT_GT(curvature(below, x, x), 0) << edge;
      EXPECT_LT(curvature(above, x, x), 0) << edge;
    };
    const double e = std::exp(1.0), all = std::exp((law.lame.lambda + 2 * law.lame.mu) / (3 * law.lame.lambda + 2 * law.lame.mu));
    at_edge(e, Eigen::Vector3d(0.99 * e, 1, 1).asDiagonal(), Eigen::Vector3d(1.01 * e, 1, 1).asDiagonal());
    at_edge(all, 0.99 * all * Dense<3>::Identity(), 1.01 * all * Dense<3>::Identity());
  }
}

// At rest the bound is the speed of pressure waves itself.
TEST(SolidElasticity, StiffnessAtRestIsThatOfPressureWaves) {
  const double exact = kLame.lambda + 2 * kLame.mu;
  const Matrix<double, 3> rest = Matrix<double, 3>::zero();
  EXPECT_NEAR(stiffness_of(FixedCorotated{kLame}, rest), exact, 1e-9 * exact);
  EXPECT_NEAR(stiffness_of(Hencky{kLame}, rest), exact, 1e-9 * exact);
  EXPECT_NEAR(stiffness_of(NeoHookean{kLame}, rest), exact, 0.25 * exact);
  EXPECT_NEAR(stiffness_of(Tait{2e5}, rest), 2e5, 1e-9);
}

// Single precision, eight at a time: the same law to its own rounding, small strains included.
TEST(SolidElasticity, LanesAgreeWithDoublePrecision) {
  std::mt19937 rng(17);
  for (int n = 0; n < 300; ++n) {
    const double size = std::pow(10, -(n % 6));
    const Dense<3> f = Dense<3>::Identity() + 0.3 * size * random_matrix<3>(rng);
    Matrix<Lanes, 3> g;
    Matrix<double, 3> same;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) g(i, k) = Lanes(float(f(i, k) - (i == k))), same(i, k) = double(g(i, k)[0]);
    for_all_laws([&](const auto& law, const char* name) {
      const Matrix<Lanes, 3> tau = kirchhoff_of(law, g);
      const Dense<3> exact = dense<3>(kirchhoff_of(law, same));
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(double(tau(i, k)[4]), exact(i, k), 2e-5 * size * 3e5) << name;
    });
  }
}

// Flat, a line, a point, inside out: finite, and the way back is uphill nowhere: energy falls along the line to rest.
TEST(SolidElasticity, CollapsedAndInvertedMatterIsFiniteAndComesBack) {
  const std::vector<Eigen::Vector3d> cases = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, -0.5}, {0.5, 0.5, 0.5}, {-0.3, 1.2, 1}};
  for (const Eigen::Vector3d& s : cases)
    for_all_laws([&](const auto& law, const char* name) {
      const Dense<3> f = s.asDiagonal();
      EXPECT_TRUE(kirchhoff<3>(law, f).allFinite()) << name;
      EXPECT_TRUE(std::isfinite(energy<3>(law, f))) << name;
      const Dense<3> nearer = f + 1e-3 * (Dense<3>::Identity() - f);
      EXPECT_LT(energy<3>(law, nearer), energy<3>(law, f)) << name << " " << s.transpose();
    });
}
