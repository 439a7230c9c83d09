#pragma once
// Scenes for the tests of solids.
#include <string>

#include "sim/simulation.h"
#include "sim/verify/scenes.h"

namespace solid_test {

using sim::verify::ball, sim::verify::block, sim::verify::open_scene, sim::verify::walled_scene;

inline void set_transfer(sim::Options& o, const std::string& name) {
  using sim::Transfer;
  o.transfer = name == "pic" ? Transfer::pic : name == "flip" ? Transfer::flip : name == "apic" ? Transfer::apic : Transfer::polypic;
  o.modes = {};
}

/// Advances to time t = (frame - 1) / fps; returns the totals after each frame, the start's first.
inline std::vector<sim::Totals> run(sim::Simulation& simulation, int frames) {
  std::vector<sim::Totals> all{simulation.totals()};
  base::Ledger ledger;
  for (int f = 0; f < frames; ++f) {
    simulation.advance(ledger, {});
    all.push_back(simulation.totals());
  }
  return all;
}

inline double energy(const sim::Totals& t) { return t.energy(); }

inline const sim::Material kJelly{.model = sim::Elasticity::neo_hookean, .density = 1000, .young = 1e5, .poisson = 0.3};

inline base::Vec3 mean_position(const sim::Frame& f) {
  base::Vec3 sum = base::Vec3::Zero();
  for (const auto& x : f.position) sum += x.cast<double>();
  return sum / double(f.position.size());
}

}  // namespace solid_test
