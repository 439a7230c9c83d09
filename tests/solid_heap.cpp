// Sand at rest and in motion: the slope at which a layer lets go, the slope a heap comes to, and the room that sand fills when it has been shaken.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <utility>

#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

constexpr double kDegree = M_PI / 180;

Material sand_of(double friction_angle) {
  Material sand = preset_material("dry_sand");
  sand.friction_angle = friction_angle;
  return sand;
}

/// Steepest slope [degrees] of the law in plane strain. The cone that is Mohr and Coulomb's in triaxial compression [Klar16] has there the friction
/// sin = 2 sqrt(3) s / (3 - s), s = sin phi; with the plane's own deviator, in two dimensions, 4 s / (sqrt(3) (3 - s)). Flow keeps
/// volume, so a plane of slip bears that sine times its pressure, not the tangent [Davis68].
double steepest(int dimension, double friction_angle) {
  const double s = std::sin(friction_angle * kDegree);
  return std::atan(dimension == 3 ? 2 * std::sqrt(3.0) * s / (3 - s) : 4 * s / (std::sqrt(3.0) * (3 - s))) / kDegree;
}

/// What a layer without end, eight cells deep on a rough bed, gains of speed [m/s] in the second half of a second on a slope.
double gain_on_slope(int dimension, double tilt, double friction_angle) {
  Scene scene = walled_scene(dimension, 0.2, 0.0125);
  Options& o = scene.options;
  o.domain.upper = dimension == 3 ? base::Vec3(0.05, 0.05, 0.2) : base::Vec3(0.1, 0.2, 0);
  for (int a = 0; a < dimension - 1; ++a) o.boundary[std::size_t(a)] = {Side::periodic, Side::periodic};
  o.boundary[std::size_t(dimension - 1)][0] = Side::sticky;
  o.precision = Precision::single_precision;
  set_transfer(o, "apic");
  base::Vec3 top = o.domain.upper, pull = base::Vec3::Zero();
  top[dimension - 1] = 0.1;
  pull[0] = 9.81 * std::sin(tilt * kDegree), pull[dimension - 1] = -9.81 * std::cos(tilt * kDegree);
  scene.bodies = {block(base::Vec3::Zero(), top, sand_of(friction_angle))};
  scene.effects = {{"gravity", pull}};
  const auto simulation = make_simulation(scene, 2);
  const std::vector<Totals> seen = run(*simulation, 2);
  return (seen[2].linear_momentum.x() - seen[1].linear_momentum.x()) / seen[2].mass;
}

/// Slope [degrees] of a heap against a smooth wall at x = 0, by a line through its uppermost particles between a fifth and four fifths of its width.
double slope_of(const Frame& frame, double cell) {
  std::vector<double> top(100, 0.0);
  for (const base::Vec3f& x : frame.position) {
    double& height = top[std::min<std::size_t>(99, std::size_t(double(x.x()) / cell))];
    height = std::max(height, double(x.y()));
  }
  std::size_t width = 0;
  while (width < top.size() && top[width] > 1.2 * cell) ++width;
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t b = width / 5; b <= 4 * width / 5; ++b) {
    const double at = (double(b) + 0.5) * cell;
    n += 1, x += at, y += top[b], xx += at * at, xy += at * top[b];
  }
  return std::atan(-(n * xy - x * y) / (n * xx - x * x)) / kDegree;
}

/// Half a heap, built of rows, steeper than it can be; 1.2 s later.
double slope_of_heap(double friction_angle, double start, double seconds) {
  constexpr double kCell = 0.01, kWidth = 0.25;
  Scene scene = walled_scene(2, 0.6, kCell);
  scene.options.domain.upper.y() = 0.3;
  scene.options.boundary[0][0] = Side::slip;
  scene.options.boundary[1][0] = Side::sticky;
  scene.options.precision = Precision::single_precision;
  set_transfer(scene.options, "apic");
  const double rise = std::tan(start * kDegree);
  const auto width_of = [&](int row) { return kWidth - (row + 0.5) * kCell / rise; };
  for (int row = 0; width_of(row) > kCell / 2; ++row) {   // as wide as particles are apart
    scene.bodies.push_back(block({0, row * kCell, 0}, {width_of(row), (row + 1) * kCell, 0}, sand_of(friction_angle)));
    scene.bodies.back().name = "row" + std::to_string(row);
  }
  scene.effects = {{"gravity", {0, -9.81, 0}}};
  const auto simulation = make_simulation(scene, 1 / seconds);
  run(*simulation, 1);
  return slope_of(simulation->frame(), kCell);
}

