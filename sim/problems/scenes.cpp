// What scenes of several problems have in common.
#include "sim/problems/problems.h"

namespace sim {

std::string periodic_box(int dimension, const std::string& cell, const std::string& depth) {
  if (dimension == 3)
    return "[sim]\ndomain = [[0, 0, 0], [1, 1, " + depth + "]]\ncell = " + cell + R"(
cfl = 0.5
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic", z_lower = "periodic", z_upper = "periodic" }
[[body]]
name = "all"
shape = { box = [[0, 0, 0], [1, 1, )" + depth + R"(]] }
)";
  return "[sim]\ndimension = 2\ndomain = [[0, 0], [1, 1]]\ncell = " + cell + R"(
particles_per_cell = 4
precision = "double"
cfl = 0.5
pressure_tolerance = 1e-8
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic" }
[[body]]
name = "all"
shape = { box = [[0, 0], [1, 1]] }
)";
}

std::string plain_objection(const Scene& scene, bool is_solid, std::int64_t dimension) {
  if (scene.options.is_solid() != is_solid) return is_solid ? "sim.solver: must be \"solid\" here" : "sim.solver: must be \"fluid\" here";
  if (scene.options.dimension != dimension) return "sim.dimension: must be " + std::to_string(dimension) + " here";
  if (scene.bodies.size() != 1) return "body: must be one here";
  if (!scene.colliders.empty()) return "collider: there is none here";
  return "";
}

std::string periodic_objection(const Scene& scene, std::int64_t dimension) {
  if (std::string plain = plain_objection(scene, false, dimension); !plain.empty()) return plain;
  for (int a = 0; a < dimension; ++a)
    if (!scene.options.periodic(a)) return "sim.boundary: every side must be \"periodic\" here";
  if (!scene.effects.empty()) return "effect: there is none here";
  const base::Vec3 size = scene.options.domain.size();
  return size.x() == size.y() ? "" : "sim.domain: must be as high as wide here";
}

}  // namespace sim
