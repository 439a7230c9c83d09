// Pictures of two-dimensional shots against what geometry says. Where the domain is, is read from the picture of an empty one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <random>
#include <string>
#include <tuple>

#include "render/image/tone.h"
#include "render/raster/closing.h"
#include "render/raster/colors.h"
#include "render/render.h"

namespace {

using base::Vec3;
using base::Vec3f;

constexpr double kTopSpeed = 2;   // [m/s]

render::Setting plane(const Vec3& upper, std::int64_t width = 400, std::int64_t height = 300) {
  render::Setting setting;
  setting.dimension = 2;
  setting.domain = {Vec3(-0.5, 0.25, 0), upper};
  setting.options.width = width;
  setting.options.height = height;
  return setting;
}
render::Setting unit_square() { return plane(Vec3(0.5, 1.25, 0)); }

sim::Frame particles(const std::vector<Vec3f>& at, double radius, float speed = 1) {
  sim::Frame frame;
  frame.position = at;
  frame.velocity.assign(at.size(), Vec3f(0, -speed, 0));
  for (std::size_t i = 0; i < at.size(); ++i) frame.id.push_back(static_cast<std::int64_t>(i));
  frame.pscale = radius;
  return frame;
}

Vec3 pixel(const render::Image& image, std::int64_t x, std::int64_t y) {
  const float* p = &image.pixels[static_cast<std::size_t>((y * image.width + x) * 4)];
  return {p[0], p[1], p[2]};
}

render::Image empty_picture(const render::Setting& setting) {
  render::Setting bare = setting;
  bare.colliders.clear();
  return render::preview(bare, {}, "", kTopSpeed);
}

/// Pixels of the domain: those like the picture's middle, where nothing is drawn.
struct Window {
  std::int64_t left, right, top, bottom;   // first and last
  Vec3 air;
  double width() const { return static_cast<double>(right - left + 1); }
  double height() const { return static_cast<double>(bottom - top + 1); }
};
Window window_of(const render::Setting& setting) {
  const render::Image image = empty_picture(setting);
  Window w{image.width, -1, image.height, -1, pixel(image, image.width / 2, image.height / 2)};
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x)
      if (pixel(image, x, y) == w.air) w = {std::min(w.left, x), std::max(w.right, x), std::min(w.top, y), std::max(w.bottom, y), w.air};
  return w;
}

/// What of the window is not air: area [pixels] and its middle. Pixels at an edge count in part, as far as `color` shows.
struct Ink {
  double area = 0;
  Eigen::Vector2d middle{0, 0};
};
Ink ink(const render::Image& image, const Window& w, const Vec3& color) {
  Ink sum;
  const Vec3 contrast = color - w.air;
  for (std::int64_t y = w.top; y <= w.bottom; ++y)
    for (std::int64_t x = w.left; x <= w.right; ++x) {
      const double part = (pixel(image, x, y) - w.air).dot(contrast) / contrast.squaredNorm();
      sum.area += part;
      sum.middle += part * Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
    }
  sum.middle /= sum.area;
  return sum;
}


Vec3 color_of(double speed) { return render::raster::viridis(static_cast<float>(speed / kTopSpeed)).cast<double>(); }

/// One particle at random in each square of side `spacing` of the unit square.
std::vector<Vec3f> full_square(int across, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<Vec3f> at;
  for (int j = 0; j < across; ++j)
    for (int i = 0; i < across; ++i)
      at.emplace_back(-0.5f + (static_cast<float>(i) + uniform(random)) / static_cast<float>(across),
                      0.25f + (static_cast<float>(j) + uniform(random)) / static_cast<float>(across), 0);
  return at;
}
double radius_of(int across) { return 1 / (across * std::sqrt(std::numbers::pi)); }

std::uint64_t digest(const render::Image& image) {
  std::uint64_t h = 14695981039346656037u;
  for (const float p : image.pixels) h = (h ^ static_cast<std::uint64_t>(std::lround(p * 255 * 4))) * 1099511628211u;
  return h;
}

/// The liquid whose bits are compared.
std::uint64_t liquid_digest() {
  sim::Frame frame = particles(full_square(60, 6), radius_of(60));
  for (std::size_t i = 0; i < frame.velocity.size(); ++i) frame.velocity[i] *= static_cast<float>(i % 7) / 6;
  return digest(render::preview(unit_square(), frame, "", kTopSpeed));
}

