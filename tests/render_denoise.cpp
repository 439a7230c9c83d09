// Noise taken out of pictures: what is alike is averaged, what is not stays, and nothing is touched unasked.
#include <gtest/gtest.h>

#include <random>

#include "base/scratch_folder.h"
#include "render/image/denoise.h"
#include "tests/render_trace.h"

namespace {

using namespace tests;
using render::image::Estimates;

constexpr std::int64_t kWidth = 64, kHeight = 48;

/// Nothing known but grey, with the noise of `variance`.
Estimates grey(float value, float variance) {
  Estimates e{.width = kWidth, .height = kHeight, .color = {}, .color_variance = {}, .guide = {}, .guide_variance = {}};
  constexpr std::size_t kPixels = kWidth * kHeight;
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, std::sqrt(variance));
  for (std::size_t c = 0; c < 3; ++c) {
    e.color[c].resize(kPixels);
    for (float& v : e.color[c]) v = variance > 0 ? value + noise(random) : value;
    e.color_variance[c].assign(kPixels, variance);
  }
  for (std::size_t g = 0; g < render::image::kGuides; ++g) {
    e.guide[g].assign(kPixels, 0);
    e.guide_variance[g].assign(kPixels, 0);
  }
  return e;
}

/// Root mean square of the difference to `expected` of red.
template <class Expected>
double error(const std::vector<float>& colors, const Expected& expected) {
  double sum = 0;
  for (std::int64_t y = 0; y < kHeight; ++y)
    for (std::int64_t x = 0; x < kWidth; ++x)
      sum += std::pow(static_cast<double>(colors[static_cast<std::size_t>(y * kWidth + x) * 3]) - expected(x, y), 2);
  return std::sqrt(sum / (kWidth * kHeight));
}

std::size_t channel(const render::Image& image, const std::string& name) {
  return static_cast<std::size_t>(std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin());
}

/// Balls on a floor, in soft light.
render::Setting balls() {
  render::Setting setting = empty_setting();
  setting.lights = {{.kind = "area", .position = Vec3(-1, -1, 2.5), .target = Vec3(0, 0, 0), .width = 1.5, .height = 1.5, .intensity = 4},
                    uniform_sky(0.2)};
  const char* looks[] = {"clay", "glass", "steel", "plaster"};
  for (int i = 0; i < 4; ++i) setting.colliders.push_back(ball(looks[i], Vec3(-0.75 + 0.5 * i, 0, 0.22), 0.22));
  setting.camera = {.position = Vec3(0, -3, 1), .target = Vec3(0, 0, 0.2), .fov = 26};
  setting.options.width = 96;
  setting.options.height = 64;
  return setting;
}

/// Mean absolute error of three channels from `name` on against red, green and blue of the other picture.
double error(const render::Image& image, const std::string& name, const render::Image& reference) {
  const std::size_t first = channel(image, name);
  double sum = 0;
  const std::size_t pixels = static_cast<std::size_t>(image.width * image.height);
  for (std::size_t i = 0; i < pixels; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      sum += std::abs(static_cast<double>(image.pixels[i * image.channels.size() + first + c] - reference.pixels[i * reference.channels.size() + c]));
  return sum / static_cast<double>(3 * pixels);
}

}  // namespace

TEST(Denoise, KeepsAPictureWithoutNoise) {
  Estimates e = grey(0.7f, 0);
  for (std::size_t i = 0; i < e.color[0].size(); ++i) e.color[0][i] = i % kWidth < 20 ? 0.1f : 3.0f;
  EXPECT_LT(error(render::image::denoise(e), [](std::int64_t x, std::int64_t) { return x < 20 ? 0.1 : 3.0; }), 1e-5);
}

// A mean of n equal pixels has 1 / sqrt(n) of the noise; the window holds 361, the edges of the picture fewer.
TEST(Denoise, AveragesWhatIsAlike) {
  const Estimates e = grey(0.5f, 0.01f);
  const std::vector<float> quiet = render::image::denoise(e);
  EXPECT_LT(error(quiet, [](std::int64_t, std::int64_t) { return 0.5; }), 0.1 / 6);
  double mean = 0;
  for (const float v : quiet) mean += static_cast<double>(v) / static_cast<double>(quiet.size());
  EXPECT_NEAR(mean, 0.5, 3e-3);
}

