// G2P of solids and what follows for each particle: motion, deformation, stress, carry.
#include <algorithm>
#include <cmath>

#include "sim/solid/step.h"
#include "sim/transfer/basis.h"
#include "sim/transfer/carry.h"
#include "sim/transfer/tensor.h"

namespace sim {
namespace {

constexpr double kFarPush = 0.25;       // [cells] where a particle's polynomial is no longer about the place it was fitted at
constexpr double kTooFar = 2;           // [cells] in one step: no dt that was chosen allows it
// What is loose or strongly stretched gets two thirds of the step of a continuum: its speed of sound counts half as much again.
constexpr double kLooseFactor = 1.5;
constexpr double kStretched = 1.5 * 1.5 - 1, kSquashed = 0.6;

/// T that laws work with: eight particles at a time in single precision.
template <class Real>
using LawNumber = std::conditional_t<std::is_same_v<Real, float>, Lanes, double>;

/// Factors by bent axes, a bit each, that keep the energy of modes with a g factor from growing.
template <int D, class Real>
std::array<Real, std::size_t(1 << D)> limiting_factors(const Stencil<QuadraticBasis<Real>, D>& before, const Stencil<QuadraticBasis<Real>, D>& now) {
  std::array<Real, std::size_t(1 << D)> factor;
  for (unsigned bent = 0; bent < factor.size(); ++bent) {
    Real product_before = 1, product_now = 1;
    for (int a = 0; a < D; ++a)
      if (bent >> a & 1) product_before *= root_norm_of_g(before[a].x), product_now *= root_norm_of_g(now[a].x);
    factor[bent] = bent == 0 ? Real(1) : limited_factor(product_before, product_now);
  }
  return factor;
}

template <int D, class Real>
Stencil<QuadraticBasis<Real>, D> stencil_at(const Cell<D>& cell, const Vec<D, Real>& offset) {
  Stencil<QuadraticBasis<Real>, D> s;
  for (int a = 0; a < D; ++a) s[a] = QuadraticBasis<Real>(cell[a], offset[a], false);
  return s;
}

/// A block's particles while they gather: the change of deformation dt grad v of each, and whether it is loose.
template <int D, class Real>
struct Changes {
  std::vector<Matrix<Real, D>> change;
  std::vector<std::uint8_t> loose;
};

/// Deformation of particles [begin, end) of the group by `changes`; returns the speeds of sound.
template <int D, class Real, class Law>
StepLimits deform(const Law& law, Group<D, Real>& group, std::size_t begin, std::size_t end, const Changes<D, Real>& changes, std::int64_t& held) {
  using T = LawNumber<Real>;
  constexpr int W = NumberTraits<T>::kWidth;
  T fastest = T(0), fastest_loose = T(0);   // stiffness [Pa]
  for (std::size_t p = begin; p < end; p += W) {
    const int used = int(std::min<std::size_t>(W, end - p));
    Matrix<T, D> change = Matrix<T, D>::zero();
    Deformation<T, D> state{Matrix<T, D>::zero(), T(0)};
    T loose = T(0), counts = T(0);
    for (int l = 0; l < used; ++l) {
      const std::size_t k = p - begin + std::size_t(l);
      const Deformation<Real, D>& from = group.deformation[group.row(p + std::size_t(l))];
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          set_lane(change(i, j), l, changes.change[k](i, j));
          set_lane(state.gradient(i, j), l, from.gradient(i, j));
        }
      set_lane(state.state, l, from.state);
      set_lane(loose, l, Real(changes.loose[k]));
      set_lane(counts, l, Real(1));
    }
    const Response<T, D> r = law.template respond<T, D>(change, state);
    const Matrix<T, D> b = left_strain(state.gradient);
    const auto stretched = either(largest_entry(b) > constant<T>(kStretched), volume_change(state.gradient) < constant<T>(kSquashed - 1));
    const auto is_loose = either(loose > T(0), stretched);
    fastest = larger(fastest, select(counts > T(0), r.stiffness, T(0)));
    fastest_loose = larger(fastest_loose, select(both(is_loose, counts > T(0)), r.stiffness, T(0)));
    for (int l = 0; l < used; ++l) {
      const std::size_t row = group.row(p + std::size_t(l));
      Deformation<Real, D>& to = group.deformation[row];
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          to.gradient(i, j) = lane(state.gradient(i, j), l);
          if (i <= j) group.stress[row][stress_place<D>(i, j)] = lane(r.stress(i, j), l);
        }
      to.state = lane(state.state, l);
      held += lane(r.held, l);
    }
  }
  StepLimits limits;
  for (int l = 0; l < W; ++l) {
    limits.wave_speed = std::max(limits.wave_speed, std::sqrt(double(lane(fastest, l)) / group.density));
    limits.loose_speed = std::max(limits.loose_speed, kLooseFactor * std::sqrt(double(lane(fastest_loose, l)) / group.density));
  }
  return limits;
}

