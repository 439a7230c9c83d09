#include "base/atomic_file.h"
#include "base/error.h"
#include "tests/surface_bodies.h"
#include "tests/threads.h"

using namespace surface_test;

namespace {

std::string bytes_with_threads(const sim::Frame& frame, int threads) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  on_threads(threads, [&] { surface::write_surface(file.path(), frame, {}, room(), ledger); });
  return base::read_file(file.path());
}

std::vector<surface::GridInfo> grids_of(const sim::Frame& frame, const surface::Options& options = {}) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  surface::write_surface(file.path(), frame, options, room(), ledger);
  return surface::info(file.path());
}

surface::Mesh moved(surface::Mesh mesh, const Vec3f& by) {
  for (Vec3f& x : mesh.position) x += by;
  return mesh;
}

/// A tank with a ball and drops above it.
sim::Frame splash() {
  sim::Frame frame = fill([](const Vec3& x) { return x[2] < 0.2 + 0.03 * std::sin(20 * x[0]) || (x - Vec3(0.4, 0.3, 0.4)).norm() < 0.06; });
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0.02f, 0.58f);
  for (int i = 0; i < 100; ++i) {
    frame.position.emplace_back(unit(random), unit(random), unit(random));
    frame.velocity.emplace_back(0, 0, 1);
    frame.id.push_back(static_cast<std::int64_t>(frame.id.size()));
  }
  return frame;
}

}  // namespace

// The particles' own volume differs from the ball's by the noise of its rim, 0.3 %.
TEST(LevelSet, BallHasTheVolumeOfItsParticles) {
  for (const double radius : {0.12, 0.2}) {
    const sim::Frame frame = ball(radius);
    const double v = volume(mesh_of(frame));
    EXPECT_NEAR(v / particle_volume(frame), 1, 0.03) << radius;
  }
}

TEST(LevelSet, BallHasItsRadiusAllRound) {
  const surface::Mesh mesh = mesh_of(ball(0.2));
  double mean = 0, largest = 0;
  for (const Vec3f& x : mesh.position) {
    const double d = (x.cast<double>() - Vec3(0.4, 0.3, 0.3)).norm() - 0.2;
    mean += d / double(mesh.position.size());
    largest = std::max(largest, std::fabs(d));
  }
  EXPECT_NEAR(mean, 0, 0.15 * kVoxel);
  EXPECT_LT(largest, 0.5 * kVoxel);   // the jitter of the particles is +-1/2 voxel
}

TEST(LevelSet, BoxHasTheVolumeOfItsParticles) {
  const sim::Frame frame = fill([](const Vec3& x) { return x[0] > 0.2 && x[0] < 0.6 && x[1] > 0.15 && x[1] < 0.45 && x[2] > 0.15 && x[2] < 0.45; });
  EXPECT_NEAR(volume(mesh_of(frame)) / particle_volume(frame), 1, 0.03);
}

TEST(LevelSet, CalmTankIsFlatAtItsTrueHeight) {
  const surface::Mesh mesh = mesh_of(tank(0.3));
  double sum = 0, square = 0, tilt = 0, n = 0;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const Vec3f& x = mesh.position[v];
    if (x[2] < 0.2f || x[0] < 0.02f || x[0] > 0.78f || x[1] < 0.02f || x[1] > 0.58f) continue;   // the rim is a corner of two faces
    const double d = (x[2] - 0.3) / kVoxel, t = std::acos(std::min(1.0f, mesh.normal[v][2]));
    sum += d, square += d * d, tilt += t * t, n += 1;
  }
  ASSERT_GT(n, 3000);
  EXPECT_NEAR(sum / n, 0, 0.05);
  EXPECT_LT(std::sqrt(square / n), 0.08);                   // voxels; the particles scatter by 0.29
  EXPECT_LT(std::sqrt(tilt / n) * 180 / M_PI, 2.5);
}

TEST(LevelSet, IsCutFlatAtTheWallsAndHalfAVoxelBelowTheFloor) {
  const surface::Mesh mesh = mesh_of(tank(0.3));
  const base::Box box = room().domain;
  const double floor = box.lower[2] - kVoxel / 2;
  std::array<double, 5> area = {};   // of the four sides and the bottom
  for (const auto& q : mesh.quads) {
    const auto all = [&](int axis, double at) {
      for (int i = 0; i < 4; ++i)
        if (std::fabs(corner(mesh, q, i)[axis] - at) > 1e-6) return false;
      return true;
    };
    const double planes[5] = {box.lower[0], box.upper[0], box.lower[1], box.upper[1], floor};
    for (std::size_t p = 0; p < 5; ++p)
      if (all(int(p) / 2, planes[p])) area[p] += vector_area(mesh, q).norm();
  }
  const double margin = 1.5 * kVoxel;
  const double width[4] = {0.6, 0.6, 0.8, 0.8};
  for (std::size_t p = 0; p < 4; ++p) {
    EXPECT_GT(area[p], (width[p] - margin) * (0.3 - margin)) << p;
    EXPECT_LT(area[p], width[p] * 0.31) << p;
  }
  EXPECT_GT(area[4], (0.8 - margin) * (0.6 - margin));
  for (const Vec3f& x : mesh.position) {
    EXPECT_GE(x[2], floor - 1e-6);
    EXPECT_GE(x[0], box.lower[0] - 1e-6);
    EXPECT_LE(x[1], box.upper[1] + 1e-6);
  }
}

