#include "app/study/measured.h"

#include <algorithm>

#include "app/stages/document.h"
#include "app/study/front.h"
#include "base/atomic_file.h"
#include "base/error.h"

namespace app {
namespace {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
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
    take_runs(kept, trial);
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

void take_runs(const KeptRuns& kept, Variant& v) {
  if (kept.runs.empty()) return;
  const MeasuredRun& first = kept.runs.front();
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (const auto found = first.at("errors").find(kMeasureNames[m]); found != first.at("errors").end()) v.errors.value[m] = found->get<double>();
  const MeasuredRun& course = first.at("course");
  v.course = {course.at("time").get<std::vector<double>>(), course.at("energy").get<std::vector<double>>(),
              course.at("enstrophy").get<std::vector<double>>()};
  v.particles = first.at("particles"), v.steps = first.at("steps");
  std::vector<double> cpu;
  v.seconds.clear();
  for (const MeasuredRun& run : kept.runs) {
    v.seconds.push_back(run.at("seconds")), cpu.push_back(run.at("cpu_seconds"));
    v.peak_bytes = std::max(v.peak_bytes, run.at("peak_bytes").get<std::int64_t>());
  }
  v.cpu_seconds = median(cpu);
  sum_up_seconds(v);
  for (const auto& [name, cost] : first.at("passes").items()) {
    std::vector<double> wall, process;
    for (const MeasuredRun& run : kept.runs)
      wall.push_back(run.at("passes").at(name).at("seconds")), process.push_back(run.at("passes").at(name).at("cpu_seconds"));
    v.passes[name] = {cost.at("calls"), median(wall), median(process)};
  }
  if (!kept.audit.is_null()) v.energy_changes = kept.audit.at("energy_changes").get<std::map<std::string, double>>();
}

}  // namespace app
