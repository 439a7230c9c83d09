#include "sim/fluid/liquid.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/effects/gravity.h"
#include "sim/effects/potential.h"
#include "sim/fluid/births.h"
#include "sim/fluid/energy_watch.h"
#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"
#include "sim/moment.h"
#include "sim/pace.h"
#include "sim/seeding.h"
#include "sim/transfer/dimension.h"
#include "sim/transfer/particle_state.h"
#include "sim/watch.h"

namespace sim {
namespace {

/// A particle in every cell that is not solid, and no open side: there is no air, and an incompressible liquid never gets any. Ends at the
/// first cell without.
template <int D, class Real>
bool fills_the_domain(const Particles<D, Real>& particles, const Solids<D>& solids) {
  for (const auto& sides : solids.open)
    if (sides[0] || sides[1]) return false;
  const Lattice<D>& lattice = solids.lattice;
  std::vector<std::int64_t> keys;
  for (const Cell<D>& cell : particles.cell)
    if (const std::int64_t key = lattice.key(cell); keys.empty() || keys.back() != key) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  KeyTable filled;
  filled.build(keys);
  for (Cell<D> at{}; at[0] < lattice.cells[0];) {
    if (filled.find(lattice.key(at)) < 0 && !solids.solid(at)) return false;
    int a = D - 1;
    while (a > 0 && at[a] + 1 == lattice.cells[a]) at[a--] = 0;
    ++at[a];
  }
  return true;
}

template <int D, class Real>
class Liquid final : public Simulation {
 public:
  Liquid(const Scene& scene, double fps)
      : options_(scene.options), fps_(fps), gravity_(gravity(scene)), solids_(scene, lattice_of<D>(scene.options)),
        sources_(scene, solids_, kShortestStep / fps), particles_(seed_particles<D, Real>(scene, solids_.lattice, solids_, int(modes(options_).size()))),
        births_(sources_, solids_, options_, downhill(gravity_, options_), particles_.size()), step_(options_, solids_, !fills_the_domain(particles_, solids_), &sources_),
        particle_volume_(std::pow(options_.cell, D) / double(options_.particles_per_cell)) {
    pour(0);
    clear_counts();
    if (options_.write.pressure) pressure_.assign(particles_.size(), 0);
    step_.falls(downhill(gravity_, options_));
  }

  double begin_frame() override {
    step_.clear_counts();
    clear_counts();
    return 1 / fps_;
  }
  double advance_step(double left, base::Ledger& ledger) override { return left - step(left, ledger); }
  void end_frame(base::Ledger& ledger) override {
    ++frame_;
    solids_.move_to(time());
    if (options_.write.pressure) {
      const auto pass = ledger.pass("pressure", particle_bytes());
      pressure_ = step_.pressure_at(particles_, last_step_.length, last_step_.reflected);
    }
  }

  std::unique_ptr<Moment> moment() const override { return keep_moment(changing(*this)); }
  void go_back(const Moment& moment) override { put_back(moment, changing(*this)); }

  void restrain(const Restraint& restraint) override { restraint_ = restraint; }
  Frame frame() const override;
  Totals totals() const override;
  State state() const override;
  void restore(const State&) override;

 private:
  /// Of the fastest particle [m/s], and the sum of their velocities [m/s].
  struct Motion {
    double speed = 0;
    base::Vec3 momentum = base::Vec3::Zero();
  };
  /// All that a step changes.
  template <class Self>
  static auto changing(Self& s) {
    return std::tie(s.particles_, s.solids_, s.births_.given(), s.step_.counts(), s.step_.audit(), s.step_.past(), s.watch_, s.drift_, s.uncorrected_, s.aim_, s.substeps_,
                    s.splitting_fallbacks_, s.steps_by_motion_, s.steps_by_impact_, s.collider_work_, s.gravity_work_, s.largest_cfl_);
  }

