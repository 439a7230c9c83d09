// A whole step of a solid: a block of dry sand (Hencky, Drucker-Prager) on a floor that rubs, which vortices stir and gravity presses, quadratic
// kernel. Particles lie in it at random, as mixing leaves them: cells hold 8 on the average, batches of eight are full to 0.7. Steps are as
// long as sound allows.
#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>

#include "sim/random.h"
#include "sim/solid/seeding.h"
#include "sim/solid/step.h"

namespace bench {
namespace {

using namespace sim;

constexpr double kCell = 0.01, kSoundCfl = 0.3, kSpeed = 1;   // [m], [1], [m/s] of the vortices
constexpr int kWarmSteps = 10;

struct Case {
  Cell<3> block;              // cells that hold sand, 8 particles each
  Transfer transfer = Transfer::apic;
  const char* preset = "dry_sand";
  int threads = 2;
};

Scene scene_of(const Case& c) {
  Scene scene;
  Options& o = scene.options;
  o.solver = "solid";
  o.cell = kCell;
  o.transfer = c.transfer;
  o.kernel = Kernel::quadratic;
  o.carry = Carry::hybrid;
  o.wall_friction = 0.6;
  for (auto& sides : o.boundary) sides = {Side::separating, Side::separating};
  const base::Vec3 edges = kCell * base::Vec3(c.block[0], c.block[1], c.block[2]);
  o.domain = {base::Vec3::Zero(), edges + base::Vec3::Constant(16 * kCell)};
  Body sand;
  sand.name = "sand";
  const base::Vec3 corner(8 * kCell, 8 * kCell, 0);
  sand.shape.box = base::Box{corner, corner + edges};
  sand.solid = preset_material(c.preset);
  sand.is_solid = true;
  scene.bodies = {sand};
  return scene;
}

/// Anywhere in the block, and moving in vortices about the vertical.
void stir(const Case& c, Particles<3, float>& particles) {
  for (std::size_t p = 0; p < particles.size(); ++p) {
    for (int a = 0; a < 3; ++a) {
      const double at = (a < 2 ? 8 : 0) + c.block[a] * uniform(1, p, std::uint64_t(a));
      particles.cell[p][a] = int(at);
      particles.offset[p][a] = std::min(float(at - std::floor(at)), 0.999999f);
    }
    const Vec<3, double> turn = 4 * M_PI / c.block[0] * (particles.place(p) - Vec<3, double>(8, 8, 0));
    particles.component(p, 0)[0] = float(kSpeed * std::sin(turn[0]) * std::cos(turn[1]));
    particles.component(p, 1)[0] = float(-kSpeed * std::cos(turn[0]) * std::sin(turn[1]));
  }
}

void run(benchmark::State& state, const Case& c) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(c.threads));
  const Scene scene = scene_of(c);
  const Cell<3> cells{c.block[0] + 16, c.block[1] + 16, c.block[2] + 16};
  const Solids<3> solids(scene, Lattice<3>(cells));
  SolidStep<3, float> step(scene, solids);
  auto groups = seed_groups<3, float>(scene, solids);
  stir(c, groups[0].particles);
  double wave_speed = 20;   // [m/s]
  base::Ledger ledger;
  const auto advance = [&] {
    const double dt = kSoundCfl * kCell / wave_speed;
    step.scatter(dt, groups, ledger);
    step.update(dt, base::Vec3(0, 0, -9.81), groups, ledger);
    const StepLimits limits = step.gather(dt, 0, groups, ledger);
    wave_speed = std::max(limits.wave_speed, limits.loose_speed);
  };
  for (int warm = 0; warm < kWarmSteps; ++warm) advance();
  ledger = {};
  double total = 0;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    advance();
    total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  const auto count = double(groups[0].particles.size());
  const double scale = 1e9 / double(state.iterations()) / count;
  state.counters["ns_per_particle"] = total * scale;
  state.counters["particles"] = count;
  for (const auto& [name, cost] : ledger.passes()) state.counters[name] = cost.seconds * scale;   // [ns a particle]
}

const int kRegistered = [] {
  const auto add = [](const std::string& name, const Case& c) {
    benchmark::RegisterBenchmark(("solid_step/" + name).c_str(), [c](benchmark::State& state) { run(state, c); })->Unit(benchmark::kMillisecond);
  };
  const Cell<3> small{50, 50, 45}, middle{100, 100, 50}, large{100, 100, 100};
  add("900000/drucker_prager/apic", {small});
  add("900000/drucker_prager/polypic27", {small, Transfer::polypic});
  add("900000/neo_hookean/apic", {small, Transfer::apic, "jelly"});
  add("900000/drucker_prager/apic/threads:1", {small, Transfer::apic, "dry_sand", 1});
  add("4000000/drucker_prager/apic", {middle});
  add("4000000/drucker_prager/polypic27", {middle, Transfer::polypic});
  add("8000000/drucker_prager/apic", {large});
  return 0;
}();

}  // namespace
}  // namespace bench
