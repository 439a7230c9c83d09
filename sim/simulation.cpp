#include "sim/simulation.h"

#include <cassert>

#include "sim/empty_body.h"
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
  assert((!scene.bodies.empty() || !scene.sources.empty()) && "a shot has material");
  if (const std::optional<EmptyBody> empty = find_empty_body(scene)) throw base::Error(empty->complaint);
  for (const Collider& collider : scene.colliders)
    if (collider.shape.mesh) collider.shape.mesh->distances->prepare();
  return scene.options.is_solid() ? make_solid(scene, fps) : make_liquid(scene, fps);
}

}  // namespace sim
