#include "sim/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include <fmt/format.h>

#include "sim/transfer/modes.h"

namespace sim {
namespace {

using namespace std::string_view_literals;
constexpr std::array kTransferNames{"pic"sv, "flip"sv, "apic"sv, "polypic"sv};
constexpr std::array kKernelNames{"linear"sv, "quadratic"sv};
constexpr std::array kSeedingNames{"jitter"sv, "regular"sv};
constexpr std::array kPrecisionNames{"single"sv, "double"sv};
constexpr std::array kSolverNames{"fluid"sv};
constexpr std::array kSplittingNames{"lie"sv};
constexpr std::array kCarryNames{"fixed"sv};
constexpr std::array kMaterialNames{"water"sv};
constexpr std::array kEffectNames{"gravity"sv};

bool is_multiple(double length, double cell) {
  const double n = length / cell;
  return std::abs(n - std::round(n)) < 1e-6 * std::max(1.0, n) && std::round(n) >= 1;
}

bool is_multiple(const base::Vec3& size, double cell) {
  return is_multiple(size.x(), cell) && is_multiple(size.y(), cell) && is_multiple(size.z(), cell);
}

/// The cell size nearest to `cell` that divides the domain in every axis; 0 when none is near.
double nearest_cell(const base::Vec3& size, double cell) {
  const double longest = size.maxCoeff();
  const auto wanted = std::max<std::int64_t>(1, std::llround(longest / cell));
  double best = 0;
  for (std::int64_t n = std::max<std::int64_t>(1, wanted / 2); n <= 2 * wanted + 8; ++n) {
    const double candidate = longest / double(n);
    if (is_multiple(size, candidate) && (best == 0 || std::abs(candidate - cell) < std::abs(best - cell))) best = candidate;
  }
  return best;
}

std::int64_t cube_root(std::int64_t n) { return std::llround(std::cbrt(double(n))); }

}  // namespace

void Shape::params(base::Params& p) {
  p("box", box, "m", "two opposite corners of a box", "not a box");
  Sphere round = sphere.value_or(Sphere{});
  const bool is_sphere = p.table("sphere", "a ball", [&](base::Params& q) {
    q("center", round.center, "m", "centre of the sphere");
    q("radius", round.radius, "m", "radius of the sphere", base::above(0));
  });
  if (is_sphere) sphere = round;
  p.require(box.has_value() != sphere.has_value(), "", "needs exactly one of box and sphere");
  if (box) p.require((box->size().array() > 0).all(), "box", "the second corner must be above the first in every axis");
}

double Shape::distance(const base::Vec3& at, base::Vec3* normal) const {
  if (sphere) {
    const base::Vec3 from_center = at - sphere->center;
    const double r = from_center.norm();
    if (normal) *normal = r > 0 ? base::Vec3(from_center / r) : base::Vec3::UnitZ();
    return r - sphere->radius;
  }
  const base::Vec3 below = box->lower - at, over = at - box->upper;
  const base::Vec3 outside = below.cwiseMax(over);
  int axis = 0;
  const double inside = outside.maxCoeff(&axis);
  if (inside <= 0) {
    if (normal) *normal = (below[axis] > over[axis] ? -1.0 : 1.0) * base::Vec3::Unit(axis);
    return inside;
  }
  const base::Vec3 gap = outside.cwiseMax(0.0);
  const double d = gap.norm();
  if (normal)
    for (int a = 0; a < 3; ++a) (*normal)[a] = (below[a] > over[a] ? -1.0 : 1.0) * gap[a] / d;
  return d;
}

base::Box Shape::bounds() const {
  if (box) return *box;
  const base::Vec3 r = base::Vec3::Constant(sphere->radius);
  return {sphere->center - r, sphere->center + r};
}

void Body::params(base::Params& p) {
  p("name", name, "unique name, used by --set body.NAME.key");
  p.table("shape", "where the material is at the first frame", [&](base::Params& q) { shape.params(q); });
  p.preset_or_table("material", material, kMaterialNames, "what the body is made of", [&](base::Params& q) {
    q("density", density, "kg/m^3", "mass per volume", base::above(0));
  });
  p("velocity", velocity, "m/s", "velocity at the first frame");
  p("look", look, "look of the body in pictures; unset: the look named as the material");
}

void Collider::params(base::Params& p) {
  p("name", name, "unique name, used by --set collider.NAME.key");
  p.table("shape", "where the solid stands", [&](base::Params& q) { shape.params(q); });
  p("look", look, "look of the solid in pictures");
}

void Effect::params(base::Params& p) {
  p("kind", kind, "what acts", kEffectNames);
  if (p.when(kind == "gravity")) p("acceleration", acceleration, "m/s^2", "acceleration of free fall");
}

void Options::params(base::Params& p) {
  constexpr std::array kDimensions{3};
  p("dimension", dimension, "1", "dimensions of space", base::within(kDimensions.front(), kDimensions.back()));
  p("solver", solver, "what is solved: fluid is an incompressible liquid with a free surface", kSolverNames);
  p("domain", domain, "m", "two opposite corners of the box of walls");
  p("cell", cell, "m", "edge of a grid cell", base::above(0));
  p("particles_per_cell", particles_per_cell, "1", "particles seeded in a full cell: 1, 8, 27 or 64", base::within(1, 64));
  p.choice("transfer", transfer, kTransferNames, "what a particle carries between grid and grid");
  p.choice("kernel", kernel, kKernelNames, "interpolation between particles and grid");
  p.count_or_name({"modes", "1", "polynomial modes a particle carries, with transfer = \"polypic\": a prefix count or a named set",
                   {}, kModeSetNames, "full"}, modes);
  p("cfl", cfl, "1", "cells that the fastest particle may cross in a sub-step", base::within(0.05, 4));
  p("seed", seed, "1", "seed of the particles' jitter", base::at_least(0));
  p.choice("seeding", seeding, kSeedingNames, "where particles start within a cell");
  p("flip_time", flip_time, "s", "time constant of the decay to PIC, with transfer = \"flip\"", base::above(0),
    "49.75 cells at the speed of a fall through the domain");
  p("pressure_tolerance", pressure_tolerance, "1", "relative residual of the pressure solve", base::between(0, 1));
  p.choice("precision", precision, kPrecisionNames, "floating point type of particles and grid");
  p("splitting", splitting, "how advection and pressure alternate: lie is one projection a step", kSplittingNames);
  p("carry", carry, "how coefficients reach the next step: fixed keeps them", kCarryNames);

  const base::Vec3 size = domain.size();
  const bool is_box = (size.array() > 0).all();
  p.require(is_box, "domain", "the second corner must be above the first in every axis");
  const double cells = size.prod() / (cell * cell * cell);
  const bool fits = cells <= kMostCells;
  p.require(!is_box || fits, "cell", fmt::format("makes {:.3g} cells; at most {:.3g} are possible", cells, kMostCells));
  if (is_box && fits && !is_multiple(size, cell)) {
    const double near = nearest_cell(size, cell);
    p.require(false, "cell", near > 0 ? fmt::format("the domain is no multiple of it; the nearest is {} m", near)
                                      : std::string("the domain is no multiple of it, and no cell near it divides all three edges"));
  }
  const auto edge = cube_root(particles_per_cell);
  p.require(edge * edge * edge == particles_per_cell, "particles_per_cell", "must be 1, 8, 27 or 64");
  const bool modes_given = modes.count > 0 || !modes.name.empty();
  p.require(!modes_given || transfer == Transfer::polypic, "modes", "needs sim.transfer = \"polypic\"");
  p.require(!flip_time || transfer == Transfer::flip, "flip_time", "needs sim.transfer = \"flip\"");
  if (modes_given) {
    const int most = kernel == Kernel::linear ? 8 : 27;
    p.require(modes.count <= most && modes.count >= 0, "modes",
              fmt::format("must be a count from 1 to {} with the {} kernel, or a named set", most, kKernelNames[std::size_t(kernel)]));
    p.require(modes.name != "quadratic" || kernel == Kernel::quadratic, "modes", "the set \"quadratic\" needs sim.kernel = \"quadratic\"");
  }
}

void Scene::params(base::Params& p) {
  p.table("sim", "the simulation", [&](base::Params& q) { options.params(q); });
  p.list("body", bodies, "material at the first frame");
  p.list("collider", colliders, "solids that stand still");
  p.list("effect", effects, "what acts; nothing acts unless it is named");

  const auto unique = [](const auto& named) {
    std::set<std::string> seen;
    for (const auto& one : named)
      if (!one.name.empty() && !seen.insert(one.name).second) return false;
    return true;
  };
  p.require(unique(bodies), "body", "two bodies have the same name");
  p.require(unique(colliders), "collider", "two colliders have the same name");
  for (const Body& body : bodies)
    p.require(body.density == bodies.front().density, "body", "one liquid has one density: all bodies must have the same");
}

}  // namespace sim
