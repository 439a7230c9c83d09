#include "sim/fluid/particle_pressure.h"

#include <cmath>

#include "base/parallel.h"

namespace sim {

template <int D, class Real>
std::vector<float> particle_pressure(const std::vector<double>& values, double scale, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks,
                                     const Particles<D, Real>& particles) {
  std::vector<float> found(particles.size());
  base::parallel_chunks(particles.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      Cell<D> first = particles.cell[p];   // of the 2^D cells whose middles are around it
      std::array<double, D> part;
      for (int a = 0; a < D; ++a) {
        const double from_middle = double(particles.offset[p][a]) - 0.5, whole = std::floor(from_middle);
        first[a] += int(whole), part[std::size_t(a)] = from_middle - whole;
      }
      double sum = 0, total = 0;
      for (int corner = 0; corner < 1 << D; ++corner) {
        Cell<D> at = first;
        double weight = 1;
        for (int a = 0; a < D; ++a) {
          const bool high = corner >> a & 1;
          at[a] += high, weight *= high ? part[std::size_t(a)] : 1 - part[std::size_t(a)];
        }
        const std::ptrdiff_t i = blocks.index(at);
        if (value_at(kind, i, CellKind::air) == CellKind::solid) continue;
        total += weight;
        sum += weight * value_at(values, i, 0.0);
      }
      found[p] = total > 0 ? float(scale * sum / total) : 0;
    }
  });
  return found;
}

template std::vector<float> particle_pressure(const std::vector<double>&, double, const std::vector<CellKind>&, const ActiveBlocks<2>&, const Particles<2, float>&);
template std::vector<float> particle_pressure(const std::vector<double>&, double, const std::vector<CellKind>&, const ActiveBlocks<2>&, const Particles<2, double>&);
template std::vector<float> particle_pressure(const std::vector<double>&, double, const std::vector<CellKind>&, const ActiveBlocks<3>&, const Particles<3, float>&);
template std::vector<float> particle_pressure(const std::vector<double>&, double, const std::vector<CellKind>&, const ActiveBlocks<3>&, const Particles<3, double>&);

}  // namespace sim
