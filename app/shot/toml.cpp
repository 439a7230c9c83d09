#include "app/shot/toml.h"

#include <sstream>
#include <stdexcept>
#include <vector>

// The library asserts what a malformed file can break ("[[[" is enough), and its Debian build assumes it instead. Compiled here,
// a broken assertion is an exception like any other syntax error.
namespace {
struct BrokenAssertion : std::logic_error {
  using std::logic_error::logic_error;
};
[[noreturn]] void broken(const char* assertion) { throw BrokenAssertion(assertion); }
}  // namespace
#undef TOML_HEADER_ONLY
#undef TOML_SHARED_LIB
#define TOML_HEADER_ONLY 1
#define TOML_ASSERT(expr) ((expr) ? void() : broken(#expr))
#ifdef NDEBUG
#error "NDEBUG turns the library's assertions into assumptions"
#endif
#include <toml++/toml.h>

namespace app {
namespace {

constexpr std::size_t kMostKeys = 1000;  // of a table: they are searched one by one
constexpr int kMostParts = 200;          // of a dotted key: each is a table in a table

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
      if (from.as_table()->size() > kMostKeys)
        throw base::Error({.file = source.name,
                           .line = static_cast<int>(from.source().begin.line),
                           .message = "a table of more than " + std::to_string(kMostKeys) + " keys"});
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

// Where a string or comment that begins at `at` ends: behind it, or at the line's end where it is not closed. `at` itself where none begins.
std::size_t end_of_text(std::string_view text, std::size_t at) {
  const char mark = text[at];
  if (mark == '#') return std::min(text.find('\n', at), text.size());
  if (mark != '"' && mark != '\'') return at;
  const std::string_view three(mark == '"' ? "\"\"\"" : "\'\'\'");
  const bool is_long = text.substr(at).starts_with(three);
  const std::string_view closing = is_long ? three : three.substr(0, 1);
  for (at += closing.size(); at < text.size(); ++at) {
    if (text.substr(at).starts_with(closing)) return at + closing.size();
    if (text[at] == '\n' && !is_long) return at;
    if (text[at] == '\\' && mark == '"') ++at;
  }
  return text.size();
}

// The parser nests a table for each part of a dotted key, and for each bracket, by recursion: "a.a.a..." without end would take the stack.
void refuse_deep_keys(std::string_view text, const std::string& file) {
  std::vector<int> open;   // of each bracket, how deep it is in the one before
  int parts = 0, depth = 0, line = 1;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (const std::size_t end = end_of_text(text, i); end > i) {
      line += static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i), text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
      i = end - 1;   // what follows may begin another
      continue;
    }
    const char c = text[i];
    if (c == '\n') ++line;
    if (c == ',' || (c == '\n' && open.empty())) parts = 0;
    if (c == '.') ++parts;
    if (c == '[' || c == '{') open.push_back(parts + 1), depth += open.back(), parts = 0;
    if ((c == ']' || c == '}') && !open.empty()) depth -= open.back(), open.pop_back(), parts = 0;
    if (parts > kMostParts || depth + parts > kMostParts)
      throw base::Error({.file = file, .line = line, .message = (parts > kMostParts ? "a key of more than " : "tables in tables, more than ") +
                                                                std::to_string(kMostParts) + (parts > kMostParts ? " parts" : " deep")});
  }
}

bool breaks_an_assertion(std::string_view text) {
  try {
    const toml::table unused = toml::parse(text);
  } catch (const toml::parse_error&) {
  } catch (const BrokenAssertion&) {
    return true;
  }
  return false;
}

// The first line that breaks the parser, by bisection: an assertion does not say where it stands.
int broken_line(std::string_view text) {
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (text[i] == '\n') ends.push_back(i + 1);
  ends.push_back(text.size());
  return 1 +
         static_cast<int>(std::partition_point(ends.begin(), ends.end(), [&](std::size_t end) { return !breaks_an_assertion(text.substr(0, end)); }) -
                          ends.begin());
}

toml::table parsed(std::string_view text, const std::string& file) {
  refuse_deep_keys(text, file);
  try {
    return toml::parse(text);
  } catch (const BrokenAssertion&) {
    throw base::Error({.file = file, .line = broken_line(text), .message = "no valid TOML"});
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
  int count = 0;
  for (std::string part; std::getline(parts, part, '.');) {
    if (++count > kMostParts) throw base::Error({.file = name, .message = "a key of more than " + std::to_string(kMostParts) + " parts"});
    const auto first = part.find_first_not_of(' '), last = part.find_last_not_of(' ');
    if (first == std::string::npos) throw base::Error({.file = name, .allowed = "must be KEY=VALUE"});
    node->origin.file = name;
    node = &node->at(part.substr(first, last - first + 1));
  }
  *node = set_value(set.substr(equals + 1), name);
  return root;
}

}  // namespace app
