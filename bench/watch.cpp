// What the watch of a step costs, against the step: the sums over the grid and over particles that it compares, as passes of their own. In a
// step they ride on passes that read the same data, so this is the most they can be. (What it does once a frame replaces sums that a run
// writes anyway.)
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>

#include "base/parallel.h"
#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"
#include "sim/solid/seeding.h"
#include "sim/solid/step.h"

namespace bench {
namespace {

using namespace sim;
using Clock = std::chrono::steady_clock;

constexpr double kCell = 0.01;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Cost {
  double step = 0, watch = 0;   // [s] of all iterations
};

void count(benchmark::State& state, const Cost& cost, std::size_t particles) {
  const double scale = 1e9 / double(state.iterations()) / double(particles);
  state.counters["ns_per_particle"] = cost.watch * scale;
  state.counters["step"] = cost.step * scale;
  state.counters["percent_of_step"] = 100 * cost.watch / cost.step;
  state.counters["particles"] = double(particles);
}

struct Sums {
  double mass = 0;
  std::array<double, 3> momentum{};
};
Sums add(Sums a, const Sums& b) {
  a.mass += b.mass;
  for (std::size_t c = 0; c < 3; ++c) a.momentum[c] += b.momentum[c];
  return a;
}

Sums sums_of(const NodeVelocity<3, float>& grid) {
  return base::ordered_reduce(grid.mass.size(), 65536, Sums{}, [&](std::size_t begin, std::size_t end) {
    Sums s;
    for (std::size_t i = begin; i < end; ++i) {
      s.mass += double(grid.mass[i]);
      for (std::size_t c = 0; c < 3; ++c) s.momentum[c] += double(grid.velocity[i][Eigen::Index(c)]);
    }
    return s;
  }, add);
}

/// Of velocities side by side, as G2P leaves those of a block.
double sums_of(const std::vector<float>& velocity) {
  return base::ordered_reduce(velocity.size(), 24 * 512, 0.0, [&](std::size_t begin, std::size_t end) {
    std::array<float, 24> lanes{};
    for (std::size_t k = begin; k + 24 <= end; k += 24)
      for (std::size_t l = 0; l < 24; ++l) lanes[l] += velocity[k + l];
    double sum = 0;
    for (const float x : lanes) sum += double(x);
    return sum;
  }, [](double a, double b) { return a + b; });
}

void solid(benchmark::State& state, Transfer transfer) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  Scene scene;
  Options& o = scene.options;
  o.solver = "solid", o.cell = kCell, o.transfer = transfer, o.kernel = Kernel::quadratic, o.carry = Carry::hybrid;
  for (auto& sides : o.boundary) sides = {Side::separating, Side::separating};
  o.domain = {base::Vec3::Zero(), base::Vec3::Constant(0.66)};
  Body sand;
  sand.name = "sand";
  sand.shape.box = base::Box{base::Vec3::Constant(0.08), base::Vec3(0.58, 0.58, 0.53)};
  sand.solid = preset_material("dry_sand");
  sand.is_solid = true;
  scene.bodies = {sand};
  const Solids<3> solids(scene, Lattice<3>({66, 66, 66}));
  SolidStep<3, float> step(scene, solids);
  auto groups = seed_groups<3, float>(scene, solids);
  base::Ledger ledger;
  const double dt = 1e-4;
  std::vector<float> velocity(3 * groups[0].particles.size(), 1.0f);
  Cost cost;
  const auto advance = [&] {
    const auto start = Clock::now();
    step.scatter(dt, groups, ledger);
    step.update(dt, base::Vec3(0, 0, -9.81), groups, ledger);
    const auto middle = Clock::now();
    benchmark::DoNotOptimize(sums_of(step.grid(0)));
    const double watched = seconds_since(middle);
    const auto later = Clock::now();
    step.gather(dt, 0, groups, ledger);
    cost.step += std::chrono::duration<double>(middle - start).count() + seconds_since(later);
    const auto last = Clock::now();
    benchmark::DoNotOptimize(sums_of(velocity));
    cost.watch += watched + seconds_since(last);
  };
  advance();
  cost = {};
  for (auto _ : state) advance();
  count(state, cost, groups[0].particles.size());
}

void liquid(benchmark::State& state) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  Scene scene;
  Options& o = scene.options;
  o.domain = {base::Vec3::Zero(), base::Vec3::Constant(0.6)};
  o.cell = kCell;
  Body water;
  water.name = "water";
  water.shape.box = base::Box{base::Vec3::Zero(), base::Vec3(0.6, 0.6, 0.3)};
  scene.bodies = {water};
  const Lattice<3> lattice({60, 60, 60});
  const Solids<3> solids(scene, lattice);
  FluidStep<3, float> step(o, solids, true);
  auto particles = seed_particles<3, float>(scene, lattice, solids, int(step.transfer().modes().size()));
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec<3, double> at = 4 * M_PI / 60 * particles.place(p);
    particles.component(p, 0)[0] = float(std::sin(at[0]) * std::cos(at[1])), particles.component(p, 1)[0] = float(-std::cos(at[0]) * std::sin(at[1]));
  }
  base::Ledger ledger;
  Cost cost;
  const auto advance = [&] {
    const auto start = Clock::now();
    step.scatter(particles, kCell, ledger);
    step.project(kCell * base::Vec3(0, 0, -9.81), ledger);
    step.gather({}, particles, ledger);
    step.move(kCell, false, particles, ledger);
    cost.step += seconds_since(start);
    const auto last = Clock::now();
    for (const auto& field : step.velocity())   // of mass and momentum, twice as much is read
      for (int twice = 0; twice < 2; ++twice)
        benchmark::DoNotOptimize(base::ordered_reduce(field.size(), 65536, 0.0, [&](std::size_t begin, std::size_t end) {
          std::array<float, 8> lanes{};
          for (std::size_t i = begin; i + 8 <= end; i += 8)
            for (std::size_t l = 0; l < 8; ++l) lanes[l] += field[i + l];
          double sum = 0;
          for (const float x : lanes) sum += double(x);
          return sum;
        }, [](double a, double b) { return a + b; }));
    cost.watch += seconds_since(last);
  };
  advance();
  cost = {};
  for (auto _ : state) advance();
  count(state, cost, particles.size());
}

const int kRegistered = [] {
  benchmark::RegisterBenchmark("watch/solid_step/900000/apic", [](benchmark::State& s) { solid(s, Transfer::apic); })->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("watch/solid_step/900000/polypic27", [](benchmark::State& s) {
    solid(s, Transfer::polypic);
  })->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("watch/liquid_step/860000/linear/polypic8", liquid)->Unit(benchmark::kMillisecond);
  return 0;
}();

}  // namespace
}  // namespace bench
