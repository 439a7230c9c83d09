#pragma once
// A simulation in time. Built from a scene; advances frame by frame.
#include <functional>
#include <limits>
#include <memory>

#include "base/error.h"
#include "base/ledger.h"
#include "sim/frame.h"
#include "sim/scene.h"
#include "sim/state.h"

namespace sim {

/// How steps that went wrong are done again (sim/watch.h).
struct Restraint {
  int halvings = 0;   // of steps
  double longest = std::numeric_limits<double>::infinity();   // [s] of a step
  int modes = 0;      // 1: nothing reflects, and a solid's carry is the next stricter one, fixed -> hybrid -> limited; 2: limited, and modes with a g factor
                      // are dropped beside light nodes, and at the frame's start where a coefficient is above the fastest particle's speed
  int body = -1;      // whose carry: its number in the scene; -1: all bodies'
};

class Simulation {
 public:
  virtual ~Simulation() = default;
  /// For the steps from here on.
  virtual void restrain(const Restraint&) = 0;
  /// Goes on to the next frame (1/fps later) in as many sub-steps as stability asks. Costs go to `ledger`.
  /// Throws base::Error with Exit::unstable naming pass, place and cause. Between sub-steps `interrupted` is asked; when it says
  /// true the call returns false and the simulation stands between frames.
  bool advance(base::Ledger& ledger, const std::function<bool()>& interrupted);

  /// What `advance` consists of: begin_frame, advance_step until nothing is left of the frame, end_frame. Both of the first return what is left [s].
  virtual double begin_frame() = 0;
  virtual double advance_step(double left, base::Ledger&) = 0;
  virtual void end_frame(base::Ledger&) = 0;
  /// A copy, counters included, to go back to before the frame ends: what comes then has the bits that came the first time.
  class Moment {
   public:
    virtual ~Moment() = default;
  };
  virtual std::unique_ptr<Moment> moment() const = 0;
  virtual void go_back(const Moment&) = 0;

  virtual Frame frame() const = 0;    // the particles now
  virtual Totals totals() const = 0;  // the sums now; counters since the frame before
  /// All that the future depends on, to the bit.
  virtual State state() const = 0;
  /// Stands where `state` was taken, from the same scene. Throws base::Error when the state does not fit the scene.
  virtual void restore(const State&) = 0;
};

/// Particles seeded, grid allocated, at t = 0 and frame 1. Throws base::Error when a body gets no particle.
std::unique_ptr<Simulation> make_simulation(const Scene& scene, double fps);

}  // namespace sim
