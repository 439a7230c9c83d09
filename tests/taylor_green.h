#pragma once
// Taylor-Green vortices in two dimensions, with the program's own step: what schemes and splittings lose, or gain, of a flow that does neither.
//
// [0, 2 pi]^2, periodic, u = sin kx cos ky, v = -cos kx sin ky, 64 x 64 cells, stratified jitter; particles start with what one G2P of that
// field gives them. A step moves them a part of a cell at the greatest speed in the last projected field, then scatters, projects, gathers. With
// reflection it is two of half its length; after the first the particles get the field mirrored at the projected one, while the projected one
// moves them. The flow is steady: exact energy 1.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"

namespace sim::taylor_green {

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

struct Course {
  Splitting splitting = Splitting::lie;
  double step_cells = 0.5;              // that the greatest speed of the vortices crosses in a step
  Carry carry = Carry::fixed;
  int particles_per_cell = 4;
  std::array<double, 2> mean{};         // [m/s] a flow that carries them along
};

inline Scene vortices(const Scheme& scheme, const Course& course) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = 2;
  o.domain = {base::Vec3::Zero(), base::Vec3(2 * M_PI, 2 * M_PI, 0)};
  o.cell = kCell;
  o.boundary = {std::array{Side::periodic, Side::periodic}, std::array{Side::periodic, Side::periodic}};
  o.particles_per_cell = course.particles_per_cell;
  o.transfer = scheme.transfer, o.kernel = scheme.kernel, o.modes.count = scheme.modes, o.carry = course.carry;
  o.splitting = course.splitting;
  o.pressure_tolerance = 1e-8;
  o.volume_correction = 0;
  Body all;
  all.name = "all";
  all.shape.box = o.domain;
  scene.bodies = {all};
  return scene;
}

/// k waves along each axis, on a mean flow.
inline FaceField<2, double> exact_field(const ActiveBlocks<2>& blocks, int k, const std::array<double, 2>& mean) {
  FaceField<2, double> field;
  for (auto& component : field) component.resize(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Cell<2> at = blocks.cell_at(i);
    const auto angle = [&](int a, double shift) { return k * kCell * (at[std::size_t(a)] + shift); };
    field[0][i] = mean[0] + std::sin(angle(0, 0)) * std::cos(angle(1, 0.5));
    field[1][i] = mean[1] - std::cos(angle(0, 0.5)) * std::sin(angle(1, 0));
  }
  return field;
}

struct Decay {
  double energy = 1;    // relative, without the mean flow
  double error = 0;     // relative, of the field against the one at the start: where nothing carries the vortices along
  double largest = 1;   // energy so far
};

/// After the first step that ends at or after each of `times`.
inline std::vector<Decay> decay(const Scheme& scheme, int k, const std::vector<double>& times, const Course& course = {}) {
  const Scene scene = vortices(scheme, course);
  const Lattice<2> lattice({kCells, kCells}, {true, true});
  const Solids<2> solids(scene, lattice);
  FluidStep<2, double> step(scene.options, solids, /*free_surface=*/false);
  auto particles = seed_particles<2, double>(scene, lattice, solids, int(step.transfer().modes().size()));
  base::Ledger ledger;
  const FaceField<2, double> start = exact_field(step.blocks(), k, course.mean);
  const auto squares = [&](const FaceField<2, double>* less) {   // of the field, without the mean flow
    double sum = 0;
    for (std::size_t c = 0; c < 2; ++c)
      for (std::size_t i = 0; i < start[c].size(); ++i) sum += std::pow(step.velocity()[c][i] - (less ? (*less)[c][i] : course.mean[c]), 2);
    return sum;
  };
  step.set_velocity(ActiveBlocks<2>(step.blocks()), start);
  const double whole = squares(nullptr);
  EXPECT_GT(whole, 1000);
  step.gather({}, particles, ledger);
  const GatherRule rule{scheme.transfer == Transfer::flip, 0.99};
  const auto part = [&](double length, bool mirror) {
    step.move(length, particles, ledger);
    step.scatter(particles, ledger);
    step.project(length, base::Vec3::Zero(), ledger);
    if (mirror) step.gather_reflected(rule, particles, ledger);
    else step.gather(rule, particles, ledger);
  };
  const double dt = course.step_cells * kCell;
  std::vector<Decay> found;
  Decay now;
  double t = 0;
  for (const double until : times) {
    for (; t < until; t += dt) {
      if (course.splitting == Splitting::reflection) part(dt / 2, true), part(dt / 2, false);
      else part(dt, false);
      now.energy = squares(nullptr) / whole;
      now.largest = std::max(now.largest, now.energy);
    }
    EXPECT_LT(step.counts().max_divergence, 1e-6);
    now.error = std::sqrt(squares(&start) / whole);
    found.push_back(now);
  }
  return found;
}

}  // namespace sim::taylor_green
