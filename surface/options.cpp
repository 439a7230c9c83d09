#include "surface/surface.h"

namespace surface {

void Options::params(base::Params& p) {
  p("voxel", voxel, "m", "edge of a voxel of the level set", base::above(0), "half of sim.cell");
  p("radius", radius, "m", "distance of the surface from the outermost particles' mean position; more is thicker", base::above(0),
    "what puts a full body's surface at its true boundary, near 0.74 of the particle spacing");
  p("smooth", smooth, "1", "smoothing passes; each takes out bumps up to about one voxel", base::within(0, 32));
  p("vel_name", vel_name, "name of the velocity grid [m/s] (Houdini and Arnold: vel or v; Blender: velocity)");
  p.require(!vel_name.empty() && vel_name != "surface", "vel_name", "must be a name other than surface");
}

}  // namespace surface
