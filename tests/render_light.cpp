// Light against known answers.
#include <gtest/gtest.h>

#include "base/error.h"
#include "render/trace/optics.h"
#include "render/trace/scene.h"
#include "tests/render_scenes.h"

namespace {

using namespace tests;
using render::trace::fresnel;

void set_white(render::Setting& setting) {
  setting.looks["ground"].color = Vec3::Ones();
  setting.looks["plaster"].color = Vec3::Ones();
  setting.looks["water"].absorption = Vec3::Zero();
  setting.options.bounces = 256;
  setting.lights = {uniform_sky(1)};
  setting.camera = {.position = Vec3(0, -2.6, 2), .target = Vec3(0, 0, 0.3), .fov = 25};  // away from where the ground fades
}

/// Largest distance of a pixel's colour from 1.
double furnace_error(const render::Image& image) {
  double worst = 0;
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x)
      worst = std::max(worst, (mean_color(image, x, y, x + 1, y + 1) - Vec3::Ones()).cwiseAbs().maxCoeff());
  return worst;
}

}  // namespace

// ((n - 1) / (n + 1))^2
TEST(Fresnel, ReflectsTwoPercentOfLightThatFallsStraightOnWater) {
  float cos_t;
  EXPECT_NEAR(fresnel(1, 1.333f, cos_t), std::pow(0.333 / 2.333, 2), 1e-7);
  EXPECT_EQ(cos_t, 1);
}

TEST(Fresnel, IsTheSameBothWays) {
  for (float cos_i = 0.05f; cos_i < 1; cos_i += 0.05f) {
    float cos_t, back;
    const float reflected = fresnel(cos_i, 1.333f, cos_t);
    ASSERT_GT(reflected, 0);
    EXPECT_NEAR(fresnel(cos_t, 1 / 1.333f, back), reflected, 2e-5) << cos_i;  // cancellation near grazing
    EXPECT_NEAR(back, cos_i, 2e-6 / cos_i);
  }
}

TEST(Fresnel, LetsNothingOutBeyondTheCriticalAngle) {
  const float critical = std::sqrt(1 - 1 / (1.333f * 1.333f));
  float cos_t;
  EXPECT_EQ(fresnel(0.99f * critical, 1 / 1.333f, cos_t), 1);
  EXPECT_LT(fresnel(1.01f * critical, 1 / 1.333f, cos_t), 1);
}

TEST(Refraction, FollowsSnell) {
  const Vec3f n = Vec3f(0.2f, -0.3f, 0.9f).normalized(), d = Vec3f(0.5f, 0.1f, -0.8f).normalized();
  const float cos_i = -d.dot(n);
  float cos_t;
  fresnel(cos_i, 1.333f, cos_t);
  const Vec3f t = render::trace::refract(d, n, cos_i, cos_t, 1.333f);
  EXPECT_NEAR(t.norm(), 1, 1e-6);
  EXPECT_NEAR(d.cross(n).norm(), 1.333 * t.cross(n).norm(), 1e-6);
  EXPECT_NEAR(t.dot(d.cross(n)), 0, 1e-6);  // in the plane of incidence
  EXPECT_LT(t.dot(n), 0);
}

// All is white in a white furnace: whatever a path does, it ends in radiance 1, exactly.
TEST(Furnace, KeepsTheGroundWhite) {
  render::Setting setting = empty_setting();
  set_white(setting);
  EXPECT_EQ(furnace_error(traced(setting, {})), 0);
}

// Paths to the far ground, which fades, have little weight and end by chance: it is the mean that is white.
TEST(Furnace, KeepsDiffuseSurfacesWhite) {
  render::Setting setting = empty_setting();
  set_white(setting);
  setting.options.spp = 4;
  setting.colliders.resize(2);
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0.4, 0, 0.4), 0.4};
  setting.colliders[1].shape.box = base::Box{Vec3(-0.8, -0.3, 0), Vec3(-0.2, 0.3, 0.5)};
  EXPECT_NEAR(mean_color(traced(setting, {})).mean(), 1, 1e-3);
}

// Splitting, Fresnel's choice, total reflection and the n^2 of radiance in a medium cancel as well. Paths of little weight end by
// chance and paths of more than 256 surfaces are missing, so it is the mean that is white.
TEST(Furnace, KeepsWaterOnTheGroundWhite) {
  render::Setting setting = empty_setting();
  set_white(setting);
  setting.options.spp = 4;
  const render::Image image = traced(setting, box_mesh({Vec3(-0.6, -0.6, -0.05), Vec3(0.6, 0.6, 0.4)}));
  EXPECT_NEAR(mean_color(image).mean(), 1, 1e-3);
}