// One bright path among a pixel's many is no light on its neighbours; a pixel that all of its paths find bright is.
TEST(Denoise, LeavesNoSquareAroundAPixelThatOnePathHasMadeBright) {
  constexpr std::size_t kSpike = 24 * kWidth + 32, kBesideIt = kSpike + 2;
  Estimates e = grey(0.5f, 1e-4f);
  for (auto& plane : e.color) plane[kSpike] = 400, plane[kBesideIt] = 30;
  for (auto& plane : e.color_variance) plane[kSpike] = 400.0f * 400, plane[kBesideIt] = 30.0f * 30;
  EXPECT_LT(error(render::image::denoise(e), [](std::int64_t, std::int64_t) { return 0.5; }), 5e-3);
  for (auto& plane : e.color_variance) plane[kSpike] = 1;
  EXPECT_NEAR(render::image::denoise(e)[3 * kSpike], 400, 1);
}

// The step is three times the noise of a pixel.
TEST(Denoise, KeepsEdgesOfColor) {
  Estimates e = grey(0.5f, 0.01f);
  for (auto& plane : e.color)
    for (std::size_t i = 0; i < plane.size(); ++i) plane[i] += i % kWidth < 32 ? 0.0f : 0.3f;
  EXPECT_LT(error(render::image::denoise(e), [](std::int64_t x, std::int64_t) { return x < 32 ? 0.5 : 0.8; }), 0.1 / 3);
}

// A line too faint for its noise stays where a guide tells it from its surroundings, and is lost where none does.
TEST(Denoise, FollowsItsGuides) {
  Estimates e = grey(0.5f, 0.01f);
  const auto line = [](std::int64_t x, std::int64_t) { return x / 2 == 15 ? 0.56 : 0.5; };
  for (auto& plane : e.color)
    for (std::size_t i = 0; i < plane.size(); ++i) plane[i] += static_cast<float>(line(static_cast<std::int64_t>(i) % kWidth, 0) - 0.5);
  const auto on_line = [&](const std::vector<float>& colors) {
    double sum = 0;
    for (std::int64_t y = 0; y < kHeight; ++y)
      sum += 0.5 * static_cast<double>(colors[static_cast<std::size_t>(y * kWidth + 30) * 3] + colors[static_cast<std::size_t>(y * kWidth + 31) * 3]);
    return sum / kHeight;
  };
  EXPECT_LT(on_line(render::image::denoise(e)), 0.53);
  for (std::size_t i = 0; i < e.guide[3].size(); ++i) e.guide[3][i] = line(static_cast<std::int64_t>(i) % kWidth, 0) > 0.5 ? 0.8f : 0.2f;
  EXPECT_NEAR(on_line(render::image::denoise(e)), 0.56, 0.01);
}

TEST(Denoise, TakesMostOfTheErrorOutOfAPicture) {
  render::Setting setting = balls();
  setting.options.width *= 2;
  setting.options.height *= 2;
  setting.options.spp = 4;
  setting.options.denoise = "layer";
  const render::Image noisy = traced(setting, {});
  setting.options.spp = 512;
  setting.options.denoise = "none";
  const render::Image reference = traced(setting, {}, 2, 2);
  const double before = error(noisy, "R", reference), after = error(noisy, "denoised.R", reference);
  ASSERT_GT(before, 0.005);
  EXPECT_LT(after, 0.5 * before);
  Vec3 quiet = Vec3::Zero(), raw = Vec3::Zero();
  for (std::size_t i = 0; i < noisy.pixels.size(); i += noisy.channels.size())
    for (std::size_t c = 0; c < 3; ++c) {
      raw[static_cast<int>(c)] += static_cast<double>(noisy.pixels[i + c]);
      quiet[static_cast<int>(c)] += static_cast<double>(noisy.pixels[i + channel(noisy, "denoised.R") + c]);
    }
  EXPECT_LT((quiet - raw).norm(), 0.01 * raw.norm()) << "light is moved, not made";
}

