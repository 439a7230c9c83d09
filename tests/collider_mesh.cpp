// Colliders that are meshes: their distances, and liquids and solids that meet them as they meet the shape that the mesh is of.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "sim/colliders/solids.h"
#include "sim/fluid/open_faces.h"
#include "sim/random.h"
#include "sim/simulation.h"
#include "tests/closed_meshes.h"
#include "tests/solid_scenes.h"
#include "tests/threads.h"

namespace {

using namespace sim;
using base::Vec3;
using mesh_test::ball, mesh_test::box, mesh_test::collider_of, mesh_test::Surface;

/// A part of a ball, from its lowest place up to an angle from there; returns the first corner of the uppermost ring.
constexpr int kAround = 64, kUp = 24;
std::uint32_t add_cap(double radius, double angle, bool outwards, Surface& s) {
  const auto first = std::uint32_t(s.corners.size());
  s.corners.emplace_back(0, 0, float(-radius));
  for (int j = 1; j <= kUp; ++j)
    for (int i = 0; i < kAround; ++i) {
      const double a = 2 * M_PI * i / kAround, b = angle * j / kUp;
      s.corners.emplace_back(float(radius * std::sin(b) * std::cos(a)), float(radius * std::sin(b) * std::sin(a)), float(-radius * std::cos(b)));
    }
  const auto corner = [&](int i, int j) { return j == 0 ? first : first + 1 + std::uint32_t((j - 1) * kAround + i % kAround); };
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    s.triangles.push_back(outwards ? ClosedMesh::Triangle{a, c, b} : ClosedMesh::Triangle{a, b, c});
  };
  for (int j = 0; j < kUp; ++j)
    for (int i = 0; i < kAround; ++i) {
      if (j > 0) triangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
      triangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
    }
  return corner(0, kUp);
}

/// Half a ball of radius 1 with a wall as thick as `wall`, open above.
Surface bowl(double wall) {
  Surface s;
  const std::uint32_t outer = add_cap(1, M_PI / 2, true, s), inner = add_cap(1 - wall, M_PI / 2, false, s);
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const std::uint32_t next = (i + 1) % kAround;
    s.triangles.push_back({outer + i, outer + next, inner + i});
    s.triangles.push_back({outer + next, inner + next, inner + i});
  }
  return s;
}

/// What fills such a bowl up to `below` under its rim.
Surface content(double wall, double below) {
  Surface s;
  const double radius = 1 - wall;
  const std::uint32_t ring = add_cap(radius, std::acos(below / radius), true, s);
  const auto top = std::uint32_t(s.corners.size());
  s.corners.emplace_back(0, 0, float(-below));
  for (std::uint32_t i = 0; i < kAround; ++i) s.triangles.push_back({ring + i, ring + (i + 1) % kAround, top});
  return s;
}

Effect gravity() { return {.acceleration = Vec3(0, 0, -9.81)}; }

/// A tank of a metre by 0.4 m by 0.6 m with water in a box.
Scene tank(double cell, const base::Box& filled) {
  Scene scene;
  scene.options.domain = {Vec3::Zero(), Vec3(1, 0.4, 0.6)};
  scene.options.cell = cell;
  Body water;
  water.name = "water";
  water.shape.box = filled;
  scene.bodies = {water};
  scene.effects = {gravity()};
  return scene;
}

std::vector<Totals> run(const Scene& scene, int frames, std::vector<base::Vec3f>* last = nullptr) {
  const auto simulation = make_simulation(scene, 24);
  std::vector<Totals> all = solid_test::run(*simulation, frames);
  if (last) *last = simulation->frame().position;
  return all;
}

/// A block that slides along x over a table, which is a box.
Scene cube_on_a_table(double friction) {
  Scene scene = solid_test::walled_scene(3, 1, 1.0 / 24);
  Body cube;
  cube.name = "cube";
  cube.is_solid = true;
  cube.solid = {.model = Elasticity::neo_hookean, .density = 1000, .young = 2e5, .poisson = 0.3};
  cube.shape.box = base::Box{Vec3(0.2, 0.4, 0.3), Vec3(0.4, 0.6, 0.5)};
  cube.velocity = Vec3(1, 0, 0);
  scene.bodies = {cube};
  scene.effects = {gravity()};
  Collider table;
  table.meets_solids = true;
  table.friction = friction;
  table.shape.box = base::Box{Vec3(0.05, 0.05, 0.1), Vec3(0.95, 0.95, 0.3)};
  scene.colliders = {table};
  return scene;
}

}  // namespace

