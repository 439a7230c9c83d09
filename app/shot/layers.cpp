#include "app/shot/layers.h"

#include <algorithm>

#include "app/shot/reader.h"
#include "app/shot/toml.h"
#include "base/text.h"

namespace app {
namespace {

template <class Change>
void for_each_node(Node& node, const Change& change) {
  change(node);
  for (Node& item : node.items) for_each_node(item, change);
}

// What a rung sets. A shot that sets one of these keys is about that key.
std::string_view rung_text(const std::string& quality) {
  if (quality == "draft") return R"(
sim = { kernel = "linear", transfer = "apic" }
render = { spp = 4 }
)";
  if (quality == "high") return R"(
sim = { kernel = "linear", transfer = "polypic", modes = "full", splitting = "reflection" }
render = { spp = 16 }
)";
  if (quality == "extreme") return R"(
sim = { kernel = "quadratic", transfer = "polypic", modes = "full", splitting = "reflection", carry = "hybrid" }
render = { spp = 16 }
)";
  return R"(
sim = { kernel = "linear", transfer = "polypic", modes = "full" }
render = { spp = 16 }
)";
}

Node rung(const std::string& quality, const std::string& file) {
  Node keys = parse_toml(rung_text(quality), file);
  for_each_node(keys, [&](Node& node) {
    node.origin = {.file = file, .under = {}};
    node.key_line = node.key_column = 0;
  });
  return keys;
}

const Node* find(const Node& root, std::string_view section, std::string_view key) {
  const Node* table = root.find(section);
  return table ? table->find(key) : nullptr;
}

bool is_rung(const std::string& name) { return std::find(kRungs.begin(), kRungs.end(), name) != kRungs.end(); }

void check_qualities(const Node& qualities) {
  if (!qualities.is_table())
    throw base::Error(
        complaint_at(qualities.origin, {.key = "quality", .value = value_text(qualities), .allowed = "must be tables, each under [quality.RUNG]"}));
  for (std::size_t i = 0; i < qualities.items.size(); ++i) {
    const Node& table = qualities.items[i];
    const std::string key = "quality." + qualities.keys[i];
    if (!is_rung(qualities.keys[i])) {
      Origin place = table.origin;
      if (table.key_line > 0) place = {.file = place.file, .line = table.key_line, .column = table.key_column, .under = {}};
      const std::string nearest = base::nearest_word(qualities.keys[i], std::vector<std::string>(kRungs.begin(), kRungs.end()));
      throw base::Error(complaint_at(place, {.key = key, .allowed = "the rungs are " + one_of(kRungs),
                                             .hint = nearest.empty() ? "" : "did you mean quality." + nearest + "?", .message = "unknown key"}));
    }
    if (!table.is_table()) throw base::Error(complaint_at(table.origin, {.key = key, .value = value_text(table), .allowed = "must be a table"}));
    if (const Node* inner = find(table, "shot", "quality"))
      throw base::Error(complaint_at(inner->origin, {.key = key + ".shot.quality", .message = "a rung cannot choose another one"}));
  }
}

Node merged(const Layers& layers, const std::string& quality, bool with_sets) {
  Node user = layers.user;
  if (const Node* table = layers.qualities.find(quality)) {
    Node keys = *table;
    for_each_node(keys, [&](Node& node) { node.origin.under = under(quality); });
    overlay(user, keys);
  }
  if (with_sets)
    for (const Node& set : layers.sets) overlay(user, set);

  Node root = rung(quality, layers.file);
  const Node* solver = find(user, "sim", "solver");
  if (solver && solver->text == "solid") {
    root.at("sim").at("kernel").text = "quadratic";   // the only one that solids have
    root.at("sim").remove("splitting");               // theirs is no choice
    if (quality == "normal") root.at("sim").at("modes").text = "multilinear";   // the linear kernel's modes, on that one
  }
  const Node* transfer = find(user, "sim", "transfer");
  if (transfer && transfer->text != "polypic") root.at("sim").remove("modes");
  // The rung's carry is for the rung's modes.
  for (const std::string_view key : {"transfer", "kernel", "modes"})
    if (find(user, "sim", key)) root.at("sim").remove("carry");
  const Node* dimension = find(user, "sim", "dimension");
  if (!user.find("render")) root.remove("render");                   // no pictures are asked for
  if (dimension && dimension->integer == 2) root.remove("render");   // points are drawn: there are no samples
  overlay(root, user);
  if (Node& shot = root.at("shot"); shot.is_table() && !shot.find("quality")) shot.at("quality") = make_node(quality);
  return root;
}

}  // namespace

std::string under(const std::string& quality) { return "quality." + quality + "."; }

Layers make_layers(Node shot, const std::string& file, const std::optional<std::string>& quality, const std::vector<std::string>& sets) {
  Layers layers;
  layers.file = file;
  for (const std::string& text : sets) {
    Node set = parse_set(text);
    if (set.find("quality")) overlay(shot, set);
    else layers.sets.push_back(std::move(set));
  }
  if (const Node* tables = shot.find("quality")) {
    check_qualities(*tables);
    layers.qualities = *tables;
    shot.remove("quality");
  }
  if (quality) {
    Node chosen;
    Node& value = chosen.at("shot").at("quality");
    value = make_node(*quality);
    value.origin.file = "--quality " + *quality;
    overlay(shot, chosen);
  }
  layers.user = std::move(shot);

  const Node* chosen = find(layers.user, "shot", "quality");
  for (const Node& set : layers.sets)
    if (const Node* last = find(set, "shot", "quality")) chosen = last;
  layers.quality = chosen && is_rung(chosen->text) ? chosen->text : "normal";
  return layers;
}

Node merged(const Layers& layers) { return merged(layers, layers.quality, true); }
Node merged_for(const Layers& layers, const std::string& quality) { return merged(layers, quality, false); }

}  // namespace app