// Without particles beyond the wall the averaged spheres would turn away from it.
TEST(LevelSet, SurfaceMeetsTheWallAtItsOwnHeight) {
  const surface::Mesh mesh = mesh_of(tank(0.3));
  double low = 1;
  for (const Vec3f& x : mesh.position)
    if (x[2] > 0.2f && x[0] > 0.4f * float(kVoxel) && x[0] < 1.5f * float(kVoxel) && x[1] > 0.05f && x[1] < 0.55f) low = std::min(low, double(x[2]));
  EXPECT_GT(low, 0.3 - 0.6 * kVoxel);
  EXPECT_LT(low, 1);
}

// A ball half a voxel above the floor: the wedge of air between its lowest particles and their mirror images is what water fills.
TEST(LevelSet, WhatIsDryTouchesAWallAndDoesNotClingToIt) {
  const sim::Frame frame = fill([](const Vec3& x) { return (x - Vec3(0.4, 0.3, 0.15 + kVoxel / 2)).norm() < 0.15; });
  const auto foot = [&](const std::vector<bool>& dry, bool has_walls = true) {   // [m] its radius, half a voxel above the floor
    surface::Room walls = room();
    walls.dry = dry;
    if (!has_walls) walls.walls = {};
    double widest = 0;
    for (const Vec3f& x : mesh_of(frame, {}, walls).position)
      if (std::fabs(x[2] - kVoxel / 2) < 0.3 * kVoxel) widest = std::max(widest, std::hypot(double(x[0]) - 0.4, double(x[1]) - 0.3));
    return widest;
  };
  EXPECT_LT(foot({true}), 4.3 * kVoxel);
  EXPECT_GT(foot({}), 5 * kVoxel);
  EXPECT_EQ(foot({false, true}), foot({})) << "it is the second body that is dry";
  EXPECT_EQ(foot({true}, false), foot({}, false)) << "a side that is no wall is nothing to touch";
}

// Beyond a periodic side lies what is at the other one, and no mirror image: a slope goes on, and so does a ball that the sides cut.
TEST(LevelSet, GoesOnAcrossAPeriodicSide) {
  surface::Room periodic = room();
  periodic.walls[0] = {false, false};
  periodic.periodic[0] = true;
  const double length = periodic.domain.size()[0];
  const auto height = [&](double x) { return 0.35 + 0.06 * std::sin(2 * M_PI * x / length); };
  const surface::Mesh wave = mesh_of(fill([&](const Vec3& x) { return x[2] < height(x[0]); }), {}, periodic);
  const auto mean_error = [&](double from, double to) {   // [voxels] of a slope of a half
    double sum = 0;
    int count = 0;
    for (const Vec3f& x : wave.position)
      if (x[0] >= from && x[0] <= to && x[1] > 0.1f && x[1] < 0.5f && x[2] > 0.2f) sum += double(x[2]) - height(double(x[0])), ++count;
    EXPECT_GT(count, 60);
    return sum / count / kVoxel;
  };
  EXPECT_NEAR(mean_error(0.5 * kVoxel, 2.5 * kVoxel), 0, 0.2);
  EXPECT_NEAR(mean_error(length - 2.5 * kVoxel, length - 0.5 * kVoxel), 0, 0.2);

  const double radius = 0.12, off = 0.05, cut = std::sqrt(radius * radius - off * off);
  const auto from_ball = [&](const Vec3& x) { return (Vec3(x[0] > length / 2 ? x[0] - length : x[0], x[1], x[2]) - Vec3(off, 0.3, 0.3)).norm(); };
  const surface::Mesh ball_mesh = mesh_of(fill([&](const Vec3& x) { return from_ball(x) < radius; }), {}, periodic);
  double lower = 0, upper = 0;   // [m] radii of the cuts
  for (const Vec3f& x : ball_mesh.position) {
    const double from_axis = std::hypot(double(x[1]) - 0.3, double(x[2]) - 0.3);
    if (double(x[0]) < kVoxel) lower = std::max(lower, from_axis);
    if (double(x[0]) > length - kVoxel) upper = std::max(upper, from_axis);
  }
  EXPECT_NEAR(lower, cut, 1.2 * kVoxel);
  EXPECT_NEAR(upper, cut, 1.2 * kVoxel);
}