TEST(MeshDistance, IsABallsNearItAndOfItsSignFarFromIt) {
  constexpr double kCell = 0.05, kRadius = 0.3;
  const Vec3 middle(0.51, 0.52, 0.53);
  const Shape::Mesh mesh = collider_of(ball(64), kRadius, middle, kCell);
  ASSERT_EQ(mesh.distances->objection(), "");
  EXPECT_EQ(mesh.distances->thickness(), 8 * kCell);
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(-0.5, 1.5);
  double worst = 0, turned = 0;
  int far = 0;
  for (int n = 0; n < 100000; ++n) {
    const Vec3 at(u(rng), u(rng), u(rng)), out = (at - middle).normalized();
    const double exact = (at - middle).norm() - kRadius;
    Vec3 normal;
    const double d = mesh.distances->distance(at, &normal);
    EXPECT_NEAR(normal.norm(), 1, 1e-5);
    if (std::abs(exact) < 4 * kCell && exact > -0.2) {
      worst = std::max(worst, std::abs(d - exact)), turned = std::max(turned, std::acos(std::min(1.0, normal.dot(out))));
    } else if (std::abs(exact) > 1e-3) {
      ASSERT_EQ(d < 0, exact < 0) << at.transpose();
      ASSERT_LE(std::abs(d), std::abs(exact) + 1e-3) << at.transpose();
      ++far;
    }
  }
  EXPECT_LT(worst, 0.04 * kCell);   // where the radius is two cells: a chord of the points
  EXPECT_LT(turned, 0.2);
  EXPECT_GT(far, 50000);
}

// Points lie on the corners and middles of cells: a face in a plane of cells' faces is one to the last bit.
TEST(MeshDistance, OfABoxIsTheBoxsBesideItsFaces) {
  constexpr double kCell = 0.1;
  const Shape::Mesh mesh = collider_of(box({0, 0, 0}, {1, 1, 1}), 0.5, Vec3(0.2, 0.3, 0.4), kCell);
  Shape same;
  same.box = base::Box{Vec3(0.2, 0.3, 0.4), Vec3(0.7, 0.8, 0.9)};
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> along(0.11, 0.39), across(-0.1, 0.1);
  for (int n = 0; n < 20000; ++n) {
    Vec3 at(along(rng), along(rng), along(rng)), normal, exact;
    const int axis = n % 3;
    at[axis] = (n / 3 % 2 ? 0.5 : 0) + across(rng);
    at += same.box->lower;
    ASSERT_NEAR(mesh.distances->distance(at, &normal), same.distance(at, &exact), 1e-7) << at.transpose();
    ASSERT_LT((normal - exact).norm(), 1e-5) << at.transpose();
  }
}

TEST(MeshDistance, GoesFinerWhereTheMeshIsThinAndRefusesWhatIsTooThin) {
  const auto distances = [](const Surface& s, double scale) {
    return MeshDistance(mesh_test::shape_of(s, scale, Vec3::Zero()).solid, 0.05, Vec3::Zero(), mesh_test::everywhere());
  };
  EXPECT_EQ(distances(bowl(0.2), 0.4).thickness(), 0.05);   // walls of 8 cm
  EXPECT_EQ(distances(bowl(0.1), 0.4).thickness(), 0.025);
  EXPECT_EQ(distances(bowl(0.05), 0.4).thickness(), 0.0125);
  EXPECT_EQ(distances(bowl(0.01), 0.4).objection(), "is thinner than an eighth of sim.cell on 100 % of its surface: liquid would pass");
  EXPECT_EQ(distances(ball(12), 1e5).objection(), "is 2e+05 m long: too large for cells of 0.05 m");
  const MeshDistance thin = distances(bowl(0.1), 0.2);   // walls of 2 cm
  EXPECT_EQ(thin.objection(), "");
  EXPECT_LT(thin.distance(Vec3(0, 0, -0.19), nullptr), 0);
  EXPECT_GT(thin.distance(Vec3(0, 0, -0.17), nullptr), 0);
  thin.prepare();
  EXPECT_LT(thin.distance(Vec3(0, 0, -0.19), nullptr), -0.005);
  EXPECT_NEAR(thin.distance(Vec3(0, 0, -0.17), nullptr), 0.01, 1e-3);
  EXPECT_NEAR(thin.distance(Vec3(0, 0, -0.21), nullptr), 0.01, 1e-3);
}

