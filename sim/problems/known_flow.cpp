#include "sim/problems/known_flow.h"

#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "sim/fluid/seeding.h"
#include "sim/pace.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 4096;

/// Sum of value(place) over the places of the domain, in a fixed order.
template <int D, class Value>
double sum_over(const ActiveBlocks<D>& blocks, const Lattice<D>& lattice, const Value& value) {
  return base::ordered_reduce(blocks.size(), kChunk, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i)
      if (lattice.inside(blocks.cell_at(i))) sum += value(i);
    return sum;
  }, [](double a, double b) { return a + b; });
}

/// Velocity jumps around the edge below place i that is normal to axes a and b [m/s]; 0 where a wall cuts it.
template <int D, class Real>
double circulation(const FaceField<D, Real>& v, const ActiveBlocks<D>& blocks, const Lattice<D>& lattice, std::size_t i, int a, int b) {
  const std::ptrdiff_t before_a = blocks.neighbour(i, a, 0), before_b = blocks.neighbour(i, b, 0);
  for (const std::ptrdiff_t other : {before_a, before_b})
    if (other < 0 || !lattice.inside(blocks.cell_at(std::size_t(other)))) return 0;
  const auto at = [&](int c, std::size_t k) { return double(v[std::size_t(c)][k]); };
  return at(b, i) - at(b, std::size_t(before_a)) - at(a, i) + at(a, std::size_t(before_b));
}

template <int D, class Real>
double circulation_squares(const FaceField<D, Real>& v, const ActiveBlocks<D>& blocks, const Lattice<D>& lattice) {
  return sum_over(blocks, lattice, [&](std::size_t i) {
    double sum = 0;
    for (int a = 0; a < D; ++a)
      for (int b = a + 1; b < D; ++b) sum += std::pow(circulation<D, Real>(v, blocks, lattice, i, a, b), 2);
    return sum;
  });
}

}  // namespace

template <int D, class Real>
FaceField<D, Real> field_on_faces(const ActiveBlocks<D>& blocks, const Options& o, const VelocityAt<D>& exact, double time) {
  const Lattice<D> lattice = lattice_of<D>(o);
  FaceField<D, Real> field;
  for (int a = 0; a < D; ++a) {
    std::vector<Real>& component = field[std::size_t(a)];
    component.assign(blocks.size(), 0);
    base::parallel_chunks(blocks.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Cell<D> cell = blocks.cell_at(i);
        if (!lattice.inside(cell)) continue;
        Vec<D, double> at;
        for (int b = 0; b < D; ++b) at[b] = o.domain.lower[b] + o.cell * (cell[std::size_t(b)] + (b == a ? 0.0 : 0.5));
        component[i] = Real(exact(at, time)[a]);
      }
    });
  }
  return field;
}

template <int D, class Real>
KnownFlow<D, Real>::KnownFlow(const Scene& scene, VelocityAt<D> exact, double flip_speed)
    : options_(scene.options), lattice_(lattice_of<D>(scene.options)), solids_(scene, lattice_), exact_(std::move(exact)),
      flip_time_(scene.options.flip_time.value_or(kFlipCells * scene.options.cell / flip_speed)), step_(options_, solids_, /*free_surface=*/false),
      particles_(seed_particles<D, Real>(scene, lattice_, solids_, int(step_.transfer().modes().size()))) {
  base::Ledger unused;
  step_.set_velocity(ActiveBlocks<D>(step_.blocks()), field_on_faces<D, Real>(step_.blocks(), options_, exact_, 0));
  step_.gather({}, particles_, unused);
  step_.clear_counts();
}

template <int D, class Real>
std::vector<Vec<D, double>> KnownFlow<D, Real>::places() const {
  std::vector<Vec<D, double>> places(particles_.size());
  for (std::size_t p = 0; p < places.size(); ++p)
    places[std::size_t(particles_.id[p])] = options_.domain.lower.head<D>() + options_.cell * particles_.place(p);
  return places;
}

template <int D, class Real>
void KnownFlow<D, Real>::fit_to_walls() {
  base::Ledger unused;
  step_.scatter(particles_, 0, unused);
  step_.project(base::Vec3::Zero(), unused);
  step_.gather({}, particles_, unused);
  step_.clear_counts();
}

template <int D, class Real>
void KnownFlow<D, Real>::part(double length, bool mirror, base::Ledger& ledger) {
  const GatherRule rule{options_.transfer == Transfer::flip, std::exp(-length / flip_time_)};
  step_.move(length, options_.splitting == Splitting::reflection, particles_, ledger);
  step_.scatter(particles_, length, ledger);
  step_.project(base::Vec3::Zero(), ledger);
  if (mirror) step_.gather_reflected(rule, particles_, ledger);
  else step_.gather(rule, particles_, ledger);
}

