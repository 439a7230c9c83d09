#include "app/stages/film.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/stages/hash.h"
#include "app/stages/interrupt.h"
#include "app/stages/movie.h"
#include "app/stages/picture.h"
#include "app/stages/record.h"
#include "app/stages/simulate.h"
#include "app/stages/stopwatch.h"
#include "base/atomic_file.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;

bool has(const Order& order, Stage stage) { return std::find(order.stages.begin(), order.stages.end(), stage) != order.stages.end(); }

// What a stage is made of, and what is made of it.
std::optional<Stage> stage_above(Stage stage) {
  if (stage == Stage::simulate) return {};
  return stage == Stage::render ? Stage::surface : Stage::simulate;
}
bool is_below(Stage stage, Stage upstream) {
  for (auto above = stage_above(stage); above; above = stage_above(*above))
    if (*above == upstream) return true;
  return false;
}

const std::string& hash_of(const StageHashes& hashes, Stage stage) {
  if (stage == Stage::simulate) return hashes.simulate;
  return stage == Stage::surface ? hashes.surface : hashes.render;   // a preview stands on the camera too
}

FrameRange range_of(const Shot& shot, const Order& order) { return order.frames.value_or(FrameRange{1, shot.frames}); }

// Frames of one stage in one directory, and the keys they must be made from.
struct Making {
  const Shot& shot;
  const Order& order;
  Folder folder;
  StageHashes hashes;
  FrameRange range;

  bool finished(Stage stage, std::int64_t frame) const { return finished_record(folder, stage, frame, hash_of(hashes, stage)).has_value(); }
};

// Every unfinished frame needs its predecessor's file, from the same shot, unless that is made on the way.
void check_upstream(const Making& m) {
  for (const Stage stage : m.order.stages) {
    const auto above = stage_above(stage);
    if (!above || has(m.order, *above)) continue;
    for (std::int64_t frame = m.range.first; frame <= m.range.last; ++frame) {
      if (!m.order.restart && m.finished(stage, frame)) continue;
      const fs::path file = m.folder.outputs(*above, frame).front();
      std::error_code none;
      if (!fs::exists(file, none)) base::throw_input(file.string(), "no such file; run " + std::string(stage_name(*above)) + " first");
      const auto record = read_record(m.folder, *above, frame);
      if (record && record->hash != hash_of(m.hashes, *above))
        throw base::Error({.code = base::Exit::resume_refused, .file = file.string(),
                           .hint = std::string(stage_name(*above)) + " --restart or another --out goes on", .message = "made from another shot"});
    }
  }
}

// Without shot.toml the records still say whether the frames were made with other keys.
void check_same_hashes(const Making& m) {
  for (const Stage stage : {Stage::simulate, Stage::surface, Stage::render})
    for (const std::int64_t frame : m.folder.recorded_frames(stage))
      if (const auto record = read_record(m.folder, stage, frame); record && record->hash != hash_of(m.hashes, stage))
        throw base::Error({.code = base::Exit::resume_refused, .file = m.folder.root().string(), .hint = "--restart or another --out goes on",
                           .message = "shot.toml is missing, and the frames here were made with another shot"});
}

// Frames of this directory were made from the shot.toml in it.
void check_same_shot(const Making& m) {
  std::error_code none;
  if (m.order.restart) return;
  if (!fs::exists(m.folder.shot(), none)) return check_same_hashes(m);
  std::vector<std::string> changed;
  try {
    changed = changed_keys(base::read_file(m.folder.shot()), m.shot.resolved);
  } catch (const base::Error&) {
    throw base::Error({.code = base::Exit::resume_refused, .file = m.folder.shot().string(), .hint = "--restart or another --out goes on",
                       .message = "is no shot any more, so what the frames here were made with is unknown"});
  }
  if (changed.empty()) return;
  std::string names;
  for (const std::string& key : changed) names += (names.empty() ? "" : ", ") + key;
  throw base::Error({.code = base::Exit::resume_refused, .file = m.folder.shot().string(), .hint = "--restart or another --out goes on",
                     .message = "the frames here were made with another " + names});
}

void remove_for_restart(const Making& m) {
  for (const Stage stage : {Stage::preview, Stage::render, Stage::surface, Stage::simulate})
    if (std::any_of(m.order.stages.begin(), m.order.stages.end(), [&](Stage s) { return s == stage || is_below(stage, s); }))
      m.folder.remove_files(stage);
}

void write_if_other(const fs::path& file, const std::string& text) {
  std::error_code none;
  if (!fs::exists(file, none) || base::read_file(file) != text) base::write_text_atomically(file, text);
}

