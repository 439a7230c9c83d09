#pragma once
// The fast transfers: a block at a time, on a dense tile of its own. Particles of a cell share the nodes they read and write: P2G keeps a cell's sums
// in registers while its particles pass (scatter_lanes-inl.h), G2P takes eight particles of a cell, a lane each (gather_lanes-inl.h). In 3-D and
// single precision, for the mode sets that have a name: 1, 4 and 8 modes, and with the quadratic kernel 10 (total degree 2) and 27. Everything else
// runs the plain path of grid_transfer_bodies.h, which is the reference.
//
// A sum over lanes stays within four that follow each other, and a multiply is fused with an addition where the source says so: AVX2 and AVX-512 give the
// same bits.
#include <array>
#include <cstddef>
#include <cstdint>

#include "sim/transfer/lattice.h"

namespace sim::lanes {

/// The particles of a block, in canonical order.
struct Block {
  const std::uint32_t* begin = nullptr;   // of the particles of each cell; one more entry at the end
  const float* offset = nullptr;          // of all particles, three each
  const std::uint32_t* row = nullptr;     // of each particle, its row of coefficients; null: its own number
  float* coefficients = nullptr;          // rows of modes, three components each
  bool streams = false;                   // a gather may write rows past the caches: there are more than these hold, and nobody reads them soon
};

/// Of a scatter's tile, behind its fields: whole vectors are added to its nodes.
inline constexpr int kTileSlack = 4;
/// Sets the tile to what the particles bring. On nodes: mass and momentum x, y, z of each of kTile^3. On faces: fields of kTile^3 numbers, three of
/// mass and three of momentum. kTileSlack numbers more may be written.
using Scatter = void (*)(const Block&, float* tile);

/// What a gather reads and writes besides the particles.
struct Gathering {
  const float* tile = nullptr;            // velocity x, y, z, kTile^3 numbers each
  const float* before = nullptr;          // the same of the field before forces: FLIP, else null
  float keep = 0;                         // FLIP's
};
using Gather = void (*)(const Block&, const Gathering&);

/// Stress of a block's particles, six numbers a row (xx xy xz yy yz zz), in the rows of their coefficients.
struct Stresses {
  const float* row = nullptr;
  float factor = 1;                       // momentum, in units of a particle's mass, is factor times stress times the slopes of the weights [1/cell]
};
/// What will be read next of the block's particles: a gather calls for it meanwhile.
struct Wanted {
  const char* rows = nullptr;             // null: nothing
  std::size_t bytes = 0;                  // of a row; at most those of a line
  const std::uint32_t* row = nullptr;     // of each particle; null: its own number
};
/// What a solid's gather writes besides coefficients. Whole vectors are written: room for kMotionSlack particles behind the block's is needed.
inline constexpr int kMotionSlack = 8;
struct Motions {
  float* velocity = nullptr;              // [m/s] three numbers a particle
  float* gradient = nullptr;              // [m/s a cell] nine columns (row-major: component, axis) of a number a particle
  std::size_t stride = 0;                 // from one column to the next
  Wanted wanted = {};
};
struct MovingKernels {
  void (*scatter)(const Block&, const Stresses&, float* tile) = nullptr;                // as Scatter
  void (*gather)(const Block&, const float* tile, const Motions&) = nullptr;            // as Gather
};

/// Velocities on the faces around a block, which the quadratic kernel interpolates at places in the block's cells and kReach around. What places of a
/// cell read is put together when the first of them asks; it is of one field.
struct NearFaces {
  static constexpr int kReach = 1, kCells = Lattice<3>::kBlock + 2 * kReach, kEdge = kCells + 3;   // of cells and faces, along each axis
  const float* velocity = nullptr;                                 // x, y, z, kEdge^3 numbers each, from two places before the block on
  bool turned = false;
  std::array<bool, std::size_t(kCells * kCells * kCells)> known{};
  alignas(64) float along[2][kEdge * kEdge * kEdge];               // of x and y, their own axis fastest
  alignas(64) float read[kCells * kCells * kCells][9][16];
};
/// Some of these places, by axis. Numbers behind `count`, up to a multiple of four, are read too.
inline constexpr std::size_t kMostPlaces = 64;
struct Places {
  std::size_t count = 0;
  alignas(64) std::uint32_t cell[kMostPlaces];                         // its number among those of NearFaces
  const float (*offset)[kMostPlaces] = nullptr;
};
/// Writes the velocities at places, by component, and behind them what is nobody's.
using Interpolate = void (*)(NearFaces&, const Places&, float (*velocity)[kMostPlaces]);
Interpolate interpolation();

struct Kernels {
  Scatter scatter = nullptr;
  Gather gather = nullptr;
};

/// For this processor, by fast_set(modes); null where there is no fast path for the set. The sets of quadratic kernels that have modes which bend are
/// compiled apart from the others: it takes long.
Kernels faces_quadratic(int set);
Kernels faces_bent(int set);
Kernels faces_linear(int set);
Kernels nodes_quadratic(int set);
Kernels nodes_bent(int set);
Kernels nodes_linear(int set);
/// Those of quadratic kernels on nodes for solids: with the impulse of stress added to the momenta, with the velocity and its gradient, that of the
/// kernel's interpolation, handed out. The first has all sets: it asks the second for those of more than 8 modes.
MovingKernels nodes_quadratic_of_solids(int set);
MovingKernels nodes_bent_of_solids(int set);

/// Whether kernels found from now on may use AVX-512 (where the processor has it), or AVX2 only.
void allow_avx512(bool);

}  // namespace sim::lanes