  /// What sources have given by `time` [s] becomes particles. Returns how many were due.
  std::size_t pour(double time) {
    const auto born = births_.until(time, particles_);
    if (const std::size_t after = particles_.size() + born.size(); double(after) > kMostParticles)
      throw Unstable(frame_ + 1, {"step", fmt::format("sources make {} particles; at most {:.3g} are possible", after, kMostParticles), "end them earlier"});
    const double before = births_.given().energy;
    births_.bear(born, particles_);
    if (options_.audit && !born.empty()) step_.audit().add("source", births_.given().energy - before);
    return born.size();
  }
  void pour(double time, base::Ledger& ledger) {
    if (sources_.count() == 0) return;
    auto pass = ledger.pass("source", 0);
    pass.count(std::int64_t(pour(time) * (sizeof(Cell<D>) + sizeof(Vec<D, Real>) + sizeof(std::int64_t) + particles_.row() * sizeof(Real))));
  }

  static std::vector<ModeIndex<D>> modes(const Options& o) { return mode_set<D>(o.transfer, o.kernel, o.modes); }

  double time() const { return double(frame_ - 1) / fps_; }   // [s] of the frame
  /// [J] what moving solids did in the last projection.
  double solid_work() const { return particles_.mass * double(options_.particles_per_cell) * step_.solid_work(); }

  /// One step of at most `left` [s]; returns its length. Where it reflects gravity pulls halfway, for the whole step: a wave is moved, pulled and
  /// moved, as a leapfrog does, and keeps its energy. Half of the pull in each half of the step would meet the same surface twice in the mirrored
  /// field, and a wave of frequency w would grow by the root of 1 + (w dt)^2 / 4 each step; what is mirrored is the pressure of the flow alone.
  double step(double left, base::Ledger& ledger) {
    const bool reflects = options_.splitting == Splitting::reflection && watch_.reflects() && restraint_.modes == 0;
    const double start = time() + (1 / fps_ - left);
    const double poured_before = births_.given().energy;
    sources_.begin_step(start, solids_);
    const Motion motion = motion_of_particles(ledger);
    check_finite(motion);
    double dt = first_guess(left_until(solids_.next_change(start) - start, std::min(left, sources_.next_change(start) - start)), motion.speed);
    if (dt < left && dt < kShortestStep / fps_) throw_collapse("motion", dt);
    step_.scatter(particles_, reflects ? dt / 2 : dt, ledger);
    check_momentum(motion);
    double way = 0;   // [cells] of the fastest particle
    if (reflects) {
      const double half = project(dt / 2, [&](double) -> base::Vec3 { return base::Vec3::Zero(); }, ledger);
      add_work(2 * solid_work());   // the particles get the pressure twice
      step_.gather_reflected(gather_rule(half, motion.speed), particles_, ledger);
      solids_.move_to(start + half);
      way = step_.move(half, reflects, particles_, ledger);
      add_work(particles_.mass * step_.source_work());
      step_.scatter(particles_, half, ledger);
      const double rest = project(half, [&](double part) -> base::Vec3 { return (half + part) * gravity_; }, ledger);
      dt = half == dt / 2 && rest == half ? dt : half + rest;
      way += finish(rest, start + dt, reflects, options_.transfer == Transfer::flip ? motion_of_particles(ledger).speed : 0, ledger);
    } else {
      dt = project(dt, [&](double whole) -> base::Vec3 { return whole * gravity_; }, ledger);
      way = finish(dt, start + dt, reflects, motion.speed, ledger);
    }
    add_work(solid_work());
    pour(dt >= left ? double(frame_) / fps_ : start + dt, ledger);
    watch_.add_work(births_.given().energy - poured_before);
    if (const base::Vec3 along = along_periodic_axes(gravity_); !along.isZero(0)) {   // there is no floor, unless a collider makes one
      const double fall = 0.5 * dt * particles_.mass * along.dot(motion.momentum + motion_of_particles(ledger).momentum);   // [J]
      gravity_work_ += fall;
      if (!solids_.shapes.empty()) watch_.add_work(fall);   // of energy() it is part then
    }
    largest_cfl_ = std::max(largest_cfl_, way);
    steps_by_motion_ += dt < left;
    ++substeps_;
    last_step_ = {dt, reflects};
    if (options_.splitting == Splitting::reflection) {
      const auto pass = ledger.pass("sums", particle_bytes());
      watch_.see(energy());
      splitting_fallbacks_ += !reflects;
    }
    return dt >= left ? left : dt;
  }

