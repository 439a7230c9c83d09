#include "app/plan/plan.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "render/plan.h"
#include "sim/plan.h"
#include "surface/plan.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

// Effects of the program itself.
std::span<const base::EffectRow<Shot>> own_rows() {
  static const std::vector<base::EffectRow<Shot>> rows = {
      {"film", {"shot.frames", "shot.up", "shot.quality"}, [](const Shot&) { return true; }},
      {"checkpoints", {"shot.checkpoint_every", "shot.checkpoint_keep"}, [](const Shot&) { return true; }, {"checkpoint"}},
  };
  return rows;
}

std::span<const base::PassRow> own_pass_rows() {
  static const std::vector<base::PassRow> rows = {{"checkpoint", base::PassRow::Often::frame, {"particles"}, {"checkpoint file"}}};
  return rows;
}

surface::Task surface_task(const Shot& shot) {
  const std::vector<bool>& flows = shot.render.body_flows;
  return {.options = shot.surface, .dimension = shot.scene.options.dimension, .has_solids = !shot.scene.colliders.empty(),
          .parts_bodies = shot.render.parts_bodies(), .wets_bodies = shot.render.parts_bodies() && std::find(flows.begin(), flows.end(), true) != flows.end()};
}

// "sim.transfer=flip" -> "sim.transfer", "flip"
std::pair<std::string_view, std::string_view> split(std::string_view key) {
  const std::size_t equals = key.find('=');
  return equals == std::string_view::npos ? std::pair{key, std::string_view()} : std::pair{key.substr(0, equals), key.substr(equals + 1)};
}

bool lies_under(const std::vector<std::string>& table, const std::vector<std::string>& key) {
  if (key.size() < table.size()) return false;
  for (std::size_t i = 0; i < table.size(); ++i)
    if (table[i] != key[i] && table[i] != "NAME" && table[i] != "N") return false;
  return true;
}

// Whether a value as text asks for nothing: 0, a vector of zeros, false, or an empty text.
bool is_nothing(const std::string& value) { return value == "false" || value == "\"\"" || value.find_first_not_of("[]-., 0") == std::string::npos; }

// The first key of the shot that one of the effect's keys means, and its value: of an effect that is on one that asks for something, of choices the
// effect's own. One that is off is so by what its first key means: where the shot has none, that key itself, or its table.
std::pair<std::string, std::string> deciding(const base::PlannedEffect& effect, const std::vector<std::pair<std::string, std::string>>& values) {
  const std::vector<std::string_view>& row_keys = effect.keys;
  const std::pair<std::string, std::string>* first = nullptr;
  const bool of_choices = row_keys.front().find('=') != std::string_view::npos;
  for (const std::string_view key : row_keys) {
    if (!effect.on && !of_choices && key != row_keys.front()) break;
    const auto [pattern, choice] = split(key);
    if (choice.empty() == of_choices) continue;
    const std::vector<std::string> table = parts_of(pattern);
    for (const auto& entry : values) {
      if (!lies_under(table, parts_of(entry.first))) continue;
      if (of_choices ? entry.second == '"' + std::string(choice) + '"' : !is_nothing(entry.second)) return entry;
      if (!first && entry.second != "\"\"" && (of_choices || key == row_keys.front())) first = &entry;
    }
  }
  if (first && !(effect.on && of_choices)) return *first;   // or what comes with the program chooses it, and no key does
  const std::string_view pattern = split(row_keys.front()).first;
  return {std::string(pattern.substr(0, std::min(pattern.find(".NAME"), pattern.find(".N.")))), ""};
}

std::vector<base::Plan> plans_of(const Shot& shot) {
  std::vector<base::Plan> plans;
  for (const Stage stage : {Stage::simulate, Stage::surface, Stage::render}) plans.push_back(plan_of(shot, stage));
  return plans;
}

// Nothing of it is asked for.
base::Plan switched_off(base::Plan plan) {
  for (base::PlannedEffect& effect : plan.effects) effect.on = false;
  plan.attributes.clear(), plan.passes.clear();
  return plan;
}

std::string count_text(const Shot& shot) {
  const std::int64_t d = shot.scene.options.dimension;
  const auto modes = sim::most_modes(shot.scene);
  return base::count_of(modes, "mode") + (d == 2 ? " in two dimensions" : "");
}

}  // namespace

