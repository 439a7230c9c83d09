#include "app/shot/reader.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <tuple>

#include "app/shot/describe.h"
#include "base/text.h"

namespace app {
namespace {

constexpr std::size_t kMostWrong = 200;  // complaints kept: one will be shown, and a hostile file could make millions
constexpr auto kNumber = "a number";

std::string vector_words(std::int64_t size) { return size == 2 ? "two numbers, [x, y]" : "three numbers, [x, y, z]"; }
std::string box_words(std::int64_t size) {
  return std::string("two opposite corners, ") + (size == 2 ? "[[x, y], [x, y]]" : "[[x, y, z], [x, y, z]]");
}

// "-1 m"; long arrays and texts are cut so that the error stays one readable line.
std::string with_unit(const Node& value, std::string_view unit) {
  constexpr std::size_t kMost = 80;
  std::string text = value_text(value);
  if (text.size() > kMost) {
    std::size_t end = kMost;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;  // not within a UTF-8 letter
    text = text.substr(0, end) + "...";
  }
  const bool is_measure = value.kind == Node::Kind::integer || value.kind == Node::Kind::number || value.kind == Node::Kind::array;
  return unit.empty() || unit == "1" || !is_measure ? text : text + " " + std::string(unit);
}

bool is_good_name(const std::string& name) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !name.empty() && letter(name[0]) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-'; });
}

bool is_one_of(std::span<const std::string_view> names, const Node& value) {
  return value.kind == Node::Kind::text && std::find(names.begin(), names.end(), value.text) != names.end();
}

std::string meant(std::span<const std::string_view> names, const Node& value) {
  const std::vector<std::string> words(names.begin(), names.end());
  const std::string nearest = value.kind == Node::Kind::text ? base::nearest_word(value.text, words) : "";
  return nearest.empty() ? "" : "did you mean \"" + nearest + "\"?";
}

}  // namespace

std::string one_of(std::span<const std::string_view> names) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) out += i + 1 == names.size() ? " or " : ", ";
    out += '"' + std::string(names[i]) + '"';
  }
  return out;
}

Node vector_node(const base::Vec3& v, std::int64_t size) {
  Node node;
  node.kind = Node::Kind::array;
  for (std::int64_t a = 0; a < size; ++a) node.items.push_back(make_node(v[a]));
  return node;
}

Node box_node(const base::Box& v, std::int64_t size) {
  Node node;
  node.kind = Node::Kind::array;
  node.items = {vector_node(v.lower, size), vector_node(v.upper, size)};
  return node;
}

Reader::Reader(const Node& root, std::string file) : file_(std::move(file)) {
  nothing_.origin.file = file_;
  open(root, "");
}

void Reader::finish() {
  Scope root = close();
  given_ = std::move(root.given);
  complete_ = std::move(root.complete);
}

void Reader::open(const Node& node, const std::string& path) { scopes_.push_back({&node, path, {}, {}, {}, {}}); }

Reader::Scope Reader::close() {
  Scope closed = std::move(scopes_.back());
  scopes_.pop_back();
  complain_unknown(closed);
  return closed;
}

const Node* Reader::declare(std::string_view name) {
  scope().declared.emplace_back(name);
  return scope().node->find(name);
}

void Reader::note(std::string_view name, const Node* written, Node value) {
  if (written) scope().given.at(name) = value;
  scope().complete.at(name) = std::move(value);
}


void Reader::complain(const base::Key& key, const Node& value, const std::string& allowed, const std::string& hint) {
  if (wrong_.size() >= kMostWrong) return;
  base::Complaint complaint{.key = scope().path + std::string(key.name), .value = with_unit(value, key.unit),
                            .allowed = "must be " + allowed, .hint = hint};
  wrong_.push_back({Wrong::What::value, value.origin.under, complaint_at(value.origin, std::move(complaint))});
}

