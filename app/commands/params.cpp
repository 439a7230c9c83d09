#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/shot/tree.h"
#include "app/stages/document.h"
#include "app/study/problem_shot.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

/// "body.NAME.velocity" as somebody writes it who has an entry in mind ("body.column.velocity") or none ("body.velocity").
bool is_below(const std::string& key, const std::string& topic) {
  const std::vector<std::string> known = parts_of(key), asked = parts_of(topic);
  if (asked.size() < 2) return false;
  const auto agrees = [&](bool names_entry) {
    std::size_t i = 0;
    for (const std::string& part : known) {
      const bool is_entry = part == "NAME" || part == "N";
      if (i == asked.size()) return true;
      if (is_entry && !names_entry) continue;
      if (!is_entry && part != asked[i]) return false;
      ++i;
    }
    return i == asked.size();
  };
  const bool is_number = asked[1].find_first_not_of("0123456789") == std::string::npos;
  return agrees(false) || ((asked.size() > 2 || is_number) && agrees(true));
}

// A topic is a key, a table, or one word of a dotted key: "sim", "body.NAME.velocity", "velocity"; else a choice of one: "gravity".
bool matches(const std::string& key, const std::string& topic) {
  const std::string dotted = "." + key + ".";
  return dotted.find("." + topic + ".") != std::string::npos || is_below(key, topic);
}

/// The own keys of problems with a known answer, or of the one that is named, and whose they are.
std::vector<KeyRow> problem_rows_about(const std::string& topic) {
  std::vector<KeyRow> rows;
  for (const sim::ProblemRow& problem : sim::problem_rows()) {
    for (KeyRow& key : problem_keys(problem)) {
      if (topic != problem.name && !matches(key.key, topic)) continue;
      key.meaning = std::string(problem.name) + ": " + key.meaning;
      rows.push_back(std::move(key));
    }
  }
  return rows;
}

std::vector<KeyRow> rows_about(const std::string& topic) {
  std::vector<KeyRow> rows = all_keys();
  if (topic.empty()) return rows;
  if (topic.starts_with("problem") || sim::find_problem(topic))
    if (std::vector<KeyRow> own = problem_rows_about(topic); !own.empty()) return own;
  std::vector<std::string> words;
  for (const sim::ProblemRow& problem : sim::problem_rows()) words.emplace_back(problem.name);
  for (const KeyRow& row : rows) {
    words.push_back(row.key);
    for (const std::string entry : {".NAME.", ".N."})
      if (const std::size_t at = row.key.find(entry); at != std::string::npos) words.push_back(std::string(row.key).replace(at, entry.size(), "."));
    for (std::size_t start = 0, dot = 0; dot != std::string::npos; start = dot + 1) {
      dot = row.key.find('.', start);
      words.push_back(row.key.substr(start, dot - start));
    }
  }
  for (const KeyRow& row : rows)   // the quoted words of "one of ..."
    for (std::size_t open = row.allowed.find('"'); open != std::string::npos;) {
      const std::size_t close = row.allowed.find('"', open + 1);
      if (close == std::string::npos) break;
      words.push_back(row.allowed.substr(open + 1, close - open - 1));
      open = row.allowed.find('"', close + 1);
    }
  const auto is_choice = [&](const KeyRow& row) { return row.allowed.find('"' + topic + '"') != std::string::npos; };
  const bool is_key = std::any_of(rows.begin(), rows.end(), [&](const KeyRow& row) { return matches(row.key, topic); });
  std::erase_if(rows, [&](const KeyRow& row) { return is_key ? !matches(row.key, topic) : !is_choice(row); });
  if (!rows.empty()) return rows;
  const std::string nearest = base::nearest_word(topic, words);
  throw base::Error({.code = base::Exit::user,
                     .file = topic,
                     .hint = nearest.empty() ? "polypic params lists the keys, polypic list the problems" : "did you mean " + nearest + "?",
                     .message = "no such key, table or problem"});
}

void print_json(const std::vector<KeyRow>& rows) {
  nlohmann::ordered_json out = {{"schema", 1}, {"keys", nlohmann::ordered_json::array()}};
  for (const KeyRow& row : rows) {
    nlohmann::ordered_json entry = {{"key", row.key}};
    const std::pair<const char*, const std::string&> parts[] = {
        {"default", row.default_value}, {"default_of_solids", row.default_of_solids}, {"unit", row.unit},
        {"allowed", row.allowed}, {"meaning", row.meaning}};
    for (const auto& [name, text] : parts)
      if (!text.empty()) entry[name] = text;
    if (!row.needs.empty()) entry["needs"] = row.needs;
    out["keys"].push_back(entry);
  }
  std::fputs(document_text(out).c_str(), stdout);
}

void print_table(const std::vector<KeyRow>& rows) {
  std::size_t key = 0, value = 0;
  const auto with_unit = [](const KeyRow& row) {
    const std::string both = row.default_of_solids.empty() ? row.default_value : row.default_value + "; of solids " + row.default_of_solids;
    return both + (row.unit.empty() || row.unit == "1" ? "" : " [" + row.unit + "]");
  };
  for (const KeyRow& row : rows) {
    key = std::max(key, row.key.size());
    value = std::min<std::size_t>(std::max(value, with_unit(row).size()), 31);
  }
  for (const KeyRow& row : rows) {
    const std::string allowed = row.allowed.empty() ? "" : " (" + row.allowed + ")";
    const std::string needs = row.needs.empty() ? "" : fmt::format("; needs {}", fmt::join(row.needs, " and "));
    std::printf("%-*s  %-*s  %s%s%s\n", static_cast<int>(key), row.key.c_str(), static_cast<int>(value), with_unit(row).c_str(), row.meaning.c_str(),
                allowed.c_str(), needs.c_str());
  }
}

}  // namespace

void params(const Request& request) {
  if (request.example) {
    std::fputs(example_shot().c_str(), stdout);
    return;
  }
  const std::vector<KeyRow> rows = rows_about(request.subject);
  if (request.json) print_json(rows);
  else print_table(rows);
}

}  // namespace app
