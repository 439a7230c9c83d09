#pragma once
// The pressure projection: the velocity nearest to a given one that neither diverges in liquid cells nor flows through solids
// [PolyPIC S5, with v* - (dt / rho) grad p]. p = 0 in air, faces of solids have the solid's velocity.
#include <cstdint>

#include "sim/fluid/cells.h"
#include "sim/fluid/extrapolate.h"
#include "sim/transfer/mac_transfer.h"

namespace sim {

struct PressureReport {
  std::int64_t unknowns = 0;
  std::int64_t iterations = 0;       // of conjugate gradients; 0 when solved directly
  double residual = 0;               // [1] relative, Euclidean norm
  double max_divergence = 0;         // [cells m/s / cell] largest net outflow of a liquid cell, as a velocity [m/s]
  std::int64_t closed_pockets = 0;   // components of liquid that touch no air
};

/// Projects in place and says in `valid` which faces have a liquid neighbour or lie on a solid next to one. Systems of at most
/// kDirectUnknowns are factorised with CHOLMOD, larger ones solved by conjugate gradients with a modified incomplete Cholesky
/// preconditioner. In a pocket without air pressure is defined up to a constant: the imbalance of its right-hand side is removed.
/// Throws base::Error (unstable) when the residual does not fall below `tolerance`.
template <int D, class Real>
PressureReport project(FaceField<D, Real>& velocity, const std::vector<CellKind>&, const ActiveBlocks<D>&, double tolerance, FaceMask<D>& valid);

inline constexpr std::int64_t kDirectUnknowns = 1500;

}  // namespace sim