  base::Vec3 along_periodic_axes(base::Vec3 v) const {
    for (int a = 0; a < 3; ++a)
      if (a >= D || !options_.periodic(a)) v[a] = 0;
    return v;
  }

  /// The last projection's field to the particles, of which the fastest has `speed` [m/s], and their motion, which ends at `end` [s]. Returns the
  /// longest way of one [cells].
  double finish(double dt, double end, bool reflects, double speed, base::Ledger& ledger) {
    drift_.reset();
    LiquidVolume volume;
    if (step_.has_surface() && particles_.size() > 0) {
      const auto pass = ledger.pass("sums", std::int64_t(step_.blocks().size() * sizeof(float)));
      volume = step_.volume();
      drift_ = volume.all * std::pow(options_.cell, D) / (particle_volume_ * double(particles_.size())) - 1;
    }
    uncorrected_.steps += 1, uncorrected_.times += dt / kCorrectionTime * std::sqrt(gravity_.norm() / options_.cell);
    const bool corrects = options_.volume_correction > 0 && substeps_ % kStepsACorrection == 0;
    if (corrects) {
      const double parts = std::clamp(std::max(uncorrected_.steps, uncorrected_.times), 1.0, double(kStepsACorrection));
      const double gain = 1 - std::pow(1 - options_.volume_correction, parts);
      uncorrected_ = {};
      if (volume.bulk_filling > 0)
        aim_ = std::clamp(aim_ + kPartToAim * gain * (volume.bulk / volume.bulk_filling - 1), 1 - kFarthestAim, 1 + kFarthestAim);
      step_.correct_volume(gain, aim_, ledger);
    }
    step_.gather(gather_rule(dt, speed), particles_, ledger);
    solids_.move_to(end);
    const double way = step_.move(dt, reflects, particles_, ledger);
    add_work(particles_.mass * step_.source_work());
    if (corrects) watch_.add_work(particles_.mass * step_.shift_work());   // it is no motion, and lifts the liquid
    return way;
  }

  /// Projects over dt, or less, what forces push(dt) [m/s]: a projection that would carry a face's velocity more than twice as far as cfl allows
  /// (an impact that the guess could not know of) is done again over half the time. Returns the time.
  template <class Push>
  double project(double dt, const Push& push, base::Ledger& ledger) {
    while (step_.project(push(dt), ledger) * dt > 2 * options_.cfl * options_.cell) {
      dt /= 2;
      ++steps_by_impact_;
      if (dt < kShortestStep / fps_) throw_collapse("the pressure of an impact", dt);
    }
    return dt;
  }

  [[noreturn]] void throw_collapse(const char* cause, double dt) const {
    throw Unstable(frame_ + 1, {"step", fmt::format("{} asks for a step of {:.3g} s, less than {:.1g} of a frame", cause, dt, kShortestStep),
                                "raise sim.cfl or shot.fps, or take a coarser sim.cell"});
  }

  void check_finite(const Motion& particles) const {
    if (std::isfinite(particles.momentum.sum())) return;
    for (std::size_t p = 0; p < particles_.size(); ++p)
      if (!particles_.velocity(p).allFinite())
        throw Unstable(frame_ + 1, {"finite", fmt::format("sort: particle {} at {} has no finite velocity", particles_.id[p], place_text(particles_.cell[p], particles_.place(p))), kSmallerSteps});
  }

  void check_momentum(const Motion& particles) const {
    const double mass = particles_.mass * double(particles_.size());
    base::Vec3 masses = base::Vec3::Zero();
    masses.head<D>().setConstant(mass);
    const FaceSums& grid = step_.scattered_sums();
    // Particles at rest on a floor turn: what is lost there is nothing beside the speed at which they would fall through a cell.
    const double scale = mass * std::max({particles.speed, std::sqrt(gravity_.norm() * options_.cell), 1e-30});
    check_p2g(frame_ + 1, Places::faces, {particles_.mass * grid.mass, particles_.mass * grid.momentum},
              {masses, particles_.mass * particles.momentum}, scale, sizeof(Real) == 4, step_.crowding(particles_.size()));
  }

