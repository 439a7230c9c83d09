#include "sim/watch.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/effects/gravity.h"

namespace sim {
namespace {

base::Complaint complaint_of(std::int64_t frame, const Violation& v) {
  return {.code = base::Exit::unstable, .hint = v.remedy, .message = fmt::format("frame {}: {}: {}", frame, v.law, v.what)};
}

constexpr const char* kShorterSteps = "a smaller sim.cfl or sim.sound_cfl, or fewer modes with carry \"hybrid\", may help";

/// The first particle whose place or velocity is no number.
std::string lost_particle(const Frame& f, const std::vector<std::string>& bodies) {
  for (std::size_t p = 0; p < f.id.size(); ++p) {
    if (f.position[p].allFinite() && f.velocity[p].allFinite()) continue;
    const std::size_t body = f.body.empty() ? 0 : f.body[p];
    return fmt::format("particle {} of body {} at ({:.4g}, {:.4g}, {:.4g}) m has no finite velocity", f.id[p], bodies[std::min(body, bodies.size() - 1)], f.position[p].x(), f.position[p].y(),
                       f.position[p].z());
  }
  return "its energy is no finite number";
}

}  // namespace

Unstable::Unstable(std::int64_t frame, Violation v) : base::Error(complaint_of(frame, v)), violation_(std::move(v)) {}

Watch::Watch(const Scene& scene, double fps, std::unique_ptr<Simulation> simulation) : simulation_(std::move(simulation)), slow_(0.01 * scene.options.cell * fps) {
  for (const Body& b : scene.bodies) {
    bodies_.push_back(b.name);
    if (b.is_solid && b.solid.plasticity == Plasticity::snow) share_ = kShareOfSnow;
  }
  for (const Collider& c : scene.colliders) collider_speed_ = std::max(collider_speed_, c.velocity.norm());
  const base::Vec3 g = gravity(scene);
  for (int a = 0; a < int(scene.options.dimension); ++a)
    if (!scene.options.periodic(a)) uphill_ += std::max(g[a], 0.0) * scene.options.domain.size()[a];
  state_ = simulation_->state();
  totals_ = simulation_->totals();
  begin();
}

double Watch::energy() const {
  const Totals& t = totals_;
  return t.kinetic_energy + t.potential_energy + t.mass * uphill_ + t.elastic_energy.value_or(0);
}

void Watch::begin() {
  memory_ = {};
  memory_.start = memory_.least = energy();
  memory_.particles = double(totals_.particles);
  keep();
}

std::int64_t Watch::state_bytes() const {
  std::int64_t bytes = 0;
  for (const Column& c : state_.columns) bytes += std::int64_t(c.bytes.size());
  return bytes;
}

void Watch::keep() {
  std::erase_if(state_.columns, [](const Column& c) { return c.name == "watch"; });
  const Memory& m = memory_;
  state_.columns.push_back(make_column<double>("watch", std::vector<double>{m.start, m.least, m.work, m.particles, m.retries, m.modes, m.body}, 1));
}

void Watch::restore(const State& state) {
  simulation_->restore(state);
  state_ = state;
  totals_ = simulation_->totals();
  std::vector<double> m;
  if (read_column<double>(state, "watch", 7, 1, m)) memory_ = {m[0], m[1], m[2], m[3], m[4], m[5], m[6]};
  else begin();   // of a program that had none
}

bool Watch::advance(base::Ledger& ledger, const std::function<bool()>& interrupted) {
  const Memory before = memory_;
  Restraint restraint{.halvings = 0, .modes = int(before.modes), .body = int(before.body)};
  for (int again = 0;; ++again) {
    try {
      simulation_->restrain(restraint);
      if (!simulation_->advance(ledger, interrupted)) return false;
      const auto pass = ledger.pass("watch", state_bytes());
      totals_ = simulation_->totals();
      totals_.retries = again;
      check();
      memory_.retries = before.retries + again;
      memory_.modes = restraint.modes, memory_.body = restraint.body;
      state_ = simulation_->state();
      keep();
      return true;
    } catch (const base::Error& e) {
      if (e.complaint().code != base::Exit::unstable) throw;
      if (again == kMostRetries || before.retries + again >= kMostRetriesOfARun) {
        base::Complaint told = e.complaint();
        told.message += again > 0 ? fmt::format(", with steps {} times as short too", 1 << again) : fmt::format(", after {:.0f} frames done again", before.retries);
        throw base::Error(std::move(told));
      }
      memory_ = before;
      simulation_->restore(state_);
      restraint.halvings = again + 1;
      if (again == 0) continue;
      const auto* const known = dynamic_cast<const Unstable*>(&e);
      const int body = known ? known->violation().body : -1;
      restraint.body = before.modes > 0 && restraint.body != body ? -1 : body;
      restraint.modes = std::max(restraint.modes, again);
    }
  }
}

void Watch::check() {
  const Totals& t = totals_;
  const double energy = this->energy();
  const auto violated = [&](const char* law, std::string what, const char* remedy) { throw Unstable(state_.frame + 1, {law, std::move(what), remedy, -1}); };
  if (!std::isfinite(energy) || !std::isfinite(t.max_speed) || !t.linear_momentum.allFinite()) violated("finite", lost_particle(simulation_->frame(), bodies_), kShorterSteps);
  memory_.particles -= double(t.left);
  if (double(t.particles) != memory_.particles)
    violated("mass", fmt::format("{} particles, where {:.0f} were and {} have left", t.particles, memory_.particles + double(t.left), t.left), "this is a fault of the program");

  const double work = t.collider_work + t.gravity_work;
  memory_.work += work, memory_.start += std::max(work, 0.0);
  const double free = energy - memory_.work;
  const double had = std::max(memory_.least + memory_.work, 0.0);
  // What rests has no energy to compare with; what colliders push out is not in their work.
  const double noise = 0.5 * t.mass * (slow_ * slow_ + collider_speed_ * collider_speed_);
  if (free - memory_.least > kGain * had + share_ * std::abs(memory_.start) + noise)
    violated("energy", fmt::format("{:.4g} J (kinetic {:.4g}, potential {:.4g}{}), where {:.4g} J were left; work done so far {:.4g} J; fastest particle {:.4g} m/s", energy, t.kinetic_energy,
                                   t.potential_energy, t.elastic_energy ? fmt::format(", elastic {:.4g}", *t.elastic_energy) : "", had, memory_.work, t.max_speed), kShorterSteps);
  memory_.least = std::min(memory_.least, free);

  const double fastest = std::sqrt(2 * std::abs(memory_.start) / t.mass) + slow_ + collider_speed_;
  if (t.mass > 0 && t.largest_coefficient > kLargestCoefficient * fastest)
    violated("coefficients", fmt::format("one of {:.4g} m/s, where all energy together makes {:.4g} m/s", t.largest_coefficient, fastest), "carry \"hybrid\", or fewer modes");
  if (t.least_volume && !(std::abs(*t.least_volume) <= kLargestVolume && std::abs(*t.most_volume) <= kLargestVolume))
    violated("volume", fmt::format("volume ratios from {:.4g} to {:.4g}", *t.least_volume, *t.most_volume), kShorterSteps);
}

}  // namespace sim
