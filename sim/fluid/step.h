#pragma once
// One step of an incompressible fluid, pass by pass: particles -> grid, forces and projection, grid -> particles, motion.
//
//   step.scatter(particles, dt, ledger);              sort, P2G, which cells are liquid
//   step.project(dt * g, ledger);                     v* = v + dt g, then without divergence; again with another dt if it must be
//   step.gather(rule, particles, ledger);             G2P
//   step.move(dt, particles, ledger);                 motion, sources, contact, carry
//
// Whoever wants motion first (the field of the last projection moves the particles) begins with `move`.
#include <cstdint>
#include <optional>
#include <vector>

#include "base/ledger.h"
#include "sim/energy_audit.h"
#include "sim/fluid/advect.h"
#include "sim/fluid/pressure.h"
#include "sim/transfer/mac_transfer.h"

namespace sim {

/// What steps have counted since they were asked last.
struct StepCounts {
  std::int64_t pushed_out = 0, left = 0, dropped_modes = 0, limited_modes = 0, light_faces = 0, pressure_iterations = 0, pressure_fallbacks = 0;   // as in Totals
  std::optional<double> imbalance;    // likewise
  double max_divergence = 0;          // [1/s] left by the last projection
};

/// Over all faces, an axis each: masses [particles] and momenta [particles m/s].
struct FaceSums {
  base::Vec3 mass = base::Vec3::Zero(), momentum = base::Vec3::Zero();
};

template <int D, class Real>
class FluidStep {
 public:
  /// Without a free surface every cell that is not solid is liquid, whether a particle is in it or not. `solids` must outlive the step; where
  /// they are is asked in `scatter`, and again in `move`, when they should be where that motion ends. So must `sources`, where there are any; what
  /// is in one at `scatter` moves with its velocity.
  FluidStep(const Options&, const Solids<D>& solids, bool free_surface, const Sources<D>* sources = nullptr);

  /// `dt` [s] is how long the step will be, or the part of it that begins here: how far thin liquid flies that a solid stops.
  void scatter(Particles<D, Real>&, double dt, base::Ledger&);
  /// `push` [m/s] is what forces add to the velocity of the whole fluid. Returns the speed of the fastest face component [m/s]. Starts from what
  /// `scatter` left, so it may be called again.
  double project(const base::Vec3& push, base::Ledger&);
  void gather(const GatherRule&, Particles<D, Real>&, base::Ledger&);
  /// G2P of the field of `scatter` reflected at the projected one, 2 v - v*, while the projected field stays to move the particles [Zehnder18].
  void gather_reflected(const GatherRule&, Particles<D, Real>&, base::Ledger&);
  /// Motion: whoever is then outside an open side is gone. Before it the particles shift by the displacement that `correct_volume` found, where it
  /// did since `scatter`, which changes their places but not the flow: in `gather`, or here where an audit is to see it apart. Returns the longest way
  /// that the motion took a particle [cells].
  /// The field is the last projection's; in a step that `reflects`, where the one before is known (`past`), that of the motion's middle as far as the two
  /// tell, v + dt / 2 (v - v_before) / dt_before: of second order in flow that changes, too.
  double move(double dt, bool reflects, Particles<D, Real>&, base::Ledger&);

  /// What the last motion leaves to the next; of a splitting that reflects, without a free surface.
  struct Past {
    FaceField<D, Real> velocity;       // of the last projection, before that motion; empty where there is none
    double motion = 0;                 // [s] how long it was; 0: none
  };
  Past& past() { return past_; }
  const Past& past() const { return past_; }
  /// Whether motions leave anything.
  bool has_past() const { return options_.splitting == Splitting::reflection && !free_surface_; }
  /// What the liquid fills, by its surface at the last `scatter` [cells].
  LiquidVolume volume() const { return liquid_volume<D>(cells_, filling_, blocks_); }
  /// A displacement that takes back `gain` [1] of how much denser, or thinner, the liquid's inside is than `aim` times as it was seeded.
  void correct_volume(double gain, double aim, base::Ledger&);

  /// Mean pressure [Pa] over the last step, dt [s] long and with a reflected half or not, at the particles, where they are now; sim.write.pressure
  /// must be asked for. 0 before the first.
  std::vector<float> pressure_at(const Particles<D, Real>&, double dt, bool reflected) const;

  /// What the shift of the last `correct_volume` did on the liquid, by its weight and its velocities [J], per particle's mass.
  double shift_work() const;
  /// What sources did in the last `move` on what they hold, which they carry up and set in motion [J], per particle's mass.
  double source_work() const { return source_work_; }
  /// What moving solids did on the liquid in the last projection [J], per mass of a cell full of liquid.
  double solid_work() const { return solid_work_; }

