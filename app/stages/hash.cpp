#include "app/stages/hash.h"

#include <cinttypes>
#include <cstdio>

namespace app {

std::uint64_t fnv1a(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : bytes) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
  return hash;
}

std::string hex16(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, value);
  return text;
}

StageHashes stage_hashes(const Shot& shot) {
  StageHashes hashes;
  hashes.simulate = hex16(fnv1a(stage_text(shot, "simulate")));
  const bool has_surface = shot.scene.options.dimension == 3;
  if (has_surface) hashes.surface = hex16(fnv1a(hashes.simulate + '\n' + stage_text(shot, "surface")));
  const std::string above = (has_surface ? hashes.surface : hashes.simulate) + '\n';
  hashes.render = hex16(fnv1a(above + stage_text(shot, "render")));
  hashes.preview = hex16(fnv1a(above + stage_text(shot, "preview")));
  return hashes;
}

}  // namespace app
