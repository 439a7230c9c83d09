// The liquid in two dimensions: every scheme, kernel and precision, what it keeps and what its counters say.
#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "sim/fluid/advect.h"
#include "sim/fluid/cells.h"
#include "sim/simulation.h"
#include "tests/threads.h"

namespace sim {
namespace {

base::Vec3 flat(double x, double y) { return {x, y, 0}; }

Scene tank(double cell) {
  Scene scene;
  scene.options.dimension = 2;
  scene.options.domain = {flat(0, 0), flat(1, 0.5)};
  scene.options.cell = cell;
  scene.options.particles_per_cell = 4;
  Body column;
  column.name = "column";
  column.shape.box = base::Box{flat(0, 0), flat(0.3, 0.4)};
  scene.bodies = {column};
  scene.effects = {Effect{.acceleration = flat(0, -9.81)}};
  return scene;
}

Totals run(const Scene& scene, int frames, base::Ledger& ledger) {
  const auto simulation = make_simulation(scene, 24);
  for (int f = 0; f < frames; ++f) simulation->advance(ledger, {});
  return simulation->totals();
}

Totals run(const Scene& scene, int frames) {
  base::Ledger ledger;
  return run(scene, frames, ledger);
}

TEST(FlatLiquid, WeighsWhatASlabOfOneMetreDoes) {
  const auto simulation = make_simulation(tank(0.02), 24);
  const Totals t = simulation->totals();
  EXPECT_EQ(t.particles, 15 * 20 * 4);
  EXPECT_NEAR(t.volume, 0.3 * 0.4, 1e-12);
  EXPECT_NEAR(t.mass, 1000 * 0.3 * 0.4, 1e-9);
  EXPECT_NEAR(t.potential_energy, t.mass * 9.81 * 0.2, 0.01 * t.mass);
  const Frame frame = simulation->frame();
  EXPECT_NEAR(M_PI * frame.pscale * frame.pscale, 0.02 * 0.02 / 4, 1e-12);
  for (const base::Vec3f& x : frame.position) ASSERT_EQ(x.z(), 0);
}

TEST(FlatLiquid, FallsFreelyBeforeItLands) {
  Scene scene = tank(0.05);
  scene.bodies[0].shape.sphere = Shape::Sphere{flat(0.5, 0.35), 0.1};
  scene.bodies[0].shape.box.reset();
  scene.bodies[0].velocity = flat(0.5, 0);
  const Totals t = run(scene, 2);
  ASSERT_GT(t.particles, 40);
  const double fallen = 9.81 * 2 / 24.0;
  EXPECT_NEAR(t.linear_momentum.y() / t.mass, -fallen, 1e-5 * fallen);
  EXPECT_NEAR(t.linear_momentum.x() / t.mass, 0.5, 1e-5);
  EXPECT_EQ(t.linear_momentum.z(), 0);
}

TEST(FlatLiquid, StandsStillWhenItIsLevel) {
  Scene scene = tank(0.05);
  scene.bodies[0].shape.box = base::Box{flat(0, 0), flat(1, 0.25)};
  scene.options.seeding = Seeding::regular;
  const Totals t = run(scene, 24);
  ASSERT_GT(t.substeps, 0);
  EXPECT_LE(t.max_speed, 1e-4 * std::sqrt(9.81 * 0.25));
}

struct Scheme {
  Transfer transfer;
  Kernel kernel;
  base::CountOrName modes;
};

std::vector<Scheme> every_scheme() {
  std::vector<Scheme> all;
  for (const Kernel kernel : {Kernel::linear, Kernel::quadratic}) {
    for (const Transfer transfer : {Transfer::pic, Transfer::flip, Transfer::apic}) all.push_back({transfer, kernel, {}});
    for (std::int64_t n = 1; n <= (kernel == Kernel::linear ? 4 : 9); ++n) all.push_back({Transfer::polypic, kernel, {n, {}}});
    all.push_back({Transfer::polypic, kernel, {0, "multilinear"}});
    all.push_back({Transfer::polypic, kernel, {0, "full"}});
  }
  all.push_back({Transfer::polypic, Kernel::quadratic, {0, "quadratic"}});
  return all;
}

TEST(FlatLiquid, NeverGainsEnergyInADamBreak) {
  for (const Scheme& scheme : every_scheme())
    for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
      Scene scene = tank(0.05);
      scene.options.transfer = scheme.transfer, scene.options.kernel = scheme.kernel, scene.options.modes = scheme.modes;
      scene.options.precision = precision;
      const auto simulation = make_simulation(scene, 24);
      const double start = simulation->totals().potential_energy;
      ASSERT_GT(start, 100);
      base::Ledger ledger;
      double moved = 0;
      for (int f = 0; f < 12; ++f) {
        simulation->advance(ledger, {});
        const Totals t = simulation->totals();
        EXPECT_LE(t.kinetic_energy + t.potential_energy, 1.005 * start)
            << "transfer " << int(scheme.transfer) << " kernel " << int(scheme.kernel) << " modes " << scheme.modes.count << scheme.modes.name;
        moved = std::max(moved, t.kinetic_energy);
      }
      EXPECT_GT(moved, 0.1 * start);
    }
}

TEST(FlatLiquid, HasTheSameBitsOnAnyNumberOfThreads) {
  std::uint64_t hash[3];
  for (int i = 0; i < 3; ++i) {
    hash[i] = on_threads(1 << i, [] { return run(tank(0.01), 4).state_hash; });
  }
  EXPECT_EQ(hash[0], hash[1]);
  EXPECT_EQ(hash[0], hash[2]);
}

// Symmetric sets only: those that hold with every mode its mirror image; mirrors along an axis keep every mode, so all do.
TEST(FlatLiquid, OfAMirroredSceneIsMirrored) {
  for (const Scheme& scheme : {Scheme{Transfer::apic, Kernel::linear, {}}, Scheme{Transfer::polypic, Kernel::linear, {}}, Scheme{Transfer::polypic, Kernel::quadratic, {}},
                               Scheme{Transfer::flip, Kernel::quadratic, {}}}) {
    Scene scene = tank(0.05);
    scene.options.transfer = scheme.transfer, scene.options.kernel = scheme.kernel;
    scene.options.seeding = Seeding::regular;
    scene.options.precision = Precision::double_precision;
    Scene mirrored = scene;
    mirrored.bodies[0].shape.box = base::Box{flat(0.7, 0), flat(1, 0.4)};
    const auto one = make_simulation(scene, 24), other = make_simulation(mirrored, 24);
    const auto mirror = [](base::Vec3f x) { return base::Vec3f(1 - x.x(), x.y(), 0); };
    const Frame start = one->frame(), start_other = other->frame();
    ASSERT_EQ(start.position.size(), start_other.position.size());
    std::vector<std::size_t> twin;   // of each particle: the one that starts at its mirrored place
    for (const base::Vec3f& x : start.position)
      for (std::size_t j = 0; j < start_other.position.size(); ++j)
        if ((mirror(start_other.position[j]) - x).norm() < 1e-3f) twin.push_back(j);
    ASSERT_EQ(twin.size(), start.position.size());
    base::Ledger ledger;
    for (int f = 0; f < 6; ++f) one->advance(ledger, {}), other->advance(ledger, {});
    const Frame a = one->frame(), b = other->frame();
    double moved = 0;
    for (std::size_t i = 0; i < twin.size(); ++i) {
      EXPECT_LT((mirror(b.position[twin[i]]) - a.position[i]).norm(), 1e-6f) << int(scheme.transfer) << " " << i;
      moved = std::max(moved, double((a.position[i] - start.position[i]).norm()));
    }
    EXPECT_GT(moved, 0.1);
  }
}

TEST(FlatLiquid, GoesOnFromItsStateToTheSameBits) {
  for (const Carry carry : {Carry::fixed, Carry::hybrid}) {
    Scene scene = tank(0.02);
    scene.options.kernel = Kernel::quadratic;
    scene.options.carry = carry;
    scene.options.boundary[0] = {Side::periodic, Side::periodic};
    const auto whole = make_simulation(scene, 24), rest = make_simulation(scene, 24);
    base::Ledger ledger;
    for (int f = 0; f < 3; ++f) whole->advance(ledger, {});
    rest->restore(whole->state());
    for (int f = 0; f < 3; ++f) whole->advance(ledger, {}), rest->advance(ledger, {});
    EXPECT_EQ(whole->totals().state_hash, rest->totals().state_hash);
    EXPECT_EQ(whole->frame().number, rest->frame().number);
    EXPECT_EQ(rest->totals().time, 6 / 24.0);
    EXPECT_EQ(whole->totals().limited_modes, rest->totals().limited_modes);
    Scene other = scene;
    other.options.kernel = Kernel::linear, other.options.carry = Carry::fixed;
    EXPECT_THROW(rest->restore(make_simulation(other, 24)->state()), base::Error);
  }
}

TEST(FlatLiquid, LimitsModesOnlyWhereTheCarrySaysSo) {
  std::int64_t limited[3];
  bool has_pass[3];
  for (const Carry carry : {Carry::fixed, Carry::limited, Carry::hybrid}) {
    Scene scene = tank(0.02);
    scene.options.kernel = Kernel::quadratic;
    scene.options.carry = carry;
    base::Ledger ledger;
    limited[int(carry)] = run(scene, 4, ledger).limited_modes;
    has_pass[int(carry)] = ledger.passes().contains("carry");
  }
  EXPECT_EQ(limited[0], 0);
  EXPECT_FALSE(has_pass[0]);
  EXPECT_GT(limited[2], 0);                // the rim
  EXPECT_GT(limited[1], 2 * limited[2]);   // everywhere
  EXPECT_TRUE(has_pass[1] && has_pass[2]);
}

TEST(Contact, TakesWhatOfAVelocityLeadsIntoTheSolid) {
  Scene scene = tank(0.1);
  Collider post;
  post.shape.box = base::Box{flat(0.5, 0), flat(0.6, 0.3)};
  scene.colliders = {post};
  const Solids<2> solids(scene, Lattice<2>({10, 5}));
  const auto after = [&](double x, double y, double u, double v) {
    const Cell<2> cell{int(std::floor(x)), int(std::floor(y))};
    Moving<2, double> particle{{cell, Vec<2, double>(x - cell[0], y - cell[1])}, Vec<2, double>(u, v)};
    const double pushed = solids.push_out(particle);
    return std::array{pushed, particle.velocity[0], particle.velocity[1]};
  };
  EXPECT_EQ(after(2.5, 1.5, -3, -2), (std::array{0.0, -3.0, -2.0}));            // free
  const auto floor = after(2.5, -0.5, 3, -2), away = after(2.5, -0.5, 3, 2), wall = after(10.2, 1.5, 3, -2), side = after(4 + 1.2, 1.5, 2, -1);
  EXPECT_NEAR(floor[0], 0.501, 1e-12);
  EXPECT_EQ(floor[1], 3);
  EXPECT_EQ(floor[2], 0);
  EXPECT_EQ(away[2], 2);
  EXPECT_EQ(wall[1], 0);
  EXPECT_EQ(wall[2], -2);
  EXPECT_NEAR(side[0], 0.201, 1e-12);
  EXPECT_NEAR(side[1], 0, 1e-15);
  EXPECT_EQ(side[2], -1);
}

TEST(Contact, DropsTheModesThatBendWhereAParticleWasPushedFar) {
  Scene scene = tank(0.1);
  const Solids<2> solids(scene, Lattice<2>({10, 5}));
  const auto modes = ordered_modes<2>(2);
  Particles<2, float> particles;
  particles.modes = int(modes.size());
  particles.cell = {{2, -1}, {2, -1}, {2, 2}};
  particles.offset = {{0.5f, 0.9f}, {0.5f, 0.6f}, {0.5f, 0.5f}};   // 0.1 and 0.4 cells under the floor, and inside
  particles.id = {0, 1, 2};
  particles.coefficients.assign(3 * particles.row(), 1.0f);
  const Contacts contacts = push_out<2, float>(solids, modes, particles);
  EXPECT_EQ(contacts.pushed_out, 2);
  EXPECT_EQ(contacts.dropped_modes, 1);
  for (std::size_t r = 0; r < modes.size(); ++r) {
    const bool bends = modes[r][0] == 2 || modes[r][1] == 2;
    EXPECT_EQ(particles.component(0, 0)[r], 1);
    EXPECT_EQ(particles.component(1, 0)[r], bends ? 0 : 1);
    EXPECT_EQ(particles.component(2, 1)[r], 1);
  }
}

TEST(Cells, CloseAGapOfOneCellButNoSurface) {
  Scene scene = tank(0.1);
  const Lattice<2> lattice({10, 5});
  const Solids<2> solids(scene, lattice);
  Particles<2, float> particles;
  for (int x = 0; x < 10; ++x)
    for (int y = 0; y < 3; ++y) {
      const bool gap = (x == 4 && y == 1) || (x == 0 && y == 0), hole = (x == 7 || x == 8) && y == 1;
      if (gap || hole) continue;
      particles.cell.push_back({x, y});
      particles.offset.push_back({0.5f, 0.5f});
      particles.id.push_back(std::int64_t(particles.id.size()));
      particles.coefficients.insert(particles.coefficients.end(), 2, 0.0f);
    }
  CanonicalOrder<2, float> order;
  const CellRanges ranges = order.sort(particles, lattice);
  const auto blocks = ActiveBlocks<2>::whole(lattice);
  OpenFaces<2> open;
  open.update(solids, blocks);
  const auto kind = classify_cells(ranges, blocks, solids, open), full = classify_cells(ranges, blocks, solids, open, /*free_surface=*/false);
  const auto at = [&](const std::vector<CellKind>& k, int x, int y) { return k[std::size_t(blocks.index({x, y}))]; };
  EXPECT_EQ(at(kind, 4, 1), CellKind::liquid);
  EXPECT_EQ(at(kind, 0, 0), CellKind::liquid);   // in the corner: two walls, two liquid cells
  EXPECT_EQ(at(kind, 7, 1), CellKind::air);
  EXPECT_EQ(at(kind, 8, 1), CellKind::air);
  for (int x = 0; x < 10; ++x) EXPECT_EQ(at(kind, x, 3), CellKind::air);
  EXPECT_EQ(at(full, 7, 1), CellKind::liquid);
  EXPECT_EQ(at(full, 3, 4), CellKind::liquid);
  EXPECT_EQ(at(full, 3, 5), CellKind::solid);
}

}  // namespace
}  // namespace sim
