#include "app/stages/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <new>
#include <nlohmann/json.hpp>

#include "app/plan/limits.h"
#include "app/plan/plan.h"
#include "app/stages/document.h"
#include "app/stages/interrupt.h"
#include "app/stages/lock.h"
#include "app/stages/making.h"
#include "app/stages/movie.h"
#include "app/stages/picture.h"
#include "app/stages/record.h"
#include "app/stages/simulate.h"
#include "app/stages/stopwatch.h"
#include "app/study/run_report.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;

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

/// What is in hand: a stage and a frame.
using At = std::pair<Stage, std::int64_t>;

/// The result of `work`; where memory runs out in it, that is told as what it is: a shot too large for this machine.
template <class Work>
auto within_memory(const Shot& shot, const std::string& what, const Work& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    refuse_for_memory(shot, "out of memory in " + what);
  }
}

std::string text_of(const At& at) { return std::string(stage_name(at.first)) + " of frame " + std::to_string(at.second); }

/// The stages of a frame, one after another.
class FrameMaker {
 public:
  FrameMaker(const Making& m, Finished& finished, PointsMaker& points, base::Progress& progress)
      : m_(m), finished_(finished), points_(points), progress_(progress), pictures_(m.shot, m.folder, m.hashes, m.order.threads) {}

  void make_all() {
    std::vector<std::int64_t> others;   // frames that another process was at
    const std::int64_t first = m_.wants(Stage::simulate) ? 1 : m_.range.first;
    for (std::int64_t frame = first; frame <= m_.range.last; ++frame)
      if (!make(frame, /*wait=*/false)) others.push_back(frame);
    for (const std::int64_t frame : others) make(frame, /*wait=*/true);
    kept_.tell(progress_);
    at_.reset();
  }

  /// What is in hand, or was when it was stopped.
  const std::optional<At>& at() const { return at_; }

 private:
  /// False when another process makes one of the stages; the rest of the frame stands on it.
  bool make(std::int64_t frame, bool wait) {
    spent_.clear();
    bool complete = true;
    for (const Stage stage : m_.order.stages) {
      const bool is_simulation = stage == Stage::simulate;
      if (is_simulation ? !points_.is_missing(frame) || finished_.has(stage, frame) : frame < m_.range.first || finished_.has(stage, frame)) continue;
      stop_if_signalled();
      complete = is_simulation ? work(stage, frame) : make_locked(stage, frame, wait);
      if (!complete) break;
    }
    if (!spent_.empty()) progress_.finished(frame, m_.range.last, spent_);
    else if (complete) kept_.add(frame);
    return complete;
  }

  bool make_locked(Stage stage, std::int64_t frame, bool wait) {
    const fs::path file = m_.folder.lock_of(stage, frame);
    Folder::make_room_for(file);
    const std::optional<Lock> lock = wait ? Lock::take(file, stop_if_signalled) : Lock::try_take(file);
    if (!lock) return false;
    return finished_.look_again(stage, frame) || work(stage, frame);   // another may have made it meanwhile
  }

  bool work(Stage stage, std::int64_t frame) {
    constexpr std::array<const char*, 4> kLabels = {"sim", "surface", "render", "preview"};
    const char* const label = kLabels[static_cast<std::size_t>(stage)];
    if (spent_.empty()) kept_.tell(progress_);
    progress_.working(frame, m_.range.last, label);
    at_ = At(stage, frame);
    spent_.emplace_back(label, within_memory(m_.shot, text_of(*at_), [&] {
      return stage == Stage::simulate  ? points_.make(frame)
             : stage == Stage::surface ? pictures_.surface(frame)
             : stage == Stage::render  ? pictures_.render(frame)
                                       : pictures_.preview(frame);
    }));
    finished_.add(stage, frame);
    return true;
  }

  const Making& m_;
  Finished& finished_;
  PointsMaker& points_;
  base::Progress& progress_;
  PictureMaker pictures_;
  KeptFrames kept_;
  base::StageSeconds spent_;
  std::optional<At> at_;
};

// A film of every finished picture. One picture that is tried in other light is none, and leaves the film of all as it was.
void make_movies(const Making& m, Finished& finished, base::Progress& progress) {
  for (const Stage stage : {Stage::preview, Stage::render}) {
    if (!m.wants(stage)) continue;
    const Lock lock = Lock::take(m.folder.lock_of_movie(), stop_if_signalled);
    std::vector<std::int64_t> frames = m.folder.recorded_frames(stage);
    finished.look(stage, frames);
    const std::size_t others = std::erase_if(frames, [&](std::int64_t frame) { return !finished.has(stage, frame); });
    std::error_code none;
    if (others > 0 && frames.size() <= 1 && fs::exists(m.folder.movie(stage), none)) {
      progress.line("movie  as it was: " + std::to_string(others) + " of its frames are of other keys, or not whole");
      continue;
    }
    if (others > 0) progress.line("movie  " + base::count_of(frames.size(), "frame") + "; " + std::to_string(others) + " more are of other keys, or not whole");
    make_movie(m.folder, stage, frames, m.shot.fps, m.order.threads);
  }
}

