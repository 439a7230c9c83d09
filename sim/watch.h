#pragma once
// The watch in every run: a simulation advances frame by frame, and what must hold is seen to hold. Each step compares mass and momentum on the
// grid with the particles'; each frame its energy, by term, with what it had and was given, its particles with those it started with, its
// coefficients and volume ratios with bounds. A frame that breaks a law is done again from its start, with a copy before every step and every law
// seen to after it; the step that breaks one is done again from its start, shorter and, where they misbehave, with fewer modes. Where that does not
// help, all of the frame is done once more with the shortest steps and the fewest modes; then the run ends with exit 3, the law, the place, the
// cause.
//
// All of it rides on sums that are there anyway: what breaks no law has the same bits with the watch and without, and holds no copies.
#include <functional>
#include <memory>
#include <string>

#include "sim/simulation.h"
#include "sim/violation.h"

namespace sim {

class Watch {
 public:
  /// How often a step is done again: half as long; a quarter, with restrained modes; an eighth, with modes dropped. And how often a run has gone back
  /// in all, to the start of a step or of a frame. Steps are as long as ever after one that was shortened; modes that were restrained stay so.
  static constexpr int kMostRetries = 3, kMostRetriesOfARun = 48;
  /// Energy less the work done, over its least so far, may grow by this part of what that least was, and by this part of all that there ever was.
  /// Of what breaks no law a lone particle's energy swings by .14 at steps of 0.2 of its sound, and a liquid with one particle a cell by .25.
  static constexpr double kGain = 0.1, kShare = 0.25;
  /// The share where snow hardens: its moduli grow while it is strained, and what the strain stores with them.
  static constexpr double kShareOfSnow = 4;
  /// No coefficient is so many times as large as the speed that all energy together could give the whole.
  static constexpr double kLargestCoefficient = 1e5;
  /// No volume ratio J is beyond these.
  static constexpr double kLargestVolume = 1e6;
  /// Nor are all of them below this.
  static constexpr double kLeastVolume = 1e-5;

  /// Of the scene's simulation; throws as make_simulation does.
  Watch(const Scene& scene, double fps) : Watch(scene, fps, make_simulation(scene, fps)) {}
  /// Of one that is there already, at its first frame.
  Watch(const Scene&, double fps, std::unique_ptr<Simulation>);

  /// As Simulation::advance. Throws Unstable for what stays wrong, and base::Error as the simulation does.
  bool advance(base::Ledger&, const std::function<bool()>& interrupted);
  /// At the last whole frame. The watch's own memory goes with it.
  const State& state() const { return state_; }
  const Totals& totals() const { return totals_; }
  void restore(const State&);
  Simulation& simulation() { return *simulation_; }
  const Simulation& simulation() const { return *simulation_; }

 private:
  /// What it remembers from frame to frame, as a checkpoint's column "watch".
  struct Memory {
    double start = 0;       // [J] energy at the start, and what work added to it
    double least = 0;       // [J] running minimum of energy less work
    double least_at = 1;    // frame that it is of
    double work = 0;        // [J] done since the start
    double particles = 0;   // seeded, less those that have left
    double retries = 0;     // times it went back
    double since = 0;       // first of the frames without a break that it went back in; 0: the last one was well
    double modes = 0, body = -1;   // what a Restraint was left with
  };
  void begin();
  /// What it remembers of a frame that has come so far; throws Unstable.
  Memory checked(const Memory& before, const Totals&) const;
  /// Stands at the frame that was reached.
  void accept(const Memory& before, const Memory& now, const Totals&);
  /// The frame from its start, step by step. False where it was interrupted; throws Unstable for a step that stays wrong.
  bool again(const Memory& before, base::Ledger&, const std::function<bool()>& interrupted);
  /// Counts another going back, or throws what it is about where there were enough.
  void count(const Memory& before, const base::Error&);
  /// Of steps that were `span` [s] long at most.
  void restrain_more(const base::Error&, int halvings, double span);
  [[noreturn]] void stop(const Memory& before, const base::Error&, const std::string& tried);
  void keep();
  std::int64_t state_bytes() const;

  std::unique_ptr<Simulation> simulation_;
  Scene scene_;
  double frame_ = 0;        // [s]
  double slow_ = 0;         // [m/s] a speed that is as good as none: a hundredth of a cell a frame
  double collider_speed_ = 0;
  double share_ = kShare;
  double unresolved_ = 0;   // [m^2/s^2] what a liquid gains that rises by a cell: a surface is known to a part of that
  State state_;
  Totals totals_;
  Memory memory_;
  Restraint restraint_;     // of the frame at hand
  std::int64_t retries_ = 0;   // in it
  bool has_stopped_ = false;
};

}  // namespace sim
