#pragma once
// Images -> H.264 film, through ffmpeg.
#include <filesystem>
#include <vector>

namespace app {

/// One film frame per image in the order given, at `fps`; odd sizes are padded to even ones. Atomic. Throws base::Error (exit 5)
/// with ffmpeg's own last line.
void write_movie(const std::filesystem::path& movie, const std::vector<std::filesystem::path>& images, double fps, int threads);

}  // namespace app
