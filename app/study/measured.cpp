#include "app/study/measured.h"

#include <algorithm>
#include <array>
#include <limits>

#include "app/stages/document.h"
#include "app/study/front.h"
#include "base/atomic_file.h"
#include "base/error.h"

namespace app {
namespace {

/// The run with the median of `key`, or the two that it lies between: their passes add up to it, which medians of each pass would not.
std::array<const MeasuredRun*, 2> middle_runs(const std::vector<MeasuredRun>& runs, const char* key) {
  std::vector<const MeasuredRun*> sorted;
  for (const MeasuredRun& run : runs) sorted.push_back(&run);
  const auto value = [key](const MeasuredRun* run) { return run->at(key).get<double>(); };
  std::stable_sort(sorted.begin(), sorted.end(), [&](const MeasuredRun* a, const MeasuredRun* b) { return value(a) < value(b); });
  return {sorted[(sorted.size() - 1) / 2], sorted[sorted.size() / 2]};
}

template <class Of>
double mean(const std::array<const MeasuredRun*, 2>& runs, const Of& of) {
  return 0.5 * (of(*runs[0]) + of(*runs[1]));
}

}  // namespace

MeasuredRun measured(const sim::ProblemResult& result, const base::Ledger& ledger) {
  MeasuredRun run;
  MeasuredRun& errors = run["errors"] = MeasuredRun::object();
  const sim::ProblemErrors& e = result.errors;
  for (const auto& [measure, value] : {std::pair{Measure::energy, e.energy},
                                       {Measure::position, e.position},
                                       {Measure::vorticity, e.vorticity},
                                       {Measure::volume, e.volume},
                                       {Measure::velocity, e.velocity}})
    if (value) errors[std::string(kMeasureNames[static_cast<std::size_t>(measure)])] = *value;
  run["course"] = {{"time", result.time}, {"energy", result.energy}, {"enstrophy", result.enstrophy}};
  run["energy_changes"] = result.energy_changes;
  run["particles"] = result.particles, run["steps"] = result.steps;
  run["seconds"] = result.whole.seconds, run["cpu_seconds"] = result.whole.cpu_seconds;
  base::Ledger costs;
  base::PassCost other = result.whole;   // what no pass counts: the lengths of steps, sums, threads that wait
  for (const auto& [name, cost] : ledger.passes()) {
    costs.add(name, cost);
    other.seconds -= cost.seconds, other.cpu_seconds -= cost.cpu_seconds;
  }
  costs.add("other", {result.steps, std::max(0.0, other.seconds), 0, std::max(0.0, other.cpu_seconds)});
  MeasuredRun& passes = run["passes"] = MeasuredRun::object();
  for (const auto& [name, cost] : costs.passes())
    passes[name] = {{"calls", cost.calls}, {"seconds", cost.seconds}, {"cpu_seconds", cost.cpu_seconds}};
  return run;
}

KeptRuns read_kept(const std::filesystem::path& file, const std::string& hash) {
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return {};
  try {
    const MeasuredRun all = read_document(file, kLargestDocument);
    if (all.at("hash") != hash) return {};
    KeptRuns kept;
    for (const MeasuredRun& run : all.at("runs")) kept.runs.push_back(run);
    if (all.contains("audit")) kept.audit = all.at("audit");
    Variant trial;
    take_runs(kept, int(kept.runs.size()), trial);
    return kept;
  } catch (const std::exception&) {   // damaged: measured again
    return {};
  }
}

void write_kept(const std::filesystem::path& file, const std::string& hash, const KeptRuns& kept) {
  MeasuredRun all = {{"schema", 1}, {"hash", hash}, {"runs", kept.runs}};
  if (!kept.audit.is_null()) all["audit"] = kept.audit;
  base::write_text_atomically(file, document_text(all));
}

std::vector<MeasuredRun> fastest(const std::vector<MeasuredRun>& runs, int repeats) {
  std::vector<double> seconds;
  for (const MeasuredRun& run : runs) seconds.push_back(run.at("seconds"));
  std::sort(seconds.begin(), seconds.end());
  if (seconds.size() <= std::size_t(repeats)) return runs;
  std::vector<MeasuredRun> kept;
  for (const MeasuredRun& run : runs)
    if (run.at("seconds").get<double>() <= seconds[std::size_t(repeats) - 1] && kept.size() < std::size_t(repeats)) kept.push_back(run);
  return kept;
}

bool is_unsteady(const std::vector<MeasuredRun>& runs, int repeats) {
  constexpr double kSteady = 1.15;
  double least = std::numeric_limits<double>::max(), most = 0;
  for (const MeasuredRun& run : fastest(runs, repeats)) {
    const double seconds = run.at("seconds");
    least = std::min(least, seconds), most = std::max(most, seconds);
  }
  return most > kSteady * least;
}

void take_runs(const KeptRuns& kept, int repeats, Variant& v) {
  if (kept.runs.empty()) return;
  const MeasuredRun& first = kept.runs.front();
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (const auto found = first.at("errors").find(kMeasureNames[m]); found != first.at("errors").end()) v.errors.value[m] = found->get<double>();
  const MeasuredRun& course = first.at("course");
  v.course = {course.at("time").get<std::vector<double>>(), course.at("energy").get<std::vector<double>>(),
              course.at("enstrophy").get<std::vector<double>>()};
  v.particles = first.at("particles"), v.steps = first.at("steps");
  v.seconds.clear();
  const std::vector<MeasuredRun> counted = fastest(kept.runs, repeats);
  for (const MeasuredRun& run : counted) v.seconds.push_back(run.at("seconds"));
  for (const MeasuredRun& run : kept.runs) v.peak_bytes = std::max(v.peak_bytes, run.at("peak_bytes").get<std::int64_t>());
  sum_up_seconds(v);
  const auto by_clock = middle_runs(counted, "seconds"), by_cpu = middle_runs(counted, "cpu_seconds");
  v.cpu_seconds = mean(by_cpu, [](const MeasuredRun& run) { return run.at("cpu_seconds").get<double>(); });
  for (const auto& [name, cost] : first.at("passes").items()) {
    const auto of = [&](const char* key) { return [&name, key](const MeasuredRun& run) { return run.at("passes").at(name).at(key).get<double>(); }; };
    v.passes[name] = {cost.at("calls"), mean(by_clock, of("seconds")), mean(by_cpu, of("cpu_seconds"))};
  }
  if (!kept.audit.is_null()) v.energy_changes = kept.audit.at("energy_changes").get<std::map<std::string, double>>();
}

}  // namespace app
