#include "sim/simulation.h"

#include "sim/fluid/liquid.h"
#include "sim/solid/solid.h"

namespace sim {

bool Simulation::advance(base::Ledger& ledger, const std::function<bool()>& interrupted) {
  for (double left = begin_frame(); left > 0;) {
    if (interrupted && interrupted()) return false;
    left = advance_step(left, ledger);
  }
  end_frame(ledger);
  return true;
}

std::unique_ptr<Simulation> make_simulation(const Scene& scene, double fps) {
  return scene.options.is_solid() ? make_solid(scene, fps) : make_liquid(scene, fps);
}

}  // namespace sim