// Its lower side lies in the ground's plane, of a ball at one point: no ray that goes between the two may start behind either.
TEST(Furnace, KeepsWhatStandsOnTheGroundWhite) {
  const render::Look glass{.model = "dielectric", .ior = 1.5}, frosted{.model = "dielectric", .roughness = 0.3, .ior = 1.5},
      wax{.model = "translucent", .color = Vec3::Ones(), .depth = 0.1};
  sim::Shape box, ball;
  box.box = base::Box{Vec3(-0.4, -0.4, 0), Vec3(0.4, 0.4, 0.3)};
  ball.sphere = sim::Shape::Sphere{Vec3(0, 0, 0.25), 0.25};
  for (const render::Look& look : {glass, frosted, wax})
    for (const sim::Shape& shape : {box, ball}) {
      render::Setting setting = empty_setting();
      set_white(setting);
      setting.looks["thing"] = look;
      setting.camera.fov = 12;
      setting.options.spp = look.model == "translucent" ? 64 : 16;
      setting.colliders.resize(1);
      setting.colliders[0].look = "thing";
      setting.colliders[0].shape = shape;
      EXPECT_NEAR(mean_color(traced(setting, surface::Mesh{})).mean(), 1, 0.015) << look.model << look.roughness << (shape.box ? " box" : " ball");
    }
}

// Smooth boundaries end no path: its weight gets to 0 in what absorbs, and then it comes into what scatters.
TEST(Furnace, HasNumbersForInkInMilk) {
  render::Setting setting = empty_setting();
  set_white(setting);
  setting.options.spp = 64;
  setting.looks["water"] = {.model = "dielectric", .ior = 1.33, .scattering = Vec3::Constant(20)};
  setting.looks["ink"] = {.model = "dielectric", .ior = 1.5, .absorption = Vec3::Constant(300)};
  setting.colliders.resize(1);
  setting.colliders[0].look = "ink";
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0, 0, 0.3), 0.28};
  const double mean = mean_color(traced(setting, box_mesh({Vec3(-0.6, -0.6, -0.05), Vec3(0.6, 0.6, 0.4)}))).mean();
  EXPECT_GT(mean, 0.3);
  EXPECT_LT(mean, 1);
}

// Total reflection between two media must not depend on which was met first: glass under water under sky.
TEST(Furnace, KeepsGlassInWaterWhite) {
  render::Setting setting = empty_setting();
  set_white(setting);
  setting.looks["glass"].absorption = Vec3::Zero();
  setting.options.spp = 4;
  setting.colliders.resize(1);
  setting.colliders[0].look = "glass";
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0.1, 0, 0.45), 0.25};  // half out of the water
  const render::Image image = traced(setting, box_mesh({Vec3(-0.6, -0.6, -0.05), Vec3(0.6, 0.6, 0.4)}));
  EXPECT_NEAR(mean_color(image).mean(), 1, 2e-3);
}

// What leaves a body into another medium than it came from takes the change of index with it.
TEST(Furnace, KeepsWaxHalfOutOfWaterWhite) {
  render::Setting setting = empty_setting();
  set_white(setting);
  setting.looks["wax"] = {.model = "translucent", .color = Vec3::Ones(), .depth = 0.1};
  setting.camera = {.position = Vec3(0.1, -2.6, 1.4), .target = Vec3(0.1, 0, 0.55), .fov = 6};   // of what is above the water
  setting.options.spp = 64;
  setting.colliders.resize(1);
  setting.colliders[0].look = "wax";
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0.1, 0, 0.45), 0.25};
  const render::Image image = traced(setting, box_mesh({Vec3(-0.6, -0.6, -0.05), Vec3(0.6, 0.6, 0.4)}));
  EXPECT_NEAR(mean_color(image).mean(), 1, 0.02);
}

