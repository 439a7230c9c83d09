#include "sim/fluid/step.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.h"
#include "sim/effects/potential.h"
#include "sim/fluid/advect.h"
#include "sim/fluid/particle_pressure.h"

namespace sim {
namespace {

template <int D, class Real>
std::int64_t bytes_of(const Particles<D, Real>& particles) {
  return std::int64_t(particles.size() * (sizeof(Cell<D>) + sizeof(Vec<D, Real>) + particles.row() * sizeof(Real)));
}

/// Thin liquid that flies at a solid, with air behind it, is stopped while it crosses the cell before it; `crossing` is the step over a cell's edge
/// [s/m]. No pressure does that, and particles that lie at the solid keep the speed of the cell's far face in their modes: gravity would feed it for
/// ever, and what an impact left there would shorten every step.
template <int D, class Real>
void stop_at_solids(FaceField<D, Real>& v, double crossing, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  const auto kind_of = [&](std::ptrdiff_t j) { return value_at(cells.kind, j, CellKind::air); };
  for (const std::size_t i : cells.thin)
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1}) {
        const std::ptrdiff_t upper = blocks.neighbour(i, a, 1), far = side ? std::ptrdiff_t(i) : upper, at = side ? upper : std::ptrdiff_t(i);
        if (far < 0 || kind_of(blocks.neighbour(i, a, side)) != CellKind::solid || kind_of(blocks.neighbour(i, a, 1 - side)) != CellKind::air) continue;
        const double solid = at < 0 ? 0 : cells.open.pushed(a, std::size_t(at)), sign = side ? 1 : -1;
        const double towards = sign * (double(v[a][std::size_t(far)]) - solid);
        if (towards > 0) v[a][std::size_t(far)] = Real(solid + sign * towards / (1 + towards * crossing));
      }
}

}  // namespace

template <int D, class Real>
FluidStep<D, Real>::FluidStep(const Options& options, const Solids<D>& solids, bool free_surface, const Sources<D>* sources)
    : options_(options), solids_(solids), sources_(sources), blocks_(free_surface ? ActiveBlocks<D>(solids.lattice) : ActiveBlocks<D>::whole(solids.lattice)),
      free_surface_(free_surface), transfer_(options.kernel, mode_set<D>(options.transfer, options.kernel, options.modes)) {
  cells_.open_sides = solids.open;
}

template <int D, class Real>
int FluidStep<D, Real>::layers() const {
  return int(std::ceil(std::sqrt(3.0) * options_.cfl)) + 3;
}

template <int D, class Real>
void FluidStep<D, Real>::scatter(Particles<D, Real>& particles, double dt, base::Ledger& ledger) {
  displaces_ = departed_ = false;
  {
    const auto pass = ledger.pass("sort", 2 * bytes_of(particles));
    ranges_ = order_.sort(particles, solids_.lattice, transfer_.home());
    ledger.hold("order", order_.bytes(particles));
    // Stencils reach two places beyond a cell; from there the field goes on into the air, and whoever reads at its rim looks one further.
    if (free_surface_) blocks_.cover(ranges_, layers() + 3);
  }
  if (options_.audit) {
    const auto pass = ledger.pass("audit", bytes_of(particles));
    particle_mass_ = particles.mass, mass_ = particles.mass * double(particles.size());
    audit_.begin(energy(particles));
  }
  {
    const auto pass = ledger.pass("p2g", bytes_of(particles) + 4 * grid_bytes());
    transfer_.scatter(particles, ranges_, blocks_, grid_);
    counts_.light_faces += grid_.light_faces;
  }
  audit("p2g", grid_.velocity, ledger);
  find_held(particles, ledger);
  {
    const auto pass = ledger.pass("pressure", std::int64_t(blocks_.size()));
    cells_.open.update(solids_, blocks_, sources_);
    cells_.kind = classify_cells(ranges_, blocks_, solids_, cells_.open, free_surface_);
    filling_ = cell_filling(ranges_, blocks_, double(options_.particles_per_cell));
    if (free_surface_) find_surface(grid_.mass, filling_, double(options_.particles_per_cell), cells_, blocks_);
  }
  // Faces that no particle reached take their neighbours' velocity; FLIP needs the field as deep as the one it will be compared with.
  {
    const auto pass = ledger.pass("extrapolate", 2 * grid_bytes());
    constexpr int kShallow = 2;
    for (int a = 0; a < D; ++a) {
      valid_[a].resize(blocks_.size());
      struct Sums {
        double mass = 0, momentum = 0;
      };
      const Sums sums = base::ordered_reduce(blocks_.size(), 65536, Sums{}, [&](std::size_t begin, std::size_t end) {
        Sums s;
        for (std::size_t first = begin; first < end; first += 64) {   // short sums in Real, as long as a row of lanes can add them
          std::array<Real, 8> mass{}, momentum{};
          const std::size_t last = std::min(end, first + 64);
          for (std::size_t i = first; i < last; ++i) {
            const Real m = grid_.mass[a][i];
            valid_[a][i] = double(m) > kLightestNode;
            mass[(i - first) % 8] += m, momentum[(i - first) % 8] += m * grid_.velocity[a][i];
          }
          for (std::size_t l = 0; l < 8; ++l) s.mass += double(mass[l]), s.momentum += double(momentum[l]);
        }
        return s;
      }, [](const Sums& s, const Sums& t) { return Sums{s.mass + t.mass, s.momentum + t.momentum}; });
      scattered_sums_.mass[a] = sums.mass, scattered_sums_.momentum[a] = sums.momentum;
    }
    stop_at_solids(grid_.velocity, dt / options_.cell, cells_, blocks_);
    extrapolate(grid_.velocity, valid_, blocks_, options_.transfer == Transfer::flip ? layers() : kShallow);
    scattered_ = grid_.velocity;
  }
  audit("extrapolate", scattered_, ledger);
  scattered_audit_ = audit_;
}

