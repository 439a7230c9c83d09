#pragma once
// The suite of hard cases: those of sim/verify.h and those about files, shots, restarts and threads. Runs them, and tells what they found.
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "base/progress.h"
#include "sim/verify.h"

namespace app {

/// A case that was run.
struct Verdict {
  sim::VerifyCase what;
  sim::CaseOutcome found;
  double seconds = 0;       // wall clock, others under way at the same time
  bool passed = false;
};

/// Every case the program knows, in the order of the table.
std::vector<sim::VerifyCase> all_verify_cases();

/// Cases that need what is not built, and those of the shipped shots where none lie beside the program.
std::vector<sim::CaseNotBuilt> cases_left_out();

/// Those whose name matches any of the patterns: a whole name, its beginning up to a slash, or a pattern with * and ?. All for no pattern. Throws
/// base::Error (exit 2) for a pattern that matches none, with the nearest name.
std::vector<sim::VerifyCase> chosen_cases(std::vector<sim::VerifyCase>, const std::vector<std::string>& patterns, bool quick);

/// Runs them, several at a time; a line each as they end, in no order. A case that throws has failed. Throws Interrupted.
std::vector<Verdict> run_cases(const std::vector<sim::VerifyCase>&, base::Progress&);

/// {cases: [...], passed, failed, not_built: [...]} as docs/files.md has it.
nlohmann::ordered_json verdicts_json(const std::vector<Verdict>&);
/// The same of cases that nobody has run yet: {cases: [...], not_built: [...]}.
nlohmann::ordered_json list_json(const std::vector<sim::VerifyCase>&);
/// The same as lines for people: failures first, then counts.
std::string verdicts_text(const std::vector<Verdict>&);
/// One page: all at a glance, then the tables, an energy curve and a picture of every case that has one, beside the pictures in `folder`.
/// `seconds` that all of it took on so many threads.
void write_verify_page(const std::vector<Verdict>&, double seconds, int threads, const std::filesystem::path& folder);

}  // namespace app
