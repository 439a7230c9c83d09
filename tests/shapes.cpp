// Shapes that cut material and colliders out of space.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "sim/colliders/solids.h"
#include "sim/drawn_shape.h"

namespace {

using base::Vec3;

sim::Shape turned_box() {
  sim::Shape shape;
  shape.box = base::Box{Vec3(0.2, 0.1, 0.3), Vec3(0.6, 0.3, 0.4)};
  shape.turn_by(30, Vec3(1, 2, -1));
  return shape;
}

Vec3 somewhere(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-0.2, 1);
  return {place(random), place(random), place(random)};
}

}  // namespace

// Turning the box and the place alike changes nothing.
TEST(TurnedBox, IsAsFarFromATurnedPlaceAsTheBoxFromThePlace) {
  const sim::Shape turned = turned_box();
  sim::Shape straight;
  straight.box = turned.box;
  const Vec3 middle(0.4, 0.2, 0.35);
  std::mt19937 random(1);
  int inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 at = somewhere(random), there = middle + *turned.turn * (at - middle);
    Vec3 normal, other;
    const double far = straight.distance(at, &normal);
    EXPECT_NEAR(turned.distance(there, &other), far, 1e-14);
    EXPECT_LT((*turned.turn * normal - other).norm(), 1e-13);
    inside += far < 0;
  }
  EXPECT_GT(inside, 0);
  EXPECT_GT(std::abs(turned.distance(Vec3(0.62, 0.2, 0.35)) - straight.distance(Vec3(0.62, 0.2, 0.35))), 0.01);
}

TEST(TurnedBox, LeadsOutAlongItsNormal) {
  const sim::Shape shape = turned_box();
  std::mt19937 random(2);
  for (int i = 0; i < 500; ++i) {
    const Vec3 at = somewhere(random);
    Vec3 normal;
    const double far = shape.distance(at, &normal);
    EXPECT_NEAR(shape.distance(at - far * normal), 0, 1e-12);
  }
}

TEST(TurnedBox, LiesWithinItsBoundsAndTouchesThem) {
  const sim::Shape shape = turned_box();
  const base::Box bounds = shape.bounds();
  Vec3 lower = Vec3::Constant(9), upper = -lower;
  for (const Vec3& corner : shape.corners()) {
    EXPECT_NEAR(shape.distance(corner), 0, 1e-12);
    lower = lower.cwiseMin(corner), upper = upper.cwiseMax(corner);
  }
  EXPECT_LT((lower - bounds.lower).norm() + (upper - bounds.upper).norm(), 1e-12);
}

TEST(TurnedBox, TurnsCounterClockwiseInTheTwoDimensions) {
  sim::Shape shape;
  shape.box = base::Box{Vec3(0, 0, 0), Vec3(2, 0.2, 0)};
  shape.turn_by(90, Vec3::UnitZ());
  EXPECT_LT(shape.distance(Vec3(1, 1, 0)), 0);
  EXPECT_GT(shape.distance(Vec3(0.2, 0.1, 0)), 0.5);
  shape.turn_by(30, Vec3::UnitZ());
  EXPECT_LT(shape.distance(Vec3(1 + 0.8 * std::cos(M_PI / 6), 0.1 + 0.8 * std::sin(M_PI / 6), 0)), 0);
}

