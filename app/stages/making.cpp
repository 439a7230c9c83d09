#include "app/stages/making.h"

#include <algorithm>
#include <numeric>

#include "app/stages/document.h"
#include "app/stages/record.h"
#include "app/version.h"
#include "base/atomic_file.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr auto kGoesOn = "--restart or another --out goes on";
constexpr std::size_t kMostNamed = 4;

base::Error refusal(const fs::path& file, const std::string& message, const std::string& hint = kGoesOn) {
  return base::Error({.code = base::Exit::resume_refused, .file = file.string(), .hint = hint, .message = message});
}

// "a, b and 3 more"
std::string names_of(const std::vector<ChangedKey>& changed, std::size_t from = 0) {
  std::string names;
  for (std::size_t i = from; i < changed.size() && i < from + kMostNamed; ++i) names += (names.empty() ? "" : ", ") + changed[i].key;
  if (changed.size() > from + kMostNamed) names += " and " + std::to_string(changed.size() - from - kMostNamed) + " more";
  return names;
}

// The key that names the mesh of a body or collider; empty where none has one.
std::string key_of_mesh(const Shot& shot) {
  for (const sim::Body& body : shot.scene.bodies)
    if (body.shape.mesh) return "body." + body.name + ".shape.mesh.file";
  for (const sim::Collider& collider : shot.scene.colliders)
    if (collider.shape.mesh) return "collider." + collider.name + ".shape.mesh.file";
  return {};
}

// Frames of `stage` that were made with other keys are in the way.
[[noreturn]] void refuse_changed(const Making& m, Stage stage, const std::vector<ChangedKey>& changed, const std::string& goes_on = kGoesOn) {
  if (changed.empty()) {
    base::Complaint complaint = refusal(m.folder.root(), "the frames here were made with another shot", goes_on).complaint();
    std::error_code none;
    if (stage == Stage::simulate && fs::exists(m.folder.shot(), none))
      if (complaint.key = key_of_mesh(m.shot); !complaint.key.empty())
        complaint.message = "the frames here were made with another content of the file";
    throw base::Error(complaint);
  }
  const ChangedKey& first = changed.front();
  std::string message = first.before.empty() ? "the frames here were made without it" : "the frames here were made with " + first.before;
  if (changed.size() > 1) message += "; " + names_of(changed, 1) + " changed too";
  const std::string hint = stage == Stage::surface ? "surface makes them again; another --out leaves them" : goes_on;
  throw base::Error(
      {.code = base::Exit::resume_refused, .file = m.folder.shot().string(), .key = first.key, .value = first.now, .hint = hint, .message = message});
}

// The keys in which shot.toml differs for a stage; none where it was written for others since.
std::vector<ChangedKey> changes(const Making& m, Stage stage) {
  std::error_code none;
  if (!fs::exists(m.folder.shot(), none) || (stage == Stage::surface && m.dimension() == 2)) return {};
  try {
    return changed_keys(base::read_file(m.folder.shot(), kLargestRecord), m.shot, std::string(stage_name(stage)));
  } catch (const base::Error&) {
    throw refusal(m.folder.shot(), "is no shot any more, so what the frames here were made with is unknown");
  }
}

/// How the frames of a stage that matter were made: of a simulation all, of the others those asked for.
struct Past {
  bool other_keys = false;
  std::string other_version;   // of the program; empty when there is none
};

Past past_of(const Making& m, Stage stage) {
  Past past;
  for (const std::int64_t frame : m.folder.recorded_frames(stage)) {
    if (stage != Stage::simulate && (frame < m.range.first || frame > m.range.last)) continue;
    const auto record = read_record(m.folder, stage, frame);
    if (!record) continue;
    if (record->hash != m.hashes.of(stage)) past.other_keys = true;
    if (record->version != kVersion) past.other_version = record->version;
  }
  return past;
}

void add_once(std::vector<ChangedKey>& keys, const ChangedKey& key) {
  if (std::none_of(keys.begin(), keys.end(), [&](const ChangedKey& k) { return k.key == key.key; })) keys.push_back(key);
}

}  // namespace

bool Making::stands_on(Stage stage, Stage upstream) const {
  return is_below(stage, upstream, dimension()) || (upstream == Stage::surface && stage == Stage::preview && previews_surface());
}

bool Making::previews_surface() const { return dimension() == 3 && shot.render.preview.draw == "surface"; }

