// What floors, slopes, edges, grooves and colliders that move do to bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

Collider box_collider(const base::Vec3& lower, const base::Vec3& upper) {
  Collider c;
  c.shape.box = base::Box{lower, upper};
  return c;
}

/// [m/s] along x of a block of jelly, after half a second without friction on these colliders, on which it lies and on which it starts at 1 m/s.
double speed_on(const std::vector<Collider>& colliders, bool is_periodic, double start = 1) {
  Scene scene = walled_scene(2, 1, 0.02);
  if (is_periodic) scene.options.boundary[0] = {Side::periodic, Side::periodic};
  scene.options.seeding = Seeding::regular;
  scene.bodies = {block({0.4, 0.1, 0}, {0.6, 0.2, 0}, kJelly)};
  scene.bodies[0].velocity = {start, 0, 0};
  scene.colliders = colliders;
  scene.effects = {{"gravity", {0, -9.81, 0}}};
  const Totals t = run(*make_simulation(scene, 50), is_periodic ? 25 : 10).back();
  return t.linear_momentum.x() / t.mass;
}

}  // namespace

// Coulomb on a slope: gravity is tilted, the floor rubs. a = g (sin - mu cos).
TEST(SolidContact, ABlockSlidesDownASlopeAsCoulombSays) {
  Scene scene = walled_scene(2, 4, 0.05);
  scene.options.wall_friction = 0.25;
  Material stiff = kJelly;
  stiff.young = 1e6;
  scene.bodies = {block({0.5, 0, 0}, {1.1, 0.2, 0}, stiff)};
  const double g = 9.81, angle = 0.5;
  scene.effects = {{"gravity", {g * std::sin(angle), -g * std::cos(angle), 0}}};
  const auto simulation = make_simulation(scene, 20);
  const auto totals = run(*simulation, 14);
  const double a = g * (std::sin(angle) - 0.25 * std::cos(angle));
  const auto speed = [&](std::size_t f) { return totals[f].linear_momentum.x() / totals[f].mass; };
  EXPECT_NEAR((speed(14) - speed(4)) / 0.5, a, 0.02 * a);   // after it has settled on the floor
}

TEST(SolidContact, ABlockOnASlopeFlatterThanItsFrictionStays) {
  Scene scene = walled_scene(2, 2, 0.05);
  scene.options.wall_friction = 0.7;
  set_transfer(scene.options, "pic");   // loses the swing that being let go leaves it with
  scene.bodies = {block({0.5, 0, 0}, {1.1, 0.2, 0}, kJelly)};
  scene.effects = {{"gravity", {9.81 * std::sin(0.5), -9.81 * std::cos(0.5), 0}}};
  const auto simulation = make_simulation(scene, 20);
  run(*simulation, 10);
  const base::Vec3 before = mean_position(simulation->frame());
  run(*simulation, 20);
  EXPECT_NEAR((mean_position(simulation->frame()) - before).x(), 0, 1e-3);
}

// What falls comes to rest where it touches, and not where it shares nodes with the floor, a cell above. Particles are middles: of these a quarter of a cell.
TEST(SolidContact, WhatHasFallenRestsOnTheFloorAndOnColliders) {
  constexpr double kCell = 0.025;
  Material rubber = kJelly;
  rubber.young = 2e5, rubber.poisson = 0.45;
  for (const bool on_collider : {false, true}) {
    Scene scene = walled_scene(2, 1, kCell);
    const double floor = on_collider ? 0.1 + 0.3 * kCell : 0;
    if (on_collider) scene.colliders = {box_collider({0, -1, 0}, {1, floor, 0})};
    scene.bodies = {block({0.3, floor + 0.05, 0}, {0.7, floor + 0.25, 0}, rubber)};
    scene.effects = {{"gravity", {0, -9.81, 0}}};
    set_transfer(scene.options, "apic");
    const auto simulation = make_simulation(scene, 24);
    run(*simulation, 30);
    double lowest = 1;
    for (const auto& x : simulation->frame().position) lowest = std::min(lowest, double(x.y()) - floor);
    EXPECT_LT(lowest, 0.35 * kCell) << on_collider;
    EXPECT_GT(lowest, 0.05 * kCell) << on_collider;
  }
}

// A plate without friction hands a block momentum by its own velocity alone: work is that velocity times the momentum; of a block on a floor, too, whose
// nodes in the corner meet both.
TEST(SolidContact, APlateThatMovesDoesTheWorkThatItsPushTells) {
  for (const bool on_floor : {false, true}) {
    Scene scene = walled_scene(2, 1, 0.02);
    scene.options.precision = Precision::double_precision;
    scene.bodies = {block({0.3, 0.4, 0}, {0.5, 0.6, 0}, kJelly)};
    scene.colliders = {box_collider({0.1, 0.2, 0}, {0.29, 0.8, 0})};
    scene.colliders[0].velocity = {0.5, 0, 0};
    if (on_floor) scene.colliders.push_back(box_collider({0, 0.2, 0}, {1, 0.4, 0})), scene.effects = {{"gravity", {0, -9.81, 0}}};
    const auto simulation = make_simulation(scene, 50);
    double work = 0;
    Totals t;
    for (const Totals& frame : run(*simulation, 25)) work += frame.collider_work, t = frame;
    EXPECT_GT(t.linear_momentum.x() / t.mass, 0.4);
    EXPECT_NEAR(work, 0.5 * t.linear_momentum.x(), 1e-9 * work) << on_floor;
    EXPECT_TRUE(on_floor || t.energy() < work);   // on the floor gravity gives, too
  }
}

