#pragma once
// The watch in every run: a simulation advances frame by frame, and what must hold is seen to hold. Each step compares mass and momentum on the
// grid with the particles'; each frame its energy, by term, with what it had and was given, its particles with those it started with, its
// coefficients and volume ratios with bounds. What breaks a law goes back to the frame's start and is done again with shorter steps and, where
// they misbehave, fewer modes; a frame that stays wrong ends the run with exit 3, the law, the place and the cause.
//
// All of it rides on sums that are there anyway: what breaks no law has the same bits with the watch and without.
#include <functional>
#include <memory>
#include <string>

#include "sim/simulation.h"

namespace sim {

/// A law that did not hold, and where.
struct Violation {
  std::string law;         // "finite", "mass", "momentum", "energy", "coefficients", "volume", "motion", "step", "pressure"
  std::string what;        // with the particle, cell, position and body where one is to blame
  std::string remedy;      // what to change
  int body = -1;           // number in the scene from 0; -1: not one alone
};

/// A violation in a frame, exit 3: "frame 12: energy: 3.1 J after ...".
class Unstable : public base::Error {
 public:
  Unstable(std::int64_t frame, Violation);
  const Violation& violation() const { return violation_; }

 private:
  Violation violation_;
};

class Watch {
 public:
  /// How often a frame is done again: with steps half as long; a quarter, and restrained modes; an eighth, and modes dropped. And how often a run has
  /// that done in all. Modes that were restrained stay so to the run's end.
  static constexpr int kMostRetries = 3, kMostRetriesOfARun = 24;
  /// Energy less the work done, over its least so far, may grow by this part of what that least was, and by this part of all that there ever was.
  /// Of what breaks no law a lone particle's energy swings by .14 at steps of 0.2 of its sound, and a liquid with one particle a cell by .25.
  static constexpr double kGain = 0.1, kShare = 0.25;
  /// The share where snow hardens: its moduli grow while it is strained, and what the strain stores with them.
  static constexpr double kShareOfSnow = 4;
  /// No coefficient is so many times as large as the speed that all energy together could give the whole.
  static constexpr double kLargestCoefficient = 1e5;
  /// No volume ratio J is beyond these.
  static constexpr double kLargestVolume = 1e6;

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
    double work = 0;        // [J] done since the start
    double particles = 0;   // seeded, less those that have left
    double retries = 0;     // frames done again
    double modes = 0, body = -1;   // what a Restraint was left with
  };
  void begin();
  double energy() const;    // [J] with potential energy from the lowest place in the domain, so that it is never below 0
  void check();             // throws Unstable
  void keep();
  std::int64_t state_bytes() const;

  std::unique_ptr<Simulation> simulation_;
  std::vector<std::string> bodies_;
  double slow_ = 0;         // [m/s] a speed that is as good as none: a hundredth of a cell a frame
  double collider_speed_ = 0;
  double share_ = kShare;
  double uphill_ = 0;       // [m^2/s^2] from the side that gravity pulls to, to where potential energy counts from
  State state_;
  Totals totals_;
  Memory memory_;
};

}  // namespace sim
