#include "app/stages/record.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>

#include "app/stages/document.h"
#include "app/plan/plan.h"
#include "app/stages/hash.h"
#include "app/version.h"
#include "base/atomic_file.h"
#include "base/checksum.h"
#include "base/error.h"
#include "sim/instructions.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

double finite(double value, std::string_view name) {
  if (!std::isfinite(value)) throw std::logic_error(std::string(name) + " is not a finite number");
  return value;
}

Json array(const base::Vec3& v, std::string_view name) { return {finite(v.x(), name), finite(v.y(), name), finite(v.z(), name)}; }

base::Vec3 vector(const Json& json) { return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()}; }

// Counters that stand in the record; in run.json those alone that put_totals names.
constexpr std::pair<const char*, std::int64_t sim::Totals::*> kCounters[] = {{"pushed_out", &sim::Totals::pushed_out},
                                                                            {"left", &sim::Totals::left},
                                                                            {"poured", &sim::Totals::poured},
                                                                            {"dropped_modes", &sim::Totals::dropped_modes},
                                                                            {"limited_modes", &sim::Totals::limited_modes},
                                                                            {"light_faces", &sim::Totals::light_faces},
                                                                            {"pressure_iterations", &sim::Totals::pressure_iterations},
                                                                            {"pressure_fallbacks", &sim::Totals::pressure_fallbacks},
                                                                            {"splitting_fallbacks", &sim::Totals::splitting_fallbacks},
                                                                            {"held_strains", &sim::Totals::held_strains},
                                                                            {"steps_by_sound", &sim::Totals::steps_by_sound},
                                                                            {"steps_by_loose", &sim::Totals::steps_by_loose},
                                                                            {"steps_by_motion", &sim::Totals::steps_by_motion},
                                                                            {"steps_by_impact", &sim::Totals::steps_by_impact},
                                                                            {"retries", &sim::Totals::retries}};

// The sums of a frame under the names of run.json.
void put_totals(const sim::Totals& totals, Json& out) {
  const auto put = [&](const char* name, double value) { out[name] = finite(value, name); };
  out["substeps"] = totals.substeps;
  out["particles"] = totals.particles;
  put("mass", totals.mass);
  put("volume", totals.volume);
  put("kinetic_energy", totals.kinetic_energy);
  put("potential_energy", totals.potential_energy);
  if (totals.elastic_energy) put("elastic_energy", *totals.elastic_energy);
  out["linear_momentum"] = array(totals.linear_momentum, "linear_momentum");
  out["angular_momentum"] = array(totals.angular_momentum, "angular_momentum");
  put("max_speed", totals.max_speed);
  if (totals.elastic_energy) put("shortest_step", totals.shortest_step);
  else put("max_divergence", totals.max_divergence);
  if (totals.least_volume) put("least_volume", *totals.least_volume), put("most_volume", *totals.most_volume);
  put("largest_coefficient", totals.largest_coefficient);
  put("largest_cfl", totals.largest_cfl);
  put("collider_work", totals.collider_work);
  put("gravity_work", totals.gravity_work);
  if (totals.poured > 0) out["poured"] = totals.poured, put("poured_energy", totals.poured_energy);
  if (totals.volume_drift) put("volume_drift", *totals.volume_drift);
  if (totals.imbalance) put("imbalance", *totals.imbalance);
  if (totals.splitting_fallbacks > 0) out["splitting_fallbacks"] = totals.splitting_fallbacks;
  for (const auto& [stage, change] : totals.energy_changes) out["energy_changes"][stage] = finite(change, stage);
  out["state_hash"] = hex16(totals.state_hash);
}

sim::Totals totals_from(const Json& json) {
  sim::Totals totals;
  totals.time = json.at("time");
  totals.substeps = json.at("substeps");
  totals.particles = json.at("particles");
  totals.mass = json.at("mass");
  totals.volume = json.at("volume");
  totals.kinetic_energy = json.at("kinetic_energy");
  totals.potential_energy = json.at("potential_energy");
  totals.linear_momentum = vector(json.at("linear_momentum"));
  totals.angular_momentum = vector(json.at("angular_momentum"));
  totals.max_speed = json.at("max_speed");
  if (json.contains("elastic_energy"))
    totals.elastic_energy = json.at("elastic_energy").get<double>(), totals.shortest_step = json.at("shortest_step");
  else totals.max_divergence = json.at("max_divergence");
  if (json.contains("least_volume"))
    totals.least_volume = json.at("least_volume").get<double>(), totals.most_volume = json.at("most_volume").get<double>();
  totals.largest_coefficient = json.value("largest_coefficient", 0.0);   // of records of before the watch there are none of these
  totals.largest_cfl = json.value("largest_cfl", 0.0);
  totals.collider_work = json.value("collider_work", 0.0);
  totals.gravity_work = json.value("gravity_work", 0.0);
  totals.poured_energy = json.value("poured_energy", 0.0);
  if (json.contains("volume_drift")) totals.volume_drift = json.at("volume_drift").get<double>();
  if (json.contains("energy_changes"))
    for (const auto& [pass, change] : json.at("energy_changes").items()) totals.energy_changes[pass] = change;
  if (json.contains("imbalance")) totals.imbalance = json.at("imbalance").get<double>();
  totals.state_hash = std::stoull(json.at("state_hash").get<std::string>(), nullptr, 16);
  for (const auto& [name, count] : kCounters) totals.*count = json.value(name, std::int64_t{0});
  return totals;
}

