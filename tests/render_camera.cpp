// Camera, shutter and lens against geometry.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "render/trace/camera.h"
#include "render/trace/integrator.h"
#include "render/view/keys.h"
#include "tests/render_scenes.h"

namespace {

using namespace tests;
using Eigen::Vector2d;
using render::view::resolve;
using render::view::View;

const base::Box kRoom{Vec3(-1, -1, 0), Vec3(1, 1, 1)};

/// Pixels from the upper left corner.
Vector2d projected(const View& v, const Vec3& p, double width, double height) {
  const Vec3 way = p - v.position;
  const double z = way.dot(v.forward);
  return {0.5 * width * (1 + way.dot(v.right) / (z * v.tan_x)), 0.5 * height * (1 - way.dot(v.up) / (z * v.tan_y))};
}

double channel(const render::Image& image, const char* name, std::int64_t x, std::int64_t y) {
  const auto c = std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin();
  return image.pixels[static_cast<std::size_t>((y * image.width + x) * static_cast<std::int64_t>(image.channels.size()) + c)];
}

/// Moments of a non-negative picture [pixels].
struct Spot {
  double mass = 0;
  Vector2d mean = Vector2d::Zero(), variance = Vector2d::Zero();
};
template <class Value>
Spot spot(const render::Image& image, const Value& value) {
  Spot s;
  Vector2d square = Vector2d::Zero();
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x) {
      const double w = value(x, y);
      const Vector2d at(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
      s.mass += w;
      s.mean += w * at;
      square += w * at.cwiseAbs2();
    }
  s.mean /= s.mass;
  s.variance = square / s.mass - s.mean.cwiseAbs2();
  return s;
}
/// How much of each pixel the liquid covers: it alone is white.
Spot coverage(const render::Image& image) {
  return spot(image, [&](std::int64_t x, std::int64_t y) { return channel(image, "albedo.R", x, y); });
}

/// A white liquid above a black floor, seen from the front; a metre at the origin is about 89 pixels.
render::Setting stage() {
  render::Setting setting = empty_setting();
  setting.options.width = 192;
  setting.options.height = 108;
  setting.options.spp = 128;
  setting.options.bounces = 1;
  setting.liquid_look = "white";
  setting.looks["white"].color = Vec3::Ones();
  setting.looks["ground"].color = Vec3::Zero();
  setting.camera = {.position = Vec3(0, -4, 0.5), .target = Vec3(0, 0, 0.5), .fov = 17.26, .shutter = 0};
  return setting;
}
double pixels_per_metre(const render::Setting& setting, double depth) {
  return 0.5 * static_cast<double>(setting.options.height) / (depth * std::tan(0.5 * *setting.camera.fov * std::numbers::pi / 180));
}

surface::Mesh ball(const Vec3& middle, double radius, const Vec3f& velocity) {
  surface::Mesh mesh = sphere_mesh(middle, radius, 24);
  std::fill(mesh.velocity.begin(), mesh.velocity.end(), velocity);
  return mesh;
}

}  // namespace

TEST(CameraKeys, AreMetAndRestAtTheEnds) {
  const std::vector<render::view::Key<double>> keys{{1, 2}, {5, 4}, {7, 10}};
  for (const auto& key : keys) EXPECT_DOUBLE_EQ(curve(keys, key.at), key.value);
  EXPECT_EQ(curve(keys, -3), 2);
  EXPECT_EQ(curve(keys, 8), 10);
  EXPECT_NEAR(curve(keys, 1 + 1e-4), 2, 1e-8);   // slope 0
  EXPECT_NEAR(curve(keys, 7 - 1e-4), 10, 1e-7);
}

// Between two keys alone the cubic with level ends is 3 s^2 - 2 s^3.
TEST(CameraKeys, EaseInAndOut) {
  const std::vector<render::view::Key<Vec3>> keys{{1, Vec3(0, 0, 0)}, {5, Vec3(8, -4, 0)}};
  EXPECT_LT((curve(keys, 2) - (3.0 / 16 - 2.0 / 64) * Vec3(8, -4, 0)).norm(), 1e-14);
  EXPECT_LT((curve(keys, 3) - Vec3(4, -2, 0)).norm(), 1e-14);
}

