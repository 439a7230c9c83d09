#pragma once
// One explicit step of elastic and plastic bodies (symplectic Euler, material point method [Sulsky94, PolyPIC S5]), pass by pass:
//
//   step.scatter(dt, groups, ledger);        sort; P2G of mass, momentum and dt times the force -sum V0 tau grad w
//   step.update(dt, acceleration, groups, ledger);   v += dt g on nodes; other bodies, walls and colliders, where particles touch them
//   step.gather(dt, keep, groups, ledger);   G2P; x += dt c_1; F <- (I + dt sum v grad w^T) F, return map, stress; carry
//
// Quadratic kernel. Linear momentum is exact, angular momentum too (c_1 of the grid moves the particle, stress is symmetric). With FLIP, the
// particle moves with what it would have without.
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "base/ledger.h"
#include "sim/colliders/solids.h"
#include "sim/energy_audit.h"
#include "sim/solid/body_contact.h"
#include "sim/solid/contact.h"
#include "sim/solid/energy.h"
#include "sim/solid/group.h"
#include "sim/transfer/place_set.h"

namespace sim {

/// What sets the length of the next step, over all particles.
struct StepLimits {
  double wave_speed = 0;       // [m/s] of the fastest sound in what it was deformed to
  double loose_speed = 0;      // [m/s] the same of particles that are alone or strongly stretched
  double speed = 0;            // [m/s] of the fastest particle
  double least_volume = std::numeric_limits<double>::max(), most_volume = -std::numeric_limits<double>::max();   // [1] J
  base::Vec3 momentum = base::Vec3::Zero();    // [m/s] sum of the particles' velocities; of a whole step [kg m/s]
  void take(const StepLimits& other);
};

/// What steps have counted since they were asked last.
struct SolidCounts {
  std::int64_t pushed_out = 0, dropped_modes = 0, limited_modes = 0, light_nodes = 0, held = 0;   // as in Totals
  void add(const SolidCounts& other);
};

/// A particle that is not finite, or went too far.
struct LostParticle {
  std::size_t group = 0;
  std::int64_t id = -1;
  std::string place;           // its cell and position
};

/// Over all nodes: mass [kg] and momentum [kg m/s].
struct NodeTotals {
  double mass = 0;
  base::Vec3 momentum = base::Vec3::Zero();
};

template <int D, class Real>
class SolidStep {
 public:
  using Groups = std::vector<Group<D, Real>>;

  /// `scene` and `solids` must outlive the step.
  SolidStep(const Scene& scene, const Solids<D>& solids);

  void scatter(double dt, Groups&, base::Ledger&);
  /// Forces and contact with solids, which are where they are at the step's start.
  void update(double dt, const base::Vec3& acceleration, const Groups&, base::Ledger&);
  /// `keep` [1] is FLIP's. Throws LostParticle for one that is not finite or crossed several cells.
  StepLimits gather(double dt, double keep, Groups&, base::Ledger&);

  /// Cell and position of a particle: "cell (3, 4), (0.31, 0.42, 0) m".
  std::string place_of(const Particles<D, Real>&, std::size_t p) const;

  /// The velocities of a field of bodies.
  const NodeVelocity<D, Real>& grid(std::size_t field) const { return grid_[field]; }
  /// What `scatter` left on the nodes, before gravity and contact; after `update`.
  const NodeTotals& scattered() const { return scattered_; }
  /// [J] what colliders that move have done in the last update and gather.
  double collider_work() const { return collider_work_; }
  const SolidCounts& counts() const { return counts_; }
  SolidCounts& counts() { return counts_; }   // to go back to what they were
  /// Where the energy went since the counts were cleared; empty unless the scene says audit.
  const EnergyAudit& audit() const { return audit_; }
  EnergyAudit& audit() { return audit_; }
  void clear_counts() { counts_ = {}, audit_.clear(); }

 private:
  /// The nodes that particles of a field which touch a wall or collider reach.
  PlaceSet<D> find_touched(const Groups&, std::size_t field) const;
  /// Blocks that hold particles of any group, and where each group's are.
  void merge(const Groups&);
  /// Masses, and momenta with the impulse of stress over dt.
  void sum_on_nodes(double dt, const Groups&);
  SolidEnergy energy(const Groups&) const;
  /// [J] of the grid, of velocities or, before they are divided, of momenta.
  double grid_energy(bool divided) const;
  void audit_update(std::string_view stage, base::Ledger&);
  std::int64_t grid_bytes() const { return std::int64_t(grid_.size() * blocks_.size() * (D + 1) * sizeof(Real)); }
  LostParticle lost_particle(const Groups&, std::size_t group, std::int64_t id) const;

