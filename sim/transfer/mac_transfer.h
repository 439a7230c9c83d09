#pragma once
// Particles <-> the velocity faces of a MAC grid. Each velocity component lives on a lattice of its own: uncentred on its own axis,
// centred on the others.
#include <array>
#include <vector>

#include "sim/transfer/grid_transfer.h"

namespace sim {

/// One number per face, an array for each axis, indexed by ActiveBlocks.
template <int D, class Real>
struct FaceField : std::array<std::vector<Real>, std::size_t(D)> {};

template <int D, class Real>
struct MacVelocity {
  FaceField<D, Real> velocity;     // [m/s]
  FaceField<D, Real> mass;         // [particles]; a face not heavier than kLightestNode is invalid and has velocity 0
  std::int64_t light_faces = 0;    // faces that particles reached but left invalid
};

/// Component a on lattice a.
template <int dimension, class Number>
struct FaceLayout {
  static constexpr int kDimension = dimension, kLattices = dimension, kComponents = 1;   // components a lattice
  using Real = Number;
  using Field = FaceField<dimension, Real>;
  using Mass = FaceField<dimension, Real>;
  using Grid = MacVelocity<dimension, Real>;
  static constexpr bool centred(int lattice, int axis) { return axis != lattice; }
  static constexpr int component(int lattice, int) { return lattice; }
  static auto& at(auto& velocity, int component, std::size_t i) { return velocity[component][i]; }
  static auto& mass(auto& masses, int lattice) { return masses[lattice]; }
  static std::int64_t& light(Grid& grid) { return grid.light_faces; }
  static void clear(Field& velocity, std::size_t size) {
    for (auto& component : velocity) {
      component.resize(size);
      base::parallel_chunks(size, 65536, [&](std::size_t begin, std::size_t end) { std::fill(&component[begin], &component[0] + end, Real(0)); });
    }
  }
};

template <int D, class Real>
using MacTransfer = GridTransfer<FaceLayout<D, Real>>;

}  // namespace sim