TEST(CameraKeys, RunSmoothlyAndStayBetweenTheirNeighbours) {
  const std::vector<render::view::Key<double>> keys{{1, 0}, {4, 1}, {6, 5}, {12, 5}, {14, -2}};
  for (std::size_t i = 0; i + 1 < keys.size(); ++i)
    for (double at = keys[i].at; at <= keys[i + 1].at; at += 0.05) {
      const double value = curve(keys, at);
      EXPECT_GE(value, std::min(keys[i].value, keys[i + 1].value) - 1e-12) << at;
      EXPECT_LE(value, std::max(keys[i].value, keys[i + 1].value) + 1e-12) << at;
    }
  const double h = 1e-5, left = (curve(keys, 4) - curve(keys, 4 - h)) / h, right = (curve(keys, 4 + h) - curve(keys, 4)) / h;
  ASSERT_GT(left, 0.1);
  EXPECT_NEAR(left, right, 1e-4);
}

TEST(CameraKeys, MoveOnlyWhatTheyName) {
  render::Camera camera{.target = Vec3(0, 0, 0), .fov = 40};
  camera.keys = {{.frame = 1, .position = Vec3(0, -4, 0)}, {.frame = 5, .fov = 20}, {.frame = 9, .position = Vec3(4, -4, 0)}};
  const View v = resolve(camera, kRoom, 192, 108, 5);
  EXPECT_LT((v.position - Vec3(2, -4, 0)).norm(), 1e-14);
  EXPECT_LT((v.forward - (Vec3(0, 0, 0) - v.position).normalized()).norm(), 1e-14);
  EXPECT_NEAR(v.tan_y, std::tan(10 * std::numbers::pi / 180), 1e-14);
  EXPECT_LT((resolve(camera, kRoom, 192, 108, 100).position - Vec3(4, -4, 0)).norm(), 1e-14);
}

TEST(Turntable, TurnsAQuarterAndComesBack) {
  render::Camera camera{.position = Vec3(1, -3, 2), .target = Vec3(1, 1, 0.5)};
  camera.turntable = render::Turntable{.revolutions = 1, .frames = 48};
  EXPECT_LT((resolve(camera, kRoom, 192, 108, 1).position - Vec3(1, -3, 2)).norm(), 1e-14);
  const View quarter = resolve(camera, kRoom, 192, 108, 13);
  EXPECT_LT((quarter.position - Vec3(5, 1, 2)).norm(), 1e-13);
  EXPECT_LT((quarter.forward - (Vec3(1, 1, 0.5) - quarter.position).normalized()).norm(), 1e-14);
  EXPECT_LT((resolve(camera, kRoom, 192, 108, 49).position - Vec3(1, -3, 2)).norm(), 1e-13);
}

TEST(Turntable, KeepsTheWholeDomainInTheDefaultView) {
  render::Camera camera;
  camera.turntable = render::Turntable{.frames = 32};
  const base::Box longish{Vec3(0, 0, 0), Vec3(4, 0.5, 0.7)};
  double widest = 0;
  for (int frame = 1; frame <= 32; ++frame)
    for (int i = 0; i < 8; ++i) {
      const Vec3 corner = longish.lower + Vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1).cwiseProduct(longish.size());
      const Vector2d at = projected(resolve(camera, longish, 200, 100, frame), corner, 2, 2) - Vector2d(1, 1);
      widest = std::max(widest, at.cwiseAbs().maxCoeff());
    }
  EXPECT_LE(widest, 0.9301);
  EXPECT_GT(widest, 0.9);   // no further away than it must be
}

// Rays of one pixel meet in the plane of focus; at distance d they fill, on the film, the circle c = A |d - F| / d  f / (F - f).
TEST(Lens, FillsTheCircleOfConfusionOfTheLensFormula) {
  render::Setting setting = stage();
  setting.camera.aperture = 1.4;
  setting.camera.focus = 3.0;
  setting.camera.sensor = 0.05;
  const render::trace::Camera camera(setting, 1);
  const View view = resolve(setting.camera, setting.domain, setting.options.width, setting.options.height);
  const double F = 3, s = 0.5 * 0.05 / view.tan_y, f = 1 / (1 / s + 1 / F), A = f / 1.4;
  ASSERT_GT(f, 0.1);
  for (const double d : {1.0, 2.5, 3.0, 7.0}) {
    const Vector2d pixel(61.5, 33.5);
    double widest = 0;
    for (int i = 0; i < 64 * 64; ++i) {
      const render::trace::Ray ray = camera.ray(61.5f, 33.5f, {static_cast<float>(i % 64) / 63.999f, static_cast<float>(i / 64) / 63.999f}, 0.5f);
      const Vec3 direction = ray.direction.cast<double>();
      const Vec3 at = ray.origin.cast<double>() + d / direction.dot(view.forward) * direction;
      widest = std::max(widest, (projected(view, at, 192, 108) - pixel).norm());
    }
    const double circle = A * std::abs(d - F) / d * f / (F - f);                // [m] diameter on the film
    EXPECT_NEAR(widest, 0.5 * circle / 0.05 * 108, 0.01 * widest + 1e-3) << d;  // the 64 x 64 points reach the rim to 0.2 %
  }
}

