#pragma once
// Cells on which a study tries a shot.
#include <string>
#include <vector>

#include "app/shot/shot.h"

namespace app {

struct Coarser {
  std::vector<std::vector<std::string>> sets;   // of each size: "sim.cell=..." first, then what else must grow with it
  std::string told;                             // which they are, and which were left out and why
};

/// About four times and twice the shot's own, of those that part its domain and leave every body a particle. Throws base::Error (exit 2) where there
/// is none.
Coarser coarser_cells(const Shot&);

}  // namespace app
