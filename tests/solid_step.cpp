// Laws of the step as a whole: what is conserved, what is exact, and the cases that break a material point method that is careless.
#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "base/error.h"
#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

const Material kJelly{.model = Elasticity::neo_hookean, .density = 1000, .young = 1e5, .poisson = 0.3};

base::Vec3 mean_position(const Frame& f) {
  base::Vec3 sum = base::Vec3::Zero();
  for (const auto& x : f.position) sum += x.cast<double>();
  return sum / double(f.position.size());
}

/// Scene of one particle whose coefficients have the given velocity gradient at first.
Scene lone_particle(double edge, double cell) {
  Scene scene = open_scene(3, edge, cell);
  scene.options.particles_per_cell = 1;
  scene.options.seeding = Seeding::regular;
  return scene;
}

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

// What falls freely does so exactly: g and no force of its own.
TEST(SolidStep, ABodyInFreeFallKeepsItsShapeAndFallsAsGalileoSays) {
  Scene scene = open_scene(2, 2, 0.05);
  scene.bodies = {block({0.5, 0.5, 0}, {0.9, 0.8, 0}, kJelly)};
  scene.bodies[0].velocity = {1, 0, 0};
  scene.effects = {{"gravity", {0, -2, 0}}};
  const auto simulation = make_simulation(scene, 10);
  const auto totals = run(*simulation, 3);
  ASSERT_GT(totals[3].substeps, 20);
  EXPECT_NEAR(totals[3].linear_momentum.x(), totals[0].mass, 1e-11 * totals[0].mass);
  EXPECT_NEAR(totals[3].linear_momentum.y(), -2 * 0.3 * totals[0].mass, 1e-11 * totals[0].mass);
  EXPECT_LT(*totals[3].elastic_energy, 1e-16 * kJelly.young);
}

// Moved over a thousand cells, in single precision too: no stress comes of it.
TEST(SolidStep, TranslationOverAThousandCellsMakesNoStress) {
  Scene scene = open_scene(2, 64, 0.05);
  scene.options.domain.upper = base::Vec3(64, 1, 0);
  scene.bodies = {block({1, 0.3, 0}, {1.3, 0.6, 0}, kJelly)};
  scene.bodies[0].velocity = {50, 0, 0};
  const auto simulation = make_simulation(scene, 1);
  const base::Vec3 before = mean_position(simulation->frame());
  const auto totals = run(*simulation, 1);
  EXPECT_NEAR((mean_position(simulation->frame()) - before).x(), 50, 1e-4);
  // Energy density of a stress s is s^2 / 2E: s <= 1e-12 E.
  EXPECT_LT(*totals[1].elastic_energy / totals[1].volume, 0.5e-24 * kJelly.young);
}

// A lone particle, stretched at first by 0.6 to 1.5: for ten thousand steps its energy stays where it was, without a trend.
TEST(SolidStep, ALoneParticleNeitherGainsEnergyNorDrifts) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 3; ++n) {
    Scene scene = lone_particle(1, 0.1);
    set_transfer(scene.options, n == 0 ? "apic" : "polypic");
    scene.bodies = {ball({0.45, 0.45, 0.45}, 0.06, kJelly)};
    scene.bodies[0].velocity = {0.3 * u(rng), 0.3 * u(rng), 0.3 * u(rng)};
    const auto simulation = make_simulation(scene, 8);
    State state = simulation->state();
    for (Column& c : state.columns) {
      if (c.name == "limits") {   // a short first step, until the speed of sound is that of this state
        const double fast = 50;
        std::memcpy(c.bytes.data(), &fast, sizeof fast);
      }
      if (c.name == "deformation") {
        std::vector<double> d(10);
        std::memcpy(d.data(), c.bytes.data(), sizeof(double) * 10);
        d[0] = 0.5, d[4] = -0.4, d[8] = 0.2, d[1] = 0.2 * u(rng);
        std::memcpy(c.bytes.data(), d.data(), sizeof(double) * 10);
      }
    }
    simulation->restore(state);
    ASSERT_EQ(simulation->totals().particles, 1);
    const double start = energy(simulation->totals());
    base::Ledger ledger;
    double first = 0, last = 0;
    std::int64_t steps = 0;
    for (int f = 0; f < 140; ++f) {
      simulation->advance(ledger, {});
      const Totals now = simulation->totals();
      steps += now.substeps;
      const double e = energy(now) / start;
      if (f < 35) first = std::max(first, e);
      if (f >= 105) last = std::max(last, e);
      ASSERT_TRUE(std::isfinite(e));
    }
    EXPECT_GT(steps, 10000);
    EXPECT_LT(first, 1 + 2.6 * 0.2);
    EXPECT_LE(last, 1.02 * first);
  }
}

