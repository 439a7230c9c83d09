// Taylor-Green vortices under advection-reflection: what the second projection of a step gives back.
//
// As in transfer_taylor_green.cpp: [0, 2 pi]^2, periodic, u = sin kx cos ky, v = -cos kx sin ky, 64 x 64 cells, 2 x 2 stratified jitter,
// dt = half a cell at the greatest speed. A step is two of half its length; after the first the particles get the field mirrored at the
// projected one, while the projected one moves them.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"

namespace sim {
namespace {

constexpr int kCells = 64;
constexpr double kCell = 2 * M_PI / kCells;

struct Scheme {
  const char* name;
  Transfer transfer;
  Kernel kernel;
  std::int64_t modes;   // 0: the scheme's own
};
constexpr Scheme kPic{"PIC", Transfer::pic, Kernel::quadratic, 0}, kFlip{"FLIP", Transfer::flip, Kernel::quadratic, 0},
    kApic{"APIC", Transfer::apic, Kernel::quadratic, 0}, kPoly4{"PolyPIC 4", Transfer::polypic, Kernel::quadratic, 4},
    kPoly6{"PolyPIC 6", Transfer::polypic, Kernel::quadratic, 6}, kPoly9{"PolyPIC 9", Transfer::polypic, Kernel::quadratic, 9},
    kLinear4{"linear, full", Transfer::polypic, Kernel::linear, 4};

FaceField<2, double> exact_field(const ActiveBlocks<2>& blocks, int k) {
  FaceField<2, double> field;
  for (auto& component : field) component.resize(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Cell<2> at = blocks.cell_at(i);
    const auto angle = [&](int a, double shift) { return k * kCell * (at[std::size_t(a)] + shift); };
    field[0][i] = std::sin(angle(0, 0)) * std::cos(angle(1, 0.5));
    field[1][i] = -std::cos(angle(0, 0.5)) * std::sin(angle(1, 0));
  }
  return field;
}

double squares(const FaceField<2, double>& a, const FaceField<2, double>* less) {
  double sum = 0;
  for (std::size_t c = 0; c < 2; ++c)
    for (std::size_t i = 0; i < a[c].size(); ++i) sum += std::pow(a[c][i] - (less ? (*less)[c][i] : 0), 2);
  return sum;
}

struct Decay {
  double energy = 1, error = 0;   // relative
};

Decay decay(const Scheme& scheme, int k, double until, double step_cells, bool reflects = true, Carry carry = Carry::fixed) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = 2;
  o.domain = {base::Vec3::Zero(), base::Vec3(2 * M_PI, 2 * M_PI, 0)};
  o.cell = kCell;
  o.boundary = {std::array{Side::periodic, Side::periodic}, std::array{Side::periodic, Side::periodic}};
  o.particles_per_cell = 4;
  o.transfer = scheme.transfer, o.kernel = scheme.kernel, o.modes.count = scheme.modes, o.carry = carry;
  o.pressure_tolerance = 1e-8;
  Body all;
  all.name = "all";
  all.shape.box = o.domain;
  scene.bodies = {all};
  const Lattice<2> lattice({kCells, kCells}, {true, true});
  const Solids<2> solids(scene, lattice);
  FluidStep<2, double> step(o, solids, /*free_surface=*/false);
  auto particles = seed_particles<2, double>(scene, lattice, solids, int(step.transfer().modes().size()));
  base::Ledger ledger;
  const FaceField<2, double> start = exact_field(step.blocks(), k);
  const double whole = squares(start, nullptr);
  EXPECT_GT(whole, 1000);
  step.set_velocity(ActiveBlocks<2>(step.blocks()), start);
  step.gather({}, particles, ledger);
  const GatherRule rule{scheme.transfer == Transfer::flip, 0.99};
  const double dt = step_cells * kCell;
  const auto part = [&](double length, bool mirror) {
    step.move(length, particles, ledger);
    step.scatter(particles, ledger);
    step.project(length, base::Vec3::Zero(), ledger);
    if (mirror) step.gather_reflected(rule, particles, ledger);
    else step.gather(rule, particles, ledger);
  };
  for (double t = 0; t < until; t += dt) {
    if (reflects) part(dt / 2, true), part(dt / 2, false);
    else part(dt, false);
  }
  return {squares(step.velocity(), nullptr) / whole, std::sqrt(squares(step.velocity(), &start) / whole)};
}

// Other seeds change these numbers by up to 0.003, and they are rounded to 0.001.
constexpr double kTolerance = 0.01;

TEST(Reflection, KeepsWideVorticesAsTheyAre) {
  for (const auto& [scheme, error] : {std::pair{kPic, .625}, {kFlip, .020}, {kApic, .002}, {kPoly4, .004}, {kPoly9, .001}})
    EXPECT_NEAR(decay(scheme, 1, 5, 0.5).error, error, kTolerance) << scheme.name;
}

TEST(Reflection, KeepsOfNarrowVorticesWhatTheModesHold) {
  for (const auto& [scheme, energy] : {std::pair{kFlip, .286}, {kApic, .052}, {kPoly4, .248}, {kPoly6, .700}, {kPoly9, .838}, {kLinear4, .771}})
    EXPECT_NEAR(decay(scheme, 8, 1, 0.5).energy, energy, kTolerance) << scheme.name;
  EXPECT_NEAR(decay(kPoly9, 8, 1, 0.5, true, Carry::limited).energy, .745, kTolerance);
}

// The flow is steady; with full modes on wide vortices the error that is left is the splitting's.
TEST(Splitting, IsOfFirstOrderAloneAndOfSecondWithReflection) {
  double error[2][3];
  for (const bool reflects : {false, true})
    for (int i = 0; i < 3; ++i) error[reflects][i] = decay(kPoly9, 1, 2, (reflects ? 8.0 : 2.0) / (1 << i), reflects).error;   // below, space has the last word
  const auto order = [](const double (&e)[3]) { return std::log2(e[0] / e[2]) / 2; };
  EXPECT_NEAR(order(error[0]), 1, 0.2) << error[0][0] << " " << error[0][1] << " " << error[0][2];
  EXPECT_GT(order(error[1]), 1.7) << error[1][0] << " " << error[1][1] << " " << error[1][2];
}

}  // namespace
}  // namespace sim
