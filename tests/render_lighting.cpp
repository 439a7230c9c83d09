// Lights against formulas, and their two ways of being found against each other; media inside each other; adaptive and timed frames.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>

#include "base/error.h"
#include "render/trace/optics.h"
#include "tests/render_trace.h"

namespace {

using namespace tests;

/// A white floor at z = 0, seen from above at its middle: radiance is irradiance / pi.
render::Setting floor_setting(const render::Light& light) {
  render::Setting setting = empty_setting();
  setting.options.bounces = 1;
  setting.looks["ground"] = {.color = Vec3::Ones()};
  setting.lights = {light};
  return setting;
}

Mean on_floor(const Rays& rays, int groups = 16, int samples = 256) { return rays.mean(Vec3(0.3, 0, 0.5), Vec3(0, 0, 0), groups, samples); }

/// A picture that is dark but for a patch of a few pixels.
trace::Environment patchy() {
  std::vector<Vec3f> pixels(64 * 32, Vec3f::Constant(0.05f));
  for (const std::size_t i : {5 * 64 + 20, 5 * 64 + 21, 6 * 64 + 20}) pixels[i] = Vec3f(300, 200, 100);
  return {64, 32, std::move(pixels), 30};
}

}  // namespace

// pi L (r / d)^2 cos, where all of it is above the horizon.
TEST(SphereLight, GivesTheAnalyticIrradiance) {
  const render::Setting setting = floor_setting({.kind = "sphere", .position = Vec3(1, 1, 2), .radius = 0.6, .intensity = 5});
  const double square = 6, expected = 5 * 0.36 / square * 2 / std::sqrt(square);
  Rays rays(setting);
  const Mean both = on_floor(rays);
  EXPECT_NEAR(both.value.x(), expected, 4 * std::sqrt(both.variance.x()) + 1e-4);
  ASSERT_LT(std::sqrt(both.variance.x()), 0.005 * expected);
}

TEST(Sun, GivesItsIntensityToAWhiteSurfaceThatFacesIt) {
  for (const double angle : {0.53, 20.0}) {
    const render::Setting setting = floor_setting({.kind = "sun", .direction = Vec3(1, 0, -1), .angle = angle, .intensity = 3});
    const Mean seen = on_floor(Rays(setting));
    EXPECT_NEAR(seen.value.x(), 3 * std::sqrt(0.5), 4 * std::sqrt(seen.variance.x()) + 1e-3) << angle;
  }
}

TEST(Environment, DrawsDirectionsAsItsDensitySays) {
  const trace::Environment environment = patchy();
  // integral of radiance over the sphere, by drawn and by even directions
  Vec3 drawn = Vec3::Zero(), even = Vec3::Zero();
  double density = 0;
  constexpr int kSamples = 1 << 18;
  const render::sampling::Sequence sequence(kSamples, 1);
  const render::sampling::PixelSampler points(sequence, 0, 0);
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const trace::LightSample s = environment.sample(Vec3f::Zero(), points.point(i, 1));
    ASSERT_GT(s.density, 0);
    drawn += (s.radiance / s.density).cast<double>() / kSamples;
    const Vec3f direction = trace::cap_direction(2, points.point(i, 2));
    even += 4 * std::numbers::pi / kSamples * environment.radiance(direction).cast<double>();
    density += 4 * std::numbers::pi / kSamples * static_cast<double>(environment.density(direction));
  }
  EXPECT_NEAR(density, 1, 0.01);
  EXPECT_LT((drawn - even).norm(), 0.01 * even.norm()) << drawn.transpose() << " against " << even.transpose();
}

