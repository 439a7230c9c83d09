// Bodies with surfaces of their own: one file, a level set and a velocity each, and those around all.
#include "base/atomic_file.h"
#include "base/error.h"
#include "tests/surface_bodies.h"

using namespace surface_test;

namespace {

const Vec3 kMiddle(0.3, 0.3, 0.3);
const Vec3f kOfBall(1, 0, 0), kOfBlock(0, 0, -2);   // [m/s]
const std::vector<std::string> kNames = {"ball", "block"};

bool in_ball(const Vec3& x) { return (x - kMiddle).norm() < 0.1; }
bool in_block(const Vec3& x) { return x[0] > 0.4 && x[0] < 0.6 && (x - kMiddle).tail<2>().cwiseAbs().maxCoeff() < 0.1; }

/// The ball touches the block.
sim::Frame ball_at_block() {
  sim::Frame frame = fill([](const Vec3& x) { return in_ball(x) || in_block(x); });
  for (std::size_t i = 0; i < frame.position.size(); ++i) {
    frame.body.push_back(in_block(frame.position[i].cast<double>()) ? 1 : 0);
    frame.velocity[i] = frame.body[i] == 1 ? kOfBlock : kOfBall;
  }
  return frame;
}

sim::Frame of_body(std::uint16_t body) {
  const sim::Frame both = ball_at_block();
  sim::Frame frame = fill([](const Vec3&) { return false; });
  for (std::size_t i = 0; i < both.position.size(); ++i) {
    if (both.body[i] != body) continue;
    frame.position.push_back(both.position[i]);
    frame.velocity.push_back(both.velocity[i]);
    frame.id.push_back(both.id[i]);
  }
  return frame;
}

surface::Room room_of(const std::vector<std::string>& bodies) {
  surface::Room walls = room();
  walls.bodies = bodies;
  return walls;
}

class Parts : public testing::Test {
 protected:
  static void SetUpTestSuite() { surface::initialize(); }
  const std::filesystem::path& write(const sim::Frame& frame, const std::vector<std::string>& bodies, const surface::Options& options = {}) {
    surface::write_surface(file_.path(), frame, options, room_of(bodies), ledger_);
    return file_.path();
  }
  std::vector<surface::Mesh> meshes(const std::vector<std::string>& names) { return surface::read_surfaces(file_.path(), {}, names, ledger_); }
  surface::Mesh all() { return surface::read_surface(file_.path(), {}, ledger_); }

  TemporaryFile file_;
  base::Ledger ledger_;
};

}  // namespace

TEST_F(Parts, OfAFileAreNamedByTheirBodies) {
  surface::Options options;
  options.vel_name = "v";
  std::vector<std::string> names;
  const auto grids = surface::info(write(ball_at_block(), kNames, options));
  for (const surface::GridInfo& grid : grids) names.push_back(grid.name);
  EXPECT_EQ(names, (std::vector<std::string>{"surface", "v", "surface_ball", "v_ball", "surface_block", "v_block"}));
  for (std::size_t i = 0; i < grids.size(); i += 2) {
    EXPECT_EQ(grids[i].grid_class, "level set");
    EXPECT_TRUE(grids[i].half);
    EXPECT_GT(grids[i].active, 1000u);
    EXPECT_EQ(grids[i + 1].active, grids[i].active);
  }
}

// As if the others were not there, to the last bit.
TEST_F(Parts, AreMadeOfTheirOwnParticlesAlone) {
  write(ball_at_block(), kNames);
  const std::vector<surface::Mesh> parts = meshes(kNames);
  for (const std::uint16_t body : {0, 1}) {
    const surface::Mesh alone = mesh_of(of_body(body));
    ASSERT_GT(alone.quads.size(), 1000u);
    EXPECT_EQ(parts[body].position, alone.position);
    EXPECT_EQ(parts[body].normal, alone.normal);
    EXPECT_EQ(parts[body].velocity, alone.velocity);
    EXPECT_EQ(parts[body].quads, alone.quads);
  }
  EXPECT_EQ(parts[0].velocity.front(), kOfBall);
  EXPECT_EQ(parts[1].velocity.front(), kOfBlock);
  const std::vector<surface::Mesh> second = meshes({"", "block"});
  EXPECT_TRUE(second[0].quads.empty());
  EXPECT_EQ(second[1].position, parts[1].position);
}

// The union has the parts' volume but for the crease where they touch, no surface between them, and each part's velocity.
TEST_F(Parts, TogetherAreTheSurfaceAroundAll) {
  write(ball_at_block(), kNames);
  const std::vector<surface::Mesh> parts = meshes(kNames);
  const surface::Mesh both = all();
  EXPECT_NEAR(volume(both) / (volume(parts[0]) + volume(parts[1])), 1, 0.005);
  std::size_t of_ball = 0, of_block = 0;
  for (std::size_t v = 0; v < both.position.size(); ++v) {
    const double from_ball = (both.position[v].cast<double>() - kMiddle).norm() - 0.1, from_block = 0.4 - both.position[v].x();
    if (from_ball + 4 * kVoxel < std::fabs(from_block)) of_ball += (both.velocity[v] - kOfBall).norm() < 1e-3f;
    else if (from_ball > 4 * kVoxel) of_block += (both.velocity[v] - kOfBlock).norm() < 1e-3f;
    EXPECT_FALSE(from_block < 4 * kVoxel && from_block > -4 * kVoxel && (both.position[v].cast<double>() - kMiddle).tail<2>().norm() < 2 * kVoxel)
        << "between ball and block";
  }
  EXPECT_GT(of_ball, 1000u);
  EXPECT_GT(of_block, 1000u);
}

TEST_F(Parts, AreNoneWithoutNames) {
  sim::Frame plain = ball_at_block();
  const std::string with = base::read_file(write(plain, {}));
  plain.body.clear();
  EXPECT_EQ(base::read_file(write(plain, {})), with);
  EXPECT_EQ(surface::info(file_.path()).size(), 2u);
}

TEST_F(Parts, WithoutParticlesAreEmpty) {
  write(of_body(0), {"ball", "gone"});
  const std::vector<surface::Mesh> parts = meshes({"ball", "gone"});
  EXPECT_GT(parts[0].quads.size(), 1000u);
  EXPECT_TRUE(parts[1].quads.empty());
  EXPECT_EQ(all().position, parts[0].position);
}

TEST_F(Parts, ThatAreNotThereAreOneLine) {
  write(ball_at_block(), {});
  try {
    meshes(kNames);
    FAIL() << "a surface of nothing";
  } catch (const base::Error& e) {
    EXPECT_EQ(std::string(e.what()), file_.path().string() + ": has no level set named surface_ball");
  }
}
