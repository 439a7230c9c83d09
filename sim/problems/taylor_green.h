#pragma once
// Taylor-Green vortices in a periodic square or box, inviscid: u = s sin kx cos ky, v = -s cos kx sin ky, with k waves along each edge and
// s = edge / (2 pi) per second, so that times are those of a square of edge 2 pi and speed 1 whatever the edge. Steady, in the frame of the flow
// that carries them.
// In three dimensions the same flow in every layer: two-dimensional vortices, computed with the modes, stencils and solver of three.
#include "sim/problems/known_flow.h"

namespace sim {

/// Greatest speed of the vortices [m/s] in a domain of edge `edge` [m].
inline double taylor_green_speed(double edge) { return edge / (2 * M_PI); }

/// `mean` [m/s] carries them along.
template <int D>
VelocityAt<D> taylor_green_velocity(int waves, double edge, const base::Vec3& mean);

}  // namespace sim