// Beside a pole a picture's row is narrower than what a cosine tells apart.
TEST(Environment, DrawsThePolesOfALargePicture) {
  constexpr int kWidth = 64, kHeight = 4096, kSamples = 1 << 16;
  std::vector<Vec3f> pixels(std::size_t(kWidth) * kHeight, Vec3f::Zero());
  std::fill_n(pixels.begin(), kWidth, Vec3f::Ones());
  std::fill_n(pixels.end() - kWidth, kWidth, Vec3f::Ones());
  const trace::Environment environment(kWidth, kHeight, pixels, 0);
  const render::sampling::Sequence sequence(kSamples, 1);
  const render::sampling::PixelSampler points(sequence, 0, 0);
  double drawn = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const trace::LightSample s = environment.sample(Vec3f::Zero(), points.point(i, 1));
    ASSERT_GT(s.density, 0);
    drawn += static_cast<double>(s.radiance.x() / s.density) / kSamples;
  }
  // Linear between the middles of rows, a half beyond: 1 up to half a row, then down to 0 at one and a half.
  const double row = std::numbers::pi / kHeight;
  const double caps = 2 * 2 * std::numbers::pi * row * row * (0.125 + 0.5 * 0.5 + 1.0 / 6);
  EXPECT_NEAR(drawn / caps, 1, 0.02);
}

TEST(Environment, IsSeenWhereItsPictureSays) {
  std::vector<Vec3f> pixels(8 * 4, Vec3f::Zero());
  pixels[1 * 8 + 3] = pixels[1 * 8 + 4] = Vec3f::Ones();  // above the horizon, in the middle
  pixels[2 * 8 + 5] = pixels[2 * 8 + 6] = Vec3f::Constant(2);  // below, to the right
  const trace::Environment environment(8, 4, pixels, 0);
  const float h = std::sin(std::numbers::pi_v<float> / 8), c = std::cos(std::numbers::pi_v<float> / 8);
  EXPECT_NEAR(environment.radiance(Vec3f(0, c, h)).x(), 1, 1e-5);   // +y, up
  EXPECT_NEAR(environment.radiance(Vec3f(c, 0, -h)).x(), 2, 1e-5);  // +x, down
  EXPECT_EQ(environment.radiance(Vec3f(0, -c, h)).x(), 0);
  const trace::Environment turned(8, 4, pixels, 90);  // clockwise from above: what was ahead is to the right
  EXPECT_NEAR(turned.radiance(Vec3f(c, 0, h)).x(), 1, 1e-5);
}

// Each strategy alone is unbiased, so all means agree within noise: z-test on the variance between independent groups.
TEST(ImportanceSampling, AgreesWithEachStrategyAlone) {
  const render::Light area{.kind = "area", .position = Vec3(0.5, 0, 1.5), .target = Vec3(0, 0, 0.3), .width = 1, .height = 1, .intensity = 4};
  const render::Light sphere{.kind = "sphere", .position = Vec3(-0.5, 0.6, 1.4), .radius = 0.4, .intensity = 5};
  const render::Light sun{.kind = "sun", .direction = Vec3(0.3, 0.5, -1), .angle = 30, .intensity = 1};
  const render::Look metal{.model = "conductor", .color = Vec3(0.9, 0.6, 0.3), .roughness = 0.5},
      plastic{.model = "coated", .color = Vec3(0.1, 0.3, 0.5), .roughness = 0.5};
  for (const int kind : {0, 1, 2, 3})
    for (const auto& look : {metal, plastic}) {
      render::Setting setting = empty_setting();
      setting.options.caustics = "path";
      setting.options.bounces = 3;
      setting.lights = {kind == 0 ? area : kind == 1 ? sphere : kind == 2 ? sun : uniform_sky(0)};
      setting.looks["ball"] = look;
      setting.colliders = {ball("ball", Vec3(0, 0, 0.3), 0.3)};
      Rays rays(setting);
      if (kind == 3) rays.scene.lights.environments.push_back(patchy());
      std::array<Mean, 3> means;
      for (const trace::Strategy s : {trace::Strategy::both, trace::Strategy::lights, trace::Strategy::scattering}) {
        rays.scene.strategy = s;
        means[static_cast<std::size_t>(s)] = rays.mean(Vec3(0.2, -2, 1.2), Vec3(0, -0.1, 0.45), 32, kind == 3 ? 2048 : 128);
      }
      ASSERT_GT(means[0].value.maxCoeff(), 1e-3);
      for (const std::size_t other : {1, 2})
        for (int c = 0; c < 3; ++c)
          EXPECT_LT(std::abs(means[0].value[c] - means[other].value[c]), 4 * std::sqrt(means[0].variance[c] + means[other].variance[c]) + 1e-6)
              << "light " << kind << " " << look.model << " strategy " << other << ": " << means[0].value[c] << " against " << means[other].value[c];
      EXPECT_LE(means[0].variance.sum(), std::max(means[1].variance.sum(), means[2].variance.sum())) << kind << look.model;
    }
}

