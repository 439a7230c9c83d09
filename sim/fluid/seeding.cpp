#include "sim/fluid/seeding.h"

#include "sim/seeding.h"

namespace sim {

template <int D, class Real>
Particles<D, Real> seed_particles(const Scene& scene, const Lattice<D>& lattice, const Solids<D>& solids, int modes) {
  const Options& o = scene.options;
  const int edge = places_along_edge<D>(o);
  Particles<D, Real> particles;
  particles.modes = modes;
  particles.mass = liquid_density(scene) * std::pow(o.cell, D) / double(o.particles_per_cell);

  std::vector<std::vector<Shape>> shapes;   // of each body
  std::vector<Shape> all;
  for (const Body& body : scene.bodies) {
    shapes.push_back(with_images(body.shape, o));
    all.insert(all.end(), shapes.back().begin(), shapes.back().end());
  }
  constexpr std::uint32_t kNobody = ~0u;
  const auto owner = [&](const base::Vec3& at) {
    if (any_holds(solids.shapes, at)) return kNobody;
    for (std::uint32_t b = 0; b < shapes.size(); ++b)
      if (any_holds(shapes[b], at)) return b;
    return kNobody;
  };
  std::vector<std::uint32_t> bodies;        // of each particle

  for (const std::int64_t number : cells_around<D>(all, o, lattice)) {
    const Cell<D> at = cell_of<D>(number, lattice);
    for (int sub = 0; sub < int(o.particles_per_cell); ++sub) {
      const SeedPlace<D, Real> place = seed_place<D, Real>(o, edge, at, number, sub);
      const std::uint32_t body = owner(place.at);
      if (body == kNobody) continue;
      Moving<D, Real> particle{{at, place.offset}, Vec<D, Real>::Zero()};   // it may touch a wall; that is no contact that stops it
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