  std::string place_text(const Cell<D>& cell, const Vec<D, double>& place) const {
    base::Vec3 x = options_.domain.lower;
    x.template head<D>() += options_.cell * place;
    std::string text = fmt::format("cell ({}", cell[0]);
    for (int a = 1; a < D; ++a) text += fmt::format(", {}", cell[a]);
    return text + fmt::format("), ({:.4g}, {:.4g}, {:.4g}) m,", x.x(), x.y(), x.z());
  }

  void add_work(double work) { watch_.add_work(work), collider_work_ += work; }
  void clear_counts() {
    substeps_ = 0, splitting_fallbacks_ = 0, steps_by_motion_ = 0, steps_by_impact_ = 0;
    collider_work_ = 0, gravity_work_ = 0, largest_cfl_ = 0;
    births_.given().clear();
  }

  /// Kinetic and potential energy [J], for the watch: without the mean flow along periodic axes, which a projection can neither feed nor brake where
  /// there is no collider.
  double energy() const {
    const auto sums = step_.transfer().sums(particles_, options_.cell);
    const double mass = particles_.mass * double(particles_.size());
    double mean = 0;
    for (int a = 0; a < D; ++a)
      if (options_.periodic(a) && solids_.shapes.empty()) mean += sums.linear_momentum[a] * sums.linear_momentum[a] / (2 * mass);
    return sums.kinetic_energy - mean + potential_energy();
  }

  /// The step in which the fastest particle, falling freely, crosses cfl cells; the rest of the frame is cut in two rather than leave a sliver.
  double first_guess(double left, double speed) const {
    const double reach = options_.cfl * options_.cell;
    const double dt = longest_step(std::max({speed, solids_.speed(), sources_.speed()}), gravity_.norm(), reach) / (1 << restraint_.halvings);
    return cut_to(left, std::min(dt, restraint_.longest));
  }

  GatherRule gather_rule(double dt, double speed) const {
    if (options_.transfer != Transfer::flip) return {};
    return {true, std::exp(-dt / flip_time(options_, gravity_, speed, 1 / fps_))};
  }

  std::int64_t particle_bytes() const { return std::int64_t(particles_.size() * particles_.row() * sizeof(Real)); }

  Motion motion_of_particles(base::Ledger& ledger) const {
    const auto pass = ledger.pass("sums", particle_bytes());
    return motion_of_particles();
  }
  Motion motion_of_particles() const {
    return base::ordered_reduce(particles_.size(), 16384, Motion{}, [&](std::size_t begin, std::size_t end) {
      Motion sum;
      for (std::size_t p = begin; p < end; ++p) {
        const Vec<D, double> v = particles_.velocity(p).template cast<double>();
        sum.speed = std::max(sum.speed, v.norm());
        sum.momentum.template head<D>() += v;
      }
      return sum;
    }, [](const Motion& a, const Motion& b) { return Motion{std::max(a.speed, b.speed), a.momentum + b.momentum}; });
  }
  double max_speed() const { return motion_of_particles().speed; }

  /// From the domain's floor; without the part along periodic axes, which have none.
  double potential_energy() const { return sim::potential_energy(particles_, downhill(gravity_, options_), options_); }

  /// Of a state: the field before the last motion, along an axis [m/s].
  static std::string past_column(int axis) { return std::string("past_velocity_") + "xyz"[axis]; }

