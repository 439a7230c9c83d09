// Liquid that comes and goes: taps, a funnel, blocks that fall into a pool, a scene that runs empty.
#include <algorithm>
#include <cmath>

#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim::verify {
namespace {

/// A tap pours for twelve seconds, until the pool is more than six times as deep, and stops; then it settles.
VerifyCase long_pour(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("long_pour", dimension, scheme);
  c.expect = "the births are the flow through the tap, to a layer of cells; volume by the surface within the tolerance, over the last second of fifteen";
  c.tolerance = 0.02;
  c.source = "case 6";
  c.run = [=] {
    const double cell = dimension == 2 ? 0.02 : 0.04, speed = dimension == 2 ? 0.5 : 0.6, end = 12;
    Scene scene = tank(dimension, cell, base::Vec3::Zero(), upright(dimension, 1, 0.12));
    scene.options.domain.upper = dimension == 2 ? base::Vec3(1, 1.2, 0) : base::Vec3(1, 0.2, 1.2);
    apply(scheme, scene.options);
    Source tap;
    tap.name = "tap";
    tap.shape.box = dimension == 2 ? base::Box{{0.3, 1.04, 0}, {0.4, 1.12, 0}} : base::Box{{0.28, 0.04, 1.04}, {0.4, 0.16, 1.12}};
    tap.velocity = dimension == 2 ? base::Vec3(0.4 * speed, -speed, 0) : base::Vec3(0.4 * speed, 0, -speed), tap.end = end;
    scene.sources = {tap};
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 360, .most_energy = 1e3});   // what is poured has some
    double drift = 0, poured = 0;
    for (const Totals& t : course.totals) poured += double(t.poured);
    for (std::size_t f = course.totals.size() - 24; f < course.totals.size(); ++f) drift += course.totals[f].volume_drift.value_or(0) / 24;
    const base::Vec3 size = tap.shape.box->size() / cell;   // [cells]
    const double sides = dimension == 2 ? size.x() + 0.4 * size.y() : size.x() * size.y() + 0.4 * size.y() * size.z();
    const double flow = end * speed / cell * sides, cells = poured / double(scene.options.particles_per_cell);
    CaseOutcome found = report(course, std::abs(drift), say("%.1f cells poured, %.1f by the flow; volume %+.2f %%", cells, flow, 100 * drift));
    found.energy.clear(), found.time.clear();
    if (std::abs(cells - flow) > sides) found.broken.push_back("what was poured is not the flow");
    return found;
  };
  return c;
}

/// A tap pours into a funnel whose neck is four cells wide: what comes along the cone is pushed together where slivers of faces lead on.
VerifyCase funnel(const Scheme& scheme) {
  VerifyCase c = liquid_case("funnel", 3, scheme);
  c.expect = "what a thousandth of the particles is faster than, over the speed of a fall from the tap to the floor; never more energy than was given; volume to 5 %";
  c.tolerance = 1.1;
  c.source = "case 17";
  c.run = [=] {
    const double cell = 0.02, edge = 0.8, tap_top = 0.74, speed = 1.2;
    Scene scene;
    scene.options.domain = {base::Vec3::Zero(), base::Vec3::Constant(edge)};
    scene.options.cell = cell;
    apply(scheme, scene.options);
    Source tap;
    tap.name = "tap";
    tap.shape.box = base::Box{{0.34, 0.34, 0.7}, {0.46, 0.46, tap_top}};
    tap.velocity = {0, 0, -speed};
    scene.sources = {tap};
    scene.colliders = {turned_collider("funnel", {{0.04, 0}, {0.07, 0}, {0.07, 0.1}, {0.23, 0.3}, {0.2, 0.3}, {0.04, 0.1}}, {0.4, 0.4, 0.2})};
    measure_meshes(scene);
    add_gravity(scene);
    double fastest = 0, through = 0;
    const Course course = follow(scene, {.fps = 24, .frames = 16, .see = [&](const Simulation& s) {
      const Frame frame = s.frame();
      std::vector<double> speeds;   // a drop of a splash may be faster
      for (const base::Vec3f& v : frame.velocity) speeds.push_back(double(v.norm()));
      const auto nearly_all = speeds.begin() + std::ptrdiff_t(0.999 * double(speeds.size()));
      std::nth_element(speeds.begin(), nearly_all, speeds.end());
      fastest = std::max(fastest, *nearly_all / std::sqrt(speed * speed + 2 * kGravity * tap_top));
      for (const base::Vec3f& x : frame.position) through += x.z() < 0.2f;
    }, .most_energy = 1e3});
    double given = course.energy(0), most = 0;
    for (std::size_t f = 1; f < course.totals.size(); ++f) {
      given += course.totals[f].poured_energy;
      most = std::max(most, course.energy(f) / given);
    }
    CaseOutcome found = report(course, fastest, say("nearly all slower than %.3f of the fall, energy at most %.3f of what was given, volume %+.1f %%", fastest, most,
                                                       100 * course.end().volume_drift.value_or(0)));
    found.energy.clear(), found.time.clear();
    if (most > 1) found.broken.push_back("energy was gained");
    if (std::abs(course.end().volume_drift.value_or(0)) > 0.05) found.broken.push_back("its volume changed");
    if (through == 0) found.broken.push_back("nothing came through");
    return found;
  };
  return c;
}

