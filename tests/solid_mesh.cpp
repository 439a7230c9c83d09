// Bodies from closed meshes: what is inside, what is refused, and what is made of them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/closed_meshes.h"
#include "tests/solid_scenes.h"

using namespace sim;
using namespace mesh_test;
using solid_test::open_scene, solid_test::run, solid_test::set_transfer;

TEST(SolidMesh, ARingHoldsWhatItsTubeHolds) {
  const ClosedMesh mesh = closed(ring(96, 0.3));
  ASSERT_EQ(mesh.objection(), "");
  std::mt19937 rng(41);
  std::uniform_real_distribution<double> u(-1.4, 1.4);
  int inside = 0;
  for (int n = 0; n < 200000; ++n) {
    const base::Vec3 at(u(rng), u(rng), 0.3 * u(rng));
    const double from_tube = std::hypot(std::hypot(at.x(), at.y()) - 1, at.z());
    if (std::abs(from_tube - 0.3) < 0.005) continue;   // between the ring and its chords
    ASSERT_EQ(mesh.inside(at), from_tube < 0.3) << at.transpose();
    inside += mesh.inside(at);
  }
  EXPECT_GT(inside, 10000);
}

// Rays through corners and along edges and upright faces: where a careless count is off by one.
TEST(SolidMesh, PlacesInLineWithCornersAndEdgesAreCountedOnce) {
  const ClosedMesh mesh = closed(box({0, 0, 0}, {1, 1, 1}));
  for (const double x : {0.25, 0.5, 0.75})
    for (const double y : {0.25, 0.5, 0.75}) {   // diagonals of the faces among them
      EXPECT_TRUE(mesh.inside({x, y, 0.5})) << x << " " << y;
      EXPECT_FALSE(mesh.inside({x, y, -0.5}));
      EXPECT_FALSE(mesh.inside({x, y, 1.5}));
      EXPECT_FALSE(mesh.inside({x + 1, y, 0.5}));
    }
  const ClosedMesh wheel = closed(ring(16, 0.3));
  for (const base::Vec3f& c : ring(16, 0.3).corners) {
    EXPECT_FALSE(wheel.inside({double(c.x()), double(c.y()), -1}));
    EXPECT_FALSE(wheel.inside({double(c.x()), double(c.y()), 1}));
  }
}

TEST(SolidMesh, PiecesThatOverlapAreOneAndAPieceInsideOutIsAHole) {
  Surface two = box({0, 0, 0}, {1, 1, 1});
  two.add(box({0.5f, 0.5f, 0.5f}, {1.5f, 1.5f, 1.5f}));
  const ClosedMesh both = closed(two);
  EXPECT_TRUE(both.inside({0.7, 0.75, 0.8}));
  EXPECT_TRUE(both.inside({1.2, 1.3, 1.1}));
  EXPECT_FALSE(both.inside({1.2, 0.2, 0.2}));
  Surface hollow = box({0, 0, 0}, {1, 1, 1});
  Surface inner = box({0.25f, 0.25f, 0.25f}, {0.75f, 0.75f, 0.75f});
  for (auto& t : inner.triangles) std::swap(t[1], t[2]);
  hollow.add(inner);
  EXPECT_FALSE(closed(hollow).inside({0.5, 0.55, 0.6}));
  EXPECT_TRUE(closed(hollow).inside({0.1, 0.55, 0.6}));
  for (auto& t : hollow.triangles) std::swap(t[1], t[2]);
  EXPECT_FALSE(closed(hollow).inside({0.5, 0.55, 0.6})) << "all of it inside out is the same";
  EXPECT_TRUE(closed(hollow).inside({0.1, 0.55, 0.6}));
  Surface drilled = box({0, 0, 0}, {1, 1, 1});
  Surface drill = box({0.25f, 0.25f, -0.5f}, {0.75f, 0.75f, 1.5f});
  for (auto& t : drill.triangles) std::swap(t[1], t[2]);
  drilled.add(drill);
  EXPECT_FALSE(closed(drilled).inside({0.5, 0.55, 0.6}));
  EXPECT_FALSE(closed(drilled).inside({0.5, 0.55, 1.2})) << "a hole sticks out of nothing";
  EXPECT_TRUE(closed(drilled).inside({0.1, 0.55, 0.6}));
}

TEST(SolidMesh, WhatIsOpenOrTurnedOverIsRefusedByItsEdges) {
  Surface open = box({0, 0, 0}, {1, 1, 1});
  open.triangles.pop_back();
  EXPECT_EQ(closed(open).objection(), "is not closed: 3 of its edges have a triangle on one side only, the first from (1, 0, 0) to (1, 0, 1) m");
  EXPECT_FALSE(closed(open).inside({0.5, 0.5, 0.5}));
  Surface turned = box({0, 0, 0}, {1, 1, 1});
  std::swap(turned.triangles[0][1], turned.triangles[0][2]);
  EXPECT_EQ(closed(turned).objection().substr(0, 65), "has no inside: at 3 of its edges one triangle is turned over, the");
  EXPECT_EQ(closed({{{0, 0, 0}, {1, 0, 0}}, {{0, 1, 1}}}).objection(), "encloses nothing: it has no triangle with three corners");
}

// A body of a mesh has the mesh's volume, moves as any other and turns about its middle.
TEST(SolidMesh, ABodyOfAMeshHasItsVolumeAndMoves) {
  Scene scene = open_scene(3, 1, 1.0 / 40);
  set_transfer(scene.options, "apic");
  Body body;
  body.name = "ring";
  body.is_solid = true;
  body.solid = {.model = Elasticity::neo_hookean, .density = 1000, .young = 1e5, .poisson = 0.3};
  const Surface s = ring(64, 0.4);
  body.shape.mesh = shape_of(s, 0.2, base::Vec3(0.5, 0.5, 0.5));
  body.velocity = {0.5, 0, 0};
  body.spin = {0, 0, 2};
  scene.bodies = {body};
  const auto simulation = make_simulation(scene, 50);
  const double volume = 2 * M_PI * M_PI * 0.2 * 0.08 * 0.08;
  const Totals start = simulation->totals();
  EXPECT_NEAR(start.volume, volume, 0.01 * volume);
  EXPECT_NEAR(start.linear_momentum.x(), 0.5 * start.mass, 1e-9 * start.mass);
  const double about_middle = start.angular_momentum.z() + 0.5 * start.linear_momentum.x(),
               turning = 2 * start.mass * (0.2 * 0.2 + 0.75 * 0.08 * 0.08);
  EXPECT_NEAR(about_middle, turning, 0.03 * turning);
  const auto totals = run(*simulation, 2);
  EXPECT_LT((totals[2].linear_momentum - start.linear_momentum).norm(), 1e-11 * start.mass);
  EXPECT_NEAR(totals[2].angular_momentum.z(), start.angular_momentum.z(), 1e-10 * start.mass);
}