  static constexpr double kShortestStep = 1e-4;   // [frames]
  static constexpr const char* kSmallerSteps = "a smaller sim.cfl may help";
  static constexpr int kStepsACorrection = 4;     // the volume is corrected in a frame's first step, and in every fourth after it
  /// It takes back as many parts as there were steps since the one before, or of these times [sqrt(cell / g)] where steps are long: about a step of a splash.
  static constexpr double kCorrectionTime = 0.16;
  /// Only the inside can be corrected. What the cells beside the surface have too much, or too little, it makes up for: its aim follows the
  /// volume's drift with this part of the gain, and no farther than this.
  static constexpr double kPartToAim = 0.2, kFarthestAim = 0.1;
  Options options_;
  double fps_;
  base::Vec3 gravity_;
  Solids<D> solids_;
  Sources<D> sources_;
  Particles<D, Real> particles_;
  Births<D, Real> births_;
  FluidStep<D, Real> step_;
  double particle_volume_;            // [m^3]; of a slab one metre deep in two dimensions
  EnergyWatch watch_;                 // used where the splitting reflects
  std::optional<double> drift_;       // [1] of volume, at the last step
  std::vector<float> pressure_;       // [Pa] of each particle at the frame; empty where nobody asks
  struct {
    double length = 0;                // [s]
    bool reflected = false;
  } last_step_;
  struct {
    double steps = 0, times = 0;      // [1] since the last volume correction: steps, and their length in kCorrectionTime
  } uncorrected_;
  double aim_ = 1;                    // [1] density of the liquid's inside that the volume correction aims at, over the one seeded
  std::int64_t frame_ = 1, substeps_ = 0, splitting_fallbacks_ = 0, steps_by_motion_ = 0, steps_by_impact_ = 0;
  double collider_work_ = 0, gravity_work_ = 0, largest_cfl_ = 0;   // since the frame before
  Restraint restraint_;
};

template <int D, class Real>
Frame Liquid<D, Real>::frame() const {
  Frame f;
  f.number = frame_;
  f.time = time();
  f.pscale = D == 2 ? std::sqrt(particle_volume_ / M_PI) : std::cbrt(3 * particle_volume_ / (4 * M_PI));
  const std::size_t n = particles_.size();
  f.position.resize(n), f.velocity.resize(n), f.id.resize(n);
  std::vector<std::size_t> order(n);   // particles by ascending id
  const bool all = n == 0 || *std::max_element(particles_.id.begin(), particles_.id.end()) == std::int64_t(n) - 1;
  for (std::size_t p = 0; p < n; ++p) order[all ? std::size_t(particles_.id[p]) : p] = p;
  f.pressure.resize(options_.write.pressure ? n : 0);
  const std::vector<float> mode_energy = options_.write.mode_energy ? step_.transfer().mode_energies(particles_) : std::vector<float>();
  f.mode_energy.resize(mode_energy.size());
  if (!all) std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return particles_.id[a] < particles_.id[b]; });
  base::parallel_chunks(n, 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t to = begin; to < end; ++to) {
      const std::size_t p = order[to];
      base::Vec3 x = options_.domain.lower;
      x.head<D>() += options_.cell * particles_.place(p);
      base::Vec3f v = base::Vec3f::Zero();
      v.head<D>() = particles_.velocity(p).template cast<float>();
      f.position[to] = x.cast<float>();
      f.velocity[to] = v;
      f.id[to] = particles_.id[p];
      if (!pressure_.empty()) f.pressure[to] = pressure_[p];
      if (!mode_energy.empty()) f.mode_energy[to] = mode_energy[p];
    }
  });
  return f;
}

template <int D, class Real>
Totals Liquid<D, Real>::totals() const {
  Totals t;
  const StepCounts& counts = step_.counts();
  t.substeps = substeps_;
  t.pushed_out = counts.pushed_out;
  t.left = counts.left;
  t.poured = births_.given().count, t.poured_energy = births_.given().energy;
  t.imbalance = counts.imbalance;
  t.dropped_modes = counts.dropped_modes;
  t.limited_modes = counts.limited_modes;
  t.light_faces = counts.light_faces;
  t.pressure_iterations = counts.pressure_iterations;
  t.pressure_fallbacks = counts.pressure_fallbacks;
  t.splitting_fallbacks = splitting_fallbacks_;
  t.volume_drift = drift_;
  t.max_divergence = counts.max_divergence;
  t.energy_changes = step_.audit().changes();
  t.collider_work = collider_work_, t.gravity_work = gravity_work_;
  t.largest_cfl = largest_cfl_, t.steps_by_motion = steps_by_motion_, t.steps_by_impact = steps_by_impact_;
  const std::size_t n = particles_.size();
  t.time = time();
  t.particles = std::int64_t(n);
  t.mass = particles_.mass * double(n);
  t.volume = particle_volume_ * double(n);
  const auto sums = step_.transfer().sums(particles_, options_.cell);
  t.kinetic_energy = sums.kinetic_energy;
  t.largest_coefficient = sums.largest_coefficient;
  t.linear_momentum = sums.linear_momentum;
  t.angular_momentum = sums.angular_momentum;
  t.potential_energy = potential_energy();
  t.max_speed = max_speed();
  t.state_hash = hash_of(particles_, [](std::size_t, std::uint64_t hash) { return hash; });
  return t;
}

