#pragma once
// Variants on their way to being measured: what studies of problems and of shots share.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/study/cost.h"
#include "app/study/measured.h"
#include "base/error.h"

namespace app {

/// A variant, the keys that make it and what is known of it so far.
struct Trial {
  Variant variant;
  std::vector<std::string> sets;       // of the case and of the variant, in this order: "sim.transfer=apic"
  std::string hash;                    // of all that its outcome depends on
  KeptRuns kept;
};

/// A hash of the variant's whole text, of the program as it is built and of what else `more` says.
std::string trial_hash(const std::string& text, const std::string& more);

/// Throws the complaint of a varied key or value that no trial which has it accepts: a mistake, and no variant that cannot run.
void refuse_what_suits_none(const std::vector<Varied>&, const std::vector<Trial>&, const std::vector<std::optional<base::Complaint>>&);

/// Fills what is missing of `repeats` runs a trial, one of each in turn, after one that nobody counts; then, where `audit` is given, the one that
/// says where the energy went. A trial that fails is marked and not tried again. Whatever is measured is kept in files below `folder`.
using RunTrial = std::function<MeasuredRun(const Trial&, int repeat, std::string& failure)>;
void run_trials(std::vector<Trial>&, int repeats, const std::filesystem::path& folder, const RunTrial& run, const RunTrial& audit, base::Progress&);

/// Study::command, version and so on.
void sign(Study&, const CostOrder&, int repeats);

}  // namespace app
