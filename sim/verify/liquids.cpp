// Liquids: dam breaks over every scheme, still water, boxes and pockets without air, few particles, what is too fast.
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim::verify {
namespace {

VerifyCase dam_break(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("dam_break", dimension, scheme);
  c.expect = "energy at most the tolerance of the start's";
  // The column is 16 cells high, in space 8: what it gains while it falls goes as their size does, not as the steps' (tests/fluid_dam_break.cpp).
  const double cell = dimension == 2 ? 0.025 : 0.05;
  c.tolerance = dimension == 3 && scheme.splitting == Splitting::reflection ? 1.015 : 1.005;
  c.source = "docs/fluid.md, rungs";
  c.run = [=] {
    Scene scene = tank(dimension, cell, base::Vec3::Zero(), upright(dimension, 0.4, 0.4));
    apply(scheme, scene.options);
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 24});
    double moved = 0;
    for (const Totals& t : course.totals) moved = std::max(moved, t.kinetic_energy / course.energy(0));
    CaseOutcome found = report(course, course.largest_energy(), say("largest energy %.4f of the start, %.2f of it in motion at most, volume %+.1f %%",
                                                                    course.largest_energy(), moved, 100 * course.end().volume_drift.value_or(0)));
    if (moved < 0.1) found.broken.push_back("it did not break");
    return found;
  };
  return c;
}

/// t = 10 in units in which g H = 1/2 and H = 1/2.
VerifyCase still_water(int dimension, const char* rung, const Scheme& scheme, Seeding seeding) {
  VerifyCase c = liquid_case(std::string("still_water/") + rung + (seeding == Seeding::jitter ? "/jitter" : "/regular"), dimension, scheme);
  const bool jitters = seeding == Seeding::jitter;
  c.expect = jitters ? "root mean square of the speed over the second half, over sqrt(g H); fastest at most .15 of it; volume to 1 %"
      : "fastest particle at the end over sqrt(g H)";
  c.tolerance = jitters ? 1.2e-2 : 1e-6;
  c.source = "case 19";
  c.run = [=] {
    const double depth = 0.25, unit = std::sqrt(kGravity * depth);
    Scene scene = tank(dimension, dimension == 2 ? 0.02 : 0.05, base::Vec3::Zero(), upright(dimension, 1, depth));
    apply(scheme, scene.options);
    scene.options.seeding = seeding;
    if (!jitters) scene.options.pressure_tolerance = 1e-9, scene.options.precision = kDouble;
    add_gravity(scene);
    double squares = 0, fastest = 0;
    int seen = 0;
    const Course course = follow(scene, {.fps = 24, .frames = 54, .see = [&](const Simulation& s) {
      if (s.frame().number <= 28) return;
      const Totals t = s.totals();
      squares += 2 * t.kinetic_energy / t.mass, ++seen;
      fastest = std::max(fastest, t.max_speed);
    }});
    const double rms = std::sqrt(squares / seen) / unit, drift = course.end().volume_drift.value_or(0);
    CaseOutcome found = report(course, jitters ? rms : course.end().max_speed / unit, say("rms %.1e, fastest %.1e, volume %+.2f %%", rms,
                                                                                          fastest / unit, 100 * drift));
    if (fastest / unit > 0.15) found.broken.push_back("a particle is faster than .15");
    if (std::abs(drift) > 0.01) found.broken.push_back("the level moves");
    return found;
  };
  return c;
}

/// Water at rest around a box that no face of the grid is parallel to.
VerifyCase tilted_box(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("still_water/around_a_tilted_box", dimension, scheme);
  c.expect = "fastest particle at the end over sqrt(g H)";
  c.tolerance = 1e-3;
  c.source = "case 19";
  c.run = [=] {
    const double depth = 0.3;
    Scene scene = tank(dimension, 0.025, base::Vec3::Zero(), upright(dimension, 1, depth));
    apply(scheme, scene.options);
    scene.options.pressure_tolerance = 1e-9;
    scene.options.volume_correction = 0;
    scene.options.seeding = Seeding::regular;   // the surface is exact
    Collider box;
    box.name = "box";
    box.shape.box = dimension == 2 ? base::Box{{0.41, 0.09, 0}, {0.63, 0.19, 0}} : base::Box{{0.41, 0.06, 0.09}, {0.63, 0.14, 0.19}};
    box.shape.turn_by(30, dimension == 2 ? base::Vec3(0, 0, 1) : base::Vec3(0.2, 1, 0.1));
    scene.colliders = {box};
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 12});
    const double speed = course.end().max_speed / std::sqrt(kGravity * depth);
    return report(course, speed, say("fastest %.1e sqrt(g H)", speed));
  };
  return c;
}