// A block that holds a wheel, and sticks to it, turns as far as the wheel does, which does nothing before it starts and after it stops.
TEST(SolidContact, WhatSticksToAWheelTurnsWithIt) {
  Scene scene = walled_scene(2, 1, 0.02);
  scene.bodies = {block({0.36, 0.36, 0}, {0.64, 0.64, 0}, kJelly)};
  Collider wheel;
  wheel.shape.sphere = {{0.5, 0.5, 0}, 0.07};
  wheel.contact = Contact::sticky;
  wheel.spin = {0, 0, M_PI};
  wheel.start = 0.1, wheel.end = 0.6;
  scene.colliders = {wheel};
  const auto simulation = make_simulation(scene, 50);
  double angle = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const Totals t = run(*simulation, 1).back();
    const Frame now = simulation->frame();
    double turning = 0, inertia = 0;
    for (std::size_t p = 0; p < now.id.size(); ++p) {
      const base::Vec3 from = now.position[p].cast<double>() - base::Vec3(0.5, 0.5, 0);
      turning += from.cross(now.velocity[p].cast<double>()).z(), inertia += from.squaredNorm();
    }
    angle += turning / inertia / 50;
    EXPECT_TRUE(t.collider_work == 0 || (frame >= 4 && frame <= 31)) << frame;
  }
  EXPECT_NEAR(angle, M_PI / 2, 0.1);
}

// A collider's face in a plane of nodes is met there, whatever the last bit says of 35 x 0.02 and 0.7.
TEST(SolidContact, AFaceInAPlaneOfNodesIsMetWhereverItIs) {
  std::vector<double> back;
  for (const double shift : {0.0, 0.02, 0.1, 0.26, 0.38}) {
    Scene scene = walled_scene(2, 1.6, 0.02);
    scene.options.seeding = Seeding::regular;
    scene.bodies = {block({0.1 + shift, 0.2, 0}, {0.4 + shift, 0.3, 0}, kJelly)};
    scene.bodies[0].velocity = {1, 0, 0};
    Collider wall;
    wall.name = "wall";
    wall.shape.box = base::Box{base::Vec3(0.44 + shift, 0.1, 0), base::Vec3(0.6 + shift, 0.4, 0)};
    wall.contact = Contact::sticky;
    scene.colliders = {wall};
    back.push_back(run(*make_simulation(scene, 50), 10).back().linear_momentum.x());
  }
  EXPECT_LT(back[0], 0);
  for (const double b : back) EXPECT_NEAR(b, back[0], 0.02 * std::abs(back[0]));   // it was half as much again where rounding said so
}

// Where two boxes meet there is no wall between them, on nodes or off, nor where one box goes on across a periodic side.
TEST(SolidContact, SlidesOverTheSeamOfTwoBoxesAsOverOne) {
  const auto floor = [](double from, double to) { return box_collider({from, 0, 0}, {to, 0.1, 0}); };
  EXPECT_NEAR(speed_on({floor(0, 1)}, false), 1, 1e-9);
  for (const double seam : {0.66, 0.67})
    EXPECT_NEAR(speed_on({floor(0, seam), floor(seam, 1)}, false), 1, 1e-9) << seam;
  for (const double start : {1.0, -1.0})
    EXPECT_NEAR(speed_on({floor(0, 1)}, true, start), start, 1e-9);
}

// What slides along a face that ends in a plane of nodes goes on beyond its edge.
TEST(SolidContact, SlidesOffTheEdgeOfATable) {
  for (const int axis : {0, 1}) {
    Scene scene = walled_scene(2, 1, 0.02);
    scene.options.seeding = Seeding::regular;
    const auto swapped = [&](double x, double y) { return axis == 0 ? base::Vec3(x, y, 0) : base::Vec3(y, x, 0); };
    scene.bodies = {block(swapped(0.4, 0.1), swapped(0.6, 0.2), kJelly)};
    scene.bodies[0].velocity = swapped(-0.5, 0);
    scene.colliders = {box_collider(swapped(0, 0), swapped(0.5, 0.1))};
    const Totals t = run(*make_simulation(scene, 25), 10).back();
    EXPECT_NEAR(t.linear_momentum[axis] / t.mass, -0.5, 0.02) << "along axis " << axis;
  }
}

