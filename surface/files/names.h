#pragma once
// Names of the grids of a surface file.
#include <string>

namespace surface::files {

/// The level set around all that there is.
inline const std::string kSurface = "surface";

/// Of the grid that holds for one body what `name` holds for all. A body's name has letters, digits, _ and - only, so any program can read it.
inline std::string name_of_body(const std::string& name, const std::string& body) { return name + "_" + body; }

}  // namespace surface::files
