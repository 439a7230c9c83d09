#include "app/plan/predict.h"

#include <algorithm>
#include <cmath>

#include "app/plan/limits.h"
#include "app/plan/plan.h"
#include "sim/size.h"

namespace app {
namespace {

constexpr double kTiny = 1e-3;   // [s] below it a measured cost says nothing of how it grows

using Costs = std::map<std::string, double> FrameCost::*;

double get(const FrameCost& frame, Costs costs, const std::string& key) {
  const auto found = (frame.*costs).find(key);
  return found == (frame.*costs).end() ? 0 : found->second;
}

bool is_of(const std::string& key, std::string_view stage) { return key.starts_with(std::string(stage) + "/"); }

class Predictor {
 public:
  Predictor(const Shot& shot, const Pilot& pilot) : shot_(shot), pilot_(pilot) {
    const render::Options& o = shot.render.options;
    particles_ = particles_at(shot, shot.frames);
    pixels_ = shot.has_pictures ? double(o.width * o.height) : 0;
    samples_ = shot.scene.options.dimension == 2 ? pixels_ : pixels_ * double(o.spp);
    for (const auto& [frame, cost] : pilot.fine.frames)
      if (frame <= kFirst) first_ = std::max(first_, frame);
    for (const base::PassRow& pass : plan_of(shot, Stage::simulate).passes)
      if (pass.often == base::PassRow::Often::step) step_keys_.push_back("simulate/" + std::string(pass.name));
    for (const std::string& key : step_keys_) {
      const double a = step_cost(pilot_.wide, 1, first_, key), c = step_cost(pilot_.fine, 1, first_, key);
      a_step_ += c * std::pow(particles_ / pilot_.fine.particles, power(a, c, pilot_.wide.particles, pilot_.fine.particles, 0.1 * kTiny, 1));
    }
    if (pours()) poured_ = poured_steps();
  }

  Prediction predict(const FrameRange& range) const {
    Prediction out;
    out.frames = double(range.last - range.first + 1);
    const double late = late_steps();
    for (std::int64_t frame = 1; frame <= range.last; ++frame) add_simulation(frame, range.last, late, out);
    for (std::int64_t frame = range.first; frame <= range.last; ++frame) add_pictures(frame, out);
    if (const double bytes = checkpoint_bytes(shot_, particles_at(shot_, range.last), range.last); bytes > 0) out.disk["checkpoint"] = bytes;
    constexpr double kPage = 8e4, kPicture = 1.5e4, kMostPictures = 24;   // of report.html: the same for all shots
    out.disk["report"] = kPage + (shot_.has_pictures ? kPicture * std::min(out.frames, kMostPictures) : 0);
    out.peak_bytes = std::max(memory(), least(shot_, range).peak_bytes);
    return out;
  }

 private:
  static constexpr std::int64_t kFirst = 3;   // frames that all runs have

  double sum(const MicroRun& run, Costs costs, const std::string& key) const {
    double total = 0;
    for (const auto& [frame, cost] : run.frames)
      if (frame <= first_) total += get(cost, costs, key);
    return total;
  }

  /// q of cost ~ size^q between two runs; `unknown` where they are too near, or the cost too small.
  static double power(double cost_a, double cost_b, double size_a, double size_b, double least, double unknown) {
    if (!(size_b > 1.3 * size_a) || cost_b < least || cost_a <= 0) return unknown;
    return std::clamp(std::log(cost_b / cost_a) / std::log(size_b / size_a), 0.0, 1.3);
  }

  static bool is_picture(const std::string& key) { return is_of(key, "render") || key == "images"; }

  /// From the fine run's size to the shot's.
  double growth(Costs costs, const std::string& key, double least) const {
    const double b = sum(pilot_.wide, costs, key), c = sum(pilot_.fine, costs, key);
    const double by_particles = power(b, c, pilot_.wide.particles, pilot_.fine.particles, least, is_picture(key) ? 0 : 1);
    return std::pow(particles_ / pilot_.fine.particles, by_particles) * picture_growth(pilot_.fine, costs, key, least);
  }

  /// From a run's picture to the shot's; 1 of what is none.
  double picture_growth(const MicroRun& run, Costs costs, const std::string& key, double least) const {
    if (!is_picture(key)) return 1;
    const double a = sum(pilot_.small, costs, key), b = sum(pilot_.wide, costs, key);
    const bool traces = key == "render/trace";
    const double now = traces ? samples_ : pixels_, then = traces ? run.samples : run.pixels;
    return std::pow(now / then, power(a, b, pilot_.small.pixels, pilot_.wide.pixels, least, 1));
  }

