// Bodies with surfaces of their own: one file, a level set and a velocity each, and those around all.
#include <algorithm>
#include <iterator>

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

/// Of solids, unless `dry` says which are.
surface::Room room_of(const std::vector<std::string>& bodies, std::vector<bool> dry = {true, true}) {
  surface::Room walls = room();
  walls.bodies = bodies;
  walls.dry = std::move(dry);
  return walls;
}

/// Frames as one, of as many bodies.
sim::Frame together(const std::vector<sim::Frame>& frames) {
  sim::Frame all = fill([](const Vec3&) { return false; });
  for (std::size_t body = 0; body < frames.size(); ++body)
    for (std::size_t i = 0; i < frames[body].id.size(); ++i) {
      all.position.push_back(frames[body].position[i]);
      all.velocity.push_back(frames[body].velocity[i]);
      all.id.push_back(std::int64_t(all.id.size()));
      all.body.push_back(std::uint16_t(body));
    }
  return all;
}

constexpr double kRadius = 0.1, kGap = 1.1 * kCell, kLevel = 0.3;
const Vec3 kFloating(0.4, 0.3, kLevel);

/// A tank of water with a ball in it, parted from it by kGap.
struct Float {
  Vec3 middle = kFloating;
  double distance(const Vec3& x) const { return (x - middle).norm() - kRadius; }
  double distance(const Vec3f& x) const { return distance(Vec3(x.cast<double>())); }
  sim::Frame water() const { return fill([this](const Vec3& x) { return x[2] < kLevel && distance(x) > kGap; }); }
  sim::Frame with_water() const { return together({water(), fill([this](const Vec3& x) { return distance(x) < 0; })}); }
  /// Vertices of the water's surface in the gap, under water and off the walls.
  long in_gap(const surface::Mesh& mesh) const {
    return std::count_if(mesh.position.begin(), mesh.position.end(), [this](const Vec3f& x) {
      return x[2] < kLevel - 2 * kVoxel && x[2] > kVoxel && x[0] > kVoxel && distance(x) > 0.25 * kVoxel && distance(x) < kGap + 2 * kVoxel;
    });
  }
};
const std::vector<std::string> kWaterAndFloat = {"water", "float"};

