#include "app/compare/run.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "app/compare/files.h"
#include "app/stages/document.h"
#include "app/stages/folder.h"
#include "app/stages/record.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// What a record says of the making of a frame and not of the frame.
const std::set<std::string> kUntold = {"schema", "stage", "frame", "hash", "version", "source", "files", "seconds", "cpu_seconds", "peak_bytes",
                                       "passes", "checkpoint", "attributes", "checksum"};

Json read_record_of(const Folder& folder, std::int64_t frame) {
  const fs::path file = folder.record(Stage::simulate, frame);
  Json record = read_document(file, kLargestRecord);
  if (!read_record(folder, Stage::simulate, frame)) base::throw_input(file.string(), "not a record of a ledger");
  return record;
}

/// |a - b| over the larger of the two; vectors by length. Infinite for what is no number on either side.
double relative_difference(const Json& a, const Json& b) {
  const auto vector = [](const Json& value) {
    std::vector<double> numbers;
    if (value.is_number()) numbers.push_back(value.get<double>());
    for (const Json& part : value.is_array() ? value : Json::array())
      if (part.is_number()) numbers.push_back(part.get<double>());
    return numbers;
  };
  const std::vector<double> u = vector(a), v = vector(b);
  if (u.empty() || u.size() != v.size()) return a == b ? 0 : INFINITY;
  double difference = 0, length_u = 0, length_v = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    difference += (u[i] - v[i]) * (u[i] - v[i]);
    length_u += u[i] * u[i];
    length_v += v[i] * v[i];
  }
  return difference > 0 ? std::sqrt(difference / std::max(length_u, length_v)) : 0;
}

/// A record with each number of its energy audit as one of its own; `with_audit`: else without it.
Json flat(Json record, bool with_audit) {
  const Json audit = record.value("energy_changes", Json::object());
  record.erase("energy_changes");
  if (with_audit)
    for (const auto& [pass, change] : audit.items()) record["energy_changes." + pass] = change;
  return record;
}

/// Sums of one frame: {same, max, quantity}, the quantity being the one that differs most. The hash of the state counts where
/// everything must be equal.
Json compare_sums(const Folder& a, const Folder& b, std::int64_t frame, const Tolerance& tolerance) {
  const Json read_a = read_record_of(a, frame), read_b = read_record_of(b, frame);
  const bool audited = read_a.contains("energy_changes") && read_b.contains("energy_changes");   // asking for it changes no result
  const Json in_a = flat(read_a, audited), in_b = flat(read_b, audited);
  std::set<std::string> names;
  for (const Json* record : {&in_a, &in_b})
    for (const auto& [name, value] : record->items())
      if (!kUntold.contains(name)) names.insert(name);
  Json out = {{"same", true}};
  double largest = 0;
  for (const std::string& name : names) {
    if (name == "state_hash" && !tolerance.exact()) continue;
    const bool numbers = name != "state_hash" && in_a.contains(name) && in_b.contains(name);
    const bool same = in_a.value(name, Json()) == in_b.value(name, Json());
    const double difference = numbers ? relative_difference(in_a[name], in_b[name]) : same ? 0 : INFINITY;
    if (difference > tolerance.fail) out["same"] = false;
    if (std::isfinite(difference) && difference > largest) {
      out["quantity"] = name;
      out["max"] = largest = difference;
    } else if (difference > 0 && !out.contains("quantity")) {
      out["quantity"] = name;
    }
  }
  return out;
}

