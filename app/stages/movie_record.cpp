// Whether a movie is that of the pictures that are there.
#include <nlohmann/json.hpp>

#include "app/stages/document.h"
#include "app/stages/movie.h"
#include "app/stages/record.h"
#include "base/atomic_file.h"
#include "base/error.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// What a movie is made from, by the records of its pictures.
Json ingredients(const Folder& folder, Stage stage, const std::vector<std::int64_t>& frames, double fps) {
  Json images = Json::array();
  for (const std::int64_t frame : frames)
    if (const auto record = read_record(folder, stage, frame); record && !record->files.empty()) images.push_back(file_json(record->files.back()));
  return {{"fps", fps}, {"images", images}};
}

bool is_current(const Folder& folder, Stage stage, const Json& from) {
  std::error_code none;
  if (!fs::exists(folder.movie_record(stage), none)) return false;
  try {
    const Json record = read_document(folder.movie_record(stage), kLargestDocument);
    const auto is = measure(folder, folder.movie(stage));
    return record.at("from") == from && is && record.at("file") == file_json(*is);
  } catch (const std::exception&) {   // damaged: the movie is made again
    return false;
  }
}

}  // namespace

void make_movie(const Folder& folder, Stage stage, const std::vector<std::int64_t>& frames, double fps, int threads) {
  if (frames.empty()) return;
  const Json from = ingredients(folder, stage, frames, fps);
  if (is_current(folder, stage, from)) return;
  std::vector<fs::path> images;
  for (const std::int64_t frame : frames) images.push_back(folder.outputs(stage, frame).back());
  const fs::path movie = folder.movie(stage);
  write_movie(movie, images, fps, threads);
  const Json record = {{"schema", 1}, {"file", file_json(measure_written(folder, movie))}, {"from", from}};
  base::write_text_atomically(folder.movie_record(stage), document_text(record));
}

}  // namespace app
