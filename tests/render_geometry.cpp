// What rays meet: grains and set pieces at known places.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <numbers>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/scratch_folder.h"
#include "render/files/mesh.h"
#include "render/trace/scene.h"
#include "tests/closed_meshes.h"
#include "tests/render_scenes.h"

namespace {

using namespace tests;

std::size_t index_of(const render::Image& image, const char* name) {
  return static_cast<std::size_t>(std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin());
}
double channel(const render::Image& image, const char* name, std::int64_t x, std::int64_t y) {
  return image.pixels[static_cast<std::size_t>(y * image.width + x) * image.channels.size() + index_of(image, name)];
}

/// Seen from 5 m in front; 100 pixels a metre at y = 0. Black floor, grains of plain white.
render::Setting stage() {
  render::Setting setting = empty_setting();
  setting.options.width = 160;
  setting.options.height = 100;
  setting.options.spp = 32;
  setting.options.bounces = 1;
  setting.liquid_look = "white";
  setting.looks["white"] = {.color = Vec3::Ones(), .draw = "grains", .grain_variation = 0};
  setting.looks["ground"].color = Vec3::Zero();
  setting.camera = {.position = Vec3(0, -5, 0.5), .target = Vec3(0, 0, 0.5), .fov = 2 * std::atan(0.1) * 180 / std::numbers::pi, .shutter = 0};
  return setting;
}

render::Grains one_grain(const Vec3f& at, double radius, const Vec3f& velocity = Vec3f::Zero()) {
  return {.position = {at}, .velocity = {velocity}, .id = {7}, .body = {}, .radius = radius};
}

/// A heap of overlapping grains, a third of them twice in the same place with two ids: rays meet both at the same distance.
render::Grains doubled_heap() {
  render::Grains grains{.position = {}, .velocity = {}, .id = {}, .body = {}, .radius = 0.03};
  const auto add = [&](const Vec3f& p) {
    grains.position.push_back(p);
    grains.velocity.push_back(Vec3f(p.y(), -p.x(), 0.5f));
    grains.id.push_back(static_cast<std::int64_t>(grains.id.size()));
  };
  for (int i = 0; i < 30000; ++i) {
    const Vec3f p(std::sin(static_cast<float>(i) * 1.7f) * 0.6f, std::sin(static_cast<float>(i) * 2.3f) * 0.4f,
                  0.4f + 0.35f * std::sin(static_cast<float>(i) * 0.37f));
    add(p);
    if (i % 3 == 0) add(p);
  }
  return grains;
}

render::Image traced(const render::Setting& setting, const render::Grains& grains, int threads = 2, const surface::Mesh& mesh = {}) {
  base::Ledger ledger;
  return render::PathTracer(setting, threads).trace(mesh, grains, 1, ledger);
}

struct Spot {
  double mass = 0, x = 0, y = 0, variance = 0;  // [pixels], variance along x
};
Spot coverage(const render::Image& image) {
  Spot s;
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < image.width; ++x) {
      const double w = channel(image, "albedo.R", x, y), at = static_cast<double>(x) + 0.5;
      s.mass += w;
      s.x += w * at;
      s.y += w * (static_cast<double>(y) + 0.5);
      s.variance += w * at * at;
    }
  s.x /= s.mass;
  s.y /= s.mass;
  s.variance = s.variance / s.mass - s.x * s.x;
  return s;
}

}  // namespace

// A ball of radius r at distance d is the disc of radius r / sqrt(1 - r^2 / d^2) there.
TEST(Grains, AreBallsInTheirPlaces) {
  const double r = 0.2;
  const Spot seen = coverage(traced(stage(), one_grain(Vec3f(0.3f, 0, 0.7f), r)));
  EXPECT_NEAR(seen.x, 80 + 30, 0.15);   // perspective shifts a ball outwards by r^2 / d^2
  EXPECT_NEAR(seen.y, 50 - 20, 0.15);
  EXPECT_NEAR(seen.mass, std::numbers::pi * r * r * 1e4, 0.01 * std::numbers::pi * r * r * 1e4);
  render::Setting larger = stage();
  larger.looks["white"].grain_size = 1.5;
  EXPECT_NEAR(coverage(traced(larger, one_grain(Vec3f(0.3f, 0, 0.7f), r))).mass / seen.mass, 2.25, 0.03);
}

