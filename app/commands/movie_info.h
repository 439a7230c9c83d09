#pragma once
// What ffprobe says of a movie.
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace app {

/// {codec, width, height, fps, frames}. Throws base::Error ("PATH: reason", exit 2), also where ffprobe is not installed.
nlohmann::ordered_json movie_info(const std::filesystem::path&);

}  // namespace app