// Through four blocks that overlap; where they do, the one of higher priority is, whichever was entered first.
TEST(NestedDielectrics, AbsorbAsTheirPrioritiesSay) {
  for (const std::int64_t priority : {-1, 1}) {
    render::Setting setting = bare_setting();
    setting.lights = {uniform_sky(1)};
    setting.looks["a"] = {.model = "dielectric", .ior = 1, .absorption = Vec3(3, 0, 1)};
    setting.looks["b"] = {.model = "dielectric", .ior = 1, .absorption = Vec3(0, 2, 1), .priority = priority};
    setting.colliders = {block("a", {Vec3(-1, -1, 0), Vec3(1, 1, 0.5)}), block("b", {Vec3(-1, -1, 0.3), Vec3(1, 1, 0.7)})};
    const double in_a = priority < 0 ? 0.5 : 0.3, in_b = 0.7 - in_a;
    for (const double side : {-1.0, 1.0}) {
      const Mean seen = Rays(setting).mean(Vec3(0.1, 0.1, 0.35 - side), Vec3(0.1, 0.1, 0.35), 2, 4);
      EXPECT_NEAR(seen.value.x(), std::exp(-3 * in_a), 1e-3) << priority << side;
      EXPECT_NEAR(seen.value.y(), std::exp(-2 * in_b), 1e-3) << priority << side;
      EXPECT_NEAR(seen.value.z(), std::exp(-0.7), 1e-3) << priority << side;
    }
  }
}

namespace {

double straight_on(double a, double b) { return std::pow((a - b) / (a + b), 2); }

/// Layers between interfaces, light going back and forth: transmission of what is in front, and its reflection back from behind.
double transmission(const std::vector<double>& reflection, const std::vector<double>& through) {
  double t = 1 - reflection[0], back = reflection[0];
  for (std::size_t i = 1; i < reflection.size(); ++i) {
    const double inside = back * through[i - 1] * through[i - 1], rest = 1 / (1 - inside * reflection[i]);
    t *= through[i - 1] * rest * (1 - reflection[i]);
    back = reflection[i] + (1 - reflection[i]) * (1 - reflection[i]) * inside * rest;
  }
  return t;
}

}  // namespace