nlohmann::ordered_json write_run(const Making& m, base::Progress& progress, const nlohmann::ordered_json& stopped = {}) {
  const Lock lock = Lock::take(m.folder.lock_of_run(), [] {});   // the last to write has read all records
  nlohmann::ordered_json run = run_document(m.folder, m.shot, m.order.threads);
  if (!stopped.empty()) run["stopped"] = stopped;
  base::write_text_atomically(m.folder.run(), document_text(run));
  if (m.order.report) within_memory(m.shot, "report.html", [&] { write_run_report(m.folder, m.shot, run, m.order.command, progress); });
  return run;
}

// Why a run was stopped, beside all that is finished.
void write_stopped(const Making& m, const std::optional<At>& at, int code, const std::string& message, base::Progress& progress) {
  nlohmann::ordered_json stopped = {{"code", code}, {"message", message}};
  if (at) stopped["stage"] = stage_name(at->first), stopped["frame"] = at->second;
  try {
    write_run(m, progress, stopped);
  } catch (const std::exception&) {   // a disk or memory that is still full; why the run stopped is what counts
  }
}

// The command that goes on where this one ended.
std::string without_restart(std::string command) {
  const std::string restart = " --restart";
  for (std::size_t at; (at = command.find(restart)) != std::string::npos;) command.erase(at, restart.size());
  return command;
}

// Makes everything; whatever stops it, what is finished is told of in run.json and report.html, and the simulation is saved.
nlohmann::ordered_json make_and_write(const Making& m, Finished& finished, PointsMaker& points, base::Progress& progress) {
  FrameMaker frames(m, finished, points, progress);
  try {
    frames.make_all();
    within_memory(m.shot, "the movie", [&] { make_movies(m, finished, progress); });
    return write_run(m, progress);
  } catch (const Interrupted& e) {
    fs::path saved;
    try {
      saved = points.save();
    } catch (const base::Error& full) {
      progress.warn(full.what());
    }
    write_stopped(m, frames.at(), 128 + e.signal(), "interrupted", progress);
    throw Interrupted(e.signal(), saved.string());
  } catch (const base::Error& e) {
    base::Complaint complaint = e.complaint();
    if (complaint.code == base::Exit::package && !m.order.command.empty())
      complaint.hint = "apt-get install ffmpeg, then: " + without_restart(m.order.command);
    write_stopped(m, frames.at(), static_cast<int>(complaint.code), base::to_line(complaint), progress);
    throw base::Error(std::move(complaint));
  } catch (const std::exception& e) {
    write_stopped(m, frames.at(), static_cast<int>(base::Exit::fault), e.what(), progress);
    throw;
  }
}

// Where the result of the last stage asked for lies.
fs::path result_of(const Making& m) {
  const bool is_one = m.range.first == m.range.last;
  for (const Stage stage : {Stage::render, Stage::preview})
    if (m.wants(stage)) return is_one ? m.folder.outputs(stage, m.range.first).back() : m.folder.movie(stage);
  return m.folder.outputs(m.order.stages.back(), 1).front().parent_path();
}

void announce_thin_meshes(const sim::Scene& scene, base::Progress& progress) {
  constexpr double kTold = 1e-3;   // parts of the surface: edges have less
  for (const sim::Collider& collider : scene.colliders) {
    if (!collider.shape.mesh || collider.shape.mesh->distances->part_too_thin() < kTold) continue;
    progress.line(fmt::format("thin   collider {}: {:.1f} % of its surface has less than half a cell under it, and may let through what comes there",
                              collider.name, 100 * collider.shape.mesh->distances->part_too_thin()));
  }
}

void announce(const Making& m, const std::string& again, const Finished& finished, base::Progress& progress) {
  const render::Options& picture = m.shot.render.options;
  std::string text = "shot   " + m.shot.name + "  " + frames_text(m.range.first, m.range.last);
  if (m.wants(Stage::render) || m.wants(Stage::preview)) text += "  " + std::to_string(picture.width) + "x" + std::to_string(picture.height);
  if (m.wants(Stage::render) && m.dimension() == 3) text += "  " + std::to_string(picture.spp) + " spp";
  progress.line(text + "  " + base::count_of(m.order.threads, "thread"));
  progress.line("plan   " + plan_line(m.shot) + (m.order.cost.empty() ? "" : ", " + m.order.cost));
  if (m.wants(Stage::simulate)) announce_thin_meshes(m.shot.scene, progress);
  if (!again.empty()) progress.line("again  " + again);
  if (finished.damaged().empty()) return;
  const std::size_t more = finished.damaged().size() - 1;
  progress.line("again  " + finished.damaged().front() + (more > 0 ? " and " + std::to_string(more) + " more files" : "") +
                (more > 0 ? " are" : " is") + " damaged");
}

void remove_for_restart(const Making& m) {
  for (const Stage stage : {Stage::preview, Stage::render, Stage::surface, Stage::simulate})
    if (std::any_of(m.order.stages.begin(), m.order.stages.end(), [&](Stage s) { return s == stage || m.stands_on(stage, s); }))
      m.folder.remove_files(stage);
}

