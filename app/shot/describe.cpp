#include "app/shot/describe.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <sstream>

#include "app/shot/reader.h"
#include "app/shot/shot.h"
#include "base/text.h"

namespace app {
namespace {

/// Visits every declared key, branches not taken included, and changes nothing but sim.solver, on which defaults depend, where one is given.
class Describer : public base::Params {
 public:
  std::vector<KeyRow> rows;

  explicit Describer(std::string solver = {}) : solver_(std::move(solver)) {}

  void count_or_name(const base::Key& key, base::CountOrName& v) override {
    add(key, v.count > 0 ? std::to_string(v.count) : v.name.empty() ? "" : '"' + v.name + '"', "a count from 1, " + one_of(key.choices));
  }
  bool table(std::string_view name, std::string_view, const std::function<void(base::Params&)>& keys) override {
    within(std::string(name), keys);
    return true;
  }
  void preset_or_table(std::string_view name, std::string& preset, std::span<const std::string_view> names, std::string_view meaning,
                       const std::function<void(base::Params&)>& keys) override {
    text({name, "", meaning, {}, names}, preset);
    within(std::string(name), [&](base::Params& p) {
      p("preset", preset, "whose values the other keys of the table change", names);
      keys(p);
    });
  }
  void where(bool, std::string_view needs, const std::function<void()>& keys) override {
    if (needs.empty()) return keys();
    needs_.emplace_back(needs);
    keys();
    needs_.pop_back();
  }
  bool when(bool) override { return true; }

 protected:
  void number(const base::Key& key, double& v) override { add(key, base::to_text(v), key.range.text()); }
  void integer(const base::Key& key, std::int64_t& v) override { add(key, std::to_string(v), key.range.text()); }
  void flag(const base::Key& key, bool& v) override { add(key, v ? "true" : "false", "true or false"); }
  void text(const base::Key& key, std::string& v) override {
    add(key, v.empty() ? "" : '"' + v + '"', one_of(key.choices));
    if (!solver_.empty() && path_ + std::string(key.name) == "sim.solver") v = solver_;
  }
  void vector(const base::Key& key, base::Vec3& v) override { add(key, value_text(vector_node(v)), key.range.text()); }
  void box(const base::Key& key, base::Box& v) override { add(key, value_text(box_node(v)), ""); }
  void optional_number(const base::Key& key, std::optional<double>& v) override { add(key, v ? base::to_text(*v) : "", key.range.text()); }
  void optional_vector(const base::Key& key, std::optional<base::Vec3>& v) override { add(key, v ? value_text(vector_node(*v)) : "", ""); }
  void optional_box(const base::Key& key, std::optional<base::Box>& v) override { add(key, v ? value_text(box_node(*v)) : "", ""); }

  // An entry is called by its name where it has one: body.NAME.velocity, but light.N.color.
  void list_of(std::string_view name, std::string_view, const std::function<void(std::size_t)>& resize,
               const std::function<void(std::size_t, base::Params&)>& entry) override {
    resize(1);
    const std::size_t first = rows.size();
    const std::string start = path_ + std::string(name);
    within(std::string(name) + ".NAME", [&](base::Params& p) { entry(0, p); });
    if (std::any_of(rows.begin() + std::ptrdiff_t(first), rows.end(), [&](const KeyRow& r) { return r.key == start + ".NAME.name"; })) return;
    for (std::size_t i = first; i < rows.size(); ++i) rows[i].key = start + ".N" + rows[i].key.substr(start.size() + 5);
  }
  void map_of(std::string_view name, std::string_view, const std::function<void(const std::string&, base::Params&)>& entry) override {
    within(std::string(name) + ".NAME", [&](base::Params& p) { entry("NAME", p); });
  }

 private:
  void within(const std::string& name, const std::function<void(base::Params&)>& keys) {
    const std::string outer = path_;
    path_ += name + ".";
    keys(*this);
    path_ = outer;
  }
  // Two branches may declare the same key: the first counts.
  void add(const base::Key& key, const std::string& value, const std::string& allowed) {
    const std::string full = path_ + std::string(key.name);
    if (std::any_of(rows.begin(), rows.end(), [&](const KeyRow& r) { return r.key == full; })) return;
    rows.push_back({full, value.empty() ? key.default_text : value, std::string(key.unit), allowed, std::string(key.meaning), needs_});
  }

  std::string path_, solver_;
  std::vector<std::string> needs_;
};

std::vector<KeyRow> keys_with(const std::string& solver) {
  Describer describer(solver);
  Shot shot;
  shot.params(describer);
  return std::move(describer.rows);
}

bool means(const std::string& declared, const std::string& key) {
  const auto a = parts_of(declared), b = parts_of(key);
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) { return x == y || x == "NAME" || x == "N"; });
}

