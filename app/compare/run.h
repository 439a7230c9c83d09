#pragma once
// The directories of two runs, frame by frame and stage by stage. Seconds, memory, hosts and dates are no difference.
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "app/compare/compare.h"

namespace app {

/// Has a ledger with at least one frame in it.
bool is_run(const std::filesystem::path& directory);

/// {same, kind: "run", first: {frame, stage}, stages: [{stage, frames, differ, first, only_a, only_b, worst ...}]}. `frames` are those
/// both have, `differ` how many of them do. Two frames are in memory at a time.
nlohmann::ordered_json compare_runs(const std::filesystem::path& a, const std::filesystem::path& b, const Tolerance&);

}  // namespace app