template <int D, class Real>
double FluidStep<D, Real>::project(const base::Vec3& push, base::Ledger& ledger) {
  audit_ = scattered_audit_;
  pushed_ = false;
  for (int a = 0; a < D; ++a) pushed_ = pushed_ || (options_.periodic(a) && push[a] != 0);   // in a full domain walls take all else
  if (push.isZero(0)) {
    grid_.velocity = scattered_;
  } else {
    const auto pass = ledger.pass("forces", 2 * grid_bytes());
    for (int a = 0; a < D; ++a) {
      const Real change = Real(push[a]);
      base::parallel_chunks(blocks_.size(), 65536, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) grid_.velocity[a][i] = scattered_[a][i] + change;
      });
    }
  }
  if (!push.isZero(0)) audit("forces", grid_.velocity, ledger);
  PressureReport report;
  {
    auto pass = ledger.pass("pressure", 4 * grid_bytes());
    report = projection_.project(grid_.velocity, cells_, blocks_, options_.pressure_tolerance, valid_);
    pass.count(report.bytes);
    see_covered_parts(grid_.velocity, /*moves=*/true, cells_, blocks_, valid_);
    if (options_.write.pressure) {
      pressure_ = projection_.pressure();
      pressure_.resize(blocks_.size(), 0.0);   // nothing was solved where there is no liquid
    }
    open_inflow();
  }
  audit("pressure", grid_.velocity, ledger);
  counts_.pressure_iterations += report.iterations;
  counts_.pressure_fallbacks += report.fell_back;
  counts_.max_divergence = report.max_divergence / options_.cell;
  if (report.closed_pockets > 0) counts_.imbalance = std::max(counts_.imbalance.value_or(0), report.imbalance / options_.cell);
  solid_work_ = report.solid_work;
  const auto pass = ledger.pass("sums", grid_bytes());
  Real fastest = 0;
  for (int a = 0; a < D; ++a)
    fastest = base::ordered_reduce(blocks_.size(), 65536, fastest, [&](std::size_t begin, std::size_t end) {
      Real most = 0;
      for (std::size_t i = begin; i < end; ++i)
        if (valid_[a][i]) most = std::max(most, std::abs(grid_.velocity[a][i]));
      return most;
    }, [](Real x, Real y) { return std::max(x, y); });
  return double(fastest);
}

template <int D, class Real>
void FluidStep<D, Real>::gather(const GatherRule& rule, Particles<D, Real>& particles, base::Ledger& ledger) {
  {
    const auto pass = ledger.pass("extrapolate", 2 * grid_bytes());
    extrapolate(grid_.velocity, valid_, blocks_, layers());
  }
  audit("extrapolate", grid_.velocity, ledger);
  const auto after = shift_after(particles, ledger);
  {
    const auto pass = ledger.pass("g2p", bytes_of(particles) + grid_bytes());
    if (ranges_.occupied.empty()) transfer_.gather(blocks_, grid_.velocity, &scattered_, rule, particles);
    else transfer_.gather(ranges_, blocks_, grid_.velocity, &scattered_, rule, particles, after);
  }
  if (free_surface_) {
    const auto pass = ledger.pass("extrapolate", grid_bytes());
    carry_on_outflow(grid_.velocity, valid_, cells_, blocks_);
  }
  audit("g2p", particles, ledger);
}