/// No air anywhere: nothing can move.
VerifyCase full_box(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("full_box", dimension, scheme);
  c.expect = "fastest particle over sqrt(g H); imbalance at most 1e-9 /s";
  c.tolerance = 1e-4;
  c.source = "case 16";
  c.run = [=] {
    Scene scene = tank(dimension, 0.05, base::Vec3::Zero(), upright(dimension, 1, 0.5));
    apply(scheme, scene.options);
    scene.options.volume_correction = 0;
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 24});
    const double speed = course.end().max_speed / std::sqrt(kGravity * 0.5), imbalance = course.end().imbalance.value_or(1);
    CaseOutcome found = report(course, speed, say("fastest %.1e sqrt(g H), imbalance %.1e /s", speed, imbalance));
    if (imbalance > 1e-9) found.broken.push_back("an imbalance where there is none, or no pocket was seen");
    return found;
  };
  return c;
}

enum class Pocket { chamber, two_cells, one_cell };

/// Liquid shut in without air beside a tank in which a dam breaks: a chamber, or a cell or two in a shell of collider.
VerifyCase pocket(int dimension, const Scheme& scheme, Pocket kind) {
  const bool chamber = kind == Pocket::chamber, single = kind == Pocket::one_cell;
  VerifyCase c = liquid_case(chamber ? "full_chamber_beside_a_dam_break" : single ? "pocket_of_one_cell" : "pocket_of_two_cells", dimension, scheme);
  c.expect = single ? "a cell without an open face is solid: what is in it stays (value: particles that got out)"
                    : "what is shut in stays at rest: its fastest particle over sqrt(g H)";
  c.tolerance = single ? 0 : 1e-3;
  c.source = "case 16";
  c.run = [=] {
    const double h = 0.05;
    Scene scene = tank(dimension, h, base::Vec3::Zero(), upright(dimension, 0.3, 0.3));
    apply(scheme, scene.options);
    scene.options.volume_correction = 0;
    add_gravity(scene);
    Body shut = scene.bodies[0];
    shut.name = "shut";
    base::Box inner{{0.7, 0, 0}, {1, 0.2, dimension == 2 ? 0 : 0.2}};
    if (!chamber) inner = {{0.7, dimension == 2 ? 0.2 : 0.1, dimension == 2 ? 0 : 0.2}, {single ? 0.75 : 0.8, dimension == 2 ? 0.25 : 0.15,
                                                                                         dimension == 2 ? 0 : 0.25}};
    shut.shape.box = inner;
    scene.bodies.push_back(shut);
    // Through a thinner wall stencils of both sides meet, and what is on one drags the other along it.
    const double thick = single ? h : 3 * h;
    const int up = dimension - 1;
    base::Box shell{inner.lower - base::Vec3::Constant(thick), inner.upper + base::Vec3::Constant(thick)};
    if (dimension == 2) shell.lower.z() = shell.upper.z() = 0;
    for (int a = 0; a < dimension; ++a)
      for (int side = 0; side < 2; ++side) {
        if (chamber && (a != 0 || side != 0) && (a != up || side != 1)) continue;   // the domain's walls are the others
        base::Box part = shell;
        (side ? part.lower : part.upper)[a] = side ? inner.upper[a] : inner.lower[a];
        scene.colliders.push_back(box_collider("wall " + std::to_string(a) + std::to_string(side), part.lower, part.upper));
      }
    const auto within = [&](const base::Vec3f& x) {
      for (int a = 0; a < dimension; ++a)
        if (double(x[a]) < inner.lower[a] - 1e-3 * h || double(x[a]) > inner.upper[a] + 1e-3 * h) return false;
      return true;
    };
    double fastest = 0;
    std::int64_t start = 0;
    for (const base::Vec3f& x : make_simulation(scene, 24)->frame().position) start += within(x);
    std::int64_t least = start;
    const Course course = follow(scene, {.fps = 24, .frames = 12, .see = [&](const Simulation& s) {
      const Frame f = s.frame();
      std::int64_t there = 0;
      for (std::size_t p = 0; p < f.position.size(); ++p)
        if (within(f.position[p])) ++there, fastest = std::max(fastest, double(f.velocity[p].norm()));
      least = std::min(least, there);
    }});
    const double speed = fastest / std::sqrt(kGravity * 0.3);
    CaseOutcome found = report(course, single ? double(start - least) : speed,
                               say("%lld of %lld particles stay shut in, fastest %.1e sqrt(g H); fastest outside %.2f m/s",
                                   static_cast<long long>(least),
                                                                                 static_cast<long long>(start), speed, course.end().max_speed));
    if (start == 0 || least != start) found.broken.push_back("not all stayed in");
    if (!single && !course.end().imbalance) found.broken.push_back("no pocket was seen");
    if (course.end().max_speed < 0.5) found.broken.push_back("the dam did not break");
    return found;
  };
  return c;
}