// Only who is alone changes what the directory is for.
void require_alone(const Making& m, const FolderLock& lock) {
  if (!lock.alone()) base::throw_input(m.folder.root().string(), "in use by " + owner_of(m.folder.lock()));
}

std::optional<Lock> lock_simulation(const Making& m) {
  if (!m.wants(Stage::simulate)) return {};
  std::optional<Lock> lock = Lock::try_take(m.folder.lock_of_simulation());
  if (!lock) base::throw_input(m.folder.root().string(), "in use by " + owner_of(m.folder.lock_of_simulation()));
  return lock;
}

// The frames a simulation must make. Those it only passes by are not read, and need not be whole.
std::vector<std::int64_t> missing_points(const Making& m, Finished& finished) {
  if (!m.wants(Stage::simulate)) return {};
  std::vector<std::int64_t> missing;
  for (std::int64_t frame = 1; frame <= m.range.last; ++frame)
    if (m.order.restart || !(frame < m.range.first ? finished.stands(Stage::simulate, frame) : finished.has(Stage::simulate, frame)))
      missing.push_back(frame);
  return missing;
}

// A shot.toml that is no run's copy is somebody's work: it is not written over.
void spare_shots_of_others(const Making& m) {
  const fs::path file = m.folder.shot();
  std::error_code none;
  if (!fs::exists(file, none)) return;
  const std::string hint = "another --out leaves it";
  if (fs::equivalent(file, m.shot.file, none) && base::read_file(file, kLargestRecord) != copy_of(m.shot, m.folder.root()))
    throw base::Error({.file = file.string(), .hint = hint, .message = "is the shot itself, and the run would write its own copy over it"});
  if (!m.folder.has_ledger() && !is_resolved(base::read_file(file, kLargestRecord)))
    throw base::Error({.file = file.string(), .hint = hint, .message = "is not of a run, and this one would write its own over it"});
}

void write_shot(const Making& m, const FolderLock& lock, bool changed) {
  std::error_code none;
  const bool there = fs::exists(m.folder.shot(), none);
  const std::string copy = copy_of(m.shot, m.folder.root());
  if (there && base::read_file(m.folder.shot(), kLargestRecord) == copy) return;
  if (!lock.alone() && (!there || changed || reads_otherwise(m))) require_alone(m, lock);
  if (lock.alone()) base::write_text_atomically(m.folder.shot(), copy);
}

/// All that comes before the first frame. What fails in a directory that is this run's alone is told in its run.json; a refusal leaves that as it is.
std::unique_ptr<PointsMaker> prepare(const Making& m, FolderLock& lock, Finished& finished, base::Progress& progress) {
  const std::string again = made_again(m);
  if (!m.order.restart)
    for (const Stage stage : m.order.stages) finished.look(stage, m.frames());
  At at(m.order.stages.front(), m.range.first);
  try {
    check_upstream(m, finished);
    const std::vector<std::int64_t> missing = missing_points(m, finished);
    if (!missing.empty()) at.second = missing.front();
    if (!missing.empty() && !m.order.restart) check_version(m);
    auto points = within_memory(m.shot, text_of(at), [&] {
      return std::make_unique<PointsMaker>(m.shot, m.folder, m.hashes.simulate, missing, progress);
    });
    announce(m, again, finished, progress);
    if (m.order.restart && m.order.frames && m.folder.has_frames()) progress.line("again  --restart forgets all frames, not these alone");
    if (m.order.restart) remove_for_restart(m);   // not before the scene has turned out to be one
    write_shot(m, lock, !again.empty());
    if (lock.alone()) lock.let_others_in();
    return points;
  } catch (const base::Error& e) {
    const base::Complaint& complaint = e.complaint();
    const bool of_others = m.order.restart && m.folder.has_frames();   // which are still there
    if (lock.alone() && !of_others && !reads_otherwise(m) && complaint.code != base::Exit::resume_refused)
      write_stopped(m, at, static_cast<int>(complaint.code), base::to_line(complaint), progress);
    throw;
  }
}

}  // namespace

nlohmann::ordered_json make_film(const Shot& shot, const Order& order, base::Progress& progress) {
  const Stopwatch watch;
  const Making m{shot, order, Folder(order.out), stage_hashes(shot), order.frames.value_or(FrameRange{1, shot.frames})};
  Finished finished(m.folder, m.hashes, m.dimension());
  std::error_code none;
  if (!fs::exists(m.folder.root(), none)) check_upstream(m, finished);   // no directory is made for a stage that cannot start
  spare_shots_of_others(m);
  if (order.report) m.folder.refuse_for_reports_of_studies();
  FolderLock lock(m.folder);
  const std::optional<Lock> simulating = lock_simulation(m);
  if (order.restart) require_alone(m, lock);

  std::unique_ptr<PointsMaker> points = prepare(m, lock, finished, progress);
  nlohmann::ordered_json run = make_and_write(m, finished, *points, progress);
  progress.line("done   " + result_of(m).string() + "   " + base::duration_text(watch.seconds()));
  return run;
}

}  // namespace app