class Parts : public testing::Test {
 protected:
  static void SetUpTestSuite() { surface::initialize(); }
  const std::filesystem::path& write(const sim::Frame& frame, const std::vector<std::string>& bodies, const surface::Options& options = {}) {
    surface::write_surface(file_.path(), frame, options, room_of(bodies), ledger_);
    return file_.path();
  }
  std::vector<surface::Mesh> meshes_of(const sim::Frame& frame, const std::vector<std::string>& bodies, const std::vector<bool>& dry, const surface::Options& options = {}) {
    surface::write_surface(file_.path(), frame, options, room_of(bodies, dry), ledger_);
    return meshes(bodies);
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

// Under water no air is left around the float, beside walls neither: what remains of the water's surface there lies inside of it. The float's own is as it was.
TEST_F(Parts, OfALiquidGoOnIntoASolidThatStandsInIt) {
  for (const Vec3& middle : {kFloating, Vec3(0.4, 0.3, kRadius), Vec3(kRadius, 0.3, 0.14), Vec3(kRadius, 0.3, kRadius)}) {
    const Float ball{middle};
    const auto apart = meshes_of(ball.with_water(), kWaterAndFloat, {true, true}), wet = meshes_of(ball.with_water(), kWaterAndFloat, {false, true});
    EXPECT_GT(ball.in_gap(apart[0]), 1000);
    EXPECT_LE(ball.in_gap(wet[0]), middle == kFloating ? 0 : 10) << "at " << middle.transpose() << ", where it touches the wall";
    EXPECT_EQ(wet[1].position, apart[1].position);
    const auto in_ball = std::count_if(wet[0].position.begin(), wet[0].position.end(), [&](const Vec3f& x) { return ball.distance(x) < 0; });
    EXPECT_GT(in_ball, 100) << "the surface ends at the float";
    for (std::size_t v = 0; v < wet[0].position.size(); ++v)
      if (middle == kFloating && ball.distance(wet[0].position[v]) < 0) {
        ASSERT_LT((wet[0].velocity[v] - Vec3f(1, 2, -3)).norm(), 0.01f);
      }
  }
}

// And around a ball that lies on a collider; where the gap was there are thousands otherwise.
TEST_F(Parts, OfALiquidLeaveNoAirAtACollider) {
  constexpr double kTop = 0.04;
  const Float ball{{0.4, 0.3, kTop + kRadius}};
  sim::Frame water = ball.with_water();
  surface::Room walls = room_of(kWaterAndFloat, {false, true});
  walls.solids.resize(1);
  walls.solids[0].shape.box = base::Box{{0.2, 0.1, 0}, {0.6, 0.5, kTop}};
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < water.id.size(); ++i)
    if (walls.solids[0].shape.distance(water.position[i].cast<double>()) > 0) kept.push_back(i);
  sim::Frame frame = fill([](const Vec3&) { return false; });
  for (const std::size_t i : kept) {
    frame.position.push_back(water.position[i]), frame.velocity.push_back(water.velocity[i]), frame.body.push_back(water.body[i]);
    frame.id.push_back(std::int64_t(frame.id.size()));
  }
  surface::write_surface(file_.path(), frame, {}, walls, ledger_);
  const surface::Mesh wet = meshes(kWaterAndFloat)[0];
  const auto in_gap = std::count_if(wet.position.begin(), wet.position.end(), [&](const Vec3f& x) {
    return x[2] > kTop + kVoxel && x[2] < kLevel - 2 * kVoxel && ball.distance(x) > 0.25 * kVoxel && ball.distance(x) < kGap + 2 * kVoxel;
  });
  EXPECT_LE(in_gap, 20) << "where it touches";
}

// At the water's level the gap is filled but for the fillet, which rises little; further off nothing changes.
TEST_F(Parts, OfALiquidMeetASolidInAFillet) {
  const Float ball;
  const auto wet = meshes_of(ball.with_water(), kWaterAndFloat, {false, true});
  for (const Vec3f& x : wet[0].position) {
    if (ball.distance(x) < 0 || ball.distance(x) > kGap || x[2] < kLevel - 4 * kVoxel) continue;
    ASSERT_GT(x[2], kLevel - 2 * kVoxel);
    ASSERT_LT(x[2], kLevel + kVoxel);
  }
  const auto far = [&](const surface::Mesh& mesh) {
    std::vector<Vec3f> places;
    std::copy_if(mesh.position.begin(), mesh.position.end(), std::back_inserter(places), [&](const Vec3f& x) { return ball.distance(x) > 3 * kGap; });
    return places;
  };
  const surface::Mesh alone = mesh_of(ball.water());
  ASSERT_GT(far(alone).size(), 1000u);
  EXPECT_TRUE(far(wet[0]) == far(alone));
}

// Where a wall cuts both, the water's face lies half a voxel behind the solid's: in one plane neither would be seen for certain.
TEST_F(Parts, OfALiquidLieBehindASolidAtAWall) {
  const Float ball{{0.03, 0.3, 0.14}};
  const auto parts = meshes_of(ball.with_water(), kWaterAndFloat, {false, true});
  const auto in_face = [&](const surface::Mesh& mesh, double behind) {
    return std::count_if(mesh.position.begin(), mesh.position.end(), [&](const Vec3f& x) { return std::fabs(ball.distance(x) + 1.5 * kVoxel) < 0.5 * kVoxel && std::fabs(x[0] - behind) < 0.3 * kVoxel; });
  };
  EXPECT_GT(in_face(parts[1], 0), 20);
  EXPECT_GT(in_face(parts[0], 0.5 * kVoxel), 20);
}

TEST_F(Parts, OfALiquidFarFromTheOthersAreAsIfItWereAlone) {
  const auto waves = fill([](const Vec3& x) { return x[2] < 0.15 + 0.02 * std::sin(60 * x[0]) * std::sin(50 * x[1]) || (x - Vec3(0.4, 0.3, 0.2)).norm() < 0.03; });
  const auto high = fill([](const Vec3& x) { return (x - Vec3(0.4, 0.3, 0.45)).norm() < 0.1; }), none = fill([](const Vec3&) { return false; });
  for (const double voxel : {kCell / 2, kCell / 4}) {
    surface::Options options;
    options.voxel = voxel;
    const surface::Mesh alone = mesh_of(waves, options);
    ASSERT_GT(alone.position.size(), 1000u);
    for (const sim::Frame& other : {high, none}) {
      const auto wet = meshes_of(together({waves, other}), kWaterAndFloat, {false, true}, options);
      EXPECT_TRUE(wet[0].position == alone.position);
      EXPECT_TRUE(wet[0].normal == alone.normal);
    }
  }
}

// A gap counts in voxels where these are fine: what two voxels a cell close, four leave open, but not one of one cell less a bit.
TEST_F(Parts, OfALiquidGoOnByFiveVoxelsAtTheMost) {
  const auto air = [this](double gap) {
    surface::Options options;
    options.voxel = kCell / 4;
    const sim::Frame frame = together({fill([&](const Vec3& x) { return x[0] < 0.4 - gap && x[2] < 0.2; }), fill([](const Vec3& x) { return x[0] > 0.4 && x[2] < 0.2; })});
    const auto wet = meshes_of(frame, kWaterAndFloat, {false, true}, options);
    double furthest = 0;
    for (const Vec3f& x : wet[0].position) furthest = std::max(furthest, double(x[0]));
    return furthest < 0.4;
  };
  EXPECT_FALSE(air(0.8 * kCell));
  EXPECT_TRUE(air(1.8 * kCell));
}

// Between two blocks of liquid no air is left, and they overlap by about a voxel.
TEST_F(Parts, OfTwoLiquidsMeetHalfWay) {
  const auto block = [](double from, double to) {
    return fill([=](const Vec3& x) { return x[0] > from && x[0] < to && (x - kMiddle).tail<2>().cwiseAbs().maxCoeff() < 0.15; });
  };
  const double middle = 0.4;
  const sim::Frame both = together({block(0.2, middle - kGap / 2), block(middle + kGap / 2, 0.6)});
  const auto wet = meshes_of(both, kNames, {false, false});
  double left = 0, right = 1;
  for (const Vec3f& x : wet[0].position) left = std::max(left, double(x[0]));
  for (const Vec3f& x : wet[1].position) right = std::min(right, double(x[0]));
  EXPECT_NEAR(left, middle + kVoxel / 2, kVoxel / 2);
  EXPECT_NEAR(right, middle - kVoxel / 2, kVoxel / 2);
  EXPECT_GT(left, right);
}
