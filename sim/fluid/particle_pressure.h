#pragma once
// The pressure of the last projection where particles are.
#include <vector>

#include "sim/fluid/cells.h"
#include "sim/transfer/particles.h"

namespace sim {

/// `scale` times the values of cells [any], linear between the middles of cells: 0 in the air, and in a solid cell nobody is asked. Particles
/// may have moved since, within `blocks`; beyond is air.
template <int D, class Real>
std::vector<float> particle_pressure(const std::vector<double>& values, double scale, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks, const Particles<D, Real>&);

}  // namespace sim
