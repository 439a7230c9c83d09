// What previews are coloured by, against motions whose curl is known; scales, surfaces, axes and sheets.
#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.h"
#include "render/attribute/attribute.h"
#include "render/raster/canvas.h"
#include "render/raster/colors.h"
#include "render/view/view.h"
#include "tests/closed_meshes.h"
#include "tests/render_scenes.h"

namespace {

using namespace tests;

/// Particles of a full box (or square) of 24 to a side, and the velocity at each.
template <class Velocity>
sim::Frame full(std::int64_t dimension, const Velocity& velocity) {
  constexpr int kSides = 24;
  sim::Frame frame;
  const double spacing = 1.0 / kSides;
  for (int k = 0; k < (dimension == 3 ? kSides : 1); ++k)
    for (int j = 0; j < kSides; ++j)
      for (int i = 0; i < kSides; ++i) {
        const Vec3 p = spacing * Vec3(i + 0.5, j + 0.5, dimension == 3 ? k + 0.5 : 0);
        frame.id.push_back(static_cast<std::int64_t>(frame.id.size()));
        frame.position.push_back(p.cast<float>());
        frame.velocity.push_back(velocity(p).template cast<float>());
      }
  frame.pscale = spacing * (dimension == 3 ? std::cbrt(3 / (4 * std::numbers::pi)) : std::sqrt(1 / std::numbers::pi));
  return frame;
}

render::Setting coloured(std::int64_t dimension, const std::string& color) {
  render::Setting setting;
  setting.dimension = dimension;
  setting.domain = {Vec3(0, 0, 0), Vec3(1, 1, dimension == 3 ? 1 : 0)};
  setting.preview.color = color;
  setting.options.width = 320;
  setting.options.height = 180;
  return setting;
}

/// CIE L* of a display colour.
double lightness(const Vec3f& c) {
  double y = 0;
  const double weights[] = {0.2126, 0.7152, 0.0722};
  for (int i = 0; i < 3; ++i)
    y += weights[i] * (c[i] <= 0.04045f ? static_cast<double>(c[i]) / 12.92 : std::pow((static_cast<double>(c[i]) + 0.055) / 1.055, 2.4));
  return 116 * std::cbrt(y) - 16;
}

std::size_t changed(const render::Image& a, const render::Image& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 4) count += !std::equal(&a.pixels[i], &a.pixels[i] + 3, &b.pixels[i]);
  return count;
}

}  // namespace

// A rigid rotation has twice its angular velocity everywhere: a linear fit of a linear field is exact, at the rim too.
TEST(Vorticity, OfARigidRotationIsTwiceItsAngularVelocity) {
  for (const double omega : {3.0, -2.0}) {
    const sim::Frame flat = full(2, [&](const Vec3& p) { return Vec3(-omega * (p.y() - 0.5), omega * (p.x() - 0.5), 0); });
    for (const float v : render::attribute::values(coloured(2, "vorticity"), flat)) EXPECT_NEAR(v, 2 * omega, 0.06 * std::abs(omega));
  }
  const Vec3 omega(1, -2, 2);
  const sim::Frame solid = full(3, [&](const Vec3& p) { return Vec3(omega.cross(p - Vec3::Constant(0.5))); });
  std::vector<float> seen = render::attribute::values(coloured(3, "vorticity"), solid);
  for (const float v : seen) EXPECT_NEAR(v, 6, 0.3);
}

TEST(Vorticity, OfATranslationAndOfAStrainIsNone) {
  const sim::Frame moving = full(3, [](const Vec3&) { return Vec3(3, -1, 2); });
  for (const float v : render::attribute::values(coloured(3, "vorticity"), moving)) EXPECT_NEAR(v, 0, 1e-3);
  const sim::Frame strained = full(2, [](const Vec3& p) { return Vec3(4 * p.x(), -4 * p.y(), 0); });
  for (const float v : render::attribute::values(coloured(2, "vorticity"), strained)) EXPECT_NEAR(v, 0, 0.1);
}

TEST(Attribute, IsWhatItsNameSays) {
  const sim::Frame frame = full(3, [](const Vec3&) { return Vec3(3, -4, 12); });
  const std::pair<const char*, float> expected[] = {{"speed", 13}, {"velocity_x", 3}, {"velocity_y", -4}, {"velocity_z", 12}};
  surface::Mesh mesh = sphere_mesh(Vec3(0.5, 0.5, 0.5), 0.2, 8);
  for (Vec3f& v : mesh.velocity) v = Vec3f(3, -4, 12);
  for (const auto& [name, value] : expected) {
    for (const float v : render::attribute::values(coloured(3, name), frame)) ASSERT_NEAR(v, value, 1e-5) << name;
    for (const float v : render::attribute::values(coloured(3, name), frame, mesh)) ASSERT_NEAR(v, value, 1e-5) << name;
  }
}

