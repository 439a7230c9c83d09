#include "sim/solid/solid.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/effects/gravity.h"
#include "sim/effects/potential.h"
#include "sim/moment.h"
#include "sim/pace.h"
#include "sim/solid/seeding.h"
#include "sim/solid/step.h"
#include "sim/transfer/dimension.h"
#include "sim/transfer/particle_state.h"
#include "sim/watch.h"

namespace sim {
namespace {

/// [Pa] of a Kirchhoff stress: the mean of its normal parts, pressing positive. In two dimensions of the two in the plane.
template <int D, class Real>
float pressure_of(const Stress<D, Real>& stress) {
  Real sum = 0;
  for (int i = 0; i < D; ++i) sum += stress[stress_place<D>(i, i)];
  return float(-sum / Real(D));
}

/// [1] von Mises' measure of the logarithmic strain, as Frame::strain; in two dimensions nothing stretches out of the plane.
template <int D, class Real>
float equivalent_strain(const Deformation<Real, D>& p) {
  const Svd<Real, D> f = svd(p.gradient);
  std::array<double, 3> strain{};
  double mean = 0, sum = 0;
  constexpr double kFlat = 1e-6;   // a flattened particle has a finite strain too
  for (std::size_t i = 0; i < std::size_t(D); ++i) mean += strain[i] = std::log(std::max(kFlat, std::abs(1 + double(f.stretch[i]))));
  for (const double e : strain) sum += (e - mean / 3) * (e - mean / 3);
  return float(std::sqrt(2 * sum / 3));
}

template <int D, class Real>
class Solid final : public Simulation {
 public:
  Solid(const Scene& scene, double fps)
      : options_(scene.options), bodies_(names_of(scene)), fps_(fps), gravity_(gravity(scene)), solids_(scene, lattice_of<D>(scene.options)),
        groups_(seed_groups<D, Real>(scene, solids_)), step_(scene, solids_) {
    limits_ = limits_at_rest();
    momentum_ = momentum_of_particles();
    for (const auto& g : groups_) carries_.push_back(g.scheme.carry);
  }

  double begin_frame() override {
    step_.clear_counts();
    steps_ = {}, gravity_work_ = 0, collider_work_ = 0;
    return 1 / fps_;
  }

  double advance_step(double left, base::Ledger& ledger) override {
    const double start = double(frame_) / fps_ - left, change = solids_.next_change(start) - start;
    const double dt = next_step(left_until(change, left));
    if (solids_.speed() > 0) solids_.move_to(start);   // not where the last step left them: a retry goes back, and a restart finds the same bits
    step_.scatter(dt, groups_, ledger);
    step_.update(dt, gravity_, groups_, ledger);
    check_grid();
    if (solids_.speed() > 0) solids_.move_to(start + dt);
    try {
      hold(step_.gather(dt, keep(dt), groups_, ledger));
    } catch (const LostParticle& lost) {
      throw Unstable(frame_ + 1, {"motion",
                                  fmt::format("g2p: particle {} of body {}, {}, is not finite or crossed more than two cells in a step of {:.3g} s",
                                              lost.id, bodies_[lost.group], lost.place, dt),
                                  kSmallerSteps, int(lost.group)});
    }
    add_gravity_work(dt);
    collider_work_ += step_.collider_work();
    steps_.largest_cfl = std::max(steps_.largest_cfl, limits_.speed * dt / options_.cell);   // of the velocities that have moved them
    ++steps_.all;
    return dt >= left ? 0 : left - dt;
  }
  void end_frame(base::Ledger&) override { ++frame_; }

  std::unique_ptr<Moment> moment() const override { return keep_moment(changing(*this)); }
  void go_back(const Moment& moment) override { put_back(moment, changing(*this)); }

  void restrain(const Restraint& restraint) override {
    restraint_ = restraint;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const bool meant = restraint.modes > 0 && (restraint.body < 0 || restraint.body == int(g));
      Scheme<D>& scheme = groups_[g].scheme;
      scheme.carry = meant && scheme.bends ? (restraint.modes > 1 || carries_[g] == Carry::hybrid ? Carry::limited : Carry::hybrid) : carries_[g];
      scheme.drops_beside_light = meant && restraint.modes > 1;
      if (scheme.drops_beside_light) drop_wild_modes(groups_[g]);
    }
  }
  Frame frame() const override;
  Totals totals() const override;
  State state() const override;
  void restore(const State&) override;

