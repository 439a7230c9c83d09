#include "sim/simulation.h"

#include "sim/fluid/liquid.h"

namespace sim {

std::unique_ptr<Simulation> make_simulation(const Scene& scene, double fps) { return make_liquid(scene, fps); }

}  // namespace sim
