#include "sim/fluid/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"

namespace sim {
namespace {

/// No particle is looked for farther than this [cells]; without one a cell is this far from any.
constexpr double kReach = 1.25;
/// The nearest that a cell's middle is to the surface [cells]: the sign must not be lost.
constexpr float kBeside = 1e-3f;

/// From the middle of a cell `height` [cells] above the surface of liquid seeded with n particles along an edge.
template <int D>
double nearest_of_regular(int n, double height) {
  double across = n % 2 ? 0 : 0.5 / n, down = std::numeric_limits<double>::infinity();
  for (int layer = 0; layer < 4 * n; ++layer) down = std::min(down, std::abs(height + (layer + 0.5) / n));
  return std::min(kReach, std::sqrt((D - 1) * across * across + down * down));
}

}  // namespace

template <int D, class Real>
SurfaceDistance<D, Real>::SurfaceDistance(int n) {
  const auto smoothed = [n](double height) {
    return (nearest_of_regular<D>(n, height - 1) + 2 * nearest_of_regular<D>(n, height) + nearest_of_regular<D>(n, height + 1)) / 4;
  };
  radius_ = (smoothed(-0.5) + smoothed(0.5)) / 2;
}

template <int D, class Real>
void SurfaceDistance<D, Real>::update(const CellRanges& ranges, const Particles<D, Real>& particles, const std::vector<CellKind>& kind,
                                      const ActiveBlocks<D>& blocks, std::vector<float>& distance) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  constexpr int around = ActiveBlocks<D>::kNeighbours;
  nearest_.resize(blocks.size()), distance.resize(blocks.size());

  // Blocks at the surface: with liquid in or around them, and air.
  std::vector<std::uint8_t> has_liquid(blocks.count()), has_air(blocks.count()), near(blocks.count());
  base::parallel_chunks(blocks.count(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      bool liquid = false, air = false;
      for (std::size_t i = slot * per_block; i < (slot + 1) * per_block; ++i) liquid |= kind[i] == CellKind::liquid, air |= kind[i] == CellKind::air;
      has_liquid[slot] = liquid, has_air[slot] = air;
    }
  });
  std::vector<std::int32_t> first(blocks.count(), -1);   // of each slot: place in ranges.occupied
  for (std::size_t b = 0; b < ranges.occupied.size(); ++b) first[std::size_t(blocks.slot(ranges.occupied[b]))] = std::int32_t(b);

  base::parallel_chunks(blocks.count(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      bool liquid = false, air = false;
      for (const std::int32_t other : blocks.neighbours(slot)) {
        if (other < 0) continue;
        liquid = liquid || has_liquid[std::size_t(other)];
        air = air || has_air[std::size_t(other)];
      }
      near[slot] = liquid && air;
      for (std::size_t i = slot * per_block; i < (slot + 1) * per_block; ++i) {
        distance[i] = kind[i] == CellKind::liquid ? -1.0f : kind[i] == CellKind::air ? 1.0f : 0.0f;
        if (!near[slot] || kind[i] == CellKind::solid) continue;
        // The particles of the 3^D cells around, nearest cells first: own, then by how many axes a cell is aside.
        const std::array<std::ptrdiff_t, std::size_t(around)> places = [&] {
          Cell<D> lower = blocks.cell_at(i);
          for (int& c : lower) --c;
          return blocks.template places<3>(lower);
        }();
        double least2 = kReach * kReach;
        for (int aside = 0; aside <= D; ++aside) {
          if (0.25 * aside >= least2) break;
          for (int n = 0; n < around; ++n) {
            std::array<double, D> shift;
            int sides = 0;
            for (int a = D - 1, rest = n; a >= 0; --a, rest /= 3) shift[std::size_t(a)] = rest % 3 - 1.5, sides += rest % 3 != 1;
            const std::ptrdiff_t at = places[std::size_t(n)];
            if (sides != aside || at < 0) continue;
            const std::int32_t b = first[std::size_t(at) / per_block];
            if (b < 0) continue;
            const std::size_t cell = std::size_t(b) * per_block + std::size_t(at) % per_block;
            for (std::size_t p = ranges.begin[cell]; p < ranges.begin[cell + 1]; ++p) {
              double d2 = 0;
              for (int a = 0; a < D; ++a) {
                const double d = shift[std::size_t(a)] + double(particles.offset[p][a]);
                d2 += d * d;
              }
              least2 = std::min(least2, d2);
            }
          }
        }
        nearest_[i] = float(std::sqrt(least2) - radius_);
      }
    }
  });

  base::parallel_chunks(blocks.count(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      if (!near[slot]) continue;
      for (std::size_t i = slot * per_block; i < (slot + 1) * per_block; ++i) {
        if (kind[i] == CellKind::solid) continue;
        bool meets = false;
        for (int a = 0; a < D; ++a)
          for (const int side : {0, 1}) {
            const CellKind other = value_at(kind, blocks.neighbour(i, a, side), CellKind::air);
            meets = meets || (other != kind[i] && other != CellKind::solid);
          }
        if (!meets) continue;
        Cell<D> lower = blocks.cell_at(i);
        for (int& c : lower) --c;
        const auto places = blocks.template places<3>(lower);
        double sum = 0, weights = 0;
        for (int n = 0; n < around; ++n) {
          int weight = 1;
          for (int a = 0, rest = n; a < D; ++a, rest /= 3) weight *= rest % 3 == 1 ? 2 : 1;
          const std::ptrdiff_t at = places[std::size_t(n)];
          if (at >= 0 && kind[std::size_t(at)] == CellKind::solid) continue;
          const bool known = at >= 0 && near[std::size_t(at) / per_block];
          sum += weight * (known ? double(nearest_[std::size_t(at)]) : kReach - radius_);
          weights += weight;
        }
        const auto mean = float(sum / weights);
        distance[i] = kind[i] == CellKind::liquid ? std::min(mean, -kBeside) : std::max(mean, kBeside);
      }
    }
  });
}

template class SurfaceDistance<2, float>;
template class SurfaceDistance<2, double>;
template class SurfaceDistance<3, float>;
template class SurfaceDistance<3, double>;

}  // namespace sim