Json passes_json(const std::map<std::string, base::PassCost, std::less<>>& passes) {
  Json out = Json::object();
  for (const auto& [name, cost] : passes)
    out[name] = {
        {"calls", cost.calls}, {"seconds", finite(cost.seconds, name)}, {"bytes", cost.bytes}, {"cpu_seconds", finite(cost.cpu_seconds, name)}};
  return out;
}

Record::File file_from(const Json& json) { return {json.at("name"), json.at("bytes"), json.at("checksum")}; }

Json to_json(const Record& record) {
  Json out = {{"schema", 1}, {"stage", stage_name(record.stage)}, {"frame", record.frame}, {"hash", record.hash}, {"files", Json::array()}};
  out["version"] = record.version;
  if (record.source) out["source"] = file_json(*record.source);
  for (const Record::File& file : record.files) out["files"].push_back(file_json(file));
  out["seconds"] = finite(record.seconds, "seconds");
  out["cpu_seconds"] = finite(record.cpu_seconds, "cpu_seconds");
  out["peak_bytes"] = record.peak_bytes;
  out["passes"] = passes_json(record.passes);
  if (!record.attributes.empty()) out["attributes"] = record.attributes;
  if (!record.totals) return out;
  out["time"] = finite(record.totals->time, "time");
  put_totals(*record.totals, out);
  for (const auto& [name, count] : kCounters) out[name] = record.totals.value().*count;
  return out;
}

Record record_from(const Json& json, Stage stage) {
  Record record;
  record.stage = stage;
  record.frame = json.at("frame");
  record.hash = json.at("hash");
  record.version = json.at("version");
  if (json.contains("source")) record.source = file_from(json.at("source"));
  for (const Json& file : json.at("files")) record.files.push_back(file_from(file));
  record.seconds = json.at("seconds");
  record.cpu_seconds = json.value("cpu_seconds", 0.0);
  record.peak_bytes = json.at("peak_bytes");
  for (const auto& [name, cost] : json.at("passes").items())
    record.passes[name] = {cost.at("calls"), cost.at("seconds"), cost.at("bytes"), cost.value("cpu_seconds", 0.0)};
  if (json.contains("attributes")) record.attributes = json.at("attributes");
  if (stage == Stage::simulate) record.totals = totals_from(json);
  return record;
}

// One entry of run.json's frames; the records are those of the frame's finished stages.
Json frame_entry(std::int64_t frame, double fps, const std::vector<Record>& records) {
  Json entry = {{"frame", frame}, {"time", static_cast<double>(frame - 1) / fps}};
  base::Ledger passes;
  Json seconds = Json::object(), cpu = Json::object();
  for (const Record& record : records) {
    seconds[stage_name(record.stage)] = record.seconds;
    cpu[stage_name(record.stage)] = record.cpu_seconds;
    for (const auto& [name, cost] : record.passes) passes.add(name, cost);
  }
  for (const Record& record : records)
    if (record.totals) put_totals(*record.totals, entry);
  entry["seconds"] = seconds;
  entry["cpu_seconds"] = cpu;
  entry["passes"] = passes_json(passes.passes());
  return entry;
}

constexpr const char* kOwnSum = "checksum";

std::string sum_of_text(const Json& json) {
  const std::string text = document_text(json);
  return hex16(base::checksum(std::as_bytes(std::span(text))));
}

/// The rest of a record whose own checksum is right; records of before there was one have none.
Json checked(Json json) {
  const auto own = json.find(kOwnSum);
  if (own == json.end()) return json;
  const std::string sum = *own;
  json.erase(kOwnSum);
  if (sum_of_text(json) != sum) throw std::runtime_error("damaged");
  return json;
}