// Sky of radiance 1 seen straight up through h metres: exp(-a h), with ior = 1 so that nothing is reflected.
TEST(Absorption, FollowsBeerThroughASlab) {
  render::Setting setting = empty_setting();
  setting.lights = {uniform_sky(1)};
  setting.looks["water"] = {.model = "dielectric", .ior = 1, .absorption = Vec3(2, 1, 0)};
  setting.camera = {.position = Vec3(0, 0, 1), .target = Vec3(0, 0, 2), .up = Vec3(0, 1, 0), .fov = 1};
  const Vec3 seen = mean_color(traced(setting, box_mesh({Vec3(-2, -2, 2), Vec3(2, 2, 2.5)})));
  EXPECT_NEAR(seen.x(), std::exp(-1.0), 1e-4);  // 1 / cos of half a degree
  EXPECT_NEAR(seen.y(), std::exp(-0.5), 1e-4);
  EXPECT_NEAR(seen.z(), 1, 1e-5);
}

// A small light above a slab of water: each face lets 1 - F through, the inside exp(-a h).
TEST(StraightShadows, AreTintedByFresnelAndBeer) {
  render::Setting setting = empty_setting();
  setting.options.bounces = 1;  // nothing but the shadow ray
  setting.looks["water"] = {.model = "dielectric", .ior = 1.333, .absorption = Vec3(2, 1, 0)};
  setting.lights = {{.kind = "area", .position = Vec3(0, 0, 6), .target = Vec3(0, 0, 0), .width = 0.02, .height = 0.02, .intensity = 1000}};
  setting.camera = {.position = Vec3(2, 0, 1), .target = Vec3(0, 0, 0), .fov = 1};
  const Vec3 open = mean_color(traced(setting, {})), tinted = mean_color(traced(setting, box_mesh({Vec3(-1, -1, 2), Vec3(1, 1, 2.5)})));
  const double through = std::pow(1 - std::pow(0.333 / 2.333, 2), 2);
  ASSERT_GT(open.minCoeff(), 1e-3);
  EXPECT_NEAR(tinted.x() / open.x(), through * std::exp(-1.0), 2e-4);
  EXPECT_NEAR(tinted.y() / open.y(), through * std::exp(-0.5), 2e-4);
  EXPECT_NEAR(tinted.z() / open.z(), through, 2e-4);
}

// Below the middle of a parallel rectangle: form factor in closed form [Howell, configuration factor B-3, four quarters].
TEST(AreaLight, GivesTheAnalyticIrradiance) {
  render::Setting setting = empty_setting();
  setting.options.spp = 64;
  setting.looks["ground"].color = Vec3::Constant(0.5);
  setting.lights = {{.kind = "area", .position = Vec3(0, 0, 1), .target = Vec3(0, 0, 0), .width = 2, .height = 1, .intensity = 3}};
  setting.camera = {.position = Vec3(3, 0, 0.5), .target = Vec3(0, 0, 0), .fov = 0.5};
  const double a = 1, b = 0.5, p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
  const double factor = 4 / (2 * std::numbers::pi) * (a / p * std::atan(b / p) + b / q * std::atan(a / q));
  // the hemisphere's samples find the light too: power heuristic, both techniques together give the whole
  EXPECT_NEAR(mean_color(traced(setting, {})).x(), 0.5 * 3 * factor, 2e-3 * 3 * factor);
}

TEST(AreaLight, ShinesToOneSideOnly) {
  render::Setting setting = empty_setting();
  setting.lights = {{.kind = "area", .position = Vec3(0, 0, 1), .target = Vec3(0, 0, 2), .intensity = 3}};
  setting.camera = {.position = Vec3(0, -2, 0.5), .target = Vec3(0, 0, 0.3)};
  EXPECT_EQ(mean_color(traced(setting, {})).maxCoeff(), 0);
}

// Without a dielectric there is nothing that the two could treat differently.
TEST(Caustics, ChangeNothingWhereNothingIsTransparent) {
  render::Setting setting = empty_setting();
  setting.lights = {};
  setting.colliders.resize(1);
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0.4, 0, 0.4), 0.4};
  const render::Image straight = traced(setting, {});
  setting.options.caustics = "path";
  EXPECT_EQ(traced(setting, {}).pixels, straight.pixels);
}

