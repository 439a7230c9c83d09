// G2P of solids and what follows for each particle: motion, deformation, stress, carry. Block by block, pass by pass over its particles, whose
// data stay in the cache meanwhile.
#include <algorithm>
#include <cmath>

#include "base/past_caches.h"
#include "sim/solid/rows.h"
#include "sim/solid/step.h"
#include "sim/transfer/basis.h"
#include "sim/transfer/carry.h"
#include "sim/transfer/node_runs.h"
#include "sim/transfer/tensor.h"

namespace sim {
namespace {

constexpr double kTooFar = 2;           // [cells] in one step: no dt that was chosen allows it
constexpr double kAlone = 1.001;        // a particle's mass and what else is at its nodes, in its own mass
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

/// Numbers of a struct of Reals alone, one after the other.
template <class Real, class Struct>
auto& numbers_of(Struct& s) {
  constexpr std::size_t count = sizeof(Struct) / sizeof(Real);
  using Array = std::conditional_t<std::is_const_v<Struct>, const std::array<Real, count>, std::array<Real, count>>;
  return reinterpret_cast<Array&>(s);
}

}  // namespace

void StepLimits::take(const StepLimits& o) {
  wave_speed = std::max(wave_speed, o.wave_speed), loose_speed = std::max(loose_speed, o.loose_speed), speed = std::max(speed, o.speed);
  least_volume = std::min(least_volume, o.least_volume), most_volume = std::max(most_volume, o.most_volume);
}

void SolidCounts::add(const SolidCounts& o) {
  pushed_out += o.pushed_out, dropped_modes += o.dropped_modes, limited_modes += o.limited_modes, light_nodes += o.light_nodes, held += o.held;
}

template <int D, class Real>
void BlockGather<D, Real>::gather_plainly(Group<D, Real>& group) {
  constexpr int n = 3;
  for (std::size_t p = begin_; p < end_; ++p) {
    const Stencil<QuadraticBasis<Real>, D> stencil = stencil_at<D, Real>(group.particles.cell[p], group.particles.offset[p]);
    Cell<D> first;
    for (int a = 0; a < D; ++a) first[a] = stencil[a].base;
    const auto at = blocks_.template places<n>(first);
    const auto w = weights<D>(stencil);
    Real mass = 0, lightest = std::numeric_limits<Real>::max();
    for (std::size_t node = 0; node < w.size(); ++node) {
      const Real m = value_at(grid_.mass, at[node], Real(0));
      mass += m;
      lightest = std::min(lightest, m);
    }
    flags_[p - begin_] =
        std::uint8_t((mass <= Real(kAlone * group.weight) ? kLoose : 0) | (lightest < Real(kLightNode * group.weight) ? kBesideLight : 0));
    for (int c = 0; c < D; ++c) {
      const std::size_t row = (p - begin_) * D + std::size_t(c);
      Tensor<Real, n, D> value;
      for (std::size_t node = 0; node < value.size(); ++node) value[node] = at[node] < 0 ? Real(0) : grid_.velocity[std::size_t(at[node])][c];
      Real then = 0;
      if (group.scheme.flip)
        for (std::size_t node = 0; node < value.size(); ++node) then += w[node] * (at[node] < 0 ? Real(0) : before_[std::size_t(at[node])][c]);
      analyse<D>(stencil, value);
      velocity_[row] = value[0];
      for (int a = 0; a < D; ++a) {   // the kernel's slope is (dual of w) - x (1 - 4 x^2) (dual of g)
        const int step = int_power(n, D - 1 - a);
        const Real x = stencil[a].x;
        gradient(p, std::size_t(c * D + a)) = value[std::size_t(step)] - x * (1 - 2 * x) * (1 + 2 * x) * value[std::size_t(2 * step)];
      }
      const auto coefficients = group.particles.component(p, c);
      if (group.scheme.flip) coefficients[0] = value[0] + Real(keep_) * (coefficients[0] - then);
      else
        for (std::size_t r = 0; r < coefficients.size(); ++r) coefficients[r] = value[std::size_t(group.scheme.place[r])];
    }
  }
}

/// The fast path; `begin` are the ranges of the block's nodes.
template <int D, class Real>
void BlockGather<D, Real>::gather_eight_at_a_time(Group<D, Real>& group, const Cell<D>& block, const std::uint32_t* begin)
  requires(D == 3 && std::is_same_v<Real, float>)
{
  constexpr int edge = Lattice<3>::kBlock, tile = NodeSums<3, float>::kEdge, per_block = Lattice<3>::kCellsPerBlock;
  constexpr std::size_t size = NodeSums<3, float>::kSize;
  std::array<float, 3 * size> velocity{};
  std::array<float, size> mass{};
  blocks_.template for_tile<tile>(block, [&](int to, std::size_t from, auto count) {
    std::copy_n(&grid_.mass[from], int(count), &mass[std::size_t(to)]);
    split_components<3>(grid_.velocity[from].data(), count, &velocity[std::size_t(to)], int(size));
  });
  std::array<std::uint32_t, std::size_t(per_block + 1)> local;   // ranges that count from the block's first particle
  for (std::size_t k = 0; k < local.size(); ++k) local[k] = std::uint32_t(begin[k] - begin_);
  Particles<3, float>& p = group.particles;
  const bool in_order = group.rows.empty(), has_many = p.coefficients.size() * sizeof(float) > base::kHeldByCaches;
  const lanes::Wanted strain{.rows = reinterpret_cast<const char*>(group.deformation.data() + (in_order ? begin_ : 0)),
                             .bytes = sizeof group.deformation[0], .row = in_order ? nullptr : &group.rows[begin_]};
  group.kernels.gather({.begin = local.data(), .offset = p.offset[begin_].data(), .row = nullptr,
                        .coefficients = &p.coefficients[begin_ * p.row()], .streams = group.scheme.carry != Carry::limited && has_many},
                       velocity.data(), {.velocity = velocity_.data(), .gradient = gradient_.data(), .stride = room(), .wanted = strain});
  // Sum and least of the masses of each node's stencil, one axis after the other.
  std::array<float, size> all = mass, lightest = mass;
  for (std::size_t step = 1; step < size; step *= tile)
    for (std::size_t i = 0; i + 2 * step < size; ++i) {
      all[i] = all[i] + all[i + step] + all[i + 2 * step];
      lightest[i] = std::min(std::min(lightest[i], lightest[i + step]), lightest[i + 2 * step]);
    }
  for (int node = 0; node < per_block; ++node) {
    const auto corner = std::size_t((node / (edge * edge) * tile + node / edge % edge) * tile + node % edge);
    const std::uint32_t flag =
        (all[corner] <= float(kAlone * group.weight) ? kLoose : 0) | (lightest[corner] < float(kLightNode * group.weight) ? kBesideLight : 0);
    for (std::uint32_t q = local[std::size_t(node)]; q < local[std::size_t(node) + 1]; ++q) flags_[q] = std::uint8_t(flag);
  }
}

/// Replaces each particle's change of volume by the mean of those nearest to the same node; `ranges` are those of the block's nodes.
template <int D, class Real>
void BlockGather<D, Real>::average_volume(const std::uint32_t* ranges) {
  const auto trace = [&](std::size_t p) {
    Real sum = 0;
    for (std::size_t a = 0; a < D; ++a) sum += gradient(p, a * (D + 1));
    return sum;
  };
  for (int node = 0; node < Lattice<D>::kCellsPerBlock; ++node) {
    const std::size_t first = ranges[node], end = ranges[node + 1];
    Real sum = 0;
    for (std::size_t p = first; p < end; ++p) sum += trace(p);
    const Real mean = sum / Real(end - first);
    for (std::size_t p = first; p < end; ++p) {
      const Real difference = (mean - trace(p)) / D;
      for (std::size_t a = 0; a < D; ++a) gradient(p, a * (D + 1)) += difference;
    }
  }
}

/// Whether a particle of the block may be at a wall or collider, or across a periodic side, after the step.
template <int D, class Real>
bool BlockGather<D, Real>::may_touch_solids(const Cell<D>& block) const {
  constexpr int edge = Lattice<D>::kBlock, reach = int(kTooFar) + 1;   // [cells]; half a one of them because particles lie around nodes
  base::Vec3 middle = solids_.origin;
  for (int a = 0; a < D; ++a) {
    if (block[a] * edge < reach || (block[a] + 1) * edge + reach > solids_.lattice.cells[a]) return true;
    middle[a] += solids_.cell * (block[a] * edge + 0.5 * (edge - 1));
  }
  const double radius = solids_.cell * std::sqrt(double(D)) * (0.5 * edge + reach);
  return std::any_of(solids_.shapes.begin(), solids_.shapes.end(), [&](const Shape& s) { return s.distance(middle) < radius; });
}

/// Keeps a particle that has moved out of walls and colliders, and scales what its scheme says.
template <int D, class Real>
bool BlockGather<D, Real>::settle(Group<D, Real>& group, std::size_t p, bool touches) {
  Particles<D, Real>& particles = group.particles;
  double pushed = 0;
  Moving<D, Real> moving{{particles.cell[p], particles.offset[p]}, particles.velocity(p)};
  if (touches) {
    if (solids_.has_thin()) solids_.stop_in_thin({from_cell_[p - begin_], from_offset_[p - begin_]}, dt_, moving.site);
    pushed = solids_.push_out(moving);
    collider_work += particles.mass * moving.work;
    particles.cell[p] = moving.site.cell;
    particles.offset[p] = moving.site.offset;
  }
  const bool drops = pushed > kFarPush && group.scheme.bends;
  counts.pushed_out += pushed > 0;
  counts.dropped_modes += drops;
  const bool limits_it = group.scheme.carry == Carry::limited || (group.scheme.carry == Carry::hybrid && (flags_[p - begin_] & kBesideLight));
  std::array<Real, std::size_t(1 << D)> factor;
  if (limits_it)
    factor = limiting_factors<D, Real>(stencil_at<D, Real>(from_cell_[p - begin_], from_offset_[p - begin_]),
                                       stencil_at<D, Real>(particles.cell[p], particles.offset[p]));
  for (int c = 0; c < D && (pushed > 0 || limits_it); ++c) {
    const auto coefficients = particles.component(p, c);
    if (pushed > 0) coefficients[0] = moving.velocity[c];
    for (std::size_t r = 1; r < coefficients.size(); ++r) {
      const unsigned bent = group.scheme.bent[r];
      if (bent == 0) continue;
      if (drops || (group.scheme.drops_beside_light && (flags_[p - begin_] & kBesideLight))) coefficients[r] = 0;
      else if (limits_it && factor[bent] < 1) coefficients[r] *= factor[bent], ++counts.limited_modes;
    }
  }
  return pushed > 0;
}

/// The same of all of the block; what it did to their energy is contact's where it pushed them, else the limiter's.
template <int D, class Real>
void BlockGather<D, Real>::settle_all(Group<D, Real>& group, bool touches) {
  for (std::size_t p = begin_; p < end_; ++p) {
    const double before = audits ? kinetic_energy(group, p) : 0;
    const bool pushed = settle(group, p, touches);
    if (audits) (pushed ? audit.collided : audit.carried) += kinetic_energy(group, p) - before;
  }
}

template <int D, class Real>
double BlockGather<D, Real>::kinetic_energy(const Group<D, Real>& group, std::size_t p) const {
  const Stencil<QuadraticBasis<double>, D> stencil =
      stencil_at<D, double>(group.particles.cell[p], group.particles.offset[p].template cast<double>());
  double sum = 0;
  for (int c = 0; c < D; ++c) {
    const auto coefficients = group.particles.component(p, c);
    for (std::size_t r = 0; r < coefficients.size(); ++r) {
      double norm = 1;
      for (int a = 0; a < D; ++a) norm *= stencil[a].norm(group.scheme.modes[r][std::size_t(a)]);
      sum += 0.5 * group.particles.mass * double(coefficients[r]) * double(coefficients[r]) * norm;
    }
  }
  return sum;
}

template <int D, class Real>
double BlockGather<D, Real>::kinetic_energy(const Group<D, Real>& group) const {
  double sum = 0;
  for (std::size_t p = begin_; p < end_; ++p) sum += kinetic_energy(group, p);
  return sum;
}

template <int D, class Real>
double BlockGather<D, Real>::trial_energy(const Group<D, Real>& group) const {
  double sum = 0;
  for (std::size_t p = begin_; p < end_; ++p) {
    Deformation<double, D> trial = exact(group.deformation[group.rows.empty() ? p : group.rows[p]]);
    Matrix<double, D> change;
    for (std::size_t i = 0; i < D; ++i)
      for (std::size_t k = 0; k < D; ++k) change.m[i][k] = dt_ / solids_.cell * double(gradient(p, i * D + k));
    trial.gradient = composed(change, trial.gradient);
    sum += elastic_energy(group, trial);
  }
  return sum;
}

template <int D, class Real>
double BlockGather<D, Real>::elastic_energy_now(const Group<D, Real>& group) const {
  double sum = 0;
  for (std::size_t p = begin_; p < end_; ++p) sum += elastic_energy(group, exact(group.next[p]));
  return sum;
}

/// What they carry to the next step; those that were pushed have lost some of what they moved with.
template <int D, class Real>
void BlockGather<D, Real>::add_momentum(const Particles<D, Real>& particles, bool were_pushed) {
  const std::size_t count = end_ - begin_;
  Vec<D, double> sum = Vec<D, double>::Zero();
  if (were_pushed) {
    for (std::size_t p = begin_; p < end_; ++p) sum += particles.velocity(p).template cast<double>();
  } else {
    constexpr std::size_t kRow = 8 * D;   // eight particles at a time
    std::array<Real, kRow> lanes{};
    std::size_t k = 0;
    for (; k + kRow <= D * count; k += kRow)
      for (std::size_t l = 0; l < kRow; ++l) lanes[l] += velocity_[k + l];
    for (std::size_t l = 0; k + l < D * count; ++l) lanes[l] += velocity_[k + l];
    for (std::size_t l = 0; l < kRow; ++l) sum[Eigen::Index(l % D)] += double(lanes[l]);
  }
  limits.momentum.template head<D>() += sum;
}

/// Moves the particles with the grid. False, and none has moved, where one is not finite or goes too far.
template <int D, class Real>
bool BlockGather<D, Real>::move(Group<D, Real>& group, bool touches) {
  Particles<D, Real>& particles = group.particles;
  const std::size_t count = end_ - begin_;
  const Real scale = Real(dt_ / solids_.cell);
  bool all_near = true;
  for (std::size_t k = 0; k < D * count; ++k) all_near &= std::abs(velocity_[k] * scale) < Real(kTooFar);
  if (!all_near) {
    for (std::size_t k = 0; k < D * count && lost < 0; ++k)
      if (!(std::abs(velocity_[k] * scale) < Real(kTooFar))) lost = particles.id[begin_ + k / D];
    return false;
  }
  const bool limits_some = group.scheme.carry == Carry::limited ||
                           (group.scheme.carry == Carry::hybrid &&
                            std::any_of(flags_.begin(), flags_.begin() + std::ptrdiff_t(count), [](auto f) { return f & kBesideLight; }));
  if (limits_some || (touches && solids_.has_thin())) {
    from_cell_.assign(particles.cell.begin() + std::ptrdiff_t(begin_), particles.cell.begin() + std::ptrdiff_t(end_));
    from_offset_.assign(particles.offset.begin() + std::ptrdiff_t(begin_), particles.offset.begin() + std::ptrdiff_t(end_));
  }
  int* const cell = particles.cell[begin_].data();
  Real* const offset = particles.offset[begin_].data();
  for (std::size_t k = 0; k < D * count; ++k) {   // as Site::move does
    const Real moved = offset[k] + velocity_[k] * scale, whole = std::floor(moved), part = moved - whole;
    cell[k] += int(whole) + (part >= 1);
    offset[k] = part >= 1 ? Real(0) : part;
  }
  if (audits) audit.moved += kinetic_energy(group);
  if (touches || limits_some) settle_all(group, touches);
  if (group.scheme.flip)
    for (std::size_t p = begin_; p < end_; ++p)
      for (int c = 0; c < D; ++c) velocity_[(p - begin_) * D + std::size_t(c)] = particles.component(p, c)[0];
  Real fastest = 0;
  for (std::size_t k = 0; k < count; ++k) {
    Real square = 0;
    for (std::size_t c = 0; c < D; ++c) square += velocity_[k * D + c] * velocity_[k * D + c];
    fastest = std::max(fastest, square);
  }
  limits.speed = std::max(limits.speed, std::sqrt(double(fastest)));
  add_momentum(particles, touches && !group.scheme.flip);
  return true;
}

/// Deformation and stress after the step, and the speeds of sound in it.
template <int D, class Real>
template <class Law>
void BlockGather<D, Real>::deform(const Law& law, Group<D, Real>& group) {
  using T = LawNumber<Real>;
  constexpr int W = NumberTraits<T>::kWidth;
  constexpr std::size_t kStrain = D * D + 1, kStress = Stress<D, Real>{}.size();
  static_assert(sizeof(Deformation<Real, D>) == kStrain * sizeof(Real));
  const T scale = T(Real(dt_ / solids_.cell));
  T fastest = T(0), fastest_loose = T(0);   // stiffness [Pa]
  T least_volume = constant<T>(1e30), most_volume = constant<T>(-1e30);   // J - 1
  const std::array<Real, kStrain> no_strain{};
  const bool past_caches = group.next.size() * kStrain * sizeof(Real) > base::kHeldByCaches;
  RowWriter<T, kStrain> strains(numbers_of<Real>(group.next[begin_]).data(), past_caches);
  RowWriter<T, kStress> stresses(group.stress[begin_].data(), past_caches);
  for (std::size_t p = begin_; p < end_; p += W) {
    const int used = int(std::min<std::size_t>(W, end_ - p));
    RowsAt<T, const Real> from;
    for (std::size_t l = 0; l < std::size_t(W); ++l)
      from[l] = int(l) < used ? numbers_of<Real>(std::as_const(group.deformation[group.rows.empty() ? p + l : group.rows[p + l]])).data()
                              : no_strain.data();
    std::array<T, D * D> change;
    std::array<T, kStrain> strain;
    load_columns(&gradient(p, 0), room(), change);
    load_rows(from, strain);
    Matrix<T, D> step;
    Deformation<T, D> state;
    for (std::size_t i = 0; i < D; ++i)
      for (std::size_t k = 0; k < D; ++k) step.m[i][k] = scale * change[i * D + k], state.gradient.m[i][k] = strain[i * D + k];
    state.state = strain[D * D];
    const Response<T, D> r = law.template respond<T, D>(step, state);

    const Matrix<T, D> b = left_strain(state.gradient);
    const T volume = volume_change(state.gradient);
    const auto stretched = either(largest_entry(b) > constant<T>(kStretched), volume < constant<T>(kSquashed - 1));
    const auto counts_here = first_lanes(used, T(0));
    const T own = std::is_same_v<Law, Liquid> ? state.state : volume;   // a liquid's F is not kept
    least_volume = smaller(least_volume, select(counts_here, own, least_volume)),
    most_volume = larger(most_volume, select(counts_here, own, most_volume));
    const auto is_loose = either(flagged(&flags_[p - begin_], T(0)), stretched);
    fastest = larger(fastest, select(counts_here, r.stiffness, T(0)));
    fastest_loose = larger(fastest_loose, select(both(is_loose, counts_here), r.stiffness, T(0)));
    std::array<T, kStress> stress;
    T sum = T(0);
    for (int i = 0; i < D; ++i)
      for (int k = 0; k < D; ++k) {
        strain[std::size_t(i * D + k)] = state.gradient(i, k);
        if (i > k) continue;
        stress[stress_place<D>(i, k)] = r.stress(i, k);
        sum += r.stress(i, k);
      }
    strain[D * D] = state.state;
    strains.write(strain, used);
    stresses.write(stress, used);
    const T nothing = sum - sum;   // no number where any stress is none
    if (any(both(counts_here, none(nothing <= T(0)))) && lost < 0)
      for (int l = 0; l < used && lost < 0; ++l)
        if (!std::isfinite(lane(sum, l))) lost = group.particles.id[p + std::size_t(l)];
    if (any(r.held))
      for (int l = 0; l < used; ++l) counts.held += lane(r.held, l);
  }
  strains.finish(), stresses.finish();
  for (int l = 0; l < W; ++l) {
    limits.least_volume = std::min(limits.least_volume, 1 + double(lane(least_volume, l)));
    limits.most_volume = std::max(limits.most_volume, 1 + double(lane(most_volume, l)));
    limits.wave_speed = std::max(limits.wave_speed, std::sqrt(double(lane(fastest, l)) / group.density));
    limits.loose_speed = std::max(limits.loose_speed, kLooseFactor * std::sqrt(double(lane(fastest_loose, l)) / group.density));
  }
}

template <int D, class Real>
void BlockGather<D, Real>::run(Group<D, Real>& group, std::size_t block) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  const std::uint32_t* const ranges = &group.ranges.begin[block * per_block];
  begin_ = ranges[0], end_ = ranges[per_block];
  const std::size_t count = end_ - begin_;
  if (lost >= 0) return;
  velocity_.resize(room() * D), gradient_.resize(room() * D * D);
  flags_.resize(count + 8);   // eight are read at a time
  const Cell<D> at = blocks_.lattice().block_at(group.ranges.occupied[block]);
  bool fast = false;
  if constexpr (D == 3 && std::is_same_v<Real, float>) {
    fast = group.kernels.gather != nullptr;
    if (fast) gather_eight_at_a_time(group, at, ranges);
  }
  if (!fast) gather_plainly(group);
  if (group.averages) average_volume(ranges);
  if (audits) audit.gathered += kinetic_energy(group);
  if (!move(group, may_touch_solids(at))) return;
  std::visit([&](const auto& law) { deform(law, group); }, group.model);
  if (audits && is_plastic(group.model)) audit.yielded += elastic_energy_now(group) - trial_energy(group);
}

template class BlockGather<2, float>;
template class BlockGather<2, double>;
template class BlockGather<3, float>;
template class BlockGather<3, double>;

}  // namespace sim