Record::File file_of(const Folder& folder, const fs::path& file, const base::FileSum& sum) {
  return {file.lexically_relative(folder.root()).generic_string(), sum.bytes, hex16(sum.checksum)};
}

}  // namespace

Json file_json(const Record::File& file) { return {{"name", file.name}, {"bytes", file.bytes}, {"checksum", file.checksum}}; }

std::optional<Record::File> measure(const Folder& folder, const fs::path& file) {
  const auto sum = base::sum_of(file);
  if (!sum) return {};
  return file_of(folder, file, *sum);
}

Record::File measure_written(const Folder& folder, const fs::path& file) { return file_of(folder, file, base::sum_of_written(file, file)); }

void write_record(const Folder& folder, std::int64_t dimension, Record record) {
  record.version = kVersion;
  record.files.clear();
  for (const fs::path& file : folder.outputs(record.stage, record.frame)) record.files.push_back(measure_written(folder, file));
  if (const auto above = stage_above(record.stage, dimension)) record.source = measure_written(folder, folder.outputs(*above, record.frame).front());
  record.peak_bytes = base::peak_memory();
  const fs::path path = folder.record(record.stage, record.frame);
  Folder::make_room_for(path);
  Json json = to_json(record);
  json[kOwnSum] = sum_of_text(json);
  base::write_text_atomically(path, document_text(json));
}

std::optional<Record> read_record(const Folder& folder, Stage stage, std::int64_t frame) {
  const fs::path path = folder.record(stage, frame);
  std::error_code none;
  if (!fs::exists(path, none)) return {};
  try {
    Record record = record_from(checked(read_document(path, kLargestRecord)), stage);
    if (record.frame == frame) return record;
    return {};
  } catch (const std::exception&) {   // damaged or of another version: the frame is made again
    return {};
  }
}

std::optional<Record> finished_record(const Folder& folder, std::int64_t dimension, Stage stage, std::int64_t frame, const std::string& hash) {
  std::optional<Record> record = read_record(folder, stage, frame);
  if (!record || record->hash != hash) return {};
  if (stage != Stage::simulate && record->version != kVersion) return {};
  const auto there = [&](const fs::path& output) {
    std::error_code failure;
    const auto bytes = fs::file_size(output, failure);
    return !failure && std::any_of(record->files.begin(), record->files.end(),
                                   [&](const Record::File& file) { return folder.root() / file.name == output && file.bytes == bytes; });
  };
  const std::vector<fs::path> outputs = folder.outputs(stage, frame);
  if (!std::all_of(outputs.begin(), outputs.end(), there)) return {};
  const auto above = stage_above(stage, dimension);
  const auto upstream = above ? read_record(folder, *above, frame) : std::nullopt;   // a user may have removed it to save room
  if (upstream && (!record->source || upstream->files.empty() || *record->source != upstream->files.front())) return {};
  return record;
}

std::vector<std::string> damaged_files(const Folder& folder, const Record& record) {
  std::vector<std::string> damaged;
  for (const Record::File& file : record.files)
    if (measure(folder, folder.root() / file.name) != file) damaged.push_back(file.name);
  return damaged;
}

Json run_document(const Folder& folder, const Shot& shot, int threads) {
  const StageHashes hashes = stage_hashes(shot);
  std::map<std::int64_t, std::vector<Record>> frames;
  std::int64_t peak_bytes = base::peak_memory();
  const std::int64_t dimension = shot.scene.options.dimension;
  for (const Stage stage : {Stage::simulate, Stage::surface, Stage::render})
    for (const std::int64_t frame : folder.recorded_frames(stage))
      if (auto record = finished_record(folder, dimension, stage, frame, hashes.of(stage))) {
        peak_bytes = std::max(peak_bytes, record->peak_bytes);
        frames[frame].push_back(std::move(*record));
      }

  Json stages = {{"simulate", hashes.simulate}};
  if (!hashes.surface.empty()) stages["surface"] = hashes.surface;
  if (shot.has_pictures) stages["render"] = hashes.render;
  Json program = {{"version", kVersion}};
  if (*kCommit) program["commit"] = kCommit;
  Json out = {{"schema", 1},
              {"shot", shot.name},
              {"hashes", stages},
              {"program", program},
              {"threads", threads},
              {"isa", sim::instructions()},
              {"plan", plan_json(shot)},
              {"peak_bytes", peak_bytes},
              {"frames", Json::array()}};
  for (const auto& [frame, records] : frames) out["frames"].push_back(frame_entry(frame, shot.fps, records));
  return out;
}

}  // namespace app
