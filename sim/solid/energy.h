#pragma once
// Energies of the particles of a solid.
#include <variant>

#include "base/parallel.h"
#include "sim/solid/group.h"

namespace sim {

/// [J] of motion, of place (from the domain's floor) and of deformation.
struct SolidEnergy {
  double kinetic = 0, place = 0, elastic = 0;
  void add(const SolidEnergy& o) { kinetic += o.kinetic, place += o.place, elastic += o.elastic; }
};

/// A particle's deformation in double precision.
template <int D, class Real>
Deformation<double, D> exact(const Deformation<Real, D>& d) {
  Deformation<double, D> e;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) e.gradient(i, k) = double(d.gradient(i, k));
  e.state = double(d.state);
  return e;
}

/// [J] of one particle of the group in the state `d`.
template <int D, class Real>
double elastic_energy(const Group<D, Real>& group, const Deformation<double, D>& d) {
  return group.rest_volume * std::visit([&](const auto& law) { return law.template energy<D>(d); }, group.model);
}

/// `down` [m/s^2]: gravity along axes that have a floor; cell [m].
template <int D, class Real>
SolidEnergy energy_of(const Group<D, Real>& group, const base::Vec3& down, double cell) {
  const Particles<D, Real>& particles = group.particles;
  SolidEnergy energy = base::ordered_reduce(particles.size(), 16384, SolidEnergy{}, [&](std::size_t begin, std::size_t end) {
    SolidEnergy sum;
    for (std::size_t p = begin; p < end; ++p) {
      sum.elastic += elastic_energy(group, exact(group.deformation[particles.row_of(p)]));
      sum.place -= particles.mass * cell * down.head<D>().dot(particles.place(p));
    }
    return sum;
  }, [](SolidEnergy a, const SolidEnergy& b) { return a.add(b), a; });
  energy.kinetic = NodeTransfer<D, Real>(Kernel::quadratic, group.scheme.modes).sums(particles, cell).kinetic_energy;
  return energy;
}

}  // namespace sim
