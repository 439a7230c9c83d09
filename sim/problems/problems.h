#pragma once
// What the table of problems (sim/problem.cpp) makes.
#include <memory>
#include <string>

#include "sim/problem.h"

namespace sim {

std::unique_ptr<Problem> make_taylor_green_2d();
std::unique_ptr<Problem> make_taylor_green_3d();
std::unique_ptr<Problem> make_abc_flow();
std::unique_ptr<Problem> make_rigid_rotation_2d();
std::unique_ptr<Problem> make_rigid_rotation_3d();
std::unique_ptr<Problem> make_vortex_ring();
std::unique_ptr<Problem> make_hydrostatic_2d();
std::unique_ptr<Problem> make_hydrostatic_3d();
std::unique_ptr<Problem> make_spinning_disk_2d();
std::unique_ptr<Problem> make_spinning_sphere_3d();
std::unique_ptr<Problem> make_released_square();
std::unique_ptr<Problem> make_bar_wave();
std::unique_ptr<Problem> make_slope_block();

/// What most problems ask of a scene: its solver and dimension, and nothing in the way. "KEY: must be ..."; empty when it is so.
std::string plain_objection(const Scene&, bool is_solid, std::int64_t dimension);

/// The text of a square full of liquid, or of a slab, an eighth of its edge deep unless said, without sides; and what keeps a scene from being one.
std::string periodic_box(int dimension, const std::string& cell, const std::string& depth = "0.125");
std::string periodic_objection(const Scene&, std::int64_t dimension);

}  // namespace sim
