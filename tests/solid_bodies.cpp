// Bodies that come apart, slip or rub where they touch each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/solid_scenes.h"
#include "tests/threads.h"

namespace {

using namespace sim;
using namespace solid_test;

constexpr double kFall = 9.81;   // [m/s^2]

Material jelly_of(double young, double density = 1000, double poisson = 0.3) {
  Material m = kJelly;
  m.young = young, m.density = density, m.poisson = poisson;
  return m;
}

void let_part(Body& b, double friction = 0) { b.contact = Contact::separating, b.friction = friction; }

struct Mean {
  base::Vec3 position = base::Vec3::Zero(), velocity = base::Vec3::Zero();
  double count = 0;
};
/// Of each body.
std::vector<Mean> means(const Simulation& simulation) {
  const Frame f = simulation.frame();
  std::vector<Mean> all;
  for (std::size_t p = 0; p < f.id.size(); ++p) {
    if (all.size() <= f.body[p]) all.resize(std::size_t(f.body[p]) + 1);
    Mean& m = all[f.body[p]];
    m.position += f.position[p].cast<double>(), m.velocity += f.velocity[p].cast<double>(), ++m.count;
  }
  for (Mean& m : all) m.position /= m.count, m.velocity /= m.count;
  return all;
}

/// [m] Between the particles of two bodies that are nearest to each other.
double gap(const Simulation& simulation) {
  const Frame f = simulation.frame();
  double least = std::numeric_limits<double>::max();
  for (std::size_t p = 0; p < f.id.size(); ++p)
    for (std::size_t q = p; q < f.id.size(); ++q)
      if (f.body[p] != f.body[q]) least = std::min(least, double((f.position[p] - f.position[q]).norm()));
  return least;
}

/// [rad/s] Of a body about its middle, counter-clockwise in the plane of x and y.
double turning(const Simulation& simulation, std::size_t body) {
  const Mean mean = means(simulation)[body];
  const Frame f = simulation.frame();
  double turns = 0, inertia = 0;
  for (std::size_t p = 0; p < f.id.size(); ++p) {
    if (f.body[p] != body) continue;
    base::Vec3 arm = f.position[p].cast<double>() - mean.position;
    arm.z() = 0;
    turns += arm.cross(f.velocity[p].cast<double>() - mean.velocity).z(), inertia += arm.squaredNorm();
  }
  return turns / inertia;
}

/// Two balls on their way to each other, not head on, in a box without walls.
Scene glancing_balls(int dimension, double cell) {
  Scene scene = open_scene(dimension, 1, cell);
  const double z = dimension == 3 ? 0.5 : 0;
  scene.bodies = {ball({0.36, 0.47, z}, 0.12, kJelly), ball({0.64, 0.53, z}, 0.12, jelly_of(2e5, 3000))};
  scene.bodies[0].velocity = {1, 0, 0}, scene.bodies[1].velocity = {-1, 0, 0};
  return scene;
}

/// A block that slides on a slab which sticks to the floor, gravity at an angle in place of a slope.
Scene slope(double friction, double angle) {
  Scene scene = walled_scene(2, 4, 0.05);
  scene.options.boundary[1][0] = Side::sticky;
  scene.options.domain.upper.y() = 1;
  scene.options.seeding = Seeding::regular;
  scene.bodies = {block({0, 0, 0}, {4, 0.4, 0}, jelly_of(4e6)), block({0.5, 0.4, 0}, {1.1, 0.6, 0}, jelly_of(1e6))};
  let_part(scene.bodies[1], friction);
  scene.effects = {{"gravity", {kFall * std::sin(angle), -kFall * std::cos(angle), 0}}};
  return scene;
}

}  // namespace

TEST(SolidBodies, HandEachOtherMomentumAndKeepTheSum) {
  for (const int dimension : {2, 3}) {
    double spin_without = 0;
    for (const double friction : {0.0, 0.5}) {
      Scene scene = glancing_balls(dimension, dimension == 2 ? 0.025 : 1.0 / 32);
      for (Body& b : scene.bodies) let_part(b, friction);
      const auto simulation = make_simulation(scene, 50);
      const auto totals = run(*simulation, 6);
      const Totals &first = totals.front(), &last = totals.back();
      const double scale = first.mass * 2;
      EXPECT_LT((last.linear_momentum - first.linear_momentum).norm(), 1e-12 * scale) << dimension << " " << friction;
      EXPECT_LT((last.angular_momentum - first.angular_momentum).norm(), 1e-11 * scale) << dimension << " " << friction;
      EXPECT_LT(last.energy(), first.energy());
      const auto now = means(*simulation);
      EXPECT_LT(now[0].velocity.x(), 0);            // the lighter one bounces
      EXPECT_LT(now[0].velocity.y(), -0.05);        // and both are turned aside
      const double spin = std::abs(turning(*simulation, 0));
      if (friction == 0) spin_without = spin;
      else EXPECT_LT(spin_without, spin / 2) << dimension;   // without friction what pushes it goes through its middle
    }
  }
}

