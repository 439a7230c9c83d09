#pragma once
// What a simulation hands on: the particles of one frame, and the sums that say whether physics was kept.
#include <cstdint>
#include <optional>
#include <vector>

#include "base/vec.h"
#include "sim/energy_audit.h"

namespace sim {

/// Particles at one frame, in ascending id; ids of those that have left are missing. All arrays have the same length.
struct Frame {
  std::int64_t number = 1;            // frames count from 1; frame 1 is t = 0
  double time = 0;                    // [s]
  std::vector<base::Vec3f> position;  // [m] world
  std::vector<base::Vec3f> velocity;  // [m/s]
  std::vector<std::int64_t> id;       // from 0, kept for life
  std::vector<std::uint16_t> body;    // number of the scene's body, from 0; empty: all are of one kind
  std::vector<float> pressure;        // [Pa]; this and what follows: empty unless sim.write asks
  std::vector<float> strain;          // [1] sqrt(2/3) times the norm of the deviator of log U, F = R U the elastic deformation; of solids
  std::vector<float> mode_energy;     // [J/kg] sum of 1/2 c_r^2 D_r over the modes above the constant
  double pscale = 0;                  // [m] radius of a sphere (in 2-D: a disc) with a particle's volume, the same for all
};

/// Conserved quantities and counters of one frame, in SI units. In two dimensions masses, volumes, energies and momenta are those of a
/// slab one metre deep; angular momentum is about z.
struct Totals {
  double time = 0;
  std::int64_t substeps = 0;              // since the frame before
  std::int64_t particles = 0;
  double mass = 0, volume = 0;            // [kg], [m^3]
  double kinetic_energy = 0;              // [J] sum of 1/2 m c_r^2 D_r over particles and modes
  double potential_energy = 0;            // [J] measured from the domain's floor; without the part along periodic axes, which have none
  std::optional<double> elastic_energy;   // [J] stored in deformation; liquids store none
  base::Vec3 linear_momentum = base::Vec3::Zero();    // [kg m/s]
  base::Vec3 angular_momentum = base::Vec3::Zero();   // [kg m^2/s] about the domain's lower corner
  double max_speed = 0;                   // [m/s]
  double max_divergence = 0;              // [1/s] left by the last projection of the frame
  std::uint64_t state_hash = 0;           // of the whole particle state, independent of storage order
  std::int64_t pushed_out = 0;            // particles moved back out of a wall or collider since the frame before
  std::int64_t left = 0;                  // particles gone through an open side since the frame before
  std::int64_t poured = 0;                // particles that sources gave, since the frame before
  std::int64_t dropped_modes = 0;         // particles pushed so far that they lost the modes that bend, since the frame before
  std::int64_t limited_modes = 0;         // coefficients scaled down by a carry that limits, since the frame before
  std::int64_t light_faces = 0;           // faces reached by particles but too light to have a velocity, since the frame before
  std::int64_t pressure_iterations = 0;   // since the frame before
  std::int64_t pressure_fallbacks = 0;    // solves that went on with incomplete Cholesky, since the frame before
  std::int64_t splitting_fallbacks = 0;   // steps that did not reflect because the energy rose, since the frame before
  std::optional<double> imbalance;        // [1/s] largest mean outflow that no pressure of a pocket without air could balance, since the frame before
  EnergyChanges energy_changes = {};      // [J] by stage, since the frame before; empty unless sim.audit
  std::optional<double> volume_drift;     // [1] volume by the liquid's surface over `volume`, less 1, at the frame's last step
  std::int64_t retries = 0;               // times that the watch had the frame done again
  double collider_work = 0;               // [J] what moving colliders, and what sources pour, did since the frame before
  double poured_energy = 0;               // [J] kinetic and potential, of what sources gave, since the frame before
  double gravity_work = 0;                // [J] what gravity did along periodic axes, where no potential energy stands for it, since the frame before
  double largest_coefficient = 0;         // [m/s] of any particle and mode
  double largest_cfl = 0;                 // [cells] the longest way of a particle in a step, since the frame before
  std::int64_t steps_by_impact = 0;       // steps of a liquid cut because the pressure made it faster than expected, since the frame before
  // Of solids, since the frame before:
  std::optional<double> least_volume, most_volume;   // [1] smallest and largest elastic volume ratio J, at the last step
  std::int64_t held_strains = 0;          // particle steps in which a law met the end of its range
  std::int64_t steps_by_sound = 0, steps_by_loose = 0, steps_by_motion = 0;   // what set the length of steps; the rest ended the frame
  double shortest_step = 0;               // [s]

  /// [J] of all kinds.
  double energy() const { return kinetic_energy + potential_energy + elastic_energy.value_or(0); }
};

}  // namespace sim
