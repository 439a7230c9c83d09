// The identities of the bases, proved: both sides are polynomials in the offset x of each axis, so rational arithmetic at more offsets
// than the degree decides. Each branch of a basis (corners left and right of the middle, middles) gets twelve offsets, the highest
// degree is ten. Tensors are proved twice: by the rows of one axis and multilinearity, and entry by entry.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <vector>

#include "sim/transfer/modes.h"
#include "sim/transfer/tensor.h"

namespace sim {
namespace {

using Rational = boost::multiprecision::number<boost::multiprecision::cpp_rational_backend, boost::multiprecision::et_off>;

constexpr int kCell = 5;

/// t = 0, 1/count ..
std::vector<Rational> offsets(int count) {
  std::vector<Rational> t;
  for (int k = 0; k < count; ++k) t.push_back(Rational(k, count));
  return t;
}

/// Twelve on either side of 1/2, the degenerate 0 and 1/2 among them.
const std::vector<Rational> kOffsets = offsets(24);

template <class Basis>
void expect_identities() {
  constexpr int n = Basis::kNodes;
  for (const Rational& t : kOffsets)
    for (const bool centred : {false, true}) {
      SCOPED_TRACE(testing::Message() << "t = " << t << (centred ? ", middles" : ", corners"));
      const Basis b(kCell, t, centred);
      // The places of nodes are what the header says: node - particle = w, in cells.
      const Rational shift = centred ? Rational(1, 2) : Rational(0);
      for (int i = 0; i < n; ++i) ASSERT_EQ(b.phi[1][i], b.base + i + shift - (kCell + t));
      // Degree <= 2: the weights sum to 1.
      Rational sum = 0;
      for (const Rational& w : b.weight) {
        ASSERT_GE(w, 0);
        sum += w;
      }
      ASSERT_EQ(sum, 1);
      for (int r = 0; r < n; ++r)
        for (int s = 0; s < n; ++s) {
          Rational product = 0, energy = 0;
          for (int i = 0; i < n; ++i) {
            product += b.dual[r][i] * b.phi[s][i];                  // degree <= 3 + 4: L Q = I
            energy += b.weight[i] * b.phi[r][i] * b.phi[s][i];      // degree <= 2 + 4 + 4: Q^T M Q is diagonal, of the norms
          }
          ASSERT_EQ(product, r == s ? 1 : 0) << r << s;
          ASSERT_EQ(energy, r == s ? b.norm(r) : Rational(0)) << r << s;
        }
    }
}

TEST(Identities, HoldForTheLinearBasis) { expect_identities<LinearBasis<Rational>>(); }

TEST(Identities, HoldForTheQuadraticBasis) { expect_identities<QuadraticBasis<Rational>>(); }

// Q can be inverted at every offset, where Q^T M Q cannot: degree <= 1 and <= 5.
TEST(Identities, TheDeterminantOfTheModesIsConstant) {
  for (const Rational& t : kOffsets)
    for (const bool centred : {false, true}) {
      const auto l = LinearBasis<Rational>(kCell, t, centred).phi;
      ASSERT_EQ(l[0][0] * l[1][1] - l[0][1] * l[1][0], 1);
      const auto q = QuadraticBasis<Rational>(kCell, t, centred).phi;
      Rational det = 0;
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        det += q[0][i] * (q[1][j] * q[2][k] - q[1][k] * q[2][j]);
      }
      ASSERT_EQ(det, 2);
    }
}

// The factorised g is the polynomial of the supplement, degree <= 4, and its norm vanishes at half a cell only, degree <= 6.
TEST(Identities, GIsThePolynomialOfTheSupplement) {
  for (const Rational& t : kOffsets) {
    const QuadraticBasis<Rational> b(kCell, t, true);
    const Rational x = b.x;
    ASSERT_EQ(x, t - Rational(1, 2));
    for (int i = 0; i < 3; ++i) {
      const Rational w = i - 1 - x;
      ASSERT_EQ(b.phi[2][i], w * w - x * (1 - 4 * x * x) * w - Rational(1, 4));
    }
    ASSERT_EQ(b.norm(2), (1 - 4 * x * x) * (1 - 4 * x * x) * (3 - 4 * x * x) / 16);
    ASSERT_EQ(b.norm(2) == 0, x == Rational(-1, 2));
  }
}

/// Rows that hold one 1 each: the mode `mode` is 1 at `node`, everything else is 0.
template <int n>
struct UnitRows {
  using Real = long;
  static constexpr int kNodes = n;
  Row<long, n> weight{};
  std::array<Row<long, n>, n> phi{}, dual{};
  UnitRows() = default;
  UnitRows(int mode, int node) {
    phi[mode][node] = 1;
    dual[mode][node] = 1;
    weight[node] = 1;
  }
};

/// Evaluation, analysis and weights are linear in the rows of each axis and in the tensor. So they are the tensor products of the rows if
/// they are for unit rows and unit tensors: then the identities of one axis, multiplied, are those of D axes.
template <int n, int D>
void expect_tensor_products() {
  constexpr int cases = int_power(n * n, D), size = int_power(n, D);
  for (int which = 0; which < cases; ++which) {
    std::array<int, D> mode, node;
    Stencil<UnitRows<n>, D> stencil;
    for (int a = 0, rest = which; a < D; ++a, rest /= n * n) {
      mode[a] = rest % n, node[a] = rest / n % n;
      stencil[a] = UnitRows<n>(mode[a], node[a]);
    }
    const int from = tensor_place<n, D>(mode), to = tensor_place<n, D>(node);
    const Tensor<long, n, D> w = weights<D>(stencil);
    for (int i = 0; i < size; ++i) {
      Tensor<long, n, D> values{}, coefficients{};
      values[i] = coefficients[i] = 1;
      evaluate<D>(stencil, values);
      analyse<D>(stencil, coefficients);
      for (int j = 0; j < size; ++j) {
        ASSERT_EQ(values[j], i == from && j == to);
        ASSERT_EQ(coefficients[j], i == to && j == from);
      }
      ASSERT_EQ(w[i], i == to);
    }
  }
}

TEST(Identities, TensorsAreProductsOfTheRowsOfTheAxes) {
  expect_tensor_products<2, 2>();
  expect_tensor_products<2, 3>();
  expect_tensor_products<3, 2>();
  expect_tensor_products<3, 3>();
}

/// Degree in an axis' offset of a mode's value there.
constexpr int value_degree(int mode) { return mode == 2 ? 4 : mode; }

/// Q^T M Q and L Q of D axes, from the functions the transfers call, each entry at more offsets an axis than its degree there: 2 + 4 + 4 at
/// most for Q^T M Q, 3 + 4 for L Q. All axes are centred, so that [0, 1) is one branch of the quadratic basis, [1/2, 1) one of the linear.
template <template <class> class Kernel, int D>
void expect_tensor_identities() {
  using Basis = Kernel<Rational>;
  constexpr int n = Basis::kNodes, size = int_power(n, D), offsets = 2 * (n - 1) + (n == 3 ? 7 : 2);   // 11 and 4
  using Values = Tensor<Rational, n, D>;
  const auto indices = [](int place, int base) {
    std::array<int, D> index;
    for (int a = D - 1; a >= 0; --a, place /= base) index[a] = place % base;
    return index;
  };
  // Whether the identity of modes r and s needs the offset number k of axis a.
  const auto needs = [](const auto& k, const auto& r, const auto& s) {
    for (int a = 0; a < D; ++a)
      if (k[a] > n - 1 + value_degree(r[a]) + value_degree(s[a])) return false;
    return true;
  };
  std::array<int, D> highest;
  highest.fill(n - 1);
  int entries = 0;
  for (int which = 0; which < int_power(offsets, D); ++which) {
    const std::array<int, D> k = indices(which, offsets);
    Stencil<Basis, D> stencil;
    for (int a = 0; a < D; ++a) stencil[a] = Basis(0, n == 3 ? Rational(k[a], offsets) : Rational(offsets + k[a], 2 * offsets), true);
    const Values w = weights<D>(stencil);
    std::vector<Values> q(std::size_t(size), Values{});
    for (int r = 0; r < size; ++r) {
      if (!needs(k, indices(r, n), highest)) continue;
      Values& v = q[std::size_t(r)];
      v[std::size_t(r)] = 1;
      evaluate<D>(stencil, v);
      for (int s = 0; s <= r; ++s) {
        if (!needs(k, indices(r, n), indices(s, n))) continue;
        Rational energy = 0, norm = r == s ? 1 : 0;
        for (int i = 0; i < size; ++i) energy += w[std::size_t(i)] * v[std::size_t(i)] * q[std::size_t(s)][std::size_t(i)];
        for (int a = 0; a < D; ++a) norm *= stencil[a].norm(indices(r, n)[a]);
        ASSERT_EQ(energy, norm) << r << ' ' << s;
        ++entries;
      }
      if (*std::max_element(k.begin(), k.end()) > 7) continue;
      Values c = v;
      analyse<D>(stencil, c);
      for (int s = 0; s < size; ++s) ASSERT_EQ(c[std::size_t(s)], r == s ? 1 : 0);
    }
  }
  EXPECT_GT(entries, int_power(offsets, D));
}

TEST(Identities, HoldForTensorsOfTheLinearKernel) {
  expect_tensor_identities<LinearBasis, 2>();
  expect_tensor_identities<LinearBasis, 3>();
}

TEST(Identities, HoldForTensorsOfTheQuadraticKernelInThePlane) { expect_tensor_identities<QuadraticBasis, 2>(); }

TEST(Identities, HoldForTensorsOfTheQuadraticKernelInSpace) { expect_tensor_identities<QuadraticBasis, 3>(); }

}  // namespace
}  // namespace sim