  /// What a later frame costs against the last of the first ones, as the coarse run shows at its end.
  double later(Costs costs, const std::string& key, std::int64_t frame) const {
    const auto last = pilot_.wide.frames.find(pilot_.last), first = pilot_.wide.frames.find(first_);
    if (frame <= first_ || pilot_.last <= first_ || last == pilot_.wide.frames.end() || first == pilot_.wide.frames.end()) return 1;
    const double before = get(first->second, costs, key), after = get(last->second, costs, key);
    if (!(before > (costs == &FrameCost::cpu ? kTiny : 0)) || !(after > 0)) return 1;
    const double share = std::min(1.0, double(frame - first_) / double(pilot_.last - first_));
    return 1 + share * (after / before - 1);
  }

  /// Of a frame, at the shot's size.
  double cost(Costs costs, const std::string& key, std::int64_t frame, double least) const {
    const auto found = pilot_.fine.frames.find(std::min(frame, first_));
    if (found == pilot_.fine.frames.end()) return 0;
    const double first = get(found->second, costs, key) * growth(costs, key, least);
    const auto last = pilot_.wide.frames.find(pilot_.last);
    if (!pours() || frame <= first_ || pilot_.last <= first_ || last == pilot_.wide.frames.end()) return first * later(costs, key, frame);
    // What pours has next to nothing in its first frames: its end is measured, and what is no picture's goes by the particles that are there.
    const double share = std::min(1.0, double(frame - first_) / double(pilot_.last - first_)), end = get(last->second, costs, key);
    if (is_picture(key)) return first + share * (picture_growth(pilot_.wide, costs, key, least) * end - first);
    if (key == "ledger") return first + share * (end - first);
    return line_through({{poured(pilot_.wide, first_), get(pilot_.wide.frames.at(first_), costs, key), 1}, {poured(pilot_.wide, pilot_.last), end, 1}}).at(particles_at(shot_, frame));
  }

  /// Particles of a run in a frame of a shot that pours.
  double poured(const MicroRun& run, std::int64_t frame) const { return run.particles / particles_ * particles_at(shot_, frame); }

  /// Cost by particles: some that is always there, and some for each.
  struct Line {
    double fixed = 0, each = 0;
    double at(double particles) const { return fixed + each * particles; }
  };
  struct Sample {
    double particles, cost, weight;
  };
  /// The nearest with nothing below 0, by weighted least squares.
  static Line line_through(const std::vector<Sample>& samples) {
    double w = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (const Sample& s : samples) w += s.weight, x += s.weight * s.particles, y += s.weight * s.cost, xx += s.weight * s.particles * s.particles, xy += s.weight * s.particles * s.cost;
    const double det = w * xx - x * x;
    if (!(det > 1e-9 * w * xx)) return {w > 0 ? y / w : 0, 0};
    const Line line{(y * xx - x * xy) / det, (w * xy - x * y) / det};
    if (line.each < 0) return {y / w, 0};
    if (line.fixed < 0) return {0, xy / xx};
    return line;
  }

  /// [s] of a step by particles, where a shot pours.
  Line poured_steps() const {
    std::vector<Sample> samples;
    for (const MicroRun* run : {&pilot_.wide, &pilot_.fine})
      for (const auto& [frame, cost] : run->frames) {
        double seconds = 0;
        for (const std::string& key : step_keys_) seconds += get(cost, &FrameCost::cpu, key);
        if (cost.steps > 0) samples.push_back({poured(*run, frame), seconds / cost.steps, cost.steps});
      }
    return line_through(samples);
  }

  double speed(std::int64_t frame) const {
    const auto fine = pilot_.fine.frames.find(frame);
    if (fine != pilot_.fine.frames.end()) return fine->second.speed;
    const auto wide = pilot_.wide.frames.find(std::min(frame, pilot_.last));
    return wide == pilot_.wide.frames.end() ? 0 : wide->second.speed;
  }

  double steps(std::int64_t frame) const {
    if (frame == 1) return 0;
    const auto fine = pilot_.fine.frames.find(frame);
    if (fine != pilot_.fine.frames.end() && pilot_.fine.cell == shot_.scene.options.cell) return fine->second.steps;
    const double expected = sim::steps_in_frame(shot_.scene, shot_.fps, speed(frame - 1), speed(frame));
    if (!shot_.scene.options.is_solid()) return expected;
    const auto wide = pilot_.wide.frames.find(std::clamp<std::int64_t>(frame, 2, pilot_.last));   // how much stiffer than at rest they are there
    if (wide == pilot_.wide.frames.end() || wide->second.steps == 0) return expected;
    sim::Scene coarse = shot_.scene;
    coarse.options.cell = pilot_.wide.cell;
    return expected * wide->second.steps / sim::steps_in_frame(coarse, shot_.fps, speed(frame - 1), speed(frame));
  }

  /// [s] a step of the passes of a step, over frames in (after, to].
  double step_cost(const MicroRun& run, std::int64_t after, std::int64_t to, const std::string& key) const {
    double seconds = 0, count = 0;
    for (const auto& [frame, c] : run.frames)
      if (frame > after && frame <= to) seconds += get(c, &FrameCost::cpu, key), count += c.steps;
    return count > 0 ? seconds / count : 0;
  }

