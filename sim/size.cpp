#include "sim/size.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sim/effects/gravity.h"
#include "sim/fluid/sources.h"
#include "sim/pace.h"
#include "sim/seeding.h"
#include "sim/solid/make_model.h"
#include "sim/transfer/dimension.h"

namespace sim {
namespace {

constexpr double kMostPlaces = 2e6;   // looked at for a shape

/// A pattern of places over the part of a shape's bounds that lies in the domain, aligned with the seeding's boxes.
struct Pattern {
  base::Vec3 start = base::Vec3::Zero(), step = base::Vec3::Ones();
  std::array<std::int64_t, 3> count{1, 1, 1};
  double particles_each = 1;   // that a place stands for

  Pattern(const base::Box& bounds, const Options& o) {
    const double edge = o.cell / (o.dimension == 2 ? places_along_edge<2>(o) : places_along_edge<3>(o));   // [m] of a seeding box
    std::array<double, 3> first{}, boxes{1, 1, 1};
    double all = 1;
    for (std::size_t a = 0; a < std::size_t(o.dimension); ++a) {
      const auto axis = Eigen::Index(a);
      const double low = std::max(bounds.lower[axis], o.domain.lower[axis]), high = std::min(bounds.upper[axis], o.domain.upper[axis]);
      first[a] = std::floor((low - o.domain.lower[axis]) / edge);
      boxes[a] = std::max(0.0, std::ceil((high - o.domain.lower[axis]) / edge) - first[a]);
      all *= boxes[a];
    }
    double coarser = all > kMostPlaces ? std::pow(all / kMostPlaces, 1.0 / double(o.dimension)) : 1;
    if (o.seeding == Seeding::jitter && 64 * all < kMostPlaces) coarser = 0.25;   // anywhere in its box: several places a box tell its share
    for (std::size_t a = 0; a < std::size_t(o.dimension); ++a) {
      const auto axis = Eigen::Index(a);
      count[a] = std::int64_t(std::ceil(boxes[a] / coarser));
      if (count[a] == 0) continue;
      const double each = boxes[a] / double(count[a]);
      step[axis] = each * edge;
      start[axis] = o.domain.lower[axis] + first[a] * edge + 0.5 * step[axis];
      particles_each *= each;
    }
    if (o.dimension == 2) start.z() = 0, step.z() = 0;
  }
};

/// What sources have given by a time [s], as if nothing were in their cells when they begin.
double poured_by(double time, const Scene& scene) {
  if (scene.sources.empty()) return 0;
  return with_numbers(scene.options, [&](auto dimension, auto) {
    constexpr int D = decltype(dimension)::value;
    const Solids<D> solids(scene, lattice_of<D>(scene.options));
    const Sources<D> sources(scene, solids);
    double particles = 0;
    for (int s = 0; s < sources.count(); ++s) {
      if (time < sources.start(s)) continue;
      particles += double(sources.cells(s).size()) * double(scene.options.particles_per_cell);
      particles += sources.rate(s) * (std::min(time, sources.end(s)) - sources.start(s));
    }
    return particles;
  });
}

}  // namespace

std::int64_t common_parts(const Options& o) {
  std::int64_t common = 0;
  for (int a = 0; a < o.dimension; ++a) common = std::gcd(common, std::llround(o.domain.size()[a] / o.cell));
  return common;
}

Size size_of(const Scene& scene) {
  const Options& o = scene.options;
  Size size{0, 1};
  for (int a = 0; a < o.dimension; ++a) size.cells *= std::round(o.domain.size()[a] / o.cell);
  std::vector<Shape> taken;   // by what is named earlier
  for (const Collider& c : scene.colliders)
    for (const Shape& image : with_images(c.shape, o)) taken.push_back(image);
  for (const Body& body : scene.bodies)
    for (const Shape& shape : with_images(body.shape, o)) {
      const Pattern pattern(shape.bounds(), o);
      std::int64_t inside = 0;
      for (std::int64_t i = 0; i < pattern.count[0]; ++i)
        for (std::int64_t j = 0; j < pattern.count[1]; ++j)
          for (std::int64_t k = 0; k < pattern.count[2]; ++k) {
            const base::Vec3 at = pattern.start + base::Vec3(double(i), double(j), double(k)).cwiseProduct(pattern.step);
            inside += shape.distance(at) < 0 && !any_holds(taken, at);
          }
      size.particles += double(inside) * pattern.particles_each;
      taken.push_back(shape);
    }
  size.particles += poured_by(0, scene);
  return size;
}

std::vector<double> flows(const Scene& scene) {
  std::vector<double> all;
  if (scene.sources.empty()) return all;
  return with_numbers(scene.options, [&](auto dimension, auto) {
    constexpr int D = decltype(dimension)::value;
    const Sources<D> sources(scene, Solids<D>(scene, lattice_of<D>(scene.options)));
    for (int s = 0; s < sources.count(); ++s)
      all.push_back(sources.rate(s) * std::pow(scene.options.cell, D) / double(scene.options.particles_per_cell));
    return all;
  });
}

double particles_at(double time, const Scene& scene) { return size_of(scene).particles + poured_by(time, scene) - poured_by(0, scene); }

namespace {

/// [m/s] of sound in a body at rest.
double sound_at_rest(const Body& body) {
  Deformation<double, 3> rest{Matrix<double, 3>::zero(), 0};
  const double stiffness =
      std::visit([&](const auto& law) { return law.template respond<double, 3>(Matrix<double, 3>::zero(), rest).stiffness; }, make_model(body.solid));
  return std::sqrt(stiffness / body.solid.density);
}

/// [s] that sound allows; endless for a liquid, which has none.
double sound_step(const Scene& scene) {
  double fastest = 0;
  if (scene.options.is_solid())
    for (const Body& body : scene.bodies) fastest = std::max(fastest, sound_at_rest(body));
  return fastest > 0 ? scene.options.sound_cfl * scene.options.cell / fastest : std::numeric_limits<double>::infinity();
}

}  // namespace

double steps_in_frame(const Scene& scene, double fps, double before, double after) {
  const double frame = 1 / fps, fall = gravity(scene).norm(), reach = scene.options.cfl * scene.options.cell, sound = sound_step(scene);
  double steps = 0;
  for (double left = frame; left > 1e-9 * frame; ++steps) {
    const double share = 1 - left / frame;
    const double motion = cut_to(left, longest_step(before + share * (after - before), fall, reach));
    left -= motion <= sound ? motion : left / std::ceil(left / sound);   // solids cut what is left into equal steps
  }
  return steps;
}

}  // namespace sim