/// A piston moves into a full box: no flow can make room, and how much is missing is told.
VerifyCase piston(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("piston_into_a_full_box", dimension, scheme);
  c.expect = "the imbalance told is the piston's sweep over the volume left, to the column of cells it cuts (value: off by); nothing "
             "faster than three times the piston";
  c.tolerance = 0.06;
  c.source = "case 16";
  c.run = [=] {
    const double speed = 0.1;
    Scene scene = tank(dimension, 0.05, base::Vec3::Zero(), upright(dimension, 1, 0.5));
    apply(scheme, scene.options);
    scene.options.volume_correction = 0;
    scene.colliders = {box_collider("piston", dimension == 2 ? base::Vec3(-1, -1, 0) : base::Vec3(-1, -1, -1), dimension == 2 ? base::Vec3(0.1, 2, 0)
                                    : base::Vec3(0.1, 2, 2), {speed, 0, 0})};
    double off = 0, told = 0;
    const Course course = follow(scene, {.fps = 24, .frames = 12, .see = [&](const Simulation& s) {
      const Totals t = s.totals();
      told = t.imbalance.value_or(0);
      const double expected = speed / (0.9 - speed * t.time);
      off = std::max(off, std::abs(told / expected - 1));
    }});
    CaseOutcome found = report(course, off, say("imbalance %.4f /s at the end, off by %.1f %% at most; fastest %.2f m/s", told, 100 * off,
                                                course.end().max_speed));
    found.energy.clear(), found.time.clear();
    if (course.end().max_speed > 3 * speed) found.broken.push_back("something is faster than three times the piston");
    return found;
  };
  return c;
}

/// One particle a cell: gaps everywhere.
VerifyCase few_particles(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("one_particle_a_cell", dimension, scheme);
  c.expect = "three seconds of a dam break with gaps everywhere: energy at most the tolerance of the start's; the volume that is lost "
             "is told, not held";
  c.tolerance = 1.005;
  c.source = "case 6";
  c.run = [=] {
    Scene scene = tank(dimension, dimension == 2 ? 0.02 : 0.04, base::Vec3::Zero(), upright(dimension, 0.4, 0.4));
    if (dimension == 3) scene.options.domain.upper = {1, 0.2, 0.52}, scene.bodies[0].shape.box->upper.z() = 0.4;
    apply(scheme, scene.options);
    scene.options.particles_per_cell = 1;
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 72});
    double drift = 0, height = 0;
    for (std::size_t f = 49; f < course.totals.size(); ++f) drift += course.totals[f].volume_drift.value_or(0) / 24,
        height += course.totals[f].potential_energy / (course.end().mass * kGravity) / 24;
    return report(course, course.largest_energy(),
                  say("largest energy %.4f of the start; volume by the surface %+.0f %%, by the height of the particles %+.0f %%",
                      course.largest_energy(), 100 * drift,
                                                      100 * (height / (0.5 * course.end().volume / (dimension == 2 ? 1 : 0.2)) - 1)));
  };
  return c;
}

/// A block hits a wall with more than a cell a step: the step is cut.
VerifyCase fast(int dimension, const Scheme& scheme, double speed) {
  VerifyCase c = liquid_case(say("fast/%g_m_s", speed), dimension, scheme);
  c.expect = "energy at most the tolerance of the start's, and no step moves a particle farther than cfl, or twice as far by its own pressure";
  c.tolerance = 1.005;
  c.source = "case 8";
  c.run = [=] {
    Scene scene = tank(dimension, 0.05, upright(dimension, 0.1, 0.1) - (dimension == 3 ? base::Vec3(0, 0.2, 0) : base::Vec3::Zero()),
                       upright(dimension, 0.3, 0.3));
    apply(scheme, scene.options);
    scene.bodies[0].velocity = {speed, 0, 0};
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 6});
    CaseOutcome found = report(course, course.largest_energy(), say("%lld steps in 6 frames of %.0f cells, largest energy %.4f of the start",
                                                                    static_cast<long long>(course.sum(&Totals::substeps)), speed / 24 / 0.05,
        course.largest_energy()));
    for (const Totals& t : course.totals)
      if (t.largest_cfl > 2 * scene.options.cfl) found.broken.push_back(say("a step of %.2f cells", t.largest_cfl));
    if (course.sum(&Totals::substeps) < std::int64_t(speed / 24 / 0.05)) found.broken.push_back("steps longer than cfl allows");
    return found;
  };
  return c;
}

