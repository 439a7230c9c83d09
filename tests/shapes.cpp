// Shapes that cut material and colliders out of space.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

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
