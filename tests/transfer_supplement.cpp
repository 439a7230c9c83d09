// The lists of the PolyPIC supplement, typed in as printed but for its errata: basis functions [PolyPIC S1], their norms and the formulas
// from grid to particle [PolyPIC S2], by number. Each equals, in the corrected order of sim/transfer/modes.h, the tensor product that the
// transfers use; what is printed wrong does not. Both sides are polynomials: of degree <= 4 an axis (modes, coefficients), compared at five
// offsets an axis, or 6 (norms), at seven.
#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>

#include <array>
#include <functional>

#include "sim/transfer/modes.h"
#include "sim/transfer/tensor.h"

namespace sim {
namespace {

using Rational = boost::multiprecision::number<boost::multiprecision::cpp_rational_backend, boost::multiprecision::et_off>;

const Rational h(3, 2);   // Delta x: not 1, so that a wrong power shows
const Rational h2 = h * h, h4 = h2 * h2, h6 = h4 * h2;

/// The letters of the supplement for a particle and a node k of its stencil; index 1, 2, 3 are the axes.
struct Letters {
  Rational N1, N2, N3 = 1;   // weights
  Rational w1, w2, w3 = 0;   // x_i - x_p
  Rational g1, g2, g3 = 0;
  Rational p1, p2, p3 = 1;   // (-2)^((i-1) mod 2) for i = 1, 2, 3
};

/// x_p from the middle node [cells]; node 0, 1 or 2.
void write(const Rational& x, int node, Rational& N, Rational& w, Rational& g, Rational& p) {
  const Rational xp = h * x;
  w = (node - 1) * h - xp;
  g = w * w - xp * (h2 - 4 * xp * xp) / h2 * w - h2 / 4;
  const Rational weight[] = {(Rational(1, 2) - x) * (Rational(1, 2) - x) / 2, Rational(3, 4) - x * x, (x + Rational(1, 2)) * (x + Rational(1, 2)) / 2};
  N = weight[node];
  p = node == 1 ? -2 : 1;
}

using Formula = std::function<Rational(const Letters&)>;
#define FORMULA(expression) []([[maybe_unused]] const Letters& k) -> Rational { return expression; }

const std::array<Formula, 9> kBasis2 = {
    FORMULA(1), FORMULA(k.w1), FORMULA(k.w2), FORMULA(k.w1 * k.w2), FORMULA(k.g1), FORMULA(k.g2), FORMULA(k.g1 * k.w2), FORMULA(k.g2 * k.w1),
    FORMULA(k.g1 * k.g2)};

const std::array<Formula, 9> kCoefficient2 = {
    FORMULA(k.N1 * k.N2),
    FORMULA(k.N1 * k.N2 * k.w1 / (h2 / 4)),
    FORMULA(k.N1 * k.N2 * k.w2 / (h2 / 4)),
    FORMULA(k.N1 * k.N2 * k.w1 * k.w2 / (h4 / 16)),
    FORMULA(k.N2 * k.p1 / (2 * h2)),
    FORMULA(k.N1 * k.p2 / (2 * h2)),
    FORMULA(2 * k.w2 * k.N2 * k.p1 / h4),   // erratum
    FORMULA(2 * k.w1 * k.N1 * k.p2 / h4),   // erratum
    FORMULA(k.p1 * k.p2 / (4 * h4))};

const Formula kPrinted2Coefficient7 = FORMULA(2 * k.w1 * k.N2 * k.p2 / h4), kPrinted2Coefficient8 = FORMULA(2 * k.w2 * k.N1 * k.p1 / h4);

const std::array<Formula, 27> kBasis3 = {
    FORMULA(1), FORMULA(k.w1), FORMULA(k.w2), FORMULA(k.w3), FORMULA(k.w1 * k.w2), FORMULA(k.w1 * k.w3), FORMULA(k.w2 * k.w3),
    FORMULA(k.w1 * k.w2 * k.w3), FORMULA(k.g1), FORMULA(k.g2), FORMULA(k.g3), FORMULA(k.g1 * k.g2),
    FORMULA(k.g1 * k.g3),   // erratum
    FORMULA(k.g2 * k.g3),   // erratum
    FORMULA(k.g1 * k.g2 * k.g3), FORMULA(k.g1 * k.w2), FORMULA(k.g1 * k.w3), FORMULA(k.g1 * k.w2 * k.w3), FORMULA(k.g2 * k.w1), FORMULA(k.g2 * k.w3),
    FORMULA(k.g2 * k.w1 * k.w3), FORMULA(k.g3 * k.w1), FORMULA(k.g3 * k.w2), FORMULA(k.g3 * k.w1 * k.w2), FORMULA(k.g1 * k.g2 * k.w3),
    FORMULA(k.g1 * k.g3 * k.w2), FORMULA(k.g2 * k.g3 * k.w1)};

const Formula kPrinted3Basis13 = FORMULA(k.g2 * k.g3), kPrinted3Basis14 = FORMULA(k.g1 * k.g3);

const std::array<Formula, 27> kCoefficient3 = {
    FORMULA(k.N1 * k.N2 * k.N3),
    FORMULA(k.N1 * k.N2 * k.N3 * k.w1 / (h2 / 4)),
    FORMULA(k.N1 * k.N2 * k.N3 * k.w2 / (h2 / 4)),
    FORMULA(k.N1 * k.N2 * k.N3 * k.w3 / (h2 / 4)),
    FORMULA(k.N1 * k.N2 * k.N3 * k.w1 * k.w2 / (h4 / 16)),
    FORMULA(k.N1 * k.N2 * k.N3 * k.w1 * k.w3 / (h4 / 16)),   // erratum
    FORMULA(k.N1 * k.N2 * k.N3 * k.w2 * k.w3 / (h4 / 16)),   // erratum
    FORMULA(k.N1 * k.N2 * k.N3 * k.w1 * k.w2 * k.w3 / (h6 / 64)),
    FORMULA(k.N2 * k.N3 * k.p1 / (2 * h2)),
    FORMULA(k.N1 * k.N3 * k.p2 / (2 * h2)),
    FORMULA(k.N1 * k.N2 * k.p3 / (2 * h2)),
    FORMULA(k.N3 * k.p1 * k.p2 / (4 * h4)),
    FORMULA(k.N2 * k.p1 * k.p3 / (4 * h4)),
    FORMULA(k.N1 * k.p2 * k.p3 / (4 * h4)),
    FORMULA(k.p1 * k.p2 * k.p3 / (8 * h6)),
    FORMULA(k.N2 * k.N3 * k.w2 * k.p1 / (h4 / 2)),
    FORMULA(k.N2 * k.N3 * k.w3 * k.p1 / (h4 / 2)),
    FORMULA(k.N2 * k.N3 * k.w2 * k.w3 * k.p1 / (h6 / 8)),
    FORMULA(k.N1 * k.N3 * k.w1 * k.p2 / (h4 / 2)),
    FORMULA(k.N1 * k.N3 * k.w3 * k.p2 / (h4 / 2)),
    FORMULA(k.N1 * k.N3 * k.w1 * k.w3 * k.p2 / (h6 / 8)),
    FORMULA(k.N1 * k.N2 * k.w1 * k.p3 / (h4 / 2)),
    FORMULA(k.N1 * k.N2 * k.w2 * k.p3 / (h4 / 2)),
    FORMULA(k.N1 * k.N2 * k.w1 * k.w2 * k.p3 / (h6 / 8)),
    FORMULA(k.N3 * k.w3 * k.p1 * k.p2 / h6),
    FORMULA(k.N2 * k.w2 * k.p1 * k.p3 / h6),
    FORMULA(k.N1 * k.w1 * k.p2 * k.p3 / h6)};

const Formula kPrinted3Coefficient6 = FORMULA(k.N1 * k.N2 * k.N3 * k.w2 * k.w3 / (h4 / 16)),
              kPrinted3Coefficient7 = FORMULA(k.N1 * k.N2 * k.N3 * k.w1 * k.w3 / (h4 / 16));
#undef FORMULA

/// The norms of [PolyPIC S1.2], 3-D, for m_p = 1; x, y, z are offsets in units of length.
std::array<Rational, 27> printed_norms(const Rational& x, const Rational& y, const Rational& z) {
  const auto square = [](const Rational& r) -> Rational { return r * r; };
  const Rational X = square(h2 - 4 * x * x) * (3 * h2 - 4 * x * x), Y = square(h2 - 4 * y * y) * (3 * h2 - 4 * y * y),
                 Z = square(h2 - 4 * z * z) * (3 * h2 - 4 * z * z);
  const auto both = [&](const Rational& r) -> Rational { return (3 * h2 - 4 * r * r) * square(h * h2 - 4 * h * r * r) / 256; };
  return {1, h2 / 4, h2 / 4, h2 / 4, h4 / 16, h4 / 16, h4 / 16, h6 / 64,
          X / (16 * h2), Y / (16 * h2), Z / (16 * h2), X * Y / (256 * h4), X * Z / (256 * h4), Y * Z / (256 * h4), X * Y * Z / (4096 * h6),
          X / 64, X / 64, both(x), Y / 64, Y / 64, both(y), Z / 64, Z / 64, both(z),
          X * Y / (1024 * h2), X * Z / (1024 * h2), Y * Z / (1024 * h2)};
}

template <int D>
struct Particle {
  Stencil<QuadraticBasis<Rational>, D> stencil;
  std::vector<Letters> node;   // the last axis fastest
};

/// A particle with the offset t - 1/2 [cells] an axis.
template <int D>
Particle<D> particle_at(const std::array<Rational, D>& t) {
  Particle<D> p;
  p.node.resize(std::size_t(int_power(3, D)));
  for (int a = 0; a < D; ++a) p.stencil[a] = QuadraticBasis<Rational>(0, t[a], true);
  for (std::size_t i = 0; i < p.node.size(); ++i) {
    Letters& k = p.node[i];
    const int at = int(i);
    if constexpr (D == 2) {
      write(p.stencil[0].x, at / 3, k.N1, k.w1, k.g1, k.p1);
      write(p.stencil[1].x, at % 3, k.N2, k.w2, k.g2, k.p2);
    } else {
      write(p.stencil[0].x, at / 9, k.N1, k.w1, k.g1, k.p1);
      write(p.stencil[1].x, at / 3 % 3, k.N2, k.w2, k.g2, k.p2);
      write(p.stencil[2].x, at % 3, k.N3, k.w3, k.g3, k.p3);
    }
  }
  return p;
}

template <int D>
using Values = Tensor<Rational, 3, D>;

/// The transfers' mode as it stands at the nodes, and the row that reads its coefficient, in the units of the supplement.
template <int D>
struct Mode {
  Values<D> phi, dual;
};

/// h^degree: a mode in units of length against one in cells.
template <int D>
Rational unit_of(const ModeIndex<D>& mode) {
  Rational unit = 1;
  for (const int index : mode)
    for (int k = 0; k < index; ++k) unit *= h;
  return unit;
}

template <int D>
std::vector<Mode<D>> modes_at(const Particle<D>& p) {
  const std::size_t nodes = p.node.size();
  std::vector<Values<D>> analysed(nodes);   // of each unit field, all coefficients
  for (std::size_t i = 0; i < nodes; ++i) {
    analysed[i].fill(0);
    analysed[i][i] = 1;
    analyse<D>(p.stencil, analysed[i]);
  }
  std::vector<Mode<D>> modes;
  for (const ModeIndex<D>& index : ordered_modes<D>(2)) {
    const Rational unit = unit_of<D>(index);
    Mode<D> m;
    const auto place = std::size_t(tensor_place<3, D>(index));
    m.phi.fill(0);
    m.phi[place] = unit;
    evaluate<D>(p.stencil, m.phi);
    for (std::size_t i = 0; i < nodes; ++i) m.dual[i] = analysed[i][place] / unit;
    modes.push_back(m);
  }
  return modes;
}

template <int D>
bool equals(const Formula& formula, const Particle<D>& p, const Values<D>& values) {
  for (std::size_t i = 0; i < p.node.size(); ++i)
    if (formula(p.node[i]) != values[i]) return false;
  return true;
}

/// Calls body with all offsets 0, 1/count .. of each axis.
template <int D, class Body>
void for_offsets(int count, const Body& body) {
  for (int all = 0; all < int_power(count, D); ++all) {
    std::array<Rational, D> t;
    for (int a = 0, rest = all; a < D; ++a, rest /= count) t[a] = Rational(rest % count, count);
    body(t);
  }
}

TEST(Supplement, ListsTheNineModesAndCoefficientsOfTwoDimensions) {
  for_offsets<2>(5, [](const std::array<Rational, 2>& t) {
    const Particle<2> p = particle_at<2>(t);
    const auto modes = modes_at<2>(p);
    for (std::size_t r = 0; r < 9; ++r) {
      ASSERT_TRUE(equals<2>(kBasis2[r], p, modes[r].phi)) << "s" << r + 1;
      ASSERT_TRUE(equals<2>(kCoefficient2[r], p, modes[r].dual)) << "c" << r + 1;
    }
  });
}

TEST(Supplement, ListsTheTwentySevenModesAndCoefficientsOfThreeDimensions) {
  for_offsets<3>(5, [](const std::array<Rational, 3>& t) {
    const Particle<3> p = particle_at<3>(t);
    const auto modes = modes_at<3>(p);
    for (std::size_t r = 0; r < 27; ++r) {
      ASSERT_TRUE(equals<3>(kBasis3[r], p, modes[r].phi)) << "s" << r + 1;
      ASSERT_TRUE(equals<3>(kCoefficient3[r], p, modes[r].dual)) << "c" << r + 1;
    }
  });
}

TEST(Supplement, ListsTheTwentySevenNormsOfThreeDimensions) {
  const auto modes = ordered_modes<3>(2);
  for_offsets<3>(7, [&](const std::array<Rational, 3>& t) {
    std::array<QuadraticBasis<Rational>, 3> b;
    for (int a = 0; a < 3; ++a) b[a] = QuadraticBasis<Rational>(0, t[a], true);
    const auto norms = printed_norms(h * b[0].x, h * b[1].x, h * b[2].x);
    for (std::size_t r = 0; r < 27; ++r) ASSERT_EQ(norms[r], unit_of<3>(modes[r]) * unit_of<3>(modes[r]) * b[0].norm(modes[r][0]) * b[1].norm(modes[r][1]) * b[2].norm(modes[r][2])) << r + 1;
  });
}

// As printed, c7 and c8 of two dimensions are the coefficients of no mode at any offset.
TEST(Supplement, PrintsCoefficientsSevenAndEightOfTwoDimensionsWrong) {
  for_offsets<2>(5, [](const std::array<Rational, 2>& t) {
    const Particle<2> p = particle_at<2>(t);
    for (const Mode<2>& m : modes_at<2>(p)) {
      ASSERT_FALSE(equals<2>(kPrinted2Coefficient7, p, m.dual));
      ASSERT_FALSE(equals<2>(kPrinted2Coefficient8, p, m.dual));
    }
  });
}

// As printed, c6 is the coefficient of s7 and c7 that of s6; s13 has the norm and the coefficient numbered 14, and s14 those numbered 13.
TEST(Supplement, SwapsTwoPairsOfThreeDimensions) {
  const Particle<3> p = particle_at<3>({Rational(1, 7), Rational(2, 7), Rational(4, 7)});
  const auto modes = modes_at<3>(p);
  EXPECT_FALSE(equals<3>(kPrinted3Coefficient6, p, modes[5].dual));
  EXPECT_FALSE(equals<3>(kPrinted3Coefficient7, p, modes[6].dual));
  EXPECT_TRUE(equals<3>(kPrinted3Coefficient6, p, modes[6].dual));
  EXPECT_TRUE(equals<3>(kPrinted3Coefficient7, p, modes[5].dual));
  EXPECT_FALSE(equals<3>(kPrinted3Basis13, p, modes[12].phi));
  EXPECT_FALSE(equals<3>(kPrinted3Basis14, p, modes[13].phi));
  EXPECT_TRUE(equals<3>(kPrinted3Basis13, p, modes[13].phi));
  EXPECT_TRUE(equals<3>(kPrinted3Basis14, p, modes[12].phi));
  const auto norm = [&](const Formula& s) {
    Rational sum = 0;
    for (const Letters& k : p.node) sum += k.N1 * k.N2 * k.N3 * s(k) * s(k);
    return sum;
  };
  const auto norms = printed_norms(h * p.stencil[0].x, h * p.stencil[1].x, h * p.stencil[2].x);
  EXPECT_NE(norm(kPrinted3Basis13), norms[12]);
  EXPECT_NE(norm(kPrinted3Basis14), norms[13]);
  EXPECT_EQ(norm(kPrinted3Basis13), norms[13]);
  EXPECT_EQ(norm(kPrinted3Basis14), norms[12]);
}

// The other zero the supplement gives the norm of g, sqrt(3)/2 of a cell from the middle node, lies outside the stencil.
TEST(Supplement, TheNormOfGVanishesOnlyAtHalfACell) {
  for (int k = 0; k < 32; ++k) {
    const QuadraticBasis<Rational> b(0, Rational(k, 32), true);
    EXPECT_EQ(b.norm(2) == 0, k == 0);
    EXPECT_GT(3 - 4 * b.x * b.x, 0);
  }
}

}  // namespace
}  // namespace sim
