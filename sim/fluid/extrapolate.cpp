#include "sim/fluid/extrapolate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "base/parallel.h"

namespace sim {
namespace {

/// Layers from the valid faces; faces not reached yet; and what is no face.
constexpr std::uint8_t kUnknown = std::numeric_limits<std::uint8_t>::max(), kOutside = kUnknown - 1;
constexpr std::size_t kChunk = 32768;

using Faces = std::vector<std::uint32_t>;

/// Calls body(index) for the neighbours of a face that are active.
template <int D, class Neighbour, class Body>
void for_neighbours(std::size_t face, const Neighbour& neighbour, const Body& body) {
  for (int a = 0; a < D; ++a)
    for (const int side : {0, 1})
      if (const std::ptrdiff_t j = neighbour(face, a, side); j >= 0) body(std::size_t(j));
}

/// Unknown faces next to a valid one, ascending.
template <int D, class Neighbour>
Faces first_layer(const std::vector<std::uint8_t>& depth, const Neighbour& neighbour) {
  return base::ordered_reduce(depth.size(), kChunk, Faces{}, [&](std::size_t begin, std::size_t end) {
    Faces found;
    for (std::size_t i = begin; i < end; ++i) {
      if (depth[i] != kUnknown) continue;
      bool touches_valid = false;
      for_neighbours<D>(i, neighbour, [&](std::size_t j) { touches_valid = touches_valid || depth[j] == 0; });
      if (touches_valid) found.push_back(std::uint32_t(i));
    }
    return found;
  }, [](Faces all, const Faces& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
}

/// Unknown faces next to those of the layer before; marks them as the next one.
template <int D, class Neighbour>
Faces next_layer(const Faces& before, const Neighbour& neighbour, int layer, std::vector<std::uint8_t>& depth) {
  Faces found;
  for (const std::size_t i : before)
    for_neighbours<D>(i, neighbour, [&](std::size_t j) {
      if (depth[j] != kUnknown) return;
      depth[j] = std::uint8_t(layer);
      found.push_back(std::uint32_t(j));
    });
  return found;
}

template <int D, class Real, class Neighbour>
void extrapolate_component(std::vector<Real>& field, const std::vector<std::uint8_t>& valid, const ActiveBlocks<D>& blocks, int layers,
                           const Neighbour& neighbour) {
  std::vector<std::uint8_t> depth(blocks.size());
  base::parallel_chunks(depth.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) depth[i] = valid[i] ? 0 : kUnknown;
    if (blocks.all_places()) return;
    for (std::size_t i = begin; i < end; ++i)
      if (!blocks.is_place(i)) depth[i] = kOutside;
  });
  Faces faces = first_layer<D>(depth, neighbour);
  for (const std::uint32_t i : faces) depth[i] = 1;
  for (int layer = 1; layer <= layers && !faces.empty(); ++layer) {
    // Reads only faces of earlier layers, writes only faces of this one.
    base::parallel_chunks(faces.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t f = begin; f < end; ++f) {
        Real sum = 0;
        int known = 0;
        for_neighbours<D>(faces[f], neighbour, [&](std::size_t j) {
          if (depth[j] < layer) sum += field[j], ++known;
        });
        field[faces[f]] = sum / Real(known);
      }
    });
    if (layer < layers) faces = next_layer<D>(faces, neighbour, layer + 1, depth);
  }
  base::parallel_chunks(depth.size(), 65536, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (depth[i] >= kOutside) field[i] = 0;
  });
}

}  // namespace

template <int D, class Real>
void extrapolate(FaceField<D, Real>& field, const FaceMask<D>& valid, const ActiveBlocks<D>& blocks, int layers) {
  blocks.with_neighbour([&](const auto& neighbour) {
    for (int a = 0; a < D; ++a) extrapolate_component<D, Real>(field[a], valid[a], blocks, layers, neighbour);
  });
}

