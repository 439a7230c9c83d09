#pragma once
// What previews colour particles and surfaces by: a quantity of the motion, from the particles' velocities.
#include <string>
#include <string_view>
#include <vector>

#include "render/render.h"

namespace render::attribute {

inline constexpr std::string_view kNames[] = {"speed", "velocity_x", "velocity_y", "velocity_z", "vorticity", "pressure", "strain", "mode_energy",
                                              "material"},
                                  kFlatNames[] = {"speed", "velocity_x", "velocity_y", "vorticity", "pressure", "strain", "mode_energy", "material"};

/// Whether it comes from what particles carry (pressure, strain, mode_energy as sim.write asks, material), and no surface has it.
bool only_particles_have(std::string_view color);

/// How values become colours.
struct Scale {
  bool is_signed = false;  // from -top to top, else from 0
  double top = 1;          // in `unit`
  std::string unit;
  std::vector<std::string> names = {};   // of values 0, 1, 2 ..., each with a colour of its own; empty: values are measured
  /// From -1 or 0 to 1; what is beyond is the bound.
  float place(float value) const;
  base::Vec3f color(float value) const;
};
/// `top_speed` [m/s] is one that the shot hardly passes; vorticity's bound is that over a twentieth of the domain's longest side, as 1, 2 or
/// 5 times a power of ten. [preview] range stands in place of either.
Scale scale_of(const Setting&, double top_speed);

/// Of each particle, in `unit` of its scale. Throws base::Error (exit 2) when the particles do not carry what is asked. Vorticity is the curl
/// (in two dimensions about z, else its length) of the linear fields that fit the particles' velocities best around the nodes of a grid of
/// twice their spacing; 0 outside the domain.
std::vector<float> values(const Setting&, const sim::Frame&);
/// At the vertices of the surface made from these particles.
std::vector<float> values(const Setting&, const sim::Frame&, const surface::Mesh&);

}  // namespace render::attribute
