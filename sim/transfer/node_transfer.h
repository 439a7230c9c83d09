#pragma once
// Particles <-> the nodes of a grid, at the corners of its cells: all velocity components on one lattice, uncentred on every axis, so
// that one stencil serves them all.
#include <vector>

#include "sim/transfer/grid_transfer.h"

namespace sim {

/// A velocity per node, indexed by ActiveBlocks.
template <int D, class Real>
using NodeField = std::vector<Vec<D, Real>>;

template <int D, class Real>
struct NodeVelocity {
  NodeField<D, Real> velocity;     // [m/s]
  std::vector<Real> mass;          // [particles]; a node not heavier than kLightestNode is invalid and has velocity 0
  std::int64_t light_nodes = 0;    // nodes that particles reached but left invalid
};

/// All components on lattice 0.
template <int dimension, class Number>
struct NodeLayout {
  static constexpr int kDimension = dimension, kLattices = 1, kComponents = dimension;   // components a lattice
  using Real = Number;
  using Field = NodeField<dimension, Real>;
  using Mass = std::vector<Real>;
  using Grid = NodeVelocity<dimension, Real>;
  static constexpr bool centred(int, int) { return false; }
  static constexpr int component(int, int number) { return number; }
  static auto& at(auto& velocity, int component, std::size_t i) { return velocity[i].data()[component]; }   // unchecked: it is in every loop
  static auto& mass(auto& masses, int) { return masses; }
  static std::int64_t& light(Grid& grid) { return grid.light_nodes; }
  static void clear(Field& velocity, std::size_t size) { velocity.assign(size, Vec<dimension, Real>::Zero()); }
};

template <int D, class Real>
using NodeTransfer = GridTransfer<NodeLayout<D, Real>>;

}  // namespace sim