// A hill that goes on beyond the domain, and what is nowhere near it.
TEST(MeshDistance, IsThatOfTheWholeMeshWithinTheDomainAlone) {
  const base::Box domain{Vec3(0, 0, 0), Vec3(1, 1, 1)};
  const auto hill = mesh_test::shape_of(ball(64), 3, Vec3(0.5, 0.5, -2.7)).solid;
  const MeshDistance there(hill, 0.05, Vec3::Zero(), domain), afar(mesh_test::shape_of(ball(16), 0.3, Vec3(5, 5, 5)).solid, 0.05, Vec3::Zero(), domain);
  there.prepare(), afar.prepare();
  for (const Vec3& at : {Vec3(0.5, 0.5, 0.4), Vec3(0.1, 0.9, 0.2), Vec3(0.9, 0.2, 0.1)})
    EXPECT_NEAR(there.distance(at, nullptr), (at - Vec3(0.5, 0.5, -2.7)).norm() - 3, 5e-3) << at.transpose();
  EXPECT_LT(there.distance(Vec3(2, 0.5, -2), nullptr), 0);   // outside the domain: the sign
  EXPECT_GT(there.distance(Vec3(2.9, 2.9, -0.1), nullptr), 0);
  EXPECT_NEAR(afar.distance(Vec3(1, 1, 1), nullptr), 3.7 * std::sqrt(3.0), 0.1);
  EXPECT_LT(afar.distance(Vec3(5, 5, 5), nullptr), 0);
}

TEST(MeshDistance, HasTheSameBitsOnAnyNumberOfThreads) {
  const auto sample = [&](int threads) {
    std::vector<double> values;
    on_threads(threads, [&] {
      const Shape::Mesh mesh = collider_of(bowl(0.2), 0.3, Vec3(0.4, 0.4, 0.4), 0.04);
      for (int n = 0; n < 8000; ++n) values.push_back(mesh.distances->distance(Vec3(n % 20, n / 20 % 20, n / 400) / 20, nullptr));
    });
    return values;
  };
  EXPECT_EQ(sample(1), sample(4));
}

// Particles in cells that are far inside are not asked for their distances.
TEST(Colliders, TouchNothingThatIsFarInside) {
  Scene scene = tank(0.05, {Vec3::Zero(), Vec3(1, 0.4, 0.5)});
  scene.options.boundary[0] = {Side::periodic, Side::periodic};
  const Lattice<3> lattice({20, 8, 10}, {true, false, false});
  Shape straight, turned, ball_shape, mesh;
  straight.box = base::Box{Vec3(0.2, 0.1, 0), Vec3(0.4, 0.3, 0.2)};
  turned = straight, turned.turn_by(30, Vec3(1, 2, -1));
  ball_shape.sphere = Shape::Sphere{Vec3(0.9, 0.21, 0.27), 0.13};
  mesh.mesh = collider_of(ball(96), 0.13, Vec3(0.5, 0.2, 0.25), 0.05);
  for (const Shape& shape : {straight, turned, ball_shape, mesh}) {
    Collider collider;
    collider.shape = shape;
    if (!shape.mesh) collider.velocity = Vec3(1, 0, 0);
    scene.colliders = {collider};
    Solids<3> solids(scene, lattice);
    for (const double time : {0.0, 0.37}) {
      solids.move_to(time);
      std::size_t far = 0, inside = 0;
      for (std::size_t n = 0; n < 20000; ++n) {
        Moving<3, float> particle{{}, Vec<3, float>::Zero()};
        Vec3 at;
        for (int a = 0; a < 3; ++a) {
          const double place = lattice.cells[std::size_t(a)] * uniform(11, n, std::uint64_t(a));
          particle.site.cell[std::size_t(a)] = int(place), particle.site.offset[a] = float(place - std::floor(place));
          at[a] = 0.05 * place;
        }
        const double depth = std::transform_reduce(solids.shapes.begin(), solids.shapes.end(), 1.0, [](double a, double b) { return std::min(a, b); },
                                                   [&](const Shape& s) { return s.distance(at); });
        const bool is_far = solids.is_far_inside(particle.site.cell);
        if (is_far) {
          EXPECT_GT(depth, 0.01) << at.transpose();
        }
        if (depth < -0.01) {
          EXPECT_GT(solids.push_out(particle), 0) << at.transpose();
        }
        far += is_far, inside += depth < -0.01;
      }
      EXPECT_GT(far, 2000);
      EXPECT_GT(inside, 50);
    }
  }
}

