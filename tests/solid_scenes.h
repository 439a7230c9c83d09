#pragma once
// Scenes for the tests of solids.
#include <string>

#include "sim/simulation.h"

namespace solid_test {

/// A plane or box without gravity and with periodic sides, so that nothing touches a wall.
inline sim::Scene open_scene(int dimension, double edge, double cell) {
  sim::Scene scene;
  sim::Options& o = scene.options;
  o.dimension = dimension;
  o.solver = "solid";
  o.domain = {base::Vec3::Zero(), base::Vec3(edge, edge, dimension == 3 ? edge : 0)};
  o.cell = cell;
  o.particles_per_cell = dimension == 3 ? 8 : 4;
  o.kernel = sim::Kernel::quadratic;
  o.carry = sim::Carry::hybrid;
  o.cfl = 0.4;
  for (auto& sides : o.boundary) sides = {sim::Side::periodic, sim::Side::periodic};
  o.precision = sim::Precision::double_precision;
  return scene;
}

/// The same between separating walls.
inline sim::Scene walled_scene(int dimension, double edge, double cell) {
  sim::Scene scene = open_scene(dimension, edge, cell);
  for (auto& sides : scene.options.boundary) sides = {sim::Side::separating, sim::Side::separating};
  return scene;
}

inline sim::Body ball(const base::Vec3& center, double radius, const sim::Material& material) {
  sim::Body body;
  body.name = "ball";
  body.shape.sphere = {center, radius};
  body.solid = material;
  body.is_solid = true;
  return body;
}

inline sim::Body block(const base::Vec3& lower, const base::Vec3& upper, const sim::Material& material) {
  sim::Body body;
  body.name = "block";
  body.shape.box = {lower, upper};
  body.solid = material;
  body.is_solid = true;
  return body;
}

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

inline double energy(const sim::Totals& t) { return t.kinetic_energy + t.elastic_energy.value_or(0) + t.potential_energy; }

}  // namespace solid_test