// Glass with water that overlaps its wall: air, glass, water, air and nothing else, in whichever order they are met, and the straight
// shadow ray agrees but for what goes back and forth.
TEST(NestedDielectrics, TransmitAsTheirLayersDo) {
  render::Setting setting = bare_setting();
  setting.looks["glass"] = {.model = "dielectric", .ior = 1.5, .absorption = Vec3(1, 0, 2), .priority = 1};
  setting.looks["juice"] = {.model = "dielectric", .ior = 1.333, .absorption = Vec3(0, 2, 2)};
  setting.colliders = {block("glass", {Vec3(-1, -1, 0.2), Vec3(1, 1, 0.4)}), block("juice", {Vec3(-1, -1, 0.3), Vec3(1, 1, 0.8)})};
  setting.lights = {{.kind = "area", .position = Vec3(0, 0, 1.5), .target = Vec3(0, 0, 0), .width = 3, .height = 3, .intensity = 1}};
  const std::vector<double> reflection{straight_on(1, 1.5), straight_on(1.5, 1.333), straight_on(1.333, 1)};
  const Mean seen = Rays(setting).mean(Vec3(0, 0, -0.5), Vec3(0, 0, 0), 16, 1024);
  for (int c = 0; c < 3; ++c) {
    const double glass = std::exp(-0.2 * setting.looks["glass"].absorption[c]), juice = std::exp(-0.4 * setting.looks["juice"].absorption[c]);
    EXPECT_NEAR(seen.value[c], transmission(reflection, {glass, juice}), 4 * std::sqrt(seen.variance[c]) + 1e-5) << c;
  }
  render::Setting lit = setting;
  lit.options.ground = "floor";
  lit.options.caustics = "straight";
  lit.options.bounces = 1;
  lit.looks["ground"] = {.color = Vec3::Ones()};
  lit.lights = {{.kind = "area", .position = Vec3(0, 0, 6), .target = Vec3(0, 0, 0), .width = 0.02, .height = 0.02, .intensity = 1e4}};
  render::Setting open = lit;
  open.colliders.clear();
  const Vec3 shaded = Rays(lit).mean(Vec3(0.1, 0, 0.15), Vec3(0, 0, 0), 2, 16).value,
             clear = Rays(open).mean(Vec3(0.1, 0, 0.15), Vec3(0, 0, 0), 2, 16).value;
  for (int c = 0; c < 3; ++c) {
    const double depth = 0.2 * setting.looks["glass"].absorption[c] + 0.4 * setting.looks["juice"].absorption[c];
    EXPECT_NEAR(shaded[c] / clear[c], (1 - reflection[0]) * (1 - reflection[1]) * (1 - reflection[2]) * std::exp(-depth), 2e-4) << c;
  }
}

// Straight up from inside: what comes through the surface and Beer's law. A white room is white under water too.
TEST(NestedDielectrics, HoldTheCamera) {
  render::Setting setting = bare_setting();
  setting.looks["water"] = {.model = "dielectric", .ior = 1.333, .absorption = Vec3(1, 2, 3)};
  setting.colliders = {block("water", {Vec3(-5, -5, -5), Vec3(5, 5, 1)})};
  setting.lights = {{.kind = "area", .position = Vec3(0, 0, 2), .target = Vec3(0, 0, 0), .width = 3, .height = 3, .intensity = 1}};
  const Mean seen = Rays(setting).mean(Vec3(0, 0, 0.5), Vec3(0, 0, 1), 2, 16);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(seen.value[c], (1 - straight_on(1, 1.333)) * std::exp(-0.5 * setting.looks["water"].absorption[c]), 1e-4) << c;
  setting.looks["water"].absorption.setZero();
  setting.lights = {uniform_sky(1)};
  EXPECT_LT((Rays(setting).mean(Vec3(0, 0, 0.5), Vec3(0.3, 0.2, 1), 4, 64).value - Vec3::Ones()).norm(), 1e-3);
}

// A ball of nothing, and a wall of two glasses that are one, are not to be seen: no light is counted twice for them, and none is lost.
TEST(NestedDielectrics, OfOneIndexChangeNothing) {
  const std::vector<render::Light> lights = {uniform_sky(1),
                                             {.kind = "sun", .direction = Vec3(0.3, 0.2, -1), .angle = 10, .intensity = 2},
                                             {.kind = "area", .position = Vec3(0.5, 0, 2), .target = Vec3(0, 0, 0.3), .width = 1.5, .height = 1.5, .intensity = 4}};
  for (const render::Light& light : lights)
    for (const char* caustics : {"none", "straight", "path"}) {
      render::Setting setting = empty_setting();
      setting.options.ground = "none";
      setting.options.caustics = caustics;
      setting.options.bounces = 8;
      setting.looks["white"] = {.color = Vec3::Ones()};
      setting.looks["nothing"] = {.model = "dielectric", .ior = 1};
      setting.lights = {light};
      setting.colliders = {ball("white", Vec3(0, 0, 0.3), 0.2)};
      const auto seen = [&] { return Rays(setting).mean(Vec3(0.2, -2, 1.5), Vec3(0, 0, 0.35), 16, 256); };
      const Mean bare = seen();
      ASSERT_GT(bare.value.x(), 0.05) << light.kind;
      setting.colliders.push_back(ball("nothing", Vec3(0, 0, 0.3), 0.5));
      const Mean within = seen();
      EXPECT_NEAR(within.value.x(), bare.value.x(), 4 * std::sqrt(within.variance.x() + bare.variance.x()) + 1e-3) << light.kind << " " << caustics;
    }
}

