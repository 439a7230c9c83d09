#include "sim/fluid/extrapolate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "sim/transfer/place_set.h"

namespace sim {
namespace {

/// Of a block's faces, those that come next after the known ones, and their values.
template <int D, class Real, class Neighbour>
PlaceBits fill_layer(std::size_t slot, const PlaceSet<D>& known, const ActiveBlocks<D>& blocks, const Neighbour& neighbour, std::vector<Real>& field) {
  const PlaceBits missing = PlaceSet<D>::places(blocks, slot) & ~known[slot];
  if (missing == 0) return 0;
  std::array<PlaceBits, std::size_t(2 * D)> beside;
  PlaceBits any = 0;
  for (int a = 0; a < D; ++a)
    for (const int side : {0, 1}) any |= beside[std::size_t(2 * a + side)] = known.beside(blocks, slot, a, side);
  for_places(missing & any, [&](std::size_t k) {
    const std::size_t face = slot * std::size_t(PlaceSet<D>::kCells) + k;
    Real sum = 0;
    int count = 0;
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1})
        if (beside[std::size_t(2 * a + side)] >> k & 1) sum += field[std::size_t(neighbour(face, a, side))], ++count;
    field[face] = sum / Real(count);
  });
  return missing & any;
}

template <int D, class Real, class Neighbour>
void extrapolate_component(std::vector<Real>& field, const std::vector<std::uint8_t>& valid, const ActiveBlocks<D>& blocks, int layers,
                           const Neighbour& neighbour) {
  PlaceSet<D> known(blocks, valid, std::uint8_t{1}), next(blocks);
  for (int layer = 1; layer <= layers; ++layer) {
    // Reads only faces of earlier layers, writes only faces of this one.
    base::parallel_chunks(blocks.count(), PlaceSet<D>::kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slot = begin; slot < end; ++slot) next[slot] = known[slot] | fill_layer(slot, known, blocks, neighbour, field);
    });
    std::swap(known, next);
  }
  base::parallel_chunks(blocks.count(), PlaceSet<D>::kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot)
      for_places(PlaceSet<D>::kAll & ~known[slot], [&](std::size_t k) { field[slot * std::size_t(PlaceSet<D>::kCells) + k] = 0; });
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
  base::parallel_chunks(blocks.size(), PlaceSet<D>::kBlocksAtOnce * std::size_t(PlaceSet<D>::kCells), [&](std::size_t begin, std::size_t end) {
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
