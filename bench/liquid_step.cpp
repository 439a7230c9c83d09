// A whole step of the liquid: a basin that sloshes under a free surface, of 1.85 million particles; and smaller and larger ones, for how cost
// grows. Every fourth step corrects the volume, as the liquid does. And a splash, most of whose cells are near a surface.
#include <benchmark/benchmark.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <chrono>

#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"
#include "sim/simulation.h"

namespace bench {
namespace {

using namespace sim;

constexpr double kCell = 0.01;
constexpr int kCorrectEvery = 4;   // steps: the liquid's own rhythm

/// `edge` x `edge` x `depth` cells hold liquid, 8 particles each.
struct Basin {
  int edge = 76, depth = 40;
};

Scene basin(const Basin& size, Transfer transfer, Kernel kernel, double cfl, Carry carry) {
  Scene scene;
  Options& o = scene.options;
  o.domain = {base::Vec3::Zero(), base::Vec3::Constant(size.edge * kCell)};
  o.cell = kCell;
  o.transfer = transfer;
  o.kernel = kernel;
  o.cfl = cfl;
  o.carry = carry;
  Body water;
  water.name = "water";
  water.shape.box = base::Box{base::Vec3::Zero(), base::Vec3(size.edge * kCell, size.edge * kCell, size.depth * kCell)};
  scene.bodies = {water};
  return scene;
}

std::int64_t peak_kilobytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

/// Vortices about the vertical, without divergence.
void stir(int edge, Particles<3, float>& particles) {
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec<3, double> at = 4 * M_PI / edge * particles.place(p);
    particles.component(p, 0)[0] = float(std::sin(at[0]) * std::cos(at[1]));
    particles.component(p, 1)[0] = float(-std::cos(at[0]) * std::sin(at[1]));
  }
}

void run(benchmark::State& state, const Basin& size, Transfer transfer, Kernel kernel, double cfl, Carry carry) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  const Scene scene = basin(size, transfer, kernel, cfl, carry);
  const Lattice<3> lattice({size.edge, size.edge, size.edge});
  const Solids<3> solids(scene, lattice);
  FluidStep<3, float> step(scene.options, solids, true);
  auto particles = seed_particles<3, float>(scene, lattice, solids, int(step.transfer().modes().size()));
  stir(size.edge, particles);
  const double dt = cfl * kCell;                  // the flow's greatest speed is 1 m/s
  base::Ledger ledger;
  double iterations = 0;
  int steps = 0;
  const auto advance = [&] {
    step.scatter(particles, dt, ledger);
    step.project(dt * base::Vec3(0, 0, -9.81), ledger);
    if (steps++ % kCorrectEvery == 0) step.correct_volume(0.34, 1, ledger);
    step.gather({}, particles, ledger);
    step.move(dt, false, particles, ledger);
    iterations += double(step.counts().pressure_iterations);
    step.clear_counts();
  };
  advance();
  ledger = {};
  iterations = 0, steps = 0;
  double total = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    advance();
    total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  const double scale = 1e9 / double(state.iterations()) / double(particles.size());
  state.counters["ns_per_particle"] = total * scale;
  state.counters["particles"] = double(particles.size());
  // Of the process so far: ask for one size at a time.
  state.counters["peak_bytes_per_particle"] = 1024 * double(peak_kilobytes()) / double(particles.size());
  state.counters["pressure_iterations"] = iterations / double(state.iterations());
  for (const auto& [name, cost] : ledger.passes()) state.counters[name] = cost.seconds * scale;   // [ns a particle]
}

/// A column of water, 252,000 particles, that has broken on a block: an iteration is a frame.
void run_splash(benchmark::State& state) {
  constexpr int kFirstFrame = 20;
  constexpr double kFps = 24, kSplashCell = 0.02;   // [1/s], [m]
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  Scene scene;
  scene.options.domain = {base::Vec3::Zero(), base::Vec3(2, 1, 1.6)};
  scene.options.cell = kSplashCell;
  scene.options.transfer = Transfer::polypic;
  Body column;
  column.name = "column";
  column.shape.box = base::Box{base::Vec3::Zero(), base::Vec3(0.6, 1, 0.42)};
  scene.bodies = {column};
  Collider block;
  block.name = "block";
  block.shape.box = base::Box{base::Vec3(1, 0.32, 0), base::Vec3(1.18, 0.68, 0.16)};
  scene.colliders = {block};
  scene.effects = {Effect{.kind = "gravity", .acceleration = base::Vec3(0, 0, -9.81)}};
  const auto simulation = make_simulation(scene, kFps);
  base::Ledger ledger;
  const auto advance = [&] { simulation->advance(ledger, [] { return false; }); };
  for (int frame = 1; frame < kFirstFrame; ++frame) advance();
  ledger = {};
  double total = 0, steps = 0, particles = 0, iterations = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    advance();
    total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const Totals totals = simulation->totals();
    steps += double(totals.substeps), particles = double(totals.particles), iterations += double(totals.pressure_iterations);
  }
  const double scale = 1e9 / steps / particles;
  state.counters["ns_per_particle"] = total * scale;
  state.counters["particles"] = particles;
  state.counters["pressure_iterations"] = iterations / steps;
  for (const auto& [name, cost] : ledger.passes()) state.counters[name] = cost.seconds * scale;   // [ns a particle]
}

const int kRegistered = [] {
  const auto add = [](const char* name, const Basin& size, Transfer transfer, Kernel kernel, double cfl,
                      Carry carry = Carry::fixed) {
    const auto one = [=](benchmark::State& state) { run(state, size, transfer, kernel, cfl, carry); };
    benchmark::RegisterBenchmark(name, one)->Unit(benchmark::kMillisecond)->Iterations(2 * kCorrectEvery);
  };
  add("liquid_step/1850000/apic", {}, Transfer::apic, Kernel::quadratic, 0.5);
  add("liquid_step/1850000/polypic27", {}, Transfer::polypic, Kernel::quadratic, 0.5);
  add("liquid_step/1850000/polypic27/hybrid", {}, Transfer::polypic, Kernel::quadratic, 0.5, Carry::hybrid);
  add("liquid_step/1850000/linear/apic", {}, Transfer::apic, Kernel::linear, 1);
  add("liquid_step/1850000/linear/polypic8", {}, Transfer::polypic, Kernel::linear, 1);
  add("liquid_step/200000/linear/polypic8", {36, 19}, Transfer::polypic, Kernel::linear, 1);
  add("liquid_step/8000000/linear/polypic8", {124, 65}, Transfer::polypic, Kernel::linear, 1);
  benchmark::RegisterBenchmark("liquid_step/splash", run_splash)->Unit(benchmark::kMillisecond)->Iterations(6);
  return 0;
}();

}  // namespace
}  // namespace bench