template <int D, class Real>
void FluidStep<D, Real>::depart(const Particles<D, Real>& particles, base::Ledger& ledger) {
  if (options_.carry == Carry::fixed) return;
  const auto bytes = std::int64_t(particles.size() * (sizeof(Cell<D>) + sizeof(Vec<D, Real>)));
  const auto pass = ledger.pass("carry", 2 * bytes);
  departure_.cell = particles.cell, departure_.offset = particles.offset;
  ledger.hold("departures", bytes);
}

template <int D, class Real>
void FluidStep<D, Real>::find_held(const Particles<D, Real>& particles, base::Ledger& ledger) {
  held_.clear();
  if (!sources_ || !sources_->acts()) return;
  const auto pass = ledger.pass("source", std::int64_t(particles.size() * sizeof(Cell<D>)));
  held_ = base::ordered_reduce(particles.size(), 16384, std::vector<Held>{}, [&](std::size_t begin, std::size_t end) {
    std::vector<Held> found;
    for (std::size_t p = begin; p < end; ++p)
      if (const int source = sources_->at(particles.cell[p]); source != Sources<D>::kNone)
        found.push_back({p, {particles.cell[p], particles.offset[p]}, source, 0.5 * double(particles.velocity(p).squaredNorm())});
    return found;
  }, [](std::vector<Held> all, const std::vector<Held>& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
}

template <int D, class Real>
void FluidStep<D, Real>::open_inflow() {
  for (int s = 0; sources_ && s < sources_->count(); ++s) {
    if (!sources_->acts(s)) continue;
    for (const auto& [cell, axis] : sources_->upstream(s)) {
      if (sources_->at(cell) != s) continue;
      const double velocity = sources_->velocity(s)[axis];
      Cell<D> above = cell, outside = cell;
      outside[std::size_t(axis)] += velocity > 0 ? -1 : 1;
      if (velocity < 0) ++above[std::size_t(axis)];
      const std::ptrdiff_t face = blocks_.index(solids_.lattice.wrapped(above));
      if (face >= 0 && value_at(cells_.kind, blocks_.index(solids_.lattice.wrapped(outside)), CellKind::air) == CellKind::air)
        grid_.velocity[std::size_t(axis)][std::size_t(face)] = Real(velocity);
    }
  }
}

template <int D, class Real>
void FluidStep<D, Real>::move_held(double dt, Particles<D, Real>& particles, base::Ledger& ledger) {
  source_work_ = 0;
  if (!sources_ || !sources_->acts()) return;
  {
    const auto pass = ledger.pass("source", std::int64_t(particles.size() * sizeof(Cell<D>) + held_.size() * (sizeof(Held) + particles.row() * sizeof(Real))));
    base::parallel_chunks(particles.size(), 16384, [&](std::size_t begin, std::size_t end) {
      auto own = std::lower_bound(held_.begin(), held_.end(), begin, [](const Held& held, std::size_t p) { return held.particle < p; });
      for (std::size_t p = begin; p < end; ++p) {
        if (own != held_.end() && own->particle == p) {
          ++own;
          continue;
        }
        if (sources_->at(particles.cell[p]) == Sources<D>::kNone) continue;
        Site<D, Real> site{particles.cell[p], particles.offset[p]};
        sources_->push_out(solids_, site);
        particles.cell[p] = site.cell, particles.offset[p] = site.offset;
      }
    });
    source_work_ = base::ordered_reduce(held_.size(), 4096, 0.0, [&](std::size_t begin, std::size_t end) {
      double work = 0;
      for (std::size_t n = begin; n < end; ++n) {
        Held& held = held_[n];
        const base::Vec3 moved = sources_->velocity(held.source);
        const Vec<D, Real> velocity = moved.template head<D>().template cast<Real>();
        held.site.move(Real(dt / options_.cell) * velocity);
        particles.cell[held.particle] = solids_.lattice.wrapped(held.site.cell);
        particles.offset[held.particle] = held.site.offset;
        for (int a = 0; a < D; ++a) {
          const auto c = particles.component(held.particle, a);
          c[0] = velocity[a];
          for (std::size_t r = 1; r < c.size(); ++r) c[r] = 0;
        }
        work += 0.5 * moved.squaredNorm() - held.kinetic - dt * down_.dot(moved);
      }
      return work;
    }, [](double s, double t) { return s + t; });
  }
  audit("source", particles, ledger);
}

template <int D, class Real>
typename MacTransfer<D, Real>::After FluidStep<D, Real>::shift_after(Particles<D, Real>& particles, base::Ledger& ledger) {
  if (!displaces_ || options_.audit) return {};
  displaces_ = false;
  if (!std::exchange(departed_, true)) depart(particles, ledger);
  shifted_.resize(ranges_.occupied.size());
  return [this, &particles](std::size_t block) { shifted_[block] = shift(transfer_, blocks_, displacement_, solids_, ranges_, block, particles); };
}

template <int D, class Real>
void FluidStep<D, Real>::gather_reflected(const GatherRule& rule, Particles<D, Real>& particles, base::Ledger& ledger) {
  {
    const auto pass = ledger.pass("reflect", 3 * grid_bytes());
    for (int a = 0; a < D; ++a) {
      reflected_[a].resize(blocks_.size());
      base::parallel_chunks(blocks_.size(), 65536, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) reflected_[a][i] = 2 * grid_.velocity[a][i] - scattered_[a][i];
      });
    }
  }
  audit("reflect", reflected_, ledger);
  {
    const auto pass = ledger.pass("extrapolate", 4 * grid_bytes());
    extrapolate(reflected_, valid_, blocks_, layers());
    extrapolate(grid_.velocity, valid_, blocks_, layers());
    if (free_surface_) carry_on_outflow(grid_.velocity, valid_, cells_, blocks_);
  }
  audit("extrapolate", reflected_, ledger);
  if (options_.write.pressure) mirrored_pressure_ = {blocks_, cells_.kind, pressure_};
  const auto after = shift_after(particles, ledger);
  {
    const auto pass = ledger.pass("g2p", bytes_of(particles) + grid_bytes());
    transfer_.gather(ranges_, blocks_, reflected_, &scattered_, rule, particles, after);
  }
  audit("g2p", particles, ledger);
}