// A film of every finished picture, unless the one that is there is newer than all of them.
void make_movie(const Making& m, Stage stage) {
  std::vector<fs::path> images;
  for (const std::int64_t frame : m.folder.recorded_frames(stage))
    if (m.finished(stage, frame)) images.push_back(m.folder.outputs(stage, frame).back());
  const fs::path movie = m.folder.movie(stage);
  std::error_code none;
  const auto made = fs::last_write_time(movie, none);
  const bool current = !none && std::all_of(images.begin(), images.end(), [&](const fs::path& image) { return fs::last_write_time(image, none) <= made; });
  if (!images.empty() && !current) write_movie(movie, images, m.shot.fps, m.order.threads);
}

// "frames 3-7"
std::string frames_text(std::int64_t first, std::int64_t last) {
  return first == last ? "frame " + std::to_string(first) : "frames " + std::to_string(first) + "-" + std::to_string(last);
}

/// Tells of frames that were finished before, in one line a stretch.
class KeptFrames {
 public:
  void add(std::int64_t frame) {
    if (first_ == 0) first_ = frame;
    last_ = frame;
  }
  void tell(base::Progress& progress) {
    if (first_ != 0) progress.line("kept   " + frames_text(first_, last_));
    first_ = 0;
  }

 private:
  std::int64_t first_ = 0, last_ = 0;
};

void make_frames(const Making& m, PointsMaker& points, base::Progress& progress) {
  PictureMaker pictures(m.shot, m.folder, m.hashes, m.order.threads);
  KeptFrames kept;
  const std::int64_t first = points.has_work() ? 1 : m.range.first;
  for (std::int64_t frame = first; frame <= m.range.last; ++frame) {
    base::StageSeconds spent;
    const auto work = [&](Stage stage, const char* label, const auto& make) {
      if (!has(m.order, stage)) return;
      if (stage == Stage::simulate ? !points.has_work() : frame < m.range.first || m.finished(stage, frame)) return;
      stop_if_signalled();
      if (spent.empty()) kept.tell(progress);
      progress.working(frame, m.range.last, label);
      spent.emplace_back(label, make());
    };
    work(Stage::simulate, "sim", [&] { return points.make(frame); });
    work(Stage::preview, "preview", [&] { return pictures.preview(frame); });
    work(Stage::surface, "surface", [&] { return pictures.surface(frame); });
    work(Stage::render, "render", [&] { return pictures.render(frame); });
    if (spent.empty()) kept.add(frame);
    else progress.finished(frame, m.range.last, spent);
  }
  kept.tell(progress);
}

// Where the result of the last stage asked for lies.
fs::path result_of(const Making& m) {
  if (has(m.order, Stage::render)) return m.folder.movie(Stage::render);
  if (has(m.order, Stage::preview)) return m.folder.movie(Stage::preview);
  return m.folder.outputs(m.order.stages.back(), 1).front().parent_path();
}

void check(const Making& m) {
  m.folder.remove_leftovers();
  check_same_shot(m);
  check_upstream(m);
}

void announce(const Making& m, base::Progress& progress) {
  const render::Options& picture = m.shot.render.options;
  std::string text = "shot   " + m.shot.name + "  " + frames_text(m.range.first, m.range.last);
  if (has(m.order, Stage::render) || has(m.order, Stage::preview)) text += "  " + std::to_string(picture.width) + "x" + std::to_string(picture.height);
  if (has(m.order, Stage::render)) text += "  " + std::to_string(picture.spp) + " spp";
  progress.line(text + "  " + std::to_string(m.order.threads) + (m.order.threads == 1 ? " thread" : " threads"));
}

}  // namespace

nlohmann::ordered_json make_film(const Shot& shot, const Order& order, base::Progress& progress) {
  const Stopwatch watch;
  const Making m{shot, order, Folder(order.out), stage_hashes(shot), range_of(shot, order)};
  if (!fs::exists(m.folder.root())) check_upstream(m);   // no directory is made for a stage that cannot start
  const FolderLock lock(m.folder);
  check(m);
  PointsMaker points(shot, m.folder, m.hashes.simulate, has(order, Stage::simulate) ? m.range.last : 0, order.restart);
  announce(m, progress);
  if (order.restart) remove_for_restart(m);   // not before the scene has turned out to be one
  write_if_other(m.folder.shot(), shot.resolved);

  const auto document = [&] {
    nlohmann::ordered_json run = run_document(m.folder, shot, order.threads);
    base::write_text_atomically(m.folder.run(), run.dump(2) + "\n");
    return run;
  };
  try {
    make_frames(m, points, progress);
    for (const Stage stage : {Stage::preview, Stage::render})
      if (has(order, stage)) make_movie(m, stage);
  } catch (const Interrupted&) {
    document();
    throw;
  } catch (const base::Error& e) {
    if (e.complaint().code != base::Exit::io) document();
    throw;
  }
  nlohmann::ordered_json run = document();
  progress.line("done   " + result_of(m).string() + "   " + base::duration_text(watch.seconds()));
  return run;
}

}  // namespace app