  /// The field of the last projection [m/s], on `blocks`; after `gather` reaching into the air.
  const FaceField<D, Real>& velocity() const { return grid_.velocity; }
  const ActiveBlocks<D>& blocks() const { return blocks_; }
  /// Begins with a field that is known, valid everywhere on `blocks`.
  void set_velocity(const ActiveBlocks<D>& blocks, FaceField<D, Real> field);
  const MacTransfer<D, Real>& transfer() const { return transfer_; }
  /// What the last `scatter` left on the faces.
  const FaceSums& scattered_sums() const { return scattered_sums_; }
  /// So many times as dense as it was seeded these particles are, on the average of the blocks that hold any.
  double crowding(std::size_t particles) const {
    const double room = double(ranges_.occupied.size()) * Lattice<D>::kCellsPerBlock * double(options_.particles_per_cell);
    return room > 0 ? double(particles) / room : 1;
  }
  const StepCounts& counts() const { return counts_; }
  StepCounts& counts() { return counts_; }   // to go back to what they were
  /// Where the energy went since the counts were cleared; empty unless options say audit.
  const EnergyAudit& audit() const { return audit_; }
  EnergyAudit& audit() { return audit_; }
  /// Begins an audit that does not see the motion of all with `moving` [m/s].
  void audit_in_frame(const base::Vec3& moving, const Particles<D, Real>&);
  /// [m/s^2] gravity that places are measured by: only along axes that have a floor.
  void falls(const base::Vec3& down) { down_ = down; }
  void clear_counts() { counts_ = {}, audit_.clear(); }
  bool has_surface() const { return free_surface_; }

 private:
  /// Cells that a particle may cross in a step, rounded up, and a margin for the kernel: how deep the field must reach into the air.
  int layers() const;
  /// What a pass made of the energy, where it is asked for: of the particles, or of `velocity` with the masses that particles gave the faces.
  void audit(std::string_view stage, const Particles<D, Real>&, base::Ledger&);
  void audit(std::string_view stage, const FaceField<D, Real>& velocity, base::Ledger&);
  EnergyAudit::Energy energy(const Particles<D, Real>&) const;
  /// [J] of what has these sums and the particles' mass.
  double audited_energy(const typename MacTransfer<D, Real>::Sums&) const;
  /// Keeps where the particles are, which the carry asks for after the motion.
  void depart(const Particles<D, Real>&, base::Ledger&);
  /// For a gather: the shift of a volume correction, while the rows of a block's particles are in the cache. Nothing where there is none, or where
  /// an audit is to see it apart.
  typename MacTransfer<D, Real>::After shift_after(Particles<D, Real>&, base::Ledger&);
  /// Keeps where the particles are that sources hold.
  void find_held(const Particles<D, Real>&, base::Ledger&);
  /// Faces through which a source's medium comes in out of the air get its velocity: nobody is drawn in there, and what flies along the source is not
  /// braked.
  void open_inflow();
  /// Makes the past field that of the middle of a motion of dt [s]; false where its change may not go on that long.
  bool foresee(double dt);
  /// Moves them as their source does, and out of sources who has come into one.
  void move_held(double dt, Particles<D, Real>&, base::Ledger&);
  std::int64_t grid_bytes() const { return std::int64_t(blocks_.size() * D * sizeof(Real)); }

  Options options_;
  const Solids<D>& solids_;
  const Sources<D>* sources_;         // or null
  ActiveBlocks<D> blocks_;            // around the particles as they were at the last `scatter`, as deep as layers(); all without a free surface
  bool free_surface_;
  MacTransfer<D, Real> transfer_;
  CanonicalOrder<D, Real> order_;
  CellRanges ranges_;                 // of the particles as `scatter` sorted them; none once they have moved
  LiquidCells<D> cells_;
  std::vector<float> filling_;        // [1] of every cell
  Projection<D> projection_;
  std::vector<double> pressure_;      // of every cell [cells m/s], over density, times the time it acts; kept where it is to be written
  struct {
    ActiveBlocks<D> blocks;
    std::vector<CellKind> kind;
    std::vector<double> values;
  } mirrored_pressure_;               // likewise, of the last step's first half that reflected
  MacVelocity<D, Real> grid_;
  FaceField<D, Real> scattered_;      // the field after P2G, before forces
  FaceField<D, Real> reflected_;      // 2 v - v*; empty unless the splitting reflects
  Past past_;
  bool pushed_ = false;               // what forces gave before the last projection was more than pressure takes back
  FaceSums scattered_sums_;
  FaceMask<D> valid_;
  Departure<D, Real> departure_;      // empty unless the carry limits
  FaceField<D, Real> displacement_;   // [cells] of the volume correction
  FaceMask<D> displaced_;
  std::vector<Shift<D>> shifted_;     // by it, a block each
  struct Held {
    std::size_t particle;
    Site<D, Real> site;               // at the last `scatter`
    int source;
    double kinetic;                   // [m^2/s^2] of its mean velocity then
  };
  std::vector<Held> held_;            // by sources
  bool displaces_ = false, departed_ = false;   // in this step: a correction was found; the particles have departed
  double solid_work_ = 0, source_work_ = 0;
  StepCounts counts_;
  EnergyAudit audit_, scattered_audit_;         // the second as it was after `scatter`
  double particle_mass_ = 0, mass_ = 0;         // [kg] of one, of all; where there is an audit
  base::Vec3 audited_frame_ = base::Vec3::Zero();   // [m/s]
  base::Vec3 down_ = base::Vec3::Zero();        // [m/s^2]
};

}  // namespace sim