// Each kind of shape turns about the pivot, which moves on, and stops when it is to.
TEST(TurningCollider, IsWhereItsMotionLeads) {
  sim::Options room;
  room.domain = {Vec3(0, 0, 0), Vec3(2, 2, 2)};
  sim::Collider ball{.name = "ball", .shape = {}, .velocity = Vec3(0.1, 0, 0), .spin = Vec3(0, 0, M_PI), .pivot = Vec3(1, 1, 1), .start = 0.5, .end = 2.0};
  ball.shape.sphere = {Vec3(1.5, 1, 1), 0.2};
  const auto center = [&](double time) { return sim::shape_at(time, ball, room).sphere->center; };
  EXPECT_EQ(center(0.5), Vec3(1.5, 1, 1));
  EXPECT_LT((center(1) - Vec3(1.05, 1.5, 1)).norm(), 1e-12);
  EXPECT_EQ(center(2), center(7));
  const double dt = 1e-5;
  const Vec3 moved = (center(1 + dt) - center(1 - dt)) / (2 * dt), said = sim::motion_at(1, ball, room).at(center(1));
  EXPECT_LT((moved - said).norm(), 1e-8);
  EXPECT_TRUE(sim::motion_at(0.4, ball, room).rests());
  EXPECT_FALSE(sim::motion_at(0.5, ball, room).rests());
  EXPECT_TRUE(sim::motion_at(2, ball, room).rests());
  EXPECT_NEAR(ball.speed(), 0.1 + 0.7 * M_PI, 1e-12);

  sim::Collider blade{.name = "blade", .shape = {}, .velocity = Vec3::Zero(), .spin = Vec3(0, M_PI / 2, 0)};
  blade.shape.box = base::Box{Vec3(0.5, 0.9, 0.9), Vec3(1.5, 1.1, 1.1)};
  const sim::Shape upright = sim::shape_at(1, blade, room);
  EXPECT_LT(upright.distance(Vec3(1, 1, 1.45)), 0);
  EXPECT_GT(upright.distance(Vec3(1.45, 1, 1)), 0.3);
  EXPECT_NEAR(blade.speed(), M_PI / 2 * std::hypot(0.5, 0.1), 1e-12);
}

// A box that turns stands on the walls across its axis alone: a stirrer reaches the floor, and its blades end where they end.
TEST(TurningCollider, GoesOnThroughTheWallsAlongItsAxis) {
  sim::Options room;
  room.domain = {Vec3(0, 0, 0), Vec3(1, 1, 1)};
  sim::Collider blade{.name = "blade", .shape = {}, .velocity = Vec3::Zero(), .spin = Vec3(0, 0, 2)};
  blade.shape.box = base::Box{Vec3(0, 0.45, 0), Vec3(1, 0.55, 0.5)};
  const sim::Collider on = sim::continued_through_walls(blade, room);
  EXPECT_EQ(on.shape.box->lower, Vec3(0, 0.45, -1));
  EXPECT_EQ(on.shape.box->upper, Vec3(1, 0.55, 0.5));
  EXPECT_EQ(on.pivot_at_start(), Vec3(0.5, 0.5, 0.25));
}

// A piston leaves no gap behind it, and what lies on that part of it must not lie on nothing in pictures. One that stood off the wall leaves a gap.
TEST(MovingBox, IsDrawnBackToTheWallThatItStoodOn) {
  sim::Options room;
  room.domain = {Vec3(0, 0, 0), Vec3(2, 1, 1)};
  sim::Collider piston{.name = "piston", .shape = {}, .velocity = Vec3(0.5, 0, 0)};
  piston.shape.box = base::Box{Vec3(-0.1, 0, 0), Vec3(0.2, 1, 0.5)};
  const base::Box start = *sim::drawn_shape_at(0, piston, room).box, later = *sim::drawn_shape_at(1, piston, room).box;
  EXPECT_EQ(start.lower, Vec3(-0.1, 0, 0));
  EXPECT_EQ(later.lower, Vec3(0, 0, 0));
  EXPECT_EQ(later.upper, Vec3(0.7, 1, 0.5));
  piston.shape.box->lower.x() = 0.01;
  EXPECT_EQ(sim::drawn_shape_at(1, piston, room).box->lower, Vec3(0.51, 0, 0));
  piston.shape.box->lower.x() = 0;
  room.boundary[0] = {sim::Side::periodic, sim::Side::periodic};
  EXPECT_EQ(sim::drawn_shape_at(1, piston, room).box->lower, Vec3(0.5, 0, 0));
}
