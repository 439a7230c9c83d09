#include "sim/simulation.h"

#include "sim/fluid/liquid.h"
#include "sim/solid/solid.h"

namespace sim {

std::unique_ptr<Simulation> make_simulation(const Scene& scene, double fps) {
  return scene.options.is_solid() ? make_solid(scene, fps) : make_liquid(scene, fps);
}

}  // namespace sim