TEST(Denoise, IsDoneOnlyWhereItIsAskedFor) {
  render::Setting setting = balls();
  setting.options.spp = 4;
  const render::Image without = traced(setting, {});
  EXPECT_EQ(channel(without, "denoised.R"), without.channels.size());
  base::Ledger ledger;
  setting.options.denoise = "layer";
  const render::Image with = render::PathTracer(setting, 2).trace({}, 1, ledger);
  EXPECT_EQ(ledger.passes().count("denoise"), 1u);
  ASSERT_EQ(with.channels.size(), without.channels.size() + 3);
  for (std::size_t i = 0; i < without.pixels.size(); ++i)
    ASSERT_EQ(with.pixels[i / without.channels.size() * with.channels.size() + i % without.channels.size()], without.pixels[i])
        << "the other channels stay as they are";
}

TEST(Denoise, ReachesThePngWhereThatIsAskedFor) {
  const base::ScratchFolder folder;
  render::Setting setting = balls();
  setting.options.spp = 4;
  setting.options.denoise = "layer";
  const render::Image image = traced(setting, {});
  std::map<std::string, std::vector<float>> shown;
  for (const char* denoise : {"none", "layer", "picture"}) {
    base::Ledger ledger;
    setting.options.denoise = denoise;
    render::write_png(folder.path() / "a.png", image, setting.options, false, ledger);
    shown[denoise] = render::read_image(folder.path() / "a.png").pixels;
  }
  EXPECT_EQ(shown["layer"], shown["none"]);
  EXPECT_NE(shown["picture"], shown["none"]);
}

TEST(Denoise, GivesTheSameBitsForAnyNumberOfThreads) {
  render::Setting setting = balls();
  setting.options.spp = 8;
  setting.options.denoise = "layer";
  setting.camera.aperture = 0.5;
  const render::Image one = traced(setting, {}, 1);
  EXPECT_EQ(traced(setting, {}, 2).pixels, one.pixels);
  EXPECT_EQ(traced(setting, {}, 4).pixels, one.pixels);
}

// Through glass and in a mirror the floor is the guide: its colour, less what the boundaries keep.
TEST(Guides, AreOfWhatScattersFirst) {
  for (const bool mirror : {false, true}) {
    render::Setting setting = empty_setting();
    setting.looks["ground"] = {.color = Vec3(0.2, 0.5, 0.8)};
    setting.looks["mirror"] = {.model = "conductor", .color = Vec3::Ones()};
    setting.colliders = {mirror ? block("mirror", {Vec3(-1, 0.5, 0), Vec3(1, 0.6, 1)}) : block("glass", {Vec3(-1, -1, 0.3), Vec3(1, 1, 0.4)})};
    setting.looks["glass"].absorption.setZero();
    const trace::Scene scene = trace::make_scene(setting);
    trace::Geometry geometry(scene.surfaces, 1);
    const render::Grains none;
    geometry.set_frame({}, none, {});
    const trace::Integrator integrator(scene, geometry);
    const trace::Ray ray{.origin = mirror ? Vec3f(0, -1, 0.8f) : Vec3f(0, 0, 0.8f),
                         .direction = (mirror ? Vec3f(0, 1.5f, -0.3f) : Vec3f(0.1f, 0.1f, -1)).normalized()};
    Vec3f albedo = Vec3f::Zero(), normal = Vec3f::Zero();
    constexpr int kSamples = 512;
    const render::sampling::Sequence sequence(kSamples, 1);
    const render::sampling::PixelSampler points(sequence, 0, 0);
    trace::FirstHit first;
    for (std::uint32_t s = 0; s < kSamples; ++s) {
      first = {};
      integrator.radiance(ray, {}, points, s, first);
      albedo += first.guide_albedo / kSamples;
      normal += first.guide_normal / kSamples;
    }
    const double through = mirror ? 1 : 0.923;  // of a pane: (1 - r) / (1 + r) with r = 0.04
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(static_cast<double>(albedo[c]), through * setting.looks["ground"].color[c], 0.03 * setting.looks["ground"].color[c]) << mirror << c;
    EXPECT_NEAR(normal.z(), through, 0.03) << mirror;
    EXPECT_EQ(first.albedo, Vec3f::Ones()) << "the picture's own channel is of the first hit";
  }
}
