#include "app/study/trials.h"

#include <tbb/info.h>

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "app/stages/hash.h"
#include "app/stages/interrupt.h"
#include "app/stages/machine.h"
#include "app/stages/stopwatch.h"
#include "app/version.h"
#include "base/checksum.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::string program_text() {
  static const std::string text = [] {
    const auto sum = base::sum_of("/proc/self/exe");
    return fmt::format("{} {} {:x} {}", kVersion, kCommit, sum ? sum->checksum : 0, processor_name());
  }();
  return text;
}

fs::path file_of(const Trial& trial, const fs::path& folder) { return folder / (trial.hash + ".json"); }

void make_folder(const fs::path& folder) {
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) base::throw_io(folder.string(), failure.message());
}

std::string progress_text(const Trial& t, const MeasuredRun& run) {
  return fmt::format("{}: {}   {:.3g} s", t.variant.part, t.variant.label, run.at("seconds").get<double>());
}

}  // namespace

std::string trial_hash(const std::string& text, const std::string& more) { return hex16(fnv1a(text + "\n" + more + "\n" + program_text())); }

void refuse_what_suits_none(const std::vector<Varied>& vary, const std::vector<Trial>& trials,
                            const std::vector<std::optional<base::Complaint>>& complaints) {
  for (const Varied& varied : vary)
    for (const std::string& value : varied.values) {
      const std::string set = varied.key + "=" + value;
      const base::Complaint* first = nullptr;
      bool suits = false, is_there = false;
      for (std::size_t i = 0; i < trials.size(); ++i) {
        if (std::find(trials[i].sets.begin(), trials[i].sets.end(), set) == trials[i].sets.end()) continue;
        is_there = true;
        suits = suits || !complaints[i];
        if (complaints[i] && !first) first = &*complaints[i];
      }
      if (!is_there || suits) continue;   // modes without polypic are in none
      base::Complaint complaint = *first;
      if (complaint.file.starts_with("--set ")) complaint.file.replace(0, 5, varied.option);
      complaint.code = base::Exit::user;
      throw base::Error(std::move(complaint));
    }
}

void read_kept_runs(std::vector<Trial>& trials, const TrialRuns& order) {
  for (Trial& t : trials)
    if (t.variant.ran()) t.kept = read_kept(file_of(t, order.folder), t.hash);
}

std::vector<Varied> all_varied(const CostOrder& order) {
  std::vector<Varied> all = order.vary;
  all.insert(all.end(), order.refine.begin(), order.refine.end());
  return all;
}

void refuse_what_is_given_twice(const CostOrder& order) {
  const std::vector<Varied> vary = all_varied(order);
  for (auto varied = vary.begin(); varied != vary.end(); ++varied) {
    const std::string option = varied->option + " " + varied->key;
    const auto is_same = [&](const Varied& other) { return other.key == varied->key; };
    if (std::any_of(vary.begin(), varied, is_same)) throw base::Error({.file = option, .message = "is given twice: all values go after one ="});
    for (const std::string& set : order.overrides.sets)
      if (set.starts_with(varied->key + "=")) throw base::Error({.file = option, .message = "is also given by --set " + set});
  }
}

void refuse_what_changes_nothing(const std::vector<Varied>& vary, const std::vector<Trial>& trials, const std::string& read_by) {
  for (const Varied& varied : vary) {
    std::map<std::vector<std::string>, std::vector<std::string>> texts;   // by what a trial has beside this key
    for (const Trial& t : trials) {
      std::vector<std::string> others = t.sets;
      std::erase_if(others, [&](const std::string& set) { return set.starts_with(varied.key + "="); });
      if (t.variant.ran()) texts[others].push_back(t.text);
    }
    bool compared = false, differs = false;
    for (const auto& [others, same] : texts)
      for (const std::string& text : same) compared = compared || same.size() > 1, differs = differs || text != same.front();
    if (compared && !differs)
      throw base::Error({.file = varied.option + " " + varied.key,
                         .message = "changes nothing that " + read_by + " reads: all its values make the same variant"});
  }
}

namespace {

bool is_missing(const Trial& t, int count) { return t.variant.ran() && int(t.kept.runs.size()) < count; }

/// That are still to be made, the audit among them.
int runs_of(const Trial& t, const TrialRuns& order) {
  if (!t.variant.ran()) return 0;
  return std::max(0, order.repeats - int(t.kept.runs.size())) + (order.audit && t.kept.audit.is_null());
}

void announce(const std::vector<Trial>& trials, const TrialRuns& order, const KnownRun& known, base::Progress& progress) {
  double seconds = 0, again = 0;   // where no run is made again; what those would take
  int runs = 0, more = 0;
  for (const Trial& t : trials)
    if (const int own = runs_of(t, order); own > 0) {
      const double one = known.around + known.seconds * order.size(t) / known.size;
      runs += own, seconds += own * one;
      if (order.repeats > 1 && is_missing(t, order.repeats)) more += order.repeats, again += order.repeats * one;
    }
  std::string text = fmt::format("{} to make, in about {}", runs, base::duration_text(seconds));
  if (more > 0) text += fmt::format(", and up to {} again where they disagree, {}", more, base::duration_text(again));
  for (const auto& [what, own] : order.besides) text += fmt::format("; {}, {}", what, base::duration_text(own)), seconds += own;
  const std::string most = more > 0 ? " to " + base::duration_text(seconds + again) : "";
  if (!order.besides.empty()) text += ": " + base::duration_text(seconds) + most + " in all";
  if (runs > 0) progress.line("runs   " + text);
}

/// One that nobody counts: it warms the caches of the disk and the clock of the processor.
std::optional<KnownRun> warm_up(const Trial& trial, const TrialRuns& order) {
  std::string failure;
  const Stopwatch watch;
  const MeasuredRun warm = order.run(trial, -1, failure);
  if (!failure.empty()) return {};
  const double seconds = warm.at("seconds");
  return KnownRun{seconds, std::max(0.0, watch.seconds() - seconds), order.size(trial)};
}

}  // namespace