template <int D, class Real>
State Liquid<D, Real>::state() const {
  State s;
  s.frame = frame_;
  add_particles(particles_, s);
  if (options_.write.pressure) s.columns.push_back(make_column<float>("pressure", pressure_, 1));
  if (options_.volume_correction > 0)
    s.columns.push_back(make_column<double>("volume_correction", std::vector<double>{aim_, uncorrected_.steps, uncorrected_.times}, 1));
  if (sources_.count() > 0) {
    s.columns.push_back(make_column<double>("poured_until", births_.given().until, 1));
    s.columns.push_back(make_column<std::int64_t>("next_id", std::vector<std::int64_t>{births_.given().next_id}, 1));
  }
  if (options_.splitting == Splitting::reflection)
    s.columns.push_back(make_column<double>("energy_watch", std::vector<EnergyWatch::State>{watch_.state()}, 4));
  if (step_.has_past()) {
    s.columns.push_back(make_column<double>("past_motion", std::vector<double>{step_.past().motion}, 1));
    for (int a = 0; a < D; ++a) s.columns.push_back(make_column<Real>(past_column(a), step_.past().velocity[std::size_t(a)], 1));
  }
  return s;
}

template <int D, class Real>
void Liquid<D, Real>::restore(const State& s) {
  const Column* const id = s.find("id");
  Particles<D, Real> p;
  p.modes = particles_.modes, p.mass = particles_.mass;
  const std::int64_t n = id ? id->rows : 0;
  std::vector<EnergyWatch::State> watch;
  const bool watched = options_.splitting != Splitting::reflection || read_column<double>(s, "energy_watch", 1, 4, watch);
  std::vector<double> correction;
  const bool aimed = options_.volume_correction == 0 || read_column<double>(s, "volume_correction", 3, 1, correction);
  std::vector<double> until;
  std::vector<std::int64_t> next_id{std::int64_t(n)};
  const bool poured = sources_.count() == 0 || (read_column<double>(s, "poured_until", sources_.count(), 1, until) &&
                                                read_column<std::int64_t>(s, "next_id", 1, 1, next_id));
  std::vector<float> pressure;
  const bool pressed = !options_.write.pressure || read_column<float>(s, "pressure", n, 1, pressure);
  typename FluidStep<D, Real>::Past past;
  bool has_past = true;
  if (step_.has_past()) {
    std::vector<double> motion;
    has_past = read_column<double>(s, "past_motion", 1, 1, motion);
    if (has_past) past.motion = motion.front();
    for (int a = 0; a < D; ++a) has_past = has_past && read_column<Real>(s, past_column(a), past.motion > 0 ? std::int64_t(step_.blocks().size()) : 0, 1, past.velocity[std::size_t(a)]);
  }
  const bool fits = watched && aimed && has_past && poured && pressed && s.frame >= 1 && read_particles(s, n, solids_.lattice, p);
  if (!fits) throw base::Error({.message = "the state does not fit the scene"});
  particles_ = std::move(p);
  step_.past() = std::move(past);
  if (!watch.empty()) watch_.restore(watch.front());
  if (!correction.empty()) aim_ = correction[0], uncorrected_ = {correction[1], correction[2]};
  pressure_ = std::move(pressure);
  births_.given().until = std::move(until), births_.given().next_id = next_id.front();
  frame_ = s.frame;
  solids_.move_to(time());
  step_.clear_counts();
  clear_counts();
  drift_.reset();
}

}  // namespace

std::unique_ptr<Simulation> make_liquid(const Scene& scene, double fps) {
  return with_numbers(scene.options, [&](auto dimension, auto number) -> std::unique_ptr<Simulation> {
    return std::make_unique<Liquid<decltype(dimension)::value, decltype(number)>>(scene, fps);
  });
}

}  // namespace sim