/// Particles on top of each other with opposite velocities.
VerifyCase coincident(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("coincident/liquid", dimension, scheme);
  c.expect = "energy at most the tolerance of the start's";
  c.tolerance = 1 + 1e-6;
  c.source = "case 5";
  c.run = [=] {
    Scene scene = tank(dimension, 0.05, dimension == 2 ? base::Vec3(0.3, 0.2, 0) : base::Vec3(0.3, 0.05, 0.2), dimension == 2
                       ? base::Vec3(0.4, 0.3, 0) : base::Vec3(0.4, 0.15, 0.3));
    apply(scheme, scene.options);
    const Course course = follow(scene, {.fps = 24, .frames = 6, .prepare = [&](State& s) {
      edit<std::int32_t>(s, "cell", [&](std::int64_t, std::int32_t* x) { x[0] = 8, x[1] = dimension == 2 ? 5 : 2; if (dimension == 3) x[2] = 5; });
      edit_reals(s, "offset", scheme.precision, [&](std::int64_t, double* x) { for (int a = 0; a < dimension; ++a) x[a] = 0.5; });
      edit_reals(s, "coefficients", scheme.precision, [&](std::int64_t row, double* v) { v[1] = row % 2 ? 3 : -3; });
    }});
    return report(course, course.largest_energy(), say("%lld particles at one place: energy %.2e of the start at the end",
                                                       static_cast<long long>(course.start().particles),
        course.energy(course.totals.size() - 1) / course.energy(0)));
  };
  return c;
}

/// What no step can resolve ends with its cause, not in a loop: 0 where it did, 1 where it went on.
VerifyCase collapse(const std::string& name, const std::string& cause, const std::function<Scene()>& scene, bool is_solid) {
  VerifyCase c;
  c.name = "step_collapses/" + name;
  c.dimension = 2;
  c.transfer = "apic", c.kernel = is_solid ? "quadratic" : "linear", c.integrator = is_solid ? "explicit" : "lie";
  c.expect = "an expected failure: it stops with exit 3 and names the cause, " + cause;
  c.tolerance = 0;
  c.source = "case 20";
  c.run = [=] {
    Watch simulation(scene(), 24);
    base::Ledger ledger;
    CaseOutcome found;
    found.value = 1, found.outcome = "went on";
    try {
      simulation.advance(ledger, {});
    } catch (const base::Error& e) {
      found.outcome = e.what();
      found.value = e.complaint().code == base::Exit::unstable && e.complaint().message.find(cause) != std::string::npos ? 0 : 1;
    }
    return found;
  };
  return c;
}

}  // namespace