base::Plan plan_of(const Shot& shot, Stage stage) {
  switch (stage) {
    case Stage::surface: return surface::plan_of(surface_task(shot));
    case Stage::render: return shot.has_pictures ? render::plan_of(shot.render) : switched_off(render::plan_of(shot.render));
    case Stage::preview: return render::preview_plan_of(shot.render);
    case Stage::simulate: break;
  }
  base::Plan plan = base::joined(sim::plan_of(shot.scene), surface::points_plan_of(shot.scene));
  return base::joined(std::move(plan), base::make_plan("simulate", own_rows(), own_pass_rows(), shot));
}

std::vector<ExplainedEffect> explained_effects(const Shot& shot) {
  std::vector<ExplainedEffect> effects;
  for (const base::Plan& plan : plans_of(shot))
    for (const base::PlannedEffect& e : plan.effects) {
      auto [key, value] =
          plan.stage == "render" && !shot.has_pictures ? std::pair{std::string("render"), std::string()} : deciding(e, shot.values);
      effects.push_back({e.name, e.stage, e.on, std::move(key), std::move(value)});
    }
  return effects;
}

std::vector<Row> all_rows() {
  std::vector<Row> rows;
  const auto add = [&](std::string_view stage, const auto& table) {
    for (const auto& row : table) rows.push_back({std::string(row.name), std::string(stage), row.keys, row.passes});
  };
  add("simulate", sim::effect_rows());
  add("simulate", surface::points_rows());
  add("simulate", own_rows());
  add("surface", surface::effect_rows());
  add("render", render::effect_rows());
  return rows;
}

std::set<std::string> all_passes() {
  std::set<std::string> names;
  for (const auto& table :
       {sim::pass_rows(), sim::solid_pass_rows(), surface::points_pass_rows(), own_pass_rows(), surface::pass_rows(), render::pass_rows()})
    for (const base::PassRow& pass : table) names.emplace(pass.name);
  return names;
}

std::vector<Stage> stages_of(const Shot& shot) {
  std::vector<Stage> stages = {Stage::simulate};
  if (shot.scene.options.dimension == 3) stages.push_back(Stage::surface);
  if (shot.has_pictures) stages.push_back(Stage::render);
  return stages;
}

std::string plan_line(const Shot& shot) {
  constexpr std::size_t kMostNamed = 6;
  const base::Plan sim = plan_of(shot, Stage::simulate);
  std::string off = shot.has_pictures ? "" : "pictures";
  std::size_t count = shot.has_pictures ? 0 : 1;
  for (const base::Plan& plan : plans_of(shot))
    for (const base::PlannedEffect& e : plan.effects)
      if (!e.on && (plan.stage != "render" || shot.has_pictures) && e.keys.front().find('=') == std::string_view::npos &&
          e.keys.front() != "sim.dimension" && ++count <= kMostNamed)
        off += (off.empty() ? "" : ", ") + e.name;
  return std::string(shot.scene.options.is_solid() ? "solid" : "liquid") + ", " +
         std::string(shot.scene.options.kernel == sim::Kernel::linear ? "linear" : "quadratic") + " kernel, " + count_text(shot) +
         (count > 0 ? "; off: " + off + (count > kMostNamed ? " ..." : "") : "") + "; " + std::to_string(sim.bytes_per_particle()) + " B a particle";
}

Json plan_json(const Shot& shot) {
  Json out = {{"effects", Json::array()}, {"attributes", Json::array()}};
  for (const ExplainedEffect& e : explained_effects(shot)) {
    Json entry = {{"name", e.name}, {"stage", e.stage}, {"on", e.on}, {"key", e.key}};
    if (!e.value.empty()) {
      const Json value = Json::parse(e.value, nullptr, /*allow_exceptions=*/false);   // TOML's numbers, texts and arrays are JSON too
      entry["value"] = value.is_discarded() ? Json(e.value) : value;
    }
    out["effects"].push_back(std::move(entry));
  }
  const base::Plan sim = plan_of(shot, Stage::simulate);
  for (const base::Attribute& a : sim.attributes) out["attributes"].push_back({{"name", a.name}, {"bytes", a.bytes}});
  out["bytes_per_particle"] = sim.bytes_per_particle();
  out["passes"] = Json::array();
  for (const Stage stage : stages_of(shot))
    for (const base::PassRow& pass : plan_of(shot, stage).passes) out["passes"].push_back(pass.name);
  return out;
}

}  // namespace app
