#pragma once
// What a stage will do, known from the shot before anything is allocated: which effects are on and what decided it, what every particle
// carries, which passes run and in which order. A folder describes its own effects in a table; what is in no table cannot run
// (base/ledger.h).
#include <algorithm>
#include <cassert>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace base {

/// An array with an entry a particle. `bytes` are those of an entry. What is not part of the state is kept by passes for their own work.
struct Attribute {
  std::string name;
  std::int64_t bytes = 0;
  bool is_state = true;
};

/// A pass: what it reads and writes are names of the stage's data, the same for all passes; often is how often it runs.
struct PassRow {
  enum class Often { once, frame, step };
  std::string_view name;
  Often often = Often::frame;
  std::vector<std::string_view> reads, writes;
};

/// An effect, as a row of its folder's table. `keys` are those of the shot that belong to it, as `polypic params` lists them or the
/// table that they are in ("sim.cfl", "collider.NAME"); a key of several choices names those that mean this effect
/// ("sim.transfer=flip"). The first key decides. `on` says whether any value in the shot asks for the effect. `passes` run because of it;
/// "bvh<mesh" does not make bvh run, but where it does, it reads the mesh because of this effect.
template <class Input>
struct EffectRow {
  using Keys = std::vector<std::string_view>;
  using Attributes = std::vector<Attribute> (*)(const Input&);

  std::string_view name;
  Keys keys;
  bool (*on)(const Input&);
  std::vector<std::string_view> passes;   // other effects may name them too
  Attributes attributes;                  // that particles carry because of it; same names add up

  EffectRow(std::string_view effect, Keys its_keys, bool (*is_on)(const Input&), std::vector<std::string_view> its_passes = {}, Attributes carried = nullptr)
      : name(effect), keys(std::move(its_keys)), on(is_on), passes(std::move(its_passes)), attributes(carried) {}
};

/// An effect of one shot.
struct PlannedEffect {
  std::string name, stage;
  bool on = false;
  std::vector<std::string_view> keys;
};

struct Plan {
  std::string stage;
  std::vector<PlannedEffect> effects;    // in the order of the table
  std::vector<Attribute> attributes;     // of the effects that are on
  std::vector<PassRow> passes;           // the same, in the order of work
  bool runs(std::string_view pass) const {
    return std::any_of(passes.begin(), passes.end(), [&](const PassRow& p) { return p.name == pass; });
  }
  bool is_on(std::string_view effect) const {
    return std::any_of(effects.begin(), effects.end(), [&](const PlannedEffect& e) { return e.on && e.name == effect; });
  }
  std::int64_t bytes_per_particle() const {
    std::int64_t sum = 0;
    for (const Attribute& a : attributes) sum += a.bytes;
    return sum;
  }
  /// Of these, what the state is: what a checkpoint holds.
  std::int64_t state_bytes_per_particle() const {
    std::int64_t sum = 0;
    for (const Attribute& a : attributes) sum += a.is_state ? a.bytes : 0;
    return sum;
  }
};

/// `passes`: all that the stage can run, in the order of work.
template <class Input>
Plan make_plan(std::string_view stage, std::span<const EffectRow<Input>> rows, std::span<const PassRow> passes, const Input& input) {
  Plan plan{std::string(stage), {}, {}, {}};
  const auto add = [&](const Attribute& a) {
    const auto same = std::find_if(plan.attributes.begin(), plan.attributes.end(), [&](const Attribute& b) { return b.name == a.name; });
    if (same == plan.attributes.end()) plan.attributes.push_back(a);
    else same->bytes += a.bytes;
  };
  std::vector<std::string_view> wanted;
  for (const EffectRow<Input>& row : rows) {
    const bool on = row.on(input);
    plan.effects.push_back({std::string(row.name), plan.stage, on, row.keys});
    if (!on) continue;
    wanted.insert(wanted.end(), row.passes.begin(), row.passes.end());
    if (row.attributes)
      for (const Attribute& a : row.attributes(input)) add(a);
  }
  for (const PassRow& pass : passes) {
    if (std::find(wanted.begin(), wanted.end(), pass.name) == wanted.end()) continue;
    PassRow& planned = plan.passes.emplace_back(pass);
    for (const std::string_view name : wanted) {
      const std::size_t end = name.find('<');
      if (end == std::string_view::npos || name.substr(0, end) != pass.name) continue;
      const std::string_view more = name.substr(end + 1);
      if (std::find(planned.reads.begin(), planned.reads.end(), more) == planned.reads.end()) planned.reads.push_back(more);
    }
  }
  return plan;
}

/// `second` goes on where `first` ends, in the same stage.
inline Plan joined(Plan first, const Plan& second) {
  first.effects.insert(first.effects.end(), second.effects.begin(), second.effects.end());
  first.attributes.insert(first.attributes.end(), second.attributes.begin(), second.attributes.end());
  first.passes.insert(first.passes.end(), second.passes.begin(), second.passes.end());
  return first;
}

}  // namespace base