/// Blocks of water fall one after the other into a pool.
VerifyCase falling_blocks(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("blocks_fall_into_a_pool", dimension, scheme);
  c.expect = "volume by the surface within the tolerance, over the last second of six";
  c.tolerance = 0.02;
  c.source = "case 6";
  c.is_quick = dimension == 2;
  c.run = [=] {
    Scene scene = tank(dimension, dimension == 2 ? 0.02 : 0.04, base::Vec3::Zero(), upright(dimension, 1, 0.12));
    scene.options.domain.upper = dimension == 2 ? base::Vec3(1, 1.2, 0) : base::Vec3(1, 0.2, 1.2);
    apply(scheme, scene.options);
    for (int n = 0; n < 4; ++n) {
      Body drop = scene.bodies[0];
      drop.name = "drop " + std::to_string(n);
      const double x = 0.2 + 0.16 * n, z = 0.3 + 0.22 * n;
      drop.shape.box = dimension == 2 ? base::Box{{x, z, 0}, {x + 0.12, z + 0.12, 0}} : base::Box{{x, 0.04, z}, {x + 0.12, 0.16, z + 0.12}};
      scene.bodies.push_back(drop);
    }
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 144});
    double drift = 0;
    for (std::size_t f = course.totals.size() - 24; f < course.totals.size(); ++f) drift += course.totals[f].volume_drift.value_or(0) / 24;
    return report(course, std::abs(drift), say("volume %+.2f %%, largest energy %.4f of the start", 100 * drift, course.largest_energy()));
  };
  return c;
}

/// Everything runs out through open sides; the simulation goes on with nothing.
VerifyCase emptied(int dimension, const Scheme& scheme) {
  VerifyCase c = liquid_case("emptied_half_way", dimension, scheme);
  c.expect = "all particles go out and are counted, and empty frames follow (value: particles left)";
  c.tolerance = 0;
  c.source = "case 5";
  c.run = [=] {
    Scene scene = tank(dimension, 0.05, upright(dimension, 0.3, 0.2) - upright(dimension, 0, 0.2), upright(dimension, 0.6, 0.3));
    apply(scheme, scene.options);
    for (int a = 0; a < dimension; ++a) scene.options.boundary[std::size_t(a)] = {Side::open, Side::open};
    add_gravity(scene);
    const Course course = follow(scene, {.fps = 24, .frames = 24});
    std::int64_t left = 0;
    int empty = 0;
    for (const Totals& t : course.totals) left += t.left, empty += t.particles == 0;
    CaseOutcome found = report(course, double(course.end().particles), say("%lld of %lld out, %d empty frames", static_cast<long long>(left),
                                                                           static_cast<long long>(course.start().particles), empty));
    if (left != course.start().particles || empty < 2) found.broken.push_back("not all of them were counted");
    return found;
  };
  return c;
}

}  // namespace

void add_pouring_cases(std::vector<VerifyCase>& all) {
  all.push_back(long_pour(2, kNormal));
  all.push_back(long_pour(2, kHigh));
  all.push_back(long_pour(3, kNormal));
  all.push_back(long_pour(3, kExtreme));
  all.push_back(funnel(kDraft));
  all.push_back(funnel(kNormal));
  all.push_back(funnel(kHigh));
  all.push_back(falling_blocks(2, kNormal));
  all.push_back(falling_blocks(3, kHigh));
  all.push_back(emptied(2, kNormal));
  all.push_back(emptied(2, {Transfer::flip, 0, Kernel::quadratic, Carry::fixed, kDouble, Splitting::lie}));
  all.push_back(emptied(3, kExtreme));
}

}  // namespace sim::verify