const KeyRow* find_row(const std::vector<KeyRow>& rows, const std::string& key) {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const KeyRow& r) { return means(r.key, key); });
  return found == rows.end() ? nullptr : &*found;
}

constexpr auto kExample = R"(
[shot]
frames = 24
fps = 24

[sim]
domain = [[0, 0, 0], [1, 0.5, 0.5]]
cell = 0.025
particles_per_cell = 8
cfl = 1
seed = 1

[[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.3, 0.5, 0.35]] }
material = "water"
velocity = [0, 0, 0]

[[collider]]
name = "ball"
shape = { sphere = { center = [0.65, 0.25, 0], radius = 0.12 } }
look = "plaster"

[[effect]]
kind = "gravity"
acceleration = [0, 0, -9.81]

[surface]
smooth = 8

[render]
width = 480
height = 270
view = "filmic"
exposure = 0

[camera]
position = [0.5, -1.4, 0.7]
target = [0.5, 0.25, 0.12]
fov = 35

[look.water]
ior = 1.333

[quality.draft.sim]
cell = 0.05

[quality.draft.render]
width = 240
height = 136
)";

// What the declaration says of the key, for a comment. A table is described by its first key in the line.
std::string comment(const std::vector<KeyRow>& rows, const std::string& key, const std::string& value) {
  const KeyRow* row = find_row(rows, key);
  if (!row) {
    const auto first = value.find_first_not_of("{ ");
    assert(value[0] == '{' && first != std::string::npos && "the example holds a key that is not declared");
    const std::string inner = value.substr(first);
    const auto equals = inner.find(" = ");
    return comment(rows, key + "." + inner.substr(0, equals), inner.substr(equals + 3));
  }
  std::string text = row->meaning;
  if (!row->unit.empty() && row->unit != "1") text += " [" + row->unit + "]";
  if (row->allowed.find("\" or \"") != std::string::npos) text += ": " + row->allowed;
  return text;
}

}  // namespace

std::vector<KeyRow> all_keys() {
  std::vector<KeyRow> rows = keys_with("fluid");
  const std::vector<KeyRow> solids = keys_with("solid");
  assert(rows.size() == solids.size() && "every branch is visited");
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (solids[i].default_value != rows[i].default_value) rows[i].default_of_solids = solids[i].default_value;
  return rows;
}

std::vector<KeyRow> keys_of(const std::string& table, const std::function<void(base::Params&)>& declaration) {
  Describer describer;
  describer.table(table, "", declaration);
  return describer.rows;
}

std::optional<std::vector<std::string>> needs_of(const std::string& key) {
  const std::vector<KeyRow> rows = keys_with("fluid");
  const KeyRow* row = find_row(rows, key);
  return row ? std::optional(row->needs) : std::nullopt;
}

std::string declared_unit(const std::string& key) {
  const std::vector<KeyRow> rows = keys_with("fluid");
  const KeyRow* row = find_row(rows, key);
  return row ? row->unit : "";
}

std::string declared_key_ending_in(std::string_view name) {
  for (const KeyRow& row : keys_with("fluid"))
    if (row.key.ends_with("." + std::string(name))) return row.key;
  return {};
}

std::string transfer_text(const sim::Options& o) {
  constexpr std::array<const char*, 4> kWritten{"PIC", "FLIP", "APIC", "PolyPIC"};
  const std::string modes = o.modes.count > 0 ? std::to_string(o.modes.count) + " modes " : o.modes.name.empty() ? "full " : o.modes.name + " ";
  return kWritten[static_cast<std::size_t>(o.transfer)] + std::string(" ") + (o.transfer == sim::Transfer::polypic ? modes : "") +
         (o.kernel == sim::Kernel::linear ? "linear" : "quadratic") + (!o.is_solid() && o.splitting == sim::Splitting::reflection ? " reflection" : "");
}

std::string example_shot() {
  constexpr std::size_t kColumn = 56;
  const std::vector<KeyRow> rows = all_keys();
  std::istringstream lines(kExample + 1);
  std::string out, section;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("[[")) section = line.substr(2, line.size() - 4) + ".NAME.";
    else if (line.starts_with("[")) section = line.substr(1, line.size() - 2) + ".";
    if (section.starts_with("quality.draft.")) section = section.substr(14);
    if (const auto equals = line.find(" = "); equals != std::string::npos) {
      const std::string text = comment(rows, section + line.substr(0, equals), line.substr(equals + 3));
      line += std::string(line.size() < kColumn ? kColumn - line.size() : 1, ' ') + "# " + text;
    } else if (line.starts_with("[quality.draft.")) {
      line += std::string(kColumn - line.size(), ' ') + "# with --quality draft, over the keys above";
    }
    out += line + "\n";
  }
  return out;
}

}  // namespace app
