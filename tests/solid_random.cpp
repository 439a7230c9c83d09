// Sixty scenes that nobody designed: bodies of random materials in random motion between random walls. They end well, or stop and say why.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.h"
#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

#ifdef __SANITIZE_ADDRESS__
constexpr int kFrames = 15;    // sanitized code takes ten times as long
#else
constexpr int kFrames = 100;
#endif

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
  return scene;
}

}  // namespace

TEST(SolidRandom, SixtyScenesEndWellOrStopAndSayWhy) {
  int stopped = 0;
  for (int number = 0; number < 60; ++number) {
    const auto simulation = make_simulation(random_scene(number), 200);
    base::Ledger ledger;
    try {
      for (int frame = 0; frame < kFrames; ++frame) simulation->advance(ledger, {});
      const Totals now = simulation->totals();
      ASSERT_TRUE(std::isfinite(energy(now)) && now.linear_momentum.allFinite()) << number;
      for (const auto& x : simulation->frame().position) ASSERT_TRUE(x.allFinite()) << number;
    } catch (const base::Error& e) {
      ++stopped;
      EXPECT_EQ(e.complaint().code, base::Exit::unstable) << number << ": " << e.what();
      EXPECT_FALSE(e.complaint().message.empty());
      std::printf("scene %d stopped: %s\n", number, e.what());
    }
  }
  EXPECT_LE(stopped, 6);
}