 private:
  /// Steps since the frame before, and what set their length.
  struct Steps {
    std::int64_t all = 0, by_sound = 0, by_loose = 0, by_motion = 0;
    double shortest = 0;   // [s]
    double largest_cfl = 0;
  };

  /// All that a step changes.
  template <class Self>
  static auto changing(Self& s) {
    return std::tie(s.groups_, s.step_.counts(), s.step_.audit(), s.limits_, s.momentum_, s.gravity_work_, s.collider_work_, s.steps_);
  }

  std::size_t particles() const {
    std::size_t n = 0;
    for (const auto& g : groups_) n += g.particles.size();
    return n;
  }

  /// Coefficients of a particle, of the body whose particles have the most.
  std::size_t row_width() const {
    std::size_t width = 0;
    for (const auto& g : groups_) width = std::max(width, g.particles.row());
    return width;
  }

  StepLimits limits_at_rest() const {
    StepLimits limits;
    for (const auto& g : groups_) {
      if (g.particles.size() == 0) continue;
      Deformation<double, D> rest{Matrix<double, D>::zero(), 0};
      const double stiffness =
          std::visit([&](const auto& law) { return law.template respond<double, D>(Matrix<double, D>::zero(), rest).stiffness; }, g.model);
      limits.wave_speed = std::max(limits.wave_speed, std::sqrt(stiffness / g.density));
      for (std::size_t p = 0; p < g.particles.size(); ++p) limits.speed = std::max(limits.speed, double(g.particles.velocity(p).norm()));
    }
    return limits;
  }

  /// Modes with a g factor may have coefficients without bound where they have no energy; what they do to light nodes has no bound either.
  void drop_wild_modes(Group<D, Real>& group) const {
    const auto most = Real(limits_.speed);
    for (std::size_t p = 0; p < group.particles.size(); ++p) {
      bool wild = false;
      for (int a = 0; a < D; ++a)
        for (std::size_t r = 0; r < group.scheme.bent.size(); ++r)
          wild = wild || (group.scheme.bent[r] != 0 && std::abs(group.particles.component(p, a)[r]) > most);
      if (!wild) continue;
      for (int a = 0; a < D; ++a)
        for (std::size_t r = 0; r < group.scheme.bent.size(); ++r)
          if (group.scheme.bent[r] != 0) group.particles.component(p, a)[r] = 0;
    }
  }

  static std::vector<std::string> names_of(const Scene& scene) {
    std::vector<std::string> names;
    for (const Body& b : scene.bodies) names.push_back(b.name);
    return names;
  }

  base::Vec3 momentum_of_particles() const {   // [kg m/s]
    base::Vec3 sum = base::Vec3::Zero();
    for (const auto& g : groups_)
      for (std::size_t p = 0; p < g.particles.size(); ++p)
        sum.template head<D>() += g.particles.mass * g.particles.velocity(p).template cast<double>();
    return sum;
  }

  /// Of a step that is over. By the grid's momentum at its start, which has the same bits after a restart: the particles' is then summed in another
  /// order; and by what contact has left of it at its end.
  void add_gravity_work(double dt) {
    for (int a = 0; a < D; ++a)
      if (options_.periodic(a)) gravity_work_ += 0.5 * dt * gravity_[a] * (step_.scattered().momentum[a] + momentum_[a]);
  }

