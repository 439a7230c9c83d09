#pragma once
// Hashes that say which shot a file was made from. Written as 16 lowercase hexadecimal digits.
#include <cstdint>
#include <string>
#include <string_view>

#include "app/shot/shot.h"
#include "app/stages/folder.h"

namespace app {

/// FNV-1a, 64 bit.
std::uint64_t fnv1a(std::string_view bytes);
std::string hex16(std::uint64_t);

/// Of the keys that each stage reads (and the contents of the files they name, of which there are none yet), chained: a change
/// upstream changes all below it. The program's version is no part of them: records name it, and who goes on compares it.
struct StageHashes {
  std::string simulate, surface, render, preview;   // no surface in two dimensions
  const std::string& of(Stage stage) const {
    return stage == Stage::simulate ? simulate : stage == Stage::surface ? surface : stage == Stage::render ? render : preview;
  }
};
StageHashes stage_hashes(const Shot&);

}  // namespace app
