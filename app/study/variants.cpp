#include "app/study/variants.h"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

constexpr std::array<std::string_view, 5> kSchemeKeys{"sim.transfer", "sim.kernel", "sim.modes", "sim.splitting", "sim.carry"};

const std::string* value_of(const Sets& sets, std::string_view key) {
  for (const auto& [name, value] : sets)
    if (name == key) return &value;
  return nullptr;
}

/// A word as TOML may have it.
std::string_view unquoted(std::string_view word) {
  const bool is_quoted = word.size() > 1 && word.front() == word.back() && (word.front() == '"' || word.front() == '\'');
  return is_quoted ? word.substr(1, word.size() - 2) : word;
}

Sets scheme(const char* transfer, const char* kernel, const char* modes, const char* splitting, const char* carry) {
  Sets sets;
  for (const auto& [key, value] :
       {std::pair{"sim.transfer", transfer}, {"sim.kernel", kernel}, {"sim.modes", modes}, {"sim.splitting", splitting}, {"sim.carry", carry}})
    if (*value) sets.emplace_back(key, value);
  return sets;
}

}  // namespace

bool is_scheme_key(const std::string& key) { return std::find(kSchemeKeys.begin(), kSchemeKeys.end(), key) != kSchemeKeys.end(); }

Varied parse_vary(const std::string& text, const std::string& option) {
  const std::size_t equals = text.find('=');
  const auto refuse = [&](const std::string& why) {
    throw base::Error({.file = option + " " + text, .hint = "as in " + option + (option == "--vary" ? " sim.transfer=apic,polypic" : " sim.cell=0.02,0.01"), .message = why});
  };
  if (equals == std::string::npos || equals == 0) refuse("must be KEY=VALUE,VALUE ...");
  Varied varied{text.substr(0, equals), {""}, option};
  int depth = 0;
  char quote = 0;
  for (const char c : text.substr(equals + 1)) {
    if (quote) quote = c == quote ? 0 : quote;
    else if (c == '"' || c == '\'') quote = c;
    else if (c == '[' || c == '{') ++depth;
    else if (c == ']' || c == '}') --depth;
    if (c == ',' && depth == 0 && !quote) varied.values.emplace_back();
    else varied.values.back() += c;
  }
  for (const std::string& value : varied.values)
    if (value.empty()) refuse("has an empty value");
  return varied;
}

std::vector<Sets> combinations(const std::vector<Varied>& keys) {
  std::vector<Sets> all{{}};
  for (const Varied& varied : keys) {
    std::vector<Sets> longer;
    for (const Sets& sets : all)
      for (const std::string& value : varied.values) longer.push_back(sets), longer.back().emplace_back(varied.key, value);
    all = std::move(longer);
  }
  std::vector<Sets> kept;
  std::set<Sets> seen;
  for (Sets& sets : all) {
    const std::string* const transfer = value_of(sets, "sim.transfer");
    if (transfer && unquoted(*transfer) != "polypic") std::erase_if(sets, [](const auto& s) { return s.first == "sim.modes"; });
    if (seen.insert(sets).second) kept.push_back(std::move(sets));
  }
  return kept;
}

std::vector<Sets> scheme_ladder(bool is_solid) {
  if (is_solid)
    return {scheme("pic", "", "", "", ""),
            scheme("flip", "", "", "", ""),
            scheme("apic", "", "", "", ""),
            scheme("polypic", "", "multilinear", "", ""),
            scheme("polypic", "", "quadratic", "", ""),
            scheme("polypic", "", "full", "", "")};
  return {scheme("pic", "linear", "", "lie", ""),
          scheme("flip", "linear", "", "lie", ""),
          scheme("apic", "linear", "", "lie", ""),
          scheme("polypic", "linear", "full", "lie", ""),
          scheme("polypic", "linear", "full", "reflection", ""),
          scheme("apic", "quadratic", "", "lie", ""),
          scheme("polypic", "quadratic", "multilinear", "lie", ""),
          scheme("polypic", "quadratic", "quadratic", "lie", "hybrid"),
          scheme("polypic", "quadratic", "full", "lie", "hybrid"),
          scheme("polypic", "quadratic", "full", "reflection", "hybrid")};
}

SchemeNames scheme_names(const sim::Options& o) {
  constexpr std::array kTransfers{"pic", "flip", "apic", "polypic"};
  SchemeNames names;
  names.transfer = kTransfers[static_cast<std::size_t>(o.transfer)];
  names.kernel = o.kernel == sim::Kernel::linear ? "linear" : "quadratic";
  if (o.transfer == sim::Transfer::polypic)
    names.modes = o.modes.count > 0 ? std::to_string(o.modes.count) : o.modes.name.empty() ? "full" : o.modes.name;
  if (!o.is_solid()) names.splitting = o.splitting == sim::Splitting::lie ? "lie" : "reflection";
  return names;
}

namespace {

/// The end of a key that no other varied key has: "velocity", or "a.velocity" beside "b.velocity".
std::string short_name(const std::string& key, const Sets& varied) {
  for (std::size_t dot = key.rfind('.'); dot != std::string::npos && dot > 0; dot = key.rfind('.', dot - 1)) {
    const std::string end = key.substr(dot);
    if (std::none_of(varied.begin(), varied.end(), [&](const auto& v) { return v.first != key && v.first.ends_with(end); })) return end.substr(1);
  }
  return key;
}

}  // namespace

std::string label_of(const sim::Options& o, const Sets& varied) {
  std::string label;
  const auto add = [&](const std::string& word) { label += (label.empty() ? "" : " ") + word; };
  if (varied.empty() || std::any_of(varied.begin(), varied.end(), [](const auto& v) { return is_scheme_key(v.first); })) {
    const SchemeNames names = scheme_names(o);
    add(names.transfer);
    if (!names.modes.empty()) add(names.modes);
    if (!o.is_solid()) add(names.kernel);
    if (names.splitting == "reflection") add(names.splitting);
  }
  for (const auto& [key, value] : varied) {
    if (key == "sim.carry") {   // the ladder's own needs no word
      const bool bends = o.transfer == sim::Transfer::polypic && o.kernel == sim::Kernel::quadratic;
      if (varied.size() == 1 || o.carry != (bends ? sim::Carry::hybrid : sim::Carry::fixed)) add(value);
    } else if (!is_scheme_key(key)) {
      add(short_name(key, varied) + " " + (key == "sim.cell" ? fmt::format("{:.3g}", o.cell) : value));
    }
  }
  return label;
}

std::vector<std::string> set_texts(const Sets& sets) {
  std::vector<std::string> texts;
  for (const auto& [key, value] : sets) texts.push_back(key + "=" + value);
  return texts;
}

}  // namespace app
