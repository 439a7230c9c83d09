#pragma once
// Scenes that nobody designed: bodies of random materials in random motion between random walls. The same for the same number.
#include "sim/scene.h"

namespace sim::verify {

Scene random_scene(int number);

}  // namespace sim::verify
