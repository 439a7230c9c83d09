#include "app/stages/folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <optional>
#include <regex>
#include <system_error>

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
  return std::stoll(part[2]);
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
constexpr std::string_view kLedger = "ledger";

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

// The descriptor of the locked file, or -1 when its former owner removed it meanwhile.
int try_lock(const fs::path& file) {
  const auto fail = [&] { base::throw_io(file.parent_path().string(), std::system_category().message(errno)); };
  const int descriptor = ::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
  if (descriptor < 0) fail();
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
    struct stat status {};
    if (::fstat(descriptor, &status) == 0 && status.st_nlink > 0) return descriptor;
    ::close(descriptor);
    return -1;
  }
  const bool busy = errno == EWOULDBLOCK;
  if (!busy) fail();
  char owner[32] = {};
  [[maybe_unused]] const auto got = ::read(descriptor, owner, sizeof owner - 1);
  ::close(descriptor);
  base::throw_input(file.parent_path().string(), std::string("in use by process ") + owner);
}

}  // namespace

std::string_view stage_name(Stage stage) {
  constexpr std::array<std::string_view, 4> names = {"simulate", "surface", "render", "preview"};
  return names[static_cast<std::size_t>(stage)];
}

fs::path Folder::points(std::int64_t frame) const { return root_ / "points" / numbered("points", frame, ".vdb"); }
fs::path Folder::surface(std::int64_t frame) const { return root_ / "surface" / numbered("surface", frame, ".vdb"); }
fs::path Folder::image(std::int64_t frame, std::string_view extension) const { return root_ / "images" / numbered("beauty", frame, extension); }
fs::path Folder::preview(std::int64_t frame) const { return root_ / "preview" / numbered("preview", frame, ".png"); }
fs::path Folder::record(Stage stage, std::int64_t frame) const { return root_ / kLedger / numbered(stage_name(stage), frame, ".json"); }
fs::path Folder::movie(Stage stage) const { return root_ / (stage == Stage::preview ? "preview.mp4" : "movie.mp4"); }

std::vector<fs::path> Folder::outputs(Stage stage, std::int64_t frame) const {
  std::vector<fs::path> files;
  for (const Series& series : kSeries)
    if (series.stage == stage) files.push_back(root_ / series.folder / numbered(series.stem, frame, series.extension));
  return files;
}

std::vector<std::int64_t> Folder::recorded_frames(Stage stage) const { return frames_in(root_ / kLedger, stage_name(stage), ".json"); }

void Folder::make_room_for(const fs::path& file) {
  std::error_code failure;
  fs::create_directories(file.parent_path(), failure);
  if (failure) base::throw_io(file.parent_path().string(), failure.message());
}

void Folder::remove_files(Stage stage) const {
  for (const std::int64_t frame : recorded_frames(stage)) remove_one(record(stage, frame));   // first: without it a frame is unfinished
  for (const Series& series : kSeries) {
    if (series.stage != stage) continue;
    for (const std::int64_t frame : frames_in(root_ / series.folder, series.stem, series.extension))
      remove_one(root_ / series.folder / numbered(series.stem, frame, series.extension));
  }
  if (stage == Stage::render || stage == Stage::preview) remove_one(movie(stage));
}

void Folder::remove_leftovers() const {
  static const std::regex temporary(R"(\.(shot|run|movie|preview|(points|surface|beauty|preview|simulate|render)\.[0-9]{4,9})\.tmp[0-9]+-[0-9]+\.[a-z0-9]+)");
  for (const fs::path& folder : {root_, root_ / "points", root_ / "surface", root_ / "images", root_ / "preview", root_ / kLedger}) {
    std::error_code none;
    std::vector<fs::path> found;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none))
      if (std::regex_match(entry->path().filename().string(), temporary)) found.push_back(entry->path());
    for (const fs::path& file : found) fs::remove_all(file, none);
  }
}

FolderLock::FolderLock(const Folder& folder) : file_(folder.root() / ".lock") {
  for (fs::path made = fs::absolute(folder.root()).lexically_normal(); made.has_relative_path() && !fs::exists(made); made = made.parent_path())
    made_.push_back(made);
  Folder::make_room_for(file_);
  while (descriptor_ < 0) descriptor_ = try_lock(file_);
  const std::string owner = std::to_string(::getpid());
  if (::ftruncate(descriptor_, 0) == 0 && ::write(descriptor_, owner.data(), owner.size()) == static_cast<ssize_t>(owner.size())) return;
  const std::string reason = std::system_category().message(errno);
  ::close(descriptor_);
  base::throw_io(file_.string(), reason);
}

FolderLock::~FolderLock() {
  std::error_code none;
  fs::remove(file_, none);
  for (const fs::path& made : made_) fs::remove(made, none);   // goes only where nothing came of it: a run that failed leaves no trace
  ::close(descriptor_);
}

}  // namespace app
