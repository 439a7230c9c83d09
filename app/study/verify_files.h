#pragma once
// Hard cases about what surrounds a simulation: shots and meshes that hold nonsense, threads, restarts, files.
#include <vector>

#include "sim/verify.h"

namespace app {

std::vector<sim::VerifyCase> file_cases();

}  // namespace app
