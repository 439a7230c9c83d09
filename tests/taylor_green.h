#pragma once
// Taylor-Green vortices in two dimensions (sim/problems/carried_flow.h): what schemes and splittings lose, or gain, of a flow that does neither.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/problems/carried_flow.h"

namespace sim::taylor_green {

constexpr int kCells = 64;
constexpr double kCell = 1.0 / kCells, kSpeed = 1 / (2 * M_PI);   // [m], [m/s] of the vortices

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
  std::array<double, 2> mean{};         // [1] a flow that carries them along, over their speed
};

inline Scene vortices(const Scheme& scheme, const Course& course) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = 2;
  o.domain = {base::Vec3::Zero(), base::Vec3(1, 1, 0)};
  o.cell = kCell;
  o.boundary = {std::array{Side::periodic, Side::periodic}, std::array{Side::periodic, Side::periodic}};
  o.particles_per_cell = course.particles_per_cell;
  o.transfer = scheme.transfer, o.kernel = scheme.kernel, o.modes.count = scheme.modes, o.carry = course.carry;
  o.splitting = course.splitting;
  o.cfl = course.step_cells;
  o.pressure_tolerance = 1e-8;
  o.precision = Precision::double_precision;
  o.volume_correction = 0;
  o.flip_time = 49.75 * kCell / kSpeed / (course.splitting == Splitting::reflection ? 2 : 1);   // keeps 0.99 each time it gathers
  Body all;
  all.name = "all";
  all.shape.box = o.domain;
  scene.bodies = {all};
  return scene;
}

struct Decay {
  double energy = 1;    // relative, without the mean flow
  double error = 0;     // relative, of the field against the exact one
  double largest = 1;   // energy so far
};

/// After the first step that ends at or after each of `times`.
inline std::vector<Decay> decay(const Scheme& scheme, int waves, const std::vector<double>& times, const Course& course = {}) {
  const base::Vec3 mean = kSpeed * base::Vec3(course.mean[0], course.mean[1], 0);
  KnownFlow<2, double> flow(vortices(scheme, course), taylor_green_velocity<2>(waves, 1, mean), kSpeed);
  const double whole = flow.squares(mean.head<2>());
  EXPECT_GT(whole, 1000 * kSpeed * kSpeed);
  base::Ledger ledger;
  std::vector<Decay> found;
  Decay now;
  for (const double until : times) {
    while (flow.time() < until) {
      flow.step(course.step_cells * kCell / kSpeed, ledger);
      now.energy = flow.squares(mean.head<2>()) / whole;
      now.largest = std::max(now.largest, now.energy);
    }
    EXPECT_LT(flow.grid().counts().max_divergence, 1e-6);
    now.error = std::sqrt(flow.squares_of_error() / whole);
    found.push_back(now);
  }
  return found;
}

}  // namespace sim::taylor_green
