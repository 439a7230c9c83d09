#include "app/study/trials.h"

#include <algorithm>

#include <fmt/format.h>

#include "app/stages/hash.h"
#include "app/stages/interrupt.h"
#include "app/version.h"
#include "base/checksum.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::string program_text() {
  static const std::string text = [] {
    const auto sum = base::sum_of("/proc/self/exe");
    return fmt::format("{} {} {:x}", kVersion, kCommit, sum ? sum->checksum : 0);
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
      if (complaint.file.starts_with("--set ")) complaint.file.replace(0, 5, "--vary");
      complaint.code = base::Exit::user;
      throw base::Error(std::move(complaint));
    }
}

void run_trials(std::vector<Trial>& trials, int repeats, const fs::path& folder, const RunTrial& run, const RunTrial& audit,
                base::Progress& progress) {
  make_folder(folder);
  for (Trial& t : trials)
    if (t.variant.ran()) t.kept = read_kept(file_of(t, folder), t.hash);
  const auto missing = [&](const Trial& t, int count) { return t.variant.ran() && int(t.kept.runs.size()) < count; };
  const auto attempt = [&](Trial& t, const RunTrial& way, int repeat) {
    stop_if_signalled();
    std::string failure;
    MeasuredRun found = way(t, repeat, failure);
    if (failure.empty()) return found;
    t.variant.failure = failure;
    progress.line(t.variant.part + ": " + t.variant.label + "   could not run: " + failure);
    return MeasuredRun();
  };
  const auto first = std::find_if(trials.begin(), trials.end(), [&](const Trial& t) { return missing(t, repeats); });
  if (first != trials.end() && repeats > 1) {
    std::string failure;
    run(*first, -1, failure);   // warms the caches of the disk and the clock of the processor
  }
  std::size_t kept = 0;
  for (const Trial& t : trials) kept += t.variant.ran() && !missing(t, repeats);
  if (kept > 0) progress.line(fmt::format("kept   {} of {} variants, measured before", kept, trials.size()));
  for (int repeat = 0; repeat < repeats; ++repeat)
    for (Trial& t : trials) {
      if (!missing(t, repeat + 1)) continue;
      const MeasuredRun found = attempt(t, run, repeat);
      if (!t.variant.ran()) continue;
      t.kept.runs.push_back(found);
      write_kept(file_of(t, folder), t.hash, t.kept);
      progress.line(fmt::format("{:>2}/{}   ", repeat + 1, repeats) + progress_text(t, found));
    }
  for (Trial& t : trials) {
    if (!audit || !t.variant.ran() || !t.kept.audit.is_null()) continue;
    const MeasuredRun found = attempt(t, audit, 0);
    if (!t.variant.ran()) continue;
    t.kept.audit = found;
    write_kept(file_of(t, folder), t.hash, t.kept);
  }
  for (Trial& t : trials)
    if (t.variant.ran()) take_runs(t.kept, t.variant);
}

void sign(Study& study, const CostOrder& order, int repeats) {
  study.command = order.command;
  study.version = kVersion, study.commit = kCommit;
  study.threads = order.threads, study.repeats = repeats;
}

}  // namespace app
