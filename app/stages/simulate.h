#pragma once
// First stage: scene -> points/points.0001.vdb.
#include <cstdint>
#include <memory>
#include <string>

#include "app/shot/shot.h"
#include "app/stages/folder.h"
#include "sim/simulation.h"

namespace app {

/// Brings a run's directory to have the points of frames 1, 2, ... Frames that are finished are kept; a missing one makes the
/// simulation start at frame 1, and what it recomputes must be what is there.
class PointsMaker {
 public:
  /// Seeds the scene when any frame of 1 ... `last` is missing, or all are wanted `anew`; throws base::Error for a scene that
  /// cannot be simulated.
  PointsMaker(const Shot&, const Folder&, std::string hash, std::int64_t last, bool anew);
  bool has_work() const { return simulation_ != nullptr; }
  /// Frames come in ascending order from 1, and only when there is work. Returns the seconds spent.
  double make(std::int64_t frame);

 private:
  void check_repeats(std::int64_t frame, std::uint64_t state_hash) const;

  const Folder& folder_;
  std::string hash_;
  std::unique_ptr<sim::Simulation> simulation_;
};

}  // namespace app