// Fog is not what a camera in it sees first, and neither is what light meets after it was scattered.
TEST(NestedDielectrics, ThatScatterKeepTheFirstHitBehindThem) {
  render::Setting setting = bare_setting();
  setting.looks["fog"] = {.model = "dielectric", .ior = 1.2, .scattering = Vec3(1, 1, 1)};
  setting.looks["white"] = {.color = Vec3::Ones()};
  setting.lights = {uniform_sky(1)};
  setting.colliders = {block("fog", {Vec3(-5, -5, -5), Vec3(5, 5, 5)}), block("white", {Vec3(-4, 1, -4), Vec3(4, 2, 4)})};
  const trace::Scene scene = trace::make_scene(setting);
  trace::Geometry geometry(scene.surfaces, 1);
  geometry.set_frame({}, {}, {});
  const trace::Integrator integrator(scene, geometry);
  const trace::Ray ray{.origin = Vec3f::Zero(), .direction = Vec3f::UnitY()};
  const trace::Media around = integrator.media_at(ray.origin, 0.5f);
  const render::sampling::Sequence sequence(256, 1);
  const render::sampling::PixelSampler points(sequence, 0, 0);
  int met = 0;
  for (std::uint32_t s = 0; s < 256; ++s) {
    trace::FirstHit first;
    integrator.radiance(ray, around, points, s, first);
    if (!first.found) continue;
    EXPECT_NEAR(first.t, 1, 1e-4);
    ++met;
  }
  EXPECT_NEAR(met, 256 * std::exp(-1), 25);
}

// The water level goes on inside a body of wax: light comes out above it as dry as it would be without.
TEST(Translucent, BodyHalfUnderWaterIsLitThroughAirAboveIt) {
  render::Setting setting = bare_setting();
  setting.options.bounces = 16;
  setting.looks["wax"] = {.model = "translucent", .color = Vec3(0.9, 0.9, 0.9), .depth = 0.1};
  setting.lights = {{.kind = "sun", .direction = Vec3(0, 1, -1), .angle = 5, .intensity = 3}};
  setting.colliders = {ball("wax", Vec3(0, 0, 0), 0.3), block("water", {Vec3(-3, -3, -3), Vec3(3, 3, 0)})};
  std::vector<Mean> seen;
  for (const double absorption : {0.0, 1e-6}) {   // [1/m] nothing, unless it is for all the way to the sun
    setting.looks["water"] = {.model = "dielectric", .ior = 1.333, .absorption = Vec3::Constant(absorption)};
    seen.push_back(Rays(setting).mean(Vec3(0, -2, 0.5), Vec3(0, -0.29, 0.03), 8, 256));
  }
  EXPECT_NEAR(seen[1].value.x(), seen[0].value.x(), 0.003 * seen[0].value.x());
}

