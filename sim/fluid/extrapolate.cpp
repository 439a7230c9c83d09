#include "sim/fluid/extrapolate.h"

#include <limits>

#include "base/parallel.h"

namespace sim {
namespace {

constexpr std::uint8_t kUnknown = std::numeric_limits<std::uint8_t>::max();
constexpr std::size_t kChunk = 32768;

/// Faces of layer `layer`: unknown, with a neighbour in an earlier layer. Ascending.
template <int D>
std::vector<std::uint32_t> next_layer(const std::vector<std::uint8_t>& depth, const Lattice<D>& lattice, std::size_t margin) {
  using List = std::vector<std::uint32_t>;
  const std::size_t first = margin, last = lattice.size - margin;
  return base::ordered_reduce(last - first, kChunk, List{}, [&](std::size_t begin, std::size_t end) {
    List found;
    for (std::size_t i = first + begin; i < first + end; ++i) {
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

template <int D, class Real>
void extrapolate_component(std::vector<Real>& field, const std::vector<std::uint8_t>& valid, const Lattice<D>& lattice, int layers) {
  std::vector<std::uint8_t> depth(lattice.size);
  for (std::size_t i = 0; i < lattice.size; ++i) depth[i] = valid[i] ? 0 : kUnknown;
  const auto margin = std::size_t(lattice.stride[0]);   // the outermost slab has no neighbour on one side
  for (int layer = 1; layer <= layers; ++layer) {
    const std::vector<std::uint32_t> faces = next_layer<D>(depth, lattice, margin);
    if (faces.empty()) break;
    // Reads only faces of earlier layers, writes only faces of this one.
    base::parallel_chunks(faces.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = begin; f < end; ++f) {
        const std::size_t i = faces[f];
        Real sum = 0;
        int known = 0;
        for (int a = 0; a < D; ++a)
          for (const std::size_t j : {i - std::size_t(lattice.stride[a]), i + std::size_t(lattice.stride[a])})
            if (depth[j] != kUnknown) sum += field[j], ++known;
        field[i] = sum / Real(known);
      }
    });
    for (const std::uint32_t i : faces) depth[i] = std::uint8_t(layer);
  }
  for (std::size_t i = 0; i < lattice.size; ++i)
    if (depth[i] == kUnknown) field[i] = 0;
}

}  // namespace

template <int D, class Real>
void extrapolate(FaceField<D, Real>& field, const FaceMask<D>& valid, const Lattice<D>& lattice, int layers) {
  for (int a = 0; a < D; ++a) extrapolate_component<D, Real>(field[a], valid[a], lattice, layers);
}

template void extrapolate(FaceField<3, float>&, const FaceMask<3>&, const Lattice<3>&, int);
template void extrapolate(FaceField<3, double>&, const FaceMask<3>&, const Lattice<3>&, int);

}  // namespace sim
