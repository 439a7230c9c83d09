#pragma once
// What a program runs on.
#include <string>

namespace app {

/// As its maker calls it: "AMD EPYC 9R14"; empty where the system does not say.
std::string processor_name();

}  // namespace app
