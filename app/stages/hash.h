#pragma once
// Hashes that say which shot a file was made from. Written as 16 lowercase hexadecimal digits.
#include <cstdint>
#include <string>
#include <string_view>

#include "app/shot/shot.h"

namespace app {

/// FNV-1a, 64 bit.
std::uint64_t fnv1a(std::string_view bytes);
std::string hex16(std::uint64_t);

/// Of the keys that each stage reads, chained: a change upstream changes all below it.
struct StageHashes {
  std::string simulate, surface, render;
};
StageHashes stage_hashes(const Shot&);

}  // namespace app