namespace {

/// A face through which an air cell may pass on what flows into it.
template <class Real>
struct OuterFace {
  Real* velocity;
  Real side;   // 1 or -1: to the cell's upper or lower side
  double outward() const { return double(side) * double(*velocity); }
};

/// Takes `outflow` off the faces in equal parts, up to `fastest` each; what one face cannot take the others do.
template <class Real>
void take_off(double outflow, double fastest, std::span<const OuterFace<Real>> faces) {
  const bool gathers = outflow < 0;
  const auto can_take = [&](const OuterFace<Real>& f) { return gathers ? f.outward() < fastest : f.outward() > -fastest; };
  for (std::size_t round = 0; round < faces.size(); ++round) {
    const auto free = std::count_if(faces.begin(), faces.end(), can_take);
    if (free == 0) return;
    const double part = outflow / double(free);
    for (const OuterFace<Real>& f : faces) {
      if (!can_take(f)) continue;
      const double before = f.outward();
      *f.velocity = f.side * Real(std::clamp(before - part, -fastest, fastest));
      outflow += f.outward() - before;
    }
  }
}

}  // namespace

template <int D, class Real>
void carry_on_outflow(FaceField<D, Real>& field, const FaceMask<D>& valid, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  const auto is_air = [&](std::size_t i) { return cells.kind[i] == CellKind::air; };
  const auto is_beside_liquid = [&](std::size_t i) { return cells.distance[i] < 1; };   // of air
  // A face that is written lies between a cell beside liquid and one that is not: only the first writes it, and no other cell beside liquid reads it.
  base::parallel_chunks(blocks.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!is_air(i) || !is_beside_liquid(i)) continue;
      std::array<OuterFace<Real>, std::size_t(2 * D)> outer;
      std::size_t count = 0;
      int wet = 0;
      double outflow = 0, fastest = 0;
      for (int a = 0; a < D; ++a)
        for (const int side : {0, 1}) {
          const std::ptrdiff_t beyond = blocks.neighbour(i, a, side), place = side ? beyond : std::ptrdiff_t(i);
          if (place < 0) continue;   // never: the field reaches farther than a cell from liquid
          const auto face = std::size_t(place);
          const double velocity = double(field[a][face]);
          outflow += side ? velocity : -velocity;
          fastest = std::max(fastest, std::abs(velocity));
          wet += beyond >= 0 && cells.kind[std::size_t(beyond)] == CellKind::liquid;
          if (beyond < 0 || !is_air(std::size_t(beyond)) || is_beside_liquid(std::size_t(beyond))) continue;
          if (valid[a][face] || cells.open(a, face) == 0) continue;
          outer[count++] = {&field[a][face], Real(side ? 1 : -1)};
        }
      if (wet <= D) take_off<Real>(outflow, fastest, std::span(outer).first(count));
    }
  });
}

template void extrapolate(FaceField<2, float>&, const FaceMask<2>&, const ActiveBlocks<2>&, int);
template void extrapolate(FaceField<2, double>&, const FaceMask<2>&, const ActiveBlocks<2>&, int);
template void extrapolate(FaceField<3, float>&, const FaceMask<3>&, const ActiveBlocks<3>&, int);
template void extrapolate(FaceField<3, double>&, const FaceMask<3>&, const ActiveBlocks<3>&, int);
template void carry_on_outflow(FaceField<2, float>&, const FaceMask<2>&, const LiquidCells<2>&, const ActiveBlocks<2>&);
template void carry_on_outflow(FaceField<2, double>&, const FaceMask<2>&, const LiquidCells<2>&, const ActiveBlocks<2>&);
template void carry_on_outflow(FaceField<3, float>&, const FaceMask<3>&, const LiquidCells<3>&, const ActiveBlocks<3>&);
template void carry_on_outflow(FaceField<3, double>&, const FaceMask<3>&, const LiquidCells<3>&, const ActiveBlocks<3>&);

}  // namespace sim
