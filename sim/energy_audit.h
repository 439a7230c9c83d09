#pragma once
// Where the energy of a simulation goes, pass by pass. Energy is that of whatever carries the motion at the moment: of the particles' polynomials
// before a scatter and after a gather, of the grid's velocities with the masses of the particles between them; with it goes the potential energy
// of place and of deformation, which particles have at all times. Every pass gets the difference that it made, so the changes of all passes add up
// to the whole: nothing is missed and nothing is counted twice.
//
// Work that goes from one form into the other is no loss: what gravity gives velocities and takes from places by motion is counted together, as
// "forces"; likewise what stress gives and takes, as "stress". What is left of each is the error of the time step, and of a free fall on periodic
// axes, which have no potential, all of it.
#include <map>
#include <string>
#include <string_view>

namespace sim {

/// [J] by stage: p2g, forces, stress (of solids), pressure, reflect, extrapolate, g2p, volume, advect, source (births, and what sources hold), collide,
/// carry (limiters), plasticity.
using EnergyChanges = std::map<std::string, double, std::less<>>;

class EnergyAudit {
 public:
  struct Energy {
    double kinetic = 0, potential = 0;   // [J]
  };
  /// Where a step begins.
  void begin(const Energy& now) { now_ = now; }
  /// What `stage` has made of it, both forms together.
  void reached(std::string_view stage, const Energy& now) {
    add(stage, now.kinetic - now_.kinetic + now.potential - now_.potential);
    now_ = now;
  }
  /// The same of a pass that works on velocities alone.
  void reached(std::string_view stage, double kinetic) { reached(stage, {kinetic, now_.potential}); }
  /// After motion: what became of velocities is the motion's, what of places is gravity's.
  void moved(const Energy& now) {
    add("advect", now.kinetic - now_.kinetic);
    add("forces", now.potential - now_.potential);
    now_ = now;
  }
  void add(std::string_view stage, double change) {
    const auto found = changes_.find(stage);
    if (found == changes_.end()) changes_.emplace(stage, change);
    else found->second += change;
  }
  const Energy& now() const { return now_; }
  const EnergyChanges& changes() const { return changes_; }
  void clear() { changes_.clear(); }

 private:
  Energy now_;
  EnergyChanges changes_;
};

}  // namespace sim
