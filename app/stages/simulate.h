#pragma once
// First stage: scene -> points/points.0001.vdb.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/shot/shot.h"
#include "app/stages/checkpoints.h"
#include "app/stages/folder.h"
#include "sim/watch.h"

namespace app {

/// Makes the points that are missing in a run's directory, going on from the nearest checkpoint before each gap, or from frame 1.
/// What is computed again on the way must be what is there.
class PointsMaker {
 public:
  /// Seeds the scene when any frame is missing; `missing` in ascending order. Throws base::Error for a scene that cannot be simulated.
  PointsMaker(const Shot&, const Folder&, std::string hash, std::vector<std::int64_t> missing, base::Progress&);
  bool is_missing(std::int64_t frame) const;
  /// Missing frames in ascending order. Returns the seconds spent.
  double make(std::int64_t frame);
  /// Saves the latest frame that was reached, if none of the checkpoints holds it; returns the file, or an empty path when nothing
  /// but the start was reached.
  std::filesystem::path save() const;

 private:
  bool is_end(std::int64_t frame) const;
  void advance(base::Ledger&);
  void check_repeats() const;

  const Shot& shot_;
  const Folder& folder_;
  std::string hash_;
  std::vector<std::int64_t> missing_;
  Checkpoints checkpoints_;
  base::Progress& progress_;
  bool told_of_pressing_ = false;
  std::unique_ptr<sim::Watch> watch_;   // what it has reached is a whole frame: an interrupted simulation stands between two
};

}  // namespace app
