#pragma once
// Periodic axes: the arrays hold a ring around the domain, and on a periodic axis the ring repeats the other side. Index n of such an
// axis (of n cells) is index 0, for cells, faces and nodes alike. Stencils read the ring as if it were the domain, so whoever changes
// a field that is gathered later fills its images first; scatter leaves them filled.
#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <vector>

#include "base/parallel.h"
#include "sim/transfer/lattice.h"

namespace sim {

/// Copies the domain's values into the ring, on the periodic axes; other axes stay as they are.
template <int D, class Value>
void fill_images(std::vector<Value>& field, const Lattice<D>& lattice) {
  assert(field.size() == lattice.size);
  // One axis after the other, each over the whole extent of the others: edges and corners come out right.
  for (int axis = 0; axis < D; ++axis) {
    if (!lattice.periodic[axis]) continue;
    const std::ptrdiff_t inner = lattice.stride[axis], line = inner * lattice.extent[axis], n = lattice.cells[axis];
    constexpr std::ptrdiff_t pad = Lattice<D>::kPad;
    const auto copy = [&](Value* first, std::ptrdiff_t at) {
      std::copy_n(first + (pad + (at % n + n) % n) * inner, inner, first + (pad + at) * inner);
    };
    base::parallel_chunks(lattice.size / std::size_t(line), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t l = begin; l < end; ++l) {
        Value* const first = field.data() + std::ptrdiff_t(l) * line;
        for (std::ptrdiff_t at = -pad; at < 0; ++at) copy(first, at);
        for (std::ptrdiff_t at = n; at <= n + pad; ++at) copy(first, at);
      }
    });
  }
}

/// The same for every component of a field on faces.
template <int D, class Value, std::size_t n>
void fill_images(std::array<std::vector<Value>, n>& field, const Lattice<D>& lattice) {
  for (std::vector<Value>& component : field) fill_images(component, lattice);
}

}  // namespace sim
