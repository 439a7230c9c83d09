#include "sim/fluid/advect.h"

#include <algorithm>

#include "base/parallel.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 4096;

/// A midpoint may lie outside the domain; the field is asked at the nearest place inside.
template <int D, class Real>
void keep_inside(Site<D, Real>& site, const Lattice<D>& lattice) {
  for (int a = 0; a < D; ++a) {
    if (site.cell[a] < 0) site.cell[a] = 0, site.offset[a] = 0;
    if (site.cell[a] >= lattice.cells[a]) site.cell[a] = lattice.cells[a] - 1, site.offset[a] = std::nextafter(Real(1), Real(0));
  }
}

}  // namespace

template <int D, class Real>
void advect(const MacTransfer<D, Real>& transfer, const FaceField<D, Real>& velocity, double dt, const Solids<D>& solids,
            Particles<D, Real>& particles) {
  const Real cells = Real(dt / solids.cell);   // per m/s
  base::parallel_chunks(particles.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      Site<D, Real> site{particles.cell[p], particles.offset[p]}, middle = site;
      middle.move(Real(0.5) * cells * transfer.velocity_at(velocity, site));
      keep_inside<D, Real>(middle, solids.lattice);
      site.move(cells * transfer.velocity_at(velocity, middle));
      particles.cell[p] = site.cell;
      particles.offset[p] = site.offset;
    }
  });
}

template <int D, class Real>
std::int64_t push_out(const Solids<D>& solids, Particles<D, Real>& particles) {
  return base::ordered_reduce(particles.size(), kChunk, std::int64_t{0}, [&](std::size_t begin, std::size_t end) {
    std::int64_t pushed = 0;
    for (std::size_t p = begin; p < end; ++p) {
      Site<D, Real> site{particles.cell[p], particles.offset[p]};
      if (!solids.push_out(site)) continue;
      particles.cell[p] = site.cell;
      particles.offset[p] = site.offset;
      ++pushed;
    }
    return pushed;
  }, [](std::int64_t a, std::int64_t b) { return a + b; });
}

template void advect(const MacTransfer<3, float>&, const FaceField<3, float>&, double, const Solids<3>&, Particles<3, float>&);
template void advect(const MacTransfer<3, double>&, const FaceField<3, double>&, double, const Solids<3>&, Particles<3, double>&);
template std::int64_t push_out(const Solids<3>&, Particles<3, float>&);
template std::int64_t push_out(const Solids<3>&, Particles<3, double>&);

}  // namespace sim