TEST(SolidContact, AFaceInAPeriodicSideIsMetFromEitherSide) {
  std::vector<double> left;
  for (const double to : {1.0, -1.0}) {
    Scene scene = walled_scene(2, 1, 0.05);
    scene.options.boundary[0] = {Side::periodic, Side::periodic};
    scene.options.seeding = Seeding::regular;
    const auto across = [&](double from, double until, double low, double high) {   // mirrored where the block moves to the left
      return to > 0 ? std::pair(base::Vec3(from, low, 0), base::Vec3(until, high, 0)) : std::pair(base::Vec3(1 - until, low, 0), base::Vec3(1 - from, high, 0));
    };
    const auto [lower, upper] = across(0.6, 0.8, 0.4, 0.6);
    scene.bodies = {block(lower, upper, kJelly)};
    scene.bodies[0].velocity = {2 * to, 0, 0};
    const auto [first, last] = across(0, 0.3, 0, 1);
    scene.colliders = {box_collider(first, last)};
    left.push_back(energy(run(*make_simulation(scene, 50), 15).back()));
  }
  EXPECT_NEAR(left[0], left[1], 1e-9 * left[0]);
}

// A groove has no side that is asked first.
TEST(SolidContact, StaysInTheMiddleOfAGroove) {
  for (const double friction : {0.0, 0.3})
    for (const bool is_swapped : {false, true}) {
      Scene scene = walled_scene(2, 2, 0.05);
      scene.options.seeding = Seeding::regular;
      for (const double sign : {1.0, -1.0}) {
        const double angle = sign * M_PI / 6;
        const base::Vec3 along(std::cos(angle), std::sin(angle), 0), outward(-std::sin(angle), std::cos(angle), 0);
        const base::Vec3 middle = base::Vec3(1, 0.5, 0) + sign * 0.6 * along - 0.3 * outward;
        Collider side = box_collider(middle - base::Vec3(0.8, 0.3, 0), middle + base::Vec3(0.8, 0.3, 0));
        side.shape.turn_by(sign * 30, base::Vec3::UnitZ());
        side.friction = friction;
        scene.colliders.push_back(side);
      }
      if (is_swapped) std::swap(scene.colliders[0], scene.colliders[1]);
      scene.bodies = {block({0.9, 0.52, 0}, {1.1, 0.72, 0}, kJelly)};
      scene.effects = {{"gravity", {0, -9.81, 0}}};
      const auto simulation = make_simulation(scene, 50);
      run(*simulation, 50);
      EXPECT_NEAR(mean_position(simulation->frame()).x(), 1, 1e-3 * 0.05) << "friction " << friction << (is_swapped ? ", the left one first" : "");
    }
}

// A post that stands on the floor is met as one that goes on below it.
TEST(SolidContact, APostOnTheFloorIsMetAsOneThatGoesOnBelow) {
  std::vector<double> energies;
  for (const double below : {0.0, -1.0}) {
    Scene scene = walled_scene(2, 1, 0.05);
    scene.options.seeding = Seeding::regular;
    scene.bodies = {block({0.2, 0, 0}, {0.4, 0.1, 0}, kJelly)};
    scene.bodies[0].velocity = {1, 0, 0};
    Collider post;
    post.name = "post";
    post.shape.box = base::Box{base::Vec3(0.52, below, 0), base::Vec3(0.72, 0.37, 0)};
    scene.colliders = {post};
    energies.push_back(energy(run(*make_simulation(scene, 50), 15).back()));
  }
  EXPECT_NEAR(energies[0], energies[1], 1e-9 * energies[1]);
}

// The inner corner of a floor and a wall that are boxes is that of the domain.
TEST(SolidContact, ACornerOfTwoBoxesIsMetAsOneOfWalls) {
  Material soft = kJelly;
  soft.young = 2e4;
  std::vector<base::Vec3> middles;
  for (const bool by_boxes : {false, true}) {
    Scene scene = walled_scene(2, 1.2, 0.025);
    scene.options.seeding = Seeding::regular;
    scene.options.modes.name = "multilinear";
    for (auto& sides : scene.options.boundary) sides = {Side::slip, Side::slip};
    if (by_boxes) scene.colliders = {box_collider({0, 0, 0}, {1.2, 0.2, 0}), box_collider({0, 0, 0}, {0.2, 1.2, 0})};
    else scene.options.domain.lower = {0.2, 0.2, 0};
    for (Collider& c : scene.colliders) c.contact = Contact::slip;
    scene.bodies = {block({0.3, 0.25, 0}, {0.7, 0.55, 0}, soft)};
    scene.bodies[0].velocity = {-1, -1, 0};
    scene.effects = {{"gravity", {0, -9.81, 0}}};
    const auto simulation = make_simulation(scene, 24);
    run(*simulation, 12);
    middles.push_back(mean_position(simulation->frame()));
  }
  EXPECT_LT((middles[1] - middles[0]).norm(), 1e-5);
}