template <int D, class Real>
bool FluidStep<D, Real>::foresee(double dt) {
  // What a force just gave does not go on; faces that a solid sweeps over, or a source holds, were others before.
  if (past_.motion == 0 || pushed_ || solids_.speed() > 0 || (sources_ && sources_->acts())) return false;
  const Real part = Real(std::min(1.0, dt / (2 * past_.motion))), most = Real(2 * options_.cfl * options_.cell / dt);   // as fast as a projection may be
  for (int a = 0; a < D; ++a)
    base::parallel_chunks(blocks_.size(), 65536, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Real now = grid_.velocity[a][i], bound = std::max(most, std::abs(now));
        past_.velocity[a][i] = std::clamp(now + part * (now - past_.velocity[a][i]), -bound, bound);
      }
    });
  return true;
}

template <int D, class Real>
double FluidStep<D, Real>::move(double dt, bool reflects, Particles<D, Real>& particles, base::Ledger& ledger) {
  CellRanges ranges = std::exchange(ranges_, {});
  if (!std::exchange(departed_, false)) depart(particles, ledger);
  if (displaces_) {
    // Both are of the places before the motion; the shift comes first, and the motion takes over where it ends.
    const auto pass = ledger.pass("volume", bytes_of(particles));
    shifted_.resize(ranges.occupied.size());
    base::parallel_chunks(ranges.occupied.size(), 1, [&](std::size_t b, std::size_t) {
      shifted_[b] = shift(transfer_, blocks_, displacement_, solids_, ranges, b, particles);
    });
  }
  if (std::exchange(displaces_, false)) audit("volume", particles, ledger);
  double way;
  {
    const auto pass = ledger.pass("advect", bytes_of(particles) + 2 * grid_bytes());
    const bool ahead = reflects && foresee(dt);
    way = advect(transfer_, blocks_, ahead ? past_.velocity : grid_.velocity, dt, options_.advection, solids_, ranges, particles);
  }
  if (has_past()) past_.velocity = grid_.velocity, past_.motion = dt;
  audit("advect", particles, ledger);
  move_held(dt, particles, ledger);
  if (solids_.any()) {
    {
      const auto pass = ledger.pass("collide", bytes_of(particles));
      const Contacts contacts = push_out<D, Real>(solids_, transfer_.modes(), particles);
      counts_.pushed_out += contacts.pushed_out;
      counts_.dropped_modes += contacts.dropped_modes;
      const std::int64_t left = remove_outside(solids_.lattice, particles, departure_);
      counts_.left += left;
      if (left > 0) ranges = {};
    }
    audit("collide", particles, ledger);
  }
  if (options_.carry == Carry::fixed) return way;
  {
    const auto pass = ledger.pass("carry", 2 * bytes_of(particles));
    counts_.limited_modes += transfer_.limit(ranges, blocks_, departure_, grid_.mass, options_.carry, particles);
  }
  audit("carry", particles, ledger);
  return way;
}