TEST(Grains, BlurByTheirVelocity) {
  render::Setting setting = stage();
  setting.options.spp = 128;
  const render::Grains grain = one_grain(Vec3f(0, 0, 0.5f), 0.1, Vec3f(12, 0, 0));
  const Spot frozen = coverage(traced(setting, grain));
  setting.camera.shutter = 0.5;
  const render::Image image = traced(setting, grain);
  const Spot blurred = coverage(image);
  const double length = 12 * 0.5 / 24 * 100;
  EXPECT_NEAR(blurred.x, frozen.x, 0.1);
  EXPECT_NEAR(blurred.mass, frozen.mass, 0.03 * frozen.mass);   // noise
  EXPECT_NEAR(blurred.variance - frozen.variance, length * length / 12, 0.03 * length * length / 12);
}

// Twelve metres a second are 50 pixels a frame.
TEST(Grains, SayHowTheyMoveAndWhatTheyAre) {
  const render::Image image = traced(stage(), one_grain(Vec3f(0, 0, 0.5f), 0.1, Vec3f(12, 0, -6)));
  EXPECT_NEAR(channel(image, "motion.X", 80, 50), 50 * 5 / 4.9, 0.1);
  EXPECT_NEAR(channel(image, "motion.Y", 80, 50), -25 * 5 / 4.9, 0.1);
  EXPECT_EQ(channel(image, "id", 80, 50), 3);   // sky, ground, liquid, then the grains
}

TEST(Grains, AreShadedByTheirIdAlone) {
  render::Setting setting = stage();
  setting.looks["white"].color = Vec3(0.5, 0.4, 0.3);
  setting.looks["white"].grain_variation = 0.4;
  render::Grains grains{.position = {}, .velocity = {}, .id = {}, .body = {}, .radius = 0.03};
  for (int i = 0; i < 64; ++i) {
    grains.position.push_back(Vec3f(-0.7f + 0.2f * static_cast<float>(i % 8), 0, 0.1f + 0.1f * static_cast<float>(i / 8)));
    grains.velocity.push_back(Vec3f::Zero());
    grains.id.push_back(1000 + i);
  }
  const render::Image image = traced(setting, grains);
  double sum = 0, square = 0;
  for (std::int64_t i = 0; i < 64; ++i) {
    const double shade = channel(image, "albedo.R", 10 + 20 * (i % 8), 90 - 10 * (i / 8)) / 0.5;
    EXPECT_NEAR(shade, 1, 0.4001);
    EXPECT_NEAR(channel(image, "albedo.B", 10 + 20 * (i % 8), 90 - 10 * (i / 8)) / 0.3, shade, 1e-5);
    sum += shade / 64;
    square += shade * shade / 64;
  }
  EXPECT_NEAR(sum, 1, 0.1);
  EXPECT_NEAR(std::sqrt(square - sum * sum), 0.4 / std::sqrt(3), 0.05);   // even between both ends
  std::reverse(grains.position.begin(), grains.position.end());
  std::reverse(grains.id.begin(), grains.id.end());
  EXPECT_EQ(traced(setting, grains).pixels, image.pixels);
}

// The lightest of white grains is white: none reflects more than falls on it.
TEST(Grains, NeverShineByTheirShade) {
  render::Setting setting = stage();
  setting.looks["white"].grain_variation = 1;
  const render::Image image = traced(setting, doubled_heap());
  const std::size_t albedo = index_of(image, "albedo.R");
  float most = 0;
  for (std::size_t i = albedo; i < image.pixels.size(); i += image.channels.size()) most = std::max(most, image.pixels[i]);
  EXPECT_GT(most, 0.9f);
  EXPECT_LE(most, 1.00001f);
}

