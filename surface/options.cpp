#include "surface/surface.h"

namespace surface {

void Options::params(base::Params& p) {
  p("voxel", voxel, "m", "edge of a voxel of the level set; in less than 0.43 cells air may be left between water_mpm and what stands in it", base::above(0), "half of sim.cell");
  p("radius", radius, "m", "distance of the surface from the outermost particles' mean position; more is thicker", base::above(0),
    "what puts the surface of a body at its true boundary, 0.98 of the particle spacing");
  p("smooth", smooth, "1", "smoothing passes; 8 halve waves of 8 voxels and keep longer ones, the reach grows with the root", base::within(0, 32));
  p("vel_name", vel_name, "name of the velocity grid [m/s] (Houdini and Arnold: vel or v; Blender: velocity)");
  p.require(!vel_name.empty() && vel_name != "surface" && !vel_name.starts_with("surface_"), "vel_name",
            "must be a name other than surface, and not begin with surface_");
}

}  // namespace surface