void Reader::complain_unknown(const Scope& table) {
  for (std::size_t i = 0; i < table.node->items.size() && wrong_.size() < kMostWrong; ++i) {
    const std::string& name = table.node->keys[i];
    if (std::find(table.declared.begin(), table.declared.end(), name) != table.declared.end()) continue;
    const Node& item = table.node->items[i];
    Origin place = item.origin;
    if (item.key_line > 0) std::tie(place.line, place.column) = std::tie(item.key_line, item.key_column);

    base::Complaint complaint{.key = table.path + name, .message = "unknown key"};
    const auto conditions = needs_of(complaint.key);
    if (conditions) {
      complaint.message = "has no effect with the other values given here";
      for (const std::string& needs : *conditions)
        if (table.unmet.contains(needs)) complaint.message = "needs " + needs;
    } else {
      const std::string nearest = base::nearest_word(name, table.declared);
      const std::string elsewhere = declared_key_ending_in(name);
      if (!nearest.empty()) complaint.hint = "did you mean " + place.under + table.path + nearest + "?";
      else if (!elsewhere.empty()) complaint.hint = "did you mean " + place.under + elsewhere + "?";
    }
    wrong_.push_back({conditions ? Wrong::What::dependent : Wrong::What::value, place.under, complaint_at(place, std::move(complaint))});
  }
}

void Reader::where(bool condition, std::string_view needs, const std::function<void()>& keys) {
  if (condition) keys();
  else scope().unmet.emplace(needs);
}

void Reader::without(std::string_view table, std::string_view reason) {
  const Node* node = declare(table);
  if (!node || wrong_.size() >= kMostWrong) return;
  Origin place = node->is_list() ? node->items.front().origin : node->origin;
  if (node->key_line > 0) std::tie(place.line, place.column) = std::tie(node->key_line, node->key_column);
  wrong_.push_back({Wrong::What::value, place.under, complaint_at(place, {.key = scope().path + std::string(table), .message = std::string(reason)})});
}

void Reader::require(bool holds, std::string_view key, const std::string& message) {
  if (holds || wrong_.size() >= kMostWrong) return;
  const auto step = [](const Node* node, const std::string& part) {
    return !node ? node : node->is_list() ? find_entry(*node, part) : node->find(part);
  };
  const Node* node = scope().node;
  const Node* value = &scope().complete;
  const Node* place = node->origin.file.empty() ? &nothing_ : node;
  std::string path = scope().path;
  std::istringstream parts{std::string(key)};
  for (std::string part; std::getline(parts, part, '.');) {
    const bool is_entry = node && node->is_list();
    const Node* list = node;
    node = step(node, part);
    value = step(value, part);
    if (node) place = node;
    path += (is_entry && node ? entry_name(*list, static_cast<std::size_t>(node - list->items.data())) : part) + ".";
  }
  if (!path.empty()) path.pop_back();
  const bool is_value = value && !value->is_table() && (value->kind != Node::Kind::array || (!value->items.empty() && !value->is_list()));
  base::Complaint complaint{.key = path, .value = is_value ? with_unit(*value, declared_unit(path)) : "", .message = message};
  const Origin origin = node ? place_of(*node) : place->origin;
  wrong_.push_back({Wrong::What::law, origin.under, complaint_at(origin, std::move(complaint))});
}

void Reader::throw_if_wrong() const {
  const auto order = [](const Wrong& a, const Wrong& b) {
    const auto rank = [](const Wrong& w) {   // the command line's own comes before what follows from it in the file
      const bool is_said = w.complaint.file.starts_with("--set ") || w.complaint.file.starts_with("--quality ");
      return std::make_tuple(w.what, !is_said && w.complaint.line == 0, w.complaint.line, w.complaint.column);
    };
    return rank(a) < rank(b);
  };
  const auto first = std::min_element(wrong_.begin(), wrong_.end(), order);
  if (first != wrong_.end()) throw base::Error(first->complaint);
}

void Reader::throw_if_wrong_under(const std::string& under) const {
  for (const Wrong& wrong : wrong_)
    if (wrong.what != Wrong::What::law && wrong.under == under) throw base::Error(wrong.complaint);
}


bool Reader::read_number(const base::Key& key, const Node& whole, const Node& part, const std::string& kind, double& v) {
  const bool each = &whole != &part;
  const std::string range = key.range.text();
  double number = 0;
  if (part.kind == Node::Kind::integer) number = static_cast<double>(part.integer);
  else if (part.kind == Node::Kind::number) number = part.number;
  else return complain(key, whole, kind + (range.empty() ? "" : (each ? ", each " : " ") + range)), false;
  if (!std::isfinite(number)) return complain(key, whole, each ? "finite in each component" : "finite"), false;
  if (!key.range.contains(number)) return complain(key, whole, range + (each ? " in each component" : "")), false;
  constexpr double kLargest = 1e18;   // its square is a single-precision number, too
  if (std::abs(number) > kLargest) return complain(key, whole, std::string("at most 1e18 in size") + (each ? ", each component" : "")), false;
  v = number;
  return true;
}