  double cell_;
  const Solids<D>& solids_;
  NodeContacts<D> contacts_;
  BodyContacts<D, Real> bodies_;
  bool flip_ = false;
  std::vector<CanonicalOrder<D, Real>> order_;
  CellRanges merged_;                              // of all groups together
  std::vector<std::vector<std::int32_t>> at_;      // of each group: place of each merged block in its own list, -1 when it has none there
  ActiveBlocks<D> blocks_;
  std::vector<NodeVelocity<D, Real>> grid_;        // of each field of bodies_; momentum until it is divided
  std::vector<NodeVelocity<D, Real>> before_;      // the same before forces, of groups with FLIP alone: so their momentum is exact
  double unit_mass_ = 1;                           // [kg] of grid_.mass
  NodeTotals scattered_;
  double collider_work_ = 0;                       // [J]
  SolidCounts counts_;
  bool audits_;
  base::Vec3 down_;                                // [m/s^2] gravity along axes that have a floor
  EnergyAudit audit_;
  SolidEnergy before_step_;                        // of the particles, as they were scattered
};

/// What happens to the energy of particles within a gather [J].
struct GatherAudit {
  double gathered = 0, moved = 0;                      // kinetic: where they were, where they are
  double collided = 0, carried = 0, yielded = 0;       // what push-out, limiters and plasticity changed
  void add(const GatherAudit& o) { gathered += o.gathered, moved += o.moved, collided += o.collided, carried += o.carried, yielded += o.yielded; }
};

/// P2G of the particles of one group in one block, added to the block's own arrays. Units: masses of the lightest group's particle.
template <int D, class Real>
struct NodeSums {
  static constexpr int kEdge = Lattice<D>::kBlock + 3, kSize = D == 2 ? kEdge * kEdge : kEdge * kEdge * kEdge;
  std::array<Real, std::size_t((D + 1) * kSize)> carried{};   // mass and momentum, with forces, of each node
  std::array<Real, std::size_t((D + 1) * kSize)> before{};    // the same without them, of groups with FLIP alone

  /// Adds what the group has in `block`, the `group_block`-th of its own. `impulse` [kg m/s / (Pa unit mass)]: -dt V0 / h, in unit masses.
  void add(const Group<D, Real>&, std::size_t group_block, const Cell<D>& block, const Lattice<D>&, double impulse);

 private:
  /// Particles [begin, end), one at a time: the reference.
  void add_plainly(const Group<D, Real>&, const std::uint32_t* begin, const Cell<D>& block, const Lattice<D>&, double impulse);
};

/// G2P of the particles of one group in one of its blocks, everything that happens to them up to the end of the step.
template <int D, class Real>
class BlockGather {
 public:
  BlockGather(const ActiveBlocks<D>& blocks, const NodeVelocity<D, Real>& grid, const NodeField<D, Real>& before, const Solids<D>& solids, double dt,
              double keep)
      : blocks_(blocks), grid_(grid), before_(before), solids_(solids), dt_(dt), keep_(keep) {}

  void run(Group<D, Real>&, std::size_t block);

  StepLimits limits = {};
  SolidCounts counts = {};
  double collider_work = 0;    // [J] of those that move, on particles that were pushed out
  std::int64_t lost = -1;      // id of a particle that is not finite or went too far
  bool audits = false;         // whether to fill the next
  GatherAudit audit = {};

 private:
  /// What the steps below hand to each other, of particles [begin_, end_): rows of D numbers a particle, and D * D columns of a number.
  enum Flag : std::uint8_t { kLoose = 1, kBesideLight = 2 };   // nobody else of its field reaches its nodes; one of them is light
  std::vector<Real> velocity_;         // of the grid at the particle [m/s]
  std::vector<Real> gradient_;         // of it, row-major: component, axis [m/s a cell]
  std::vector<std::uint8_t> flags_;
  std::vector<Cell<D>> from_cell_;     // where they were
  std::vector<Vec<D, Real>> from_offset_;
  std::size_t begin_ = 0, end_ = 0;

  std::size_t room() const { return end_ - begin_ + lanes::kMotionSlack; }   // numbers of a column
  Real& gradient(std::size_t p, std::size_t number) { return gradient_[number * room() + p - begin_]; }
  Real gradient(std::size_t p, std::size_t number) const { return gradient_[number * room() + p - begin_]; }
  void gather_plainly(Group<D, Real>&);
  void gather_eight_at_a_time(Group<D, Real>&, const Cell<D>& block, const std::uint32_t* begin) requires(D == 3 && std::is_same_v<Real, float>);
  void average_volume(const std::uint32_t* ranges);
  bool may_touch_solids(const Cell<D>& block) const;
  bool move(Group<D, Real>&, bool touches);
  void add_momentum(const Particles<D, Real>&, bool were_pushed);
  /// Whether the particle was pushed.
  bool settle(Group<D, Real>&, std::size_t p, bool touches);
  void settle_all(Group<D, Real>&, bool touches);
  double kinetic_energy(const Group<D, Real>&, std::size_t p) const;
  double kinetic_energy(const Group<D, Real>&) const;   // of all of the block
  double trial_energy(const Group<D, Real>&) const;     // of deformation, as the step's motion alone would leave it
  double elastic_energy_now(const Group<D, Real>&) const;
  template <class Law>
  void deform(const Law&, Group<D, Real>&);

  const ActiveBlocks<D>& blocks_;
  const NodeVelocity<D, Real>& grid_;
  const NodeField<D, Real>& before_;
  const Solids<D>& solids_;
  double dt_, keep_;
};

}  // namespace sim