TEST(Grains, HaveTheLookOfTheirBody) {
  render::Setting setting = stage();
  setting.body_looks = {"white", "red"};
  setting.looks["red"] = {.color = Vec3(1, 0, 0), .draw = "grains", .grain_variation = 0};
  render::Grains grains{.position = {Vec3f(-0.3f, 0, 0.5f), Vec3f(0.3f, 0, 0.5f)}, .velocity = {Vec3f::Zero(), Vec3f(24, 0, 0)}, .id = {0, 1},
                        .body = {1, 0}, .radius = 0.1};
  const render::Image image = traced(setting, grains);
  EXPECT_EQ(channel(image, "albedo.G", 50, 50), 0);
  EXPECT_EQ(channel(image, "albedo.R", 50, 50), 1);
  EXPECT_EQ(channel(image, "albedo.G", 110, 50), 1);
  EXPECT_EQ(channel(image, "motion.X", 50, 50), 0) << "the velocity of the other grain";
  EXPECT_GT(channel(image, "motion.X", 110, 50), 90);
  EXPECT_EQ(channel(image, "id", 50, 50) - channel(image, "id", 110, 50), 1);
}

TEST(Grains, GiveTheSameBitsForAnyNumberOfThreadsEvenWhereTwoAreOne) {
  render::Setting setting = stage();
  setting.looks["white"] = {.color = Vec3(0.5, 0.5, 0.5), .draw = "grains", .grain_variation = 1};
  setting.options.spp = 2;
  setting.options.bounces = 4;
  setting.camera.shutter = 0.5;
  setting.lights = {};
  const render::Grains heap = doubled_heap();
  const render::Image one = traced(setting, heap, 1);
  for (const int threads : {2, 4, 2}) EXPECT_EQ(traced(setting, heap, threads).pixels, one.pixels) << threads;
}

TEST(Grains, StandBesideAMeshFrameAfterFrame) {
  render::Setting setting = stage();
  setting.body_looks = {"sand"};
  setting.liquid_look = "water";
  setting.lights = {};
  setting.options.spp = 2;
  setting.options.bounces = 8;
  const surface::Mesh mesh = sphere_mesh(Vec3(-0.3, 0, 0.5), 0.2);
  const render::Grains grain = one_grain(Vec3f(0.3f, 0, 0.5f), 0.2);
  base::Ledger ledger;
  render::PathTracer tracer(setting, 2);
  tracer.trace({}, doubled_heap(), 1, ledger);
  tracer.trace(mesh, 1, ledger);
  const render::Image both = tracer.trace(mesh, grain, 1, ledger);
  EXPECT_EQ(both.pixels, traced(setting, grain, 2, mesh).pixels);
  EXPECT_EQ(channel(both, "id", 50, 50), 2);
  EXPECT_EQ(channel(both, "id", 110, 50), 3);
}

TEST(Grains, AreAskedForByTheLookOfABody) {
  render::Setting setting = stage();
  EXPECT_TRUE(setting.draws_grains());
  EXPECT_FALSE(setting.draws_surface());
  setting.body_looks = {"water"};
  EXPECT_TRUE(setting.draws_grains() && setting.draws_surface());
  setting.liquid_look = "water";
  EXPECT_FALSE(setting.draws_grains());
}

TEST(Grains, AreRefusedWhenNotFinite) {
  render::Grains heap = doubled_heap();
  heap.velocity[20000].y() = std::nanf("");
  try {
    traced(stage(), heap);
    FAIL() << "a picture of NaN";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::fault);
    EXPECT_NE(std::string(e.what()).find("grain 20000 has no finite position and velocity"), std::string::npos) << e.what();
  }
}

