#include "sim/fluid/advect.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/parallel.h"
#include "sim/transfer/carry.h"
#include "sim/transfer/near_field.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 4096;

/// Where all get to by part times steps [cells].
template <int D, class Real>
void move(const Sites<D, Real>& from, Real part, const AtSites<D, Real>& steps, Sites<D, Real>& to) {
  to.count = from.count;
  for (int a = 0; a < D; ++a) {
    const int* const cell = from.cell[a];
    const Real *const offset = from.offset[a], *const step = steps.value[a];
    int* __restrict const to_cell = to.cell[a];
    Real* __restrict const to_offset = to.offset[a];
    for (std::size_t k = 0; k < from.count; ++k) {
      int at = cell[k];
      Real within = offset[k];
      move_along(at, within, part * step[k]);
      to_cell[k] = at, to_offset[k] = within;
    }
  }
}

/// A midpoint may lie beyond a wall; the field is asked at the nearest place inside.
template <int D, class Real>
void keep_inside(Sites<D, Real>& sites, const Lattice<D>& lattice) {
  for (int a = 0; a < D; ++a) {
    if (lattice.periodic[std::size_t(a)]) continue;
    const int last = lattice.cells[std::size_t(a)] - 1;
    const Real end = std::nextafter(Real(1), Real(0));
    int* __restrict const cell = sites.cell[a];
    Real* __restrict const offset = sites.offset[a];
    for (std::size_t k = 0; k < sites.count; ++k) {
      offset[k] = cell[k] < 0 ? Real(0) : cell[k] > last ? end : offset[k];
      cell[k] = std::clamp(cell[k], 0, last);
    }
  }
}

template <int D>
std::vector<std::size_t> modes_that_bend(const std::vector<ModeIndex<D>>& modes) {
  std::vector<std::size_t> bend;
  for (std::size_t r = 0; r < modes.size(); ++r)
    if (*std::max_element(modes[r].begin(), modes[r].end()) == 2) bend.push_back(r);
  return bend;
}

template <int kStages, int D, class Real>
double advect_in(const MacTransfer<D, Real>& transfer, const ActiveBlocks<D>& blocks, const FaceField<D, Real>& velocity, double dt,
               const Solids<D>& solids, const CellRanges& ranges, Particles<D, Real>& particles) {
  const Real cells = Real(dt / solids.cell);   // per m/s
  const bool thin = solids.has_thin();
  std::atomic<Real> longest = 0;   // square of it: the same whoever comes first
  with_near_field(transfer, blocks, velocity, ranges, particles.size(), [&](std::size_t begin, std::size_t end, auto& near) {
    // Stage by stage for some particles at a time: one particle's stages wait for each other, those of many do not.
    Sites<D, Real> from, sites;
    AtSites<D, Real> first, second, third;
    Real farthest = 0;
    for (; begin < end; begin += from.count) {
      from.load(particles, begin, end);
      const auto steps_at = [&](const Sites<D, Real>& at, AtSites<D, Real>& found) {
        near.velocities(at, found);
        for (int a = 0; a < D; ++a)
          for (std::size_t k = 0; k < at.count; ++k) found.value[a][k] *= cells;
      };
      const auto steps_after = [&](Real part, const AtSites<D, Real>& steps, AtSites<D, Real>& found) {
        move(from, part, steps, sites);
        keep_inside(sites, solids.lattice);
        steps_at(sites, found);
      };
      steps_at(from, first);
      steps_after(Real(0.5), first, second);
      if constexpr (kStages == 3) {
        steps_after(Real(0.75), second, third);
        for (int a = 0; a < D; ++a)
          for (std::size_t k = 0; k < sites.count; ++k)
            second.value[a][k] = (Real(2) * first.value[a][k] + Real(3) * second.value[a][k] + Real(4) * third.value[a][k]) / Real(9);
      }
      move(from, Real(1), second, sites);
      for (std::size_t k = 0; k < sites.count; ++k) {
        farthest = std::max(farthest, second[k].squaredNorm());
        Site<D, Real> site = sites[k];
        if (thin) solids.stop_in_thin(from[k], dt, site);
        particles.cell[begin + k] = solids.lattice.wrapped(site.cell);
        particles.offset[begin + k] = site.offset;
      }
    }
    for (Real seen = longest; farthest > seen && !longest.compare_exchange_weak(seen, farthest);) {}
  });
  return std::sqrt(double(longest.load()));
}

}  // namespace

