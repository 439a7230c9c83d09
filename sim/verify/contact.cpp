// Walls and colliders that are hit at speed, thinner than a cell, closing, or where material is at the start.
#include <algorithm>
#include <cmath>

#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim::verify {
namespace {

const Material kJelly{.model = Elasticity::neo_hookean, .density = 1000, .young = 1e4, .poisson = 0.3};

VerifyCase contact_case(const std::string& name, int dimension, const Scheme& scheme, bool is_solid) {
  VerifyCase c = is_solid ? solid_case(name + "/solid", dimension, scheme) : liquid_case(name + "/liquid", dimension, scheme);
  c.source = "case 17";
  return c;
}

/// Particles that are where no shot of this kind can get to.
template <class Is>
std::int64_t count(const Frame& frame, const Is& is) {
  std::int64_t n = 0;
  for (const base::Vec3f& x : frame.position) n += is(x.cast<double>());
  return n;
}

/// A column of it flies at a wall that reaches across the whole domain.
VerifyCase thin_wall(int dimension, const Scheme& scheme, bool is_solid, double cells, double speed, bool is_mesh = false) {
  VerifyCase c = contact_case((is_mesh ? "mesh_wall/" : "thin_wall/") + say("%g_cells", cells), dimension, scheme, is_solid);
  c.expect = say("hit at %g m/s, %g cells a frame: particles beyond the wall or in it", speed, speed / 24 / 0.05);
  c.tolerance = 0;
  c.run = [=] {
    const double h = 0.05, at = 0.6 + 0.3 * h, z = dimension == 3 ? 0.4 : 0;
    Scene scene = is_solid ? walled_scene(dimension, 1, h) : tank(dimension, h, {0, 0, 0}, {0.3, dimension == 3 ? 0.2 : 0.3, 0.3});
    scene.options.domain.upper = dimension == 2 ? base::Vec3(1, 0.4, 0) : base::Vec3(1, 0.4, 0.4);
    apply(scheme, scene.options);
    if (is_solid) scene.options.cfl = 0.4, scene.bodies = {block({0.2, 0.1, dimension == 3 ? 0.1 : 0}, {0.4, 0.3, dimension == 3 ? 0.3 : 0}, kJelly)};
    else scene.bodies[0].shape.box = base::Box{{0.2, 0.1, dimension == 3 ? 0.1 : 0}, {0.4, 0.3, dimension == 3 ? 0.3 : 0}};
    scene.bodies[0].velocity = {speed, 0, 0};
    scene.colliders = {is_mesh ? mesh_collider("wall", {at, -1, -1}, {at + cells * h, 2, 2})
                               : box_collider("wall", {at, -1, dimension == 3 ? -1.0 : 0}, {at + cells * h, 2, dimension == 3 ? 2.0 : z})};
    scene.colliders[0].meets_solids = is_solid;
    measure_meshes(scene);
    std::int64_t through = 0, reached = 0;
    const Course course = follow(scene, {.fps = 24, .frames = 12, .see = [&](const Simulation& s) {
      through = std::max(through, count(s.frame(), [&](const base::Vec3& x) { return x.x() > at + 1e-3 * h; }));
      reached = std::max(reached, count(s.frame(), [&](const base::Vec3& x) { return x.x() > at - 1.5 * h; }));
    }});
    CaseOutcome found = report(course, double(through), say("%lld of %lld particles through, %lld came to it, %lld were pushed back",
                                                            static_cast<long long>(through), static_cast<long long>(course.start().particles),
                                                          static_cast<long long>(reached), static_cast<long long>(course.sum(&Totals::pushed_out))));
    if (reached == 0) found.broken.push_back("nothing came to the wall");
    return found;
  };
  return c;
}

/// Two plates close on a column that can get away above them only.
VerifyCase closing(int dimension, const Scheme& scheme, bool is_solid) {
  VerifyCase c = contact_case("closing_colliders", dimension, scheme, is_solid);
  c.expect = "two plates close to half a cell: no particle in them, none lost (value: particles in a plate)";
  c.tolerance = 0;
  c.run = [=] {
    const double h = 0.05;
    Scene scene = is_solid ? walled_scene(dimension, 1, h) : tank(dimension, h, {0, 0, 0}, {1, 0.2, dimension == 2 ? 0 : 0.2});
    apply(scheme, scene.options);
    add_gravity(scene);
    if (is_solid) scene.bodies = {block({0.4, 0, 0}, {0.6, 0.2, dimension == 2 ? 0 : 0.2}, kJelly)};
    const base::Vec3 top = dimension == 2 ? base::Vec3(0, 0.3, 0) : base::Vec3(0, 0.3, 0.3);   // half as high as the tank: the liquid gets away above
    const base::Vec3 low = dimension == 2 ? base::Vec3(0, -0.1, 0) : base::Vec3(0, -0.1, -0.1);
    scene.colliders = {box_collider("left", base::Vec3(0.25, 0, 0) + low, base::Vec3(0.4, 0, 0) + top, {0.18, 0, 0}),
                       box_collider("right", base::Vec3(0.6, 0, 0) + low, base::Vec3(0.75, 0, 0) + top, {-0.18, 0, 0})};
    for (Collider& plate : scene.colliders) plate.meets_solids = is_solid;
    std::int64_t inside = 0;
    const Course course = follow(scene, {.fps = 24, .frames = 12, .see = [&](const Simulation& s) {   // 0.2 m apart, and 0.02 m after half a second
      for (const Collider& collider : scene.colliders) {
        const Shape now = shape_at(s.totals().time, collider, scene.options);
        inside = std::max(inside, count(s.frame(), [&](const base::Vec3& x) { return now.distance(x) < -1e-2 * h; }));
      }
    }});
    CaseOutcome found = report(course, double(inside), say("%lld particles in a plate at worst, %lld pushed out, fastest %.2f m/s at the end",
                                                           static_cast<long long>(inside), static_cast<long long>(course.sum(&Totals::pushed_out)),
                                                           course.end().max_speed));
    if (course.end().imbalance.value_or(0) > 0) found.broken.push_back("the liquid is shut in");
    return found;
  };
  return c;
}

/// A collider stands where a body is at the start: nothing is seeded in it, and what is beside it stays out.
VerifyCase overlapping(int dimension, const Scheme& scheme, bool is_solid) {
  VerifyCase c = contact_case("overlapping_at_start", dimension, scheme, is_solid);
  c.expect = "particles in the collider";
  c.tolerance = 0;
  c.run = [=] {
    const double h = 0.05;
    const base::Vec3 lower(0.2, 0, 0), upper(0.7, dimension == 2 ? 0.3 : 0.2, dimension == 2 ? 0 : 0.3);
    Scene scene = is_solid ? walled_scene(dimension, 1, h) : tank(dimension, h, lower, upper);
    apply(scheme, scene.options);
    if (is_solid) {
      scene.options.domain.upper = dimension == 2 ? base::Vec3(1, 0.5, 0) : base::Vec3(1, 0.2, 0.5);
      scene.bodies = {block(lower, upper, kJelly)};
    }
    add_gravity(scene);
    Collider post;
    post.name = "post";
    post.shape.sphere = {dimension == 2 ? base::Vec3(0.45, 0.12, 0) : base::Vec3(0.45, 0.1, 0.12), dimension == 2 ? 0.13 : 0.085};
    post.meets_solids = is_solid;
    scene.colliders = {post};
    const auto inside = [&](const Simulation& s) { return count(s.frame(), [&](const base::Vec3& x) { return post.shape.distance(x) < -1e-2 * h; });
    };
    std::int64_t most = inside(*make_simulation(scene, 24));
    const Course course = follow(scene, {.fps = 24, .frames = 12, .see = [&](const Simulation& s) { most = std::max(most, inside(s)); }});
    return report(course, double(most), say("%lld of %lld in it at worst, %lld pushed out", static_cast<long long>(most),
                                            static_cast<long long>(course.start().particles),
        static_cast<long long>(course.sum(&Totals::pushed_out))));
  };
  return c;
}

/// Particles on the domain's edges and beside them by an ulp, some moving out: walls keep them, open sides let them go and count them.
VerifyCase domain_edge(int dimension, const Scheme& scheme, bool is_solid, Side side) {
  const char* const kind = side == Side::open ? "open" : side == Side::periodic ? "periodic" : "walls";
  VerifyCase c = contact_case(std::string("on_the_domains_edge/") + kind, dimension, scheme, is_solid);
  c.expect = side == Side::open ? "inside or counted as gone (value: those that are neither)" : "kept inside (value: those that are not)";
  c.tolerance = 0;
  c.source = "case 2";
  c.run = [=] {
    const double h = 0.1;
    Scene scene = is_solid ? walled_scene(dimension, 1, h) : tank(dimension, h, {0, 0, 0}, dimension == 2 ? base::Vec3(1, 0.3, 0)
                                                                  : base::Vec3(1, 0.2, 0.3));
    apply(scheme, scene.options);
    if (is_solid) scene.bodies = {block({0, 0, 0}, dimension == 2 ? base::Vec3(1, 0.3, 0) : base::Vec3(1, 1, 0.3), kJelly)};
    for (int a = 0; a < dimension; ++a)
      if (side != Side::slip) scene.options.boundary[std::size_t(a)] = {side, side};
    if (is_solid && side == Side::slip)
      for (int a = 0; a < dimension; ++a) scene.options.boundary[std::size_t(a)] = {Side::separating, Side::separating};
    const base::Box domain = scene.options.domain;
    std::array<std::int64_t, 3> cells{};
    for (int a = 0; a < dimension; ++a) cells[std::size_t(a)] = std::int64_t(std::lround(domain.size()[a] / h));
    const Course course = follow(scene, {.fps = 24, .frames = 6, .prepare = [&](State& s) {
      edit<std::int32_t>(s, "cell", [&](std::int64_t row, std::int32_t* x) {
        if (row % 7 < 2 * dimension) x[row % 7 / 2] = row % 7 % 2 ? std::int32_t(cells[std::size_t(row % 7 / 2)] - 1) : 0;
      });
      edit_reals(s, "offset", scheme.precision, [&](std::int64_t row, double* x) {
        if (row % 7 < 2 * dimension) x[row % 7 / 2] = row % 7 % 2 ? 1 - (scheme.precision == kDouble ? 1.2e-16 : 6e-8) : 0;
      });
      edit_reals(s, "coefficients", scheme.precision, [&](std::int64_t row, double* v) {
        if (row % 7 < 2 * dimension) v[row % 7 / 2] = row % 7 % 2 ? 1 : -1;
      });
    }, .most_energy = 1e3});
    std::int64_t left = 0;
    for (const Totals& t : course.totals) left += t.left;
    const std::int64_t outside = count(course.simulation->frame(), [&](const base::Vec3& x) {
      for (int a = 0; a < dimension; ++a)
        if (x[a] < domain.lower[a] - 1e-6 || x[a] > domain.upper[a] + 1e-6) return true;
      return false;
    });
    CaseOutcome found = report(course, double(outside + course.start().particles - course.end().particles - left),
                               say("%lld particles, %lld gone and counted, %lld outside", static_cast<long long>(course.start().particles),
                                   static_cast<long long>(left), static_cast<long long>(outside)));
    if (side == Side::open && left == 0) found.broken.push_back("none went out");
    if (side != Side::open && left != 0) found.broken.push_back("some went out");
    return found;
  };
  return c;
}

/// A block thrown at a wall with three cells a step, moved by a rule of third order: where the flow stops within a cell that goes beyond the wall.
VerifyCase into_a_wall(int dimension, const Scheme& scheme) {
  VerifyCase c = contact_case("into_a_wall", dimension, scheme, false);
  c.expect = "kept inside (value: particles that are not)";
  c.tolerance = 0;
  c.source = "case 2";
  c.run = [=] {
    const double h = 0.05;
    Scene scene = tank(dimension, h, dimension == 2 ? base::Vec3(0.5, 0.1, 0) : base::Vec3(0.5, 0, 0.1), dimension == 2 ? base::Vec3(0.8, 0.4, 0)
                       : base::Vec3(0.8, 0.2, 0.4));
    apply(scheme, scene.options);
    scene.options.cfl = 3, scene.options.advection = Advection::rk3;
    scene.bodies[0].velocity = {15, 0, 0};
    const Course course = follow(scene, {.fps = 100, .frames = 12});
    std::int64_t left = 0;
    for (const Totals& t : course.totals) left += t.left;
    const std::int64_t outside = count(course.simulation->frame(), [&](const base::Vec3& x) { return x.x() > scene.options.domain.upper.x() + 1e-6;
    });
    const std::int64_t pushed = course.sum(&Totals::pushed_out);
    CaseOutcome found = report(course, double(outside + left), say("%lld particles, %lld pushed back",
                                                                   static_cast<long long>(course.start().particles), static_cast<long long>(pushed)));
    if (pushed == 0) found.broken.push_back("nothing came to the wall");
    return found;
  };
  return c;
}

}  // namespace

