#pragma once
// Geometry that other programs made: triangles of an OBJ, PLY or STL file.
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/vec.h"

namespace render::files {

struct Triangles {
  std::vector<base::Vec3f> position;                   // in the file's units
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Throws base::Error ("PATH: reason", exit 2) for a file that is no such mesh, is cut short, holds no triangle or a coordinate that
/// is not finite, and before anything is allocated for one that is too large or whose header counts more than it can hold. What is
/// not closed or not manifold is fine.
Triangles read_mesh(const std::filesystem::path&);

}  // namespace render::files
