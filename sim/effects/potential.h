#pragma once
// Energy of place in a uniform gravity.
#include <algorithm>

#include "base/parallel.h"
#include "sim/scene.h"
#include "sim/transfer/particles.h"

namespace sim {

/// `gravity` [m/s^2] without its part along periodic axes, which have no floor to measure from.
inline base::Vec3 downhill(base::Vec3 gravity, const Options& o) {
  for (int a = 0; a < o.dimension; ++a)
    if (o.periodic(a)) gravity[a] = 0;
  return gravity;
}

/// [m^2/s^2] Of place, per mass, of the domain's corner that `down` points to, measured from its lower one: negative, or 0.
inline double energy_of_floor(const base::Vec3& down, const Options& o) {
  double energy = 0;
  for (int a = 0; a < o.dimension; ++a) energy -= std::max(down[a], 0.0) * o.domain.size()[a];
  return energy;
}

/// [m^2/s^2] Of a place [cells], per mass, measured from the same.
template <int D>
double energy_of_place(const Vec<D, double>& place, const base::Vec3& down, const Options& o) {
  return -(o.cell * down.head<D>().dot(place) + energy_of_floor(down, o));
}

/// [J] from the domain's floor, which is the side that gravity points to: nothing in the domain has less than 0.
template <int D, class Real>
double potential_energy(const Particles<D, Real>& particles, const base::Vec3& down, const Options& o) {
  const double sum = base::ordered_reduce(particles.size(), 16384, 0.0, [&](std::size_t begin, std::size_t end) {
    double part = 0;
    for (std::size_t p = begin; p < end; ++p) part += o.cell * down.head<D>().dot(particles.place(p));
    return part;
  }, [](double a, double b) { return a + b; });
  return -particles.mass * (sum + double(particles.size()) * energy_of_floor(down, o));
}

}  // namespace sim
