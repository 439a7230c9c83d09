#include "sim/fluid/extrapolate.h"

#include <limits>

#include "base/parallel.h"

namespace sim {
namespace {

constexpr std::uint8_t kUnknown = std::numeric_limits<std::uint8_t>::max();
constexpr std::size_t kChunk = 32768;

/// Unknown faces next to a valid one, ascending.
template <int D>
std::vector<std::uint32_t> first_layer(const std::vector<std::uint8_t>& depth, const Lattice<D>& lattice, std::size_t margin) {
  using List = std::vector<std::uint32_t>;
  return base::ordered_reduce(lattice.size - 2 * margin, kChunk, List{}, [&](std::size_t begin, std::size_t end) {
    List found;
    for (std::size_t i = margin + begin; i < margin + end; ++i) {
      if (depth[i] != kUnknown) continue;
      for (int a = 0; a < D; ++a) {
        const auto s = std::size_t(lattice.stride[a]);
        if (depth[i - s] != kUnknown || depth[i + s] != kUnknown) {
          found.push_back(std::uint32_t(i));
          break;
        }
      }
    }
    return found;
  }, [](List all, const List& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
}

/// Unknown faces next to those of the layer before; marks them as the next one.
template <int D>
std::vector<std::uint32_t> next_layer(const std::vector<std::uint32_t>& before, const Lattice<D>& lattice, std::size_t margin, int layer,
                                      std::vector<std::uint8_t>& depth) {
  std::vector<std::uint32_t> found;
  for (const std::size_t i : before)
    for (int a = 0; a < D; ++a)
      for (const std::size_t j : {i - std::size_t(lattice.stride[a]), i + std::size_t(lattice.stride[a])})
        if (j >= margin && j < lattice.size - margin && depth[j] == kUnknown) {
          depth[j] = std::uint8_t(layer);
          found.push_back(std::uint32_t(j));
        }
  return found;
}

template <int D, class Real>
void extrapolate_component(std::vector<Real>& field, const std::vector<std::uint8_t>& valid, const Lattice<D>& lattice, int layers) {
  std::vector<std::uint8_t> depth(lattice.size);
  for (std::size_t i = 0; i < lattice.size; ++i) depth[i] = valid[i] ? 0 : kUnknown;
  const auto margin = std::size_t(lattice.stride[0]);   // the outermost slab has no neighbour on one side
  std::vector<std::uint32_t> faces = first_layer<D>(depth, lattice, margin);
  for (const std::uint32_t i : faces) depth[i] = 1;
  for (int layer = 1; layer <= layers && !faces.empty(); ++layer) {
    // Reads only faces of earlier layers, writes only faces of this one.
    base::parallel_chunks(faces.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = begin; f < end; ++f) {
        const std::size_t i = faces[f];
        Real sum = 0;
        int known = 0;
        for (int a = 0; a < D; ++a)
          for (const std::size_t j : {i - std::size_t(lattice.stride[a]), i + std::size_t(lattice.stride[a])})
            if (depth[j] < layer) sum += field[j], ++known;
        field[i] = sum / Real(known);
      }
    });
    if (layer < layers) faces = next_layer<D>(faces, lattice, margin, layer + 1, depth);
  }
  base::parallel_chunks(lattice.size, 65536, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (depth[i] == kUnknown) field[i] = 0;
  });
}

}  // namespace

template <int D, class Real>
void extrapolate(FaceField<D, Real>& field, const FaceMask<D>& valid, const Lattice<D>& lattice, int layers) {
  for (int a = 0; a < D; ++a) extrapolate_component<D, Real>(field[a], valid[a], lattice, layers);
}

template void extrapolate(FaceField<3, float>&, const FaceMask<3>&, const Lattice<3>&, int);
template void extrapolate(FaceField<3, double>&, const FaceMask<3>&, const Lattice<3>&, int);

}  // namespace sim