void add_liquid_cases(std::vector<VerifyCase>& all) {
  using enum Transfer;
  constexpr auto kLinear = Kernel::linear, kQuadratic = Kernel::quadratic;
  constexpr auto kFixed = Carry::fixed, kHybrid = Carry::hybrid, kLimited = Carry::limited;
  constexpr auto kLie = Splitting::lie, kReflection = Splitting::reflection;
  // Every pair of transfer with kernel, precision and splitting is here, in two dimensions or three.
  all.push_back(dam_break(2, {pic, 0, kLinear, kFixed, kSingle, kReflection}));
  all.push_back(dam_break(2, {flip, 0, kQuadratic, kFixed, kDouble, kReflection}));
  all.push_back(dam_break(2, {apic, 0, kLinear, kFixed, kDouble, kReflection}));
  all.push_back(dam_break(2, {polypic, 4, kQuadratic, kFixed, kSingle, kLie}));
  all.push_back(dam_break(2, {polypic, 0, kLinear, kFixed, kSingle, kReflection}));
  all.push_back(dam_break(2, {polypic, 6, kQuadratic, kHybrid, kSingle, kLie}));
  all.push_back(dam_break(2, {polypic, 0, kQuadratic, kHybrid, kDouble, kReflection}));
  all.push_back(dam_break(2, {polypic, 0, kQuadratic, kFixed, kSingle, kLie}));
  all.push_back(dam_break(3, {pic, 0, kQuadratic, kFixed, kDouble, kLie}));
  all.push_back(dam_break(3, {flip, 0, kLinear, kFixed, kSingle, kLie}));
  all.push_back(dam_break(3, {apic, 0, kQuadratic, kFixed, kSingle, kLie}));
  all.push_back(dam_break(3, {polypic, 4, kLinear, kFixed, kDouble, kLie}));
  all.push_back(dam_break(3, {polypic, 4, kQuadratic, kFixed, kSingle, kReflection}));
  all.push_back(dam_break(3, {polypic, 8, kLinear, kFixed, kDouble, kLie}));
  all.push_back(dam_break(3, {polypic, 8, kQuadratic, kFixed, kSingle, kReflection}));
  all.push_back(dam_break(3, {polypic, 0, kQuadratic, kHybrid, kSingle, kReflection}));
  all.push_back(dam_break(3, {polypic, 0, kQuadratic, kLimited, kDouble, kLie}));

  const std::pair<const char*, Scheme> rungs[] = {{"draft", kDraft}, {"normal", kNormal}, {"high", kHigh}, {"extreme", kExtreme}};
  for (const auto& [name, scheme] : rungs)
    for (const Seeding seeding : {Seeding::regular, Seeding::jitter}) {
      Scheme own = scheme;
      if (seeding == Seeding::regular) own.precision = kDouble;
      all.push_back(still_water(2, name, own, seeding));
    }
  all.push_back(still_water(3, "normal", kNormal, Seeding::jitter));
  Scheme exact_extreme = kExtreme;
  exact_extreme.precision = kDouble;
  all.push_back(still_water(3, "extreme", exact_extreme, Seeding::regular));

  all.push_back(tilted_box(2, kNormal));
  all.push_back(tilted_box(3, kNormal));

  all.push_back(full_box(2, kNormal));
  all.push_back(full_box(2, kExtreme));
  all.push_back(full_box(3, kHigh));
  all.push_back(full_box(3, {flip, 0, kQuadratic, kFixed, kDouble, kLie}));
  all.push_back(pocket(2, kNormal, Pocket::chamber));
  all.push_back(pocket(3, kExtreme, Pocket::chamber));
  all.push_back(pocket(2, kExtreme, Pocket::two_cells));
  all.push_back(pocket(3, kNormal, Pocket::two_cells));
  all.push_back(pocket(2, kNormal, Pocket::one_cell));
  all.push_back(pocket(3, kHigh, Pocket::one_cell));
  all.push_back(piston(2, kNormal));
  all.push_back(piston(3, {apic, 0, kQuadratic, kFixed, kDouble, kLie}));
  all.push_back(few_particles(2, kNormal));
  all.push_back(few_particles(2, kExtreme));
  all.push_back(few_particles(3, kHigh));
  all.push_back(fast(2, kNormal, 100));
  all.push_back(fast(3, kExtreme, 50));
  all.push_back(coincident(2, kNormal));
  all.push_back(coincident(3, {apic, 0, kQuadratic, kFixed, kDouble, kReflection}));

  all.push_back(collapse("stiff_solid", "sound", [] {
    Scene scene = open_scene(2, 1, 0.05);
    scene.options.transfer = Transfer::apic;
    scene.bodies = {ball({0.5, 0.5, 0}, 0.2, {.model = Elasticity::neo_hookean, .density = 1000, .young = 1e20, .poisson = 0.3})};
    return scene;
  }, true));
  all.push_back(collapse("fast_solid", "motion", [] {
    Scene scene = open_scene(2, 1, 0.05);
    scene.options.transfer = Transfer::apic;
    scene.bodies = {ball({0.5, 0.5, 0}, 0.2, {.model = Elasticity::neo_hookean, .density = 1000, .young = 1e4, .poisson = 0.3})};
    scene.bodies[0].velocity = {1e9, 0, 0};
    return scene;
  }, true));
  all.push_back(collapse("fast_liquid", "motion", [] {
    Scene scene = tank(2, 0.05, base::Vec3::Zero(), {0.3, 0.3, 0});
    scene.options.transfer = Transfer::apic;
    scene.options.boundary[0] = {Side::periodic, Side::periodic};
    scene.bodies[0].velocity = {1e7, 0, 0};
    return scene;
  }, false));
}

}  // namespace sim::verify