void add_contact_cases(std::vector<VerifyCase>& all) {
  using enum Transfer;
  constexpr auto kLinear = Kernel::linear, kQuadratic = Kernel::quadratic;
  const Scheme linear{polypic, 0, kLinear, Carry::fixed, kSingle}, rough{apic, 0, kQuadratic, Carry::fixed, kSingle},
      full{polypic, 0, kQuadratic, Carry::hybrid, kSingle};
  Scheme reflected = linear;
  reflected.splitting = Splitting::reflection;
  for (const double cells : {0.5, 1.0, 2.0}) {
    all.push_back(thin_wall(2, linear, false, cells, 20));
    all.push_back(thin_wall(2, full, true, cells, 20));
  }
  all.push_back(thin_wall(3, full, false, 0.5, 40));
  all.push_back(thin_wall(3, reflected, false, 1, 20));
  all.push_back(thin_wall(3, rough, true, 0.5, 20));
  all.push_back(thin_wall(3, linear, false, 2, 20, true));
  all.push_back(thin_wall(3, full, false, 0.5, 20, true));
  all.push_back(thin_wall(3, rough, true, 2, 20, true));
  all.push_back(closing(2, linear, false));
  all.push_back(closing(3, reflected, false));
  all.push_back(closing(2, full, true));
  all.push_back(overlapping(2, full, false));
  all.push_back(overlapping(3, linear, false));
  all.push_back(overlapping(2, rough, true));
  all.push_back(overlapping(3, full, true));
  all.push_back(into_a_wall(2, linear));
  all.push_back(into_a_wall(3, rough));
  all.push_back(domain_edge(2, linear, false, Side::slip));
  all.push_back(domain_edge(2, full, false, Side::open));
  all.push_back(domain_edge(3, {flip, 0, kQuadratic}, false, Side::open));
  all.push_back(domain_edge(3, linear, false, Side::periodic));
  all.push_back(domain_edge(2, {polypic, 0, kQuadratic, Carry::limited}, true, Side::slip));
  all.push_back(domain_edge(3, rough, true, Side::periodic));
}

}  // namespace sim::verify
