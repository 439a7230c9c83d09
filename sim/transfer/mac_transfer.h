#pragma once
// Particles <-> the velocity faces of a MAC grid. Each velocity component lives on a lattice of its own: uncentred on its own axis,
// centred on the others. Masses are in units of a particle's mass.
#include <array>
#include <vector>

#include "sim/scene.h"
#include "sim/transfer/modes.h"
#include "sim/transfer/order.h"
#include "sim/transfer/tensor.h"

namespace sim {

/// One number per face, an array for each axis, indexed by Lattice.
template <int D, class Real>
struct FaceField : std::array<std::vector<Real>, std::size_t(D)> {};

template <int D, class Real>
struct MacVelocity {
  FaceField<D, Real> velocity;   // [m/s]
  FaceField<D, Real> mass;       // [particles]; a face lighter than kLightestNode is invalid and has velocity 0
};

/// Below this mass, in units of a particle's, a node's velocity is not defined.
inline constexpr double kLightestNode = 1e-28;

/// How an updated grid velocity becomes the particles': FLIP keeps `keep` of what a particle had and adds the change.
struct GatherRule {
  bool flip = false;
  double keep = 0;   // [1] exp(-dt / flip_time)
};

/// Where particles stood when they gathered; kept only for a carry that limits.
template <int D, class Real>
struct Departure {
  std::vector<Cell<D>> cell;
  std::vector<Vec<D, Real>> offset;
};

/// The transfer of one scheme: mode set and kernel. Stateless between calls.
template <int D, class Real>
class MacTransfer {
 public:
  MacTransfer(const Lattice<D>& lattice, Kernel kernel, std::vector<ModeIndex<D>> modes);

  /// P2G: face masses and velocities from particles in canonical order. Scatters block by block in 2^D colours: sums keep one order.
  void scatter(const Particles<D, Real>&, const CellRanges&, MacVelocity<D, Real>&) const;
  /// G2P: coefficients from face velocities at the particles' places. `before` is the field after P2G, read by FLIP only.
  void gather(const FaceField<D, Real>& velocity, const FaceField<D, Real>* before, const GatherRule&, Particles<D, Real>&) const;
  /// After motion, push-out and corrections: scales coefficients so that no mode's energy grew on the way from `from` (Carry::limited),
  /// or only where a node of the stencil at `from` was light in `mass` (Carry::hybrid). Returns how many coefficients it scaled.
  std::int64_t limit(const Departure<D, Real>& from, const FaceField<D, Real>& mass, Carry, Particles<D, Real>&) const;
  /// The grid velocity [m/s] at a site inside the domain, interpolated with the kernel.
  Vec<D, Real> velocity_at(const FaceField<D, Real>& velocity, const Site<D, Real>&) const;
  /// Kinetic energy [J], linear momentum [kg m/s] and angular momentum [kg m^2/s] about the domain's lower corner: the polynomial's, all
  /// modes counted. h is the cell size [m].
  struct Sums {
    double kinetic_energy = 0;
    base::Vec3 linear_momentum = base::Vec3::Zero(), angular_momentum = base::Vec3::Zero();
  };
  Sums sums(const Particles<D, Real>&, double h) const;
  /// The same momenta of the grid, over valid faces.
  Sums sums(const MacVelocity<D, Real>&, double particle_mass, double h) const;

  const std::vector<ModeIndex<D>>& modes() const { return modes_; }

 private:
  Lattice<D> lattice_;
  Kernel kernel_;
  std::vector<ModeIndex<D>> modes_;
  std::vector<int> place_;   // of each mode in the stencil's tensor
};

}  // namespace sim
