#include "sim/solid/seeding.h"

#include <cmath>

#include "sim/seeding.h"
#include "sim/solid/make_model.h"

namespace sim {
namespace {

/// The fast transfers of a mode set, where there are any.
void set_lanes(Group<3, float>& group) {
  if (!group.scheme.flip) group.kernels = lanes::nodes_quadratic_of_solids(fast_set(group.scheme.modes));
}

template <int D, class Real>
Group<D, Real> empty_group(const Body& body, const Options& o) {
  Group<D, Real> group;
  group.scheme = Scheme<D>(with_scheme_of(body, o));
  group.model = make_model(body.solid);
  if constexpr (D == 3 && std::is_same_v<Real, float>) set_lanes(group);
  group.averages = body.solid.volume_averaging;
  group.density = body.solid.density;
  group.rest_volume = std::pow(o.cell, D) / double(o.particles_per_cell);
  group.particles.modes = int(group.scheme.modes.size());
  group.particles.mass = group.density * group.rest_volume;
  return group;
}

/// Places [cells] of a body's particles from the middle of its shape; on a periodic axis of the image that is nearest to it.
template <int D, class Real>
std::vector<Vec<D, double>> places_in_body(const Body& body, const Options& o, const Particles<D, Real>& p) {
  const base::Box bounds = body.shape.bounds();
  std::vector<Vec<D, double>> places(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    places[i] = p.place(i);
    for (int a = 0; a < D; ++a) {
      const double across = o.domain.size()[a] / o.cell;
      places[i][a] -= (0.5 * (bounds.lower[a] + bounds.upper[a]) - o.domain.lower[a]) / o.cell;
      if (o.periodic(a)) places[i][a] -= across * std::round(places[i][a] / across);
    }
  }
  return places;
}

/// Velocity and its gradient [1/s] of a body that turns about its middle become the coefficients of each particle.
template <int D, class Real>
void set_motion(const Body& body, const Options& o, Group<D, Real>& group) {
  Particles<D, Real>& p = group.particles;
  const std::vector<Vec<D, double>> places = places_in_body(body, o, p);
  Vec<D, double> middle = Vec<D, double>::Zero();
  for (const Vec<D, double>& place : places) middle += place / double(p.size());
  Eigen::Matrix3d turning;   // v = velocity + turning (x - middle)
  for (int a = 0; a < 3; ++a) turning.col(a) = body.spin.cross(base::Vec3(base::Vec3::Unit(a)));
  for (std::size_t i = 0; i < p.size(); ++i) {
    base::Vec3 arm = base::Vec3::Zero();
    arm.head<D>() = o.cell * (places[i] - middle);
    const base::Vec3 v = body.velocity + turning * arm;
    for (int c = 0; c < D; ++c)
      for (int r = 0; r < p.modes; ++r) {
        const ModeIndex<D>& mode = group.scheme.modes[std::size_t(r)];
        double value = r == 0 ? v[c] : 0;
        for (int a = 0; a < D; ++a) {
          bool alone = mode[a] == 1;
          for (int b = 0; b < D; ++b) alone = alone && (b == a || mode[b] == 0);
          if (alone) value = turning(c, a) * o.cell;
        }
        p.component(i, c)[std::size_t(r)] = Real(value);
      }
  }
}

}  // namespace

template <int D, class Real>
std::vector<Group<D, Real>> seed_groups(const Scene& scene, const Solids<D>& solids) {
  const Options& o = scene.options;
  const Lattice<D>& lattice = solids.lattice;
  const int edge = places_along_edge<D>(o);
  std::vector<std::vector<Shape>> shapes;   // of each body
  for (const Body& body : scene.bodies) shapes.push_back(with_images(body.shape, o));
  std::vector<Group<D, Real>> groups;
  std::int64_t next_id = 0;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    Group<D, Real>& group = groups.emplace_back(empty_group<D, Real>(scene.bodies[b], o));
    Particles<D, Real>& p = group.particles;
    group.first_id = next_id;
    for (const std::int64_t number : cells_around<D>(shapes[b], o, lattice)) {
      const Cell<D> at = cell_of<D>(number, lattice);
      for (int sub = 0; sub < int(o.particles_per_cell); ++sub) {
        const SeedPlace<D, Real> place = seed_place<D, Real>(o, edge, at, number, sub);
        if (!any_holds(shapes[b], place.at) || any_holds(solids.shapes, place.at)) continue;
        bool taken = false;
        for (std::size_t other = 0; other < b && !taken; ++other) taken = any_holds(shapes[other], place.at);
        if (taken) continue;
        Moving<D, Real> particle{{at, place.offset}, Vec<D, Real>::Zero()};   // it may touch a wall; that is no contact that stops it
        solids.push_out(particle);
        p.cell.push_back(particle.site.cell);
        p.offset.push_back(particle.site.offset);
        p.id.push_back(next_id++);
      }
    }
    p.cell.shrink_to_fit(), p.offset.shrink_to_fit(), p.id.shrink_to_fit();   // they are held for the whole run
    p.coefficients.assign(p.size() * p.row(), 0);
    set_motion<D, Real>(scene.bodies[b], o, group);
    group.deformation.assign(p.size(), {Matrix<Real, D>::zero(), Real(0)});
    group.stress.assign(p.size(), {});
  }
  return groups;
}

template std::vector<Group<2, float>> seed_groups(const Scene&, const Solids<2>&);
template std::vector<Group<2, double>> seed_groups(const Scene&, const Solids<2>&);
template std::vector<Group<3, float>> seed_groups(const Scene&, const Solids<3>&);
template std::vector<Group<3, double>> seed_groups(const Scene&, const Solids<3>&);

}  // namespace sim