// Flat water bends light but keeps its amount: the straight shadow is the unbiased one but for noise (found by chance) and for the
// angle of absorption, of which there is none here.
TEST(Caustics, AgreeOnTheMeanUnderFlatWater) {
  render::Setting setting = empty_setting();
  setting.options.spp = 128;
  setting.options.bounces = 32;
  setting.looks["water"].absorption = Vec3::Zero();
  setting.lights = {{.kind = "area", .position = Vec3(0, 0, 3), .target = Vec3(0, 0, 0), .width = 4, .height = 4, .intensity = 1}};
  setting.camera = {.position = Vec3(0, -3, 3), .target = Vec3(0, 0, 0), .fov = 8};
  const surface::Mesh pool = box_mesh({Vec3(-30, -30, -0.05), Vec3(30, 30, 0.1)});
  const double straight = mean_color(traced(setting, pool)).x();
  setting.options.caustics = "path";
  const double path = mean_color(traced(setting, pool)).x();
  ASSERT_GT(path, 0.05);
  EXPECT_NEAR(straight, path, 0.03 * path);
}

// Left and right of a symmetric scene differ by noise only.
TEST(PathTracer, GivesASymmetricMeanOfASymmetricScene) {
  render::Setting setting = empty_setting();
  setting.lights = render::default_lights(setting.domain);
  setting.lights[1].position.x() = 0;
  setting.options.spp = 64;
  setting.camera = {.position = Vec3(0, -4, 1.5), .target = Vec3(0, 0, 0.3)};
  const render::Image image = traced(setting, sphere_mesh(Vec3(0, 0, 0.5), 0.4));
  const Vec3 left = mean_color(image, 0, 0, 32, 36), right = mean_color(image, 32, 0, 64, 36);
  ASSERT_GT(left.minCoeff(), 0.05);
  EXPECT_LT((left - right).cwiseAbs().maxCoeff(), 0.01 * left.maxCoeff());
}

TEST(PathTracer, GivesTheSameBitsForAnyNumberOfThreads) {
  render::Setting setting = empty_setting();
  setting.lights = {};
  setting.colliders.resize(1);
  setting.colliders[0].shape.box = base::Box{Vec3(-0.8, -0.3, 0), Vec3(-0.2, 0.3, 0.5)};
  const surface::Mesh mesh = sphere_mesh(Vec3(0.3, 0, 0.5), 0.4, 256);
  const render::Image one = traced(setting, mesh, 1);
  EXPECT_EQ(traced(setting, mesh, 2).pixels, one.pixels);
  EXPECT_NE(traced(setting, mesh, 2, 2).pixels, one.pixels) << "another frame has other noise";
}

TEST(PathTracer, TracesFrameAfterFrameAsIfEachWereTheFirst) {
  render::Setting setting = empty_setting();
  setting.lights = {};
  base::Ledger ledger;
  render::PathTracer tracer(setting, 2);
  tracer.trace(sphere_mesh(Vec3(0.3, 0, 0.5), 0.4), 1, ledger);
  tracer.trace({}, 2, ledger);
  const surface::Mesh third = box_mesh({Vec3(-0.6, -0.6, -0.05), Vec3(0.6, 0.6, 0.4)});
  EXPECT_EQ(tracer.trace(third, 3, ledger).pixels, traced(setting, third, 2, 3).pixels);
  EXPECT_EQ(ledger.passes().at("bvh").calls, 3);
  EXPECT_EQ(ledger.passes().at("trace").calls, 3);
}

namespace {

void expect_fault(const render::Setting& setting, const surface::Mesh& mesh, const std::string& words) {
  try {
    traced(setting, mesh);
    FAIL() << "a picture of NaN";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::fault);
    EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
  }
}

}  // namespace

TEST(PathTracer, NamesThePixelThatIsNotFinite) {
  render::Setting setting = empty_setting();
  setting.options.width = setting.options.height = 16;
  setting.lights = {uniform_sky(std::nan(""))};
  expect_fault(setting, {}, "render: frame 1, pixel (0, 0), sample 0: radiance is not finite");
}

TEST(PathTracer, RefusesNormalsThatAreNotFinite) {
  surface::Mesh mesh = sphere_mesh(Vec3(0, 0, 0.5), 0.4);
  mesh.normal[100].setConstant(std::nanf(""));
  expect_fault(empty_setting(), mesh, "normal 100 of the mesh is no unit vector");
}

TEST(PathTracer, SaysWhichLookIsNotThere) {
  render::Setting setting = empty_setting();
  setting.colliders.resize(1);
  setting.colliders[0].name = "block";
  setting.colliders[0].look = "plastre";
  try {
    render::PathTracer tracer(setting, 1);
    FAIL();
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user);
    EXPECT_EQ(e.complaint().key, "collider.block.look");
    EXPECT_NE(e.complaint().allowed.find("plaster"), std::string::npos);
  }
}