TEST(ColliderMesh, OpensFacesAsTheShapeItIsOf) {
  Scene scene = tank(0.05, {Vec3::Zero(), Vec3(1, 0.4, 0.5)});
  const Lattice<3> lattice({20, 8, 12}, {false, false, false});
  const ActiveBlocks<3> blocks = ActiveBlocks<3>::whole(lattice);
  const auto fractions = [&](const Shape& shape) {
    Collider collider;
    collider.shape = shape;
    scene.colliders = {collider};
    OpenFaces<3> open;
    open.update(Solids<3>(scene, lattice), blocks);
    return open;
  };
  const auto compare = [&](const Shape& shape, const Shape& mesh, double tolerance) {
    const OpenFaces<3> one = fractions(shape), other = fractions(mesh);
    double sum = 0;
    for (int a = 0; a < 3; ++a)
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        ASSERT_NEAR(one(a, i), other(a, i), tolerance) << a << " " << blocks.cell_at(i)[0] << " " << blocks.cell_at(i)[1] << " " << blocks.cell_at(i)[2];
        sum += double(one(a, i));
      }
    EXPECT_LT(sum, 3.0 * double(blocks.size()) - 20);
  };
  Shape a, b;
  a.box = base::Box{Vec3(0.3, 0.1, 0.1), Vec3(0.7, 0.3, 0.4)};
  b.mesh = collider_of(box({0, 0, 0}, {0.4f, 0.2f, 0.3f}), 1, a.box->lower, 0.05);
  compare(a, b, 0);
  Shape c, d;
  c.sphere = Shape::Sphere{Vec3(0.52, 0.21, 0.27), 0.13};
  d.mesh = collider_of(ball(96), 0.13, c.sphere->center, 0.05);
  compare(c, d, 0.06);
}

// The face of a wave that breaks on it: as fast, as high, and nothing inside.
TEST(ColliderMesh, MeetsADamBreakAsTheBoxItIsOf) {
  const base::Box block{Vec3(0.6, 0.1, 0), Vec3(0.75, 0.3, 0.1)};
  const auto broken = [&](bool as_mesh, std::vector<base::Vec3f>& at) {
    Scene scene = tank(0.025, {Vec3::Zero(), Vec3(0.3, 0.4, 0.4)});
    Collider collider;
    if (as_mesh) collider.shape.mesh = collider_of(box(Vec3(0.6, 0.1, -0.1).cast<float>(), block.upper.cast<float>()), 1, Vec3::Zero(), 0.025);
    else collider.shape.box = block;
    scene.colliders = {collider};
    return run(scene, 12, &at);
  };
  std::vector<base::Vec3f> one, other;
  const Totals box = broken(false, one).back(), mesh = broken(true, other).back();
  EXPECT_NEAR(mesh.kinetic_energy, box.kinetic_energy, 0.05 * box.kinetic_energy);
  EXPECT_NEAR(mesh.potential_energy, box.potential_energy, 0.02 * box.potential_energy);
  EXPECT_EQ(mesh.particles, box.particles);
  for (const base::Vec3f& x : other) {
    const Vec3 at = x.cast<double>();
    const double depth = std::min((at - block.lower).minCoeff(), (block.upper - at).minCoeff());
    ASSERT_LT(depth, 0.2 * 0.025) << at.transpose();   // edges are round by about a tenth
  }
}

// Cut faces all round, and walls of a cell and less: water at rest in a bowl stays there.
TEST(ColliderMesh, ABowlHoldsWater) {
  for (const double wall : {0.3, 0.1, 0.06}) {
    Scene scene;
    scene.options.domain = {Vec3::Zero(), Vec3(1, 1, 0.6)};
    scene.options.cell = 0.04;
    const Vec3 middle(0.5, 0.5, 0.45);
    Collider collider;
    collider.shape.mesh = collider_of(bowl(wall), 0.4, middle, scene.options.cell);
    scene.colliders = {collider};
    Body water;
    water.name = "water";
    water.shape.mesh = mesh_test::shape_of(content(wall, 0.2), 0.4, middle);
    scene.bodies = {water};
    scene.effects = {gravity()};
    std::vector<base::Vec3f> at;
    const std::vector<Totals> all = run(scene, 24, &at);
    double farthest = 0;
    for (const base::Vec3f& x : at) farthest = std::max(farthest, (x.cast<double>() - middle).norm());
    EXPECT_LT(farthest, 0.4 * (1 - wall) + 0.1 * scene.options.cell) << wall;
    EXPECT_NEAR(all.back().potential_energy, all.front().potential_energy, 0.03 * all.front().potential_energy) << wall;
    EXPECT_LT(all.back().kinetic_energy, 2e-3 * all.back().mass * 9.81 * 0.1) << wall;
  }
}