namespace {

/// White, red and sand: two balls to the left and right, a grain between them, a collider far to the right.
render::Setting three_bodies() {
  render::Setting setting = stage();
  setting.body_looks = {"left", "right", "sand"};
  setting.liquid_look = "left";
  setting.looks["left"] = {.color = Vec3::Ones()};
  setting.looks["right"] = {.color = Vec3(1, 0, 0)};
  setting.looks["sand"] = {.color = Vec3(0, 0, 1), .draw = "grains", .grain_variation = 0};
  setting.colliders.resize(1);
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0.75, 0, 0.1), 0.02};
  return setting;
}

std::vector<surface::Mesh> two_balls(const Vec3f& velocity = Vec3f::Zero()) {
  std::vector<surface::Mesh> meshes = {sphere_mesh(Vec3(-0.5, 0, 0.5), 0.2), sphere_mesh(Vec3(0.4, 0, 0.5), 0.2), {}};
  meshes[1].velocity.assign(meshes[1].velocity.size(), velocity);
  return meshes;
}

/// A grain of each body: those of bodies with a mesh are in front of it.
render::Grains three_grains() {
  return {.position = {Vec3f(-0.5f, -0.5f, 0.5f), Vec3f(0.4f, -0.5f, 0.5f), Vec3f(0, 0, 0.5f)}, .velocity = std::vector<Vec3f>(3, Vec3f::Zero()),
          .id = {0, 1, 2}, .body = {0, 1, 2}, .radius = 0.1};
}

render::Image traced(const render::Setting& setting, const std::vector<surface::Mesh>& meshes, const render::Grains& grains) {
  base::Ledger ledger;
  return render::PathTracer(setting, 2).trace_bodies(meshes, grains, 1, ledger);
}

}  // namespace

TEST(Bodies, OfSeveralLooksHaveSurfacesOfTheirOwn) {
  render::Setting setting = three_bodies();
  EXPECT_TRUE(setting.parts_bodies());
  setting.body_looks = {"left", "left"};
  EXPECT_FALSE(setting.parts_bodies()) << "one surface around both";
  setting.looks["other"] = setting.looks["sand"];
  setting.body_looks = {"sand", "other"};
  EXPECT_FALSE(setting.parts_bodies()) << "no surface at all";
  setting.body_looks = {"sand", "left"};
  EXPECT_TRUE(setting.parts_bodies());
  setting.dimension = 2;
  EXPECT_FALSE(setting.parts_bodies());
}

// Sky, ground, liquid, the collider, then the bodies in the order of the shot, grains among them.
TEST(Bodies, AreDrawnEachWithItsLookMotionAndId) {
  const render::Image image = traced(three_bodies(), two_balls(Vec3f(12, 0, -6)), three_grains());
  const std::array<std::int64_t, 3> at = {30, 120, 80};
  const std::array<Vec3, 3> color = {Vec3(1, 1, 1), Vec3(1, 0, 0), Vec3(0, 0, 1)};
  for (std::size_t body = 0; body < 3; ++body) {
    EXPECT_EQ(channel(image, "id", at[body], 50), 4 + static_cast<double>(body));
    EXPECT_NEAR(channel(image, "albedo.R", at[body], 50), color[body].x(), 1e-6);
    EXPECT_NEAR(channel(image, "albedo.G", at[body], 50), color[body].y(), 1e-6);
    EXPECT_NEAR(channel(image, "albedo.B", at[body], 50), color[body].z(), 1e-6);
  }
  EXPECT_EQ(channel(image, "motion.X", 30, 50), 0);
  EXPECT_NEAR(channel(image, "motion.X", 120, 50), 50 * 5 / 4.8, 0.6);   // as wide as the ball is deep
  EXPECT_NEAR(channel(image, "motion.Y", 120, 50), -25 * 5 / 4.8, 0.6);
  EXPECT_NEAR(channel(image, "Z", 30, 50), 4.8, 0.01) << "a body with a mesh was drawn as grains, too";
  EXPECT_GT(channel(image, "N.Y", 30, 50), -1.001);
  EXPECT_LT(channel(image, "N.Y", 30, 50), -0.95);
}