bool Making::wants(Stage stage) const { return std::find(order.stages.begin(), order.stages.end(), stage) != order.stages.end(); }

std::vector<std::int64_t> Making::frames() const {
  std::vector<std::int64_t> all(static_cast<std::size_t>(range.last - range.first + 1));
  std::iota(all.begin(), all.end(), range.first);
  return all;
}

std::string made_again(const Making& m) {
  if (m.order.restart) return {};
  std::string stages;
  std::vector<ChangedKey> why;
  const auto feeds = [&](Stage stage) {
    return std::any_of(m.order.stages.begin(), m.order.stages.end(), [&](Stage s) { return m.stands_on(s, stage); });
  };
  for (const Stage stage : {Stage::simulate, Stage::surface, Stage::preview, Stage::render}) {
    if (m.folder.recorded_frames(stage).empty()) continue;
    const std::vector<ChangedKey> changed = changes(m, stage);
    const Past past = past_of(m, stage);
    if (past.other_keys && (stage == Stage::simulate || (!m.wants(stage) && feeds(stage)))) refuse_changed(m, stage, changed);
    if (stage == Stage::simulate || !m.wants(stage) || (!past.other_keys && past.other_version.empty())) continue;
    if (!past.other_version.empty()) add_once(why, {"program.version", past.other_version, kVersion});
    if (past.other_keys)
      for (const ChangedKey& key : changed) add_once(why, key);
    if (past.other_keys && changed.empty() && stage != Stage::surface && !m.shot.render.files().empty())
      add_once(why, {"the content of a file", "", ""});
    stages += (stages.empty() ? "" : ", ") + std::string(stage_name(stage));
  }
  return stages.empty() || why.empty() ? stages : stages + " (" + names_of(why) + " changed)";
}

bool reads_otherwise(const Making& m) {
  return std::any_of(m.order.stages.begin(), m.order.stages.end(), [&](Stage stage) { return !changes(m, stage).empty(); });
}

namespace {

/// What each stage that is to be made reads.
std::vector<std::pair<Stage, Stage>> reads(const Making& m) {
  std::vector<std::pair<Stage, Stage>> pairs;
  for (const Stage stage : m.order.stages) {
    if (const auto above = stage_above(stage, m.dimension())) pairs.emplace_back(stage, *above);
    if (stage == Stage::render && m.dimension() == 3 && m.shot.render.draws_grains()) pairs.emplace_back(stage, Stage::simulate);
    if (stage == Stage::preview && m.previews_surface()) pairs.emplace_back(stage, Stage::surface);
  }
  return pairs;
}

}  // namespace

void check_upstream(const Making& m, Finished& finished) {
  for (const auto& [stage, above] : reads(m)) {
    if (m.wants(above)) continue;
    const std::string run = std::string(stage_name(above));
    std::vector<std::int64_t> needed;
    for (const std::int64_t frame : m.frames())
      if (m.order.restart || !finished.has(stage, frame)) needed.push_back(frame);
    finished.look(above, needed);
    for (const std::int64_t frame : needed) {
      const fs::path file = m.folder.outputs(above, frame).front();
      std::error_code none;
      if (!fs::exists(file, none)) {
        const std::string there = std::to_string(m.range.first) + (frame - 1 > m.range.first ? "-" + std::to_string(frame - 1) : "");
        throw base::Error({.file = file.string(), .hint = frame > m.range.first ? "--frames " + there + " is there" : "", .message = "no such file; run " + run + " first"});
      }
      if (finished.has(above, frame)) continue;
      const auto record = read_record(m.folder, above, frame);
      if (!record) base::throw_input(file.string(), "is not finished; run " + run + " first");
      if (record->hash != m.hashes.of(above)) refuse_changed(m, above, changes(m, above), run + " --restart or another --out goes on");
      if (record->version != kVersion && damaged_files(m.folder, *record).empty()) continue;   // another program's surface can be drawn
      base::throw_input(file.string(), "is damaged or out of date; run " + run + ", which makes it again");
    }
  }
}

void check_version(const Making& m) {
  const std::string version = past_of(m, Stage::simulate).other_version;
  if (version.empty()) return;
  throw base::Error({.code = base::Exit::resume_refused, .file = m.folder.root().string(), .key = "program.version", .value = kVersion,
                     .hint = kGoesOn,
                     .message = "the frames here were made by polypic " + version});
}

}  // namespace app
