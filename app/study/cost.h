#pragma once
// The engine of `polypic cost`: every variant runs in a process of its own, several times and in turns, and what it got wrong stands beside what it
// took.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/shot/shot.h"
#include "app/stages/film.h"
#include "app/study/study.h"
#include "app/study/variants.h"
#include "base/progress.h"
#include "sim/problem.h"

namespace app {

struct CostOrder {
  Overrides overrides;                 // of every variant
  std::vector<Varied> vary;            // empty: the ladder of schemes
  std::vector<Varied> refine;          // of problems: every variant at every value of these; how long each takes to an error is said then
  std::optional<Measure> decides;      // the kind of error that ranks; else the subject's own
  std::optional<FrameRange> frames;    // of shots
  std::filesystem::path out;           // the study's directory
  int threads = 1;
  std::optional<int> repeats;          // of each variant's clock; 3 for problems, 2 for shots
  std::string command;                 // as typed
  bool dry_run = false;                // says what would be run, and about how long, and measures nothing
};

/// Variants that are measured already are not run again. Throws base::Error (exit 2) where a key or value suits no variant at all.
Study study_of_problem(const sim::ProblemRow&, const CostOrder&, base::Progress&);
Study study_of_shot(const std::filesystem::path& shot, const CostOrder&, base::Progress&);

/// Runs the problem once, here, and returns what it measured (measured.h) as text: what every variant's process does.
std::string single_run(const sim::ProblemRow&, const Overrides&);

/// cost.csv and cost.json, and all that the report draws.
void write_study(const Study&, const std::filesystem::path& out);

}  // namespace app