/// Replaces each particle's change of volume by the mean of those nearest to the same node.
template <int D, class Real>
void average_volume(const Particles<D, Real>& particles, std::size_t begin, std::size_t end, std::vector<Matrix<Real, D>>& change) {
  const auto trace = [](const Matrix<Real, D>& m) {
    Real sum = 0;
    for (int a = 0; a < D; ++a) sum += m(a, a);
    return sum;
  };
  for (std::size_t p = begin; p < end;) {
    std::size_t last = p;
    Real sum = 0;
    for (; last < end && home_of<D, Real>(particles, last) == home_of<D, Real>(particles, p); ++last) sum += trace(change[last - begin]);
    const Real mean = sum / Real(last - p);
    for (; p < last; ++p) {
      const Real difference = (mean - trace(change[p - begin])) / D;
      for (int a = 0; a < D; ++a) change[p - begin](a, a) += difference;
    }
  }
}

}  // namespace

void StepLimits::take(const StepLimits& o) {
  wave_speed = std::max(wave_speed, o.wave_speed), loose_speed = std::max(loose_speed, o.loose_speed), speed = std::max(speed, o.speed);
}

void SolidCounts::add(const SolidCounts& o) {
  pushed_out += o.pushed_out, dropped_modes += o.dropped_modes, limited_modes += o.limited_modes, light_nodes += o.light_nodes, held += o.held;
}

namespace {

/// One particle: what it reads from its stencil, and where it goes.
template <int D, class Real>
struct Gathered {
  static constexpr int n = 3;
  Cell<D> cell;                      // where it is
  Vec<D, Real> offset;
  Vec<D, Real> velocity;             // of the grid at its place [m/s]
  Matrix<Real, D> gradient;          // of the velocity [m/s a cell]
  bool loose = false, beside_light = false;

