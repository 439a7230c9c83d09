// The data of the figure in docs/solids.md: a square, compressed by a tenth along both axes and let go, for every transfer and three lengths of a step
// [PolyPIC fig. 7]. Prints a block a length, which gnuplot's `index` tells apart: time [s], then energy over that of the start by scheme.
#include <cstdio>
#include <cstring>
#include <iterator>

#include "sim/simulation.h"

namespace {

using namespace sim;

struct Scheme {
  const char* name;
  Transfer transfer;
  std::int64_t modes;   // 0: the scheme's own
};
constexpr Scheme kSchemes[] = {{"PIC", Transfer::pic, 0},         {"FLIP", Transfer::flip, 0},       {"APIC", Transfer::apic, 0},
                               {"PolyPIC 4", Transfer::polypic, 4}, {"PolyPIC 6", Transfer::polypic, 6}, {"PolyPIC 9", Transfer::polypic, 0}};
constexpr int kFrames = 80;
constexpr double kFps = 80, kStrain = -0.1;

Scene square(const Scheme& scheme, double sound_cfl) {
  Scene scene;
  Options& o = scene.options;
  o.dimension = 2;
  o.solver = "solid";
  o.domain = {base::Vec3::Zero(), base::Vec3(1, 1, 0)};
  o.cell = 1.0 / 32;
  o.particles_per_cell = 4;
  o.kernel = Kernel::quadratic;
  o.carry = Carry::hybrid;
  o.cfl = 0.4;
  o.sound_cfl = sound_cfl;
  for (auto& sides : o.boundary) sides = {Side::periodic, Side::periodic};
  o.precision = Precision::double_precision;
  o.transfer = scheme.transfer;
  o.modes.count = scheme.modes;
  Body body;
  body.name = "square";
  body.shape.box = base::Box{base::Vec3(0.375, 0.375, 0), base::Vec3(0.625, 0.625, 0)};
  body.solid = {.model = Elasticity::neo_hookean, .density = 1, .young = 200, .poisson = 0.3};
  body.is_solid = true;
  scene.bodies = {body};
  return scene;
}

/// Energy at every frame over that of the first.
std::vector<double> energies(const Scheme& scheme, double sound_cfl) {
  const auto simulation = make_simulation(square(scheme, sound_cfl), kFps);
  State state = simulation->state();
  for (Column& c : state.columns)
    if (c.name == "deformation")
      for (std::int64_t row = 0; row < c.rows; ++row)
        for (const int place : {0, 3}) std::memcpy(c.bytes.data() + sizeof(double) * std::size_t(row * c.width + place), &kStrain, sizeof kStrain);
  simulation->restore(state);
  const auto energy = [&] {
    const Totals t = simulation->totals();
    return t.kinetic_energy + t.elastic_energy.value_or(0);
  };
  const double start = energy();
  std::vector<double> all{1};
  base::Ledger ledger;
  for (int f = 0; f < kFrames; ++f) {
    simulation->advance(ledger, {});
    all.push_back(energy() / start);
  }
  return all;
}

}  // namespace

int main() {
  for (const double fraction : {1.0, 0.25, 0.0625}) {
    std::vector<std::vector<double>> columns;
    for (const Scheme& scheme : kSchemes) columns.push_back(energies(scheme, 0.3 * fraction));
    std::printf("time");
    for (const Scheme& scheme : kSchemes) std::printf(" \"%s\"", scheme.name);
    std::printf("\n");
    for (int f = 0; f <= kFrames; ++f) {
      std::printf("%g", f / kFps);
      for (const auto& column : columns) std::printf(" %.5f", column[std::size_t(f)]);
      std::printf("\n");
    }
    std::printf("\n\n");
  }
}
