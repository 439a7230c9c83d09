#include "app/stages/movie.h"

#include <string>

#include "app/stages/program.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;

/// The images one after another into a pipe. Returns what is wrong with one that cannot be read, or nothing; that nobody reads the
/// pipe any more is the reader's to explain.
std::string feed_images(int pipe, const std::vector<fs::path>& images) try {
  for (const fs::path& image : images)
    if (!write_all(pipe, base::read_file(image))) break;
  return {};
} catch (const base::Error& e) {
  return e.what();
}

void run_encoder(std::vector<std::string> words, const std::vector<fs::path>& images, const fs::path& made) {
  const std::string name = words[0];
  std::string unreadable;
  const ProgramEnd end = run_program(std::move(words), made.string(), [&](int pipe) { unreadable = feed_images(pipe, images); });
  if (!unreadable.empty()) base::throw_io(made.string(), unreadable);
  if (!end.started)
    throw base::Error({.code = base::Exit::package, .file = made.string(),
                       .message = "not made, the images are complete: " + name + " cannot be started: " + end.said});
  if (!end.well) base::throw_io(made.string(), name + ": " + (end.said.empty() ? "failed" : end.said) + " (the images are complete)");
}

}  // namespace

void write_movie(const fs::path& movie, const std::vector<fs::path>& images, double fps, int threads) {
  base::write_atomically(movie, [&](const fs::path& temporary) {
    // -xerror: without it a movie that the disk had no room for is a success
    run_encoder({"ffmpeg", "-nostdin", "-loglevel", "error", "-xerror", "-y", "-threads", std::to_string(threads), "-framerate", base::to_text(fps),
                 "-f", "image2pipe", "-c:v", "png", "-i", "pipe:0", "-vf",
                 "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p",
                 "-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709", "-color_range", "tv", "-movflags", "+faststart",
                 "-threads", std::to_string(threads), "file:" + temporary.string()},   // a name may have a colon, or begin with -
                images, movie);
  });
}

}  // namespace app