  Gathered() = default;
  Gathered(const BlockGather<D, Real>& g, Group<D, Real>& group, std::size_t p)
      : cell(group.particles.cell[p]), offset(group.particles.offset[p]) {
    const Stencil<QuadraticBasis<Real>, D> stencil = stencil_at<D, Real>(cell, offset);
    Cell<D> first;
    for (int a = 0; a < D; ++a) first[a] = stencil[a].base;
    const auto at = g.blocks.template places<n>(first);
    const auto w = weights<D>(stencil);
    Real mass = 0, lightest = std::numeric_limits<Real>::max();
    for (std::size_t node = 0; node < w.size(); ++node) {
      const Real m = value_at(g.grid.mass, at[node], Real(0));
      mass += m;
      lightest = std::min(lightest, m);
    }
    loose = mass <= Real(1.001 * group.weight);   // nobody else reaches its nodes
    beside_light = lightest < Real(kLightNode * group.weight);
    for (int c = 0; c < D; ++c) {
      Tensor<Real, n, D> value;
      for (std::size_t node = 0; node < value.size(); ++node) value[node] = at[node] < 0 ? Real(0) : g.grid.velocity[std::size_t(at[node])][c];
      Real then = 0;
      if (group.scheme.flip)
        for (std::size_t node = 0; node < value.size(); ++node) then += w[node] * (at[node] < 0 ? Real(0) : g.before[std::size_t(at[node])][c]);
      analyse<D>(stencil, value);
      velocity[c] = value[0];
      for (int a = 0; a < D; ++a) {   // the kernel's slope is (dual of w) - x (1 - 4 x^2) (dual of g)
        const int step = int_power(n, D - 1 - a);
        const Real x = stencil[a].x;
        gradient(c, a) = value[std::size_t(step)] - x * (1 - 2 * x) * (1 + 2 * x) * value[std::size_t(2 * step)];
      }
      const std::span<Real> coefficients = group.particles.component(p, c);
      if (group.scheme.flip) coefficients[0] = value[0] + Real(g.keep) * (coefficients[0] - then);
      else
        for (std::size_t r = 0; r < coefficients.size(); ++r) coefficients[r] = value[std::size_t(group.scheme.place[r])];
    }
  }
};

/// Moves the particle with the grid, keeps it out of walls and colliders, and scales what its scheme says. False for a particle that is not
/// finite or goes too far.
template <int D, class Real>
bool move(const BlockGather<D, Real>& g, Group<D, Real>& group, std::size_t p, const Gathered<D, Real>& from, SolidCounts& counts) {
  Particles<D, Real>& particles = group.particles;
  const Vec<D, Real> step = from.velocity * Real(g.dt / g.solids.cell);
  if (!(step.cwiseAbs().maxCoeff() < Real(kTooFar))) return false;
  Moving<D, Real> moving{{particles.cell[p], particles.offset[p]}, particles.velocity(p)};
  moving.site.move(step);
  const double pushed = g.solids.push_out(moving);
  particles.cell[p] = moving.site.cell;
  particles.offset[p] = moving.site.offset;
  const bool drops = pushed > kFarPush && group.scheme.bends;
  counts.pushed_out += pushed > 0;
  counts.dropped_modes += drops;
  const bool limits = group.scheme.carry == Carry::limited || (group.scheme.carry == Carry::hybrid && from.beside_light);
  std::array<Real, std::size_t(1 << D)> factor;
  if (limits) factor = limiting_factors<D, Real>(stencil_at<D, Real>(from.cell, from.offset), stencil_at<D, Real>(particles.cell[p], particles.offset[p]));
  for (int c = 0; c < D && (pushed > 0 || limits); ++c) {
    const std::span<Real> coefficients = particles.component(p, c);
    if (pushed > 0) coefficients[0] = moving.velocity[c];
    for (std::size_t r = 1; r < coefficients.size(); ++r) {
      const unsigned bent = group.scheme.bent[r];
      if (bent == 0) continue;
      if (drops) coefficients[r] = 0;
      else if (limits && factor[bent] < 1) coefficients[r] *= factor[bent], ++counts.limited_modes;
    }
  }
  return true;
}

/// The fast path: the coefficients of a block's particles, and what else `Gathered` says of them. `begin` are the ranges of its nodes.
void gather_eight_at_a_time(const BlockGather<3, float>& g, Group<3, float>& group, const Cell<3>& block, const std::uint32_t* begin,
                            std::vector<Gathered<3, float>>& gathered) {
  constexpr int edge = Lattice<3>::kBlock, tile = NodeSums<3, float>::kEdge, size = NodeSums<3, float>::kSize, per_block = Lattice<3>::kCellsPerBlock;
  std::array<float, std::size_t(3 * size)> velocity{};
  std::array<float, std::size_t(size)> mass{};
  g.blocks.template for_tile<tile>(block, [&](int to, std::size_t from, int count) {
    for (int i = 0; i < count; ++i) {
      mass[std::size_t(to + i)] = g.grid.mass[from + std::size_t(i)];
      for (int c = 0; c < 3; ++c) velocity[std::size_t(c * size + to + i)] = g.grid.velocity[from + std::size_t(i)][c];
    }
  });
  const std::size_t first = begin[0], count = begin[per_block] - first;
  std::array<std::uint32_t, std::size_t(per_block + 1)> local;   // ranges that count from the block's first particle
  for (std::size_t k = 0; k < local.size(); ++k) local[k] = std::uint32_t(begin[k] - first);
  Particles<3, float>& p = group.particles;
  std::vector<float> gradient(9 * count);
  group.kernels.gather({.begin = local.data(), .offset = p.offset[first].data(), .row = nullptr, .coefficients = &p.coefficients[first * p.row()]},
                       {.tile = velocity.data(), .gradient = gradient.data()});
  gathered.resize(count);
  for (int node = 0; node < per_block; ++node) {
    if (local[std::size_t(node)] == local[std::size_t(node) + 1]) continue;
    const int corner = (node / (edge * edge) * tile + node / edge % edge) * tile + node % edge;
    float all = 0, lightest = std::numeric_limits<float>::max();
    for (int k = 0; k < 27; ++k) {
      const float m = mass[std::size_t(corner + (k / 9 * tile + k / 3 % 3) * tile + k % 3)];
      all += m;
      lightest = std::min(lightest, m);
    }
    for (std::size_t q = local[std::size_t(node)]; q < local[std::size_t(node) + 1]; ++q) {
      Gathered<3, float>& out = gathered[q];
      out.cell = p.cell[first + q], out.offset = p.offset[first + q], out.velocity = p.velocity(first + q);
      for (int c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a) out.gradient(c, a) = gradient[9 * q + std::size_t(3 * c + a)];
      out.loose = all <= float(1.001 * group.weight);
      out.beside_light = lightest < float(kLightNode * group.weight);
    }
  }
}

}  // namespace

