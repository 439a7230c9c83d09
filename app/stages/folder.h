#pragma once
// The directory of one run, out/NAME: where each file lies, and which files are the program's own.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace app {

/// What leaves files of its own, in the order of the flow. A preview of points needs these only.
enum class Stage { simulate, surface, render, preview };
std::string_view stage_name(Stage);

/// What a stage is made of; in a plane there is no surface and points are drawn.
std::optional<Stage> stage_above(Stage, std::int64_t dimension);
bool is_below(Stage, Stage upstream, std::int64_t dimension);

/// Paths inside a run's directory. Names end in the frame's number, at least four digits.
class Folder {
 public:
  explicit Folder(std::filesystem::path root) : root_(std::move(root)) {}

  const std::filesystem::path& root() const { return root_; }
  std::filesystem::path shot() const { return root_ / "shot.toml"; }
  std::filesystem::path run() const { return root_ / "run.json"; }
  std::filesystem::path report() const { return root_ / "report.html"; }
  std::filesystem::path points(std::int64_t frame) const;
  std::filesystem::path surface(std::int64_t frame) const;
  std::filesystem::path image(std::int64_t frame, std::string_view extension) const;   // ".exr" | ".png"
  std::filesystem::path preview(std::int64_t frame) const;
  std::filesystem::path checkpoint(std::int64_t frame) const;
  std::filesystem::path record(Stage, std::int64_t frame) const;                       // ledger/STAGE.0001.json
  std::filesystem::path movie(Stage) const;                                            // of render or preview
  std::filesystem::path movie_record(Stage) const;
  /// What a frame of the stage consists of.
  std::vector<std::filesystem::path> outputs(Stage, std::int64_t frame) const;
  /// Frames of the stage that have a record, ascending.
  std::vector<std::int64_t> recorded_frames(Stage) const;
  /// Any stage has one.
  bool has_frames() const;
  /// A run was here, even when none of its frames is left.
  bool has_ledger() const;
  /// "cost.json" or "verify.json" where the directory is that of a study or of verified cases; report.html is theirs then. Empty where it is none.
  std::string study() const;
  /// Of a study or of verified cases: throws base::Error (exit 2) where report.html is a run's, which theirs would replace.
  static void refuse_for_other_reports(const std::filesystem::path& out);
  /// The other way round.
  void refuse_for_reports_of_studies() const;
  /// Frames that have a checkpoint, ascending.
  std::vector<std::int64_t> checkpoints() const;

  /// Held while the directory is used, while a simulation works in it, while run.json or a movie is put together, while a stage makes
  /// a frame (app/stages/lock.h).
  std::filesystem::path lock() const { return root_ / ".lock"; }
  std::filesystem::path lock_of_simulation() const { return root_ / ".simulate.lock"; }
  std::filesystem::path lock_of_run() const { return root_ / ".run.lock"; }
  std::filesystem::path lock_of_movie() const { return root_ / ".movie.lock"; }
  std::filesystem::path lock_of(Stage, std::int64_t frame) const;

  /// Makes the folder a file goes to, in a run's directory that is there; throws base::Error (exit 5).
  static void make_room_for(const std::filesystem::path& file);
  /// Removes the stage's files; whatever else lies in the directory stays.
  void remove_files(Stage) const;
  /// Removes what killed runs left: temporary files and locks. Only for who is alone in the directory.
  void remove_leftovers() const;

 private:
  std::filesystem::path root_;
};

}  // namespace app
