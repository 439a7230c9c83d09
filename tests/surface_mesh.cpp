#include <map>

#include "base/atomic_file.h"
#include "base/error.h"
#include "tests/closed_meshes.h"
#include "tests/surface_bodies.h"

using namespace surface_test;

namespace {

sim::Frame tank_with_ball_and_drop() {
  sim::Frame frame = fill([](const Vec3& x) { return x[2] < 0.15 || (x - Vec3(0.4, 0.3, 0.4)).norm() < 0.1; });
  frame.position.emplace_back(0.1f, 0.1f, 0.4f);
  frame.velocity.emplace_back(0, 0, 0);
  frame.id.push_back(static_cast<std::int64_t>(frame.id.size()));
  return frame;
}

}  // namespace

// Vertices at the same place count as one: at a wall there are two, with different normals.
TEST(Mesh, EachEdgeIsSharedByTwoQuadsInOppositeDirections) {
  const surface::Mesh mesh = mesh_of(tank_with_ball_and_drop());
  ASSERT_GT(mesh.quads.size(), 10000u);
  std::map<std::array<float, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> place;
  for (const Vec3f& x : mesh.position) place.push_back(places.try_emplace({x[0], x[1], x[2]}, std::uint32_t(places.size())).first->second);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> times;
  for (const auto& q : mesh.quads)
    for (std::size_t i = 0; i < 4; ++i)
      if (q[i] != q[(i + 1) % 4]) ++times[{place[q[i]], place[q[(i + 1) % 4]]}];
  for (const auto& [edge, n] : times) {
    EXPECT_EQ(n, 1);
    EXPECT_EQ(times.count({edge.second, edge.first}), 1u);
  }
}

TEST(Mesh, EdgeAtAWallIsSharp) {
  const surface::Mesh mesh = mesh_of(tank(0.3));
  double low = 1, high = 0;
  int seen = 0;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const Vec3f& x = mesh.position[v];
    if (x[0] != 0 || x[2] < 0.28f || x[1] < 0.03f || x[1] > 0.57f || mesh.normal[v][2] < 0.5f) continue;
    low = std::min(low, double(x[2])), high = std::max(high, double(x[2]));
    ++seen;
  }
  EXPECT_GT(seen, 40);
  EXPECT_GT(low, 0.3 - 0.3 * kVoxel);    // as rough as the surface itself
  EXPECT_LT(high, 0.3 + 0.3 * kVoxel);
}

// Between water and a block that stands in it there is no surface: rays would see a film of air.
TEST(Mesh, GoesOnIntoColliders) {
  sim::Shape block;
  block.box = base::Box{Vec3(0.3, 0.2, 0), Vec3(0.5, 0.4, 0.4)};
  const sim::Frame frame = fill([&](const Vec3& x) { return x[2] < 0.3 && block.distance(x) > 0; });
  const auto beside_the_block = [&](const surface::Room& walls) {
    int vertices = 0;
    for (const Vec3f& x : mesh_of(frame, {}, walls).position) {
      const double d = block.distance(x.cast<double>());
      vertices += x[2] > 2 * kVoxel && x[2] < 0.3 - 4 * kVoxel && std::fabs(d) < 2 * kVoxel;
    }
    return vertices;
  };
  surface::Room walls = room();
  EXPECT_GT(beside_the_block(walls), 1000);
  walls.solids = {{block}};
  EXPECT_EQ(beside_the_block(walls), 0);
}

// The same of a block that is a mesh, whose distances are linear between points.
TEST(Mesh, GoesOnIntoAColliderThatIsAMesh) {
  const Vec3 middle(0.41, 0.29, 0.13);
  sim::Shape ball, as_mesh;
  ball.sphere = sim::Shape::Sphere{middle, 0.15};
  as_mesh.mesh = mesh_test::collider_of(mesh_test::ball(48), 0.15, middle, kCell);
  const sim::Frame water = fill([&](const Vec3& x) { return ball.distance(x) > 0 && x[2] < 0.4; });
  const auto beside_the_ball = [&](const sim::Shape& solid) {
    surface::Room walls = room();
    walls.solids = {{solid}};
    int vertices = 0;
    for (const Vec3f& x : mesh_of(water, {}, walls).position) vertices += x[2] > 4 * kVoxel && std::abs(ball.distance(x.cast<double>())) < 2 * kVoxel;
    return vertices;
  };
  EXPECT_EQ(beside_the_ball(ball), 0);
  EXPECT_EQ(beside_the_ball(as_mesh), 0);
}

