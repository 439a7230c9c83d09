#pragma once
// The particles of one body: what moves, in canonical order, and what it is made of. All groups of a scene share one lattice; each has its own law,
// mode set and carry.
#include <array>
#include <cstdint>
#include <vector>

#include "sim/solid/model.h"
#include "sim/transfer/lanes.h"
#include "sim/transfer/node_transfer.h"

namespace sim {

/// Kirchhoff stress [Pa], the upper triangle row by row: xx xy (xz) yy (yz zz).
template <int D, class Real>
using Stress = std::array<Real, std::size_t(D * (D + 1) / 2)>;

/// Place of element (i, k) in a Stress.
template <int D>
constexpr std::size_t stress_place(int i, int k) {
  const int row = i < k ? i : k, column = i < k ? k : i;
  return std::size_t(row * D - row * (row - 1) / 2 + column - row);
}

/// Which modes a group's particles carry and how they reach the next step.
template <int D>
struct Scheme {
  std::vector<ModeIndex<D>> modes;
  std::vector<int> place;          // of each mode in the stencil's tensor
  std::vector<unsigned> bent;      // axes on which it has a g factor, a bit each
  bool bends = false;              // any of them has
  bool flip = false;
  Carry carry = Carry::hybrid;     // fixed where no mode bends
  bool drops_beside_light = false; // modes that bend are dropped where a node is light; of a frame that is done again

  Scheme() = default;
  explicit Scheme(const Options&);
};

/// Rows of the particles, those of `deformation` and `stress` too: a particle's own number, but between a sort and the next gather what
/// Particles::row_of says. A gather reads the deformation where the last one left it, and writes it in order to `next`.
template <int D, class Real>
struct Group {
  Particles<D, Real> particles;
  CellRanges ranges;
  Scheme<D> scheme;
  Model model;
  lanes::MovingKernels kernels;    // of the transfer, eight particles at a time; null: one at a time
  bool averages = false;           // volume and pressure are the mean of the particles that a node is nearest to
  double density = 1000;           // [kg/m^3] at rest
  double rest_volume = 0;          // [m^3] of each particle
  double weight = 1;               // mass of each particle, in units of the lightest group's
  std::int64_t first_id = 0;       // ids count on from here
  std::vector<Deformation<Real, D>> deformation, next;
  std::vector<Stress<D, Real>> stress, spare_stress;
  std::vector<std::uint32_t> rows; // those of the particles while they gather

  bool is_liquid() const { return std::holds_alternative<Liquid>(model); }
};

}  // namespace sim
