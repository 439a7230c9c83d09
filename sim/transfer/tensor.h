#pragma once
// A particle's polynomial at the nodes of its stencil and back: tensor products of one-dimensional rows, contracted one axis at a
// time (n * n^D multiply-adds an axis instead of n^D * n^D in all).
#include <array>
#include <cstddef>

#include "sim/transfer/basis.h"

namespace sim {

constexpr int int_power(int base, int exponent) { return exponent == 0 ? 1 : base * int_power(base, exponent - 1); }

/// n^D numbers, the last axis fastest: coefficients by multi-index or values by node of the stencil.
template <class Real, int n, int D>
using Tensor = std::array<Real, std::size_t(int_power(n, D))>;

/// Stencil of one particle on one lattice: a basis an axis.
template <class Basis, int D>
using Stencil = std::array<Basis, D>;

/// The bases of a particle, evaluated once and shared by the lattices of a layout: an axis has one for corners and one for middles.
template <class Basis, class Layout>
struct ParticleStencils {
  static constexpr int D = Layout::kDimension;
  std::array<Basis, D> corner, middle;

  template <class Offset>
  ParticleStencils(const std::array<int, D>& cell, const Offset& offset) {
    for (int a = 0; a < D; ++a) {
      corner[a] = Basis(cell[a], offset[a], false);
      if constexpr (Layout::kLattices > 1) middle[a] = Basis(cell[a], offset[a], true);
    }
  }
  Stencil<Basis, D> of(int lattice) const {
    Stencil<Basis, D> s;
    for (int a = 0; a < D; ++a) s[a] = Layout::centred(lattice, a) ? middle[a] : corner[a];
    return s;
  }
};

/// out[.. i ..] = sum_a entry(a, i) in[.. a ..] along one axis, in place.
template <int axis, int D, int n, class Real, class Entry>
inline void contract(Tensor<Real, n, D>& t, const Entry& entry) {
  constexpr int stride = int_power(n, D - 1 - axis), lines = int_power(n, D - 1);
  for (int line = 0; line < lines; ++line) {
    const int start = (line / stride) * stride * n + line % stride;
    Row<Real, n> in, out;
    for (int a = 0; a < n; ++a) in[a] = t[start + a * stride];
    for (int i = 0; i < n; ++i) {
      out[i] = entry(0, i) * in[0];
      for (int a = 1; a < n; ++a) out[i] += entry(a, i) * in[a];
    }
    for (int i = 0; i < n; ++i) t[start + i * stride] = out[i];
  }
}

namespace detail {
template <int axis, int D, class Basis, class T, class Pick>
inline void contract_all(const Stencil<Basis, D>& stencil, T& t, const Pick& pick) {
  if constexpr (axis < D) {
    contract<axis, D, Basis::kNodes, typename Basis::Real>(t, [&](int a, int i) -> const auto& { return pick(stencil[axis], a, i); });
    contract_all<axis + 1, D>(stencil, t, pick);
  }
}
}  // namespace detail

/// Coefficients -> values of the polynomial at the nodes (Q c), in place.
template <int D, class Basis>
inline void evaluate(const Stencil<Basis, D>& stencil, Tensor<typename Basis::Real, Basis::kNodes, D>& t) {
  detail::contract_all<0, D>(stencil, t, [](const Basis& b, int mode, int node) -> const auto& { return b.phi[mode][node]; });
}

/// Node values -> coefficients of all modes (L v), in place.
template <int D, class Basis>
inline void analyse(const Stencil<Basis, D>& stencil, Tensor<typename Basis::Real, Basis::kNodes, D>& t) {
  detail::contract_all<0, D>(stencil, t, [](const Basis& b, int node, int mode) -> const auto& { return b.dual[mode][node]; });
}

/// Weights of the nodes, their product over the axes.
template <int D, class Basis>
inline Tensor<typename Basis::Real, Basis::kNodes, D> weights(const Stencil<Basis, D>& stencil) {
  constexpr int n = Basis::kNodes;
  Tensor<typename Basis::Real, n, D> w;
  for (int node = 0; node < int(w.size()); ++node) {
    int rest = node;
    w[node] = stencil[D - 1].weight[rest % n];
    for (int axis = D - 2; axis >= 0; --axis) {
      rest /= n;
      w[node] = stencil[axis].weight[rest % n] * w[node];
    }
  }
  return w;
}

/// Place of a multi-index in a tensor.
template <int n, int D>
constexpr int tensor_place(const std::array<int, D>& index) {
  int place = 0;
  for (int axis = 0; axis < D; ++axis) place = place * n + index[axis];
  return place;
}

}  // namespace sim
