#pragma once
// From a pilot's micro-runs to what a shot will cost.
#include <map>
#include <string>
#include <vector>

#include "app/plan/pilot.h"

namespace app {

/// Of the frames asked for, all stages. Seconds are those of all threads; making the movie is not among them.
struct Prediction {
  std::map<std::string, double> cpu;        // [s] by stage
  std::map<std::string, double> disk;       // [bytes] by kind: "points", "surface", "images", "checkpoint", "ledger"
  double peak_bytes = 0;
  double frames = 0;
  double cpu_seconds() const;
  double disk_bytes() const;
};

/// Costs are scaled from the fine run with powers of the number of particles and of pixels (or samples) that the three runs show; a
/// simulation's pass goes by steps, and those of a frame by the speed that the coarse run had in it.
Prediction predict(const Shot&, const Pilot&, const FrameRange&);

/// Where none leaves.
double particles_at(const Shot&, std::int64_t frame);

/// [bytes] of the checkpoints that are kept when frame `last` is made; they are not compressed.
double checkpoint_bytes(const Shot&, double particles, std::int64_t last);

/// What a finished run cost, against what was said before.
struct Outcome {
  std::string shot;
  double cpu_predicted = 0, cpu = 0;        // [s]
  double memory_predicted = 0, memory = 0;  // [bytes]
  double disk_predicted = 0, disk = 0;      // [bytes]
};
/// The latest runs on this machine, oldest first.
std::vector<Outcome> past_outcomes();
void keep_outcome(const Outcome&);
/// "CPU 6 %, memory 2 %, disk 3 % (median of 5 runs)"; empty where there are none.
std::string error_text(const std::vector<Outcome>&);

}  // namespace app
