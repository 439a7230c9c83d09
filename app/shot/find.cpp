#include "app/shot/find.h"

#include <algorithm>

#include "app/shot/shot.h"
#include "base/error.h"
#include "base/text.h"

namespace app {

namespace fs = std::filesystem;

fs::path shots_of(const fs::path& executable) {
  std::error_code none;
  const fs::path installed = executable.parent_path().parent_path() / "share/polypic/shots";
  if (fs::is_directory(installed, none)) return installed;
  for (fs::path folder = executable.parent_path(); folder.has_relative_path(); folder = folder.parent_path())
    if (fs::is_directory(folder / "shots", none) && fs::is_directory(folder / "sim", none)) return folder / "shots";
  return {};
}

std::vector<fs::path> shipped_shots() {
  std::error_code none;
  const fs::path folder = shots_of(fs::read_symlink("/proc/self/exe", none));
  std::vector<fs::path> shots;
  if (!folder.empty())
    for (const auto& entry : fs::directory_iterator(folder, none))
      if (entry.path().extension() == ".toml") shots.push_back(entry.path());
  std::sort(shots.begin(), shots.end());
  return shots;
}

fs::path find_shot(const std::string& shot) {
  std::error_code none;
  if (fs::is_regular_file(shot, none)) return shot;
  std::vector<std::string> names;
  for (const fs::path& shipped : shipped_shots()) {
    if (shipped.stem() == shot) return shipped;
    names.push_back(shipped.stem().string());
  }
  const fs::path beside = fs::path(shot).replace_extension(".toml");   // forgotten, or misspelt
  const std::string nearest = fs::is_regular_file(beside, none) ? beside.string() : base::nearest_word(shot, names);
  const bool is_path = shot.find('/') != std::string::npos || fs::path(shot).has_extension();
  if (fs::exists(shot, none)) base::throw_input(shot, fs::is_directory(shot, none) ? "is a directory" : "is not a file");
  throw base::Error({.file = shot, .hint = nearest.empty() ? "" : "did you mean " + nearest + "?",
                     .message = is_path ? "no such file" : "no such file, and no shipped shot of that name"});
}

}  // namespace app