// Rays leave a surface at a distance that floats can tell, wherever the set stands.
TEST(PathTracer, ShadesASetFarFromItsDomainEvenly) {
  for (const double away : {1.0, 1000.0}) {
    render::Setting setting = bare_setting();
    setting.looks["white"] = {.color = Vec3::Ones()};
    setting.lights = {{.kind = "sun", .direction = Vec3(0.2, 1, -0.3), .angle = 0.5, .intensity = 3}};
    setting.colliders = {block("white", {Vec3(-2, away, -2), Vec3(2, away + 1, 2)})};
    const Rays rays(setting);
    const double expected = 3 / std::sqrt(1 + 0.04 + 0.09);
    for (int k = 0; k < 32; ++k) {
      const Mean one = rays.mean(Vec3(0.3, 0, 0), Vec3(0.05 * k - 0.8, away, 0.03 * k - 0.5), 2, 64);
      EXPECT_NEAR(one.value.x(), expected, 0.01 * expected) << away << " m, " << k;
    }
  }
}

TEST(Caustics, OfNoneLeaveFullShadowsUnderWater) {
  render::Setting setting = floor_setting({.kind = "area", .position = Vec3(0, 0, 3), .target = Vec3(0, 0, 0), .intensity = 10});
  setting.options.bounces = 8;
  setting.colliders = {block("glass", {Vec3(-1, -1, 1), Vec3(1, 1, 1.2)})};
  for (const char* caustics : {"none", "straight", "path"}) {
    setting.options.caustics = caustics;
    const double seen = on_floor(Rays(setting)).value.x();
    if (setting.options.caustics == "none") {
      EXPECT_LT(seen, 0.005);  // by way of the floor around
      continue;
    }
    EXPECT_GT(seen, 0.1) << caustics;
  }
}

TEST(Ground, OfAStudioBendsUpBehindTheDomain) {
  render::Setting setting = empty_setting();
  setting.options.ground = "cyclorama";
  setting.camera = {.position = Vec3(0, -4, 1), .target = Vec3(0, 0, 0.5)};
  const trace::Ground ground = trace::make_scene(setting).ground;
  const auto met = [&](const Vec3f& from, const Vec3f& to) { return ground.meet({.origin = from, .direction = (to - from).normalized()}); };
  EXPECT_EQ(met(Vec3f(0, 0, 1), Vec3f(0, 0, 0)).normal, Vec3f(0, 0, 1));
  EXPECT_EQ(met(Vec3f(0, 0, 1), Vec3f(0, 1, 5)).normal, Vec3f(0, -1, 0)) << "the wall has no end";
  const trace::Ground::Met bend = met(Vec3f(0, 0, 1), Vec3f(0, 100, 1));
  EXPECT_GT(bend.normal.z(), 0);
  EXPECT_LT(bend.normal.y(), 0);
  EXPECT_NEAR(bend.normal.norm(), 1, 1e-6);
  EXPECT_EQ(met(Vec3f(0, 0, 1), Vec3f(0, -1, 2)).t, std::numeric_limits<float>::infinity()) << "nothing is behind the camera";
  setting.options.ground = "none";
  EXPECT_EQ(trace::make_scene(setting).ground.meet({.origin = Vec3f(0, 0, 1), .direction = -Vec3f::UnitZ()}).t,
            std::numeric_limits<float>::infinity());
}

TEST(Environment, IsReadByTheKindItsNameSaysInCapitalsToo) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("sky" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  render::Image image{.width = 8, .height = 4, .channels = {"R", "G", "B"}, .pixels = std::vector<float>(8 * 4 * 3, 2.5f)};
  base::Ledger ledger;
  render::write_exr(folder / "a.exr", image, {}, ledger);
  std::filesystem::copy_file(folder / "a.exr", folder / "b.EXR");
  for (const char* name : {"a.exr", "b.EXR"})
    EXPECT_NEAR(trace::read_environment(folder / name, Vec3f::Ones(), 0).radiance(Vec3f::UnitY()).x(), 2.5, 1e-3) << name;
  std::filesystem::remove_all(folder);
}

