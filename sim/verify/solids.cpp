// Solids that are crushed, turned inside out, thrown at each other faster than sound, and moved far.
#include <algorithm>
#include <cmath>

#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim::verify {
namespace {

const Material kJelly{.model = Elasticity::neo_hookean, .density = 1000, .young = 1e5, .poisson = 0.3};

const char* name_of(Elasticity law) {
  return law == Elasticity::fixed_corotated ? "fixed_corotated" : law == Elasticity::neo_hookean ? "neo_hookean" : "hencky";
}

base::Vec3 corner(int dimension, double x, double y) { return {x, y, dimension == 3 ? y : 0}; }

/// A block all of whose particles start with one F; `diagonal` is of F, in the first axes.
Scene deformed_block(int dimension, const Scheme& scheme, Elasticity law) {
  Scene scene = open_scene(dimension, 1, 0.1);
  apply(scheme, scene.options);
  Material material = kJelly;
  material.model = law;
  scene.bodies = {block(corner(dimension, 0.3, 0.3), corner(dimension, 0.6, 0.6), material)};
  return scene;
}

std::function<void(State&)> start_with(int dimension, Precision precision, const std::vector<double>& diagonal) {
  return [=](State& s) {
    edit<double>(s, "limits", [](std::int64_t row, double* v) { if (row == 0) *v = 200; });   // a short first step, until sound is that of this state
    edit_reals(s, "deformation", precision, [&](std::int64_t, double* f) {
      for (int a = 0; a < dimension; ++a) f[a * (dimension + 1)] = diagonal[std::size_t(a)] - 1;
    });
  };
}

double elastic(const Totals& t) { return t.elastic_energy.value_or(0); }

/// F of every particle flat, a line, a point or inside out. What is flat stays so, for F <- (I + dt grad v) F; nothing else may come of it, but that it stops
/// and says so.
VerifyCase degenerate(const std::string& kind, int dimension, const Scheme& scheme, Elasticity law, const std::vector<double>& diagonal) {
  VerifyCase c = solid_case("degenerate/" + kind + "/" + name_of(law), dimension, scheme);
  c.expect = "no number that is none; energy at most the tolerance of the start's; it may stop and say that every particle is pressed to nothing, or asks for steps that are too short";
  c.tolerance = 1.02;
  c.source = "case 9";
  c.run = [=] {
    Course course = follow(deformed_block(dimension, scheme, law), {.fps = 100, .frames = 10,
                                                                    .prepare = start_with(dimension, scheme.precision, diagonal)});
    for (const char* why : {": volume: every particle is pressed", ": step: sound in what is loose"})   // as it may
      if (course.stopped.find(why) != std::string::npos) course.stopped.clear();
    return report(course, course.largest_energy(), say("largest energy %.4f of the start, elastic energy %.3g of it at the end",
                                                       course.largest_energy(), elastic(course.end()) / course.energy(0)));
  };
  return c;
}

/// Crushed to a part of its height and let go: it comes back and goes beyond.
VerifyCase crushed(int dimension, const Scheme& scheme, Elasticity law, double to) {
  VerifyCase c = solid_case(std::string("crushed/") + name_of(law), dimension, scheme);
  c.expect = "a block crushed along one axis springs back: it gets at least 1.2 times as wide as it was let go (value: 1.2 over the widest)";
  c.tolerance = 1;
  c.source = "case 9";
  c.run = [=] {
    std::vector<double> diagonal(3, 1.0);
    diagonal[0] = to;
    double start = 0, widest = 0;
    const auto width = [](const Simulation& simulation) {
      float low = 1e9f, high = -1e9f;
      for (const auto& x : simulation.frame().position) low = std::min(low, x.x()), high = std::max(high, x.x());
      return double(high - low);
    };
    start = width(*make_simulation(deformed_block(dimension, scheme, law), 100));
    const Course course = follow(deformed_block(dimension, scheme, law), {.fps = 100, .frames = 10,
                                                                          .prepare = start_with(dimension, scheme.precision, diagonal),
                                                                          .see = [&](const Simulation& s) { widest = std::max(widest, width(s)); }});
    CaseOutcome found = report(course, 1.2 * start / widest, say("widest %.2f of the width it was let go at, largest energy %.4f of the start",
                                                                 widest / start, course.largest_energy()));
    if (course.largest_energy() > 1.02) found.broken.push_back("it gained energy");
    return found;
  };
  return c;
}

/// Two blocks that meet at several times the speed of sound in them.
VerifyCase impact(int dimension, const Scheme& scheme) {
  VerifyCase c = solid_case("impact_above_sound", dimension, scheme);
  c.expect = "steps get shorter, and energy is at most the tolerance of the start's";
  c.tolerance = 1.02;
  c.source = "case 11";
  c.run = [=] {
    Scene scene = open_scene(dimension, 2, dimension == 2 ? 0.05 : 0.1);
    apply(scheme, scene.options);
    Material material = kJelly;
    material.young = 1e3;   // sound at 1.2 m/s
    scene.bodies = {block(corner(dimension, 0.4, 0.8), corner(dimension, 0.8, 1.2), material),
                    block(corner(dimension, 1.0, 0.8), corner(dimension, 1.4, 1.2), material)};
    scene.bodies[0].velocity = {3, 0, 0}, scene.bodies[1].velocity = {-3, 0, 0};
    scene.bodies[1].name = "other";
    const Course course = follow(scene, {.fps = 50, .frames = 12});
    const std::int64_t shortened = course.sum(&Totals::steps_by_motion) + course.sum(&Totals::steps_by_loose);
    CaseOutcome found = report(course, course.largest_energy(), say("largest energy %.4f of the start, %lld steps not by sound at rest",
                                                                    course.largest_energy(), static_cast<long long>(shortened)));
    if (shortened == 0) found.broken.push_back("no step was cut");
    if (course.end().kinetic_energy > 0.9 * course.start().kinetic_energy) found.broken.push_back("they did not meet");
    if (!(course.end().most_volume.value_or(0) > 0.5)) found.broken.push_back("they stay pressed to nothing");
    return found;
  };
  return c;
}

/// Moved a thousand cells without a force. Stress s stores s^2 / 2E. Across the motion a row of particles lies a millionth of a cell from where its
/// stencil changes, so that the body drags a row of nodes of 5e-13 of a particle along: they move as it does, or they shear it.
VerifyCase translation(int dimension, const Scheme& scheme) {
  VerifyCase c = solid_case("translation_1000_cells", dimension, scheme);
  const bool exact = scheme.precision == kDouble;
  c.expect = "stress over Young's modulus no more than the tolerance";
  c.tolerance = exact ? 1e-12 : 2e-4;
  c.source = exact ? "case 15" : "case 15, in single precision by its rounding: 2500 steps of 6e-8";
  c.run = [=] {
    Scene scene = open_scene(dimension, 1, 0.05);
    scene.options.domain.upper.x() = 64;
    apply(scheme, scene.options);
    scene.bodies = {block(corner(dimension, 0.4, 0.3), corner(dimension, 0.6, 0.5), kJelly)};
    scene.bodies[0].velocity = {50, 0, 0};
    const Course course = follow(scene, {.fps = 4, .frames = 4, .prepare = [&](State& s) {
      edit_reals(s, "offset", scheme.precision, [&](std::int64_t, double* x) {
        for (int a = 1; a < dimension; ++a)
          if (x[a] > 0.5) x[a] = 0.5 + 1e-6;
      });
    }});
    const double stress = std::sqrt(2 * elastic(course.end()) / course.end().volume / kJelly.young);
    CaseOutcome found = report(course, stress, say("stress %.1e E after %lld steps", stress, static_cast<long long>(course.sum(&Totals::substeps))));
    for (const Totals& t : course.totals)
      if (t.largest_cfl > scene.options.cfl * (1 + 1e-5)) found.broken.push_back(say("a step of %.2f cells", t.largest_cfl));
    if (course.sum(&Totals::substeps) < 2000) found.broken.push_back("fewer steps than cells ask for");
    return found;
  };
  return c;
}

/// Two particles at one place with opposite velocities: the grid sees nothing move.
VerifyCase coincident(int dimension, const Scheme& scheme) {
  VerifyCase c = solid_case("coincident/solid", dimension, scheme);
  c.expect = "energy at most that of the start, momentum stays 0";
  c.tolerance = 1 + 1e-9;
  c.source = "case 5";
  c.run = [=] {
    Scene scene = open_scene(dimension, 1, 0.1);
    apply(scheme, scene.options);
    scene.options.seeding = Seeding::regular;
    scene.bodies = {block(corner(dimension, 0.3, 0.3), corner(dimension, 0.5, 0.5), kJelly)};
    const Course course = follow(scene, {.fps = 50, .frames = 10, .prepare = [&](State& s) {
      edit<std::int32_t>(s, "cell", [&](std::int64_t, std::int32_t* x) { for (int a = 0; a < dimension; ++a) x[a] = 4; });
      edit_reals(s, "offset", scheme.precision, [&](std::int64_t, double* x) { for (int a = 0; a < dimension; ++a) x[a] = 0.5; });
      edit_reals(s, "coefficients", scheme.precision, [&](std::int64_t row, double* v) { v[1] = row % 2 ? 3 : -3; });
    }});
    CaseOutcome found = report(course, course.largest_energy(), say("%lld particles at one place: energy %.2e of the start at the end",
                                                                    static_cast<long long>(course.start().particles),
        course.energy(course.totals.size() - 1) / course.energy(0)));
    if (course.end().linear_momentum.norm() > 1e-9 * course.start().mass * 3) found.broken.push_back("momentum came of nothing");
    return found;
  };
  return c;
}

/// Snow that was packed to `packed` of its volume hits a wall: exp(50 (1 - 0.3)) is 1.6e15, and with a modulus like that no step is short enough.
VerifyCase hardening(int dimension, const Scheme& scheme, double packed) {
  VerifyCase c = solid_case(packed < 1 ? "snow_hardening/packed" : "snow_hardening/loose", dimension, scheme);
  c.expect = "hardening stops at its cap, and is counted (value: 1 where nothing was held); energy at most 1.15 of the start's";
  c.tolerance = 0;
  c.source = "case 13; Stomakhin13 eq 9, whose box of stretches may store an eighth more";
  c.run = [=] {
    Scene scene = walled_scene(dimension, 1, 0.05);
    if (dimension == 3) scene.options.cell = 0.1;
    apply(scheme, scene.options);
    Material snow = preset_material("snow");
    snow.hardening = 50;
    scene.bodies = {block(corner(dimension, 0.1, 0.35), corner(dimension, 0.4, 0.65), snow)};
    scene.bodies[0].velocity = {-20, 0, 0};
    const Course course = follow(scene, {.fps = 200, .frames = 10, .prepare = [&](State& s) {
      if (packed == 1) return;
      // a short first step, until sound is that of this state
      edit<double>(s, "limits", [](std::int64_t row, double* v) { if (row == 0) *v *= 5; });
      edit_reals(s, "deformation", scheme.precision, [&](std::int64_t, double* f) { f[dimension * dimension] = packed - 1; });
    }});
    const std::int64_t held = course.sum(&Totals::held_strains);
    CaseOutcome found = report(course, held > 0 ? 0 : 1, say("%lld particle steps at the cap, largest energy %.4f of the start",
                                                             static_cast<long long>(held), course.largest_energy()));
    if (course.largest_energy() > 1.15) found.broken.push_back("it gained energy");
    return found;
  };
  return c;
}

/// A beam four cells thick and sixteen long sticks to a wall, and is let go under its weight: its tip swings to twice where it would come to
/// rest, which is q L^4 / (8 E' I) for bending and q L^2 / (2 k G A) for shear [Timoshenko21].
VerifyCase beam(int dimension, const Scheme& scheme, double poisson) {
  VerifyCase c = solid_case(say("beam/poisson_%g", poisson), dimension, scheme);
  c.expect = "half of where the tip swings to, off from the deflection of a Timoshenko beam";
  c.tolerance = 0.05;
  c.source = "case 10";
  c.run = [=] {
    const double h = 0.05, length = 0.8, thick = 0.2, g = 9.81;
    Scene scene = walled_scene(dimension, 1, h);
    apply(scheme, scene.options);
    scene.options.boundary[0][0] = Side::sticky;
    scene.options.seeding = Seeding::regular;
    scene.options.domain.upper = dimension == 2 ? base::Vec3(1, 0.6, 0) : base::Vec3(1, 0.6, 0.6);
    Material rubber = kJelly;
    rubber.young = 7e6, rubber.poisson = poisson, rubber.volume_averaging = true;
    scene.bodies = {block(corner(dimension, 0, 0.2), corner(dimension, length, 0.2 + thick), rubber)};
    add_gravity(scene, g);
    const int up = dimension - 1;
    const Frame rest = make_simulation(scene, 24)->frame();
    const auto tip = [&](const Frame& f) {   // how far the last cell's particles have come down
      double sum = 0;
      int count = 0;
      for (std::size_t p = 0; p < f.position.size(); ++p)
        if (rest.position[p].x() > length - h) sum += double(rest.position[p][up]) - double(f.position[p][up]), ++count;
      return sum / count;
    };
    double farthest = 0;
    const auto see = [&](const Simulation& s) { farthest = std::max(farthest, tip(s.frame())); };
    const Course course = follow(scene, {.fps = 500, .frames = 60, .see = see});
    // a plane is a slab that cannot widen
    const double young = dimension == 2 ? rubber.young / (1 - poisson * poisson) : rubber.young, shear = rubber.young / (2 * (1 + poisson));
    const double weight = rubber.density * g, at = length - h / 2, slender = length / thick;
    const double bends = 1.5 * weight * slender * slender / young, shears = weight / (2 * shear * 10 * (1 + poisson) / (12 + 11 * poisson));
    // of the tip's bending, where it is looked at
    const double share = at / length, shape = (share * share * share * share - 4 * share * share * share + 6 * share * share) / 3;
    const double expected = bends * length * length * shape + shears * length * length * (2 * share - share * share);
    return report(course, std::abs(farthest / 2 / expected - 1), say("tip at %.4f of the deflection that a beam has, after %lld steps",
                                                                     farthest / 2 / expected, static_cast<long long>(course.sum(&Totals::substeps))));
  };
  return c;
}

/// A soft ball on a block a million times as stiff.
VerifyCase stiffness_ratio(int dimension, const Scheme& scheme, Contact contact) {
  VerifyCase c = solid_case(contact == Contact::sticky ? "stiffness_ratio_1e6" : "stiffness_ratio_1e6/separating", dimension, scheme);
  c.expect = "the ball bounces: energy at most the tolerance of the start's, momentum to rounding";
  c.tolerance = 1.02;
  c.source = "case 10";
  c.run = [=] {
    Scene scene = open_scene(dimension, 1, 0.05);
    if (dimension == 3) scene.options.cell = 0.1;
    apply(scheme, scene.options);
    Material gel = kJelly, rock = kJelly;
    gel.young = 1e3, rock.young = 1e9;
    scene.bodies = {ball(corner(dimension, 0.35, 0.5), 0.12, gel), block(corner(dimension, 0.6, 0.4), corner(dimension, 0.7, 0.6), rock)};
    scene.bodies[0].velocity = {1, 0, 0};
    scene.bodies[0].contact = contact;
    const Course course = follow(scene, {.fps = 50, .frames = 12});
    const double off = (course.end().linear_momentum - course.start().linear_momentum).norm() / course.start().linear_momentum.norm();
    const auto steps = static_cast<long long>(course.sum(&Totals::substeps));
    CaseOutcome found = report(course, course.largest_energy(), say("largest energy %.4f of the start, momentum off by %.1e, %lld steps",
                                                                    course.largest_energy(), off, steps));
    if (off > (scheme.precision == kDouble ? 1e-10 : 1e-4)) found.broken.push_back("momentum drifts");
    if (course.end().kinetic_energy > 0.95 * course.start().kinetic_energy) found.broken.push_back("they did not meet");
    return found;
  };
  return c;
}

/// Particles that have twice as many of other bodies within a reach [m] as of their own.
std::size_t count_inside_others(const Frame& f, double reach) {
  std::size_t inside = 0;
  for (std::size_t p = 0; p < f.id.size(); ++p) {
    int own = 0, others = 0;
    for (std::size_t q = 0; q < f.id.size(); ++q)
      if (q != p && (f.position[p] - f.position[q]).squaredNorm() < float(reach * reach)) ++(f.body[p] == f.body[q] ? own : others);
    inside += others > 2 * own;
  }
  return inside;
}

/// Balls as light as cork and as heavy as steel fall on each other and part.
VerifyCase balls_on_balls(int dimension, const Scheme& scheme) {
  VerifyCase c = solid_case("balls_on_balls", dimension, scheme);
  c.expect = "energy at most the tolerance of the start's, and not one particle in 500 has twice as many of others' around it as of its own body's";
  c.tolerance = 1.01;
  c.source = "case 10; Bardenhagen00";
  c.is_quick = dimension == 2;
  c.run = [=] {
    constexpr int kBalls = 8;
    const double edge = 0.4, cell = dimension == 2 ? 0.0125 : 0.025;
    Scene scene = walled_scene(dimension, edge, cell);
    apply(scheme, scene.options);
    scene.options.domain.upper[dimension - 1] = 0.8;
    for (int b = 0; b < kBalls; ++b) {   // in turns to the left, to the right and, in space, to the front and back
      Material rubber = kJelly;
      rubber.young = 1e5, rubber.density = b % 3 == 0 ? 8000 : b % 3 == 1 ? 1000 : 200;
      base::Vec3 at = corner(dimension, b % 2 ? 0.27 : 0.13, 0);
      if (dimension == 3) at.y() = b / 2 % 2 ? 0.26 : 0.14;
      at[dimension - 1] = 0.08 + 0.09 * b;
      scene.bodies.push_back(ball(at, 0.062, rubber));
      scene.bodies.back().contact = Contact::separating, scene.bodies.back().friction = b % 2 ? 0.6 : 0.2;
    }
    add_gravity(scene);
    std::size_t most_inside = 0;
    const auto see = [&](const Simulation& s) { most_inside = std::max(most_inside, count_inside_others(s.frame(), 0.75 * cell)); };
    const Course course = follow(scene, {.fps = 24, .frames = 24, .see = see});
    CaseOutcome found = report(course, course.largest_energy(), say("largest energy %.4f of the start, at its end %.2f; %zu of %lld particles were inside others at once",
                                                                    course.largest_energy(), course.energy(course.totals.size() - 1) / course.energy(0), most_inside,
                                                                    static_cast<long long>(course.end().particles)));
    if (500 * std::int64_t(most_inside) > course.end().particles) found.broken.push_back("they went into each other");
    return found;
  };
  return c;
}

/// Volumes of the particles' cells near the middle of a settled heap would need its surface; its height does: sand as wide as its box.
VerifyCase shaken_sand(int dimension, const Scheme& scheme) {
  VerifyCase c = solid_case("shaken_sand", dimension, scheme);
  c.expect = "sand that flies apart and falls back fills at most the tolerance of its volume";
  c.tolerance = 1.03;
  c.source = "case 12; Tampubolon17";
  c.run = [=] {
    Scene scene = walled_scene(dimension, 0.4, dimension == 2 ? 0.02 : 0.04);
    apply(scheme, scene.options);
    for (int a = 0; a < dimension - 1; ++a) scene.options.boundary[std::size_t(a)] = {Side::slip, Side::slip};
    scene.options.domain.upper = dimension == 2 ? base::Vec3(0.2, 0.8, 0) : base::Vec3(0.2, 0.2, 0.8);
    scene.bodies = {block({0, 0, 0}, dimension == 2 ? base::Vec3(0.2, 0.2, 0) : base::Vec3(0.2, 0.2, 0.2), preset_material("dry_sand"))};
    add_gravity(scene);
    const int up = dimension - 1;
    const std::vector<double> heights = [&] {
      std::vector<double> y;
      for (const auto& x : make_simulation(scene, 24)->frame().position) y.push_back(x[up]);
      return y;
    }();
    double mean_then = 0, mean_most = 0;
    for (const double y : heights) mean_then += y / double(heights.size());
    const auto mean_height = [&](const Simulation& s) {
      double mean = 0;
      const Frame f = s.frame();
      for (const auto& x : f.position) mean += double(x[up]) / double(f.position.size());
      return mean;
    };
    const Course course = follow(scene, {.fps = 24, .frames = 36, .prepare = [&](State& s) {
      edit_reals(s, "coefficients", scheme.precision, [&](std::int64_t row, double* v) {   // upwards, the higher the faster
        v[up] = 6 * heights[std::size_t(row)];
      });
    }, .see = [&](const Simulation& s) { mean_most = std::max(mean_most, mean_height(s)); }});
    const double bulk = mean_height(*course.simulation) / mean_then;
    CaseOutcome found = report(course, bulk, say("its middle %.3f as high as at first, %.2f in between", bulk, mean_most / mean_then));
    if (!(bulk > 0.97)) found.broken.push_back("it lost volume");
    if (mean_most < 1.15 * mean_then) found.broken.push_back("it did not fly");
    return found;
  };
  return c;
}

}  // namespace

