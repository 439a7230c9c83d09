#pragma once
// Images -> H.264 film, through ffmpeg.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "app/stages/folder.h"

namespace app {

/// The movie of these finished frames of a stage, unless the one that is there was made from the same bytes and is whole:
/// ledger/movie.json says. Throws base::Error (exit 5; 69 where there is no ffmpeg).
void make_movie(const Folder&, Stage, const std::vector<std::int64_t>& frames, double fps, int threads);

/// One film frame per image in the order given, at `fps`, through a pipe; odd sizes are padded to even ones. Atomic. Throws base::Error (exit 5)
/// with ffmpeg's own last line, or where it is not installed (exit 69).
void write_movie(const std::filesystem::path& movie, const std::vector<std::filesystem::path>& images, double fps, int threads);

}  // namespace app
