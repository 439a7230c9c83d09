#pragma once
// An incompressible liquid with a free surface: particles carry velocity, a MAC grid makes it divergence-free.
#include <memory>

#include "sim/simulation.h"

namespace sim {

std::unique_ptr<Simulation> make_liquid(const Scene&, double fps);

}  // namespace sim
