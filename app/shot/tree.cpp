#include "app/shot/tree.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/text.h"

namespace app {

bool Node::is_list() const {
  return kind == Kind::array && !items.empty() && std::all_of(items.begin(), items.end(), [](const Node& n) { return n.is_table(); });
}

const Node* Node::find(std::string_view key) const {
  if (!is_table()) return nullptr;
  const auto found = std::find(keys.begin(), keys.end(), key);
  return found == keys.end() ? nullptr : &items[static_cast<std::size_t>(found - keys.begin())];
}

Node& Node::at(std::string_view key) {
  if (Node* found = find(key)) return *found;
  keys.emplace_back(key);
  return items.emplace_back();
}

void Node::remove(std::string_view key) {
  const auto found = std::find(keys.begin(), keys.end(), key);
  if (found == keys.end()) return;
  items.erase(items.begin() + (found - keys.begin()));
  keys.erase(found);
}

namespace {

template <class Value>
Node node_of(Node::Kind kind, Value Node::*member, Value v) {
  Node node;
  node.kind = kind;
  node.*member = std::move(v);
  return node;
}

}  // namespace

Node make_node(bool v) { return node_of(Node::Kind::flag, &Node::flag, v); }
Node make_node(std::int64_t v) { return node_of(Node::Kind::integer, &Node::integer, v); }
Node make_node(double v) { return node_of(Node::Kind::number, &Node::number, v); }
Node make_node(std::string v) { return node_of(Node::Kind::text, &Node::text, std::move(v)); }

std::string entry_name(const Node& list, std::size_t index) {
  const Node* name = list.items[index].find("name");
  return name && name->kind == Node::Kind::text && !name->text.empty() ? name->text : std::to_string(index + 1);
}

const Node* find_entry(const Node& list, std::string_view name) {
  for (std::size_t i = 0; i < list.items.size(); ++i)
    if (entry_name(list, i) == name) return &list.items[i];
  for (std::size_t i = 0; i < list.items.size(); ++i)
    if (std::to_string(i + 1) == name) return &list.items[i];
  return nullptr;
}

namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char letter : text) {
    const auto code = static_cast<unsigned char>(letter);
    if (letter == '"' || letter == '\\') out += {'\\', letter};
    else if (letter == '\n') out += "\\n";
    else if (letter == '\t') out += "\\t";
    else if (code < 0x20 || code == 0x7f) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04X", code);
      out += escape;
    } else out += letter;
  }
  return out + "\"";
}