TEST(Bodies, BlurByTheirOwnVelocity) {
  render::Setting setting = three_bodies();
  setting.camera.shutter = 0.5;
  const render::Image still = traced(setting, two_balls(), {}), moving = traced(setting, two_balls(Vec3f(12, 0, 0)), {});
  const auto partly = [&](const render::Image& image, std::int64_t x0,
                          std::int64_t x1) {   // pixels along a row that a ball covers for a part of the time
    int count = 0;
    for (std::int64_t x = x0; x < x1; ++x) count += channel(image, "albedo.R", x, 50) > 0.05 && channel(image, "albedo.R", x, 50) < 0.95;
    return count;
  };
  EXPECT_LE(partly(still, 90, 160), 6);
  EXPECT_GT(partly(moving, 90, 160), 35);   // 25 pixels at each edge
  EXPECT_EQ(partly(moving, 0, 60), partly(still, 0, 60));
}

TEST(Bodies, ComeAndGoFrameAfterFrame) {
  const render::Setting setting = three_bodies();
  base::Ledger ledger;
  render::PathTracer tracer(setting, 2);
  tracer.trace_bodies({{}, {}, {}}, doubled_heap(), 1, ledger);
  tracer.trace_bodies({two_balls()[1], {}, {}}, three_grains(), 1, ledger);
  EXPECT_EQ(tracer.trace_bodies(two_balls(), three_grains(), 1, ledger).pixels, traced(setting, two_balls(), three_grains()).pixels);
}

// Of equal priority a collider displaces bodies, a solid body a liquid one, a later body an earlier one; a higher priority displaces all.
TEST(Bodies, DisplaceEachOtherByPriority) {
  render::Setting setting = three_bodies();
  setting.looks["left"] = setting.looks["right"] = {.model = "dielectric"};
  setting.colliders[0].look = "glass";
  const render::trace::Scene scene = render::trace::make_scene(setting);
  const auto rank = [](const render::trace::Scene& s, int id) { return s.rank[static_cast<std::size_t>(id - 2)]; };
  EXPECT_LT(rank(scene, 4), rank(scene, 5));
  EXPECT_LT(rank(scene, 5), rank(scene, 3));
  EXPECT_EQ(rank(scene, 6), -1) << "sand";
  setting.body_flows = {false, true, false};
  const render::trace::Scene in_liquid = render::trace::make_scene(setting);
  EXPECT_GT(rank(in_liquid, 4), rank(in_liquid, 5));
  EXPECT_LT(rank(in_liquid, 4), rank(in_liquid, 3));
  setting.looks["left"].priority = 1;
  const render::trace::Scene other = render::trace::make_scene(setting);
  EXPECT_GT(rank(other, 4), rank(other, 3));
}

// Sixty-four media are told apart: bodies that share a surface are one.
TEST(Bodies, OfOneLookAreOneMedium) {
  render::Setting setting = three_bodies();
  setting.body_looks.assign(100, "jelly");
  EXPECT_EQ(render::trace::make_scene(setting).surface_of.size(), 0u) << "what is around all is of the liquid's look";
  setting.body_looks.push_back("left");
  try {
    render::trace::make_scene(setting);
    FAIL() << "100 media";
  } catch (const base::Error& e) {
    EXPECT_EQ(std::string(e.what()), "100 dielectric surfaces; at most 64 are told apart");
  }
}

