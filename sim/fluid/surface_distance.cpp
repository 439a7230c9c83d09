#include "sim/fluid/surface_distance.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace sim {
namespace {

/// The nearest that a cell's middle is to the surface [cells]: the sign must not be lost.
constexpr float kBeside = 1e-3f;
/// And the farthest; 1 is what cells away from it have.
constexpr float kWithin = 0.999f;
constexpr std::size_t kBlocksAtOnce = 64;

template <int D>
auto places_around(std::size_t i, const ActiveBlocks<D>& blocks) {
  Cell<D> lower = blocks.cell_at(i);
  for (int& c : lower) --c;
  return blocks.template places<3>(lower);
}

/// Averaged over the cells around one.
template <int D, class Places>
double mean_filling(const Places& places, const std::vector<float>& filling, const std::vector<CellKind>& kind) {
  double sum = 0, weights = 0;
  for (int n = 0; n < ActiveBlocks<D>::kNeighbours; ++n) {
    const std::ptrdiff_t at = places[std::size_t(n)];
    if (at >= 0 && kind[std::size_t(at)] == CellKind::solid) continue;
    int weight = 1;
    for (int a = 0, rest = n; a < D; ++a, rest /= 3) weight *= rest % 3 == 1 ? 2 : 1;
    sum += weight * double(value_at(filling, at, 0.0f));
    weights += weight;
  }
  return sum / weights;
}

}  // namespace

template <int D>
std::vector<float> cell_filling(const CellRanges& ranges, const ActiveBlocks<D>& blocks, double full) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  std::vector<float> filling(blocks.size());
  base::parallel_chunks(ranges.occupied.size(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      float* const to = &filling[std::size_t(blocks.slot(ranges.occupied[b])) * per_block];
      for (std::size_t local = 0; local < per_block; ++local)
        to[local] = float(double(ranges.begin[b * per_block + local + 1] - ranges.begin[b * per_block + local]) / full);
    }
  });
  return filling;
}

template <int D>
std::vector<float> excess_filling(const std::vector<float>& filling, double aim, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  std::vector<float> excess(blocks.size());
  const auto is_cut = [&](std::size_t i) {
    if (cells.open.is_open(i / per_block)) return false;
    for (int a = 0; a < D; ++a)
      if (const float w = cells.open(a, i); w > 0 && w < 1) return true;
    return false;
  };
  const auto meets_air = [&](std::size_t i) { return cells.kind[i] == CellKind::air || (!cells.distance.empty() && std::abs(cells.distance[i]) < 1); };
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * per_block; i < end * per_block; ++i) {
      if (cells.kind[i] != CellKind::liquid) continue;
      const auto places = places_around<D>(i, blocks);
      const bool inside = std::all_of(places.begin(), places.end(), [&](std::ptrdiff_t at) {
        const auto near = std::size_t(at);
        return at >= 0 && (cells.kind[near] == CellKind::solid || (!meets_air(near) && !is_cut(near)));
      });
      if (inside) excess[i] = float(std::clamp(mean_filling<D>(places, filling, cells.kind) - aim, -kMostExcess, kMostExcess));
    }
  });
  return excess;
}

template <int D>
std::vector<float> surface_distance(const std::vector<float>& filling, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  std::vector<float> distance(blocks.size());
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * per_block; i < end * per_block; ++i) {
      distance[i] = kind[i] == CellKind::liquid ? -1.0f : kind[i] == CellKind::air ? 1.0f : 0.0f;
      if (kind[i] == CellKind::solid) continue;
      bool meets = false;
      for (int a = 0; a < D; ++a)
        for (const int side : {0, 1}) {
          const CellKind other = value_at(kind, blocks.neighbour(i, a, side), kind[i]);
          meets = meets || (other != kind[i] && other != CellKind::solid);
        }
      if (!meets) continue;
      // Across a level surface the average falls by a half from a cell to the next.
      const auto far = float(1 - 2 * mean_filling<D>(places_around<D>(i, blocks), filling, kind));
      distance[i] = kind[i] == CellKind::liquid ? std::clamp(far, -kWithin, -kBeside) : std::clamp(far, kBeside, kWithin);
    }
  });
  return distance;
}

template std::vector<float> cell_filling(const CellRanges&, const ActiveBlocks<2>&, double);
template std::vector<float> surface_distance(const std::vector<float>&, const std::vector<CellKind>&, const ActiveBlocks<2>&);
template std::vector<float> excess_filling(const std::vector<float>&, double, const LiquidCells<2>&, const ActiveBlocks<2>&);
template std::vector<float> cell_filling(const CellRanges&, const ActiveBlocks<3>&, double);
template std::vector<float> surface_distance(const std::vector<float>&, const std::vector<CellKind>&, const ActiveBlocks<3>&);
template std::vector<float> excess_filling(const std::vector<float>&, double, const LiquidCells<3>&, const ActiveBlocks<3>&);

}  // namespace sim
