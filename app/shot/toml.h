#pragma once
// TOML text -> tree.
#include <string>
#include <string_view>

#include "app/shot/tree.h"

namespace app {

/// The whole file. `file` is what errors call it. Throws base::Error (exit 2) with line and column on bad syntax.
Node parse_toml(std::string_view text, const std::string& file);

/// "sim.cell=0.02" of the command line as tables in tables: the value is TOML, or else a plain string.
Node parse_set(const std::string& set);

}  // namespace app
