#include "app/shot/toml.h"

#include <sstream>

#include <toml++/toml.h>

namespace app {
namespace {

/// What errors call the text, and whether its lines mean anything to the user.
struct Source {
  std::string name;
  bool has_lines = true;
};

Node converted(const toml::node& from, const Source& source) {
  Node node;
  switch (from.type()) {
    case toml::node_type::boolean: node = make_node(from.as_boolean()->get()); break;
    case toml::node_type::integer: node = make_node(from.as_integer()->get()); break;
    case toml::node_type::floating_point: node = make_node(from.as_floating_point()->get()); break;
    case toml::node_type::string: node = make_node(from.as_string()->get()); break;
    case toml::node_type::array:
      node.kind = Node::Kind::array;
      for (const toml::node& item : *from.as_array()) node.items.push_back(converted(item, source));
      break;
    case toml::node_type::table:
      node.is_inline = from.as_table()->is_inline();
      for (const auto& [key, item] : *from.as_table()) {
        node.keys.emplace_back(key.str());
        Node& made = node.items.emplace_back(converted(item, source));
        if (source.has_lines) made.key_line = static_cast<int>(key.source().begin.line);
        if (source.has_lines) made.key_column = static_cast<int>(key.source().begin.column);
      }
      break;
    default: {
      std::ostringstream text;
      from.visit([&](const auto& value) { text << toml::node_view<const toml::node>(value); });
      node.kind = Node::Kind::other;
      node.text = text.str();
    }
  }
  node.origin.file = source.name;
  if (source.has_lines) node.origin.line = static_cast<int>(from.source().begin.line);
  if (source.has_lines) node.origin.column = static_cast<int>(from.source().begin.column);
  return node;
}

// The parser nests a table for each part of a dotted key, by recursion: "a.a.a..." without end would take the stack.
void refuse_deep_keys(std::string_view text, const std::string& file) {
  constexpr int kMostParts = 200;
  int parts = 0, line = 1;
  bool in_comment = false;
  for (const char c : text) {
    if (c == '\n') ++line;
    if (c == '#') in_comment = true;
    if (c == '\n') in_comment = false;
    if (c == '\n' || c == '=' || c == ',' || c == '[' || c == ']' || c == '{' || c == '}') parts = 0;
    if (c == '.' && !in_comment && ++parts > kMostParts)
      throw base::Error({.file = file, .line = line, .message = "a key of more than " + std::to_string(kMostParts) + " parts"});
  }
}

toml::table parsed(std::string_view text, const std::string& file) {
  refuse_deep_keys(text, file);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& e) {
    throw base::Error({.file = file, .line = static_cast<int>(e.source().begin.line), .column = static_cast<int>(e.source().begin.column),
                       .message = std::string(e.description())});
  }
}

// The value after the '=' of --set. What is no TOML is a plain string: --set sim.kernel=linear.
Node set_value(const std::string& value, const std::string& name) {
  try {
    const toml::table table = parsed("value = " + value, name);
    if (table.size() == 1) return converted(*table.get("value"), {name, false});
  } catch (const base::Error&) {
  }
  Node text = make_node(value);
  try {
    parsed("value = " + value_text(text), name);
  } catch (const base::Error&) {
    throw base::Error({.file = name, .allowed = "must be UTF-8 text"});
  }
  text.origin.file = name;
  return text;
}

}  // namespace

Node parse_toml(std::string_view text, const std::string& file) { return converted(parsed(text, file), {file}); }

Node parse_set(const std::string& set) {
  const std::string name = "--set " + set;
  const auto equals = set.find('=');
  if (equals == 0 || equals == std::string::npos) throw base::Error({.file = name, .allowed = "must be KEY=VALUE"});

  Node root;
  Node* node = &root;
  std::istringstream parts(set.substr(0, equals) + ".");
  for (std::string part; std::getline(parts, part, '.');) {
    const auto first = part.find_first_not_of(' '), last = part.find_last_not_of(' ');
    if (first == std::string::npos) throw base::Error({.file = name, .allowed = "must be KEY=VALUE"});
    node->origin.file = name;
    node = &node->at(part.substr(first, last - first + 1));
  }
  *node = set_value(set.substr(equals + 1), name);
  return root;
}

}  // namespace app
