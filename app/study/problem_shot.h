#pragma once
// A problem with a known answer, read like a shot: its own text, a table [problem] beside the shot's, --set over both.
#include <memory>
#include <string>
#include <vector>

#include "app/shot/shot.h"
#include "sim/problem.h"

namespace app {

struct ProblemShot {
  Shot shot;
  std::unique_ptr<sim::Problem> problem;
  std::string text;   // every key that the outcome depends on with its value, defaults included
  double work = 0;    // what a run takes, in proportion: particles times steps in a second, times problem.time where there is one
};

/// The problem's own keys: "problem.waves".
std::vector<KeyRow> problem_keys(const sim::ProblemRow&);

/// Throws base::Error (exit 2) as read_shot does, and where the problem has no answer for what is asked.
ProblemShot read_problem(const sim::ProblemRow&, const Overrides&);

}  // namespace app
