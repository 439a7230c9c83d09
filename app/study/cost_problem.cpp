// Studies of problems with known answers.
#include <tbb/global_control.h>

#include <algorithm>
#include <map>

#include "app/stages/document.h"
#include "app/study/child.h"
#include "app/study/front.h"
#include "app/study/problem_shot.h"
#include "app/study/trials.h"
#include "base/error.h"

namespace app {
namespace {

constexpr int kRepeats = 3;
constexpr std::string_view kOwn = "problem.";

/// A case with the sets that make it.
struct Case {
  std::string name;
  std::vector<std::string> sets;
};

/// Those the problem knows, unless its own keys are varied or set.
std::vector<Case> cases_of(const sim::ProblemRow& row, const CostOrder& order) {
  std::vector<Varied> own;
  for (const Varied& v : order.vary)
    if (v.key.starts_with(kOwn)) own.push_back(v);
  std::vector<Case> cases;
  if (!own.empty()) {
    for (const Sets& sets : combinations(own)) cases.push_back({label_of({}, sets), set_texts(sets)});
  } else if (std::any_of(order.overrides.sets.begin(), order.overrides.sets.end(), [](const std::string& s) { return s.starts_with(kOwn); })) {
    cases.push_back({std::string(row.name), {}});
  } else {
    for (const sim::ProblemCase& c : row.cases) cases.push_back({c.name, c.sets});
  }
  return cases;
}

std::vector<Sets> schemes_of(const CostOrder& order, bool is_solid) {
  std::vector<Varied> others;
  for (const Varied& v : order.vary)
    if (!v.key.starts_with(kOwn)) others.push_back(v);
  return others.empty() ? scheme_ladder(is_solid) : combinations(others);
}

/// Every scheme with every combination of what is refined, as it is called and as it is set.
std::vector<std::pair<Sets, Sets>> refined(const std::vector<Sets>& schemes, const std::vector<Varied>& refine) {
  std::vector<std::pair<Sets, Sets>> all;
  for (const Sets& scheme : schemes)
    for (const Sets& more : combinations(refine)) {
      all.emplace_back(scheme, scheme);
      all.back().second.insert(all.back().second.end(), more.begin(), more.end());
    }
  return all;
}

/// The order's, or the problem's own. Throws where the problem has no such error.
Measure deciding_error(const sim::ProblemRow& row, const Study& study, const CostOrder& order) {
  const Measure own = measure_named(row.decides).value();
  if (!order.decides || !study.meaning[static_cast<std::size_t>(*order.decides)].empty()) return order.decides.value_or(own);
  std::string known;
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (!study.meaning[m].empty()) known += (known.empty() ? "" : ", ") + std::string(kMeasureNames[m]);
  throw base::Error({.file = "--error " + std::string(kMeasureNames[static_cast<std::size_t>(*order.decides)]),
                     .hint = std::string(row.name) + " has " + known, .message = "the problem has no such error"});
}

void refuse_cases_to_refine(const std::vector<Varied>& refine) {
  for (const Varied& v : refine)
    if (is_scheme_key(v.key)) throw base::Error({.file = "--refine " + v.key, .hint = "--vary " + v.key + " tries several", .message = "would make another scheme"});
    else if (v.key.starts_with(kOwn)) throw base::Error({.file = "--refine " + v.key, .hint = "--vary " + v.key + " makes a case of each value", .message = "would ask another question"});
}

Overrides with(const Overrides& all, const std::vector<std::string>& sets) {
  Overrides more = all;
  more.sets.insert(more.sets.end(), sets.begin(), sets.end());
  return more;
}

void describe(const sim::Options& o, Variant& v) {
  const SchemeNames names = scheme_names(o);
  v.transfer = names.transfer, v.kernel = names.kernel, v.modes = names.modes, v.splitting = names.splitting;
  v.cell = o.cell, v.cfl = o.cfl;
}

MeasuredRun run_single(const std::string& name, const CostOrder& order, const Trial& trial, const std::vector<std::string>& more,
                       std::string& failure) {
  std::vector<std::string> words = {"cost", name, "--single", "--threads", std::to_string(order.threads)};
  if (order.overrides.quality) words.insert(words.end(), {"--quality", *order.overrides.quality});
  for (const auto& list : {order.overrides.sets, trial.sets, more})
    for (const std::string& set : list) words.insert(words.end(), {"--set", set});
  const ChildEnd end = run_child(words);
  failure = end.failure;
  if (!failure.empty()) return {};
  return MeasuredRun::parse(end.out);
}

}  // namespace

Study study_of_problem(const sim::ProblemRow& row, const CostOrder& order, base::Progress& progress) {
  const std::string name(row.name);
  const ProblemShot usual = read_problem(row, order.overrides);
  if (order.frames) throw base::Error({.file = "--frames", .message = "is for shots: a problem ends at problem.time"});
  Study study;
  study.subject = name;
  study.title = std::string(row.meaning);
  const sim::ProblemMeanings& m = row.meanings;
  study.meaning = {m.energy, m.position, m.vorticity, m.volume, "", "", m.velocity};
  const Measure decides = deciding_error(row, study, order);
  refuse_cases_to_refine(order.refine);
  study.is_refined = !order.refine.empty();
  const std::vector<Varied> varied = all_varied(order);
  std::vector<Trial> trials;
  std::vector<std::optional<base::Complaint>> complaints;
  std::map<std::string, double> work;   // by the hash of a trial
  bool quality_says_something = !order.overrides.quality;
  for (const Case& c : cases_of(row, order)) {
    study.cases.push_back({c.name, decides, {}, {}});
    for (const auto& [scheme, sets] : refined(schemes_of(order, usual.shot.scene.options.is_solid()), order.refine)) {
      Trial& t = trials.emplace_back();
      t.variant.part = c.name, t.variant.keys = sets;
      t.sets = c.sets;
      for (std::string& set : set_texts(sets)) t.sets.push_back(std::move(set));
      complaints.emplace_back();
      try {
        const ProblemShot read = read_problem(row, with(order.overrides, t.sets));
        describe(read.shot.scene.options, t.variant);
        t.variant.label = label_of(read.shot.scene.options, sets), t.variant.scheme = label_of(read.shot.scene.options, scheme);
        t.hash = trial_hash(read.text, name + " " + std::to_string(order.threads));
        t.text = read.text, work[t.hash] = read.work;
        if (!quality_says_something) quality_says_something = read_problem(row, with({{}, order.overrides.sets}, t.sets)).text != read.text;
      } catch (const base::Error& e) {
        complaints.back() = e.complaint();
        t.variant.failure = base::to_line(e.complaint());
        for (const auto& [key, value] : sets) t.variant.label += (t.variant.label.empty() ? "" : " ") + value;
      }
    }
  }
  refuse_what_suits_none(varied, trials, complaints);
  refuse_what_changes_nothing(varied, trials, "the problem");
  if (!quality_says_something && std::all_of(trials.begin(), trials.end(), [](const Trial& t) { return t.variant.ran(); }))
    throw base::Error({.file = "--quality " + *order.overrides.quality, .message = kIdleQuality});
  const int repeats = order.repeats.value_or(kRepeats);
  sign(study, order, repeats);
  TrialRuns runs{.repeats = repeats, .folder = order.out / "variants", .run = {}, .audit = {}, .size = {}, .known = {}, .besides = {}};
  runs.size = [&](const Trial& t) { return work.at(t.hash); };
  runs.run = [&](const Trial& t, int, std::string& failure) { return run_single(name, order, t, {}, failure); };
  runs.audit = [&](const Trial& t, int, std::string& failure) { return run_single(name, order, t, {"sim.audit=true"}, failure); };
  tell_plan(trials, runs, name, order.dry_run, progress);
  if (order.dry_run) {
    tell_time(trials, runs, progress);
    return study;
  }
  run_trials(trials, runs, progress);
  for (Trial& t : trials) study.variants.push_back(std::move(t.variant));
  judge(study);
  return study;
}

std::string single_run(const sim::ProblemRow& row, const Overrides& overrides) {
  const ProblemShot read = read_problem(row, overrides);
  base::Ledger ledger;
  MeasuredRun run = measured(read.problem->run(read.shot.scene, ledger), ledger);
  run["peak_bytes"] = base::peak_memory();
  return document_text(run);
}

}  // namespace app
