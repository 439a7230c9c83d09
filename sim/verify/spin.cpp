// What turns freely under no force keeps what it has: numerics of the free surface, where carried modes can gain.
#include <algorithm>
#include <cmath>

#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim::verify {
namespace {

Material soft(double young) { return {.model = Elasticity::neo_hookean, .density = 1, .young = young, .poisson = 0.3}; }

/// rho 1, nu .3, R .2, omega 4, jittered: a disk on cells of 1/32, a sphere on cells of 1/16.
Scene spinning(int dimension, const Scheme& scheme, double young) {
  Scene scene = dimension == 2 ? open_scene(2, 1, 1.0 / 32) : open_scene(3, 0.625, 1.0 / 16);
  apply(scheme, scene.options);
  const double middle = scene.options.domain.upper.x() / 2;
  scene.bodies = {ball(base::Vec3(middle, middle, dimension == 3 ? middle : 0), 0.2, soft(young))};
  scene.bodies[0].spin = base::Vec3(0, 0, 4);
  return scene;
}

/// Four seconds of a disk, two of a sphere; one of a sphere in double precision, which has no fast path: fixed carry blows up in less.
int frames_of(int dimension, const Scheme& scheme) { return dimension == 2 ? 80 : scheme.precision == kSingle ? 40 : 24; }

double angular_drift(const Course& c) { return (c.end().angular_momentum - c.start().angular_momentum).norm() / c.start().angular_momentum.norm(); }
double last_energy(const Course& c) { return c.energy(c.totals.size() - 1) / c.energy(0); }

VerifyCase spin_case(int dimension, const Scheme& scheme, double young = 200) {
  VerifyCase c = solid_case(std::string(dimension == 2 ? "spinning_disk" : "spinning_sphere") + (young < 100 ? "/soft" : ""), dimension, scheme);
  c.source = "docs/transfers.md, carry; case 15; PolyPIC S3";
  return c;
}

/// Keeps its energy, and its angular momentum to rounding.
VerifyCase keeps(int dimension, const Scheme& scheme, double tolerance, double young = 200) {
  VerifyCase c = spin_case(dimension, scheme, young);
  c.expect = "energy stays within the tolerance of the start's; angular momentum to rounding";
  c.tolerance = tolerance;
  c.run = [=] {
    const Course course = follow(spinning(dimension, scheme, young), {.fps = 20, .frames = frames_of(dimension, scheme)});
    const double off = std::max(course.largest_energy() - 1, 1 - last_energy(course));
    CaseOutcome found = report(course, off, say("energy %.5f to %.5f of the start, angular momentum off by %.1e", last_energy(course),
                                                course.largest_energy(), angular_drift(course)));
    if (angular_drift(course) > (scheme.precision == kDouble ? 1e-10 : 2e-5)) found.broken.push_back("angular momentum drifts");
    return found;
  };
  return c;
}

/// Loses, and must: nothing of a wheel is in a constant.
VerifyCase loses(int dimension, const Scheme& scheme, double kept) {
  VerifyCase c = spin_case(dimension, scheme);
  c.expect = "never gains; of the energy no more than the tolerance is left";
  c.tolerance = kept;
  c.run = [=] {
    const Course course = follow(spinning(dimension, scheme, 200), {.fps = 20, .frames = frames_of(dimension, scheme)});
    CaseOutcome found = report(course, last_energy(course), say("energy %.4f of the start, at most %.5f", last_energy(course),
                                                                course.largest_energy()));
    if (course.largest_energy() > 1.005) found.broken.push_back("it gained energy");
    return found;
  };
  return c;
}

/// Blows up, and is caught: an expected failure. The value is 1 where it does not blow up, or is not caught.
VerifyCase blows_up(int dimension, const Scheme& scheme) {
  VerifyCase c = spin_case(dimension, scheme);
  c.expect = "an expected failure: unwatched it gains energy without end; the watch does the frame again, with modes limited too, and "
             "ends below twice the energy or stops, naming the energy or what is strongly stretched";
  c.tolerance = 0;
  c.source = "docs/transfers.md, carry: fixed carry blows up in 12 of 12 runs";
  c.run = [=] {
    const Plan plan{.fps = 20, .frames = frames_of(dimension, scheme)};
    Plan alone = plan;
    alone.watched = false;
    const Course wild = follow(spinning(dimension, scheme, 200), alone);
    Course course = follow(spinning(dimension, scheme, 200), plan);
    const bool blew_up = !wild.stopped.empty() || wild.largest_energy() > 10;
    const std::int64_t retries = course.sum(&Totals::retries);
    const std::string stopped = std::exchange(course.stopped, {});
    const bool caught = stopped.empty() ? retries > 0 && course.largest_energy() < 2 : stopped.find("energy: ") != std::string::npos ||
        stopped.find("strongly stretched") != std::string::npos;
    return report(course, blew_up && caught ? 0 : 1, say("unwatched %.3g times the energy at t = %.2f s; watched ", wild.largest_energy(),
                                                         wild.end().time) +
                                                         (stopped.empty() ? say("%.3f times at most", course.largest_energy())
                                                          : "stopped: " + stopped));
  };
  return c;
}

/// One particle, stretched at first: everything a step does to it is an error of the step.
VerifyCase lone(int dimension, const Scheme& scheme, double stretch) {
  VerifyCase c = solid_case(stretch > 1 ? "lone_particle/stretched" : "lone_particle/pressed", dimension, scheme);
  c.expect = "1e4 steps: largest energy over the start's at most 1 + 2.6 CFL (CFL .2); in the last quarter at most 1.02 of the first's";
  c.tolerance = 1 + 2.6 * 0.2;
  c.source = "case 3";
  c.run = [=] {
    Scene scene = open_scene(dimension, 1, 0.1);
    apply(scheme, scene.options);
    scene.options.particles_per_cell = 1;
    scene.options.seeding = Seeding::regular;
    const double z = dimension == 3 ? 0.45 : 0;
    scene.bodies = {ball({0.45, 0.45, z}, 0.06, {.model = Elasticity::neo_hookean, .density = 1000, .young = 1e5, .poisson = 0.3})};
    scene.bodies[0].velocity = {0.21, -0.13, dimension == 3 ? 0.08 : 0};
    std::int64_t steps = 0;
    const Course course = follow(scene, {.fps = 8, .frames = 140,
        .prepare = [&](State& s) {
          // a short first step, until sound is that of this state
          edit<double>(s, "limits", [](std::int64_t row, double* v) { if (row == 0) *v = 50; });
          edit_reals(s, "deformation", scheme.precision, [&](std::int64_t, double* f) {
            f[0] = stretch - 1, f[dimension + 1] = 0.5 * (1 - stretch), f[1] = 0.1;
          });
        }});
    double first = 0, last = 0;
    for (std::size_t f = 0; f < course.totals.size(); ++f) {
      steps += course.totals[f].substeps;
      const double e = course.energy(f) / course.energy(0);
      if (4 * f < course.totals.size()) first = std::max(first, e);
      if (4 * f >= 3 * course.totals.size()) last = std::max(last, e);
    }
    CaseOutcome found = report(course, course.largest_energy(), say("%lld steps, largest energy %.3f of the start, %.3f in the last quarter",
                                                                    static_cast<long long>(steps), course.largest_energy(), last));
    if (steps < 10000) found.broken.push_back("fewer than 1e4 steps");
    if (last > 1.02 * first) found.broken.push_back("energy has a trend");
    return found;
  };
  return c;
}

/// A square that turns, one column of whose particles lies a millionth of a cell from where its stencil changes: its outer nodes weigh 5e-13.
VerifyCase light_nodes(int dimension, const Scheme& scheme) {
  VerifyCase c = solid_case("light_nodes", dimension, scheme);
  c.expect = "nodes of 1e-12 of a particle's mass: energy at most 1.01 of the start's, angular momentum to 1e-10";
  c.tolerance = 1.01;
  c.source = "case 4";
  c.run = [=] {
    Scene scene = open_scene(dimension, dimension == 2 ? 1 : 0.625, 1.0 / 16);
    apply(scheme, scene.options);
    scene.options.seeding = Seeding::regular;
    const double from = 0.25, to = 0.375;
    scene.bodies = {block({from, from, dimension == 3 ? from : 0}, {to, to, dimension == 3 ? to : 0}, soft(200))};
    scene.bodies[0].spin = base::Vec3(0, 0, 4);
    const Course course = follow(scene, {.fps = 20, .frames = 30, .prepare = [&](State& s) {
      edit_reals(s, "offset", scheme.precision, [&](std::int64_t, double* x) {
        for (int a = 0; a < dimension; ++a)
          if (x[a] > 0.5) x[a] = 0.5 + 1e-6;   // of the nearest node's stencil the far side is next to nothing
      });
    }});
    CaseOutcome found = report(course, course.largest_energy(),
                               say("largest energy %.5f of the start, angular momentum off by %.1e, %lld coefficients limited",
                                   course.largest_energy(),
                                                                  angular_drift(course), static_cast<long long>(course.sum(&Totals::limited_modes))));
    if (angular_drift(course) > 1e-10) found.broken.push_back("angular momentum drifts");
    return found;
  };
  return c;
}

/// Mean J - 1 over a spin's swings is what the spin asks for at rest in the turning frame.
VerifyCase swells(int dimension) {
  Scheme scheme;
  VerifyCase c = solid_case("swelling_by_spin", dimension, scheme);
  c.expect = "mean J - 1 over time within 5 % of the elastic solution's";
  c.tolerance = 0.05;
  c.source = dimension == 2 ? "case 15: rho w^2 R^2 / (4 (lambda + mu))" : "case 15: 2 rho w^2 R^2 / (15 K)";
  c.is_quick = dimension == 2;
  c.run = [=] {
    Scene scene = spinning(dimension, scheme, 200);
    if (dimension == 3) scene.options.domain.upper = base::Vec3::Constant(0.625), scene.options.cell = 0.625 / 20;
    double sum = 0;
    int count = 0;
    const Course course = follow(scene, {.fps = 200, .frames = dimension == 2 ? 400 : 200, .see = [&](const Simulation& simulation) {
      const std::vector<double> d = reals(simulation.state(), "deformation");
      const std::size_t width = std::size_t(dimension * dimension + 1), n = d.size() / width;
      double mean = 0;
      for (std::size_t p = 0; p < n; ++p) {
        Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
        for (int i = 0; i < dimension; ++i)
          for (int k = 0; k < dimension; ++k) f(i, k) += d[p * width + std::size_t(i * dimension + k)];
        mean += (f.determinant() - 1) / double(n);
      }
      sum += mean, ++count;
    }});
    const double lambda = 200 * 0.3 / (1.3 * 0.4), mu = 200 / 2.6, bulk = lambda + 2 * mu / 3;
    const double expected = dimension == 2 ? 16 * 0.04 / (4 * (lambda + mu)) : 2 * 16 * 0.04 / (15 * bulk);
    const double off = std::abs(sum / count / expected - 1);
    return report(course, off, say("mean J - 1 = %.3e, expected %.3e", sum / count, expected));
  };
  return c;
}

}  // namespace

