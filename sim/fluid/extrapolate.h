#pragma once
// Velocity outward from where it is known, so that particles near the surface find a field to move in.
#include <cstdint>

#include "sim/transfer/mac_transfer.h"

namespace sim {

/// Which faces hold a velocity, indexed by ActiveBlocks: 1 valid, 0 not.
template <int D>
struct FaceMask : std::array<std::vector<std::uint8_t>, std::size_t(D)> {};

/// Fills faces that are not valid, layer after layer, each with the mean of its axis neighbours in earlier layers. `layers` cells deep;
/// faces beyond get 0. On periodic axes what lies across a side counts.
template <int D, class Real>
void extrapolate(FaceField<D, Real>&, const FaceMask<D>& valid, const ActiveBlocks<D>&, int layers);

}  // namespace sim
