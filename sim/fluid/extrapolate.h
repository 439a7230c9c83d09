#pragma once
// Velocity outward from where it is known, so that particles near the surface find a field to move in.
#include <cstdint>

#include "sim/fluid/surface_distance.h"

namespace sim {

/// Which faces hold a velocity, indexed by ActiveBlocks: 1 valid, 0 not.
template <int D>
struct FaceMask : std::array<std::vector<std::uint8_t>, std::size_t(D)> {};

/// Fills faces that are not valid, layer after layer, each with the mean of its axis neighbours in earlier layers. `layers` cells deep;
/// faces beyond get 0. On periodic axes what lies across a side counts.
template <int D, class Real>
void extrapolate(FaceField<D, Real>&, const FaceMask<D>& valid, const ActiveBlocks<D>&, int layers);

/// After `extrapolate`: in an air cell beside liquid the faces to air that is not get what is missing for its outflow to be 0, as far as none becomes
/// faster than the cell's fastest: particles would hop off water at rest. Particles on top of the liquid would else come together where it gathers,
/// and stay dense when the liquid takes them in. Not in pits, with liquid on more than half of their sides: all that flows into one would leave as a jet.
template <int D, class Real>
void carry_on_outflow(FaceField<D, Real>&, const FaceMask<D>& valid, const LiquidCells<D>&, const ActiveBlocks<D>&);

}  // namespace sim
