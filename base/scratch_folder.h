#pragma once
// A folder for what nobody keeps.
#include <stdlib.h>

#include <filesystem>
#include <string>

namespace base {

/// A new folder in the system's place for temporary files, removed with all its content at the end. Its path is empty when none can be made.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code none;
    std::string pattern = (std::filesystem::temp_directory_path(none) / "polypic_XXXXXX").string();   // mkdtemp fills the X
    if (!none && ::mkdtemp(pattern.data())) path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code none;
    if (!path_.empty()) std::filesystem::remove_all(path_, none);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace base
