#pragma once
// Triangles of OBJ, PLY and STL files, for whoever else needs them.
#include "render/files/mesh.h"

namespace render {
using files::read_mesh;
using files::Triangles;
}  // namespace render
