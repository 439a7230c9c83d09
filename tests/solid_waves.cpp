// Waves in a bar that is held at its sides: the speed of sound, and what a grid makes of it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

constexpr double kCell = 0.05, kYoung = 1e5, kPoisson = 0.3, kDensity = 1000;

double sound() {
  const double lambda = kYoung * kPoisson / ((1 + kPoisson) * (1 - 2 * kPoisson)), mu = kYoung / (2 * (1 + kPoisson));
  return std::sqrt((lambda + 2 * mu) / kDensity);
}

struct Bar {
  int cells = 32;                      // of one wavelength: the length of the bar, whose ends are one
  std::string transfer = "polypic";
  Seeding seeding = Seeding::regular;
  std::int64_t particles_per_cell = 4;
};

/// One column of a state.
template <class Value>
std::vector<Value> column(const State& state, const std::string& name) {
  std::vector<Value> values;
  for (const Column& c : state.columns)
    if (c.name == name) read_column<Value>(state, name, c.rows, c.width, values);
  return values;
}

/// Speed of a standing wave, v = sin(k x) at t = 0 and no strain, over the speed of sound: half periods from the first to the fourth zero of the
/// velocity's part in sin(k x). (The first zero itself is off by half a step: velocity and strain are half a step apart.)
double wave_speed(const Bar& bar) {
  Scene scene = open_scene(2, 1, kCell);
  const double length = bar.cells * kCell, k = 2 * M_PI / length, period = length / sound();
  scene.options.domain.upper = base::Vec3(length, 8 * kCell, 0);
  scene.options.seeding = bar.seeding;
  scene.options.particles_per_cell = bar.particles_per_cell;
  set_transfer(scene.options, bar.transfer);
  scene.bodies = {
      block({0, 0, 0}, {length, 8 * kCell, 0}, {.model = Elasticity::fixed_corotated, .density = kDensity, .young = kYoung, .poisson = kPoisson})};
  constexpr int kFrames = 200;         // in a period
  const auto simulation = make_simulation(scene, kFrames / period);
  const auto sines = [&](const State& state) {
    const auto cell = column<std::int32_t>(state, "cell");
    const auto offset = column<double>(state, "offset");
    std::vector<double> sine(cell.size() / 2);
    for (std::size_t p = 0; p < sine.size(); ++p) sine[p] = std::sin(k * kCell * (cell[2 * p] + offset[2 * p]));
    return sine;
  };
  State state = simulation->state();
  auto coefficients = column<double>(state, "coefficients");
  const auto start = sines(state);
  const std::size_t row = coefficients.size() / start.size();
  for (std::size_t p = 0; p < start.size(); ++p) coefficients[p * row] = 1e-4 * sound() * start[p];
  for (Column& c : state.columns)
    if (c.name == "coefficients") std::memcpy(c.bytes.data(), coefficients.data(), c.bytes.size());
  simulation->restore(state);
  const auto share = [&] {
    const State now = simulation->state();
    const auto sine = sines(now);
    const auto v = column<double>(now, "coefficients");
    double sum = 0;
    for (std::size_t p = 0; p < sine.size(); ++p) sum += v[p * row] * sine[p];
    return sum;
  };
  base::Ledger ledger;
  std::vector<double> zeros;
  double before = share();
  for (int f = 1; f < 3 * kFrames && zeros.size() < 4; ++f) {
    simulation->advance(ledger, {});
    const double now = share();
    if (now * before < 0) zeros.push_back(f - 1 + before / (before - now));
    before = now;
  }
  return zeros.size() < 4 ? 0 : 1.5 * kFrames / (zeros[3] - zeros[0]);
}

/// The same of the equations on the grid, two particles a cell at its quarters: the strain rate of exp(i k x) at a quarter is a sum over three
/// nodes of the kernel's slopes there, the force its transpose, and the nodes' masses are equal.
double speed_on_the_grid(int cells) {
  const double k = 2 * M_PI / cells, real = 0.5 * std::cos(k) - 0.5, imaginary = std::sin(k);   // -1/4 e^-ik - 1/2 + 3/4 e^ik
  return std::hypot(real, imaginary) / k;
}

}  // namespace

// Waves of few cells are slow as any grid makes them, by how much is known, and they converge to the speed of sound with the square of the cell.
TEST(SolidWaves, TravelWithTheDispersionOfTheGrid) {
  std::vector<double> slow;
  for (const int cells : {8, 16, 32}) {
    const double measured = wave_speed({.cells = cells});
    EXPECT_NEAR(measured, speed_on_the_grid(cells), 5e-4) << cells;
    slow.push_back(1 - measured);
    EXPECT_NEAR(wave_speed({.cells = cells, .transfer = "apic"}), speed_on_the_grid(cells), cells == 8 ? 1e-2 : 2e-3)
        << cells;   // its losses shift the phase
  }
  EXPECT_GT(slow[0], 0.05);
  EXPECT_LT(slow[2], 0.006);
  EXPECT_GT(std::log2(slow[0] / slow[2]) / 2, 1.9);
}

// Jittered particles integrate forces with noise: nodes have unequal masses, and a bar of unequal links is softer than their mean. A longer wave does
// not cure that, more particles a cell do.
TEST(SolidWaves, JitterSlowsThemByItsQuadrature) {
  const double four = wave_speed({.seeding = Seeding::jitter}), sixteen = wave_speed({.seeding = Seeding::jitter, .particles_per_cell = 16});
  const double on_grid = speed_on_the_grid(32);
  EXPECT_NEAR(four, on_grid, 0.02);
  EXPECT_LT(four, on_grid - 0.005);
  EXPECT_NEAR(sixteen, on_grid, 0.01);
  EXPECT_GT(sixteen, four);
  std::printf("jitter, 32 cells a wave: %.4f with 4 a cell, %.4f with 16; on the grid %.4f\n", four, sixteen, on_grid);
}
