#pragma once
// Variants on their way to being measured: what studies of problems and of shots share.
#include <filesystem>
#include <functional>
#include <optional>
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
  std::string text;                    // of the keys among that
  KeptRuns kept;
};

/// A hash of the variant's whole text, of the program as it is built and of what else `more` says.
std::string trial_hash(const std::string& text, const std::string& more);

/// Throws the complaint of a varied key or value that no trial which has it accepts: a mistake, and no variant that cannot run.
void refuse_what_suits_none(const std::vector<Varied>&, const std::vector<Trial>&, const std::vector<std::optional<base::Complaint>>&);

/// What is varied, and then what is refined.
std::vector<Varied> all_varied(const CostOrder&);

/// Throws where a key is varied twice, or set as well ("--vary sim.cell: ...").
void refuse_what_is_given_twice(const CostOrder&);

/// Throws where a varied key makes no difference to any variant ("--vary shot.frames: changes nothing ...").
void refuse_what_changes_nothing(const std::vector<Varied>&, const std::vector<Trial>&, const std::string& read_by);

/// One run of a trial; what is wrong with it goes to `failure`. A repeat of -1 is not counted.
using RunTrial = std::function<MeasuredRun(const Trial&, int repeat, std::string& failure)>;
/// What one run took: what it measured [s], beside what its process took with start and end [s], and its size.
struct KnownRun {
  double seconds = 0, around = 0, size = 1;
};
inline constexpr const char* kIdleQuality = "changes nothing here: every variant sets itself what a quality sets";

struct TrialRuns {
  int repeats = 1;
  std::filesystem::path folder;
  RunTrial run, audit;
  std::function<double(const Trial&)> size;
  std::optional<KnownRun> known;       // of a run that was made before, if there is one
  std::vector<std::pair<std::string, double>> besides;   // [s] that the study takes beside its runs: what, and how long
};
/// Fills what is missing of `repeats` runs a trial, one of each in turn, after one that nobody counts; of those whose runs differ too much, up to
/// as many once more; then, where `audit` is given, the one that says where the energy went. A trial that fails is marked and not tried again.
/// Whatever is measured is kept in files below `folder`. `size` says how much a trial is to run, in units of its own: for the line that says how
/// long it will take.
void run_trials(std::vector<Trial>&, const TrialRuns&, base::Progress&);

/// What was measured before.
void read_kept_runs(std::vector<Trial>&, const TrialRuns&);
/// A line with the number of variants and of runs; and where all are to be named a line each.
void tell_plan(std::vector<Trial>&, const TrialRuns&, const std::string& subject, bool names, base::Progress&);
/// Makes one run that nobody counts, unless one is known, and says how long all take.
void tell_time(const std::vector<Trial>&, const TrialRuns&, base::Progress&);

/// Study::command, version and so on.
void sign(Study&, const CostOrder&, int repeats);

}  // namespace app
