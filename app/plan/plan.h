#pragma once
// What a shot will do, stage by stage: the folders' plans joined, with the keys that decide and their values.
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <vector>

#include "app/shot/shot.h"
#include "app/stages/folder.h"
#include "base/plan.h"

namespace app {

/// What a stage may do, for its ledger.
base::Plan plan_of(const Shot&, Stage);

/// An effect as a person reads it.
struct ExplainedEffect {
  std::string name, stage;
  bool on = false;
  std::string key;     // that decided
  std::string value;   // as TOML; empty where the shot has none
};
/// Of the stages simulate, surface and render, in the order of the flow.
std::vector<ExplainedEffect> explained_effects(const Shot&);

/// Every row of every table, for tests: what keys belong to it, and the passes that it names.
struct Row {
  std::string name, stage;
  std::vector<std::string_view> keys, passes;
};
std::vector<Row> all_rows();

/// The names in all tables of passes.
std::set<std::string> all_passes();

/// Stages that a whole run of the shot has: pictures only where it has a [render].
std::vector<Stage> stages_of(const Shot&);

/// "liquid, linear kernel, 8 modes; off: gravity, colliders ...; 128 B a particle".
std::string plan_line(const Shot&);

/// {effects, attributes, bytes_per_particle, passes} as in `plan --json`.
nlohmann::ordered_json plan_json(const Shot&);

}  // namespace app