/// How high the middle of sand in a box is, over that at first, after it was thrown up, the higher the faster, and fell back. `forgets`: what
/// volume its grains gained while they were apart, fifty times in each flight.
double bulk_after_flight(bool forgets, double& highest) {
  Scene scene = walled_scene(2, 0.8, 0.02);
  scene.options.domain.upper.x() = 0.2;
  scene.options.boundary[0] = {Side::slip, Side::slip};
  set_transfer(scene.options, "apic");
  for (int row = 0; row < 10; ++row) {
    scene.bodies.push_back(block({0, row * 0.02, 0}, {0.2, (row + 1) * 0.02, 0}, preset_material("dry_sand")));
    scene.bodies.back().name = "row" + std::to_string(row);
    scene.bodies.back().velocity = {0, 6 * (row + 0.5) * 0.02, 0};
  }
  scene.effects = {{"gravity", {0, -9.81, 0}}};
  const auto simulation = make_simulation(scene, 240);
  const auto middle = [&] {
    double sum = 0;
    const Frame frame = simulation->frame();
    for (const base::Vec3f& x : frame.position) sum += double(x.y()) / double(frame.position.size());
    return sum;
  };
  const double start = middle();
  for (int frame = 0; frame < 300; ++frame) {
    run(*simulation, 1);
    highest = std::max(highest, middle() / start);
    if (!forgets) continue;
    State state = simulation->state();
    for (Column& c : state.columns)
      if (c.name == "deformation")
        for (std::int64_t row = 0; row < c.rows; ++row)
          std::memset(c.bytes.data() + sizeof(double) * std::size_t(row * c.width + 4), 0, sizeof(double));
    simulation->restore(state);
  }
  return middle() / start;
}

/// How many particles the cell of one of them holds, in the mean over all, when two balls of snow have met in the air, fallen to the floor and lie there,
/// over that at first.
double packing_after_fall() {
  constexpr double kCell = 0.0125;
  Scene scene = walled_scene(2, 1.2, kCell);
  scene.options.modes.name = "multilinear";
  scene.options.wall_friction = 0.5;
  scene.bodies = {ball({0.28, 0.42, 0}, 0.11, preset_material("snow")), ball({0.92, 0.44, 0}, 0.09, preset_material("snow"))};
  scene.bodies[0].velocity = {4, 1, 0}, scene.bodies[1].velocity = {-4, 1, 0};
  scene.bodies[1].name = "other";
  scene.effects = {{"gravity", {0, -9.81, 0}}};
  const auto simulation = make_simulation(scene, 2);
  const auto packing = [&] {
    std::map<std::pair<int, int>, double> number;
    const Frame frame = simulation->frame();
    for (const base::Vec3f& x : frame.position) ++number[{int(double(x.x()) / kCell), int(double(x.y()) / kCell)}];
    double sum = 0;
    for (const auto& [cell, n] : number) sum += n * n / double(frame.position.size());
    return sum;
  };
  const double start = packing();
  run(*simulation, 2);
  return packing() / start;
}

}  // namespace

TEST(SolidHeap, ALayerOfSandStaysBelowTheSlopeOfItsLawAndRunsAboveIt) {
  for (const int dimension : {2, 3}) {
    const double limit = steepest(dimension, 35), below = gain_on_slope(dimension, limit - 3, 35), above = gain_on_slope(dimension, limit + 3, 35);
    std::printf("%d-D: steepest %.1f degrees; gain 3 degrees below %.4f m/s, above %.4f m/s\n", dimension, limit, below, above);
    EXPECT_LT(std::abs(below), 0.02) << dimension;
    EXPECT_GT(above, 0.1) << dimension;
  }
}

// What slides does not stop at once: heaps end a little flatter than the slope that would hold.
TEST(SolidHeap, AHeapSlidesToTheSlopeOfItsLawAndAFlatOneStays) {
  for (const double friction_angle : {35.0, 25.0}) {
    const double limit = steepest(2, friction_angle), seen = slope_of_heap(friction_angle, limit + 8, 1.2);
    std::printf("friction angle %.0f: steepest %.1f degrees, the heap's %.1f\n", friction_angle, limit, seen);
    EXPECT_LT(seen, limit + 1) << friction_angle;
    EXPECT_GT(seen, limit - 4) << friction_angle;
  }
  const double flat = steepest(2, 35) - 4;
  EXPECT_NEAR(slope_of_heap(35, flat, 0.6), slope_of_heap(35, flat, 1e-3), 1) << "it crept";
}

TEST(SolidHeap, ShakenSandFillsTheRoomItHadBecauseItRemembersWhatItGained) {
  double flown = 0, high = 0;
  const double bulk = bulk_after_flight(false, flown), forgotten = bulk_after_flight(true, high);
  std::printf("bulk %.4f, forgetting %.4f; highest %.2f and %.2f\n", bulk, forgotten, flown, high);
  EXPECT_GT(flown, 1.15);
  EXPECT_LT(bulk, 1.03);
  EXPECT_GT(bulk, 0.97);
  EXPECT_GT(forgotten, 1.05);
}

// An impact packs snow. Its waves pull and push in turn, though: snow that did not close its gaps before it is pushed would lie there as loose as it was
// (1.00), in three dimensions as crumbs (sim/solid/snow.h).
TEST(SolidHeap, SnowThatFellIsPacked) {
  const double packing = packing_after_fall();
  std::printf("snow that fell is %.2f times as dense as it was\n", packing);
  EXPECT_GE(packing, 1.05);
  EXPECT_LE(packing, 1.5);
}
