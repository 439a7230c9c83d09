#pragma once
// Particles <-> grid, for grids of any layout: `Layout` says on how many lattices the velocity lives (mac_transfer.h: each component on
// faces of its own; node_transfer.h: all on the nodes), and what its fields look like. Masses are in units of a particle's mass.
#include <cstdint>
#include <functional>
#include <vector>

#include "sim/scene.h"
#include "sim/transfer/blocks.h"
#include "sim/transfer/lanes.h"
#include "sim/transfer/modes.h"
#include "sim/transfer/order.h"
#include "sim/transfer/tensor.h"

namespace sim {

/// Up to this mass, in units of a particle's, a face's or node's velocity is not defined: it is invalid and has velocity 0.
inline constexpr double kLightestNode = 1e-28;

/// Carry::hybrid limits beside faces and nodes lighter than this, in units of a particle's mass. Anything from .001 to .1 does.
inline constexpr double kLightNode = 0.05;

/// How an updated grid velocity becomes the particles': FLIP keeps `keep` of what a particle had and adds the change.
struct GatherRule {
  bool flip = false;
  double keep = 0;   // [1] exp(-dt / flip_time)
};

/// Where particles stood when they gathered, in the order they are stored; kept only for a carry that limits.
template <int D, class Real>
struct Departure {
  std::vector<Cell<D>> cell;
  std::vector<Vec<D, Real>> offset;
};

/// fast: by vectors where lanes.h has a path for the set, plain elsewhere. plain: node by node, the reference.
enum class Path { fast, plain };

/// The transfer of one scheme: mode set and kernel. Stateless between calls. Fields live on `blocks`, which must hold the stencils of all
/// particles (ActiveBlocks::cover with a depth of two or more); what a stencil reads where no block is active is 0.
template <class Layout>
class GridTransfer {
 public:
  static constexpr int D = Layout::kDimension;
  using Real = typename Layout::Real;
  using Field = typename Layout::Field;   // velocity
  using Mass = typename Layout::Mass;
  using Grid = typename Layout::Grid;     // both, and the count of invalid places

  GridTransfer(Kernel kernel, std::vector<ModeIndex<D>> modes, Path path = Path::fast);
  /// How particles must be sorted for the fast path; sorted otherwise they take the plain one.
  Home home() const { return Layout::kLattices == 1 && kernel_ == Kernel::quadratic ? Home::nearest_node : Home::cell; }
  bool is_fast() const { return kernels_.scatter != nullptr; }
  /// What NearField's fast path calls; null: there is none.
  lanes::Interpolate interpolation() const { return interpolation_; }

  /// P2G: masses and velocities from particles in canonical order. Each block sums its particles in an array of its own; the blocks'
  /// arrays are added colour by colour: sums keep one order.
  void scatter(const Particles<D, Real>&, const CellRanges&, const ActiveBlocks<D>& blocks, Grid&) const;
  /// G2P: coefficients from grid velocities at the particles' places. `before` is the field after P2G, read by FLIP only.
  /// Particles in any order, one at a time.
  void gather(const ActiveBlocks<D>& blocks, const Field& velocity, const Field* before, const GatherRule&, Particles<D, Real>&) const;
  /// The same for particles in canonical order, by the fast path if there is one. `after` (if given) is called with the number of a
  /// block in `ranges.occupied` as soon as its particles are gathered, their data still in the cache. It may change what these particles have, and
  /// nothing else: several blocks are under way.
  using After = std::function<void(std::size_t block)>;
  void gather(const CellRanges&, const ActiveBlocks<D>& blocks, const Field& velocity, const Field* before, const GatherRule&, Particles<D, Real>&,
              const After& after = {}) const;
  /// After motion, push-out and corrections: scales coefficients of modes with a g factor so that no mode's energy grew on the way from
  /// `from` (Carry::limited), or only where the stencil at `from` has a node lighter than kLightNode in `mass`, that step's (Carry::hybrid).
  /// Quadratic kernel only: a scene with another carry than fixed is refused otherwise. Returns how many coefficients it scaled. `ranges` are of
  /// the places in `from`, in the order in which particles still lie; with empty ranges they may lie in any, and it takes longer.
  std::int64_t limit(const CellRanges& ranges, const ActiveBlocks<D>& blocks, const Departure<D, Real>& from, const Mass& mass, Carry,
                     Particles<D, Real>&) const;
  /// The grid velocity [m/s] at a site inside the domain, interpolated with the kernel.
  Vec<D, Real> velocity_at(const ActiveBlocks<D>& blocks, const Field& velocity, const Site<D, Real>&) const;

  /// Kinetic energy [J], linear momentum [kg m/s] and angular momentum [kg m^2/s] about the domain's lower corner: the polynomial's, all
  /// modes counted. h is the cell size [m].
  struct Sums {
    double kinetic_energy = 0;
    double largest_coefficient = 0;   // [m/s] of particles
    base::Vec3 linear_momentum = base::Vec3::Zero(), angular_momentum = base::Vec3::Zero();
  };
  Sums sums(const Particles<D, Real>&, double h) const;
  /// Of each particle, the energy of its modes above the constant [J/kg].
  std::vector<float> mode_energies(const Particles<D, Real>&) const;
  /// The same sums of the grid, over valid faces or nodes.
  Sums sums(const ActiveBlocks<D>& blocks, const Grid&, double particle_mass, double h) const;

  Kernel kernel() const { return kernel_; }
  const std::vector<ModeIndex<D>>& modes() const { return modes_; }

 private:
  void gather_plainly(const ActiveBlocks<D>&, const Field& velocity, const Field* before, const GatherRule&, std::size_t begin, std::size_t end,
                      Particles<D, Real>&) const;

  Kernel kernel_;
  std::vector<ModeIndex<D>> modes_;
  std::vector<int> place_;   // of each mode in the stencil's tensor
  lanes::Kernels kernels_;   // of the fast path, or null
  lanes::Interpolate interpolation_ = nullptr;   // with it
};

}  // namespace sim