/// What is compared, in the order of the flow. `stage` says whose frames they are.
struct Part {
  const char* name;
  Stage stage;
  Json (*compare)(const Folder&, const Folder&, std::int64_t frame, const Tolerance&);
};
const Part kParts[] = {
    {"simulate", Stage::simulate, compare_sums},
    {"points", Stage::simulate,
     [](const Folder& a, const Folder& b, std::int64_t frame, const Tolerance& t) {
       return compare_point_files(a.points(frame), b.points(frame), t);
     }},
    {"surface", Stage::surface,
     [](const Folder& a, const Folder& b, std::int64_t frame, const Tolerance& t) {
       return compare_volume_files(a.surface(frame), b.surface(frame), t);
     }},
    {"render", Stage::render,
     [](const Folder& a, const Folder& b, std::int64_t frame, const Tolerance& t) {
       Json light = compare_frame_images(a.image(frame, ".exr"), b.image(frame, ".exr"), t);
       if (light.value("max", 0.0) > 0 || !light["same"].get<bool>()) return light;   // what is displayed follows
       return compare_frame_images(a.image(frame, ".png"), b.image(frame, ".png"), t);
     }},
    {"preview", Stage::preview,
     [](const Folder& a, const Folder& b, std::int64_t frame, const Tolerance& t) {
       return compare_frame_images(a.preview(frame), b.preview(frame), t);
     }},
};

/// By which the worst frame is found: the largest difference of any of its grids.
double size_of(const Json& frame) {
  double size = frame.value("max", 0.0);
  for (const Json& grid : frame.value("grids", Json::array())) size = std::max(size, grid.value("max", 0.0));
  return size;
}

/// Counts of one part over all frames.
Json compare_part(const Part& part, const Folder& a, const Folder& b, const Tolerance& tolerance) {
  const std::vector<std::int64_t> in_a = a.recorded_frames(part.stage), in_b = b.recorded_frames(part.stage);
  std::vector<std::int64_t> both, only_a, only_b;
  std::set_intersection(in_a.begin(), in_a.end(), in_b.begin(), in_b.end(), std::back_inserter(both));
  std::set_difference(in_a.begin(), in_a.end(), in_b.begin(), in_b.end(), std::back_inserter(only_a));
  std::set_difference(in_b.begin(), in_b.end(), in_a.begin(), in_a.end(), std::back_inserter(only_b));
  Json out = {{"stage", part.name}, {"frames", both.size()}, {"differ", 0}};
  std::int64_t differ = 0;
  std::vector<std::int64_t> unlike;
  unlike.insert(unlike.end(), only_a.begin(), only_a.end());
  unlike.insert(unlike.end(), only_b.begin(), only_b.end());
  double largest = -1;
  for (const std::int64_t frame : both) {
    Json found = part.compare(a, b, frame, tolerance);
    if (!found["same"].get<bool>()) {
      ++differ;
      unlike.push_back(frame);
    }
    if (const double size = size_of(found); size > largest && (size > 0 || !found["same"].get<bool>())) {
      largest = size;
      found.erase("same");
      found.erase("kind");
      out["worst"] = Json{{"frame", frame}};
      out["worst"].update(found);
    }
  }
  out["differ"] = differ;
  if (!unlike.empty()) out["first"] = *std::min_element(unlike.begin(), unlike.end());
  if (!only_a.empty()) out["only_a"] = only_a;
  if (!only_b.empty()) out["only_b"] = only_b;
  return out;
}

}  // namespace

bool is_run(const fs::path& directory) { return Folder(directory).has_frames(); }

Json compare_runs(const fs::path& path_a, const fs::path& path_b, const Tolerance& tolerance) {
  const Folder a(path_a), b(path_b);
  Json stages = Json::array(), first;
  for (const Part& part : kParts) {
    if (a.recorded_frames(part.stage).empty() && b.recorded_frames(part.stage).empty()) continue;
    stages.push_back(compare_part(part, a, b, tolerance));
    const Json& stage = stages.back();
    if (stage.contains("first") && (first.is_null() || stage["first"] < first["frame"])) first = {{"frame", stage["first"]}, {"stage", part.name}};
  }
  Json out = {{"same", first.is_null()}, {"kind", "run"}};
  if (!first.is_null()) out["first"] = first;
  out["stages"] = stages;
  return out;
}

}  // namespace app