void add_solid_cases(std::vector<VerifyCase>& all) {
  using enum Transfer;
  using enum Elasticity;
  constexpr Kernel kQuadratic = Kernel::quadratic;
  const Scheme exact{apic}, rough{apic, 0, kQuadratic, Carry::fixed, kSingle}, full{polypic, 0, kQuadratic, Carry::hybrid},
      rough_full{polypic, 0, kQuadratic, Carry::hybrid, kSingle},
      rough_limited{polypic, 0, kQuadratic, Carry::limited, kSingle};
  all.push_back(degenerate("zero", 3, rough, fixed_corotated, {0, 0, 0}));
  all.push_back(degenerate("zero", 2, full, hencky, {0, 0}));
  all.push_back(degenerate("rank1", 2, rough_full, neo_hookean, {1, 0}));
  all.push_back(degenerate("rank1", 3, exact, fixed_corotated, {1, 0, 0}));
  all.push_back(degenerate("rank2", 3, rough_limited, hencky, {0.9, 0.9, 0}));
  all.push_back(degenerate("inside_out", 2, rough, fixed_corotated, {-0.8, 0.9}));
  all.push_back(degenerate("inside_out", 3, full, neo_hookean, {-0.8, 0.9, 1}));
  all.push_back(degenerate("equal_stretches", 3, rough_full, hencky, {0.8, 0.8, 0.8}));
  all.push_back(crushed(3, rough, fixed_corotated, 0.3));
  all.push_back(crushed(2, full, neo_hookean, 0.3));
  all.push_back(crushed(3, rough_full, hencky, 0.6));
  all.push_back(impact(2, full));
  all.push_back(impact(2, rough));
  all.push_back(impact(3, rough_full));
  all.push_back(translation(2, exact));
  all.push_back(translation(2, full));
  all.push_back(translation(2, rough_limited));
  all.push_back(translation(3, full));
  all.push_back(coincident(2, exact));
  all.push_back(coincident(3, full));
  all.push_back(hardening(2, exact, 1));
  all.push_back(hardening(2, rough, 0.3));
  all.push_back(hardening(3, rough_full, 1));
  all.push_back(hardening(3, full, 0.3));
  all.push_back(beam(2, full, 0.499));
  all.push_back(beam(3, rough_full, 0.499));
  all.push_back(stiffness_ratio(2, full, Contact::sticky));
  all.push_back(stiffness_ratio(3, rough, Contact::sticky));
  all.push_back(stiffness_ratio(2, full, Contact::separating));
  all.push_back(stiffness_ratio(3, rough, Contact::separating));
  all.push_back(balls_on_balls(2, full));
  all.push_back(balls_on_balls(3, rough_full));
  all.push_back(shaken_sand(2, exact));
  all.push_back(shaken_sand(3, rough_full));
}

}  // namespace sim::verify