  bool pours() const { return !shot_.scene.sources.empty(); }

  /// What a step costs later on, against the first frames, in the finest run that was followed so far.
  double late_steps() const {
    const MicroRun& run = pilot_.fine.frames.contains(pilot_.last) ? pilot_.fine : pilot_.wide;
    double early = 0, late = 0;
    for (const std::string& key : step_keys_) early += step_cost(run, 1, first_, key), late += step_cost(run, first_, pilot_.last, key);
    return early > 0 && late > 0 ? late / early : 1;
  }

  void add_simulation(std::int64_t frame, std::int64_t last, double late, Prediction& out) const {
    double& seconds = out.cpu["simulate"];
    seconds += steps(frame) * (pours() ? poured_.at(particles_at(shot_, frame)) : a_step_ * (frame > first_ ? late : 1));
    const auto found = pilot_.fine.frames.find(std::min(frame, first_));
    if (found != pilot_.fine.frames.end())
      for (const auto& [key, unused] : found->second.cpu) {
        if (!is_of(key, "simulate") || std::find(step_keys_.begin(), step_keys_.end(), key) != step_keys_.end()) continue;
        if (key != "simulate/checkpoint") seconds += cost(&FrameCost::cpu, key, frame, kTiny);
      }
    if (frame > 1 && (frame % shot_.checkpoint_every == 0 || frame == last)) {
      const double calls = sum(pilot_.fine, &FrameCost::calls, "simulate/checkpoint");
      if (calls > 0)
        seconds += sum(pilot_.fine, &FrameCost::cpu, "simulate/checkpoint") / calls * growth(&FrameCost::cpu, "simulate/checkpoint", kTiny);
    }
    for (const std::string kind : {"points", "ledger"}) out.disk[kind] += cost(&FrameCost::bytes, kind, frame, 1);
  }

  void add_pictures(std::int64_t frame, Prediction& out) const {
    const auto found = pilot_.fine.frames.find(std::min(frame, first_));
    if (found == pilot_.fine.frames.end()) return;
    for (const auto& [key, unused] : found->second.cpu) {
      if (is_of(key, "simulate")) continue;
      out.cpu[key.substr(0, key.find('/'))] += cost(&FrameCost::cpu, key, frame, kTiny);
    }
    for (const std::string kind : {"surface", "images"})
      if (const double bytes = cost(&FrameCost::bytes, kind, frame, 1); bytes > 0) out.disk[kind] += bytes;
  }

  /// Linear in particles and in pixels, and never less than what the plan says they hold.
  double memory() const {
    const MicroRun &small = pilot_.small, &wide = pilot_.wide, &fine = pilot_.fine;
    const auto slope = [](double from, double to, double size_from, double size_to, double least) {
      return size_to > 1.3 * size_from ? std::max(least, (to - from) / (size_to - size_from)) : least;
    };
    const double a_particle =
        slope(wide.peak_bytes, fine.peak_bytes, wide.particles, fine.particles, 2 * double(plan_of(shot_, Stage::simulate).bytes_per_particle()));
    const double a_pixel = slope(small.peak_bytes, wide.peak_bytes, small.pixels, wide.pixels, 15 * sizeof(float));
    return fine.peak_bytes + a_particle * (particles_ - fine.particles) + a_pixel * (pixels_ - fine.pixels);
  }

  const Shot& shot_;
  const Pilot& pilot_;
  double particles_ = 0, pixels_ = 0, samples_ = 0;   // particles at the shot's last frame
  double a_step_ = 0;                       // [s] among the first frames, at the shot's size
  Line poured_;                             // [s] a step, of a shot that pours
  std::int64_t first_ = 1;
  std::vector<std::string> step_keys_;
};

}  // namespace

double particles_at(const Shot& shot, std::int64_t frame) { return sim::particles_at(double(frame - 1) / shot.fps, shot.scene); }

double checkpoint_bytes(const Shot& shot, double particles, std::int64_t last) {
  std::int64_t written = last > 1 && last % shot.checkpoint_every != 0 ? 1 : 0;
  written += last / shot.checkpoint_every - (shot.checkpoint_every == 1 ? 1 : 0);
  return double(std::min(written, shot.checkpoint_keep)) * particles * double(plan_of(shot, Stage::simulate).state_bytes_per_particle());
}

double Prediction::cpu_seconds() const {
  double total = 0;
  for (const auto& [stage, seconds] : cpu) total += seconds;
  return total;
}

double Prediction::disk_bytes() const {
  double total = 0;
  for (const auto& [kind, bytes] : disk) total += bytes;
  return total;
}

Prediction predict(const Shot& shot, const Pilot& pilot, const FrameRange& range) { return Predictor(shot, pilot).predict(range); }

}  // namespace app
