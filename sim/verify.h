#pragma once
// The hard cases of the method: each sets one up, runs it and says whether what must hold does. `polypic verify` runs them all;
// docs/stability/cases.md lists them. An expected failure is a case too: it passes when it fails as said.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/frame.h"
#include "sim/scene.h"

namespace sim {

/// What a case found.
struct CaseOutcome {
  double value = 0;                       // what the case measures; must not be above its tolerance
  std::string outcome;                    // the same in words
  std::vector<std::string> broken;        // what else should hold and does not
  std::vector<double> time, energy;       // [s] and the energy then over the one at the start; empty where nothing is simulated
  std::optional<Frame> picture;           // where it ended
  std::optional<Scene> scene;             // that the picture is of
};

struct VerifyCase {
  std::string name;                       // "spinning_disk/2d/polypic9/hybrid/double": what, and the choices that the covering pairs
  int dimension = 2;
  std::string transfer, kernel;           // "polypic27", "quadratic"; "any" where none is involved
  std::string integrator;                 // "explicit", of fluids "lie" or "reflection"; "any" where nothing moves
  std::string expect;                     // what must hold
  double tolerance = 0;                   // in the unit of the value
  std::string source;                     // of the expectation
  bool is_quick = true;                   // takes seconds
  std::function<CaseOutcome()> run;
};

bool passes(const VerifyCase&, const CaseOutcome&);

/// All cases that particles, grids and materials can show by themselves; every name is there once. They do not depend on each other.
std::vector<VerifyCase> verify_cases();

/// A hard case of something that the program does not offer: a shot that asks for it is refused.
struct CaseNotBuilt {
  std::string name, needs, source;
};
std::vector<CaseNotBuilt> cases_not_built();

}  // namespace sim