template <int D, class Real>
double advect(const MacTransfer<D, Real>& transfer, const ActiveBlocks<D>& blocks, const FaceField<D, Real>& velocity, double dt, Advection method,
            const Solids<D>& solids, const CellRanges& ranges, Particles<D, Real>& particles) {
  if (method == Advection::rk3) return advect_in<3>(transfer, blocks, velocity, dt, solids, ranges, particles);
  return advect_in<2>(transfer, blocks, velocity, dt, solids, ranges, particles);
}

template <int D, class Real>
Shift<D> shift(const MacTransfer<D, Real>& transfer, const ActiveBlocks<D>& blocks, const FaceField<D, Real>& displacement, const Solids<D>& solids,
           const CellRanges& ranges, std::size_t block, Particles<D, Real>& particles) {
  std::array<int, D> gradient;   // of each axis: the mode that is linear along it, or -1
  for (int a = 0; a < D; ++a) {
    ModeIndex<D> linear{};
    linear[a] = 1;
    const auto found = std::find(transfer.modes().begin(), transfer.modes().end(), linear);
    gradient[a] = found == transfer.modes().end() ? -1 : int(found - transfer.modes().begin());
  }
  Shift<D> done;
  const bool thin = solids.has_thin();
  in_near_field(transfer, blocks, displacement, ranges, block, [&](std::size_t begin, std::size_t end, auto& near) {
    Sites<D, Real> from, sites;
    AtSites<D, Real> shifts;
    for (; begin < end; begin += from.count) {
      from.load(particles, begin, end);
      near.velocities(from, shifts);
      move(from, Real(1), shifts, sites);
      for (std::size_t k = 0; thin && k < sites.count; ++k) {
        Site<D, Real> site = sites[k];
        solids.stop_in_thin(from[k], 0, site);
        Moving<D, Real> probe{site, Vec<D, Real>::Zero()};
        if (site.cell != sites[k].cell || site.offset != sites[k].offset) solids.push_out(probe), sites.set(k, probe.site);
      }
      keep_inside(sites, solids.lattice);
      for (std::size_t k = 0; k < sites.count; ++k) {
        const std::size_t p = begin + k;
        const Site<D, Real> site = sites[k];
        const Vec<D, Real> by = shifts[k];
        for (int a = 0; a < D; ++a) done.by[a] += double(site.cell[std::size_t(a)] - from.cell[a][k]) + double(site.offset[a]) - double(from.offset[a][k]);
        particles.cell[p] = solids.lattice.wrapped(site.cell);
        particles.offset[p] = site.offset;
        for (int c = 0; c < D; ++c) {
          const auto v = particles.component(p, c);
          const double before = double(v[0]);
          for (int a = 0; a < D; ++a)
            if (gradient[a] >= 0) v[0] += v[std::size_t(gradient[a])] * by[a];
          done.kinetic += (double(v[0]) - before) * (double(v[0]) + before) / 2;
        }
      }
    }
  });
  return done;
}

template <int D, class Real>
Contacts push_out(const Solids<D>& solids, const std::vector<ModeIndex<D>>& modes, Particles<D, Real>& particles) {
  const std::vector<std::size_t> bend = modes_that_bend<D>(modes);
  return base::ordered_reduce(particles.size(), kChunk, Contacts{}, [&](std::size_t begin, std::size_t end) {
    Contacts contacts;
    for (std::size_t p = begin; p < end; ++p) {
      if (solids.is_far_inside(particles.cell[p])) continue;
      const Site<D, Real> site{particles.cell[p], particles.offset[p]};
      Moving<D, Real> probe{site, Vec<D, Real>::Zero()};   // few touch anything, and velocities lie far apart in memory
      if (solids.push_out(probe) == 0) continue;
      Moving<D, Real> particle{site, particles.velocity(p)};
      const double pushed = solids.push_out(particle);
      const bool drops = pushed > kFarPush && !bend.empty();
      particles.cell[p] = particle.site.cell;
      particles.offset[p] = particle.site.offset;
      for (int a = 0; a < D; ++a) {
        const auto c = particles.component(p, a);
        c[0] = particle.velocity[a];
        if (drops)
          for (const std::size_t r : bend) c[r] = 0;
      }
      ++contacts.pushed_out;
      contacts.dropped_modes += drops;
    }
    return contacts;
  }, [](const Contacts& a, const Contacts& b) { return Contacts{a.pushed_out + b.pushed_out, a.dropped_modes + b.dropped_modes}; });
}

