#pragma once
// Problems with known answers: what a scheme gets wrong of them is its error, and nobody has to be asked for the truth. A problem is a shot's
// text without pictures, with a table [problem] of its own; every key of [sim] can be varied.
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/ledger.h"
#include "base/params.h"
#include "sim/scene.h"

namespace sim {

/// Errors against the answer, relative to it unless the problem says otherwise; never negative, absent where the problem has no such answer.
struct ProblemErrors {
  std::optional<double> energy, position, vorticity, volume, velocity;
};

/// A kind of error in words, with its unit; empty where the problem has none.
struct ProblemMeanings {
  std::string energy, position, vorticity, volume, velocity;
};

struct ProblemResult {
  ProblemErrors errors;
  std::vector<double> time;              // [s], from 0
  std::vector<double> energy;            // [1] of that at the start, at each time
  std::vector<double> enstrophy;         // [1] the same, or empty
  std::map<std::string, double> energy_changes;   // [1] of the energy at the start, by stage (sim/energy_audit.h); empty unless sim.audit
  double particle_energy = 1;            // [1] of the particles at the end, over that at the start: what the changes add up to, and 1
  std::int64_t particles = 0, steps = 0;
  base::PassCost whole;                  // all steps together, without what measures them
};

class Problem {
 public:
  virtual ~Problem() = default;
  /// The keys of [problem].
  virtual void params(base::Params&) = 0;
  /// The shot's text: [shot], [sim], bodies and effects, as the reader of shots takes them.
  virtual std::string shot() const = 0;
  /// Says what of `scene` has no answer ("sim.dimension: must be 2 here"), or nothing.
  virtual std::string objection(const Scene& scene) const = 0;
  /// Passes of the steps go to `ledger`. Throws base::Error as Simulation::advance does.
  virtual ProblemResult run(const Scene& scene, base::Ledger& ledger) const = 0;
};

/// Values of [problem] that belong together, with what they are called: "8 cells a wavelength".
struct ProblemCase {
  std::string name;
  std::vector<std::string> sets;         // "problem.waves=8"
};

struct ProblemRow {
  std::string_view name, meaning;        // meaning: what flows or swings, what its answer is and from where
  std::string_view decides;              // the error that ranks schemes: "energy" | "position" | "vorticity" | "volume" | "velocity"
  std::unique_ptr<Problem> (*make)();
  std::vector<ProblemCase> cases;        // at least one, in the order to show
  ProblemMeanings meanings;
};
/// All of them.
std::span<const ProblemRow> problem_rows();
/// nullptr where there is none of that name.
const ProblemRow* find_problem(std::string_view name);

}  // namespace sim
