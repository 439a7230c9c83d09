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
    for (int a = 0; a < D; ++a) sum += group.stress[group.row(p)][stress_place<D>(a, a)];
  return sum / Real(D * (end - begin));
}

/// Impulse of the stress of up to eight particles that share their stencil, at its nodes (x, y, z each), added to `sums` lane by lane.
struct StressBatch {
  std::array<std::array<Lanes, 3>, 27> sums;

  void clear() {
    for (auto& node : sums) node.fill(Lanes(0));
  }
  void add(const Group<3, float>& group, std::size_t begin, std::size_t end, float pull) {
    std::array<std::array<Lanes, 3>, 3> weight, slope;   // [axis][node]
    std::array<Lanes, 6> tau;
    tau.fill(Lanes(0));
    for (int a = 0; a < 3; ++a) {
      Lanes x = Lanes(0);
      for (std::size_t p = begin; p < end; ++p) {
        const float t = group.particles.offset[p][a];
        x.set(int(p - begin), t >= 0.5f ? t - 1 : t);
      }
      const Lanes half = Lanes(0.5f), left = half - x, right = half + x;
      weight[std::size_t(a)] = {left * left * half, Lanes(0.75f) - x * x, right * right * half};
      slope[std::size_t(a)] = {x - half, Lanes(-2) * x, x + half};
    }
    for (std::size_t p = begin; p < end; ++p) {
      Stress<3, float> own = group.stress[group.row(p)];
      if (group.averages) {
        const float mean = (own[0] + own[3] + own[5]) / 3;
        own[0] += pull - mean, own[3] += pull - mean, own[5] += pull - mean;
      }
      for (std::size_t k = 0; k < 6; ++k) tau[k].set(int(p - begin), own[k]);
    }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const Lanes both = weight[0][i] * weight[1][j], in_x = slope[0][i] * weight[1][j], in_y = weight[0][i] * slope[1][j];
        const Lanes across[3] = {tau[0] * in_x + tau[1] * in_y, tau[1] * in_x + tau[3] * in_y, tau[2] * in_x + tau[4] * in_y};
        const Lanes along[3] = {tau[2] * both, tau[4] * both, tau[5] * both};
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t c = 0; c < 3; ++c) sums[(i * 3 + j) * 3 + k][c] += across[c] * weight[2][k] + along[c] * slope[2][k];
      }
  }
  /// The sum over lanes, pairwise.
  static float total(Lanes v) { return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])); }
};

/// The fast path of one group in one block: `begin` are the ranges of its nodes.
void add_eight_at_a_time(const Group<3, float>& group, const std::uint32_t* begin, float impulse, NodeSums<3, float>& sums) {
  constexpr int edge = Lattice<3>::kBlock, tile = NodeSums<3, float>::kEdge, size = NodeSums<3, float>::kSize;
  std::array<float, std::size_t(4 * size)> carried{};
  const Particles<3, float>& p = group.particles;
  group.kernels.scatter({.begin = begin, .offset = p.offset.front().data(), .row = p.rows.empty() ? nullptr : p.rows.data(),
                         .coefficients = const_cast<float*>(p.coefficients.data())}, carried.data());
  const float weight = float(group.weight);
  for (std::size_t i = 0; i < std::size_t(size); ++i) {
    sums.mass[i] += weight * carried[i];
    for (std::size_t c = 0; c < 3; ++c) sums.momentum[c][i] += weight * carried[(1 + c) * std::size_t(size) + i];
  }
  StressBatch batch;
  for (int local = 0; local < Lattice<3>::kCellsPerBlock; ++local) {
    const std::size_t first = begin[local], last = begin[local + 1];
    if (first == last) continue;
    const float pull = group.averages ? mean_pull(group, first, last) : 0;
    batch.clear();
    for (std::size_t q = first; q < last; q += Lanes::kWidth) batch.add(group, q, std::min(last, q + Lanes::kWidth), pull);
    const int corner = (local / (edge * edge) * tile + local / edge % edge) * tile + local % edge;   // one node before the home along each axis
    for (int node = 0; node < 27; ++node) {
      const auto at = std::size_t(corner + (node / 9 * tile + node / 3 % 3) * tile + node % 3);
      for (std::size_t c = 0; c < 3; ++c) sums.momentum[c][at] += impulse * StressBatch::total(batch.sums[std::size_t(node)][c]);
    }
  }
}

}  // namespace

template <int D, class Real>
void NodeSums<D, Real>::add(const Group<D, Real>& group, std::size_t group_block, const Cell<D>& block, const Lattice<D>& lattice, double impulse,
                            bool flip) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  const std::uint32_t* const begin = &group.ranges.begin[group_block * per_block];
  if constexpr (D == 3 && std::is_same_v<Real, float>) {
    if (group.kernels.scatter && !flip) return add_eight_at_a_time(group, begin, float(impulse), *this);
  }
  add_plainly(group, begin[0], begin[per_block], block, lattice, impulse, flip);
}

template <int D, class Real>
void NodeSums<D, Real>::add_plainly(const Group<D, Real>& group, std::size_t begin, std::size_t end, const Cell<D>& block, const Lattice<D>& lattice,
                                    double impulse, bool flip) {
  using Basis = QuadraticBasis<Real>;
  constexpr int n = 3;
  using Values = Tensor<Real, n, D>;
  const Particles<D, Real>& particles = group.particles;
  const Real weight = Real(group.weight), factor = Real(impulse);
  std::size_t cell_end = begin;
  Real pull = 0;
  for (std::size_t p = begin; p < end; ++p) {
    if (group.averages && p == cell_end) {
      while (cell_end < end && home_of<D, Real>(particles, cell_end) == home_of<D, Real>(particles, p)) ++cell_end;
      pull = mean_pull(group, p, cell_end);
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
    Stress<D, Real> tau = group.stress[group.row(p)];
    if (group.averages) {
      Real own = 0;
      for (int a = 0; a < D; ++a) own += tau[stress_place<D>(a, a)];
      for (int a = 0; a < D; ++a) tau[stress_place<D>(a, a)] += pull - own / D;
    }
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
    for (std::size_t node = 0; node < w.size(); ++node) mass[place(node)] += weight * w[node];
    for (int c = 0; c < D; ++c) {
      const std::span<const Real> coefficients = particles.component(p, c);
      Values value{};
      for (std::size_t r = 0; r < coefficients.size(); ++r) value[std::size_t(group.scheme.place[r])] = coefficients[r];
      evaluate<D>(stencil, value);
      for (std::size_t node = 0; node < w.size(); ++node) {
        const Real carried = weight * w[node] * value[node];
        Real force = tau[stress_place<D>(c, 0)] * gradient[0][node];
        for (int a = 1; a < D; ++a) force += tau[stress_place<D>(c, a)] * gradient[std::size_t(a)][node];
        momentum[std::size_t(c)][place(node)] += carried + factor * force;
        if (flip) before[std::size_t(c)][place(node)] += carried;
      }
    }
  }
}

template struct NodeSums<2, float>;
template struct NodeSums<2, double>;
template struct NodeSums<3, float>;
template struct NodeSums<3, double>;

}  // namespace sim
