#pragma once
// What one run of one variant says of itself, as a JSON document, and the documents of a variant that are kept:
//
//   {"errors": {...}, "course": {"time", "energy", "enstrophy"}, "energy_changes": {...}, "particles", "steps", "seconds", "cpu_seconds",
//    "peak_bytes", "passes": {NAME: {"calls", "seconds", "cpu_seconds"}}}
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/study/study.h"
#include "sim/problem.h"

namespace app {

using MeasuredRun = nlohmann::ordered_json;

/// Of a problem that was run with `ledger`.
MeasuredRun measured(const sim::ProblemResult&, const base::Ledger& ledger);

/// Runs of a variant, and one more that told where its energy went; those of another `hash` are none of them.
struct KeptRuns {
  std::vector<MeasuredRun> runs;
  MeasuredRun audit;              // null where it was not made
};
KeptRuns read_kept(const std::filesystem::path& file, const std::string& hash);
void write_kept(const std::filesystem::path& file, const std::string& hash, const KeptRuns&);

/// Something else that runs on the machine only makes a run slower: the fastest `repeats` of all that were made count, in the order they ran.
std::vector<MeasuredRun> fastest(const std::vector<MeasuredRun>&, int repeats);
/// Whether those differ by more than a run should: another may be steadier.
bool is_unsteady(const std::vector<MeasuredRun>&, int repeats);

/// What the runs say, into the variant: errors and course of the first, medians of the costs of the fastest `repeats`.
void take_runs(const KeptRuns&, int repeats, Variant&);

}  // namespace app