void tell_plan(std::vector<Trial>& trials, const TrialRuns& order, const std::string& subject, bool names, base::Progress& progress) {
  read_kept_runs(trials, order);
  int runs = 0, made = 0;
  for (const Trial& t : trials) runs += runs_of(t, order), made += int(std::min(t.kept.runs.size(), std::size_t(order.repeats)));
  const std::string times = order.repeats == 1 ? "once" : fmt::format("{} times", order.repeats);
  progress.line(fmt::format("study  {} of {}, {} each{}: {}{}", base::count_of(trials.size(), "variant"), subject, times,
                            order.audit ? " and once more for the audit" : "", base::count_of(runs, "run"),
                            made > 0 ? fmt::format(", and {} made before", made) : ""));
  if (!names) return;
  for (const Trial& t : trials) {
    const std::string failure = t.variant.ran() ? "" : "   cannot run: " + t.variant.failure;
    progress.line("       " + t.variant.part + ": " + t.variant.label + failure);
  }
}

void tell_time(const std::vector<Trial>& trials, const TrialRuns& order, base::Progress& progress) {
  const auto first = std::find_if(trials.begin(), trials.end(), [&](const Trial& t) { return runs_of(t, order) > 0; });
  if (first == trials.end()) return;
  const auto known = order.known ? order.known : warm_up(*first, order);
  if (known) announce(trials, order, *known, progress);
}

void run_trials(std::vector<Trial>& trials, const TrialRuns& order, base::Progress& progress) {
  make_folder(order.folder);
  read_kept_runs(trials, order);
  const auto attempt = [&](Trial& t, const RunTrial& way, int repeat) {
    stop_if_signalled();
    std::string failure;
    MeasuredRun found = way(t, repeat, failure);
    if (failure.empty()) return found;
    t.variant.failure = failure;
    progress.line(t.variant.part + ": " + t.variant.label + "   could not run: " + failure);
    return MeasuredRun();
  };
  const auto add_run = [&](Trial& t, int repeat, const std::string& count) {
    const MeasuredRun found = attempt(t, order.run, repeat);
    if (!t.variant.ran()) return;
    t.kept.runs.push_back(found);
    write_kept(file_of(t, order.folder), t.hash, t.kept);
    progress.line(count + "   " + progress_text(t, found));
  };
  std::size_t kept = 0;
  for (const Trial& t : trials) kept += t.variant.ran() && !is_missing(t, order.repeats);
  if (kept > 0) progress.line(fmt::format("kept   {} of {}, measured before", kept, base::count_of(trials.size(), "variant")));
  std::optional<KnownRun> known = order.known;
  const auto first = std::find_if(trials.begin(), trials.end(), [&](const Trial& t) { return is_missing(t, order.repeats); });
  if (first != trials.end() && order.repeats > 1)
    if (const auto warm = warm_up(*first, order); warm && !known) known = warm;
  if (known) announce(trials, order, *known, progress);
  for (int repeat = 0; repeat < order.repeats; ++repeat)
    for (Trial& t : trials)
      if (is_missing(t, repeat + 1)) add_run(t, repeat, fmt::format("{:>2}/{}", repeat + 1, order.repeats));
  for (int again = 1; order.repeats > 1 && again <= order.repeats; ++again)
    for (Trial& t : trials)
      if (is_missing(t, order.repeats + again) && is_unsteady(t.kept.runs, order.repeats)) add_run(t, order.repeats, "again");
  for (Trial& t : trials) {
    if (!order.audit || !t.variant.ran() || !t.kept.audit.is_null()) continue;
    const MeasuredRun found = attempt(t, order.audit, 0);
    if (!t.variant.ran()) continue;
    t.kept.audit = found;
    write_kept(file_of(t, order.folder), t.hash, t.kept);
  }
  for (Trial& t : trials)
    if (t.variant.ran()) take_runs(t.kept, order.repeats, t.variant);
}

void sign(Study& study, const CostOrder& order, int repeats) {
  study.command = order.command;
  study.version = kVersion, study.commit = kCommit;
  study.threads = order.threads, study.repeats = repeats;
  study.processor = processor_name().empty() ? "an unknown processor" : processor_name(), study.cores = tbb::info::default_concurrency();
}

}  // namespace app
