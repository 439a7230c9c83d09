#pragma once
// Runs of a shot as `polypic` makes them, in directories of a study, and what their run.json says.
#include <filesystem>
#include <string>
#include <vector>

#include "app/study/cost.h"
#include "app/study/measured.h"

namespace app {

/// The shot with `sets` over it, simulated up to a frame.
struct ShotRun {
  std::filesystem::path shot, out;
  Overrides overrides;             // of the order and of the variant
  std::int64_t last = 1;           // frame
  int threads = 1;
};

/// Simulates in a process of its own, unless it is there already; an empty document and `failure` where it could not.
MeasuredRun simulate(const ShotRun&, std::string& failure);
/// Frames whose pictures, and surfaces in three dimensions, are not there as the shot is now.
std::vector<std::int64_t> missing_pictures(const ShotRun&, const std::vector<std::int64_t>& frames);
/// Makes those; says why not, or nothing.
std::string make_pictures(const ShotRun&, const std::vector<std::int64_t>& frames);
/// Of all its files.
std::int64_t disk_bytes(const std::filesystem::path& folder);

}  // namespace app
