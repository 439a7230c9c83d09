// What takes long: a hundred thousand steps, and scenes that nobody designed.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "sim/empty_body.h"
#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/random_scene.h"
#include "sim/verify/scenes.h"

namespace sim::verify {

namespace {

Material random_material(std::mt19937& rng) {
  std::uniform_real_distribution<double> u(0, 1);
  const auto between = [&](double low, double high) { return low * std::pow(high / low, u(rng)); };
  Material m = preset_table()[rng() % preset_table().size()].material;
  m.density = between(50, 8000);
  m.young = m.density * between(1, 1e4);   // sound at 1 to 100 m/s
  m.bulk_modulus = m.density * between(1, 1e3);
  m.poisson = -0.3 + 0.79 * u(rng);
  m.yield_stress = m.young * between(1e-4, 1);
  m.hardening_modulus = u(rng) < 0.5 ? 0 : m.young * u(rng);
  m.friction_angle = 1 + 79 * u(rng);
  m.cohesion = u(rng) < 0.5 ? 0 : m.young * between(1e-5, 1e-1);
  m.critical_compression = between(1e-3, 0.4), m.critical_stretch = between(1e-3, 0.4);
  m.hardening = 50 * u(rng), m.hardening_cap = between(1, 1000);
  m.volume_averaging = u(rng) < 0.3;
  return m;
}

}  // namespace

Scene random_scene(int number) {
  std::mt19937 rng(static_cast<unsigned>(number));
  std::uniform_real_distribution<double> u(0, 1);
  const int dimension = number % 3 == 0 ? 3 : 2;
  Scene scene = walled_scene(dimension, 1, dimension == 3 ? 1.0 / 10 : 1.0 / 24);
  Options& o = scene.options;
  o.precision = number % 4 == 0 ? Precision::double_precision : Precision::single_precision;
  o.seed = number;
  o.particles_per_cell = dimension == 3 ? (number % 2 ? 8 : 1) : (number % 2 ? 4 : 9);
  o.wall_friction = u(rng) < 0.5 ? 0 : 2 * u(rng);
  o.carry = u(rng) < 0.3 ? Carry::limited : Carry::hybrid;
  for (int a = 0; a < dimension; ++a)
    for (auto& side : o.boundary[std::size_t(a)]) side = std::array{Side::slip, Side::sticky, Side::separating}[rng() % 3];
  const int bodies = 2 + int(rng() % 3);
  for (int b = 0; b < bodies; ++b) {
    const base::Vec3 at(0.15 + 0.7 * u(rng), 0.15 + 0.7 * u(rng), dimension == 3 ? 0.15 + 0.7 * u(rng) : 0);
    Body body = u(rng) < 0.5 ? ball(at, 0.06 + 0.12 * u(rng), random_material(rng))
                             : block(at - base::Vec3::Constant(0.1), at + base::Vec3::Constant(0.12), random_material(rng));
    if (dimension == 2 && body.shape.box) body.shape.box->lower.z() = body.shape.box->upper.z() = 0;
    body.name = "b" + std::to_string(b);
    body.velocity = 4 * base::Vec3(u(rng) - 0.5, u(rng) - 0.5, dimension == 3 ? u(rng) - 0.5 : 0);
    body.spin = dimension == 3 ? base::Vec3(10 * u(rng), 10 * u(rng), 0) : base::Vec3(0, 0, 20 * u(rng));
    body.transfer = std::array{"pic", "flip", "apic", "polypic", "polypic"}[rng() % 5];
    if (body.transfer == "polypic" && u(rng) < 0.5) body.modes.count = 1 + std::int64_t(rng() % std::size_t(dimension == 3 ? 27 : 9));
    scene.bodies.push_back(body);
  }
  scene.effects = {{"gravity", base::Vec3(3 * u(rng), -9.81, 0)}};
  if (u(rng) < 0.5) {
    Collider post;
    post.name = "post";
    post.shape.sphere = {base::Vec3(0.5, 0.3, dimension == 3 ? 0.5 : 0), 0.12};
    post.contact = static_cast<Contact>(rng() % 3);
    post.friction = u(rng);
    scene.colliders = {post};
  }
  std::mt19937 meetings(static_cast<unsigned>(number));
  for (Body& body : scene.bodies) body.contact = static_cast<Contact>(meetings() % 3), body.friction = double(meetings() % 8) / 8;
  while (const std::optional<EmptyBody> hidden = find_empty_body(scene)) scene.bodies.erase(scene.bodies.begin() + std::ptrdiff_t(hidden->place));
  return scene;
}

namespace {

VerifyCase random_scenes(int first, int last, int frames, bool quick) {
  VerifyCase c;
  c.name = say("random_scenes/%d-%d", first, last - 1);
  c.dimension = 3;
  c.transfer = "any", c.kernel = "quadratic", c.integrator = "explicit";
  c.expect = "bodies of random materials in random motion between random walls: numbers stay finite, or the run stops and says why "
             "(value: share of stops)";
  c.tolerance = 0.1;
  c.source = "the range of every key";
  c.is_quick = quick;
  c.run = [=] {
    CaseOutcome found;
    int stopped = 0;
    for (int number = first; number < last; ++number) {
      Course course = follow(random_scene(number), {.fps = 200, .frames = frames, .most_energy = 1e300});
      stopped += !course.stopped.empty();
      course.stopped.clear();   // it may
      CaseOutcome one = report(course, 0, "");
      for (const std::string& broken : one.broken) found.broken.push_back(say("scene %d: %s", number, broken.c_str()));
      if (number == first) found.picture = std::move(one.picture), found.scene = std::move(one.scene);
    }
    found.value = double(stopped) / (last - first);
    found.outcome = say("%d of %d stopped and said why", stopped, last - first);
    return found;
  };
  return c;
}

/// Drifts that only rounding can make: of the mean volume ratio, and of momentum over what the body's fastest part carries.
VerifyCase long_run(const std::string& name, const Scheme& scheme, double spin, double tolerance, bool quick) {
  VerifyCase c = solid_case("1e5_steps/" + name, 2, scheme);
  const bool exact = scheme.precision == kDouble;
  c.expect = "drift of the volume (mean J over a turn) and of momentum over 1e5 steps at most the tolerance";
  c.tolerance = tolerance;
  c.source = exact ? "rounding: 1e5 steps of 1e-16, as a walk or a sum" : "rounding: 1e5 steps of 6e-8, as a walk 2e-5, as a sum 6e-3";
  c.is_quick = quick;
  c.run = [=] {
    Scene scene = open_scene(2, 1, 0.1);
    apply(scheme, scene.options);
    scene.bodies = {block({0.4, 0.4, 0}, {0.6, 0.6, 0}, {.model = Elasticity::neo_hookean, .density = 1, .young = 200, .poisson = 0.3})};
    scene.bodies[0].spin = {0, 0, spin};
    double first = 0, last = 0;
    int seen = 0;
    const int frames = 40, mean = 8;
    const Course course = follow(scene, {.fps = 0.2, .frames = frames, .see = [&](const Simulation& s) {
      const std::vector<double> d = reals(s.state(), "deformation");
      double j = 0;
      for (std::size_t k = 0; k < d.size(); k += 5) j += (d[k] + d[k + 3] + d[k] * d[k + 3] - d[k + 1] * d[k + 2]) / double(d.size() / 5);
      if (seen < mean) first += j / mean;
      if (seen >= frames - mean) last += j / mean;
      ++seen;
    }});
    const Totals &start = course.start(), &end = course.end();
    const double scale = spin == 0 ? 0 : start.angular_momentum.norm();
    const double turning = scale > 0 ? (end.angular_momentum - start.angular_momentum).norm() / scale : end.max_speed / std::sqrt(200.0);
    const double moving = (end.linear_momentum - start.linear_momentum).norm() / (start.mass * (spin == 0 ? std::sqrt(200.0) : 0.1 * spin));
    const double volume = std::abs(last - first);
    CaseOutcome found = report(course, std::max({turning, moving, volume}), say("%lld steps: volume %+.1e, linear momentum %.1e, %s %.1e",
                                                                                static_cast<long long>(course.sum(&Totals::substeps)), last - first,
        moving,
                                                                              spin == 0 ? "fastest particle over sound" : "angular momentum",
                                                                                  turning));
    if (course.sum(&Totals::substeps) < 100000) found.broken.push_back("fewer than 1e5 steps");
    return found;
  };
  return c;
}

}  // namespace

void add_long_cases(std::vector<VerifyCase>& all) {
  using enum Transfer;
  constexpr Kernel kQuadratic = Kernel::quadratic;
  all.push_back(random_scenes(0, 8, 40, true));
  all.push_back(random_scenes(0, 60, 100, false));
  all.push_back(long_run("spinning", {apic, 0, kQuadratic, Carry::fixed, kSingle}, 4, 6e-3, false));
  all.push_back(long_run("spinning", {polypic, 0, kQuadratic, Carry::hybrid, kSingle}, 4, 6e-3, false));
  all.push_back(long_run("spinning", {apic}, 4, 1e-6, false));
  all.push_back(long_run("resting", {apic, 0, kQuadratic, Carry::fixed, kSingle}, 0, 6e-3, true));
  all.push_back(long_run("resting", {polypic, 0, kQuadratic, Carry::hybrid, kSingle}, 0, 6e-3, false));
}

}  // namespace sim::verify