void add_spin_cases(std::vector<VerifyCase>& all) {
  using enum Transfer;
  constexpr Kernel kQuadratic = Kernel::quadratic;
  all.push_back(loses(2, {pic}, 0.01));
  all.push_back(loses(2, {flip, 0, kQuadratic, Carry::fixed, kSingle}, 0.9));
  all.push_back(keeps(2, {apic}, 0.002));
  all.push_back(keeps(2, {apic, 0, kQuadratic, Carry::fixed, kSingle}, 0.002));
  all.push_back(keeps(2, {polypic, 4}, 0.002));
  all.push_back(keeps(2, {polypic, 6, kQuadratic, Carry::hybrid, kSingle}, 0.005));
  all.push_back(keeps(2, {polypic, 0, kQuadratic, Carry::hybrid}, 0.002));
  all.push_back(keeps(2, {polypic, 0, kQuadratic, Carry::hybrid, kSingle}, 0.002));
  all.push_back(keeps(2, {polypic, 0, kQuadratic, Carry::limited}, 0.01));
  all.push_back(keeps(2, {polypic, 0, kQuadratic, Carry::hybrid}, 0.02, 20));
  all.push_back(blows_up(2, {polypic, 0, kQuadratic, Carry::fixed}));
  all.push_back(blows_up(2, {polypic, 0, kQuadratic, Carry::fixed, kSingle}));
  all.push_back(loses(3, {pic, 0, kQuadratic, Carry::fixed, kSingle}, 0.05));
  all.push_back(keeps(3, {apic, 0, kQuadratic, Carry::fixed, kSingle}, 0.01));
  all.push_back(keeps(3, {polypic, 8}, 0.01));
  all.push_back(keeps(3, {polypic, 10, kQuadratic, Carry::fixed}, 0.01));
  all.push_back(keeps(3, {polypic, 0, kQuadratic, Carry::hybrid}, 0.01));
  all.push_back(keeps(3, {polypic, 0, kQuadratic, Carry::limited, kSingle}, 0.02));
  all.push_back(blows_up(3, {polypic, 0, kQuadratic, Carry::fixed, kSingle}));
  all.push_back(lone(2, {apic}, 0.6));
  all.push_back(lone(2, {polypic, 0, kQuadratic, Carry::hybrid, kSingle}, 1.5));
  all.push_back(lone(3, {polypic, 8, kQuadratic, Carry::fixed, kSingle}, 0.6));
  all.push_back(lone(3, {polypic, 0, kQuadratic, Carry::limited}, 1.5));
  all.push_back(light_nodes(2, {apic}));
  all.push_back(light_nodes(2, {polypic, 0, kQuadratic, Carry::hybrid}));
  all.push_back(light_nodes(2, {polypic, 0, kQuadratic, Carry::limited}));
  all.push_back(light_nodes(3, {polypic, 0, kQuadratic, Carry::hybrid}));
  all.push_back(swells(2));
  all.push_back(swells(3));
}

}  // namespace sim::verify
