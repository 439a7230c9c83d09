#include "app/study/study_files.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include <fmt/format.h>

#include "base/text.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

// The columns of the contract; what was added later follows them.
constexpr std::array<std::string_view, 23> kColumns{
    "variant",        "transfer",        "modes",        "kernel",        "splitting",      "cell",           "cfl",         "error_energy",
    "error_position", "error_vorticity", "error_volume", "error_surface", "error_image",    "seconds_median", "seconds_min", "cpu_seconds",
    "peak_bytes",     "disk_bytes",      "pareto",       "case",          "error_velocity", "seconds_max",    "failure"};

std::string measure_column(std::size_t m) { return "error_" + std::string(kMeasureNames[m]); }

/// By column; numbers, texts and flags.
Json row_of(const Variant& v) {
  Json row = {{"variant", v.label}, {"transfer", v.transfer}};
  const auto text = [&](const char* name, const std::string& value) {
    if (!value.empty()) row[name] = value;
  };
  text("modes", v.modes), text("kernel", v.kernel), text("splitting", v.splitting);
  if (v.cell > 0) row["cell"] = v.cell;
  if (v.cfl > 0) row["cfl"] = v.cfl;
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (v.errors.value[m]) row[measure_column(m)] = *v.errors.value[m];
  if (!v.seconds.empty()) {
    row["seconds_median"] = v.seconds_median, row["seconds_min"] = v.seconds_min, row["seconds_max"] = v.seconds_max;
    row["cpu_seconds"] = v.cpu_seconds;
  }
  if (v.peak_bytes > 0) row["peak_bytes"] = v.peak_bytes;
  if (v.disk_bytes > 0) row["disk_bytes"] = v.disk_bytes;
  if (v.ran()) row["pareto"] = v.pareto;
  row["case"] = v.part;
  text("failure", v.failure);
  return row;
}

std::string field(const Json& value) {
  if (value.is_number_float()) return base::to_text(value.get<double>());
  if (!value.is_string()) return value.dump();
  std::string text = value.get<std::string>();
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

Json errors_json(const Errors& errors) {
  Json out = Json::object();
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (errors.value[m]) out[std::string(kMeasureNames[m])] = *errors.value[m];
  return out;
}

Json times_json(const TimeToError& times) {
  Json out = {{"errors", times.levels}, {"schemes", Json::object()}, {"at_most", Json::object()}};
  for (const TimeToError::Row& row : times.rows) {
    Json &seconds = out["schemes"][row.scheme] = Json::array(), &at_most = out["at_most"][row.scheme] = Json::array();
    for (const auto& reach : row.reaches) seconds.push_back(reach ? Json(reach->seconds) : Json()), at_most.push_back(reach && reach->at_most);
  }
  return out;
}

Json variant_json(const Variant& v) {
  Json out = row_of(v);
  if (!v.scheme.empty() && v.scheme != v.label) out["scheme"] = v.scheme;
  Json& keys = out["keys"] = Json::object();
  for (const auto& [key, value] : v.keys) keys[key] = value;
  if (!v.ran()) return out;
  out["particles"] = v.particles, out["steps"] = v.steps;
  out["seconds"] = v.seconds;
  out["ties"] = v.ties;
  Json& passes = out["passes"] = Json::object();
  for (const auto& [name, pass] : v.passes) passes[name] = {{"calls", pass.calls}, {"seconds", pass.seconds}, {"cpu_seconds", pass.cpu_seconds}};
  if (!v.energy_changes.empty()) out["energy_changes"] = v.energy_changes;
  Json& course = out["course"] = {{"time", v.course.time}, {"energy", v.course.energy}};
  if (!v.course.enstrophy.empty()) course["enstrophy"] = v.course.enstrophy;
  Json& pictures = out["pictures"] = Json::array();
  for (const Picture& p : v.pictures) pictures.push_back({{"frame", p.frame}, {"file", p.file.string()}});
  return out;
}

std::string number(const std::optional<double>& value) { return value ? fmt::format("{:.3g}", *value) : "-"; }

std::string times_text(const StudyCase& c, std::size_t width) {
  std::string text = fmt::format("  {:<{}}", "seconds to an error of " + std::string(kMeasureNames[static_cast<std::size_t>(c.decides)]) + " of", width + 2);
  for (const double level : c.times.levels) text += fmt::format(" {:>9}", fmt::format("{:g}", level));
  text += "\n";
  for (const TimeToError::Row& row : c.times.rows) {
    text += fmt::format("    {:<{}}", row.scheme, width);
    for (const auto& reach : row.reaches) text += fmt::format(" {:>9}", reach ? (reach->at_most ? "<=" : "") + number(reach->seconds) : "-");
    text += "\n";
  }
  return text;
}

}  // namespace