// A light's density there is more than a float's square holds.
TEST(Ground, IsLitHoweverFarAway) {
  render::Setting setting = empty_setting();
  setting.options.ground = "cyclorama";
  setting.lights = {{.kind = "sphere", .position = Vec3(0, 0, 2), .radius = 0.1},
                    {.kind = "area", .position = Vec3(0, 0, 2), .target = Vec3(0, 0, 0)}};
  for (const double far : {1e3, 1e6, 1e9, 1e12}) EXPECT_TRUE(Rays(setting).mean(Vec3(0, 0, 1), Vec3(far, 0, 0), 2, 16).value.allFinite()) << far;
}

namespace {

render::Setting all_materials() {
  render::Setting setting = empty_setting();
  setting.lights = {};
  const char* looks[] = {"jelly", "steel", "clay", "wax", "glass"};
  for (int i = 0; i < 5; ++i) setting.colliders.push_back(ball(looks[i], Vec3(-1 + 0.5 * i, 0, 0.22), 0.22));
  setting.camera = {.position = Vec3(0, -3, 1), .target = Vec3(0, 0, 0.2), .fov = 30};
  return setting;
}

std::size_t channel(const render::Image& image, const std::string& name) {
  return static_cast<std::size_t>(std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin());
}

}  // namespace

TEST(PathTracer, GivesEveryMaterialTheSameBitsForAnyNumberOfThreads) {
  render::Setting setting = all_materials();
  setting.options.spp = 32;
  setting.options.noise = 0.05;
  const render::Image one = traced(setting, {}, 1);
  EXPECT_EQ(traced(setting, {}, 2).pixels, one.pixels);
  EXPECT_EQ(traced(setting, {}, 4).pixels, one.pixels);
}

TEST(PathTracer, StopsTilesThatAreQuietAndSaysHowManySamplesTheyGot) {
  render::Setting setting = all_materials();
  setting.options.spp = 64;
  const render::Image full = traced(setting, {});
  setting.options.noise = 0.05;
  const render::Image stopped = traced(setting, {});
  const std::size_t samples = channel(full, "samples"), channels = full.channels.size();
  float least = 64, most = 0;
  for (std::size_t i = samples; i < full.pixels.size(); i += channels) {
    ASSERT_EQ(full.pixels[i], 64);
    least = std::min(least, stopped.pixels[i]);
    most = std::max(most, stopped.pixels[i]);
    if (stopped.pixels[i] < 64) continue;
    EXPECT_NEAR(stopped.pixels[i - samples], full.pixels[i - samples], 1e-5) << "the same samples, in other sums";
  }
  EXPECT_EQ(least, 16);
  EXPECT_GT(most, 16);
  EXPECT_LT((mean_color(stopped) - mean_color(full)).norm(), 0.01 * mean_color(full).norm());
}

// No frame is made in no time: it has the first samples, and says that its number of samples is an accident.
TEST(PathTracer, SaysThatATimedFrameIsNotReproducible) {
  render::Setting setting = all_materials();
  EXPECT_TRUE(traced(setting, {}).reproducible);
  setting.options.time_limit = 1e-9;
  const render::Image cut = traced(setting, {});
  EXPECT_FALSE(cut.reproducible);
  EXPECT_EQ(cut.pixels[channel(cut, "samples")], 4);
  setting.options.time_limit = 1e9;
  EXPECT_TRUE(traced(setting, {}).reproducible);
}

TEST(Environment, NamesThePictureThatCannotBeUsed) {
  render::Setting setting = empty_setting();
  setting.folder = "/nowhere";
  setting.lights = {{.kind = "environment", .file = "sky.exr"}};
  ASSERT_EQ(setting.files().size(), 1u);
  EXPECT_EQ(setting.files()[0], "/nowhere/sky.exr");
  try {
    trace::make_scene(setting);
    FAIL();
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user);
    EXPECT_NE(std::string(e.what()).find("/nowhere/sky.exr: "), std::string::npos) << e.what();
  }
}