  void check_grid() const {
    double mass = 0;
    for (const auto& g : groups_) mass += g.particles.mass * double(g.particles.size());
    const NodeTotals& grid = step_.scattered();
    if (!grid.momentum.allFinite()) {
      for (std::size_t g = 0; g < groups_.size(); ++g)
        for (std::size_t p = 0; p < groups_[g].particles.size(); ++p)
          if (!groups_[g].particles.velocity(p).allFinite())
            throw Unstable(frame_ + 1, {"finite",
                                        fmt::format("p2g: particle {} of body {}, {}, has no finite velocity", groups_[g].particles.id[p], bodies_[g],
                                                    step_.place_of(groups_[g].particles, p)),
                                        kSmallerSteps, int(g)});
      throw Unstable(frame_ + 1, {"finite", "p2g: the grid's momentum is no finite number", kSmallerSteps});
    }
    base::Vec3 masses = base::Vec3::Zero(), grid_masses = base::Vec3::Zero();
    masses.head<D>().setConstant(mass), grid_masses.head<D>().setConstant(grid.mass);
    const double scale = mass * (limits_.speed + std::max(limits_.wave_speed, limits_.loose_speed)) + momentum_.norm();
    check_p2g(frame_ + 1, Places::nodes, {grid_masses, grid.momentum}, {masses, momentum_}, scale, sizeof(Real) == 4);
  }

  /// Speeds of sound may grow at once, but fall by a thousandth a step: steps whose length swings with the strain of what swings feed it.
  void hold(const StepLimits& now) {
    constexpr double kKept = 0.999;
    const StepLimits before = limits_;
    limits_ = now;
    limits_.wave_speed = std::max(now.wave_speed, kKept * before.wave_speed),
    limits_.loose_speed = std::max(now.loose_speed, kKept * before.loose_speed);
    momentum_ = now.momentum;
  }

  /// The longest step that sound, what is loose and the fastest particle (falling freely) or collider allow, cut so that
  /// what is left of the frame, or until a collider begins to move or stops, is a whole number of them.
  double next_step(double left) {
    const double h = options_.cell, never = 2 * left;
    const double sound = limits_.wave_speed > 0 ? options_.sound_cfl * h / limits_.wave_speed : never;
    const double loose = limits_.loose_speed > 0 ? options_.sound_cfl * h / limits_.loose_speed : never;
    const double motion = longest_step(std::max(limits_.speed, solids_.speed()), gravity_.norm(), options_.cfl * h);
    double dt = std::min({sound, loose, motion});
    const char* const who = dt == motion ? "motion" : dt == loose ? "sound in what is loose or strongly stretched" : "sound";
    if (!(dt > kShortestStep / fps_))
      throw Unstable(frame_ + 1, {"step", fmt::format("{} asks for a step of {:.3g} s, less than {:.1g} of a frame", who, dt, kShortestStep),
                                  "a softer material, a coarser sim.cell or a higher shot.fps needs fewer steps"});
    if (dt < left) ++(dt == motion ? steps_.by_motion : dt == loose ? steps_.by_loose : steps_.by_sound);
    dt = std::min(dt / (1 << restraint_.halvings), restraint_.longest);
    dt = left / std::ceil(left / dt * (1 - 1e-9));
    steps_.shortest = steps_.all == 0 ? dt : std::min(steps_.shortest, dt);
    return dt;
  }

  double keep(double dt) const {
    return std::exp(-dt / flip_time(options_, gravity_, limits_.speed, 1 / fps_));
  }

  std::uint64_t state_hash() const;