// Beside each other, near enough to share nodes, one goes along the other.
TEST(SolidBodies, AreNothingToEachOtherUntilTheyTouch) {
  for (const double apart : {0.05, 0.4})
    for (const Contact contact : {Contact::sticky, Contact::slip, Contact::separating}) {
      Scene scene = open_scene(2, 1, 0.05);
      scene.options.seeding = Seeding::regular;
      scene.bodies = {block({0.1, 0.4, 0}, {0.3, 0.6, 0}, kJelly), block({0.3 + apart, 0.3, 0}, {0.5 + apart, 0.5, 0}, kJelly)};
      scene.bodies[1].velocity = {0, 0.8, 0};
      scene.bodies[1].contact = contact;
      const auto simulation = make_simulation(scene, 50);
      run(*simulation, 4);
      const base::Vec3 velocity = means(*simulation)[0].velocity;
      if (contact == Contact::sticky && apart < 0.1) EXPECT_GT(velocity.y(), 0.01);
      else EXPECT_EQ(velocity.norm(), 0) << apart << " " << int(contact);
    }
}

// A rod without friction in a slot, few cells wide: normals across it everywhere, though both its sides are near.
TEST(SolidBodies, ARodSlidesThroughASlot) {
  for (const Precision precision : {Precision::double_precision, Precision::single_precision})
    for (const double cells : {2.0, 3.0, 4.0, 8.0}) {
      constexpr double kCell = 0.025;
      Scene scene = open_scene(2, 1, kCell);
      scene.options.precision = precision;
      scene.options.seeding = Seeding::regular;
      const double half = cells * kCell / 2;
      scene.bodies = {block({0.2, 0.5 - half, 0}, {0.8, 0.5 + half, 0}, kJelly), block({0, 0.3, 0}, {1, 0.5 - half, 0}, kJelly), block({0, 0.5 + half, 0}, {1, 0.7, 0}, kJelly)};
      let_part(scene.bodies[0]);
      scene.bodies[0].velocity = {0.5, 0, 0};
      const auto simulation = make_simulation(scene, 50);
      run(*simulation, 10);
      EXPECT_NEAR(means(*simulation)[0].velocity.x(), 0.5, cells < 3 ? 0.06 : 0.01) << cells << " cells";
    }
}

// Blocks that touch from the start and are pulled apart leave each other, unless they slip or stick.
TEST(SolidBodies, LeaveEachOtherWhenPulledWhereTheySeparateAlone) {
  for (const Contact contact : {Contact::sticky, Contact::slip, Contact::separating}) {
    Scene scene = open_scene(2, 1, 0.025);
    scene.options.seeding = Seeding::regular;
    scene.bodies = {block({0.3, 0.4, 0}, {0.5, 0.6, 0}, kJelly), block({0.5, 0.4, 0}, {0.7, 0.6, 0}, kJelly)};
    scene.bodies[0].velocity = {-0.5, 0, 0}, scene.bodies[1].velocity = {0.5, 0, 0};
    scene.bodies[1].contact = contact;
    const auto simulation = make_simulation(scene, 50);
    run(*simulation, 5);
    const auto now = means(*simulation);
    if (contact == Contact::separating) {
      EXPECT_NEAR(now[1].velocity.x(), 0.5, 1e-6);
      EXPECT_NEAR(gap(*simulation), 0.1 + 0.0125, 1e-3);
    } else {
      EXPECT_LT(now[1].velocity.x(), 0.3) << int(contact);
      EXPECT_LT(gap(*simulation), 0.03) << int(contact);
    }
  }
}

// Coulomb: a = g (sin - mu cos).
TEST(SolidBodies, ABlockSlidesDownASlabAsCoulombSays) {
  const double angle = 0.5;
  for (const double friction : {0.0, 0.25}) {
    const auto simulation = make_simulation(slope(friction, angle), 20);
    run(*simulation, 4);
    const double before = means(*simulation)[1].velocity.x();
    run(*simulation, 10);
    const double a = kFall * (std::sin(angle) - friction * std::cos(angle));
    EXPECT_NEAR((means(*simulation)[1].velocity.x() - before) / 0.5, a, 0.04 * a) << friction;
  }
}

TEST(SolidBodies, ABlockStaysOnASlabFlatterThanItsFriction) {
  Scene scene = slope(0.7, 0.5);
  set_transfer(scene.options, "pic");   // loses the swing that being let go leaves it with
  const auto simulation = make_simulation(scene, 20);
  run(*simulation, 10);
  const double before = means(*simulation)[1].position.x();
  run(*simulation, 20);
  EXPECT_NEAR(means(*simulation)[1].position.x() - before, 0, 4e-3);
}