/// liquid_digest() as this program says it when OpenGL has so many threads.
std::string digest_with_threads(const std::string& threads) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string command =
      "FLAT_SAYS_ITS_BITS=1 LP_NUM_THREADS=" + threads + " '" + program + "' --gtest_filter=Flat.PictureHasTheSameBitsForAnyNumberOfThreads";
  FILE* out = popen(command.c_str(), "r");
  if (out == nullptr) return "";
  std::string bits;
  for (char line[256]; std::fgets(line, sizeof line, out) != nullptr;)
    if (std::string(line).starts_with("bits ")) bits = line;
  return pclose(out) == 0 ? bits : "";
}

}  // namespace

TEST(Flat, PictureHasTheDomainsProportionsInItsMiddle) {
  for (const Vec3& upper : {Vec3(0.5, 1.25, 0), Vec3(7.5, 1.25, 0), Vec3(-0.25, 2.25, 0), Vec3(1.5, 1.65, 0)})
    for (const auto& [width, height] : {std::pair{400, 300}, {960, 540}, {160, 90}, {300, 700}}) {
      const render::Setting setting = plane(upper, width, height);
      const Window w = window_of(setting);
      const Vec3 size = setting.domain.size();
      const double scale = std::max(w.width() / size.x(), w.height() / size.y());   // of the longer side: an outline may cover half a pixel
      EXPECT_NEAR(w.width(), scale * size.x(), 2) << upper.transpose() << " in " << width << " x " << height;
      EXPECT_NEAR(w.height(), scale * size.y(), 2);
      EXPECT_NEAR(0.5 * static_cast<double>(w.left + w.right + 1), 0.5 * width, 1);
      EXPECT_NEAR(0.5 * static_cast<double>(w.top + w.bottom + 1), 0.5 * height, 1);
      EXPECT_GE(std::max(w.width() / width, w.height() / height), 0.5);   // as large as margins allow
    }
}

TEST(Flat, ParticleLandsOnItsPixel) {
  const render::Setting setting = unit_square();
  const Window w = window_of(setting);
  for (const Eigen::Vector2d& part : {Eigen::Vector2d(0.5, 0.5), Eigen::Vector2d(0.2, 0.1), Eigen::Vector2d(0.85, 0.3), Eigen::Vector2d(0.1, 0.9)}) {
    const Vec3f at(static_cast<float>(part.x() - 0.5), static_cast<float>(part.y() + 0.25), 0);
    const Ink drawn = ink(render::preview(setting, particles({at}, 0.03), "", kTopSpeed), w, color_of(1));
    EXPECT_NEAR(drawn.middle.x(), static_cast<double>(w.left) + part.x() * w.width(), 0.6);
    EXPECT_NEAR(drawn.middle.y(), static_cast<double>(w.bottom + 1) - part.y() * w.height(), 0.6) << "y points up";
  }
}

// A disc of r samples is right to about a sample in its radius' rounding: 2 / (2 r), r twice the radius in pixels.
TEST(Flat, LoneParticleHasTheAreaOfADiscOfItsRadius) {
  const render::Setting setting = plane(Vec3(0.5, 1.25, 0), 800, 600);
  const Window w = window_of(setting);
  for (const double radius : {0.01, 0.03, 0.1}) {
    const double pixels = radius * w.width(), expected = std::numbers::pi * pixels * pixels;
    const Ink drawn = ink(render::preview(setting, particles({Vec3f(0.013f, 0.777f, 0)}, radius), "", kTopSpeed), w, color_of(1));
    EXPECT_NEAR(drawn.area, expected, expected / (2 * pixels)) << radius;
  }
}

TEST(Flat, SpeedIsShownInViridis) {
  const render::Setting setting = unit_square();
  for (const float speed : {0.0f, 0.5f, 1.3f, 2.0f, 9.0f}) {
    const render::Image image = render::preview(setting, particles({Vec3f(0, 0.75f, 0)}, 0.1, speed), "", kTopSpeed);
    EXPECT_LT((pixel(image, 200, 150) - color_of(speed)).cwiseAbs().maxCoeff(), 1.01 / 255) << speed;
  }
}

// Stratified particles leave holes of more than a spacing between discs of their own area; the liquid is full all the same.
TEST(Flat, FullLiquidHasNoGaps) {
  const render::Setting setting = unit_square();
  const Window w = window_of(setting);
  for (const unsigned seed : {1u, 2u, 3u}) {
    const render::Image image = render::preview(setting, particles(full_square(24, seed), radius_of(24)), "", kTopSpeed);
    EXPECT_NEAR(ink(image, w, color_of(1)).area, w.width() * w.height(), 0.002 * w.width() * w.height());
  }
}