template <int D, class Real>
void BlockGather<D, Real>::run(Group<D, Real>& group, std::size_t block) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  const std::size_t begin = group.ranges.begin[block * per_block], end = group.ranges.begin[(block + 1) * per_block];
  Changes<D, Real> changes{std::vector<Matrix<Real, D>>(end - begin), std::vector<std::uint8_t>(end - begin)};
  std::vector<Gathered<D, Real>> gathered;
  bool fast = false;
  if constexpr (D == 3 && std::is_same_v<Real, float>) fast = group.kernels.gather != nullptr;
  if constexpr (D == 3 && std::is_same_v<Real, float>)
    if (fast) gather_eight_at_a_time(*this, group, blocks.lattice().block_at(group.ranges.occupied[block]), &group.ranges.begin[block * per_block], gathered);
  gathered.reserve(end - begin);
  for (std::size_t p = begin; p < end && !fast; ++p) gathered.emplace_back(*this, group, p);
  const Real scale = Real(dt / solids.cell);
  for (std::size_t k = 0; k < end - begin; ++k) {
    changes.loose[k] = gathered[k].loose;
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) changes.change[k](i, j) = scale * gathered[k].gradient(i, j);
  }
  if (group.averages) average_volume<D, Real>(group.particles, begin, end, changes.change);   // cells are those before the motion
  double fastest = 0;
  for (std::size_t p = begin; p < end; ++p) {
    if (!move<D, Real>(*this, group, p, gathered[p - begin], counts) && lost < 0) lost = group.particles.id[p];
    fastest = std::max(fastest, double(group.particles.velocity(p).norm()));
  }
  limits.take(std::visit([&](const auto& law) { return deform<D, Real>(law, group, begin, end, changes, counts.held); }, group.model));
  limits.speed = std::max(limits.speed, fastest);
  for (std::size_t p = begin; p < end && lost < 0; ++p)
    for (const Real x : group.stress[group.row(p)])
      if (!std::isfinite(x)) lost = group.particles.id[p];
}

template struct BlockGather<2, float>;
template struct BlockGather<2, double>;
template struct BlockGather<3, float>;
template struct BlockGather<3, double>;

}  // namespace sim