// Coulomb on a slope: gravity is tilted, the floor rubs. a = g (sin - mu cos).
TEST(SolidStep, ABlockSlidesDownASlopeAsCoulombSays) {
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

TEST(SolidStep, ABlockOnASlopeFlatterThanItsFrictionStays) {
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

// Two balls of different stiffness and density meet: momentum is kept to rounding, and they part.
// What falls comes to rest where it touches, and not where it shares nodes with the floor, a cell above. Particles are middles: of these a quarter of a cell.
TEST(SolidStep, WhatHasFallenRestsOnTheFloorAndOnColliders) {
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

// A plate without friction hands a block momentum by its own velocity alone: work is that velocity times the momentum.
TEST(SolidStep, APlateThatMovesDoesTheWorkThatItsPushTells) {
  Scene scene = walled_scene(2, 1, 0.02);
  scene.options.precision = Precision::double_precision;
  scene.bodies = {block({0.3, 0.4, 0}, {0.5, 0.6, 0}, kJelly)};
  scene.colliders = {box_collider({0.1, 0.2, 0}, {0.29, 0.8, 0})};
  scene.colliders[0].velocity = {0.5, 0, 0};
  const auto simulation = make_simulation(scene, 50);
  double work = 0;
  Totals t;
  for (const Totals& frame : run(*simulation, 25)) work += frame.collider_work, t = frame;
  EXPECT_GT(t.linear_momentum.x() / t.mass, 0.4);
  EXPECT_NEAR(work, 0.5 * t.linear_momentum.x(), 1e-9 * work);
  EXPECT_LT(t.energy(), work);
}

// A block that holds a wheel, and sticks to it, turns as far as the wheel does, which does nothing before it starts and after it stops.
TEST(SolidStep, WhatSticksToAWheelTurnsWithIt) {
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

TEST(SolidStep, CollidingBodiesKeepMomentum) {
  for (const char* transfer : {"apic", "polypic", "flip", "flip and apic"}) {
    Scene scene = open_scene(2, 3, 0.025);
    const bool flips = std::string(transfer).starts_with("flip");
    set_transfer(scene.options, flips ? "apic" : transfer);
    Material heavy = kJelly;
    heavy.density = 3000, heavy.young = 4e5;
    scene.bodies = {ball({1.3, 1.5, 0}, 0.1, kJelly), ball({1.7, 1.52, 0}, 0.1, heavy)};
    scene.bodies[0].velocity = {2, 0, 0}, scene.bodies[1].velocity = {-2, 0, 0};
    scene.bodies[1].name = "other";
    if (flips) scene.bodies[0].transfer = "flip";
    if (flips && std::string(transfer) == "flip") scene.bodies[1].transfer = "flip";
    const auto simulation = make_simulation(scene, 20);
    const auto totals = run(*simulation, 6);
    const double scale = totals[0].mass * 2;
    EXPECT_LT((totals[6].linear_momentum - totals[0].linear_momentum).norm(), 1e-12 * scale) << transfer;
    if (flips) continue;   // keeps no angular momentum, and what it has too much is noise
    EXPECT_LT((totals[6].angular_momentum - totals[0].angular_momentum).norm(), 1e-11 * scale) << transfer;
    EXPECT_LT(energy(totals[6]), 1.001 * energy(totals[0])) << transfer;
    EXPECT_LT(totals[6].kinetic_energy, 0.99 * totals[0].kinetic_energy) << transfer;   // they did meet
  }
}

// Faster than sound in the material: steps get shorter, nothing is gained, and what was pressed to a hundredth of its volume comes back.
TEST(SolidStep, AnImpactFasterThanSoundGainsNoEnergy) {
  Scene scene = open_scene(2, 2, 0.05);
  Material soft = kJelly;
  soft.young = 1e3;   // sound at 1.2 m/s
  scene.bodies = {block({0.4, 0.8, 0}, {0.8, 1.2, 0}, soft), block({1.0, 0.8, 0}, {1.4, 1.2, 0}, soft)};
  scene.bodies[0].velocity = {3, 0, 0}, scene.bodies[1].velocity = {-3, 0, 0};
  scene.bodies[1].name = "other";
  const auto simulation = make_simulation(scene, 50);
  const auto totals = run(*simulation, 12);
  double largest = 0;
  std::int64_t by_motion = 0;
  for (const Totals& t : totals) largest = std::max(largest, energy(t)), by_motion += t.steps_by_motion + t.steps_by_loose;
  EXPECT_LT(largest, 1.02 * energy(totals[0]));
  EXPECT_GT(by_motion, 0);
  EXPECT_LT(totals[12].kinetic_energy, 0.9 * totals[0].kinetic_energy);
  double least = 1;
  for (const Totals& t : totals) least = std::min(least, t.least_volume.value_or(1));
  EXPECT_LT(least, 0.1);
  EXPECT_GT(totals[12].most_volume.value_or(0), 0.5);
}

// Crushed flat and let go: it comes back, whatever its law.
TEST(SolidStep, ACrushedCubeRecovers) {
  for (const Elasticity law : {Elasticity::fixed_corotated, Elasticity::neo_hookean, Elasticity::hencky}) {
    Scene scene = open_scene(3, 1, 0.1);
    Material material = kJelly;
    material.model = law;
    scene.bodies = {block({0.3, 0.3, 0.3}, {0.6, 0.6, 0.6}, material)};
    set_transfer(scene.options, "apic");
    const auto simulation = make_simulation(scene, 100);
    State state = simulation->state();
    for (Column& c : state.columns) {
      if (c.name == "limits") {   // a short first step, until the speed of sound is that of this state
        const double fast = 200;
        std::memcpy(c.bytes.data(), &fast, sizeof fast);
      }
      if (c.name == "deformation")
        for (std::int64_t row = 0; row < c.rows; ++row) {
          const double flat = law == Elasticity::hencky ? -0.4 : -0.7;   // Hencky's law softens where stretches pass e
          std::memcpy(c.bytes.data() + sizeof(double) * std::size_t(row * c.width), &flat, sizeof flat);
        }
    }
    simulation->restore(state);
    base::Ledger ledger;
    float widest = 0;
    for (int frame = 0; frame < 10; ++frame) {
      simulation->advance(ledger, {});
      ASSERT_TRUE(std::isfinite(energy(simulation->totals())));
      float low = 1e9f, high = -1e9f;
      for (const auto& x : simulation->frame().position) low = std::min(low, x.x()), high = std::max(high, x.x());
      widest = std::max(widest, high - low);
    }
    EXPECT_GT(widest, 0.36f);   // from 0.3: it grew along the axis it was crushed in
  }
}

// State out and in again is no restart; threads do not matter.
TEST(SolidStep, GoesOnToTheBitFromAStateAndOnAnyNumberOfThreads) {
  Scene scene = walled_scene(3, 0.5, 0.05);
  scene.options.precision = Precision::single_precision;
  scene.bodies = {ball({0.25, 0.25, 0.2}, 0.12, preset_material("snow")), block({0.1, 0.1, 0}, {0.4, 0.4, 0.06}, preset_material("dry_sand"))};
  scene.bodies[1].name = "floor";
  scene.bodies[1].transfer = "apic";
  scene.effects = {{"gravity", {0, 0, -9.81}}};
  const auto straight = make_simulation(scene, 50);
  run(*straight, 4);
  const auto first = make_simulation(scene, 50);
  run(*first, 2);
  const auto second = make_simulation(scene, 50);
  second->restore(first->state());
  run(*second, 2);
  EXPECT_EQ(straight->totals().state_hash, second->totals().state_hash);
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto again = make_simulation(scene, 50);
    run(*again, 4);
    EXPECT_EQ(straight->totals().state_hash, again->totals().state_hash) << threads;
  }
}

// A scene moved by half of a periodic domain, so that bodies lie across its side, is the same scene.
TEST(SolidStep, OfBodiesAcrossAPeriodicSideNothingChanges) {
  for (const int dimension : {2, 3})
    for (const char* transfer : {"polypic", "flip"}) {
      std::vector<Totals> ends, starts;
      for (const double shift : {0.5, 0.0}) {
        Scene scene = walled_scene(dimension, 1, 0.05);
        Options& o = scene.options;
        o.seeding = Seeding::regular;
        o.boundary[0] = {Side::periodic, Side::periodic};
        o.domain.upper = dimension == 2 ? base::Vec3(1, 0.4, 0) : base::Vec3(1, 0.4, 0.4);
        set_transfer(o, transfer);
        Material jelly = kJelly;
        jelly.volume_averaging = true;
        scene.bodies = {ball({0.01 + shift, 0.2, dimension == 2 ? 0 : 0.2}, 0.12, jelly)};
        scene.bodies[0].velocity = {0.3, -1, 0};
        scene.bodies[0].spin = {0, 0, 4};
        const auto simulation = make_simulation(scene, 25);
        const auto totals = run(*simulation, 4);
        starts.push_back(totals.front()), ends.push_back(totals.back());
      }
      EXPECT_NEAR(starts[1].kinetic_energy, starts[0].kinetic_energy, 1e-6 * starts[0].kinetic_energy) << dimension << transfer;
      EXPECT_NEAR(ends[1].kinetic_energy, ends[0].kinetic_energy, 1e-4 * ends[0].kinetic_energy) << dimension << transfer;
      EXPECT_NEAR(*ends[1].elastic_energy, *ends[0].elastic_energy, 1e-4 * *ends[0].elastic_energy) << dimension << transfer;
      EXPECT_GT(*ends[0].elastic_energy, 0.05 * ends[0].kinetic_energy);   // it has met the floor
    }
}

// A collider's face in a plane of nodes is met there, whatever the last bit says of 35 x 0.02 and 0.7.
TEST(SolidStep, AFaceInAPlaneOfNodesIsMetWhereverItIs) {
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
TEST(SolidStep, SlidesOverTheSeamOfTwoBoxesAsOverOne) {
  const auto floor = [](double from, double to) { return box_collider({from, 0, 0}, {to, 0.1, 0}); };
  EXPECT_NEAR(speed_on({floor(0, 1)}, false), 1, 1e-9);
  for (const double seam : {0.66, 0.67})
    EXPECT_NEAR(speed_on({floor(0, seam), floor(seam, 1)}, false), 1, 1e-9) << seam;
  for (const double start : {1.0, -1.0})
    EXPECT_NEAR(speed_on({floor(0, 1)}, true, start), start, 1e-9);
}

// What slides along a face that ends in a plane of nodes goes on beyond its edge.
TEST(SolidStep, SlidesOffTheEdgeOfATable) {
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

TEST(SolidStep, AFaceInAPeriodicSideIsMetFromEitherSide) {
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
TEST(SolidStep, StaysInTheMiddleOfAGroove) {
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
TEST(SolidStep, APostOnTheFloorIsMetAsOneThatGoesOnBelow) {
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
TEST(SolidStep, ACornerOfTwoBoxesIsMetAsOneOfWalls) {
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

TEST(SolidStep, GoesOnToTheBitWithTheWorkOfGravity) {
  Scene scene = open_scene(2, 1, 0.05);
  scene.options.precision = Precision::single_precision;
  scene.bodies = {ball({0.5, 0.5, 0}, 0.2, kJelly)};
  scene.bodies[0].velocity = {1, 0.3, 0};
  scene.effects = {{"gravity", {1, 0, 0}}};
  const auto straight = make_simulation(scene, 50);
  run(*straight, 2);
  const auto again = make_simulation(scene, 50);
  again->restore(straight->state());
  EXPECT_EQ(run(*straight, 1).back().gravity_work, run(*again, 1).back().gravity_work);   // to the bit
  EXPECT_NE(again->totals().gravity_work, 0);
}

// On a slope without ends a block that the ground holds falls no further than it shears.
TEST(SolidStep, GravityWorksByTheWayThatContactLeaves) {
  Scene scene = walled_scene(2, 1, 0.05);
  scene.options.boundary[0] = {Side::periodic, Side::periodic};
  scene.options.boundary[1] = {Side::sticky, Side::sticky};
  scene.options.seeding = Seeding::regular;
  scene.bodies = {block({0.3, 0, 0}, {0.7, 0.2, 0}, kJelly)};
  scene.effects = {{"gravity", {3, -9.81, 0}}};
  const auto simulation = make_simulation(scene, 50);
  const double start = mean_position(simulation->frame()).x();
  double work = 0;
  for (const Totals& t : run(*simulation, 25)) work += t.gravity_work;
  const double way = mean_position(simulation->frame()).x() - start, of_the_way = simulation->totals().mass * 3 * way;
  EXPECT_GT(way, 1e-4);
  EXPECT_NEAR(work, of_the_way, 0.15 * of_the_way);   // it swings: half a step's momentum is still to move it
}

TEST(SolidStep, AMaterialTooStiffForItsFramesIsRefusedWithItsCause) {
  Scene scene = open_scene(2, 1, 0.05);
  Material hard = kJelly;
  hard.young = 1e20;
  scene.bodies = {ball({0.5, 0.5, 0}, 0.2, hard)};
  const auto simulation = make_simulation(scene, 24);
  base::Ledger ledger;
  try {
    simulation->advance(ledger, {});
    FAIL() << "it went on";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::unstable);
    EXPECT_NE(e.complaint().message.find("sound"), std::string::npos) << e.complaint().message;
  }
}
