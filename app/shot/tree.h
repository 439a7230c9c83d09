#pragma once
// A shot as it was written: values in tables, each with the place it came from. No third-party type gets past app/shot/toml.cpp.
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"

namespace app {

/// Where a value was written.
struct Origin {
  std::string file;          // as the user gave it, or "--set KEY=VALUE"
  int line = 0, column = 0;  // of the value; 0 when there is none
  std::string under;         // "quality.draft." for a value in the shot's [quality.draft]
};

/// A value, an array or a table. The keys of a table stay in the order in which they were put there.
struct Node {
  enum class Kind { flag, integer, number, text, array, table, other };
  Kind kind = Kind::table;
  bool flag = false;
  std::int64_t integer = 0;
  double number = 0;
  std::string text;               // of a text; of `other` (a date, a time) as written
  std::vector<Node> items;        // of an array or a table
  std::vector<std::string> keys;  // of a table: the name of each item
  bool is_inline = false;         // a table in braces: one value, replaced as a whole
  Origin origin;
  int key_line = 0, key_column = 0;  // where the name was written, in the same file

  bool is_table() const { return kind == Kind::table; }
  /// [[body]]: an array of nothing but tables, at least one.
  bool is_list() const;
  const Node* find(std::string_view key) const;
  Node* find(std::string_view key) { return const_cast<Node*>(std::as_const(*this).find(key)); }
  /// The item of that name, made when it is not there.
  Node& at(std::string_view key);
  /// Takes the item of that name out; nothing happens when there is none.
  void remove(std::string_view key);
};

Node make_node(bool);
Node make_node(std::int64_t);
Node make_node(double);
Node make_node(std::string);

/// The name of a list's entry in keys: its `name`, or its number from 1.
std::string entry_name(const Node& list, std::size_t index);
/// The entry that `name` (or a number from 1) means, or nullptr.
const Node* find_entry(const Node& list, std::string_view name);

/// One value as TOML on one line: 0.02, "water", [0, 0, 1], { box = [[0, 0, 0], [1, 1, 1]] }.
std::string value_text(const Node&);
/// A whole shot as TOML: [section], [[list]] and [section.name] with a line for each key; deeper tables in braces.
std::string shot_text(const Node& root);
/// Every key with the text of its value, in order: "body.column.shape.box".
std::vector<std::pair<std::string, std::string>> flat(const Node& root);

/// The words of a dotted key: "body.column.shape" has three, "body." an empty second one, "" none.
std::vector<std::string> parts_of(std::string_view key);

/// Where a value is from: of a table or an array the --set that changed a part of it, where there is one.
Origin place_of(const Node& value);
/// The value that a dotted key means ("body.column.shape"), or nullptr.
const Node* find_value(const Node& root, const std::string& key);

/// An error at the place of `origin`, which fills in file, line and column and puts `under` before the key.
base::Complaint complaint_at(const Origin& origin, base::Complaint);

/// Puts `top` over `base`. Sections and entries of lists merge key by key; lists are addressed by name or number
/// (body.column, body.1); everything else, tables in braces included, is replaced. Throws base::Error at what `top` cannot reach.
void overlay(Node& base, const Node& top);

}  // namespace app