TEST(LevelSet, VelocityOfUniformFlowIsTheParticles) {
  surface::Room open = room();
  open.walls = {};
  const surface::Mesh mesh = mesh_of(tank(0.3), {}, open);
  ASSERT_GT(mesh.velocity.size(), 3000u);
  double largest = 0;
  for (const Vec3f& v : mesh.velocity) largest = std::max(largest, double((v - Vec3f(1, 2, -3)).norm()));
  EXPECT_LT(largest, 3e-3);   // half floats: 3 * 2^-11
}

// On a wall it has the particles' components along the wall and none into it; so beside a collider, which may move itself.
TEST(LevelSet, VelocityLeadsAlongWallsAndColliders) {
  surface::Room walls = room();
  walls.walls[1][1] = false;
  sim::Shape block;
  block.box = base::Box{Vec3(0.3, 0.2, 0), Vec3(0.5, 0.4, 0.4)};
  walls.solids = {{block, {Vec3(5, 0, 0)}}};
  const surface::Mesh mesh = mesh_of(fill([&](const Vec3& x) { return x[2] < 0.3 && block.distance(x) > 0; }), {}, walls);
  int on_wall = 0, on_open = 0, beside = 0;
  double with_block = 0;
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    const Vec3f &x = mesh.position[i], &v = mesh.velocity[i];
    if (x[2] < 0.1f || x[2] > 0.32f) continue;
    if (x[0] == 0 && x[1] > 0.1f && x[1] < 0.5f) {
      EXPECT_LT((v - Vec3f(0, 2, -3)).norm(), 5e-3) << x.transpose();
      ++on_wall;
    } else if (x[0] > 0.1f && x[0] < 0.7f && x[1] > 0.6f - 1e-6f) {
      EXPECT_LT((v - Vec3f(1, 2, -3)).norm(), 5e-3) << x.transpose();
      ++on_open;
    } else if (std::fabs(x[0] - 0.5f) < 0.6f * float(kVoxel) && x[1] > 0.25f && x[1] < 0.35f) {
      with_block += v[0];
      EXPECT_NEAR(v[1], 2, 0.05);
      ++beside;
    }
  }
  EXPECT_GT(on_wall, 500);
  EXPECT_GT(on_open, 500);
  ASSERT_GT(beside, 5);
  EXPECT_NEAR(with_block / beside, 5, 0.5);   // of a change by 4 within a few voxels
}

// Half a spacing less than the radius beyond the boundary, where the outermost particles' mean is a radius away; moving as they do all over.
TEST(LevelSet, RadiusMayBeLongerThanAParticleIsSeenByDefault) {
  surface::Options thick;
  for (const double spacings : {3.0, 6.0, 8.0}) {
    thick.radius = spacings * kVoxel;
    const surface::Mesh mesh = mesh_of(ball(0.12), thick);
    const double radius = std::cbrt(volume(mesh) * 3 / (4 * M_PI));
    EXPECT_NEAR((radius - 0.12) / kVoxel, spacings - 0.5, 0.5) << spacings;
    for (const Vec3f& v : mesh.velocity) ASSERT_LT((v - Vec3f(1, 2, -3)).norm(), 5e-3f) << spacings;
  }
}

TEST(LevelSet, SingleParticleIsASmallDropWhereverItIs) {
  for (const Vec3f& at : {Vec3f(0.4f, 0.3f, 0.3f), Vec3f(0.405f, 0.305f, 0.305f), Vec3f(0.4025f, 0.301f, 0.309f)}) {
    const surface::Mesh mesh = mesh_of(single(at));
    ASSERT_GE(mesh.quads.size(), 6u);
    const double radius = std::cbrt(volume(mesh) * 3 / (4 * M_PI)) / kVoxel;
    EXPECT_GT(radius, 0.8);
    EXPECT_LT(radius, 1.5);
    for (const Vec3f& x : mesh.position) EXPECT_LT((x - at).norm(), 1.6 * kVoxel);
    for (const Vec3f& v : mesh.velocity) EXPECT_NEAR(v[2], -1, 1e-3);
  }
}

// One layer of particles, and the air on both sides of it.
TEST(LevelSet, SheetOfOneLayerHasNoHoles) {
  const sim::Frame frame = fill([](const Vec3& x) { return x[2] > 0.3 && x[2] < 0.3 + kVoxel; });
  const surface::Mesh mesh = mesh_of(frame);
  double up = 0, down = 0;
  for (const auto& q : mesh.quads) {
    const double a = vector_area(mesh, q)[2];
    (a > 0 ? up : down) += a;
  }
  EXPECT_NEAR(up, 0.8 * 0.6, 1e-3);
  EXPECT_NEAR(down, -0.8 * 0.6, 1e-3);
}

