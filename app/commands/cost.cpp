#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include "app/commands/commands.h"
#include "app/stages/document.h"
#include "app/stages/folder.h"
#include "app/stages/interrupt.h"
#include "app/stages/lock.h"
#include "app/study/cost.h"
#include "app/study/cost_report.h"
#include "app/study/study_files.h"
#include "app/study/trials.h"
#include "base/error.h"
#include "base/text.h"
#include "surface/surface.h"

namespace app {
namespace {

namespace fs = std::filesystem;

/// A shot, unless it is the name of a problem.
fs::path shot_of(const std::string& subject) {
  try {
    return find_shot(subject);
  } catch (const base::Error& e) {
    std::vector<std::string> names;
    for (const sim::ProblemRow& row : sim::problem_rows()) names.emplace_back(row.name);
    const std::string nearest = base::nearest_word(subject, names);
    if (!e.complaint().hint.empty()) throw;
    base::Complaint complaint = e.complaint();
    complaint.message = "no such file, and no shipped shot or problem of that name";
    complaint.hint = nearest.empty() ? "polypic list names them" : "did you mean " + nearest + "?";
    throw base::Error(std::move(complaint));
  }
}

Measure deciding_error(const std::string& word) {
  if (const std::optional<Measure> known = measure_named(word)) return *known;
  throw base::Error({.file = "--error " + word, .message = fmt::format("must be one of {}", fmt::join(kMeasureNames, ", "))});
}

/// One study at a time works in a directory, and measures.
class StudyLock {
 public:
  explicit StudyLock(const CostOrder& order) : out_(order.out) {
    if (order.dry_run) return;
    std::error_code failure;
    made_ = fs::create_directories(out_, failure);
    if (failure) base::throw_io(out_.string(), failure.message());
    const fs::path file = out_ / ".study.lock";
    if (std::optional<Lock> lock = Lock::try_take(file)) lock_.emplace(std::move(*lock));
    else base::throw_input(out_.string(), "in use by " + owner_of(file));
  }
  ~StudyLock() {
    lock_.reset();
    std::error_code none;
    if (made_) fs::remove(out_, none);   // where nothing came of it
  }
  StudyLock(const StudyLock&) = delete;
  StudyLock& operator=(const StudyLock&) = delete;

 private:
  fs::path out_;
  bool made_ = false;
  std::optional<Lock> lock_;
};

}  // namespace

bool cost(const Request& request) {
  const sim::ProblemRow* const problem = sim::find_problem(request.subject);
  const int cores = request.threads.value_or(tbb::info::default_concurrency());
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(cores));
  if (request.single) {
    if (!problem) throw base::Error({.file = "--single", .message = "is for problems"});
    std::fputs(single_run(*problem, request.overrides).c_str(), stdout);
    return true;
  }
  const fs::path shot = problem ? fs::path() : shot_of(request.subject);
  CostOrder order{.overrides = request.overrides, .vary = {}, .refine = {}, .decides = {}, .frames = request.frames,
                  .out = request.out.value_or(fs::path("out") / "cost" / (problem ? request.subject : shot.stem().string())),
                  .threads = cores, .repeats = request.repeats, .command = request.line, .dry_run = request.dry_run};
  for (const std::string& text : request.vary) order.vary.push_back(parse_vary(text));
  for (const std::string& text : request.refine) order.refine.push_back(parse_vary(text, "--refine"));
  if (!request.error.empty()) order.decides = deciding_error(request.error);
  refuse_what_is_given_twice(order);
  std::error_code failure;
  const fs::file_status there = fs::status(order.out, failure);
  if (failure && there.type() == fs::file_type::none) base::throw_io(order.out.string(), failure.message());
  if (fs::exists(there) && !fs::is_directory(there)) base::throw_io(order.out.string(), "Not a directory");
  Folder::refuse_for_other_reports(order.out);
  const StudyLock alone(order);
  catch_signals();
  surface::initialize();
  base::Progress progress(request.json ? stderr : stdout, request.quiet);
  const Study study = problem ? study_of_problem(*problem, order, progress) : study_of_shot(shot, order, progress);
  if (order.dry_run) return true;
  write_study(study, order.out);
  write_cost_report(study, order.out, progress);
  if (request.json) std::fputs(document_text(study_json(study)).c_str(), stdout);
  else std::fputs(study_table(study).c_str(), stdout);
  progress.line("done   " + (order.out / "report.html").string());
  return std::all_of(study.variants.begin(), study.variants.end(), [](const Variant& v) { return v.ran(); });
}

}  // namespace app
