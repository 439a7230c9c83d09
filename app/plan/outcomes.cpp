// What finished runs cost, against what was said before they began: kept in the user's cache.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/plan/predict.h"
#include "app/stages/document.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostKept = 50, kMostAsked = 20;

fs::path outcomes_file() { return cache_folder().empty() ? fs::path() : cache_folder() / "outcomes.json"; }

constexpr std::pair<const char*, double Outcome::*> kNumbers[] = {{"cpu_predicted", &Outcome::cpu_predicted},       {"cpu", &Outcome::cpu},
                                                                 {"memory_predicted", &Outcome::memory_predicted}, {"memory", &Outcome::memory},
                                                                 {"disk_predicted", &Outcome::disk_predicted},     {"disk", &Outcome::disk}};

std::string percent(const std::vector<Outcome>& outcomes, double Outcome::*predicted, double Outcome::*measured) {
  std::vector<double> errors;
  for (const Outcome& o : outcomes)
    if (o.*measured > 0) errors.push_back(std::abs(o.*predicted / o.*measured - 1));
  if (errors.empty()) return "?";
  std::sort(errors.begin(), errors.end());
  return std::to_string(std::lround(100 * errors[errors.size() / 2])) + " %";
}

}  // namespace

std::vector<Outcome> past_outcomes() {
  std::vector<Outcome> outcomes;
  const fs::path file = outcomes_file();
  std::error_code none;
  if (file.empty() || !fs::exists(file, none)) return outcomes;
  try {
    const Json json = Json::parse(base::read_file(file));
    for (const Json& entry : json.at("runs")) {
      Outcome o{.shot = entry.at("shot")};
      for (const auto& [name, number] : kNumbers) o.*number = entry.at(name);
      outcomes.push_back(o);
    }
  } catch (const std::exception&) {   // damaged: forgotten
    outcomes.clear();
  }
  return outcomes;
}

void keep_outcome(const Outcome& latest) {
  const fs::path file = outcomes_file();
  if (file.empty()) return;
  std::vector<Outcome> outcomes = past_outcomes();
  outcomes.push_back(latest);
  if (outcomes.size() > kMostKept) outcomes.erase(outcomes.begin(), outcomes.end() - kMostKept);
  Json json = {{"schema", 1}, {"runs", Json::array()}};
  for (const Outcome& o : outcomes) {
    Json entry = {{"shot", o.shot}};
    for (const auto& [name, number] : kNumbers) entry[name] = o.*number;
    json["runs"].push_back(entry);
  }
  try {
    fs::create_directories(file.parent_path());
    base::write_text_atomically(file, document_text(json));
  } catch (const fs::filesystem_error&) {   // a cache that cannot be written is none
  } catch (const base::Error&) {
  }
}

std::string error_text(const std::vector<Outcome>& all) {
  const std::vector<Outcome> latest(all.end() - std::ptrdiff_t(std::min(all.size(), kMostAsked)), all.end());
  if (latest.empty()) return {};
  return "CPU " + percent(latest, &Outcome::cpu_predicted, &Outcome::cpu) + ", memory " +
         percent(latest, &Outcome::memory_predicted, &Outcome::memory) + ", disk " + percent(latest, &Outcome::disk_predicted, &Outcome::disk) +
         " (median of " + base::count_of(latest.size(), "run") + ")";
}

}  // namespace app
