#pragma once
// The pressure projection: the velocity nearest to a given one that neither diverges in liquid cells nor flows through solids
// [PolyPIC S5, with v* - (dt / rho) grad p]. p = 0 on the free surface, wherever it is between the middles of a liquid and an air cell
// [Gibou02]; colliders cut faces [Batty07]; closed faces have the solid's velocity.
#include <cstdint>
#include <vector>

#include "sim/fluid/extrapolate.h"
#include "sim/fluid/multigrid.h"
#include "sim/fluid/surface_distance.h"
#include "sim/transfer/mac_transfer.h"

namespace sim {

struct PressureReport {
  std::int64_t unknowns = 0;
  std::int64_t iterations = 0;       // of conjugate gradients; 0 when solved directly
  double residual = 0;               // [1] relative, Euclidean norm
  double max_divergence = 0;         // [cells m/s / cell] largest net outflow of a liquid cell, as a velocity [m/s]
  std::int64_t bytes = 0;            // read and written: of the system and its vectors, and by every iteration
  std::int64_t closed_pockets = 0;   // components of liquid that touch no air
  double imbalance = 0;              // [m/s] largest mean net inflow into a cell of a pocket, which no pressure can balance
  bool fell_back = false;            // to incomplete Cholesky
  double solid_work = 0;             // [m^2/s^2 cells] that moving solids do on the liquid: times density and a cell's volume [J]
};

template <int D>
class Projection {
 public:
  /// Projects in place and says in `valid` which faces have a liquid neighbour. In a pocket without air pressure is defined up to a
  /// constant. Throws base::Error (unstable) when the residual does not fall below `tolerance`, by
  /// the fallback's sums at most twice that by others.
  template <class Real>
  PressureReport project(FaceField<D, Real>& velocity, const LiquidCells<D>&, const ActiveBlocks<D>&, double tolerance, FaceMask<D>& valid);
  /// The smallest displacement of faces [cells] whose outflow from every liquid cell is `source` [1], by index; in pockets, less its mean.
  template <class Real>
  PressureReport displace(FaceField<D, Real>& displacement, const std::vector<float>& source, const LiquidCells<D>&, const ActiveBlocks<D>&, double tolerance,
                          FaceMask<D>& valid);
  /// Of every cell at the last call of either, times dt / (rho h) [m/s]; 0 where there is no liquid.
  const std::vector<double>& pressure() const { return pressure_; }

 private:
  template <class Real>
  PressureReport solve(FaceField<D, Real>&, const std::vector<float>* source, const LiquidCells<D>&, const ActiveBlocks<D>&, double tolerance, FaceMask<D>&);

  PoissonSolver<D> solver_;
  std::vector<double> pressure_;     // p dt / (rho h) [m/s]: neither density nor time step matters
};

/// Makes a projected field, or displacement, what particles see of faces that colliders cover: the open part has the face's velocity, the covered part
/// that of the liquid around it, which slips along the collider; where it leaves one beside air, that turns nothing and makes nothing faster. The flow
/// through a sliver may be many times as fast as all around it, and what it moves would weigh as much as if all of the face were open: pressure would
/// give more than it takes. And a closed face that moved with a collider, or stood still with it, would drag. Colliders rest where nothing `moves`.
template <int D, class Real>
void see_covered_parts(FaceField<D, Real>&, bool moves, const LiquidCells<D>&, const ActiveBlocks<D>&, const FaceMask<D>& valid);

/// What the liquid fills [cells]: its cells, less or more where the surface is nearer or farther than the face to the air. Where there are
/// several such faces each counts by the square of the distance's slope across it. Parts of cells that colliders cover do not count,
/// and thin liquid and what lies in air cells away from deep liquid by its particles.
struct LiquidVolume {
  double all = 0;
  double bulk = 0, bulk_filling = 0;   // of the cells that are deep in the liquid or beside such a cell, without drops, sheets and cells that a collider cuts; and what was seeded of it
};
template <int D>
LiquidVolume liquid_volume(const LiquidCells<D>&, const std::vector<float>& filling, const ActiveBlocks<D>&);

}  // namespace sim