std::string csv_text(const Study& study) {
  std::string text;
  for (std::size_t c = 0; c < kColumns.size(); ++c) text += (c > 0 ? "," : "") + std::string(kColumns[c]);
  text += "\r\n";
  for (const Variant& v : study.variants) {
    const Json row = row_of(v);
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      const auto found = row.find(kColumns[c]);
      text += (c > 0 ? "," : "") + (found == row.end() ? "" : field(*found));
    }
    text += "\r\n";
  }
  return text;
}

Json study_json(const Study& study) {
  Json out = {{"schema", 1}, {"subject", study.subject}, {"title", study.title}, {"command", study.command}};
  out["program"] = {{"version", study.version}};
  if (!study.commit.empty()) out["program"]["commit"] = study.commit;
  out["threads"] = study.threads, out["repeats"] = study.repeats;
  out["machine"] = {{"processor", study.processor}, {"cores", study.cores}};
  Json& meaning = out["meaning"] = Json::object();
  for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
    if (!study.meaning[m].empty()) meaning[measure_column(m)] = study.meaning[m];
  out["notes"] = study.notes;
  Json& cases = out["cases"] = Json::array();
  for (const StudyCase& c : study.cases) {
    Json one = {{"name", c.name}, {"decides", kMeasureNames[static_cast<std::size_t>(c.decides)]}, {"sentences", c.sentences}};
    if (const Json noise = errors_json(c.noise); !noise.empty()) one["noise"] = noise;
    if (!c.times.levels.empty()) one["seconds_to_error"] = times_json(c.times);
    cases.push_back(std::move(one));
  }
  if (study.reference) out["reference"] = variant_json(*study.reference);
  Json& variants = out["variants"] = Json::array();
  for (const Variant& v : study.variants) variants.push_back(variant_json(v));
  return out;
}

std::string study_table(const Study& study) {
  std::size_t width = 7;
  for (const Variant& v : study.variants) width = std::max(width, v.label.size());
  std::string text;
  for (const StudyCase& c : study.cases) {
    std::vector<std::size_t> shown;
    for (std::size_t m = 0; m < kMeasureNames.size(); ++m)
      if (std::any_of(study.variants.begin(), study.variants.end(), [&](const Variant& v) { return v.part == c.name && v.errors.value[m]; }))
        shown.push_back(m);
    text += fmt::format("{}\n  {:<{}}", c.name, "error of", width + 2);
    for (const std::size_t m : shown) text += fmt::format(" {:>10}", kMeasureNames[m]);
    text += fmt::format(" {:>9} {:>9} {:>9}\n", "seconds", "CPU s", "MB");
    for (const Variant& v : study.variants) {
      if (v.part != c.name) continue;
      text += fmt::format("  {} {:<{}}", v.pareto ? "*" : " ", v.label, width);
      if (!v.ran()) {
        text += " could not run: " + v.failure + "\n";
        continue;
      }
      for (const std::size_t m : shown) text += fmt::format(" {:>10}", number(v.errors.value[m]));
      text += fmt::format(" {:>9.3g} {:>9.3g} {:>9.0f}\n", v.seconds_median, v.cpu_seconds, double(v.peak_bytes) / 1e6);
    }
    if (!c.times.levels.empty()) text += times_text(c, std::max<std::size_t>(width, 33));
    for (const std::string& sentence : c.sentences)
      if (!sentence.empty()) text += "  " + sentence + "\n";
    text += "\n";
  }
  return text;
}

}  // namespace app