template <int D, class Real>
void KnownFlow<D, Real>::step(double dt, base::Ledger& ledger) {
  if (options_.splitting == Splitting::reflection) part(dt / 2, true, ledger), part(dt / 2, false, ledger);
  else part(dt, false, ledger);
  time_ += dt;
}

template <int D, class Real>
double KnownFlow<D, Real>::squares(const Vec<D, double>& mean) const {
  const auto& v = step_.velocity();
  return sum_over(step_.blocks(), lattice_, [&](std::size_t i) {
    double sum = 0;
    for (int a = 0; a < D; ++a) sum += std::pow(double(v[std::size_t(a)][i]) - mean[a], 2);
    return sum;
  });
}

template <int D, class Real>
double KnownFlow<D, Real>::kinetic_energy(const Vec<D, double>& mean) const {
  const auto sums = step_.transfer().sums(particles_, options_.cell);
  const double mass = particles_.mass * double(particles_.size());
  return sums.kinetic_energy - mean.dot(sums.linear_momentum.template head<D>()) + 0.5 * mass * mean.squaredNorm();
}

template <int D, class Real>
double KnownFlow<D, Real>::squares_of_error() const {
  const auto& v = step_.velocity();
  const auto exact = field_on_faces<D, double>(step_.blocks(), options_, exact_, time_);
  return sum_over(step_.blocks(), lattice_, [&](std::size_t i) {
    double sum = 0;
    for (std::size_t a = 0; a < D; ++a) sum += std::pow(double(v[a][i]) - exact[a][i], 2);
    return sum;
  });
}

template <int D, class Real>
double KnownFlow<D, Real>::vorticity_squares() const {
  return circulation_squares<D, Real>(step_.velocity(), step_.blocks(), lattice_) / (options_.cell * options_.cell);
}

template <int D, class Real>
double KnownFlow<D, Real>::vorticity_squares_of_error() const {
  auto difference = field_on_faces<D, double>(step_.blocks(), options_, exact_, time_);
  for (std::size_t a = 0; a < D; ++a)
    for (std::size_t i = 0; i < difference[a].size(); ++i) difference[a][i] = double(step_.velocity()[a][i]) - difference[a][i];
  return circulation_squares<D, double>(difference, step_.blocks(), lattice_) / (options_.cell * options_.cell);
}

template <int D, class Real>
ProblemResult answer(KnownFlow<D, Real>& flow, const FlowQuestion& question, base::Ledger& ledger) {
  const Vec<D, double> mean = question.mean.head<D>();
  const double energy = flow.squares(mean), enstrophy = flow.vorticity_squares(), joules = flow.kinetic_energy(mean);
  flow.audit_in_frame(question.mean);
  ProblemResult result;
  base::Ledger clock;
  const auto sample = [&] {
    result.time.push_back(flow.time());
    result.energy.push_back(flow.squares(mean) / energy);
    result.enstrophy.push_back(flow.vorticity_squares() / enstrophy);
  };
  sample();
  while (flow.time() < question.time) {
    {
      const base::Ledger::Timer timer(clock, "step", 0);
      flow.step(question.dt, ledger);
    }
    ++result.steps;
    sample();
  }
  for (const auto& [stage, change] : flow.grid().audit().changes()) result.energy_changes[stage] = change / joules;
  result.particle_energy = flow.kinetic_energy(mean) / joules;
  result.particles = std::int64_t(flow.particles().size());
  result.whole = clock.passes().at("step");
  result.errors.energy = std::abs(result.energy.back() - 1);
  result.errors.velocity = std::sqrt(flow.squares_of_error() / energy);
  result.errors.vorticity = std::sqrt(flow.vorticity_squares_of_error() / enstrophy);
  return result;
}

template FaceField<2, float> field_on_faces<2, float>(const ActiveBlocks<2>&, const Options&, const VelocityAt<2>&, double);
template FaceField<2, double> field_on_faces<2, double>(const ActiveBlocks<2>&, const Options&, const VelocityAt<2>&, double);
template FaceField<3, float> field_on_faces<3, float>(const ActiveBlocks<3>&, const Options&, const VelocityAt<3>&, double);
template FaceField<3, double> field_on_faces<3, double>(const ActiveBlocks<3>&, const Options&, const VelocityAt<3>&, double);
template class KnownFlow<2, float>;
template class KnownFlow<2, double>;
template class KnownFlow<3, float>;
template class KnownFlow<3, double>;
template ProblemResult answer(KnownFlow<2, float>&, const FlowQuestion&, base::Ledger&);
template ProblemResult answer(KnownFlow<2, double>&, const FlowQuestion&, base::Ledger&);
template ProblemResult answer(KnownFlow<3, float>&, const FlowQuestion&, base::Ledger&);
template ProblemResult answer(KnownFlow<3, double>&, const FlowQuestion&, base::Ledger&);

}  // namespace sim