  static constexpr double kShortestStep = 1e-6;   // [frames]
  static constexpr const char* kSmallerSteps = "a smaller sim.sound_cfl or sim.cfl may help";
  static constexpr std::int64_t kStrain = sizeof(Deformation<Real, D>) / sizeof(Real), kStress = sizeof(Stress<D, Real>) / sizeof(Real);
  Options options_;
  std::vector<std::string> bodies_;            // names
  double fps_;
  base::Vec3 gravity_;
  Solids<D> solids_;
  std::vector<Group<D, Real>> groups_;
  SolidStep<D, Real> step_;
  StepLimits limits_;
  base::Vec3 momentum_ = base::Vec3::Zero();   // [kg m/s] of the particles
  double gravity_work_ = 0;                    // [J] along periodic axes, since the frame before
  double collider_work_ = 0;                   // [J] of colliders that move, likewise
  Restraint restraint_;
  std::vector<Carry> carries_;                 // of the groups, when nothing restrains them
  Steps steps_;
  std::int64_t frame_ = 1;
};

template <int D, class Real>
Frame Solid<D, Real>::frame() const {
  Frame f;
  f.number = frame_;
  f.time = double(frame_ - 1) / fps_;
  const double volume = groups_.front().rest_volume;
  f.pscale = D == 2 ? std::sqrt(volume / M_PI) : std::cbrt(3 * volume / (4 * M_PI));
  const std::size_t n = particles();
  f.position.resize(n), f.velocity.resize(n), f.id.resize(n);
  if (groups_.size() > 1) f.body.resize(n);
  f.pressure.resize(options_.write.pressure ? n : 0);
  f.strain.resize(options_.write.strain ? n : 0);
  f.mode_energy.resize(options_.write.mode_energy ? n : 0);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Particles<D, Real>& particles = groups_[g].particles;
    const std::vector<float> mode_energy =
        f.mode_energy.empty() ? std::vector<float>() : NodeTransfer<D, Real>(Kernel::quadratic, groups_[g].scheme.modes).mode_energies(particles);
    base::parallel_chunks(particles.size(), 16384, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const auto to = std::size_t(particles.id[p]);   // ids count from 0 without gaps
        const std::size_t row = particles.row_of(p);
        if (!f.pressure.empty()) f.pressure[to] = pressure_of<D, Real>(groups_[g].stress[row]);
        if (!f.strain.empty()) f.strain[to] = equivalent_strain(groups_[g].deformation[row]);
        if (!mode_energy.empty()) f.mode_energy[to] = mode_energy[p];
        base::Vec3 x = options_.domain.lower;
        x.head<D>() += options_.cell * particles.place(p);
        base::Vec3f v = base::Vec3f::Zero();
        v.head<D>() = particles.velocity(p).template cast<float>();
        f.position[to] = x.cast<float>();
        f.velocity[to] = v;
        f.id[to] = particles.id[p];
        if (!f.body.empty()) f.body[to] = std::uint16_t(g);
      }
    });
  }
  return f;
}

template <int D, class Real>
Totals Solid<D, Real>::totals() const {
  Totals t;
  t.time = double(frame_ - 1) / fps_;
  t.substeps = steps_.all;
  t.particles = std::int64_t(particles());
  t.elastic_energy = 0;
  const base::Vec3 down = downhill(gravity_, options_);
  for (const auto& g : groups_) {
    const Particles<D, Real>& particles = g.particles;
    t.mass += particles.mass * double(particles.size());
    t.volume += g.rest_volume * double(particles.size());
    const auto sums = NodeTransfer<D, Real>(Kernel::quadratic, g.scheme.modes).sums(particles, options_.cell);
    t.kinetic_energy += sums.kinetic_energy;
    t.largest_coefficient = std::max(t.largest_coefficient, sums.largest_coefficient);
    t.linear_momentum += sums.linear_momentum;
    t.angular_momentum += sums.angular_momentum;
    const SolidEnergy e = energy_of(g, down, options_.cell);
    *t.elastic_energy += e.elastic;
    t.potential_energy += e.place - particles.mass * double(particles.size()) * energy_of_floor(down, options_);
    t.max_speed = std::max(t.max_speed, base::ordered_reduce(particles.size(), 16384, 0.0, [&](std::size_t begin, std::size_t end) {
      double most = 0;
      for (std::size_t p = begin; p < end; ++p) most = std::max(most, particles.velocity(p).template cast<double>().norm());
      return most;
    }, [](double a, double b) { return std::max(a, b); }));
  }
  t.state_hash = state_hash();
  t.energy_changes = step_.audit().changes();
  const SolidCounts& c = step_.counts();
  t.pushed_out = c.pushed_out, t.dropped_modes = c.dropped_modes, t.limited_modes = c.limited_modes, t.light_faces = c.light_nodes;
  t.held_strains = c.held;
  t.steps_by_sound = steps_.by_sound, t.steps_by_loose = steps_.by_loose, t.steps_by_motion = steps_.by_motion;
  t.shortest_step = steps_.shortest;
  t.gravity_work = gravity_work_, t.collider_work = collider_work_, t.largest_cfl = steps_.largest_cfl;
  if (steps_.all > 0) t.least_volume = limits_.least_volume, t.most_volume = limits_.most_volume;
  return t;
}

