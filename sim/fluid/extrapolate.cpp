#include "sim/fluid/extrapolate.h"

#include <algorithm>
#include <limits>

#include "base/parallel.h"
#include "sim/transfer/images.h"

namespace sim {
namespace {

/// Layers from the valid faces; faces not reached yet; and faces that take no part: images, and the outermost of the arrays, which have
/// no neighbour on one side.
constexpr std::uint8_t kUnknown = std::numeric_limits<std::uint8_t>::max(), kOutside = kUnknown - 1;
constexpr std::size_t kChunk = 32768;

using Faces = std::vector<std::uint32_t>;

/// The face before (side 0) or after (1) along an axis.
template <int D>
std::size_t neighbour(std::size_t face, int axis, int side, const Lattice<D>& lattice) {
  const std::ptrdiff_t i = std::ptrdiff_t(face), step = lattice.stride[axis];
  if (lattice.periodic[axis]) {
    const std::ptrdiff_t at = i / step % lattice.extent[axis] - Lattice<D>::kPad, last = lattice.cells[axis] - 1;
    if (at == (side ? last : 0)) return std::size_t(side ? i - last * step : i + last * step);
  }
  return std::size_t(side ? i + step : i - step);
}

template <int D>
void mark_outside(std::vector<std::uint8_t>& depth, const Lattice<D>& lattice) {
  for (int a = 0; a < D; ++a) {
    const std::ptrdiff_t inner = lattice.stride[a], line = inner * lattice.extent[a];
    const std::ptrdiff_t first = lattice.periodic[a] ? Lattice<D>::kPad : 1, last = lattice.periodic[a] ? first + lattice.cells[a] : lattice.extent[a] - 1;
    for (auto start = depth.begin(); start != depth.end(); start += line) {
      std::fill(start, start + first * inner, kOutside);
      std::fill(start + last * inner, start + line, kOutside);
    }
  }
}

/// Unknown faces next to a valid one, ascending.
template <int D>
Faces first_layer(const std::vector<std::uint8_t>& depth, const Lattice<D>& lattice) {
  const auto touches_valid = [&](std::size_t i) {
    for (int a = 0; a < D; ++a)
      if (depth[neighbour<D>(i, a, 0, lattice)] == 0 || depth[neighbour<D>(i, a, 1, lattice)] == 0) return true;
    return false;
  };
  return base::ordered_reduce(lattice.size, kChunk, Faces{}, [&](std::size_t begin, std::size_t end) {
    Faces found;
    for (std::size_t i = begin; i < end; ++i)
      if (depth[i] == kUnknown && touches_valid(i)) found.push_back(std::uint32_t(i));
    return found;
  }, [](Faces all, const Faces& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
}

/// Unknown faces next to those of the layer before; marks them as the next one.
template <int D>
Faces next_layer(const Faces& before, const Lattice<D>& lattice, int layer, std::vector<std::uint8_t>& depth) {
  Faces found;
  for (const std::size_t i : before)
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1})
        if (const std::size_t j = neighbour<D>(i, a, side, lattice); depth[j] == kUnknown) {
          depth[j] = std::uint8_t(layer);
          found.push_back(std::uint32_t(j));
        }
  return found;
}

template <int D, class Real>
void extrapolate_component(std::vector<Real>& field, const std::vector<std::uint8_t>& valid, const Lattice<D>& lattice, int layers) {
  std::vector<std::uint8_t> depth(lattice.size);
  for (std::size_t i = 0; i < lattice.size; ++i) depth[i] = valid[i] ? 0 : kUnknown;
  mark_outside<D>(depth, lattice);
  Faces faces = first_layer<D>(depth, lattice);
  for (const std::uint32_t i : faces) depth[i] = 1;
  for (int layer = 1; layer <= layers && !faces.empty(); ++layer) {
    // Reads only faces of earlier layers, writes only faces of this one.
    base::parallel_chunks(faces.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = begin; f < end; ++f) {
        Real sum = 0;
        int known = 0;
        for (int a = 0; a < D; ++a)
          for (const int side : {0, 1})
            if (const std::size_t j = neighbour<D>(faces[f], a, side, lattice); depth[j] < layer) sum += field[j], ++known;
        field[faces[f]] = sum / Real(known);
      }
    });
    if (layer < layers) faces = next_layer<D>(faces, lattice, layer + 1, depth);
  }
  base::parallel_chunks(lattice.size, 65536, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (depth[i] >= kOutside) field[i] = 0;
  });
  fill_images(field, lattice);
}

}  // namespace

template <int D, class Real>
void extrapolate(FaceField<D, Real>& field, const FaceMask<D>& valid, const Lattice<D>& lattice, int layers) {
  for (int a = 0; a < D; ++a) extrapolate_component<D, Real>(field[a], valid[a], lattice, layers);
}

template void extrapolate(FaceField<2, float>&, const FaceMask<2>&, const Lattice<2>&, int);
template void extrapolate(FaceField<2, double>&, const FaceMask<2>&, const Lattice<2>&, int);
template void extrapolate(FaceField<3, float>&, const FaceMask<3>&, const Lattice<3>&, int);
template void extrapolate(FaceField<3, double>&, const FaceMask<3>&, const Lattice<3>&, int);

}  // namespace sim
