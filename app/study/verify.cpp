#include "app/study/verify.h"

#include <fnmatch.h>

#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include <fmt/format.h>

#include "app/shot/shot.h"
#include "app/stages/interrupt.h"
#include "app/stages/stopwatch.h"
#include "app/study/verify_files.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

constexpr const char* kOfShots = "threads_and_restarts";
constexpr const char* kNoShots = "the shipped shots, and none lie beside the program";

/// `pattern` with * for any letters and ? for one.
bool matches(const std::string& text, const std::string& pattern) { return fnmatch(pattern.c_str(), text.c_str(), 0) == 0; }

bool is_meant(const sim::VerifyCase& c, const std::string& pattern) {
  return matches(c.name, pattern) || c.name.starts_with(pattern.ends_with('/') ? pattern : pattern + "/");
}

/// Names, and their beginnings up to each slash.
std::string nearest_name(const std::string& pattern, const std::vector<sim::VerifyCase>& all) {
  std::vector<std::string> names;
  for (const sim::VerifyCase& c : all)
    for (std::size_t end = c.name.find('/');; end = c.name.find('/', end + 1)) {
      const std::string part = c.name.substr(0, end);
      if (std::find(names.begin(), names.end(), part) == names.end()) names.push_back(part);
      if (end == std::string::npos) break;
    }
  return base::nearest_word(pattern, names);
}

Verdict judge(const sim::VerifyCase& c) {
  Verdict v;
  v.what = c;
  const Stopwatch watch;
  try {
    v.found = c.run();
    v.passed = sim::passes(c, v.found);
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& e) {
    v.found.outcome = "ended early";
    v.found.broken.push_back(e.what());
  }
  if (!std::isfinite(v.found.value)) v.found.broken.push_back("what it measures is not finite"), v.passed = false;
  v.seconds = watch.seconds();
  return v;
}

std::string line_of(const Verdict& v) {
  char text[200];
  std::snprintf(text, sizeof text, "%s  %6.1f s  %-64s ", v.passed ? "ok  " : "FAIL", v.seconds, v.what.name.c_str());
  std::string line = text + v.found.outcome;
  for (const std::string& b : v.found.broken) line += "; " + b;
  return line;
}

}  // namespace

std::vector<sim::VerifyCase> all_verify_cases() {
  std::vector<sim::VerifyCase> all = sim::verify_cases();
  for (sim::VerifyCase& c : file_cases()) all.push_back(std::move(c));
  return all;
}

std::vector<sim::CaseNotBuilt> cases_left_out() {
  std::vector<sim::CaseNotBuilt> all = sim::cases_not_built();
  if (shipped_shots().empty()) all.push_back({kOfShots, kNoShots, "case 21"});
  return all;
}

std::vector<sim::VerifyCase> chosen_cases(std::vector<sim::VerifyCase> all, const std::vector<std::string>& patterns, bool quick) {
  for (const std::string& pattern : patterns) {
    const auto meant = [&](const sim::VerifyCase& c) { return is_meant(c, pattern); };
    if (std::any_of(all.begin(), all.end(), meant)) continue;
    for (const sim::CaseNotBuilt& c : cases_left_out())
      if (matches(c.name, pattern) || pattern.starts_with(c.name + "/")) throw base::Error({.file = pattern, .message = "needs " + c.needs});
    const std::string nearest = nearest_name(pattern, all);
    throw base::Error({.file = pattern, .hint = nearest.empty() ? "polypic verify --list shows all" : "did you mean " + nearest + "?",
                       .message = "no such case"});
  }
  std::erase_if(all, [&](const sim::VerifyCase& c) {
    const bool meant = patterns.empty() || std::any_of(patterns.begin(), patterns.end(), [&](const std::string& p) { return is_meant(c, p); });
    return !meant || (quick && !c.is_quick);
  });
  if (all.empty())
    throw base::Error({.file = patterns.front(), .hint = "without --quick they run", .message = "--quick leaves out every case of this name"});
  return all;
}

std::vector<Verdict> run_cases(const std::vector<sim::VerifyCase>& cases, base::Progress& progress) {
  std::vector<std::optional<Verdict>> found(cases.size());
  std::vector<std::size_t> order(cases.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  // the long ones first, so that none is left over alone
  std::stable_partition(order.begin(), order.end(), [&](std::size_t i) { return !cases[i].is_quick; });
  std::mutex printing;
  tbb::parallel_for_each(order.begin(), order.end(), [&](std::size_t i) {
    if (signal_came()) return;
    found[i] = judge(cases[i]);
    const std::lock_guard<std::mutex> one_line(printing);
    progress.line(line_of(*found[i]));
  });
  stop_with_nothing_kept();
  std::vector<Verdict> all;
  for (auto& v : found) all.push_back(std::move(*v));
  return all;
}

namespace {

using Json = nlohmann::ordered_json;

/// What is known of a case before it runs.
Json case_json(const sim::VerifyCase& c) {
  return {{"name", c.name}, {"dimension", c.dimension}, {"transfer", c.transfer}, {"kernel", c.kernel}, {"integrator", c.integrator},
          {"expect", c.expect}};
}

Json not_built_json() {
  Json missing = Json::array();
  for (const sim::CaseNotBuilt& c : cases_left_out()) missing.push_back({{"name", c.name}, {"needs", c.needs}, {"source", c.source}});
  return missing;
}

}  // namespace

Json verdicts_json(const std::vector<Verdict>& all) {
  Json cases = Json::array();
  std::int64_t passed = 0;
  for (const Verdict& v : all) {
    std::string outcome = v.found.outcome;
    for (const std::string& b : v.found.broken) outcome += "; " + b;
    Json c = case_json(v.what);
    c["outcome"] = outcome;
    if (std::isfinite(v.found.value)) c["value"] = v.found.value;
    c["tolerance"] = v.what.tolerance, c["source"] = v.what.source, c["passed"] = v.passed, c["seconds"] = v.seconds;
    cases.push_back(std::move(c));
    passed += v.passed;
  }
  return {{"schema", 1}, {"cases", cases}, {"passed", passed}, {"failed", std::int64_t(all.size()) - passed}, {"not_built", not_built_json()}};
}

Json list_json(const std::vector<sim::VerifyCase>& all) {
  Json cases = Json::array();
  for (const sim::VerifyCase& what : all) {
    Json c = case_json(what);
    c["tolerance"] = what.tolerance, c["source"] = what.source, c["quick"] = what.is_quick;
    cases.push_back(std::move(c));
  }
  return {{"schema", 1}, {"cases", cases}, {"not_built", not_built_json()}};
}

std::string verdicts_text(const std::vector<Verdict>& all) {
  std::string text;
  std::int64_t passed = 0;
  for (const Verdict& v : all) passed += v.passed;
  for (const Verdict& v : all)
    if (!v.passed) text += line_of(v) + "\n      expected: " + v.what.expect + "; " + v.what.source + "\n";
  text += fmt::format("{}: {} passed, {} failed; not built, and counted apart: {}\n", base::count_of(all.size(), "case"), passed,
                      std::int64_t(all.size()) - passed, sim::cases_not_built().size());
  if (shipped_shots().empty()) text += std::string("left out: ") + kOfShots + " needs " + kNoShots + "\n";
  return text;
}

}  // namespace app
