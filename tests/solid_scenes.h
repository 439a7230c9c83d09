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

}  // namespace solid_test
