#include "sim/watch.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/blame.h"
#include "sim/effects/gravity.h"

namespace sim {
namespace {

constexpr const char* kShorterSteps = "a smaller sim.cfl or sim.sound_cfl, or fewer modes with carry \"hybrid\", may help";

bool is_unstable(const base::Error& e) { return e.complaint().code == base::Exit::unstable; }

/// The violation, of whatever told it: the pressure's solver knows no frame.
Violation violation_of(const base::Error& e) {
  if (const auto* const known = dynamic_cast<const Unstable*>(&e)) return known->violation();
  const std::string& line = e.complaint().message;
  const std::size_t colon = line.find(": ");
  if (colon == std::string::npos) return {"step", line, kShorterSteps};
  return {line.substr(0, colon), line.substr(colon + 2), "a larger sim.pressure_tolerance, or a smaller sim.cfl, may help"};
}

/// The first particle whose place or velocity is no number.
std::string lost_particle(const Scene& scene, const Frame& f) {
  for (std::size_t p = 0; p < f.id.size(); ++p)
    if (!f.position[p].allFinite() || !f.velocity[p].allFinite()) return particle_text(scene, f, p) + ", has no finite velocity";
  return "its energy is no finite number";
}

}  // namespace

Watch::Watch(const Scene& scene, double fps, std::unique_ptr<Simulation> simulation) : simulation_(std::move(simulation)), scene_(scene),
    frame_(1 / fps), slow_(0.01 * scene.options.cell * fps) {
  for (const Body& b : scene.bodies)
    if (b.is_solid && b.solid.plasticity == Plasticity::snow) share_ = kShareOfSnow;
  for (const Source& s : scene.sources) collider_speed_ = std::max(collider_speed_, s.velocity.norm());
  for (const Collider& c : scene.colliders) collider_speed_ = std::max(collider_speed_, c.speed());
  const base::Vec3 g = gravity(scene);
  if (scene.options.solver == "fluid") unresolved_ = g.norm() * scene.options.cell;
  state_ = simulation_->state();
  totals_ = simulation_->totals();
  begin();
}

void Watch::begin() {
  memory_ = {};
  memory_.start = memory_.least = totals_.energy();
  memory_.least_at = double(state_.frame);
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
  state_.columns.push_back(make_column<double>("watch", std::vector<double>{m.start, m.least, m.least_at, m.work, m.particles, m.retries, m.since,
                                                                            m.modes, m.body}, 1));
}

void Watch::restore(const State& state) {
  simulation_->restore(state);
  state_ = state;
  totals_ = simulation_->totals();
  std::vector<double> m;
  if (read_column<double>(state, "watch", 9, 1, m)) memory_ = {m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]};
  else begin();   // of a program that had none
}

bool Watch::advance(base::Ledger& ledger, const std::function<bool()>& interrupted) {
  const Memory before = memory_;
  restraint_ = {.modes = int(before.modes), .body = int(before.body)};
  retries_ = 0;
  const auto whole_frame = [&] {
    simulation_->restrain(restraint_);
    if (!simulation_->advance(ledger, interrupted)) return false;
    const auto pass = ledger.pass("watch", state_bytes());
    const Totals totals = simulation_->totals();
    accept(before, checked(before, totals), totals);
    return true;
  };
  try {
    return whole_frame();
  } catch (const base::Error& e) {
    if (!is_unstable(e)) throw;
    count(before, e);
    simulation_->restore(state_);
    try {
      return again(before, ledger, interrupted);
    } catch (const base::Error& stays) {
      if (!is_unstable(stays) || has_stopped_) throw;
      count(before, stays);
      simulation_->restore(state_);
      restrain_more(stays, kMostRetries, frame_);
      try {
        return whole_frame();
      } catch (const base::Error& last) {
        if (!is_unstable(last)) throw;
        stop(before, last, fmt::format(", with all of the frame's steps {} times as short too", 1 << kMostRetries));
      }
    }
  }
}

void Watch::accept(const Memory& before, const Memory& now, const Totals& totals) {
  memory_ = now;
  memory_.retries = before.retries + double(retries_);
  memory_.since = retries_ == 0 ? 0 : before.since > 0 ? before.since : double(state_.frame + 1);
  memory_.modes = restraint_.modes, memory_.body = restraint_.body;
  totals_ = totals;
  totals_.retries = retries_;
  state_ = simulation_->state();
  keep();
}

bool Watch::again(const Memory& before, base::Ledger& ledger, const std::function<bool()>& interrupted) {
  Memory now = before;
  simulation_->restrain(restraint_);
  for (double left = simulation_->begin_frame(); left > 0;) {
    if (interrupted && interrupted()) return false;
    const auto start = simulation_->moment();
    for (int tries = 1;; ++tries) {
      try {
        const double rest = simulation_->advance_step(left, ledger);
        const auto pass = ledger.pass("watch", state_bytes());
        now = checked(before, simulation_->totals());
        left = rest;
        break;
      } catch (const base::Error& e) {
        if (!is_unstable(e) || has_stopped_ || tries > kMostRetries) throw;
        count(before, e);
        simulation_->go_back(*start);
        restrain_more(e, tries, left);
        simulation_->restrain(restraint_);
      }
    }
    if (restraint_.halvings == 0) continue;
    restraint_.halvings = 0, restraint_.longest = Restraint{}.longest;
    simulation_->restrain(restraint_);
  }
  simulation_->end_frame(ledger);
  accept(before, now, simulation_->totals());
  return true;
}