// What falls on another body comes to rest on it, and not where it begins to share nodes with it, 1.7 cells above.
TEST(SolidBodies, WhatHasFallenRestsOnTheOther) {
  constexpr double kCell = 0.025;
  for (const bool parts : {false, true}) {
    Scene scene = walled_scene(2, 1, kCell);
    scene.bodies = {block({0.2, 0, 0}, {0.8, 0.2, 0}, jelly_of(2e5, 1000, 0.45)), block({0.4, 0.26, 0}, {0.6, 0.4, 0}, jelly_of(2e5, 1000, 0.45))};
    if (parts) let_part(scene.bodies[1], 0.5);
    scene.effects = {{"gravity", {0, -kFall, 0}}};
    set_transfer(scene.options, "apic");
    const auto simulation = make_simulation(scene, 24);
    run(*simulation, 30);
    if (parts) {
      EXPECT_LT(gap(*simulation), 0.65 * kCell);
      EXPECT_GT(gap(*simulation), 0.3 * kCell);
    } else {
      EXPECT_GT(gap(*simulation), 0.8 * kCell);
    }
  }
}

// What is let go two cells above its place in the water goes there.
TEST(SolidBodies, FloatAsArchimedesSays) {
  constexpr double kCell = 0.0125;
  for (const double density : {300.0, 700.0}) {
    Scene scene = walled_scene(2, 0.6, kCell);
    scene.options.precision = Precision::single_precision;
    for (auto& sides : scene.options.boundary) sides = {Side::slip, Side::separating};
    scene.options.boundary[0][1] = Side::slip;
    Body water = block({0, 0, 0}, {0.6, 0.25, 0}, preset_material("water_mpm"));
    water.material = "water_mpm";
    const double under = 0.1 * density / 1000, above = 2 * kCell;
    scene.bodies = {block({0.2, 0.25 - under + above, 0}, {0.4, 0.35 - under + above, 0}, jelly_of(1e5, density)), water};
    let_part(scene.bodies[0]);
    scene.effects = {{"gravity", {0, -kFall, 0}}};
    const auto simulation = make_simulation(scene, 24);
    const double rises = 0.2 / 0.6 * above;   // the water, where the body goes down
    const double expected = means(*simulation)[0].position.y() - above + rises;
    double sum = 0;
    run(*simulation, 16);
    for (int f = 0; f < 16; ++f) run(*simulation, 1), sum += means(*simulation)[0].position.y() / 16;
    EXPECT_NEAR(sum, expected, 0.6 * kCell) << density;
  }
}

// Across a periodic side as elsewhere, of axes that are no whole number of blocks, too.
TEST(SolidBodies, MeetAcrossAPeriodicSide) {
  for (const int dimension : {2, 3})
    for (const int cells : {18, 20, 21})
      for (int axis = 0; axis < dimension; ++axis) {
        std::vector<double> energies;
        for (const bool parts : {true, false})
          for (const double shift : {0.0, 0.5}) {
            if (!parts && shift > 0) continue;
            Scene scene = open_scene(dimension, 1, 1.0 / cells);
            scene.options.seeding = Seeding::regular;
            scene.options.precision = Precision::double_precision;
            const double h = 1.0 / cells, moved = std::round(shift * cells) * h, middle = 9 * h;
            const auto at = [&](double along, double across) {
              base::Vec3 x = base::Vec3::Constant(across);
              x[axis] = along;
              if (dimension == 2) x.z() = 0;
              return x;
            };
            const auto body = [&](double from, double to, double low, double high) {
              if (from + moved >= 1) from -= 1, to -= 1;
              return block(at(from + moved, low), at(to + moved, high), kJelly);
            };
            scene.bodies = {body(middle - 4 * h, middle - h, 7 * h, 11 * h), body(middle + h, middle + 4 * h, 6 * h, 10 * h)};
            for (Body& b : scene.bodies) {
              b.velocity = at(0, 0);
              if (parts) let_part(b, 0.3);
            }
            scene.bodies[0].velocity[axis] = 1.5, scene.bodies[1].velocity[axis] = -1.5;
            energies.push_back(energy(run(*make_simulation(scene, 50), 6).back()));
          }
        EXPECT_NEAR(energies[0], energies[1], 1e-9 * energies[0]) << dimension << " " << cells << " " << axis;
        EXPECT_GT(std::abs(energies[2] - energies[0]), 1e-4 * energies[0]);   // they have met
      }
}

TEST(SolidBodies, GiveTheSameBitsOnAnyNumberOfThreads) {
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 2, 4}) {
    Scene scene = walled_scene(3, 1, 0.05);
    scene.bodies = {ball({0.3, 0.5, 0.2}, 0.15, kJelly), ball({0.7, 0.5, 0.25}, 0.18, kJelly), ball({0.5, 0.5, 0.6}, 0.2, jelly_of(2e5, 2000))};
    for (Body& b : scene.bodies) let_part(b, 0.4);
    scene.effects = {{"gravity", {0, 0, -kFall}}};
    const auto simulation = make_simulation(scene, 24);
    hashes.push_back(on_threads(threads, [&] { return run(*simulation, 8).back().state_hash; }));
    EXPECT_LT(gap(*simulation), 0.65 * 0.05);   // they have met
  }
  EXPECT_EQ(hashes[1], hashes[0]);
  EXPECT_EQ(hashes[2], hashes[0]);
}