// A uniform disc of radius r adds r^2 / 4 to the variance along each axis.
TEST(Lens, BlursAPictureByItsCircle) {
  render::Setting setting = stage();
  const surface::Mesh target = ball(Vec3(0, 1, 0.5), 0.04, Vec3f::Zero());
  const Spot sharp = coverage(traced(setting, target));
  setting.camera.aperture = 1;
  setting.camera.focus = 3;
  setting.camera.sensor = 0.05;
  const Spot blurred = coverage(traced(setting, target));
  const View view = resolve(setting.camera, setting.domain, 192, 108);
  const double radius = view.lens * (5.0 - 3) / 3 * pixels_per_metre(setting, 5);   // of the cone at the ball's distance
  ASSERT_GT(radius, 3);
  EXPECT_LT((blurred.mean - sharp.mean).norm(), 0.1);
  EXPECT_NEAR(blurred.mass, sharp.mass, 0.03 * sharp.mass);   // noise
  for (int axis = 0; axis < 2; ++axis) EXPECT_NEAR(blurred.variance[axis] - sharp.variance[axis], radius * radius / 4, 0.03 * radius * radius / 4);
}

// What moves by L while the shutter is open gains L^2 / 12 in variance and stays where it is at the frame's moment.
TEST(Shutter, BlursByVelocityTimesShutter) {
  for (const double shutter : {0.5, 1.0}) {
    render::Setting setting = stage();
    const surface::Mesh moving = ball(Vec3(0, 0, 0.5), 0.05, Vec3f(6, 0, 0));
    const Spot frozen = coverage(traced(setting, moving));
    setting.camera.shutter = shutter;
    const Spot blurred = coverage(traced(setting, moving));
    const double length = 6 * shutter / setting.fps * pixels_per_metre(setting, 4);
    ASSERT_GT(length, 10);
    EXPECT_LT((blurred.mean - frozen.mean).norm(), 0.05);
    EXPECT_NEAR(blurred.mass, frozen.mass, 0.03 * frozen.mass);   // noise
    EXPECT_NEAR(blurred.variance.x() - frozen.variance.x(), length * length / 12, 0.03 * length * length / 12);
    EXPECT_NEAR(blurred.variance.y(), frozen.variance.y(), 0.1);
  }
}

// The light is small, from the left; the shadow falls to the right of the ball and moves with it.
TEST(Shutter, BlursShadowsWithWhatThrowsThem) {
  render::Setting setting = stage();
  setting.looks["ground"].color = Vec3::Ones();
  setting.lights = {{.kind = "area", .position = Vec3(-40, 0, 40), .target = Vec3(0, 0, 0), .width = 0.1, .height = 0.1, .intensity = 1e6}};
  setting.camera = {.position = Vec3(0, 0, 4), .target = Vec3(0, 0, 0), .up = Vec3(0, 1, 0), .fov = 20, .shutter = 0};
  const render::Image lit = traced(setting, {});
  ASSERT_GT(channel(lit, "R", 130, 54), 0.1);
  const surface::Mesh moving = ball(Vec3(0, 0, 0.4), 0.08, Vec3f(0, 6, 0));
  const auto shadow = [&] {
    const render::Image image = traced(setting, moving);
    return spot(image,
                [&](std::int64_t x, std::int64_t y) { return x < 110 ? 0 : std::max(0.0, 1 - channel(image, "R", x, y) / channel(lit, "R", x, y)); });
  };
  const Spot frozen = shadow();
  setting.camera.shutter = 0.5;
  const Spot blurred = shadow();
  const double length = 6 * 0.5 / setting.fps * pixels_per_metre(setting, 4);
  EXPECT_NEAR(blurred.variance.y() - frozen.variance.y(), length * length / 12, 0.1 * length * length / 12);
}

