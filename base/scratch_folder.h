#pragma once
// A folder for what nobody keeps.
#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>

#include "base/error.h"

namespace base {

/// A new folder in the place for temporary files, TMPDIR or /tmp, removed with all its content at the end.
/// Throws base::Error, exit 5, when none can be made.
class ScratchFolder {
 public:
  ScratchFolder() {
    const char* const named = ::getenv("TMPDIR");
    const std::filesystem::path place = named && *named ? named : "/tmp";
    std::string pattern = (place / "polypic_XXXXXX").string();   // mkdtemp fills the X
    if (!::mkdtemp(pattern.data()))
      throw Error({.code = Exit::io, .file = place.string(), .hint = "TMPDIR names another place",
                   .message = std::string("no temporary folder can be made here: ") + std::strerror(errno)});
    path_ = pattern;
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