namespace {

/// Files of a folder that goes away, and what reading them says.
class SetMesh : public testing::Test {
 protected:
  base::ScratchFolder folder_;
  std::filesystem::path file(const std::string& name, const std::string& content) {
    base::write_atomically(folder_.path() / name, [&](const std::filesystem::path& path) { std::ofstream(path, std::ios::binary) << content; });
    return folder_.path() / name;
  }
  void expect_refused(const std::string& name, const std::string& content, const std::string& words) {
    const std::filesystem::path path = file(name, content);
    try {
      render::files::read_mesh(path);
      ADD_FAILURE() << name << " is read: " << words;
    } catch (const base::Error& e) {
      EXPECT_EQ(e.complaint().code, base::Exit::user);
      EXPECT_TRUE(std::string(e.what()).starts_with(path.string() + ": ")) << e.what();
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    }
  }
};

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 2 3 4\n";
const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int "
    "vertex_indices\n"
    "end_header\n0 0 0\n1 0 0\n0 0 1\n3 0 1 2\n";
const std::string kStl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n";

/// One facet in STL's binary form, said to be `count`.
std::string binary_stl(std::uint32_t count, float x = 1) {
  std::string bytes(80, ' ');
  const auto add = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  add(count);
  for (const float v : {0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, x, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f}) add(v);
  add(std::uint16_t{0});
  return bytes;
}

double area(const render::files::Triangles& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += 0.5 * static_cast<double>((mesh.position[t[1]] - mesh.position[t[0]]).cross(mesh.position[t[2]] - mesh.position[t[0]]).norm());
  return sum;
}

}  // namespace

TEST_F(SetMesh, IsReadFromEachKindOfFile) {
  EXPECT_EQ(area(render::files::read_mesh(file("a.obj", kSquare))), 1);
  EXPECT_EQ(area(render::files::read_mesh(file("a.ply", kPly))), 0.5);
  EXPECT_EQ(area(render::files::read_mesh(file("a.STL", kStl))), 0.5);
  EXPECT_EQ(area(render::files::read_mesh(file("b.stl", binary_stl(1)))), 0.5);
}

// Three triangles at one edge: no closed surface, and no fault.
TEST_F(SetMesh, NeedNotBeManifold) {
  const auto mesh = render::files::read_mesh(file("fan.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nv -1 0 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"));
  EXPECT_EQ(mesh.triangles.size(), 3u);
  EXPECT_EQ(area(mesh), 1.5);
}

TEST_F(SetMesh, SaysWhatIsWrongWithAFile) {
  expect_refused("a.fbx", kSquare, "must end in .obj, .ply or .stl");
  expect_refused("empty.obj", "", "cannot be read as a mesh");
  expect_refused("empty.ply", "", "has no PLY header");
  expect_refused("empty.stl", "", "cannot be read as a mesh");
  expect_refused("none.obj", "v 0 0 0\nv 1 0 0\n", "");
  expect_refused("picture.obj", "\x89PNG\r\n\x1a\n not a mesh at all, whatever it is called", "");
  expect_refused("picture.ply", "\x89PNG\r\n\x1a\n not a mesh at all", "has no PLY header");
  expect_refused("nan.obj", "v 0 0 0\nv 1 nan 0\nv 1 0 1\nf 1 2 3\n", "line 2: nan is not finite");
  expect_refused("nan.ply", std::string(kPly).replace(kPly.find("1 0 0\n"), 1, "inf"), "line 11: inf is not finite");
  expect_refused("nan.stl", std::string(kStl).replace(kStl.find("vertex 1 0 0") + 7, 1, "-nan"), "line 5: -nan is not finite");
  expect_refused("nan_binary.stl", binary_stl(1, std::nanf("")), "is not finite");
  expect_refused("large.obj", "v 0 0 0\nv 1e60 0 0\nv 1 0 1\nf 1 2 3\n", "is not finite");
  expect_refused("corner.obj", "v 0 0 0\nv 1 0 0\nv 1 0 1\nf 1 2 9\n", "");
  expect_refused("truncated.ply", kPly.substr(0, kPly.size() - 16), "");
  const std::string ply = kPly.substr(0, kPly.find("3 0 1 2"));
  expect_refused("minus.ply", ply + "3 0 1 -1\n", "face 1 has a corner that is not there");
  expect_refused("beyond.ply", ply + "3 0 1 99999999\n", "");
  expect_refused("none.ply", ply + "0\n", "");
  expect_refused("few.ply", std::string(kPly).replace(kPly.find("vertex 3"), 8, "vertex 2"), "");
  expect_refused("truncated.stl", binary_stl(1).substr(0, 100), "");
  expect_refused("huge.stl", binary_stl(4000000000u), "");
  expect_refused("huge.ply", std::string(kPly).replace(kPly.find("vertex 3"), 8, "vertex 4000000000"), "line 3");
}

