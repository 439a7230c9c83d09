#pragma once
// The passes of a shot as a picture: what each reads and writes, stage by stage.
#include <string>

#include "app/shot/shot.h"

namespace app {

/// An SVG document.
std::string pass_graph(const Shot&);

}  // namespace app
