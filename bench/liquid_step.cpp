// A whole step of the liquid: a basin of 1.85 million particles that sloshes under a free surface, quadratic kernel.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <chrono>

#include "sim/fluid/seeding.h"
#include "sim/fluid/step.h"

namespace bench {
namespace {

using namespace sim;

constexpr int kEdge = 76, kDepth = 40;             // cells: 76 x 76 x 40 hold liquid, 8 particles each
constexpr double kCell = 0.01, kCfl = 0.5;

Scene basin(Transfer transfer, Kernel kernel) {
  Scene scene;
  Options& o = scene.options;
  o.domain = {base::Vec3::Zero(), base::Vec3::Constant(kEdge * kCell)};
  o.cell = kCell;
  o.transfer = transfer;
  o.kernel = kernel;
  o.cfl = kCfl;
  Body water;
  water.name = "water";
  water.shape.box = base::Box{base::Vec3::Zero(), base::Vec3(kEdge * kCell, kEdge * kCell, kDepth * kCell)};
  scene.bodies = {water};
  return scene;
}

/// Vortices about the vertical, without divergence.
void stir(Particles<3, float>& particles) {
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec<3, double> at = 4 * M_PI / kEdge * particles.place(p);
    particles.component(p, 0)[0] = float(std::sin(at[0]) * std::cos(at[1]));
    particles.component(p, 1)[0] = float(-std::cos(at[0]) * std::sin(at[1]));
  }
}

void run(benchmark::State& state, Transfer transfer, Kernel kernel) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
  const Scene scene = basin(transfer, kernel);
  const Lattice<3> lattice({kEdge, kEdge, kEdge});
  const Solids<3> solids(scene, lattice);
  FluidStep<3, float> step(scene.options, solids, true);
  auto particles = seed_particles<3, float>(scene, lattice, solids, int(step.transfer().modes().size()));
  stir(particles);
  const double dt = kCfl * kCell;                  // the flow's greatest speed is 1 m/s
  base::Ledger ledger;
  double iterations = 0;
  const auto advance = [&] {
    step.scatter(particles, ledger);
    step.project(dt, base::Vec3(0, 0, -9.81), ledger);
    step.gather({}, particles, ledger);
    step.move(dt, particles, ledger);
    iterations += double(step.counts().pressure_iterations);
    step.clear_counts();
  };
  advance();
  ledger = {};
  iterations = 0;
  double total = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    advance();
    total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  const double scale = 1e9 / double(state.iterations()) / double(particles.size());
  state.counters["ns_per_particle"] = total * scale;
  state.counters["particles"] = double(particles.size());
  state.counters["pressure_iterations"] = iterations / double(state.iterations());
  for (const auto& [name, cost] : ledger.passes()) state.counters[name] = cost.seconds * scale;   // [ns a particle]
}

const int kRegistered = [] {
  const auto add = [](const char* name, Transfer transfer, Kernel kernel) {
    const auto one = [=](benchmark::State& state) { run(state, transfer, kernel); };
    benchmark::RegisterBenchmark(name, one)->Unit(benchmark::kMillisecond);
  };
  add("liquid_step/1850000/apic", Transfer::apic, Kernel::quadratic);
  add("liquid_step/1850000/polypic27", Transfer::polypic, Kernel::quadratic);
  add("liquid_step/1850000/linear/polypic8", Transfer::polypic, Kernel::linear);
  return 0;
}();

}  // namespace
}  // namespace bench