TEST(Flat, HoleInTheLiquidStaysOpenAndKeepsItsSize) {
  const render::Setting setting = unit_square();
  const Window w = window_of(setting);
  constexpr double kRadius = 0.2;   // [m]
  std::vector<Vec3f> at = full_square(40, 4);
  const auto removed = static_cast<double>(std::erase_if(at, [](const Vec3f& p) { return (p - Vec3f(0, 0.75f, 0)).norm() < kRadius; }));
  const double hole = w.width() * w.height() - ink(render::preview(setting, particles(at, radius_of(40)), "", kTopSpeed), w, color_of(1)).area;
  EXPECT_NEAR(std::sqrt(hole / std::numbers::pi) / w.width(), std::sqrt(removed / 1600 / std::numbers::pi), 0.25 / 40);   // a quarter of a spacing
}

TEST(Flat, NothingIsDrawnOutsideTheDomain) {
  const render::Setting setting = unit_square();
  const Window w = window_of(setting);
  const render::Image empty = empty_picture(setting);
  const render::Image image = render::preview(
      setting, particles({Vec3f(-0.5f, 0.7f, 0), Vec3f(0.5f, 1.25f, 0), Vec3f(0.7f, 0.5f, 0), Vec3f(0, 0, 0), Vec3f(0, 1e6f, 0)}, 0.1), "",
      kTopSpeed);
  EXPECT_GT(ink(image, w, color_of(1)).area, 100);
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x)
      if (x < w.left || x > w.right || y < w.top || y > w.bottom) {
        ASSERT_EQ(pixel(image, x, y), pixel(empty, x, y)) << x << ", " << y;
      }
}

TEST(Flat, CollidersAreFilledAndStandBeforeTheLiquid) {
  render::Setting setting = plane(Vec3(0.5, 1.25, 0), 800, 600);
  const Window w = window_of(setting);
  sim::Collider box, disc;
  box.shape.box = base::Box{Vec3(-0.4, 0.3, 0), Vec3(-0.2, 0.8, 0)};
  disc.shape.sphere = sim::Shape::Sphere{Vec3(0.2, 0.9, 0), 0.15};
  for (const auto& [collider, area, x, y] : {std::tuple{box, 0.1, -0.3, 0.55}, std::tuple{disc, std::numbers::pi * 0.15 * 0.15, 0.2, 0.9}}) {
    setting.colliders = {collider};
    const render::Image dry = render::preview(setting, {}, "", kTopSpeed);
    const Vec3 solid = pixel(dry, w.left + std::lround((x + 0.5) * w.width()), w.bottom - std::lround((y - 0.25) * w.height()));
    ASSERT_GT((solid - w.air).norm(), 0.1);
    const Ink drawn = ink(dry, w, solid);
    EXPECT_NEAR(drawn.area, area * w.width() * w.height(), 0.01 * drawn.area);
    EXPECT_NEAR(drawn.middle.x(), static_cast<double>(w.left) + (x + 0.5) * w.width(), 0.6);
    EXPECT_NEAR(drawn.middle.y(), static_cast<double>(w.bottom + 1) - (y - 0.25) * w.height(), 0.6);
    const render::Image wet = render::preview(setting, particles(full_square(24, 1), radius_of(24)), "", kTopSpeed);
    const auto mx = std::lround(drawn.middle.x()), my = std::lround(drawn.middle.y());
    EXPECT_EQ(pixel(wet, mx, my), solid);
  }
}

// Where discs overlap, the nearest middle decides, so the order in which particles come cannot show.
TEST(Flat, OrderOfParticlesDoesNotShow) {
  const render::Setting setting = unit_square();
  sim::Frame frame = particles(full_square(24, 5), radius_of(24));
  for (std::size_t i = 0; i < frame.velocity.size(); ++i) frame.velocity[i] *= static_cast<float>(i % 7) / 6;
  const render::Image forward = render::preview(setting, frame, "", kTopSpeed);
  std::reverse(frame.position.begin(), frame.position.end());
  std::reverse(frame.velocity.begin(), frame.velocity.end());
  EXPECT_EQ(forward.pixels, render::preview(setting, frame, "", kTopSpeed).pixels);
}

