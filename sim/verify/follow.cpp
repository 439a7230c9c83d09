#include "sim/verify/follow.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "base/error.h"

namespace sim::verify {
namespace {

bool is_finite(const Totals& t) {
  return std::isfinite(t.energy()) && std::isfinite(t.max_speed) && t.linear_momentum.allFinite() && t.angular_momentum.allFinite();
}

bool is_finite(const Frame& f) {
  const auto finite = [](const base::Vec3f& v) { return v.allFinite(); };
  return std::all_of(f.position.begin(), f.position.end(), finite) && std::all_of(f.velocity.begin(), f.velocity.end(), finite);
}

}  // namespace

double Course::energy(std::size_t frame) const { return totals[frame].energy(); }

double Course::largest_energy() const {
  double largest = 0;
  for (std::size_t f = 0; f < totals.size(); ++f) largest = std::max(largest, energy(f));
  return largest / energy(0);
}

std::int64_t Course::sum(std::int64_t Totals::* counter) const {
  std::int64_t all = 0;
  for (const Totals& t : totals) all += t.*counter;
  return all;
}

Course follow(const Scene& scene, const Plan& plan) {
  Course course;
  course.scene = scene;
  const auto watch = std::make_shared<Watch>(scene, plan.fps);
  Simulation& simulation = watch->simulation();
  course.simulation = std::shared_ptr<Simulation>(watch, &simulation);
  if (plan.prepare) {
    State state = simulation.state();
    plan.prepare(state);
    watch->restore(state);
  }
  course.totals.push_back(simulation.totals());
  base::Ledger ledger;
  for (int f = 0; f < plan.frames; ++f) {
    try {
      if (plan.watched) watch->advance(ledger, {});
      else simulation.advance(ledger, {});
    } catch (const base::Error& e) {
      if (e.complaint().code != base::Exit::unstable) throw;
      course.stopped = e.what();
      return course;
    }
    course.totals.push_back(plan.watched ? watch->totals() : simulation.totals());
    course.is_finite = course.is_finite && is_finite(course.end()) && is_finite(simulation.frame());
    if (plan.see) plan.see(simulation);
    if (!course.is_finite || (course.energy(0) > 0 && course.energy(course.totals.size() - 1) > plan.most_energy * course.energy(0))) break;
  }
  return course;
}

CaseOutcome report(const Course& course, double value, std::string outcome) {
  CaseOutcome found;
  found.value = value;
  found.outcome = std::move(outcome);
  if (!course.stopped.empty()) found.broken.push_back("stopped: " + course.stopped);
  if (const std::int64_t retries = course.sum(&Totals::retries); retries > 0) found.outcome += say("; went back %lld times",
                                                                                                   static_cast<long long>(retries));
  if (!course.is_finite) found.broken.push_back("numbers that are not finite");
  const auto& sides = course.scene.options.boundary;
  const bool is_open = std::any_of(sides.begin(), sides.end(), [](const auto& s) { return s[0] == Side::open || s[1] == Side::open; });
  std::int64_t left = 0, poured = 0;
  for (const Totals& t : course.totals) {
    left += t.left, poured += t.poured;
    const std::int64_t lost = course.start().particles + poured - left - t.particles;
    if (lost != 0) found.broken.push_back(say("%lld particles lost", static_cast<long long>(lost)));
    if (t.left > 0 && !is_open) found.broken.push_back(say("%lld particles left through a wall", static_cast<long long>(t.left)));
    if (course.energy(0) == 0) continue;
    found.time.push_back(t.time);
    found.energy.push_back(t.energy() / course.energy(0));
  }
  found.picture = course.simulation->frame();
  found.scene = course.scene;
  return found;
}

std::string say(const char* format, ...) {
  char text[400];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

void edit_reals(State& state, std::string_view name, Precision precision, const std::function<void(std::int64_t, double*)>& change) {
  if (precision == Precision::double_precision) return edit<double>(state, name, change);
  edit<float>(state, name, [&](std::int64_t row, float* values) {
    const Column* const c = state.find(name);
    std::vector<double> exact(values, values + c->width);
    change(row, exact.data());
    for (std::size_t k = 0; k < exact.size(); ++k) values[k] = float(exact[k]);
  });
}

}  // namespace sim::verify
