// Several runs, or pictures, side by side.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/stages/document.h"
#include "app/stages/folder.h"
#include "app/stages/record.h"
#include "app/stages/write_over.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;

bool has(const std::vector<std::int64_t>& frames, std::int64_t frame) { return std::find(frames.begin(), frames.end(), frame) != frames.end(); }

/// The last frame that all runs have, or the one asked for.
std::optional<std::int64_t> common_frame(const std::vector<Folder>& runs, Stage stage, const std::optional<FrameRange>& asked) {
  std::vector<std::int64_t> frames = runs.front().recorded_frames(stage);
  if (asked) frames = {asked->first};
  for (const Folder& run : runs) {
    const std::vector<std::int64_t> others = run.recorded_frames(stage);
    std::erase_if(frames, [&](std::int64_t frame) { return !has(others, frame); });
  }
  return frames.empty() ? std::nullopt : std::optional(frames.back());
}

constexpr std::int64_t kWholeCaption = 560;   // [pixels] narrower previews have no room for the transfer

/// NAME  PolyPIC full linear  frame 12  t = 0.458 s  31.5 s: the last is what simulating took so far. NAME and that, where the picture says the
/// rest itself, with the transfer where it is too narrow to.
std::string label_of(const Folder& run, Stage stage, std::int64_t frame) {
  const Shot shot = read_shot_alone(run.shot(), {});
  const bool is_drawn = stage == Stage::preview || shot.scene.options.dimension == 2;
  double seconds = 0;
  for (const std::int64_t f : run.recorded_frames(Stage::simulate))
    if (const auto record = read_record(run, Stage::simulate, f); record && f <= frame) seconds += record->seconds;
  char text[160];
  const render::Options& picture = shot.render.options;
  const bool is_wide = picture.width / std::max<std::int64_t>(1, picture.height / 500) >= kWholeCaption;
  const std::string transfer = transfer_text(shot.scene.options);
  if (is_drawn && render::has_caption(shot.render) && is_wide) std::snprintf(text, sizeof text, "  simulated in %.1f s", seconds);
  else if (is_drawn && render::has_caption(shot.render)) std::snprintf(text, sizeof text, "  %s  %.1f s", transfer.c_str(), seconds);
  else
    std::snprintf(text, sizeof text, "  %s  frame %lld  t = %.3f s  %.1f s", transfer.c_str(),
                  static_cast<long long>(frame), static_cast<double>(frame - 1) / shot.fps, seconds);
  const fs::path root = run.root().has_filename() ? run.root() : run.root().parent_path();
  return root.filename().string() + text;
}

struct Panels {
  std::vector<render::Image> pictures;
  std::vector<std::string> labels;
};

/// Previews where every run has that frame's, else the film's pictures.
Panels panels_of_runs(const std::vector<Folder>& runs, const std::optional<FrameRange>& asked) {
  for (const Stage stage : {Stage::preview, Stage::render}) {
    const auto frame = common_frame(runs, stage, asked);
    if (!frame) continue;
    Panels panels;
    for (const Folder& run : runs) {
      panels.pictures.push_back(render::read_image(stage == Stage::preview ? run.preview(*frame) : run.image(*frame, ".png")));
      panels.labels.push_back(label_of(run, stage, *frame));
    }
    return panels;
  }
  const std::string which = asked ? "frame " + std::to_string(asked->first) : "a frame";
  throw base::Error({.file = runs.front().root().string(),
                     .hint = "polypic render --preview draws them",
                     .message = "not all of the runs have a picture of " + which});
}

Panels panels_of_pictures(const std::vector<std::string>& files) {
  Panels panels;
  for (const std::string& file : files) {
    panels.pictures.push_back(render::read_image(file));
    if (panels.pictures.back().channels.size() < 3) base::throw_input(file, "has no red, green and blue");
    panels.labels.push_back(fs::path(file).filename().string());
  }
  return panels;
}

/// Also pictures of other frames of the runs: the ledger knows what they hold.
void refuse_to_write_over_what_is_shown(const fs::path& out, const std::vector<std::string>& pictures, const std::vector<Folder>& runs) {
  std::vector<fs::path> kept(pictures.begin(), pictures.end());
  for (const Folder& run : runs)
    for (const Stage stage : {Stage::preview, Stage::render})
      for (const std::int64_t frame : run.recorded_frames(stage))
        for (const fs::path& file : run.outputs(stage, frame)) kept.push_back(file);
  refuse_to_write_over(kept, "--out", out, runs.empty() ? "is one of the pictures that are shown" : "is a picture of a run that is shown");
}

void require_one_size(const std::vector<std::string>& subjects, const std::vector<render::Image>& pictures) {
  const auto text = [](const render::Image& picture) { return std::to_string(picture.width) + "x" + std::to_string(picture.height); };
  for (std::size_t i = 1; i < pictures.size(); ++i)
    if (text(pictures[i]) != text(pictures[0]))
      base::throw_input(subjects[i], "has " + text(pictures[i]) + " pixels, but " + subjects[0] + " has " + text(pictures[0]));
}

}  // namespace

void sheet(const Request& request) {
  const fs::path out = request.out.value_or("sheet.png");
  if (out.extension() != ".png") throw base::Error({.file = "--out " + out.string(), .message = "a sheet is a .png file"});
  std::vector<Folder> runs;
  for (const std::string& subject : request.subjects) {
    std::error_code failure;
    const fs::file_status there = fs::status(subject, failure);
    if (!fs::exists(there)) base::throw_input(subject, there.type() == fs::file_type::not_found ? "no such run or picture" : failure.message());
    if (fs::is_directory(there)) runs.emplace_back(subject);
  }
  if (!runs.empty() && runs.size() != request.subjects.size())
    throw base::Error({.message = "a sheet is of runs or of pictures, not of both"});
  if (runs.empty() && request.frames) throw base::Error({.file = "--frames", .message = "has no effect with pictures: they are of one frame each"});
  std::error_code none;
  for (const Folder& run : runs)
    if (!fs::exists(run.shot(), none)) base::throw_input(run.root().string(), "not the directory of a run");
  refuse_to_write_over_what_is_shown(out, request.subjects, runs);
  const Panels panels = runs.empty() ? panels_of_pictures(request.subjects) : panels_of_runs(runs, request.frames);
  require_one_size(request.subjects, panels.pictures);
  base::Ledger ledger;
  const render::Image image = render::sheet(panels.pictures, panels.labels);
  render::write_png(out, image, {}, /*display_referred=*/true, ledger);
  if (!request.json) return;
  const nlohmann::ordered_json told = {{"file", out.string()}, {"width", image.width}, {"height", image.height}, {"labels", panels.labels}};
  std::fputs(document_text(told).c_str(), stdout);
}

}  // namespace app