bool Reader::read_vector(const base::Key& key, const Node& whole, const Node& part, const std::string& kind, base::Vec3& v) {
  base::Vec3 read = base::Vec3::Zero();
  if (part.kind != Node::Kind::array || part.items.size() != static_cast<std::size_t>(vector_size())) return complain(key, whole, kind), false;
  for (int i = 0; i < vector_size(); ++i)
    if (!read_number(key, whole, part.items[static_cast<std::size_t>(i)], kind, read[i])) return false;
  v = read;
  return true;
}

bool Reader::read_box(const base::Key& key, const Node& node, base::Box& v) {
  base::Box read;
  const std::string kind = box_words(vector_size());
  if (node.kind != Node::Kind::array || node.items.size() != 2) return complain(key, node, kind), false;
  if (!read_vector(key, node, node.items[0], kind, read.lower) || !read_vector(key, node, node.items[1], kind, read.upper)) return false;
  v = read;
  return true;
}

void Reader::number(const base::Key& key, double& v) {
  const Node* node = declare(key.name);
  if (node) read_number(key, *node, *node, kNumber, v);
  note(key.name, node, make_node(v));
}

void Reader::optional_number(const base::Key& key, std::optional<double>& v) {
  const Node* node = declare(key.name);
  double read = 0;
  if (node && read_number(key, *node, *node, kNumber, read)) v = read;
  if (v) note(key.name, node, make_node(*v));
}

void Reader::integer(const base::Key& key, std::int64_t& v) {
  const Node* node = declare(key.name);
  const std::string range = key.range.text();
  if (node && node->kind != Node::Kind::integer) complain(key, *node, "a whole number" + (range.empty() ? "" : " " + range));
  else if (node && !key.range.contains(static_cast<double>(node->integer))) complain(key, *node, range);
  else if (node) v = node->integer;
  note(key.name, node, make_node(v));
}

void Reader::flag(const base::Key& key, bool& v) {
  const Node* node = declare(key.name);
  if (node && node->kind == Node::Kind::flag) v = node->flag;
  else if (node) complain(key, *node, "true or false");
  note(key.name, node, make_node(v));
}

void Reader::text(const base::Key& key, std::string& v) {
  const Node* node = declare(key.name);
  if (node && !key.choices.empty() && !is_one_of(key.choices, *node)) complain(key, *node, one_of(key.choices), meant(key.choices, *node));
  else if (node && node->kind != Node::Kind::text) complain(key, *node, "text in quotes");
  else if (node) v = node->text;
  note(key.name, node, make_node(v));
}

void Reader::vector(const base::Key& key, base::Vec3& v) {
  const Node* node = declare(key.name);
  if (node) read_vector(key, *node, *node, vector_words(vector_size()), v);
  note(key.name, node, vector_node(v, vector_size()));
}

void Reader::optional_vector(const base::Key& key, std::optional<base::Vec3>& v) {
  const Node* node = declare(key.name);
  base::Vec3 read;
  if (node && read_vector(key, *node, *node, vector_words(vector_size()), read)) v = read;
  if (v) note(key.name, node, vector_node(*v, vector_size()));
}

void Reader::box(const base::Key& key, base::Box& v) {
  const Node* node = declare(key.name);
  if (node) read_box(key, *node, v);
  note(key.name, node, box_node(v, vector_size()));
}

void Reader::optional_box(const base::Key& key, std::optional<base::Box>& v) {
  const Node* node = declare(key.name);
  base::Box read;
  if (node && read_box(key, *node, read)) v = read;
  if (v) note(key.name, node, box_node(*v, vector_size()));
}

void Reader::count_or_name(const base::Key& key, base::CountOrName& v) {
  const Node* node = declare(key.name);
  const bool is_count = node && node->kind == Node::Kind::integer;
  if (is_count && node->integer >= 1 && key.range.contains(static_cast<double>(node->integer))) v = {node->integer, {}};
  else if (node && !is_count && is_one_of(key.choices, *node)) v = {0, node->text};
  else if (node) complain(key, *node, "a count from 1, " + one_of(key.choices), meant(key.choices, *node));
  if (v.count > 0) note(key.name, node, make_node(v.count));
  else if (!v.name.empty()) note(key.name, node, make_node(v.name));
}


