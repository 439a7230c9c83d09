#pragma once
// The directory of one run, out/NAME: where each file lies, who works in it, and which files are the program's own.
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// What leaves files of its own, in the order of the flow. A preview needs points only.
enum class Stage { simulate, surface, render, preview };
std::string_view stage_name(Stage);

/// Paths inside a run's directory. Names end in the frame's number, at least four digits.
class Folder {
 public:
  explicit Folder(std::filesystem::path root) : root_(std::move(root)) {}

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path shot() const { return root_ / "shot.toml"; }
  std::filesystem::path run() const { return root_ / "run.json"; }
  std::filesystem::path points(std::int64_t frame) const;
  std::filesystem::path surface(std::int64_t frame) const;
  std::filesystem::path image(std::int64_t frame, std::string_view extension) const;   // ".exr" | ".png"
  std::filesystem::path preview(std::int64_t frame) const;
  std::filesystem::path record(Stage, std::int64_t frame) const;                       // ledger/STAGE.0001.json
  std::filesystem::path movie(Stage) const;                                            // of render or preview
  /// What a frame of the stage consists of.
  std::vector<std::filesystem::path> outputs(Stage, std::int64_t frame) const;
  /// Frames of the stage that have a record, ascending.
  std::vector<std::int64_t> recorded_frames(Stage) const;

  /// Makes the directory a file goes to; throws base::Error (exit 5).
  static void make_room_for(const std::filesystem::path& file);
  /// Removes the stage's files; whatever else lies in the directory stays.
  void remove_files(Stage) const;
  /// Removes what a killed run left under temporary names.
  void remove_leftovers() const;

 private:
  std::filesystem::path root_;
};

/// Held while a process works in a directory; a second one is turned away (exit 2, naming the first).
/// Makes the directory, and takes it away again when nothing came of it; throws base::Error (exit 5) where it cannot be made.
class FolderLock {
 public:
  explicit FolderLock(const Folder&);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::filesystem::path file_;
  std::vector<std::filesystem::path> made_;   // directories that were not there before, innermost first
  int descriptor_ = -1;
};

}  // namespace app