TEST(Shutter, OfWhatRestsOrOfNoTimeChangesNoBit) {
  render::Setting setting = stage();
  setting.lights = {};
  setting.options.spp = 4;
  const render::Image closed = traced(setting, ball(Vec3(0, 0, 0.5), 0.3, Vec3f::Zero()));
  render::Image frozen = traced(setting, ball(Vec3(0, 0, 0.5), 0.3, Vec3f(1, 2, 3)));
  const auto motion = static_cast<std::size_t>(std::find(frozen.channels.begin(), frozen.channels.end(), "motion.X") - frozen.channels.begin());
  for (std::size_t i = motion; i < frozen.pixels.size(); i += frozen.channels.size()) frozen.pixels[i] = frozen.pixels[i + 1] = 0;
  EXPECT_EQ(frozen.pixels, closed.pixels);
  setting.camera.shutter = 1;
  EXPECT_EQ(traced(setting, ball(Vec3(0, 0, 0.5), 0.3, Vec3f::Zero())).pixels, closed.pixels);
}

TEST(Shutter, LetsNothingThroughAWall) {
  const render::trace::Exposure exposure{.half = 0.5f, .walls = kRoom};
  EXPECT_EQ(exposure.moved(Vec3f(0, 0, 0.5f), Vec3f(1, 0, 0), 0.5f), Vec3f(0.5f, 0, 0.5f));
  EXPECT_EQ(exposure.moved(Vec3f(0.9f, 0, 0.5f), Vec3f(1, 1, 0), 0.5f), Vec3f(1, 0.5f, 0.5f)) << "stops at the wall";
  EXPECT_EQ(exposure.moved(Vec3f(1, 0, 0.5f), Vec3f(-1, 1, 0), 0.5f), Vec3f(1, 0.5f, 0.5f)) << "glides along the wall";
  EXPECT_EQ(exposure.moved(Vec3f(0, 0, -0.01f), Vec3f(0, 1, 2), 0.5f), Vec3f(0, 0.5f, -0.01f)) << "stays below the floor";
}

// A camera that moves sideways blurs what rests, by its own path.
TEST(Shutter, BlursWithAMovingCamera) {
  render::Setting setting = stage();
  setting.camera.position.reset();
  setting.camera.target.reset();
  const auto at = [](double frame, double x) { return render::CameraKey{.frame = frame, .position = Vec3(x, -4, 0.5), .target = Vec3(x, 0, 0.5)}; };
  setting.camera.keys = {at(0, -1.5), at(10, 1.5)};
  const surface::Mesh still = ball(Vec3(0, 0, 0.5), 0.05, Vec3f::Zero());
  const Spot frozen = coverage(traced(setting, still, 2, 5));
  setting.camera.shutter = 1;
  const Spot blurred = coverage(traced(setting, still, 2, 5));
  const double path = (resolve(setting.camera, kRoom, 192, 108, 5.5).position - resolve(setting.camera, kRoom, 192, 108, 4.5).position).norm();
  const double length = path * pixels_per_metre(setting, 4);
  ASSERT_GT(length, 10);
  EXPECT_NEAR(blurred.variance.x() - frozen.variance.x(), length * length / 12, 0.02 * length * length / 12);
}

