#pragma once
// A problem with a known answer, read like a shot: its own text, a table [problem] beside the shot's, --set over both.
#include <memory>
#include <string>

#include "app/shot/shot.h"
#include "sim/problem.h"

namespace app {

struct ProblemShot {
  Shot shot;
  std::unique_ptr<sim::Problem> problem;
  std::string text;   // every key with its value, defaults included
};

/// Throws base::Error (exit 2) as read_shot does, and where the problem has no answer for what is asked.
ProblemShot read_problem(const sim::ProblemRow&, const Overrides&);

}  // namespace app
