#pragma once
// Elastic and plastic bodies in time: explicit steps whose length the speed of sound, the motion and the frame set.
#include <memory>

#include "sim/simulation.h"

namespace sim {

std::unique_ptr<Simulation> make_solid(const Scene&, double fps);

}  // namespace sim