template <int D, class Real>
State Solid<D, Real>::state() const {
  State s;
  s.frame = frame_;
  Group<D, Real> all;
  Particles<D, Real>& p = all.particles;
  const std::size_t width = row_width();
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (const auto& group : groups_) {   // one after the other, rows of coefficients filled up with zeros to the widest
    append(p.cell, group.particles.cell), append(p.offset, group.particles.offset), append(p.id, group.particles.id);
    const std::size_t from = all.deformation.size();   // deformation and stress by id
    all.deformation.resize(from + group.particles.size()), all.stress.resize(from + group.particles.size());
    for (std::size_t i = 0; i < group.particles.size(); ++i) {
      const std::size_t to = from + std::size_t(group.particles.id[i] - group.first_id), row = group.particles.row_of(i);
      all.deformation[to] = group.deformation[row], all.stress[to] = group.stress[row];
    }
    for (std::size_t i = 0; i < group.particles.size(); ++i) {
      const std::size_t at = p.coefficients.size();
      p.coefficients.resize(at + width, 0);
      std::copy_n(&group.particles.coefficients[group.particles.row_of(i) * group.particles.row()], group.particles.row(), &p.coefficients[at]);
    }
  }
  p.modes = int(width) / D;
  add_particles(p, s);
  s.columns.push_back(make_column<Real>("deformation", all.deformation, kStrain));
  s.columns.push_back(make_column<Real>("stress", all.stress, kStress));
  s.columns.push_back(make_column<double>("limits", std::vector<double>{limits_.wave_speed, limits_.loose_speed, limits_.speed}, 1));
  return s;
}

template <int D, class Real>
void Solid<D, Real>::restore(const State& s) {
  auto groups = groups_;
  Group<D, Real> all;
  const auto n = std::int64_t(particles()), width = std::int64_t(row_width());
  all.particles.modes = int(width) / D;
  bool fits = s.frame >= 1 && read_particles(s, n, solids_.lattice, all.particles) &&
              read_column<Real>(s, "deformation", n, kStrain, all.deformation) && read_column<Real>(s, "stress", n, kStress, all.stress);
  std::size_t from = 0;
  for (auto& group : groups) {
    if (!fits) break;
    Particles<D, Real>& p = group.particles;
    const std::size_t count = p.size();
    p.rows.clear();
    p.coefficients.resize(count * p.row());
    for (std::size_t i = 0; i < count; ++i) {
      p.cell[i] = all.particles.cell[from + i], p.offset[i] = all.particles.offset[from + i], p.id[i] = all.particles.id[from + i];
      std::copy_n(&all.particles.coefficients[(from + i) * std::size_t(width)], p.row(), &p.coefficients[i * p.row()]);
      fits = fits && p.id[i] >= group.first_id && p.id[i] < group.first_id + std::int64_t(count);
      if (!fits) break;
      const std::size_t by_id = from + std::size_t(p.id[i] - group.first_id);
      group.deformation[i] = all.deformation[by_id], group.stress[i] = all.stress[by_id];
    }
    from += count;
  }
  std::vector<double> limits;
  fits = fits && read_column<double>(s, "limits", 3, 1, limits);
  if (!fits) throw base::Error({.message = "the state does not fit the scene"});
  groups_ = std::move(groups);
  limits_ = {.wave_speed = limits[0], .loose_speed = limits[1], .speed = limits[2]};
  momentum_ = momentum_of_particles();
  frame_ = s.frame;
  step_.clear_counts();
  steps_ = {}, gravity_work_ = 0, collider_work_ = 0;
}

/// With the deformation of each particle.
template <int D, class Real>
std::uint64_t Solid<D, Real>::state_hash() const {
  std::uint64_t hash = 0;
  for (const auto& g : groups_)
    hash += hash_of(g.particles, [&](std::size_t p, std::uint64_t h) {
      const Deformation<Real, D>& d = g.deformation[g.particles.row_of(p)];
      for (const auto& row : d.gradient.m)
        for (const Real x : row) h = hash_with(h, x);
      return hash_with(h, d.state);
    });
  return hash;
}

}  // namespace

std::unique_ptr<Simulation> make_solid(const Scene& scene, double fps) {
  return with_numbers(scene.options, [&](auto dimension, auto number) -> std::unique_ptr<Simulation> {
    return std::make_unique<Solid<decltype(dimension)::value, decltype(number)>>(scene, fps);
  });
}

}  // namespace sim