std::string key_text(const std::string& key) {
  const bool bare = !key.empty() && std::all_of(key.begin(), key.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
  return bare ? key : quoted(key);
}

// A whole number of up to 15 digits is exact as an integer; beyond that only a point keeps TOML from reading one.
std::string number_text(double v) {
  std::string text = base::to_text(v);
  if (std::isfinite(v) && std::abs(v) >= 1e15 && text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

void write_keys(std::string& out, const std::string& header, const Node& table) {
  if (!out.empty()) out += "\n";
  out += header + "\n";
  for (std::size_t i = 0; i < table.items.size(); ++i) out += key_text(table.keys[i]) + " = " + value_text(table.items[i]) + "\n";
}

bool holds_only_tables(const Node& table) {
  return !table.items.empty() && std::all_of(table.items.begin(), table.items.end(), [](const Node& n) { return n.is_table(); });
}

void flatten(std::vector<std::pair<std::string, std::string>>& out, const std::string& path, const Node& node) {
  const std::string start = path.empty() ? "" : path + ".";
  if (node.is_table())
    for (std::size_t i = 0; i < node.items.size(); ++i) flatten(out, start + node.keys[i], node.items[i]);
  else if (node.is_list())
    for (std::size_t i = 0; i < node.items.size(); ++i) flatten(out, start + entry_name(node, i), node.items[i]);
  else
    out.emplace_back(path, value_text(node));
}

}  // namespace

std::string value_text(const Node& node) {
  switch (node.kind) {
    case Node::Kind::flag: return node.flag ? "true" : "false";
    case Node::Kind::integer: return std::to_string(node.integer);
    case Node::Kind::number: return number_text(node.number);
    case Node::Kind::text: return quoted(node.text);
    case Node::Kind::other: return node.text;
    case Node::Kind::array:
    case Node::Kind::table: break;
  }
  std::string inside;
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    if (i > 0) inside += ", ";
    if (node.is_table()) inside += key_text(node.keys[i]) + " = ";
    inside += value_text(node.items[i]);
  }
  if (!node.is_table()) return "[" + inside + "]";
  return inside.empty() ? "{}" : "{ " + inside + " }";
}

std::string shot_text(const Node& root) {
  std::string out;
  for (std::size_t i = 0; i < root.items.size(); ++i)  // loose keys must stand before the first header
    if (const Node& item = root.items[i]; !item.is_table() && !item.is_list()) out += key_text(root.keys[i]) + " = " + value_text(item) + "\n";
  for (std::size_t i = 0; i < root.items.size(); ++i) {
    const Node& item = root.items[i];
    const std::string key = key_text(root.keys[i]);
    if (item.is_list())
      for (const Node& entry : item.items) write_keys(out, "[[" + key + "]]", entry);
    else if (item.is_table() && holds_only_tables(item))
      for (std::size_t k = 0; k < item.items.size(); ++k) write_keys(out, "[" + key + "." + key_text(item.keys[k]) + "]", item.items[k]);
    else if (item.is_table())
      write_keys(out, "[" + key + "]", item);
  }
  return out;
}

std::vector<std::pair<std::string, std::string>> flat(const Node& root) {
  std::vector<std::pair<std::string, std::string>> out;
  flatten(out, "", root);
  return out;
}

Origin place_of(const Node& value) {
  for (const Node& item : value.items)
    if (Origin place = place_of(item); place.file.starts_with("--set ")) return place;
  return value.origin;
}

std::vector<std::string> parts_of(std::string_view key) {
  if (key.empty()) return {};
  std::vector<std::string> parts(1);
  for (const char c : key)
    if (c == '.') parts.emplace_back();
    else parts.back() += c;
  return parts;
}

const Node* find_value(const Node& root, const std::string& key) {
  const Node* node = &root;
  for (const std::string& part : parts_of(key))
    if (node) node = node->is_list() ? find_entry(*node, part) : node->find(part);
  return node;
}

base::Complaint complaint_at(const Origin& origin, base::Complaint complaint) {
  complaint.file = origin.file;
  complaint.line = origin.line;
  complaint.column = origin.column;
  if (!complaint.key.empty()) complaint.key = origin.under + complaint.key;
  return complaint;
}

namespace {

void overlay_table(Node& base, const Node& top, const std::string& path);

void overlay_list(Node& list, const Node& top, const std::string& path) {
  for (std::size_t i = 0; i < top.items.size(); ++i) {
    const std::string key = path + "." + top.keys[i];
    const Origin& origin = top.items[i].origin;
    Node* entry = const_cast<Node*>(find_entry(list, top.keys[i]));
    if (!entry) {
      std::vector<std::string> names;
      constexpr std::size_t kMostNamed = 8;
      std::string there;
      for (std::size_t k = 0; k < list.items.size(); ++k) {
        names.push_back(entry_name(list, k));
        if (k < kMostNamed) there += (there.empty() ? "there is " : ", ") + names.back();
      }
      const std::string nearest = base::nearest_word(top.keys[i], names);
      const std::string hint = nearest.empty() ? there : "did you mean " + origin.under + path + "." + nearest + "?";
      throw base::Error(complaint_at(origin, {.key = key, .hint = hint, .message = "no such entry"}));
    }
    if (!top.items[i].is_table())
      throw base::Error(complaint_at(origin, {.key = key, .value = value_text(top.items[i]), .allowed = "must be a table"}));
    overlay_table(*entry, top.items[i], key);
  }
}

void overlay_table(Node& base, const Node& top, const std::string& path) {
  for (std::size_t i = 0; i < top.items.size(); ++i) {
    const Node& item = top.items[i];
    const std::string key = path.empty() ? top.keys[i] : path + "." + top.keys[i];
    const bool is_section = path.empty();
    Node* found = base.find(top.keys[i]);
    if (!found) {
      base.at(top.keys[i]) = item;
    } else if (!item.is_table() || (item.is_inline && !is_section)) {
      *found = item;
    } else if (found->is_table()) {
      overlay_table(*found, item, key);
    } else if (found->is_list()) {
      overlay_list(*found, item, key);
    } else {
      throw base::Error(
          complaint_at(item.origin, {.key = key, .value = value_text(*found), .allowed = "must be a table before its keys can be set"}));
    }
  }
}

}  // namespace

void overlay(Node& base, const Node& top) { overlay_table(base, top, ""); }

}  // namespace app
