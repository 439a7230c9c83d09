// P2G of solids: mass, momentum and the impulse of stress.
#include <algorithm>

#include "sim/solid/step.h"
#include "sim/transfer/basis.h"
#include "sim/transfer/tensor.h"

namespace sim {
namespace {

/// Mean of tr tau / D over particles: what volume averaging makes of each one's own.
template <int D, class Real>
Real mean_pull(const Group<D, Real>& group, std::size_t begin, std::size_t end) {
  Real sum = 0;
  for (std::size_t p = begin; p < end; ++p)
    for (int a = 0; a < D; ++a) sum += group.stress[group.particles.row_of(p)][stress_place<D>(a, a)];
  return sum / Real(D * (end - begin));
}

/// Stress of particle p with `pull` for its own mean.
template <int D, class Real>
Stress<D, Real> averaged_stress(const Group<D, Real>& group, std::size_t p, Real pull) {
  Stress<D, Real> tau = group.stress[group.particles.row_of(p)];
  Real own = 0;
  for (int a = 0; a < D; ++a) own += tau[stress_place<D>(a, a)];
  for (int a = 0; a < D; ++a) tau[stress_place<D>(a, a)] += pull - own / D;
  return tau;
}

/// The fast path of one group in one block: `begin` are the ranges of its nodes.
void add_fast(const Group<3, float>& group, const std::uint32_t* begin, float impulse, NodeSums<3, float>& sums) {
  constexpr int size = NodeSums<3, float>::kSize, per_block = Lattice<3>::kCellsPerBlock;
  std::array<float, std::size_t(4 * size + lanes::kTileSlack)> carried;
  const Particles<3, float>& p = group.particles;
  const float weight = float(group.weight), factor = impulse / weight;
  float* const coefficients = const_cast<float*>(p.coefficients.data());   // a scatter only reads them
  const lanes::Block block{.begin = begin, .offset = p.offset.front().data(),
                           .row = p.rows.empty() ? nullptr : p.rows.data(), .coefficients = coefficients};
  if (!group.averages) {
    group.kernels.scatter(block, {.row = group.stress.front().data(), .factor = factor}, carried.data());
  } else {   // the block's own stress, its coefficients beside it in the same order
    const std::size_t first = begin[0], count = begin[per_block] - first, width = p.row();
    std::array<std::uint32_t, std::size_t(per_block + 1)> local;
    std::vector<Stress<3, float>> stress(count);
    std::vector<float> rows(count * width);
    for (std::size_t k = 0; k < local.size(); ++k) local[k] = std::uint32_t(begin[k] - first);
    for (std::size_t k = 0; k < per_block; ++k) {
      if (begin[k] == begin[k + 1]) continue;
      const float pull = mean_pull(group, begin[k], begin[k + 1]);
      for (std::size_t q = begin[k]; q < begin[k + 1]; ++q) {
        stress[q - first] = averaged_stress(group, q, pull);
        std::copy_n(coefficients + p.row_of(q) * width, width, &rows[(q - first) * width]);
      }
    }
    group.kernels.scatter({.begin = local.data(), .offset = p.offset[first].data(), .row = nullptr,
                           .coefficients = rows.data()},
                          {.row = stress.front().data(), .factor = factor}, carried.data());
  }
  for (std::size_t i = 0; i < sums.carried.size(); ++i) sums.carried[i] += weight * carried[i];
}

}  // namespace

template <int D, class Real>
void NodeSums<D, Real>::add(const Group<D, Real>& group, std::size_t group_block, const Cell<D>& block, const Lattice<D>& lattice, double impulse) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  const std::uint32_t* const begin = &group.ranges.begin[group_block * per_block];
  if constexpr (D == 3 && std::is_same_v<Real, float>) {
    if (group.kernels.scatter && !group.scheme.flip) return add_fast(group, begin, float(impulse), *this);
  }
  add_plainly(group, begin, block, lattice, impulse);
}

template <int D, class Real>
void NodeSums<D, Real>::add_plainly(const Group<D, Real>& group, const std::uint32_t* begin, const Cell<D>& block, const Lattice<D>& lattice, double impulse) {
  using Basis = QuadraticBasis<Real>;
  constexpr int n = 3;
  using Values = Tensor<Real, n, D>;
  const Particles<D, Real>& particles = group.particles;
  const Real weight = Real(group.weight), factor = Real(impulse);
  const std::size_t end = begin[Lattice<D>::kCellsPerBlock];
  const std::uint32_t* node_end = begin;
  Real pull = 0;
  for (std::size_t p = begin[0]; p < end; ++p) {
    if (group.averages && p == *node_end) {
      while (*node_end <= p) ++node_end;
      pull = mean_pull(group, p, *node_end);
    }
    Stencil<Basis, D> stencil;
    std::array<Row<Real, n>, D> slope;   // of the weights
    std::size_t first = 0;
    for (int a = 0; a < D; ++a) {
      stencil[a] = Basis(particles.cell[p][a], particles.offset[p][a], false);
      const Real x = stencil[a].x, half = Real(0.5);
      slope[a] = {x - half, -2 * x, x + half};
      int home = stencil[a].base + 1 - block[a] * Lattice<D>::kBlock;
      if (home >= Lattice<D>::kBlock) home -= lattice.cells[a];   // beyond the end of a periodic axis: the first node's block has it
      first = first * kEdge + std::size_t(home);
    }
    const Stress<D, Real> tau = group.averages ? averaged_stress(group, p, pull) : group.stress[particles.row_of(p)];
    const Values w = weights<D>(stencil);
    std::array<Values, D> gradient;
    for (std::size_t node = 0; node < w.size(); ++node)
      for (int a = 0; a < D; ++a) {
        Real product = 1;
        for (int b = D - 1, rest = int(node); b >= 0; --b, rest /= n) {
          const auto k = std::size_t(rest % n);
          product *= b == a ? slope[b][k] : stencil[b].weight[k];
        }
        gradient[std::size_t(a)][node] = product;
      }
    const auto place = [&](std::size_t node) {
      if constexpr (D == 2) return first + node / 3 * kEdge + node % 3;
      else return first + (node / 9 * kEdge + node / 3 % 3) * kEdge + node % 3;
    };
    for (std::size_t node = 0; node < w.size(); ++node) carried[place(node) * (D + 1)] += weight * w[node];
    if (group.scheme.flip)
      for (std::size_t node = 0; node < w.size(); ++node) before[place(node) * (D + 1)] += weight * w[node];
    for (int c = 0; c < D; ++c) {
      const auto coefficients = particles.component(p, c);
      Values value{};
      for (std::size_t r = 0; r < coefficients.size(); ++r) value[std::size_t(group.scheme.place[r])] = coefficients[r];
      evaluate<D>(stencil, value);
      for (std::size_t node = 0; node < w.size(); ++node) {
        const Real own = weight * w[node] * value[node];
        Real force = tau[stress_place<D>(c, 0)] * gradient[0][node];
        for (int a = 1; a < D; ++a) force += tau[stress_place<D>(c, a)] * gradient[std::size_t(a)][node];
        carried[place(node) * (D + 1) + 1 + std::size_t(c)] += own + factor * force;
        if (group.scheme.flip) before[place(node) * (D + 1) + 1 + std::size_t(c)] += own;
      }
    }
  }
}

template struct NodeSums<2, float>;
template struct NodeSums<2, double>;
template struct NodeSums<3, float>;
template struct NodeSums<3, double>;

}  // namespace sim
