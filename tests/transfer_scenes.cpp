// Whole scenes of a liquid: turned, they give turned results, and moved by a power of two of cells, the same bits.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/simulation.h"

namespace sim {
namespace {

constexpr double kCell = 1.0 / 16;   // [m] a power of two: places of cells are exact

struct Scheme {
  Transfer transfer;
  Kernel kernel;
  const char* modes;
};
/// Sets that treat the axes alike.
const Scheme kSymmetric[] = {{Transfer::pic, Kernel::quadratic, ""},         {Transfer::flip, Kernel::linear, ""},
                             {Transfer::apic, Kernel::quadratic, ""},        {Transfer::polypic, Kernel::quadratic, "multilinear"},
                             {Transfer::polypic, Kernel::quadratic, "quadratic"}, {Transfer::polypic, Kernel::quadratic, "full"},
                             {Transfer::polypic, Kernel::linear, "full"}};

void choose(Scene& scene, const Scheme& scheme) {
  scene.options.transfer = scheme.transfer, scene.options.kernel = scheme.kernel, scene.options.modes.name = scheme.modes;
}

/// Axis a takes the place of axis to[a].
base::Vec3 turned(const base::Vec3& v, const std::array<int, 3>& to) {
  base::Vec3 result;
  for (int a = 0; a < 3; ++a) result[to[std::size_t(a)]] = v[a];
  return result;
}

/// A column that falls over in a tank of unequal sides.
Scene tank(int dimension, const std::array<int, 3>& to) {
  Scene scene;
  const double depth = dimension == 3 ? 1 : 0;
  scene.options.dimension = dimension;
  scene.options.domain = {base::Vec3::Zero(), turned(base::Vec3(16, 8, 6 * depth) * kCell, to)};
  scene.options.cell = kCell;
  scene.options.particles_per_cell = dimension == 3 ? 8 : 4;
  scene.options.seeding = Seeding::regular;
  scene.options.precision = Precision::double_precision;
  Body column;
  column.name = "column";
  column.shape.box = base::Box{base::Vec3::Zero(), turned(base::Vec3(5, 6, 4 * depth) * kCell, to)};
  scene.bodies = {column};
  scene.effects = {Effect{.acceleration = turned(base::Vec3(0, -9.81, 0), to)}};
  return scene;
}

void expect_turned(int dimension, const std::array<int, 3>& to, const Scheme& scheme) {
  Scene here = tank(dimension, {0, 1, 2}), there = tank(dimension, to);
  choose(here, scheme), choose(there, scheme);
  const auto one = make_simulation(here, 24), other = make_simulation(there, 24);
  const Frame start = one->frame(), start_other = other->frame();
  ASSERT_EQ(start.position.size(), start_other.position.size());
  const auto turn = [&](const base::Vec3f& x) -> base::Vec3 { return turned(x.cast<double>(), to); };
  std::vector<std::size_t> twin;   // of each particle: the one that starts at its turned place
  for (const base::Vec3f& x : start.position)
    for (std::size_t j = 0; j < start_other.position.size(); ++j)
      if ((start_other.position[j].cast<double>() - turn(x)).norm() < 1e-3) twin.push_back(j);
  ASSERT_EQ(twin.size(), start.position.size());
  base::Ledger ledger;
  for (int f = 0; f < 5; ++f) one->advance(ledger, {}), other->advance(ledger, {});
  const Frame a = one->frame(), b = other->frame();
  double moved = 0, apart = 0;
  for (std::size_t i = 0; i < twin.size(); ++i) {
    apart = std::max(apart, (b.position[twin[i]].cast<double>() - turn(a.position[i])).norm());
    moved = std::max(moved, double((a.position[i] - start.position[i]).norm()));
  }
  EXPECT_LT(apart, 1e-6);
  EXPECT_GT(moved, 0.1);
}

TEST(Scenes, MayBeTurnedWithSymmetricSets) {
  for (const Scheme& scheme : kSymmetric) {
    SCOPED_TRACE(testing::Message() << "transfer " << int(scheme.transfer) << ", kernel " << int(scheme.kernel) << ' ' << scheme.modes);
    expect_turned(2, {1, 0, 2}, scheme);
    expect_turned(3, {1, 2, 0}, scheme);
    expect_turned(3, {0, 2, 1}, scheme);
  }
}

/// Two drops that meet in the air, `cells` further along every axis.
Scene drops(int dimension, int cells) {
  Scene scene;
  const base::Vec3 used(1, 1, dimension == 3), by = cells * kCell * used;
  scene.options.dimension = dimension;
  scene.options.domain = {base::Vec3::Zero(), 48 * kCell * used};
  scene.options.cell = kCell;
  scene.options.particles_per_cell = dimension == 3 ? 8 : 4;
  scene.options.seeding = Seeding::regular;
  for (const int side : {0, 1}) {
    Body drop;
    drop.name = side ? "right" : "left";
    drop.shape.box = base::Box{by + base::Vec3(side ? 11 : 6, side ? 7 : 6, 6).cwiseProduct(used) * kCell,
                               by + base::Vec3(side ? 16 : 11, side ? 12 : 11, 11).cwiseProduct(used) * kCell};
    drop.velocity = base::Vec3(side ? -1 : 1, 0, 0);
    scene.bodies.push_back(drop);
  }
  scene.effects = {Effect{.acceleration = base::Vec3(0, -1, 0)}};
  return scene;
}

TEST(Scenes, MovedByAPowerOfTwoOfCellsKeepTheirBits) {
  for (const int dimension : {2, 3})
    for (const Scheme& scheme : kSymmetric) {
      SCOPED_TRACE(testing::Message() << dimension << "-D, transfer " << int(scheme.transfer) << ", kernel " << int(scheme.kernel) << ' ' << scheme.modes);
      std::vector<base::Vec3f> velocity[2];
      for (const int moved : {0, 1}) {
        Scene scene = drops(dimension, moved ? 16 : 0);
        choose(scene, scheme);
        const auto simulation = make_simulation(scene, 24);
        base::Ledger ledger;
        for (int f = 0; f < 3; ++f) simulation->advance(ledger, {});
        velocity[moved] = simulation->frame().velocity;
      }
      EXPECT_EQ(velocity[0], velocity[1]);
      float across = 0;   // they have met: some go up or down faster than they fall
      for (const base::Vec3f& v : velocity[0]) across = std::max(across, std::abs(v.y()));
      EXPECT_GT(across, 0.3f);
    }
}

}  // namespace
}  // namespace sim