TEST(Attribute, OfParticlesIsWhatTheyCarry) {
  sim::Frame frame = full(3, [](const Vec3&) { return Vec3(1, 0, 0); });
  EXPECT_THROW(render::attribute::values(coloured(3, "pressure"), frame), base::Error);
  for (std::size_t i = 0; i < frame.id.size(); ++i)
    frame.pressure.push_back(float(i)), frame.strain.push_back(2 * float(i)), frame.mode_energy.push_back(3 * float(i)), frame.body.push_back(i % 2);
  EXPECT_EQ(render::attribute::values(coloured(3, "pressure"), frame), frame.pressure);
  EXPECT_EQ(render::attribute::values(coloured(3, "strain"), frame), frame.strain);
  EXPECT_EQ(render::attribute::values(coloured(3, "mode_energy"), frame), frame.mode_energy);
  EXPECT_EQ(render::attribute::values(coloured(3, "material"), frame)[5], 1);
}

TEST(Scale, OfMaterialsNamesThemInColorsOfTheirOwn) {
  render::Setting setting = coloured(3, "material");
  setting.materials = {"ball, jelly", "heap, dry_sand"};
  const render::attribute::Scale scale = render::attribute::scale_of(setting, 5);
  EXPECT_EQ(scale.names, setting.materials);
  EXPECT_GT((scale.color(0) - scale.color(1)).norm(), 0.3);
}

TEST(Scale, OfPressureGoesBelowZeroWhereSolidsArePulled) {
  render::Setting setting = coloured(3, "pressure");
  setting.preview.range = 300;
  EXPECT_EQ(render::attribute::scale_of(setting, 5).top, 300);
  EXPECT_EQ(render::attribute::scale_of(setting, 5).unit, "Pa");
  EXPECT_FALSE(render::attribute::scale_of(setting, 5).is_signed);
  setting.shows_tension = true;
  EXPECT_TRUE(render::attribute::scale_of(setting, 5).is_signed);
}

TEST(Attribute, OutsideTheDomainHasNoVorticityAndIsFinite) {
  sim::Frame frame = full(3, [](const Vec3& p) { return Vec3(-p.y(), p.x(), 0); });
  frame.position[0] = Vec3f(1e6f, 0, -1e9f);
  EXPECT_EQ(render::attribute::values(coloured(3, "vorticity"), frame)[0], 0);
}

TEST(Scale, HasOneBoundForAllFramesUnlessTheShotSaysOne) {
  render::Setting setting = coloured(3, "vorticity");
  EXPECT_EQ(render::attribute::scale_of(setting, 5).top, 100);
  EXPECT_EQ(render::attribute::scale_of(setting, 5).unit, "1/s");
  setting.preview.range = 7;
  EXPECT_EQ(render::attribute::scale_of(setting, 5).top, 7);
  setting = coloured(3, "speed");
  EXPECT_EQ(render::attribute::scale_of(setting, 5).top, 5);
  EXPECT_FALSE(render::attribute::scale_of(setting, 5).is_signed);
  EXPECT_TRUE(render::attribute::scale_of(coloured(3, "velocity_z"), 5).is_signed);
  EXPECT_TRUE(render::attribute::scale_of(coloured(2, "vorticity"), 5).is_signed);
}

// Both maps get lighter by equal steps: 1.6 between the largest and the smallest of a side.
TEST(Colors, AreInEqualStepsOfLightness) {
  const auto steps = [](const auto& color, float from, float to) {
    double least = 1e9, most = 0;
    for (int i = 0; i < 16; ++i) {
      const float a = from + (to - from) * static_cast<float>(i) / 16, b = from + (to - from) * static_cast<float>(i + 1) / 16;
      const double step = lightness(color(b)) - lightness(color(a));
      least = std::min(least, step);
      most = std::max(most, step);
    }
    EXPECT_GT(least, 0);
    EXPECT_LT(most, 1.6 * least);
  };
  steps(render::raster::viridis, 0, 1);
  steps(render::raster::blue_to_red, -1, 0);
  steps(render::raster::blue_to_red, 1, 0);
  EXPECT_NEAR(lightness(render::raster::blue_to_red(-1)), lightness(render::raster::blue_to_red(1)), 3);
}

