#pragma once
// From particles to a smooth signed distance, pass by pass. Each pass is a function of its arguments alone and gathers, so the
// result has the same bits for any number of threads. Distances in voxels.
#include "surface/field/blocks.h"
#include "surface/field/cloud.h"

namespace surface::field {

/// How much company each particle has, from the density of particles around it: 0 on its own, 1 at the surface of a body.
std::vector<float> company(const Cloud&, const Blocks&, const Scale&);

/// Averaged spheres [ZhuBridson05]: |x - mean of the particles near x| - radius, weights (1 - s^2)^3. Not inside further than
/// `scale.gap` from every particle, so that water on two sides does not fill the air between; and a particle on its own keeps
/// its drop, whatever passes by.
/// `limit` is how far smoothing may move the surface there: drops and sheets less than bodies, or it would swallow them.
struct Spheres {
  Field surface, limit;
};
Spheres rasterize(const Cloud&, const std::vector<float>& company, const Blocks&, const Scale&);

/// The same zero set as a distance up to kFar: axis crossings beside the surface, the eikonal equation away from it.
Field distance_from_crossings(const Blocks&, const Field&);

/// Distance again after smoothing: phi / |grad phi| where phi is smooth, the eikonal equation further out. Keeps normals smooth.
Field distance_from_slope(const Blocks&, const Field&);

/// P = S^passes of the binomial filter S, applied as 2 P - P^2, whose response is 1 to fourth order: bumps go, volume and
/// curvature stay. The averaged spheres have lost 0.075 search^2 of the curvature (measured on balls); more of P - P^2 gives it
/// back. No value moves by more than `limit`.
Field smooth(const Blocks&, const Field&, int passes, float search, const Field& limit);

/// Another body, as a liquid finds it.
struct Neighbour {
  const Blocks* blocks;
  const Field* distance;
  bool is_liquid;
};
/// The least of the distances of some bodies at the voxels of `blocks`, plus `further`.
Field nearest_of(const Blocks& blocks, const std::vector<Neighbour>&, float further);

constexpr float kWetReach = kFar - 1;   // [voxels] that a liquid's surface may go out from where it was, to other bodies
/// A liquid's surface that goes on to what stands in it and into it, so that no film of air parts them: a simulation keeps bodies up to a cell and
/// three quarters from each other. Near the others all of them, walls and colliders are closed by a ball of about half that size [Serra82], which leaves a fillet where
/// they meet; elsewhere no bit changes. Two liquids meet half way. In finer voxels gaps of up to kWetReach are closed, between solid and liquid up to a voxel less.
/// What lies outside of the blocks counts as air: near their ends, kFar and a bit from particles, gaps may stay open.
Field wet(const Blocks&, const Field& distance, const std::vector<Neighbour>&, const Room&, const Lattice&);

/// x, y and z of the velocity [m/s] where |distance| < band: the mean over particles within `scale.search`, continued outwards to `scale.furthest` and the band.
std::array<Field, 3> velocity(const Cloud&, const Blocks&, const Field& distance, float band, const Scale&);

/// Cuts to the domain: the larger of the distance and the box's own, whose floor is `below` the domain's [voxels]. Where a solid's face is in a side, or its
/// back, the two would share a plane: there the cut lies half a voxel inside the solid. So it does in bodies that cover this one, whose distances `others` are; and less, up to a voxel beside them.
void cut(const Blocks&, const Room&, const Lattice&, float below, const Field* others, Field& distance);

}  // namespace surface::field
