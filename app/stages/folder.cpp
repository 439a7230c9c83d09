#include "app/stages/folder.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <regex>
#include <system_error>

#include "app/stages/lock.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::string numbered(std::string_view stem, std::int64_t frame, std::string_view extension) {
  char number[24];
  std::snprintf(number, sizeof number, ".%04lld", static_cast<long long>(frame));
  return std::string(stem) + number + std::string(extension);
}

// The frame of "STEM.0001EXTENSION", or nothing for any other name.
std::optional<std::int64_t> frame_of(const std::string& name, std::string_view stem, std::string_view extension) {
  static const std::regex form(R"(([a-z]+)\.([0-9]{4,9})(\.[a-z0-9]+))");
  std::smatch part;
  if (!std::regex_match(name, part, form) || part[1] != std::string(stem) || part[3] != std::string(extension)) return {};
  const std::int64_t frame = std::stoll(part[2]);
  if (frame < 1) return {};
  return frame;
}

// Files of one kind in a folder: images/beauty.0001.exr.
struct Series {
  Stage stage;
  std::string_view folder, stem, extension;
};
constexpr std::array kSeries = {
    Series{Stage::simulate, "points", "points", ".vdb"},   Series{Stage::surface, "surface", "surface", ".vdb"},
    Series{Stage::render, "images", "beauty", ".exr"},     Series{Stage::render, "images", "beauty", ".png"},
    Series{Stage::preview, "preview", "preview", ".png"},
};
constexpr std::string_view kLedger = "ledger", kCheckpoints = "checkpoint", kCheckpoint = "state";

std::vector<std::int64_t> frames_in(const fs::path& folder, std::string_view stem, std::string_view extension) {
  std::vector<std::int64_t> frames;
  std::error_code none;   // no folder, no frames
  for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none))
    if (const auto frame = frame_of(entry->path().filename().string(), stem, extension)) frames.push_back(*frame);
  std::sort(frames.begin(), frames.end());
  return frames;
}

void remove_one(const fs::path& file) {
  std::error_code failure;
  fs::remove(file, failure);
  if (failure) base::throw_io(file.string(), failure.message());
}

}  // namespace

std::string_view stage_name(Stage stage) {
  constexpr std::array<std::string_view, 4> names = {"simulate", "surface", "render", "preview"};
  return names[static_cast<std::size_t>(stage)];
}

std::optional<Stage> stage_above(Stage stage, std::int64_t dimension) {
  if (stage == Stage::simulate) return {};
  return stage == Stage::render && dimension == 3 ? Stage::surface : Stage::simulate;
}

bool is_below(Stage stage, Stage upstream, std::int64_t dimension) {
  for (auto above = stage_above(stage, dimension); above; above = stage_above(*above, dimension))
    if (*above == upstream) return true;
  return false;
}

fs::path Folder::points(std::int64_t frame) const { return root_ / "points" / numbered("points", frame, ".vdb"); }
fs::path Folder::surface(std::int64_t frame) const { return root_ / "surface" / numbered("surface", frame, ".vdb"); }
fs::path Folder::image(std::int64_t frame, std::string_view extension) const { return root_ / "images" / numbered("beauty", frame, extension); }
fs::path Folder::preview(std::int64_t frame) const { return root_ / "preview" / numbered("preview", frame, ".png"); }
fs::path Folder::record(Stage stage, std::int64_t frame) const { return root_ / kLedger / numbered(stage_name(stage), frame, ".json"); }
fs::path Folder::checkpoint(std::int64_t frame) const { return root_ / kCheckpoints / numbered(kCheckpoint, frame, ".h5"); }
fs::path Folder::lock_of(Stage stage, std::int64_t frame) const {
  return root_ / kLedger / numbered("." + std::string(stage_name(stage)), frame, ".lock");
}
fs::path Folder::movie(Stage stage) const { return root_ / (stage == Stage::preview ? "preview.mp4" : "movie.mp4"); }

fs::path Folder::movie_record(Stage stage) const { return root_ / kLedger / (movie(stage).stem().string() + ".json"); }

std::vector<fs::path> Folder::outputs(Stage stage, std::int64_t frame) const {
  std::vector<fs::path> files;
  for (const Series& series : kSeries)
    if (series.stage == stage) files.push_back(root_ / series.folder / numbered(series.stem, frame, series.extension));
  return files;
}

std::vector<std::int64_t> Folder::recorded_frames(Stage stage) const { return frames_in(root_ / kLedger, stage_name(stage), ".json"); }

bool Folder::has_frames() const {
  return std::any_of(kSeries.begin(), kSeries.end(), [&](const Series& series) { return !recorded_frames(series.stage).empty(); });
}

bool Folder::has_ledger() const {
  std::error_code none;
  return fs::is_directory(root_ / kLedger, none);
}

void Folder::refuse_for_other_reports(const fs::path& out) {
  const Folder folder(out);
  std::error_code none;
  if (folder.study().empty() && (folder.has_ledger() || fs::exists(folder.run(), none)))
    base::throw_input("--out " + out.string(), "is the directory of a run, whose report.html would be written over");
}

std::string Folder::study() const {
  std::error_code none;
  for (const char* const made : {"cost.json", "verify.json"})
    if (fs::exists(root_ / made, none)) return made;
  return {};
}

void Folder::refuse_for_reports_of_studies() const {
  if (const std::string made = study(); !made.empty())
    throw base::Error({.file = root_.string(), .hint = "another --out or --no-report leaves it",
                       .message = "holds " + made + ", whose report.html the run's would replace"});
}

std::vector<std::int64_t> Folder::checkpoints() const { return frames_in(root_ / kCheckpoints, kCheckpoint, ".h5"); }

void Folder::make_room_for(const fs::path& file) {
  std::error_code failure;
  fs::create_directory(file.parent_path(), failure);   // one level: a run's directory that went away is not made again
  if (failure) base::throw_io(file.parent_path().string(), failure.message());
}

void Folder::remove_files(Stage stage) const {
  for (const std::int64_t frame : recorded_frames(stage)) remove_one(record(stage, frame));   // first: without it a frame is unfinished
  for (const Series& series : kSeries) {
    if (series.stage != stage) continue;
    for (const std::int64_t frame : frames_in(root_ / series.folder, series.stem, series.extension))
      remove_one(root_ / series.folder / numbered(series.stem, frame, series.extension));
  }
  if (stage == Stage::simulate)
    for (const std::int64_t frame : checkpoints()) remove_one(checkpoint(frame));
  if (stage != Stage::render && stage != Stage::preview) return;
  remove_one(movie_record(stage));
  remove_one(movie(stage));
}

void Folder::remove_leftovers() const {
  static const std::regex left(R"(\.(shot|run|report|movie|preview|(points|surface|beauty|preview|simulate|render|state)\.[0-9]{4,9}))"
                               R"(\.tmp[0-9]+-[0-9]+\.[a-z0-9]+)"
                               R"(|\.(simulate|run|movie|(surface|render|preview)\.[0-9]{4,9})\.lock)");
  std::vector<fs::path> folders = {root_, root_ / kLedger, root_ / kCheckpoints};
  for (const Series& series : kSeries) folders.push_back(root_ / series.folder);
  for (const fs::path& folder : folders) {
    std::error_code none;
    std::vector<fs::path> found;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none))
      if (std::regex_match(entry->path().filename().string(), left)) found.push_back(entry->path());
    for (const fs::path& file : found)
      if (file.extension() == ".lock") Lock::try_take(file);   // which goes with its owner, and that is nobody any more
      else fs::remove(file, none);
  }
}

}  // namespace app