// Water on both sides of a gap of four particle spacings or more must not fill it, neither near the walls nor deep inside, wherever the blocks begin. Filled
// in the middle, it has 3 % more.
TEST(LevelSet, GapBetweenTwoBodiesStaysOpen) {
  surface::Options options;
  for (const auto& [voxels, gap] : {std::pair(1.0, 2.5 * kCell), {0.8, 2 * kCell}, {0.4, 2.5 * kCell}, {1.5, 2 * kCell}}) {
    const double voxel = voxels * kVoxel, middle = std::round(0.4 / (8 * voxel)) * 8 * voxel;
    options.voxel = voxel;
    const sim::Frame frame = fill([middle, gap = gap](const Vec3& x) { return std::fabs(x[0] - middle) > gap / 2; });
    EXPECT_NEAR(volume(mesh_of(frame, options)) / ((0.8 - gap) * 0.6 * (0.6 + voxel / 2)), 1, 0.015) << voxels << " " << gap;
  }
}

TEST(LevelSet, FileHoldsHalfFloatLevelSetAndVelocity) {
  surface::Options options;
  options.vel_name = "velocity";
  const auto grids = grids_of(ball(0.1), options);
  ASSERT_EQ(grids.size(), 2u);
  EXPECT_EQ(grids[0].name, "surface");
  EXPECT_EQ(grids[0].type, "float");
  EXPECT_EQ(grids[0].grid_class, "level set");
  EXPECT_TRUE(grids[0].half);
  EXPECT_NE(grids[0].compression.find("blosc"), std::string::npos);
  EXPECT_NEAR(*grids[0].max, 3 * kVoxel, 0.1 * kVoxel);   // a band of three voxels to each side
  EXPECT_NEAR(*grids[0].min, -3 * kVoxel, 0.1 * kVoxel);
  EXPECT_EQ(grids[1].name, "velocity");
  EXPECT_EQ(grids[1].type, "vec3s");
  EXPECT_EQ(grids[1].active, grids[0].active);
}

TEST(LevelSet, SpeedsBeyondTheLargestHalfAreThat) {
  sim::Frame frame = ball(0.1);
  for (Vec3f& v : frame.velocity) v = Vec3f(1e6f, 0, -1e6f);
  const surface::Mesh mesh = mesh_of(frame);
  ASSERT_FALSE(mesh.velocity.empty());
  for (const Vec3f& v : mesh.velocity) EXPECT_EQ(v, Vec3f(65504, 0, -65504));
}

TEST(LevelSet, FrameWithoutParticlesGivesEmptyGrids) {
  const sim::Frame none = fill([](const Vec3&) { return false; });
  const auto grids = grids_of(none);
  ASSERT_EQ(grids.size(), 2u);
  EXPECT_EQ(grids[0].active, 0u);
  EXPECT_TRUE(mesh_of(none).quads.empty());
}

TEST(LevelSet, ThreadsDoNotChangeAByte) {
  const sim::Frame frame = splash();
  const std::string one = bytes_with_threads(frame, 1);
  ASSERT_GT(one.size(), 10000u);
  EXPECT_EQ(one, bytes_with_threads(frame, 2));
  EXPECT_EQ(one, bytes_with_threads(frame, 4));
}

TEST(LevelSet, LedgerNamesItsPasses) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  surface::write_surface(file.path(), ball(0.1), {}, room(), ledger);
  surface::read_surface(file.path(), {}, ledger);
  for (const char* name : {"rasterize", "rebuild", "smooth", "velocity", "write_surface", "mesh"}) EXPECT_EQ(ledger.passes().count(name), 1u) << name;
  base::Ledger without;
  surface::Options rough;
  rough.smooth = 0;
  surface::write_surface(file.path(), ball(0.1), rough, room(), without);
  EXPECT_EQ(without.passes().count("smooth"), 0u);
}

// A domain of 8e12 voxels, empty but for a ball.
TEST(LevelSet, EmptyDomainCostsNothing) {
  sim::Frame frame = ball(0.1);
  for (Vec3f& x : frame.position) x += Vec3f(100, 100, 100);
  surface::Room wide = room();
  wide.domain.upper = Vec3(200, 200, 200);
  EXPECT_NEAR(volume(moved(mesh_of(frame, {}, wide), Vec3f(-100, -100, -100))) / particle_volume(frame), 1, 0.03);
}

TEST(LevelSet, VoxelTooSmallForTheParticlesIsTheUsersMistake) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  surface::Options fine;
  fine.voxel = 1e-5;
  EXPECT_THROW(surface::write_surface(file.path(), ball(0.1), fine, room(), ledger), base::Error);
}