// OpenGL's threads are counted once a process; so each count has a process of its own.
TEST(Flat, PictureHasTheSameBitsForAnyNumberOfThreads) {
  if (std::getenv("FLAT_SAYS_ITS_BITS") != nullptr) {
    std::printf("bits %016llx\n", static_cast<unsigned long long>(liquid_digest()));
    return;
  }
  const std::string one = digest_with_threads("1");
  ASSERT_EQ(one.size(), 22u) << one;
  EXPECT_EQ(one, digest_with_threads("0"));
  EXPECT_EQ(one, digest_with_threads("4"));
}

TEST(Flat, SmallestPictureShowsTheDomain) {
  for (const Vec3& upper : {Vec3(0.5, 1.25, 0), Vec3(99.5, 1.25, 0), Vec3(-0.4, 90.25, 0)}) {
    const render::Setting setting = plane(upper, 16, 16);
    const sim::Frame frame = particles({(0.5 * (setting.domain.lower + setting.domain.upper)).cast<float>()}, 0.01);
    const render::Image image = render::preview(setting, frame, "a caption longer than the picture", kTopSpeed);
    ASSERT_EQ(image.pixels.size(), 16u * 16 * 4);
    EXPECT_NE(pixel(image, 0, 0), pixel(image, 8, 8));
    for (const float p : image.pixels) ASSERT_TRUE(p >= 0 && p <= 1);
  }
}

TEST(Flat, CaptionAndSpeedAtRestAreDrawn) {
  const render::Setting setting = unit_square();
  EXPECT_NE(render::preview(setting, {}, "frame 1", kTopSpeed).pixels, render::preview(setting, {}, "frame 2", kTopSpeed).pixels);
  for (const float p : render::preview(setting, particles({Vec3f(0, 0.75f, 0)}, 0.1, 0), "", 0).pixels) ASSERT_TRUE(std::isfinite(p));
}

TEST(Flat, ALegendHasRoomBesideTheDomain) {
  render::Setting setting = plane(Vec3(1.1, 1.25, 0), 640, 400);
  setting.preview.color = "material";
  setting.materials = {"pool, water_mpm", "heavy, dry_sand"};
  const Window w = window_of(setting);
  const render::Image image = empty_picture(setting);
  for (std::int64_t y = w.top; y <= w.bottom; ++y)
    for (std::int64_t x = w.left; x <= w.right; ++x) ASSERT_EQ(pixel(image, x, y), w.air) << x << ", " << y;
}

TEST(SceneLinear, IsUndoneByTheDisplaysCode) {
  render::Image image{.width = 256, .height = 1, .channels = {"R", "G", "B", "A"}, .pixels = {}};
  for (int i = 0; i < 256; ++i)
    image.pixels.insert(image.pixels.end(), {static_cast<float>(i) / 255, static_cast<float>(255 - i) / 255, 0.5f, 0.25f});
  const render::Image light = render::scene_linear(image);
  EXPECT_NEAR(light.pixels[2], 0.21404, 1e-5);   // [IEC 61966-2-1] of one half
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (i % 4 == 3) {
      EXPECT_EQ(light.pixels[i], 0.25f);
    } else {
      EXPECT_NEAR(render::image::srgb_code(light.pixels[i]), image.pixels[i], 1e-6);
    }
  }
}

// Against the definition, sample by sample.
TEST(Erosion, ClearsWhatIsWithinTheRadiusOfAClearSample) {
  constexpr std::int64_t kWidth = 60, kHeight = 45;
  std::mt19937 random(1);
  for (const std::int64_t radius : {0, 1, 4, 7, 100}) {
    std::vector<std::uint8_t> mask(kWidth * kHeight, 1);
    for (int k = 0; k < 9; ++k) mask[random() % mask.size()] = 0;
    std::vector<std::uint8_t> eroded = mask;
    render::raster::erode(eroded, kWidth, radius);
    for (std::int64_t i = 0; i < kWidth * kHeight; ++i) {
      bool kept = true;
      for (std::int64_t j = 0; j < kWidth * kHeight; ++j) {
        const std::int64_t dx = i % kWidth - j % kWidth, dy = i / kWidth - j / kWidth;
        if (mask[static_cast<std::size_t>(j)] == 0 && dx * dx + dy * dy <= radius * radius) kept = false;
      }
      ASSERT_EQ(eroded[static_cast<std::size_t>(i)] != 0, kept) << "radius " << radius << ", sample " << i;
    }
  }
}