// Against positions projected a thousandth of a frame before and after.
TEST(Motion, IsTheDifferenceOfProjectedPositions) {
  render::Setting setting = stage();
  setting.options.spp = 16;
  setting.camera.turntable = render::Turntable{.frames = 20};
  const Vec3f velocity(2, 1, 3);
  const surface::Mesh mesh = ball(Vec3(0.1, 0, 0.5), 0.3, velocity);
  for (const double shutter : {0.0, 0.5}) {
    setting.camera.shutter = shutter;
    const render::Image image = traced(setting, mesh, 2, 3);
    const View now = resolve(setting.camera, kRoom, 192, 108, 3);
    const auto moved = [&](const Vec3& p, const Vec3& v) {
      const double h = 1e-3;
      const Vector2d to = projected(resolve(setting.camera, kRoom, 192, 108, 3 + h), p + h / 24 * v, 192, 108);
      return Vector2d((to - projected(resolve(setting.camera, kRoom, 192, 108, 3 - h), p - h / 24 * v, 192, 108)) / (2 * h));
    };
    const auto check = [&](std::int64_t x, std::int64_t y, double depth, const Vec3& v) {
      const Vec3 p = now.position + depth * (now.forward + (2 * (static_cast<double>(x) + 0.5) / 192 - 1) * now.tan_x * now.right +
                                             (1 - 2 * (static_cast<double>(y) + 0.5) / 108) * now.tan_y * now.up);
      const Vector2d expected = moved(p, v);
      ASSERT_GT(expected.norm(), 1);
      EXPECT_NEAR(channel(image, "motion.X", x, y), expected.x(), 0.02 * expected.norm()) << x;
      EXPECT_NEAR(channel(image, "motion.Y", x, y), -expected.y(), 0.02 * expected.norm()) << x;   // up in the file, down in rows
    };
    const Vector2d middle = projected(now, Vec3(0.1, 0, 0.5), 192, 108);
    const auto x = static_cast<std::int64_t>(middle.x()), y = static_cast<std::int64_t>(middle.y());
    check(x, y, (Vec3(0.1, 0, 0.5) - now.position).dot(now.forward) - 0.3, velocity.cast<double>());
    check(10, 5, 1e7, Vec3::Zero());   // the sky turns with the camera
    ASSERT_EQ(channel(image, "id", 10, 100), 1);
    const double below = -(now.forward + (1 - 2 * 100.5 / 108) * now.tan_y * now.up).z();   // [m] for a metre of depth
    constexpr double kGround = 2.1e-4;   // [m] the ground is seen four offsets of rays above the floor
    check(10, 100, (now.position.z() - kGround) / below, Vec3::Zero());
    EXPECT_EQ(channel(image, "id", x, y), 2);
    EXPECT_EQ(channel(image, "id", 10, 5), 0);
  }
}

// A collider is drawn where it is at the frame's moment; its motion is told all the same, and so is that of its image across a periodic side.
TEST(Motion, OfCollidersIsTheirs) {
  render::Setting setting = stage();
  setting.options.spp = 16;
  sim::Collider collider;
  collider.name = "ball";
  collider.look = "plaster";
  collider.shape.sphere = sim::Shape::Sphere{Vec3(-0.5, 0, 0.5), 0.2};
  collider.velocity = Vec3(0, 0, 2);
  setting.colliders = {collider};
  setting.images = {{0, collider.shape}};
  setting.images[0].shape.sphere->center.x() = 0.5;
  const render::Image image = traced(setting, surface::Mesh{});
  const View view = resolve(setting.camera, kRoom, 192, 108, 1);
  for (const double x : {-0.5, 0.5}) {
    const Vec3 middle(x, 0, 0.5);
    const Vector2d at = projected(view, middle, 192, 108);
    const double depth = (middle - view.position).dot(view.forward) - 0.2, up = 2.0 / 24 / depth / view.tan_y * 54;
    const auto i = static_cast<std::int64_t>(at.x()), j = static_cast<std::int64_t>(at.y());
    EXPECT_EQ(channel(image, "id", i, j), 3) << x;
    EXPECT_NEAR(channel(image, "motion.Y", i, j), up, 0.03 * up) << x;
  }
}

TEST(Motion, IsNoneWhereNothingMoves) {
  const render::Image image = traced(stage(), ball(Vec3(0, 0, 0.5), 0.3, Vec3f::Zero()));
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x)
      ASSERT_EQ(std::abs(channel(image, "motion.X", x, y)) + std::abs(channel(image, "motion.Y", x, y)), 0);
}

TEST(Shutter, GivesTheSameBitsForAnyNumberOfThreads) {
  render::Setting setting = stage();
  setting.lights = {};
  setting.looks["white"] = setting.looks["water"];
  setting.options.spp = 4;
  setting.options.bounces = 8;
  setting.camera.shutter = 0.5;
  setting.camera.aperture = 1.4;
  setting.camera.turntable = render::Turntable{};
  const surface::Mesh mesh = ball(Vec3(0, 0, 0.5), 0.4, Vec3f(3, 2, 1));
  const render::Image one = traced(setting, mesh, 1);
  EXPECT_EQ(traced(setting, mesh, 2).pixels, one.pixels);
  EXPECT_EQ(traced(setting, mesh, 4).pixels, one.pixels);
}