bool Reader::table(std::string_view name, std::string_view, const std::function<void(base::Params&)>& keys) {
  const Node* node = declare(name);
  const bool is_section = scopes_.size() == 1;  // a section that the shot leaves out still has its defaults and laws
  if (!node && !is_section) return false;
  if (node && !node->is_table()) return complain({name, "", ""}, *node, "a table"), false;
  open(node ? *node : nothing_, scope().path + std::string(name) + ".");
  keys(*this);
  Scope read = close();
  if (node) scope().given.at(name) = std::move(read.given);
  scope().complete.at(name) = std::move(read.complete);
  return node != nullptr;
}

void Reader::preset_or_table(std::string_view name, std::string& preset, std::span<const std::string_view> names, std::string_view,
                             const std::function<void(base::Params&)>& keys) {
  const Node* node = declare(name);
  const base::Key key{name, "", "", {}, names};
  const bool is_table = node && node->is_table();
  if (node && !is_table && !is_one_of(names, *node))
    return complain(key, *node, one_of(names) + ", or a table with preset and keys", meant(names, *node));
  if (node && !is_table) preset = node->text;
  open(is_table ? *node : nothing_, scope().path + std::string(name) + ".");
  text({"preset", "", "", {}, names}, preset);
  keys(*this);
  Scope read = close();
  const bool has_more = read.given.items.size() > (read.given.find("preset") ? 1u : 0u);
  if (node) scope().given.at(name) = has_more ? std::move(read.given) : make_node(preset);
  scope().complete.at(name) = std::move(read.complete);
}

void Reader::check_names(const Node& list, std::string_view list_name) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const Node* name = list.items[i].find("name");
    if (!name || name->kind != Node::Kind::text) continue;
    const std::string key = std::string(list_name) + "." + std::to_string(i + 1) + ".name";
    if (!is_good_name(name->text)) complain({key, "", ""}, *name, "letters, digits, _ or -, and begin with a letter");
    else if (!seen.insert(name->text).second) complain({key, "", ""}, *name, "unique");
  }
}

void Reader::list_of(std::string_view name, std::string_view, const std::function<void(std::size_t)>& resize,
                     const std::function<void(std::size_t, base::Params&)>& entry) {
  const Node* node = declare(name);
  if (!node) return;
  const bool is_empty = node->kind == Node::Kind::array && node->items.empty();
  if (!node->is_list() && !is_empty) {
    const std::string list(name);
    const bool names_first = node->is_table() && node->items.size() == 1 && node->keys.front() == "1" && node->items.front().is_table();   // --set light.1.kind=sun
    return complain({name, "", ""}, *node, "tables, each under [[" + list + "]]",
                    names_first ? "none is written; " + list + " = [" + value_text(node->items.front()) + "] writes the first" : "");
  }
  check_names(*node, name);
  resize(node->items.size());
  Node given, complete;
  given.kind = complete.kind = Node::Kind::array;
  for (std::size_t i = 0; i < node->items.size(); ++i) {
    open(node->items[i], scope().path + std::string(name) + "." + entry_name(*node, i) + ".");
    entry(i, *this);
    Scope read = close();
    given.items.push_back(std::move(read.given));
    complete.items.push_back(std::move(read.complete));
  }
  scope().given.at(name) = std::move(given);
  scope().complete.at(name) = std::move(complete);
}

void Reader::map_of(std::string_view name, std::string_view, const std::function<void(const std::string&, base::Params&)>& entry) {
  const Node* node = declare(name);
  if (!node) return;
  const std::string path = scope().path + std::string(name) + ".";
  if (!node->is_table()) return complain({name, "", ""}, *node, "tables, each under [" + path + "NAME]");
  Node given, complete;
  for (std::size_t i = 0; i < node->items.size(); ++i) {
    const std::string& key = node->keys[i];
    const std::string full = std::string(name) + "." + key;
    if (!node->items[i].is_table()) {
      complain({full, "", ""}, node->items[i], "a table");
      continue;
    }
    open(node->items[i], path + key + ".");
    entry(key, *this);
    Scope read = close();
    given.at(key) = std::move(read.given);
    complete.at(key) = std::move(read.complete);
  }
  scope().given.at(name) = std::move(given);
  scope().complete.at(name) = std::move(complete);
}

}  // namespace app
