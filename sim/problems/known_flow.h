#pragma once
// A flow without a surface whose field is known at all times, moved by the program's own step (sim/fluid/step.h) at a fixed pace: what problems
// about fluids have in common.
//
// A step moves the particles in the last projected field (with reflection in that of the motion's middle, FluidStep::move), then scatters, projects,
// gathers. With reflection it is two of half its length; after the first the particles get the field mirrored at the projected one, while the
// projected one moves them [Zehnder18].
#include <functional>

#include "sim/fluid/step.h"
#include "sim/problem.h"
#include "sim/transfer/dimension.h"

namespace sim {

/// [m/s] at a place [m] and a time [s].
template <int D>
using VelocityAt = std::function<Vec<D, double>(const Vec<D, double>& at, double time)>;

/// The field on the faces of `blocks`, each face at its middle; 0 outside of the domain.
template <int D, class Real>
FaceField<D, Real> field_on_faces(const ActiveBlocks<D>& blocks, const Options&, const VelocityAt<D>&, double time);

template <int D, class Real>
class KnownFlow {
 public:
  /// Particles start with what one G2P of the field at t = 0 gives them; `scene` must fill its domain. `flip_speed` [m/s] sets FLIP's time constant
  /// where the scene does not.
  KnownFlow(const Scene& scene, VelocityAt<D> exact, double flip_speed);
  /// Takes out of the field what the walls do not let through: where `exact` does not know of them.
  void fit_to_walls();
  /// Costs go to `ledger`.
  void step(double dt, base::Ledger& ledger);

  double time() const { return time_; }
  void audit_in_frame(const base::Vec3& moving) { step_.audit_in_frame(moving, particles_); }
  const FluidStep<D, Real>& grid() const { return step_; }
  const Particles<D, Real>& particles() const { return particles_; }
  /// Of the particles, by id [m].
  std::vector<Vec<D, double>> places() const;

  /// Sums of squares over the faces of the domain: of the velocity less `mean` [m^2/s^2], and of what it differs from the exact one now.
  double squares(const Vec<D, double>& mean) const;
  /// Of the particles' polynomials, without the motion of all by `mean` [J].
  double kinetic_energy(const Vec<D, double>& mean) const;
  double squares_of_error() const;
  /// The same of the vorticity, where four faces surround an edge of the cells [1/s^2].
  double vorticity_squares() const;
  double vorticity_squares_of_error() const;

 private:
  void part(double length, bool mirror, base::Ledger&);

  Options options_;
  Lattice<D> lattice_;
  Solids<D> solids_;
  VelocityAt<D> exact_;
  double flip_time_;                  // [s]
  FluidStep<D, Real> step_;
  Particles<D, Real> particles_;
  double time_ = 0;
};

/// Energy and enstrophy of a flow over the time, and its errors at the end against the exact field.
struct FlowQuestion {
  double time = 1;                    // [s] the first step that ends at or after it is the last
  double dt = 1;                      // [s]
  base::Vec3 mean = base::Vec3::Zero();   // [m/s] not counted in energies
};
template <int D, class Real>
ProblemResult answer(KnownFlow<D, Real>&, const FlowQuestion&, base::Ledger&);

}  // namespace sim
