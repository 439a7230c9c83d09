#pragma once
// Energy of place in a uniform gravity.
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

/// [J] from the domain's floor; cell [m].
template <int D, class Real>
double potential_energy(const Particles<D, Real>& particles, const base::Vec3& down, double cell) {
  return -particles.mass * base::ordered_reduce(particles.size(), 16384, 0.0, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t p = begin; p < end; ++p) sum += cell * down.head<D>().dot(particles.place(p));
    return sum;
  }, [](double a, double b) { return a + b; });
}

}  // namespace sim