template <int D, class Real>
void FluidStep<D, Real>::audit_in_frame(const base::Vec3& moving, const Particles<D, Real>& particles) {
  audited_frame_ = moving, mass_ = particles.mass * double(particles.size());
  audit_.clear(), audit_.begin(energy(particles));
}

template <int D, class Real>
EnergyAudit::Energy FluidStep<D, Real>::energy(const Particles<D, Real>& particles) const {
  return {audited_energy(transfer_.sums(particles, options_.cell)), potential_energy(particles, down_, options_)};
}

template <int D, class Real>
double FluidStep<D, Real>::audited_energy(const typename MacTransfer<D, Real>::Sums& sums) const {
  return sums.kinetic_energy - audited_frame_.dot(sums.linear_momentum) + 0.5 * mass_ * audited_frame_.squaredNorm();
}

template <int D, class Real>
void FluidStep<D, Real>::audit(std::string_view stage, const Particles<D, Real>& particles, base::Ledger& ledger) {
  if (!options_.audit) return;
  const auto pass = ledger.pass("audit", bytes_of(particles));
  if (stage == "advect") audit_.moved(energy(particles));
  else audit_.reached(stage, energy(particles));
}

template <int D, class Real>
void FluidStep<D, Real>::audit(std::string_view stage, const FaceField<D, Real>& velocity, base::Ledger& ledger) {
  if (!options_.audit) return;
  const auto pass = ledger.pass("audit", 2 * grid_bytes());
  const MacVelocity<D, Real> field{velocity, grid_.mass, 0};
  audit_.reached(stage, audited_energy(transfer_.sums(blocks_, field, particle_mass_, options_.cell)));
}

template <int D, class Real>
std::vector<float> FluidStep<D, Real>::pressure_at(const Particles<D, Real>& particles, double dt, bool reflected) const {
  if (pressure_.empty()) return std::vector<float>(particles.size(), 0.0f);
  const double density = particles.mass * double(options_.particles_per_cell) / std::pow(options_.cell, D);   // [kg/m^3]
  const double scale = density * options_.cell / dt;
  std::vector<float> found = particle_pressure(pressure_, scale, cells_.kind, blocks_, particles);
  if (!reflected) return found;
  const auto& mirrored = mirrored_pressure_;
  const std::vector<float> twice = particle_pressure(mirrored.values, 2 * scale, mirrored.kind, mirrored.blocks, particles);
  for (std::size_t p = 0; p < found.size(); ++p) found[p] += twice[p];
  return found;
}

template <int D, class Real>
void FluidStep<D, Real>::correct_volume(double gain, double aim, base::Ledger& ledger) {
  constexpr double kTolerance = 1e-2;
  const auto pass = ledger.pass("volume", 2 * grid_bytes());
  std::vector<float> growth = excess_filling(filling_, aim, cells_, blocks_);
  for (float& g : growth) g *= float(gain);
  projection_.displace(displacement_, growth, cells_, blocks_, kTolerance, displaced_);
  see_covered_parts(displacement_, /*moves=*/false, cells_, blocks_, displaced_);
  extrapolate(displacement_, displaced_, blocks_, 3);
  displaces_ = true;
}

template <int D, class Real>
double FluidStep<D, Real>::shift_work() const {
  double work = 0;
  for (const Shift<D>& block : shifted_) work += block.kinetic - options_.cell * down_.head<D>().dot(block.by);
  return work;
}

template <int D, class Real>
void FluidStep<D, Real>::set_velocity(const ActiveBlocks<D>& blocks, FaceField<D, Real> field) {
  blocks_ = blocks;
  grid_.velocity = std::move(field);
  scattered_ = grid_.velocity;
  past_ = {};
  for (auto& valid : valid_) valid.assign(blocks_.size(), 1);
  for (auto& mass : grid_.mass) mass.assign(blocks_.size(), Real(options_.particles_per_cell));   // nothing is light
}

template class FluidStep<2, float>;
template class FluidStep<2, double>;
template class FluidStep<3, float>;
template class FluidStep<3, double>;

}  // namespace sim