void Watch::count(const Memory& before, const base::Error& e) {
  if (before.retries + double(retries_) >= kMostRetriesOfARun) stop(before, e, fmt::format(", after going back {} times", kMostRetriesOfARun));
  ++retries_;
}

void Watch::restrain_more(const base::Error& e, int halvings, double span) {
  restraint_.halvings = halvings;
  restraint_.longest = span / (1 << halvings);
  if (halvings < 2) return;
  const int body = violation_of(e).body;
  restraint_.body = restraint_.modes > 0 && restraint_.body != body ? -1 : body;
  restraint_.modes = std::max(restraint_.modes, halvings - 1);
}

void Watch::stop(const Memory& before, const base::Error& e, const std::string& tried) {
  has_stopped_ = true;
  Violation v = violation_of(e);
  const std::int64_t frame = state_.frame + 1;
  if (v.since == 0) v.since = before.since > 0 ? std::int64_t(before.since) : frame;
  // what stopped within a step has left no state to look at: that of the frame's start
  if (v.where.empty() && (v.law == "step" || v.law == "pressure" || v.law == "momentum")) {
    simulation_->restore(state_);
    const bool of_sound = v.what.starts_with("sound");
    const Suspect suspect = v.law == "momentum" ? Suspect::largest_coefficient : of_sound ? Suspect::most_deformed : Suspect::fastest;
    if (const std::string who = find_culprit(suspect, scene_, *simulation_).text; !who.empty()) v.where = "at the frame's start " + who;
  }
  v.what += tried;
  throw Unstable(frame, std::move(v));
}

Watch::Memory Watch::checked(const Memory& before, const Totals& t) const {
  Memory now = before;
  const std::int64_t frame = state_.frame + 1;
  const double energy = t.energy();
  const auto violated = [&](const char* law, std::string what, const char* remedy) { return Violation{law, std::move(what), remedy}; };
  const auto with_culprit = [&](Violation v, Suspect suspect, std::int64_t since) {
    Culprit who = find_culprit(suspect, scene_, *simulation_);
    v.where = std::move(who.text), v.since = since;
    if (suspect != Suspect::fastest) v.body = who.body;
    return Unstable(frame, std::move(v));
  };
  if (!std::isfinite(energy) || !std::isfinite(t.max_speed) || !t.linear_momentum.allFinite())
    throw Unstable(frame, violated("finite", lost_particle(scene_, simulation_->frame()), kShorterSteps));
  now.particles += double(t.poured) - double(t.left);
  if (double(t.particles) != now.particles) {
    const std::string poured = t.poured > 0 ? fmt::format(", {} were poured", t.poured) : "";
    throw Unstable(frame, violated("mass", fmt::format("{} particles, where {:.0f} were{} and {} have left", t.particles, before.particles, poured, t.left),
                                   "this is a fault of the program"));
  }

  const double work = t.collider_work + t.gravity_work + t.poured_energy;
  now.work += work, now.start += std::max(work, 0.0);
  const double free = energy - now.work;
  const double had = std::max(now.least + now.work, 0.0);
  // What rests has no energy to compare with; what colliders push out is not in their work.
  const double noise = t.mass * (0.5 * (slow_ * slow_ + collider_speed_ * collider_speed_) + unresolved_);
  if (free - now.least > kGain * had + share_ * std::abs(now.start) + noise) {
    const std::string elastic = t.elastic_energy ? fmt::format(", elastic {:.4g}", *t.elastic_energy) : "";
    std::string what = fmt::format("{:.4g} J (kinetic {:.4g}, potential {:.4g}{}), where {:.4g} J were left; work done so far {:.4g} J", energy,
                                   t.kinetic_energy, t.potential_energy, elastic, had, now.work);
    throw with_culprit(violated("energy", std::move(what), kShorterSteps), Suspect::fastest, std::int64_t(now.least_at) + 1);
  }
  if (free <= now.least) now.least = free, now.least_at = double(frame);

  const double fastest = std::sqrt(2 * std::abs(now.start) / t.mass) + slow_ + collider_speed_;
  if (t.mass > 0 && t.largest_coefficient > kLargestCoefficient * fastest)
    throw with_culprit(violated("coefficients", fmt::format("one of {:.4g} m/s, where all energy together makes {:.4g} m/s", t.largest_coefficient,
                                                            fastest), "carry \"hybrid\", or fewer modes"),
                       Suspect::largest_coefficient, 0);
  // All of a body pressed to a point has no stress left, and what it stores of energy stays for ever where it is.
  if (t.least_volume && std::max(std::abs(*t.least_volume), std::abs(*t.most_volume)) < kLeastVolume)
    throw Unstable(std::int64_t(frame), violated("volume", fmt::format("every particle is pressed to less than {:.4g} of its volume", kLeastVolume),
                                   "stiffer material, or slower impacts"));
  if (t.least_volume && !(std::abs(*t.least_volume) <= kLargestVolume && std::abs(*t.most_volume) <= kLargestVolume))
    throw with_culprit(violated("volume", fmt::format("volume ratios from {:.4g} to {:.4g}", *t.least_volume, *t.most_volume), kShorterSteps),
                       Suspect::most_deformed, 0);
  return now;
}

}  // namespace sim