// Water that stands against a plate ends inside it; water on both sides meets in its middle.
TEST(Mesh, EndsInsideAThinCollider) {
  for (const double thick : {4.0, 2.0, 1.5, 1.0}) {
    sim::Shape plate;
    plate.box = base::Box{Vec3(0.4, 0, 0), Vec3(0.4 + thick * kVoxel, 0.6, 0.6)};
    surface::Room walls = room();
    walls.solids = {{plate}};
    double furthest = 0;
    for (const Vec3f& x : mesh_of(fill([](const Vec3& x) { return x[0] < 0.4 && x[2] < 0.3; }), {}, walls).position)
      furthest = std::max(furthest, (x[0] - 0.4) / kVoxel);
    EXPECT_LT(furthest, thick - 0.05) << "seen on the dry side";
    EXPECT_GT(furthest, 0.2) << "nothing was continued into the plate";
    int between = 0;
    for (const Vec3f& x : mesh_of(fill([&](const Vec3& x) { return plate.distance(x) > 0 && x[2] < 0.3; }), {}, walls).position)
      between += x[2] > 2 * kVoxel && x[2] < 0.3 - 4 * kVoxel && plate.distance(x.cast<double>()) < kVoxel && x[1] > 3 * kVoxel && x[1] < 0.6 - 3 * kVoxel;
    EXPECT_EQ(between, 0) << thick;
  }
}

// [m2] of the mesh that lies in the plane x[axis] = at, within the box.
double area_in_plane(const surface::Mesh& mesh, int axis, double at, const base::Box& box) {
  double area = 0;
  for (const auto& q : mesh.quads) {
    Vec3 middle = Vec3::Zero();
    bool in_plane = true;
    for (int i = 0; i < 4; ++i) {
      const Vec3 x = corner(mesh, q, i);
      middle += x / 4;
      in_plane &= std::fabs(x[axis] - at) < 0.02 * kVoxel;
    }
    if (in_plane && (middle.array() > box.lower.array()).all() && (middle.array() < box.upper.array()).all()) area += vector_area(mesh, q).norm();
  }
  return area;
}

// Where a collider's face lies in a wall, the cut water must not: rays could not tell which is in front.
TEST(Mesh, SharesNoPlaneWithAColliderInAWall) {
  const double edge = 0.3 + 0.4 * kVoxel;   // between voxels
  for (const int axis : {0, 1})
    for (const bool upper : {false, true}) {
      const double at = upper ? room().domain.upper[axis] : 0;
      sim::Shape block;
      block.box = base::Box{Vec3(edge, edge, 0), Vec3(0.5, 0.5, 0.5)};
      (upper ? block.box->upper : block.box->lower)[axis] = at;
      surface::Room walls = room();
      walls.solids = {{block}};
      const sim::Frame frame = fill([&](const Vec3& x) { return x[2] < 0.4 && block.distance(x) > 0; });
      base::Box face = *block.box, beside = face;
      face.lower[axis] = at - kVoxel, face.upper[axis] = at + kVoxel;
      face.lower[1 - axis] += 0.01 * kVoxel, face.upper[1 - axis] -= 0.01 * kVoxel;
      beside.lower[axis] = at - kVoxel, beside.upper[axis] = at + kVoxel;
      beside.upper[1 - axis] = edge - kVoxel, beside.lower[1 - axis] = edge - 10 * kVoxel;
      beside.lower[2] = 0.05, beside.upper[2] = 0.35;
      const surface::Mesh mesh = mesh_of(frame, {}, walls);
      EXPECT_LT(area_in_plane(mesh, axis, at, face), 3 * kVoxel * kVoxel) << axis << upper;   // below the floor
      EXPECT_NEAR(area_in_plane(mesh, axis, at, beside), 9 * kVoxel * 0.3, kVoxel * 0.3) << axis << upper;
    }
}