// Its work, and the flow it leaves, are a ball's; nothing is inside it.
TEST(ColliderMesh, MovesThroughWaterAsTheBallItIsOf) {
  struct Done {
    double work = 0;
    Totals last;
  };
  const auto moved = [&](bool as_mesh) {
    Scene scene = tank(0.04, {Vec3::Zero(), Vec3(1, 0.4, 0.4)});
    Collider collider;
    const Vec3 middle(0.3, 0.2, 0.2);
    if (as_mesh) collider.shape.mesh = collider_of(ball(32), 0.12, middle, scene.options.cell);
    else collider.shape.sphere = Shape::Sphere{middle, 0.12};
    collider.velocity = Vec3(0.8, 0, 0);
    scene.colliders = {collider};
    std::vector<base::Vec3f> at;
    Done done;
    for (const Totals& t : run(scene, 10, &at)) done.work += t.collider_work, done.last = t;
    for (const base::Vec3f& x : at) EXPECT_GT((x.cast<double>() - middle - 10 / 24.0 * collider.velocity).norm(), 0.12 - 0.05 * scene.options.cell);
    return done;
  };
  const Done sphere = moved(false), mesh = moved(true);
  EXPECT_NEAR(mesh.work, sphere.work, 0.1 * sphere.work);
  EXPECT_NEAR(mesh.last.kinetic_energy, sphere.last.kinetic_energy, 0.1 * sphere.last.kinetic_energy);
}

// Where pieces of a mesh overlap or touch there is no surface: what slides over them without friction goes on.
TEST(ColliderMesh, HasNoFacesWherePiecesMeet) {
  const auto slid = [](const Surface& surface) {
    Scene scene = cube_on_a_table(0);
    scene.colliders[0].shape = {};
    scene.colliders[0].shape.mesh = collider_of(surface, 1, Vec3::Zero(), scene.options.cell);
    const std::vector<Totals> all = run(scene, 8);
    return all.back().linear_momentum.x() / all.front().linear_momentum.x();
  };
  Surface tiles = box({0.05f, 0.05f, 0.1f}, {0.5f, 0.95f, 0.3f}), lap = tiles, buried = box({0.05f, 0.05f, 0.1f}, {0.95f, 0.95f, 0.3f});
  tiles.add(box({0.5f, 0.05f, 0.1f}, {0.95f, 0.95f, 0.3f}));
  lap.add(box({0.4f, 0.05f, 0.1f}, {0.95f, 0.95f, 0.3f}));
  buried.add(box({0.3f, 0.3f, 0.15f}, {0.8f, 0.8f, 0.27f}));
  EXPECT_NEAR(slid(tiles), 1, 1e-3);
  EXPECT_NEAR(slid(lap), 1, 1e-3);
  EXPECT_NEAR(slid(buried), 1, 1e-3);
}

// A block that slides over a table, of a box or of a mesh.
TEST(ColliderMesh, RubsASolidAsTheBoxItIsOf) {
  const auto slid = [&](bool as_mesh) {
    Scene scene = cube_on_a_table(0.3);
    Shape& shape = scene.colliders[0].shape;
    if (as_mesh) {
      const Surface plate = box(shape.box->lower.cast<float>(), shape.box->upper.cast<float>());
      shape.box.reset();
      shape.mesh = collider_of(plate, 1, Vec3::Zero(), scene.options.cell);
    }
    return run(scene, 8).back();
  };
  const Totals box = slid(false), mesh = slid(true);
  EXPECT_NEAR(mesh.linear_momentum.x(), box.linear_momentum.x(), 0.02 * box.linear_momentum.x());
  EXPECT_LT(box.linear_momentum.x(), 0.5 * box.mass);   // it does rub
  EXPECT_NEAR(mesh.potential_energy, box.potential_energy, 0.005 * box.potential_energy);
}