// A ball of water: its disc has the colour of its velocity, lit, and the size that the camera gives it.
TEST(Preview, DrawsASurfaceInItsColors) {
  render::Setting setting = coloured(3, "velocity_x");
  setting.camera = {.position = Vec3(0.5, -3, 0.5), .target = Vec3(0.5, 0.5, 0.5), .fov = 30};
  surface::Mesh ball = sphere_mesh(Vec3(0.5, 0.5, 0.5), 0.3);
  for (Vec3f& v : ball.velocity) v = Vec3f(-2, 0, 0);
  const render::Image dry = render::preview(setting, {}, surface::Mesh{}, "", 2), wet = render::preview(setting, {}, ball, "", 2);
  const double radius = 0.3 / 3.5 / std::tan(15 * std::numbers::pi / 180) * 90;
  EXPECT_NEAR(static_cast<double>(changed(dry, wet)), std::numbers::pi * radius * radius, 0.05 * std::numbers::pi * radius * radius);
  const Vec3 middle = mean_color(wet, 158, 88, 162, 92), blue = render::raster::blue_to_red(-1).cast<double>();
  const double light = middle.z() / blue.z();
  EXPECT_GT(light, 0.6);
  EXPECT_LT((middle - light * blue).norm(), 0.02);
}

TEST(Preview, HasTheSameBitsTwiceWhateverItIsColoredBy) {
  for (const char* name : {"speed", "velocity_z", "vorticity"}) {
    const render::Setting setting = coloured(3, name);
    const sim::Frame frame = full(3, [](const Vec3& p) { return Vec3(p.y() * p.z(), p.x(), 1 - p.x()); });
    const render::Image first = render::preview(setting, frame, "", 2);
    EXPECT_EQ(first.pixels, render::preview(setting, frame, "", 2).pixels) << name;
    EXPECT_GT(changed(first, render::preview(setting, {}, "", 2)), 1000u) << name;
  }
}

// Ticks every 0.2 or 0.5 m stand at the lower edges: a domain ten times as large has others.
TEST(Preview, HasAxesInMetres) {
  render::Setting setting = coloured(3, "speed");
  setting.camera = {.position = Vec3(2.2, -2, 1.5), .target = Vec3(0.5, 0.5, 0.4), .fov = 35};
  const render::Image metre = render::preview(setting, {}, "", 2);
  setting.domain.upper *= 10;
  setting.camera = {.position = Vec3(22, -20, 15), .target = Vec3(5, 5, 4), .fov = 35};
  const std::size_t labels = changed(metre, render::preview(setting, {}, "", 2));
  EXPECT_GT(labels, 60u);
  EXPECT_LT(labels, 2000u) << "the room is the same, its labels are not";
}

// A domain of millimetres and one of kilometres are seen as one of a metre, from as far.
TEST(Preview, SeesSmallAndLargeDomainsAlike) {
  std::vector<std::size_t> seen;
  for (const double scale : {1.0, 1e-3, 1e3}) {
    render::Setting setting = coloured(3, "speed");
    setting.domain.upper *= scale;
    setting.camera = {.position = scale * Vec3(2.2, -2, 1.5), .target = scale * Vec3(0.5, 0.5, 0.4), .fov = 35};
    sim::Frame frame = full(3, [](const Vec3&) { return Vec3(1, 0, 0); });
    for (Vec3f& x : frame.position) x *= static_cast<float>(scale);
    frame.pscale *= scale;
    seen.push_back(changed(render::preview(setting, {}, "", 2), render::preview(setting, frame, "", 2)));
  }
  EXPECT_GT(seen[0], 5000u);
  for (const std::size_t other : {seen[1], seen[2]}) EXPECT_NEAR(static_cast<double>(other), static_cast<double>(seen[0]), 0.02 * static_cast<double>(seen[0]));
}

// Contours of a mesh, eight along its longest axis: they stay where its bounds are and fill them less than a surface would.
TEST(Preview, OutlinesAColliderThatIsAMesh) {
  render::Setting setting = coloured(3, "speed");
  setting.camera = {.position = Vec3(0.5, -3, 0.5), .target = Vec3(0.5, 0.5, 0.5), .fov = 35};
  const render::Image empty = render::preview(setting, {}, "", 2);
  setting.colliders.resize(1);
  setting.colliders[0].shape.mesh = mesh_test::shape_of(mesh_test::ball(24), 0.3, Vec3(0.5, 0.5, 0.5));
  const std::size_t mesh = changed(empty, render::preview(setting, {}, "", 2));
  setting.colliders[0].shape.mesh.reset();
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0.5, 0.5, 0.5), 0.3};
  const std::size_t ball = changed(empty, render::preview(setting, {}, "", 2));
  EXPECT_GT(mesh, 2 * ball);   // three circles are the ball's
  EXPECT_LT(mesh, 20 * ball);
}