// A pane outside the wall: the water goes half a voxel into it, to the pane's end and no further.
TEST(Mesh, GoesOnIntoWhatLiesBehindAWall) {
  sim::Shape pane;
  pane.box = base::Box{Vec3(0.2, -0.02, 0), Vec3(0.6, 0, 0.5)};
  surface::Room walls = room();
  walls.solids = {{pane}};
  const surface::Mesh mesh = mesh_of(tank(0.3), {}, walls);
  const base::Box under{Vec3(0.2 + 2 * kVoxel, -0.1, 2 * kVoxel), Vec3(0.6 - 2 * kVoxel, 0.1, 0.3 - 2 * kVoxel)};
  EXPECT_EQ(area_in_plane(mesh, 1, 0, under), 0);
  EXPECT_NEAR(area_in_plane(mesh, 1, -kVoxel / 2, under), (0.4 - 4 * kVoxel) * (0.3 - 4 * kVoxel), 2e-3);
  EXPECT_NEAR(area_in_plane(mesh, 1, 0, {Vec3(0, -0.1, 0.05), Vec3(0.19, 0.1, 0.25)}), 0.19 * 0.2, 2e-3);
  for (const Vec3f& x : mesh.position) EXPECT_TRUE(x[1] > -0.01 * kVoxel || pane.distance(x.cast<double>()) < 0) << x.transpose();
}

// A ball above a block's edge: what is continued into the block through its top does not come out at its side.
TEST(Mesh, GoesOnIntoCollidersButNotThroughTheirOtherFaces) {
  sim::Shape block;
  block.box = base::Box{Vec3(0.1, 0.1, 0), Vec3(0.4, 0.5, 0.3)};
  const Vec3 middle(0.4, 0.3, 0.42);
  surface::Room walls = room();
  walls.solids = {{block}};
  const surface::Mesh mesh = mesh_of(fill([&](const Vec3& x) { return (x - middle).norm() < 0.1 && block.distance(x) > 0; }), {}, walls);
  int inside = 0;
  for (const Vec3f& v : mesh.position) {
    const Vec3 x = v.cast<double>();
    inside += block.distance(x) < 0;
    EXPECT_TRUE(block.distance(x) < 0 || (x - middle).norm() < 0.1 + 2 * kVoxel) << x.transpose();
  }
  EXPECT_GT(inside, 100) << "nothing was continued into the block";
}

TEST(Mesh, FacesOutwards) {
  const surface::Mesh mesh = mesh_of(ball(0.2));
  EXPECT_GT(volume(mesh), 0);
  for (const auto& q : mesh.quads) EXPECT_GT(vector_area(mesh, q).dot(corner(mesh, q, 0) - Vec3(0.4, 0.3, 0.3)), 0);
}

TEST(Mesh, NormalsHaveLengthOneAndFaceOutwards) {
  const surface::Mesh mesh = mesh_of(ball(0.2));
  double worst = 1;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    EXPECT_NEAR(mesh.normal[v].norm(), 1, 1e-5);
    worst = std::min(worst, mesh.normal[v].cast<double>().dot((mesh.position[v].cast<double>() - Vec3(0.4, 0.3, 0.3)).normalized()));
  }
  EXPECT_GT(worst, std::cos(15 * M_PI / 180));
}

TEST(Mesh, NormalsOfCutFacesAreTheWalls) {
  const surface::Mesh mesh = mesh_of(tank(0.3));
  int seen = 0;
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const Vec3f& x = mesh.position[v];
    if (x[0] != 0 || x[2] < 0.03f || x[2] > 0.27f || x[1] < 0.03f || x[1] > 0.57f) continue;
    EXPECT_NEAR(mesh.normal[v][0], -1, 1e-5);
    ++seen;
  }
  EXPECT_GT(seen, 500);
}

TEST(Mesh, IsTheSameEveryTime) {
  const surface::Mesh a = mesh_of(tank_with_ball_and_drop()), b = mesh_of(tank_with_ball_and_drop());
  EXPECT_EQ(a.quads, b.quads);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.normal, b.normal);
}

TEST(Mesh, PointsAreNotTakenForALevelSet) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  surface::write_points(file.path(), ball(0.05), ledger);
  EXPECT_THROW(surface::read_surface(file.path(), {}, ledger), base::Error);
}

TEST(Mesh, DamagedFileIsOneLine) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  surface::write_surface(file.path(), ball(0.05), {}, room(), ledger);
  const std::string whole = base::read_file(file.path());
  base::write_text_atomically(file.path(), whole.substr(0, whole.size() / 2));
  EXPECT_THROW(surface::read_surface(file.path(), {}, ledger), base::Error);
}