template <int D, class Real>
std::int64_t remove_outside(const Lattice<D>& lattice, Particles<D, Real>& particles, Departure<D, Real>& departure) {
  std::size_t to = 0;
  const std::size_t all = particles.size(), row = particles.row();
  while (to < all && lattice.inside(particles.cell[to])) ++to;
  if (to == all) return 0;
  particles.settle();
  for (std::size_t p = to; p < all; ++p) {
    if (!lattice.inside(particles.cell[p])) continue;
    particles.cell[to] = particles.cell[p], particles.offset[to] = particles.offset[p], particles.id[to] = particles.id[p];
    std::copy_n(&particles.coefficients[p * row], row, &particles.coefficients[to * row]);
    if (!departure.cell.empty()) departure.cell[to] = departure.cell[p], departure.offset[to] = departure.offset[p];
    ++to;
  }
  particles.resize(to);
  if (!departure.cell.empty()) departure.cell.resize(to), departure.offset.resize(to);
  return std::int64_t(all - to);
}

template std::int64_t remove_outside(const Lattice<2>&, Particles<2, float>&, Departure<2, float>&);
template std::int64_t remove_outside(const Lattice<2>&, Particles<2, double>&, Departure<2, double>&);
template std::int64_t remove_outside(const Lattice<3>&, Particles<3, float>&, Departure<3, float>&);
template std::int64_t remove_outside(const Lattice<3>&, Particles<3, double>&, Departure<3, double>&);
template double advect(const MacTransfer<2, float>&, const ActiveBlocks<2>&, const FaceField<2, float>&, double, Advection, const Solids<2>&,
                     const CellRanges&, Particles<2, float>&);
template Shift<2> shift(const MacTransfer<2, float>&, const ActiveBlocks<2>&, const FaceField<2, float>&, const Solids<2>&, const CellRanges&,
                    std::size_t, Particles<2, float>&);
template double advect(const MacTransfer<2, double>&, const ActiveBlocks<2>&, const FaceField<2, double>&, double, Advection, const Solids<2>&,
                     const CellRanges&, Particles<2, double>&);
template Shift<2> shift(const MacTransfer<2, double>&, const ActiveBlocks<2>&, const FaceField<2, double>&, const Solids<2>&, const CellRanges&,
                    std::size_t, Particles<2, double>&);
template double advect(const MacTransfer<3, float>&, const ActiveBlocks<3>&, const FaceField<3, float>&, double, Advection, const Solids<3>&,
                     const CellRanges&, Particles<3, float>&);
template Shift<3> shift(const MacTransfer<3, float>&, const ActiveBlocks<3>&, const FaceField<3, float>&, const Solids<3>&, const CellRanges&,
                    std::size_t, Particles<3, float>&);
template double advect(const MacTransfer<3, double>&, const ActiveBlocks<3>&, const FaceField<3, double>&, double, Advection, const Solids<3>&,
                     const CellRanges&, Particles<3, double>&);
template Shift<3> shift(const MacTransfer<3, double>&, const ActiveBlocks<3>&, const FaceField<3, double>&, const Solids<3>&, const CellRanges&,
                    std::size_t, Particles<3, double>&);
template Contacts push_out<2, float>(const Solids<2>&, const std::vector<ModeIndex<2>>&, Particles<2, float>&);
template Contacts push_out<2, double>(const Solids<2>&, const std::vector<ModeIndex<2>>&, Particles<2, double>&);
template Contacts push_out<3, float>(const Solids<3>&, const std::vector<ModeIndex<3>>&, Particles<3, float>&);
template Contacts push_out<3, double>(const Solids<3>&, const std::vector<ModeIndex<3>>&, Particles<3, double>&);

}  // namespace sim
