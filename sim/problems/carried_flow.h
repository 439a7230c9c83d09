#pragma once
// Flows without friction that are steady in the frame of a mean flow that carries them, in periodic boxes:
//
// Taylor-Green vortices  u = s sin kx cos ky, v = -s cos kx sin ky, in three dimensions the same in every layer: two-dimensional vortices, computed
//                        with the modes, stencils and solver of three
// ABC flow               u = s (sin kz + cos ky), v = s (sin kx + cos kz), w = s (sin ky + cos kx), whose vorticity is k times the velocity and whose
//                        paths are chaotic [Dombre86]
//
// with k waves along each edge and s = edge / (2 pi) per second, so that times are those of an edge of 2 pi and speed 1 whatever the edge.
#include "sim/problems/known_flow.h"

namespace sim {

/// Greatest speed of the vortices [m/s] in a domain of edge `edge` [m].
inline double taylor_green_speed(double edge) { return edge / (2 * M_PI); }
/// Likewise, of the ABC flow.
inline double abc_speed(double edge) { return std::sqrt(6.0) * edge / (2 * M_PI); }

/// `mean` [m/s] carries them along.
template <int D>
VelocityAt<D> taylor_green_velocity(int waves, double edge, const base::Vec3& mean);
VelocityAt<3> abc_velocity(int waves, double edge, const base::Vec3& mean);

}  // namespace sim