/// A ball's light as a collider that is a mesh: smooth but for its outline, and not where edges are sharp.
TEST(ColliderMesh, OfABallIsShadedAsOneAndOfABoxHasEdges) {
  const auto drawn = [](const sim::Shape& shape) {
    render::Setting setting = stage();
    setting.colliders.resize(1);
    setting.colliders[0].look = "white";
    setting.colliders[0].shape = shape;
    return traced(setting, render::Grains{});
  };
  const auto differ = [](const render::Image& a, const render::Image& b, const char* name) {   // where both are hit, and not at their outlines
    double most = 0;
    for (std::int64_t y = 0; y < a.height; ++y)
      for (std::int64_t x = 0; x < a.width; ++x)
        if (channel(a, "id", x, y) == 3 && channel(b, "id", x, y) == 3 && channel(a, "N.Y", x, y) < -0.6 && channel(b, "N.Y", x, y) < -0.6)
          most = std::max(most, std::abs(channel(a, name, x, y) - channel(b, name, x, y)));
    return most;
  };
  sim::Shape ball, of_ball, box, of_box;
  ball.sphere = sim::Shape::Sphere{Vec3(0.1, 0, 0.5), 0.3};
  of_ball.mesh = mesh_test::shape_of(mesh_test::ball(12), 0.3, Vec3(0.1, 0, 0.5));
  box.box = base::Box{Vec3(-0.4, -0.2, 0.2), Vec3(0.3, 0.2, 0.7)};
  of_box.mesh = mesh_test::shape_of(mesh_test::box(box.box->lower.cast<float>(), box.box->upper.cast<float>()), 1, Vec3::Zero());
  const render::Image smooth = drawn(of_ball);
  EXPECT_EQ(channel(smooth, "id", 90, 50), 3);
  for (const char* axis : {"N.X", "N.Y", "N.Z"}) {
    EXPECT_LT(differ(drawn(ball), smooth, axis), 0.05) << axis;   // facets are turned by up to 7.5 degrees, 0.13
    EXPECT_LT(differ(drawn(box), drawn(of_box), axis), 1e-6) << axis;
  }
}

TEST_F(SetMesh, IsDrawnInItsPlaceWithItsLook) {
  render::Setting setting = stage();
  setting.colliders.resize(1);
  setting.colliders[0].shape.sphere = sim::Shape::Sphere{Vec3(0.5, 0, 0.3), 0.05};
  setting.sets = {{.name = "wall", .file = file("square.obj", kSquare), .scale = 0.4, .translate = Vec3(-0.6, 0, 0.2), .look = "white"}};
  setting.looks["plaster"].color = Vec3::Zero();
  const render::Image image = traced(setting, render::Grains{});
  const Spot seen = coverage(image);
  EXPECT_NEAR(seen.mass, 1600, 10);
  EXPECT_NEAR(seen.x, 80 - 40, 0.1);
  EXPECT_NEAR(seen.y, 50 + 10, 0.1);
  EXPECT_EQ(channel(image, "id", 40, 60), 4);   // after the collider
  EXPECT_EQ(channel(image, "id", 130, 70), 3);
  EXPECT_EQ(channel(image, "N.Y", 40, 60), -1);
}
