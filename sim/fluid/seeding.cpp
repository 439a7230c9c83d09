#include "sim/fluid/seeding.h"

#include <algorithm>
#include <cmath>

#include "sim/random.h"

namespace sim {
namespace {

/// Numbers of the cells that a body's bounds touch, row-major over the domain, ascending.
template <int D>
std::vector<std::int64_t> cells_of(const std::vector<std::vector<Shape>>& shapes, const Options& o, const Lattice<D>& lattice) {
  std::vector<std::int64_t> numbers;
  for (const std::vector<Shape>& images : shapes)
    for (const Shape& shape : images) {
      const base::Box bounds = shape.bounds();
      Cell<D> lower, upper;                                      // both included
      bool empty = false;
      for (int a = 0; a < D; ++a) {
        const double last = double(lattice.cells[a]) - 1;
        lower[a] = int(std::clamp(std::floor((bounds.lower[a] - o.domain.lower[a]) / o.cell) - 1, 0.0, last));
        upper[a] = int(std::clamp(std::floor((bounds.upper[a] - o.domain.lower[a]) / o.cell) + 1, 0.0, last));
        empty = empty || bounds.upper[a] < o.domain.lower[a] || bounds.lower[a] > o.domain.upper[a];
      }
      if (empty) continue;
      for (Cell<D> at = lower; at[0] <= upper[0];) {
        std::int64_t number = 0;
        for (int a = 0; a < D; ++a) number = number * lattice.cells[a] + at[a];
        numbers.push_back(number);
        int a = D - 1;
        while (a > 0 && at[a] == upper[a]) at[a] = lower[a], --a;
        ++at[a];
      }
    }
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

}  // namespace

template <int D, class Real>
Particles<D, Real> seed_particles(const Scene& scene, const Lattice<D>& lattice, const Solids<D>& solids, int modes) {
  const Options& o = scene.options;
  const int edge = int(std::lround(std::pow(double(o.particles_per_cell), 1.0 / D)));
  Particles<D, Real> particles;
  particles.modes = modes;
  particles.mass = scene.bodies.front().density * std::pow(o.cell, D) / double(o.particles_per_cell);

  std::vector<std::vector<Shape>> shapes;   // of each body
  for (const Body& body : scene.bodies) shapes.push_back(with_images(body.shape, o));
  const auto holds = [](const std::vector<Shape>& any, const base::Vec3& at) {
    return std::any_of(any.begin(), any.end(), [&](const Shape& shape) { return shape.distance(at) < 0; });
  };
  constexpr std::uint32_t kNobody = ~0u;
  const auto owner = [&](const base::Vec3& at) {
    if (holds(solids.shapes, at)) return kNobody;
    for (std::uint32_t b = 0; b < shapes.size(); ++b)
      if (holds(shapes[b], at)) return b;
    return kNobody;
  };
  std::vector<std::uint32_t> bodies;        // of each particle

  for (const std::int64_t number : cells_of<D>(shapes, o, lattice)) {
    Cell<D> at;
    std::int64_t rest_of_number = number;
    for (int a = D - 1; a >= 0; rest_of_number /= lattice.cells[a], --a) at[a] = int(rest_of_number % lattice.cells[a]);
    for (int sub = 0; sub < int(o.particles_per_cell); ++sub) {
      Vec<D, Real> offset;
      base::Vec3 place = o.domain.lower;
      for (int a = D - 1, rest = sub; a >= 0; --a, rest /= edge) {
        const double within = o.seeding == Seeding::regular ? 0.5 : uniform(std::uint64_t(o.seed), std::uint64_t(number), std::uint64_t(sub * D + a));
        // The largest float below 1 keeps an offset that rounds up inside its cell.
        offset[a] = std::min(Real((rest % edge + within) / edge), std::nextafter(Real(1), Real(0)));
        place[a] += o.cell * (at[a] + double(offset[a]));
      }
      const std::uint32_t body = owner(place);
      if (body == kNobody) continue;
      Moving<D, Real> particle{{at, offset}, Vec<D, Real>::Zero()};   // it may touch a wall; that is no contact that stops it
      solids.push_out(particle);
      particles.cell.push_back(particle.site.cell);
      particles.offset.push_back(particle.site.offset);
      particles.id.push_back(std::int64_t(particles.id.size()));
      bodies.push_back(body);
    }
  }
  // They are held for the whole run: no more than they need.
  particles.cell.shrink_to_fit(), particles.offset.shrink_to_fit(), particles.id.shrink_to_fit();
  particles.coefficients.assign(particles.size() * particles.row(), Real(0));
  for (std::size_t p = 0; p < particles.size(); ++p)
    for (int a = 0; a < D; ++a) particles.component(p, a)[0] = Real(scene.bodies[bodies[p]].velocity[a]);
  return particles;
}

template Particles<2, float> seed_particles(const Scene&, const Lattice<2>&, const Solids<2>&, int);
template Particles<2, double> seed_particles(const Scene&, const Lattice<2>&, const Solids<2>&, int);
template Particles<3, float> seed_particles(const Scene&, const Lattice<3>&, const Solids<3>&, int);
template Particles<3, double> seed_particles(const Scene&, const Lattice<3>&, const Solids<3>&, int);

}  // namespace sim