// Letters of a caption that would be cut off are not begun: what is left of it is whole.
TEST(Preview, LeavesOutWhatHasNoRoom) {
  const render::Setting setting = coloured(3, "speed");
  const auto with = [&](const char* caption) { return render::preview(setting, {}, caption, 2).pixels; };
  EXPECT_EQ(with("dam  frame 1  t = 0.000 s  PolyPIC full linear  4320 particles"), with("dam  frame 1  t = 0.000 s"));
  EXPECT_NE(with("dam  frame 1"), with("dam"));
  EXPECT_EQ(with(std::string(50, 'x').c_str()), with(""));
}

TEST(Labels, OfTicksTellThemApart) {
  EXPECT_EQ(render::raster::tick_label(0.2, 0.2), "0.2");
  EXPECT_EQ(render::raster::tick_label(3 * 0.1, 0.1), "0.3");
  EXPECT_EQ(render::raster::tick_label(0, 0.05), "0");
  EXPECT_EQ(render::raster::tick_label(-0.0, 0.05), "0");
  EXPECT_EQ(render::raster::tick_label(10000.05, 0.05), "10000.05");
  EXPECT_EQ(render::raster::tick_label(123457.5, 0.5), "123457.5");
  EXPECT_EQ(render::raster::tick_label(-1e6, 2e5), "-1e+06");
}

TEST(Scale, PlacesWhatNoFloatDivides) {
  const render::attribute::Scale scale{.is_signed = false, .top = 1e-50, .unit = "m/s", .names = {}};
  EXPECT_EQ(scale.place(0), 0);
  EXPECT_EQ(scale.place(1), 1);
}

TEST(Labels, KeepClearOfEachOtherAndOfTheEdge) {
  render::Image image{.width = 100, .height = 50, .channels = {"R", "G", "B", "A"}, .pixels = std::vector<float>(100 * 50 * 4)};
  const render::raster::Canvas canvas{image, 1};
  render::raster::Labels labels(canvas);
  EXPECT_TRUE(labels.write(10, 10, "0.1"));
  const std::vector<float> before = image.pixels;
  for (const auto& [x, y] : {std::pair{10, 10}, {30, 20}, {4, 2}, {-1, 30}, {90, 30}, {10, 40}, {10, -1}})
    EXPECT_FALSE(labels.write(x, y, "0.2")) << x << " " << y;
  EXPECT_EQ(image.pixels, before);
  labels.keep_clear(60, 0, 10, 50);
  EXPECT_FALSE(labels.write(50, 30, "0.2"));
  EXPECT_TRUE(labels.write(10, 30, "0.2"));
}

TEST(Sheet, PutsPicturesSideBySideOverTheirLabels) {
  const auto plain = [](float red) {
    render::Image image{.width = 160, .height = 90, .channels = {"R", "G", "B"}, .pixels = {}};
    for (int i = 0; i < 160 * 90; ++i) image.pixels.insert(image.pixels.end(), {red, 0, 0});
    return image;
  };
  const render::Image sheet = render::sheet({plain(0.25f), plain(0.5f), plain(0.75f), plain(1)}, {"a", "b", "c", "d"});
  std::map<float, std::array<std::int64_t, 5>> found;   // of each red: pixels, bounds
  for (std::int64_t y = 0; y < sheet.height; ++y)
    for (std::int64_t x = 0; x < sheet.width; ++x) {
      const float* p = &sheet.pixels[static_cast<std::size_t>(y * sheet.width + x) * 4];
      if (p[1] != 0 || p[2] != 0) continue;
      auto& f = found.try_emplace(p[0], std::array<std::int64_t, 5>{0, x, x, y, y}).first->second;
      f = {f[0] + 1, std::min(f[1], x), std::max(f[2], x), std::min(f[3], y), std::max(f[4], y)};
    }
  ASSERT_EQ(found.size(), 4u);
  for (const auto& [red, f] : found) {
    EXPECT_EQ(f[0], 160 * 90) << red;
    EXPECT_EQ(f[2] - f[1], 159) << red;
  }
  EXPECT_LT(found[0.25f][2], found[0.5f][1]) << "two columns";
  EXPECT_EQ(found[0.25f][3], found[0.5f][3]);
  EXPECT_LT(found[0.25f][4], found[0.75f][3]) << "two rows";
  EXPECT_GT(changed(sheet, render::sheet({plain(0.25f), plain(0.5f), plain(0.75f), plain(1)}, {"a", "b", "c", "other"})), 20u);
  render::Image small = plain(1);
  small.height = 45;
  try {
    render::sheet({plain(1), small}, {"a.png", "small.png"});
    FAIL();
  } catch (const base::Error& e) {
    EXPECT_NE(std::string(e.what()).find("small.png: 160x45 pixels, but a.png has 160x90"), std::string::npos) << e.what();
  }
}
