#include "sim/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <span>

#include <fmt/format.h>

#include "sim/colliders/solids.h"
#include "sim/transfer/modes.h"
#include "sim/transfer/tensor.h"

namespace sim {
namespace {

using namespace std::string_view_literals;
constexpr std::array kTransferNames{"pic"sv, "flip"sv, "apic"sv, "polypic"sv};
constexpr std::array kKernelNames{"linear"sv, "quadratic"sv};
constexpr std::array kSeedingNames{"jitter"sv, "regular"sv};
constexpr std::array kPrecisionNames{"single"sv, "double"sv};
constexpr std::array kSolverNames{"fluid"sv, "solid"sv};
constexpr std::array kSplittingNames{"lie"sv, "reflection"sv};
constexpr std::array kAdvectionNames{"rk2"sv, "rk3"sv};
constexpr std::array kCarryNames{"fixed"sv, "limited"sv, "hybrid"sv};
/// The first three of fluids, all but the first of solids.
constexpr std::array kSideNames{"open"sv, "slip"sv, "periodic"sv, "sticky"sv, "separating"sv};
constexpr std::array kSides{Side::open, Side::slip, Side::periodic, Side::sticky, Side::separating};
constexpr std::array kContactNames{"sticky"sv, "slip"sv, "separating"sv};
constexpr auto kOfSolids = "sim.solver = \"solid\""sv, kOfLiquids = "sim.solver = \"fluid\""sv;
constexpr auto kNoLook = "has no effect in two dimensions: points are drawn, coloured as [preview] says"sv;
constexpr std::array kSideKeys{std::array{"x_lower"sv, "x_upper"sv}, std::array{"y_lower"sv, "y_upper"sv}, std::array{"z_lower"sv, "z_upper"sv}};
constexpr int kFewestPeriodicCells = 4;
constexpr std::array kMaterialNames{"water"sv, "jelly"sv, "rubber"sv, "steel"sv, "clay"sv, "dry_sand"sv, "wet_sand"sv, "snow"sv, "water_mpm"sv};
constexpr std::array kEffectNames{"gravity"sv};

bool is_multiple(double length, double cell) {
  const double n = length / cell;
  return std::abs(n - std::round(n)) < 1e-6 * std::max(1.0, n) && std::round(n) >= 1;
}

using Extents = std::vector<double>;   // [m] of the domain, an entry an axis

bool is_multiple(const Extents& size, double cell) {
  return std::all_of(size.begin(), size.end(), [&](double length) { return is_multiple(length, cell); });
}

std::int64_t cells_along(const Extents& size, double cell) {
  return std::max<std::int64_t>(1, std::llround(*std::max_element(size.begin(), size.end()) / cell));
}

/// The cell size nearest to `cell` that divides the domain in every axis and makes `fewest` to `most` cells along its longest edge; 0 when there is
/// none.
double nearest_cell(const Extents& size, double cell, std::int64_t fewest, std::int64_t most) {
  const double longest = *std::max_element(size.begin(), size.end());
  const std::int64_t wanted = cells_along(size, cell);
  for (std::int64_t away = 0; away <= std::max(wanted - fewest, most - wanted); ++away) {
    double best = 0;
    for (const std::int64_t n : {wanted + away, wanted - away}) {
      if (n < fewest || n > most || !is_multiple(size, longest / double(n))) continue;
      const double candidate = longest / double(n);
      if (best == 0 || std::abs(candidate - cell) < std::abs(best - cell)) best = candidate;
    }
    if (best > 0) return best;
  }
  return 0;
}

/// What cells there could be, for a domain that is no multiple of the one given.
std::string other_cells(const Extents& size, double cell) {
  constexpr std::int64_t kFarthest = 100000;   // cells along the longest edge
  const std::int64_t wanted = cells_along(size, cell);
  const double near = nearest_cell(size, cell, (wanted + 1) / 2, 2 * wanted + 8);
  if (near > 0) return fmt::format("; the nearest is {} m", near);
  const std::string none = fmt::format(", and no cell near it divides {} edges", size.size() == 2 ? "both" : "all three");
  const double far = nearest_cell(size, cell, 1, kFarthest);
  double cells = 1;
  for (const double length : size) cells *= length / far;
  return far > 0 && cells <= kMostCells ? none + fmt::format("; {} m does", far) : none;
}

void check_domain(const Options& o, base::Params& p) {
  const base::Vec3 edges = o.domain.size();
  const Extents size(edges.data(), edges.data() + o.dimension);
  const bool is_box = std::all_of(size.begin(), size.end(), [](double length) { return length > 0; });
  p.require(is_box, "domain", "the second corner must be above the first in every axis");
  if (!is_box) return;
  double cells = 1, most = 0;
  for (const double length : size) cells *= length / o.cell, most = std::max(most, length / o.cell);
  const bool fits = cells <= kMostCells && most <= kMostCellsOfAnEdge;
  p.require(cells <= kMostCells, "cell", fmt::format("makes {:.3g} cells; at most {:.3g} are possible", cells, kMostCells));
  p.require(cells > kMostCells || fits, "cell",
            fmt::format("makes {:.3g} cells along an edge; at most {:.3g} are possible", most, kMostCellsOfAnEdge));
  double farthest = 0;
  for (int a = 0; a < o.dimension; ++a) farthest = std::max({farthest, std::abs(o.domain.lower[a]), std::abs(o.domain.upper[a])});
  const double apart = farthest * double(std::numeric_limits<float>::epsilon());
  p.require(!fits || apart <= o.cell / 4, "domain",
            fmt::format("is so far from 0 that numbers in files, which are single precision, lie {:.2g} m apart there, and a cell is {} m", apart, o.cell));
  if (fits && !is_multiple(size, o.cell)) p.require(false, "cell", "the domain is no multiple of it" + other_cells(size, o.cell));
}

void check_boundary(const Options& o, base::Params& p) {
  for (std::size_t a = 0; a < std::size_t(o.dimension); ++a)
    for (std::size_t side = 0; side < 2; ++side) {
      const std::string key = "boundary." + std::string(kSideKeys[a][side]);
      if (o.boundary[a][side] != Side::periodic) continue;
      const auto cells = std::llround(o.domain.size()[Eigen::Index(a)] / o.cell);
      p.require(o.boundary[a][1 - side] == Side::periodic, key, fmt::format("needs sim.boundary.{} = \"periodic\" too", kSideKeys[a][1 - side]));
      p.require(cells >= kFewestPeriodicCells, key,
                fmt::format("needs at least {} cells between the two sides; there are {}", kFewestPeriodicCells, cells));
    }
}

/// Whether the mode set has modes that bend within a cell.
bool bends(const Options& o) {
  return o.modes.name.empty() ? o.modes.count == 0 || o.modes.count > int_power(2, int(o.dimension)) : o.modes.name != "multilinear";
}

/// What cannot be combined, or would have no effect.
void check_transfer(const Options& o, base::Params& p) {
  const bool polypic = o.transfer == Transfer::polypic, linear = o.kernel == Kernel::linear;
  p.require(!o.flip_time || o.transfer == Transfer::flip || o.is_solid(), "flip_time", "needs sim.transfer = \"flip\"");
  if (o.modes.count > 0 || !o.modes.name.empty()) {
    const int most = int_power(linear ? 2 : 3, int(o.dimension));
    p.require(polypic, "modes", "needs sim.transfer = \"polypic\"");
    p.require(o.modes.count <= most && o.modes.count >= 0, "modes",
              fmt::format("must be a count from 1 to {} with the {} kernel{}, or a named set", most, kKernelNames[std::size_t(o.kernel)],
                          o.dimension == 2 ? " in two dimensions" : ""));
    p.require(o.modes.name != "quadratic" || !linear, "modes", "the set \"quadratic\" needs sim.kernel = \"quadratic\"");
  }
  if (o.is_solid()) p.require(!linear, "kernel", "solids need the quadratic kernel: forces of the linear one jump from cell to cell");
  p.require(o.is_solid() || o.splitting != Splitting::reflection || o.carry != Carry::limited, "carry",
            "must be fixed or hybrid with sim.splitting = \"reflection\": a flow that is limited everywhere gains energy there");
  if (o.carry == Carry::fixed || o.is_solid()) return;
  p.require(polypic, "carry", "needs sim.transfer = \"polypic\": only modes that bend within a cell are limited, and no other transfer has any");
  p.require(!polypic || !linear, "carry", "needs sim.kernel = \"quadratic\": limiting the linear kernel's modes would throw its accuracy away");
  p.require(!polypic || linear || bends(o), "carry", "needs more sim.modes: only modes that bend within a cell are limited, and this set has none");
}

/// A body's own scheme, where the shot gives it one.
void check_body(const Body& body, const Options& options, const std::string& key, base::Params& p) {
  const Options own = with_scheme_of(body, options);
  p.require(body.modes.count == 0 && body.modes.name.empty() ? true : own.transfer == Transfer::polypic, key + ".modes",
            "needs transfer = \"polypic\"");
  p.require(own.modes.count <= int_power(3, int(options.dimension)), key + ".modes",
            fmt::format("must be at most {}", int_power(3, int(options.dimension))));
  p.require(body.carry.empty() || own.carry != Carry::limited || (own.transfer == Transfer::polypic && bends(own)), key + ".carry",
            "needs transfer = \"polypic\" with modes that bend within a cell: no others are limited");
}

/// What only some of the bodies of solids may need.
void check_schemes(const Scene& scene, base::Params& p) {
  const Options& o = scene.options;
  const auto any = [&](const auto& is) {
    return scene.bodies.empty() || std::any_of(scene.bodies.begin(), scene.bodies.end(), [&](const Body& b) { return is(with_scheme_of(b, o)); });
  };
  p.require(!o.flip_time || any([](const Options& own) { return own.transfer == Transfer::flip; }), "sim.flip_time",
            "needs transfer = \"flip\", of the simulation or of a body");
  p.require(o.carry != Carry::limited || any([](const Options& own) { return own.transfer == Transfer::polypic && bends(own); }), "sim.carry",
            "needs transfer = \"polypic\" with modes that bend within a cell: no others are limited");
}

}  // namespace

Options with_scheme_of(const Body& body, Options o) {
  const auto place_of = [](const auto& names, const std::string& name) {
    return std::size_t(std::find(names.begin(), names.end(), name) - names.begin());
  };
  if (!body.transfer.empty()) o.transfer = static_cast<Transfer>(place_of(kTransferNames, body.transfer));
  if (!body.carry.empty()) o.carry = static_cast<Carry>(place_of(kCarryNames, body.carry));
  if (body.modes.count > 0 || !body.modes.name.empty()) o.modes = body.modes;
  else if (body.solid.model == Elasticity::tait && bends(o)) o.modes = {.count = 0, .name = "multilinear"};   // no shear would hold those that bend
  if (o.transfer != Transfer::polypic) o.modes = {};
  return o;
}

void Body::params(base::Params& p) {
  p("name", name, "unique name, used by --set body.NAME.key");
  p.table("shape", "where the material is at the first frame", [&](base::Params& q) { shape.params(q, true); });
  // Whoever describes sees them all, and a solid's material without the solver is told what it needs.
  const auto presets = p.when(!is_solid) ? std::span<const std::string_view>(kMaterialNames) : material_presets();
  if (is_solid) material = material_presets().front();
  p.preset_or_table("material", material, presets, "what the body is made of: water is a fluid, everything else needs sim.solver = \"solid\"",
                    [&](base::Params& q) {
                      solid = preset_material(is_solid ? material : material_presets().front());   // whoever describes sees a solid's
                      if (q.when(!is_solid)) q("density", is_solid ? solid.density : density, "kg/m^3", "mass per volume", base::above(0));
                      q.where(is_solid, kOfSolids, [&] { solid.params(q); });
                    });
  p.require(is_solid || material == kMaterialNames.front(), "material", fmt::format("\"{}\" needs sim.solver = \"solid\"", material));
  p("velocity", velocity, "m/s", "velocity at the first frame");
  p.where(is_solid, kOfSolids, [&] {
    if (p.vector_size() == 3) p("spin", spin, "rad/s", "turning at the first frame, about the body's middle");
    else p("spin", spin.z(), "rad/s", "turning at the first frame, about the body's middle");
    p("transfer", transfer, "what this body's particles carry; unset: sim.transfer", kTransferNames);
    p.count_or_name({"modes", "1", "modes of this body's particles, with transfer = \"polypic\"", {}, kModeSetNames, "sim.modes"}, modes);
    p("carry", carry, "how this body's coefficients reach the next step; unset: sim.carry", kCarryNames);
    p.choice("contact", contact, kContactNames, "where it touches another body: sticks, slips without leaving it, or leaves it when pulled; the looser contact of the two counts");
    p.where(contact == Contact::separating, "contact = \"separating\"",
            [&] { p("friction", friction, "1", "Coulomb's coefficient of friction with other bodies; of two the smaller counts", base::at_least(0)); });
  });
  if (p.when(p.vector_size() == 3)) p("look", look, "look of the body in pictures; unset: the look named as the material");
  else p.without("look", kNoLook);
}

void Source::params(base::Params& p) {
  p("name", name, "unique name, used by --set source.NAME.key");
  p.table("shape", "where it is: whole cells, those with their middles in it", [&](base::Params& q) { shape.params(q, false); });
  p("velocity", velocity, "m/s", "velocity of what it pours");
  p.require(!velocity.isZero(0), "velocity", "must not be zero: nothing would come");
  p.require((!shape.sphere && !shape.turn) || (velocity.array() != 0).count() <= 1, "velocity",
            "must point along an axis where the shape is a sphere or a turned box: the steps of its cells would pour sideways");
  p("density", density, "kg/m^3", "mass per volume", base::above(0), "that of the bodies, or 1000");
  p("start", start, "s", "when it begins; the first frame is 0", base::at_least(0));
  p("end", end, "s", "when it ends", base::above(0), "never");
  p.require(!end || *end > start, "end", "must be later than start");
  if (p.when(p.vector_size() == 3)) p("look", look, "look of the liquid in pictures; unset: that of the bodies, or water");
  else p.without("look", kNoLook);
}

void Collider::params(base::Params& p) {
  p("name", name, "unique name, used by --set collider.NAME.key");
  p.table("shape", "where the solid stands at the first frame", [&](base::Params& q) { shape.params(q, true); });
  p("velocity", velocity, "m/s", "velocity of the solid while it moves");
  if (p.vector_size() == 3) p("spin", spin, "rad/s", "turning of the solid while it moves, about its pivot: direction of the axis times speed");
  else p("spin", spin.z(), "rad/s", "turning of the solid while it moves, about its pivot, counter-clockwise");
  p.where(!spin.isZero(0), "a spin", [&] { p("pivot", pivot, "m", "what it turns about, at the first frame; moves with `velocity`", "middle of the shape"); });
  p.where(moves(), "a velocity or a spin", [&] {
    p("start", start, "s", "when it begins to move; the first frame is 0", base::at_least(0));
    p("end", end, "s", "when it stops", base::above(0), "never");
  });
  p.require(!end || *end > start, "end", "must be later than start");
  p.where(meets_solids, kOfSolids, [&] {
    p.choice("contact", contact, kContactNames, "what a solid body does at it: sticks, slips without leaving it, or leaves it when pulled");
    p.where(contact == Contact::separating, "contact = \"separating\"",
            [&] { p("friction", friction, "1", "Coulomb's coefficient of friction", base::at_least(0)); });
  });
  if (p.when(p.vector_size() == 3)) p("look", look, "look of the solid in pictures");
  else p.without("look", kNoLook);
}

void Effect::params(base::Params& p) {
  p("kind", kind, "what acts", kEffectNames);
  if (p.when(kind == "gravity")) p("acceleration", acceleration, "m/s^2", "acceleration of free fall");
}

void Write::params(base::Params& p, bool is_solid) {
  p("pressure", pressure, "pressure [Pa]; of a liquid the mean over the last step, 0 at the first frame");
  p.where(is_solid, kOfSolids,
          [&] { p("strain", strain, "equivalent elastic strain [1]: of what is left of the logarithmic strain without its part in volume"); });
  p("mode_energy", mode_energy, "energy in a particle's modes above the constant [J/kg]");
}

void Options::params(base::Params& p) {
  p("dimension", dimension, "1", "dimensions of space: 3, or 2 for a plane seen flat, y up", base::within(2, 3));
  p.vectors_have(dimension);
  if (dimension == 2) domain.lower.z() = domain.upper.z() = 0, particles_per_cell = 4;
  p("solver", solver, "what is solved: fluid is an incompressible liquid with a free surface, solid elastic and plastic bodies", kSolverNames);
  if (is_solid()) {
    kernel = Kernel::quadratic, carry = Carry::hybrid, cfl = 0.4;
    for (auto& sides : boundary) sides = {Side::separating, Side::separating};
  }
  p("domain", domain, "m", "two opposite corners of the box that is simulated");
  p("cell", cell, "m", "edge of a grid cell", base::above(0));
  p.table("boundary", "the sides of the domain", [&](base::Params& q) {
    const bool fluid = q.when(!is_solid()), solid = q.when(is_solid());   // whoever describes sees both
    const std::size_t first = fluid ? 0 : 1, count = (solid ? kSides.size() : 3) - first;
    for (int a = 0; a < 3; ++a)
      q.where(a < dimension, a < 2 ? "" : "sim.dimension = 3", [&] {
        for (std::size_t side = 0; side < 2; ++side)
          q.choice(kSideKeys[std::size_t(a)][side], boundary[std::size_t(a)][side], std::span(kSideNames).subspan(first, count),
                   std::span<const Side>(kSides).subspan(first, count),
                   "a wall (liquids slip along it), one with the side across, or open: liquids flow out into air");
      });
    q.where(is_solid(), kOfSolids,
            [&] { q("friction", wall_friction, "1", "Coulomb's coefficient of friction of separating sides", base::at_least(0)); });
  });
  p("particles_per_cell", particles_per_cell, "1",
    "particles seeded in a full cell: 1, 8, 27 or 64; in two dimensions 1, 4, 9 or 16, and 4 when unset", base::within(1, 64));
  p.choice("transfer", transfer, kTransferNames, "what a particle carries between grid and grid");
  p.choice("kernel", kernel, kKernelNames, "interpolation between particles and grid");
  p.count_or_name({"modes", "1", "polynomial modes a particle carries, with transfer = \"polypic\": a prefix count or a named set",
                   {}, kModeSetNames, "full"}, modes);
  p("cfl", cfl, "1", "cells that the fastest particle may cross in a sub-step; of solids 1.9 at most", base::within(0.05, is_solid() ? 1.9 : 4));
  p.where(is_solid(), kOfSolids, [&] {
    p("sound_cfl", sound_cfl, "1", "cells that sound may cross in a sub-step; single particles and what is strongly stretched get two thirds",
      base::within(0.01, 0.45));
  });
  p("seed", seed, "1", "seed of the particles' jitter", base::at_least(0));
  p.choice("seeding", seeding, kSeedingNames, "where particles start within a cell");
  p("flip_time", flip_time, "s", "time constant of the decay to PIC, with transfer = \"flip\"", base::above(0),
    "49.75 cells at the speed of a fall through the domain");
  p.where(!is_solid(), kOfLiquids,
          [&] { p("pressure_tolerance", pressure_tolerance, "1", "relative residual of the pressure solve", base::between(0, 1)); });
  p.choice("precision", precision, kPrecisionNames, "floating point type of particles and grid");
  p.where(!is_solid(), kOfLiquids, [&] {
    p.choice("splitting", splitting, kSplittingNames,
             "how motion and pressure alternate: lie is one projection a step; reflection two, the flow mirrored at the first: second order in time, beside a free surface where the flow is steady");
    p.choice("advection", advection, kAdvectionNames, "how particles move in a step's velocity: the midpoint rule, or three stages of third order");
    bool endless = true;
    for (int a = 0; a < dimension; ++a) endless = endless && periodic(a);
    if (endless) volume_correction = 0;
    p("volume_correction", volume_correction, "1",
      "part of what the liquid's inside has become denser or thinner that a step takes back by shifting particles; "
      "0: none, as when unset and all sides are periodic",
      base::within(0, 1));
  });
  p.choice("carry", carry, kCarryNames,
           "how coefficients reach the next step: as they are, with those that bend scaled so that none gains energy, "
           "or that only beside light faces");
  p.table("write", "what particles carry in the points files beside place, velocity and id", [&](base::Params& q) { write.params(q, is_solid()); });
  p("audit", audit, "sums the energy that each pass of a step adds or takes: energy_changes of every frame in run.json. Changes no result");

  check_domain(*this, p);
  check_boundary(*this, p);
  const auto separates = [](const auto& sides) { return sides[0] == Side::separating || sides[1] == Side::separating; };
  p.require(wall_friction == 0 || std::any_of(boundary.begin(), boundary.begin() + dimension, separates), "boundary.friction",
            "needs a side that is \"separating\"");
  check_transfer(*this, p);
  const auto edge = std::llround(std::pow(double(particles_per_cell), 1.0 / double(dimension)));
  const bool is_power = edge <= 4 && int_power(int(edge), int(dimension)) == particles_per_cell;
  p.require(is_power, "particles_per_cell", dimension == 2 ? "must be 1, 4, 9 or 16" : "must be 1, 8, 27 or 64");
}

namespace {

/// What the boxes around the bodies would hold, within the domain, and those around sources.
double most_particles(const Scene& scene) {
  const Options& o = scene.options;
  double most = 0;
  for (const Body& body : scene.bodies) {
    if (body.shape.box.has_value() + body.shape.sphere.has_value() != 1) continue;   // a mesh, read later, or refused elsewhere
    const base::Box bounds = body.shape.bounds();
    double here = double(o.particles_per_cell);
    for (int a = 0; a < int(o.dimension); ++a)
      here *= std::max(0.0, std::min(bounds.upper[a], o.domain.upper[a]) - std::max(bounds.lower[a], o.domain.lower[a])) / o.cell;
    most += here;
  }
  for (const Source& source : scene.sources) {
    if (source.shape.box.has_value() + source.shape.sphere.has_value() != 1) continue;
    double here = double(o.particles_per_cell);
    const base::Vec3 size = source.shape.bounds().size();
    for (int a = 0; a < int(o.dimension); ++a) here *= size[a] / o.cell;
    most += here;
  }
  return most;
}

}  // namespace

void measure_meshes(Scene& scene) {
  const Options& o = scene.options;
  constexpr double kAround = 8, kAnywhere = 1e18;   // [cells] outside the domain that somebody may ask for; [m] where what moves may get to
  for (Collider& collider : scene.colliders) {
    if (!collider.shape.mesh) continue;
    base::Box within = o.domain;
    for (int a = 0; a < 3; ++a) {
      const double more = collider.moves() || !collider.shape.mesh->turn.vec().isZero(0) ? kAnywhere : kAround * o.cell + (o.periodic(a) ? o.domain.size()[a] : 0);
      within.lower[a] -= more, within.upper[a] += more;
    }
    collider.shape.mesh->distances = std::make_shared<const MeshDistance>(collider.shape.mesh->solid, o.cell, o.domain.lower, within);
  }
}

std::optional<std::size_t> find_refused_mesh(const Scene& scene) {
  for (std::size_t c = 0; c < scene.colliders.size(); ++c)
    if (const auto& mesh = scene.colliders[c].shape.mesh; mesh && !mesh->distances->objection().empty()) return c;
  return {};
}

std::optional<UnmetCollider> find_unmet_collider(const Scene& scene) {
  for (std::size_t c = 0; c < scene.colliders.size() && scene.options.is_solid(); ++c) {
    const Collider& collider = scene.colliders[c];
    const bool is_plain = collider.contact == Contact::separating && collider.friction == 0;
    const bool is_known = collider.shape.mesh ? collider.shape.mesh->distances != nullptr : collider.shape.any();
    if (is_known && !is_plain && !is_met_by_nodes(collider, scene.options))
      return UnmetCollider{c, collider.contact == Contact::separating ? "friction" : "contact",
                           "needs a collider as thick as sim.cell, with a node of the grid in it: contact of solids is there"};
  }
  return {};
}

double liquid_density(const Scene& scene) {
  if (!scene.bodies.empty()) return scene.bodies.front().density;
  for (const Source& source : scene.sources)
    if (source.density) return *source.density;
  return Body().density;
}

void Scene::params(base::Params& p) {
  p.table("sim", "the simulation", [&](base::Params& q) { options.params(q); });
  Body body;
  Collider collider;
  body.is_solid = collider.meets_solids = options.is_solid();
  p.list("body", bodies, "material at the first frame", body);
  p.where(!options.is_solid(), kOfLiquids, [&] { p.list("source", sources, "where liquid pours in"); });
  if (options.is_solid()) p.without("source", "needs sim.solver = \"fluid\": only liquids pour");
  p.list("collider", colliders, "solids in the way", collider);
  p.list("effect", effects, "what acts; nothing acts unless it is named",
         options.dimension == 2 ? Effect{.acceleration = base::Vec3(0, -9.81, 0)} : Effect{});

  const auto unique = [](const auto& named) {
    std::set<std::string> seen;
    for (const auto& one : named)
      if (!one.name.empty() && !seen.insert(one.name).second) return false;
    return true;
  };
  p.require(unique(bodies), "body", "two bodies have the same name");
  p.require(unique(sources), "source", "two sources have the same name");
  p.require(unique(colliders), "collider", "two colliders have the same name");
  const double most = most_particles(*this);
  p.require(most <= kMostParticles, "sim.cell", fmt::format("makes up to {:.3g} particles; at most {:.3g} are possible", most, kMostParticles));
  for (std::size_t i = 0; i < bodies.size() && options.is_solid(); ++i) check_body(bodies[i], options, "body." + std::to_string(i + 1), p);
  if (options.is_solid()) check_schemes(*this, p);
  if (const auto unmet = find_unmet_collider(*this)) p.require(false, "collider." + std::to_string(unmet->number + 1) + "." + unmet->key, unmet->need);
  for (const Body& one : bodies)
    p.require(options.is_solid() || one.density == bodies.front().density, "body", "one liquid has one density: all bodies must have the same");
  for (std::size_t i = 0; i < sources.size(); ++i)
    p.require(sources[i].density.value_or(liquid_density(*this)) == liquid_density(*this), "source." + std::to_string(i + 1) + ".density",
              "one liquid has one density: bodies and sources must have the same");
}

}  // namespace sim
