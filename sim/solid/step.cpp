#include "sim/solid/step.h"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/effects/gravity.h"
#include "sim/effects/potential.h"
#include "sim/transfer/carry.h"
#include "sim/transfer/tensor.h"
#include "sim/transfer/node_runs.h"

namespace sim {
namespace {

constexpr int kDepth = 2;   // places around particles that stencils reach

template <int D, class Real>
std::int64_t bytes_of(const std::vector<Group<D, Real>>& groups, bool with_deformation) {
  std::size_t bytes = 0;
  for (const Group<D, Real>& g : groups) {
    const std::size_t moving = sizeof(Cell<D>) + sizeof(Vec<D, Real>) + g.particles.row() * sizeof(Real) + sizeof(std::int64_t);
    bytes += g.particles.size() * (moving + (with_deformation ? sizeof(Deformation<Real, D>) + sizeof(Stress<D, Real>) : 0));
  }
  return std::int64_t(bytes);
}

}  // namespace

template <int D>
Scheme<D>::Scheme(const Options& o) : modes(mode_set<D>(o.transfer, Kernel::quadratic, o.modes)), flip(o.transfer == Transfer::flip), carry(o.carry) {
  for (const ModeIndex<D>& mode : modes) {
    place.push_back(tensor_place<3, D>(mode));
    bent.push_back(bent_axes<D>(mode));
    bends = bends || bent.back() != 0;
  }
  if (!bends) carry = Carry::fixed;
}

template <int D, class Real>
SolidStep<D, Real>::SolidStep(const Scene& scene, const Solids<D>& solids)
    : cell_(scene.options.cell), solids_(solids), contacts_(scene, solids), bodies_(scene), blocks_(solids.lattice), grid_(bodies_.fields()),
      before_(bodies_.fields()), audits_(scene.options.audit), down_(downhill(gravity(scene), scene.options)) {}

template <int D, class Real>
void SolidStep<D, Real>::merge(const Groups& groups) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  if (groups.size() == 1) {
    merged_ = groups[0].ranges;
    at_.assign(1, std::vector<std::int32_t>(merged_.occupied.size()));
    std::iota(at_[0].begin(), at_[0].end(), 0);
    return;
  }
  merged_.occupied.clear();
  for (const auto& g : groups) merged_.occupied.insert(merged_.occupied.end(), g.ranges.occupied.begin(), g.ranges.occupied.end());
  std::sort(merged_.occupied.begin(), merged_.occupied.end());
  merged_.occupied.erase(std::unique(merged_.occupied.begin(), merged_.occupied.end()), merged_.occupied.end());
  merged_.begin.assign(merged_.occupied.size() * per_block + 1, 0);
  at_.assign(groups.size(), std::vector<std::int32_t>(merged_.occupied.size(), -1));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const CellRanges& own = groups[g].ranges;
    for (std::size_t b = 0, m = 0; b < own.occupied.size(); ++b) {
      while (merged_.occupied[m] != own.occupied[b]) ++m;
      at_[g][m] = std::int32_t(b);
      for (std::size_t k = 0; k < per_block; ++k)
        merged_.begin[m * per_block + k + 1] += own.begin[b * per_block + k + 1] - own.begin[b * per_block + k];
    }
  }
  for (std::size_t k = 1; k < merged_.begin.size(); ++k) merged_.begin[k] += merged_.begin[k - 1];
}

template <int D, class Real>
void SolidStep<D, Real>::scatter(double dt, Groups& groups, base::Ledger& ledger) {
  {
    const auto pass = ledger.pass("sort", 2 * bytes_of(groups, false));
    order_.resize(groups.size());
    flip_ = false;
    std::int64_t held = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      Group<D, Real>& group = groups[g];
      group.ranges = order_[g].sort(group.particles, blocks_.lattice(), Home::nearest_node);
      if (group.particles.rows.empty()) {   // short rows moved, these go with them
        order_[g].move_along(group.deformation, group.next);
        order_[g].move_along(group.stress, group.spare_stress);
      }
      held += order_[g].bytes(group.particles);
      flip_ = flip_ || group.scheme.flip;
    }
    ledger.hold("order", held);
    merge(groups);
    blocks_.cover(merged_, kDepth);
  }
  unit_mass_ = std::numeric_limits<double>::max();
  for (const auto& g : groups) unit_mass_ = std::min(unit_mass_, g.particles.mass);
  for (auto& g : groups) g.weight = g.particles.mass / unit_mass_;
  if (audits_) {   // once more, without stress
    const auto pass = ledger.pass("audit", bytes_of(groups, true) + 2 * grid_bytes());
    before_step_ = energy(groups);
    audit_.begin({before_step_.kinetic, before_step_.place + before_step_.elastic});
    sum_on_nodes(0, groups);
    audit_.reached("p2g", grid_energy(/*divided=*/false));
  }
  const auto pass = ledger.pass("p2g", bytes_of(groups, true) + 2 * grid_bytes());
  sum_on_nodes(dt, groups);
}

template <int D, class Real>
void SolidStep<D, Real>::sum_on_nodes(double dt, const Groups& groups) {
  const auto clear = [&](NodeVelocity<D, Real>& grid) {
    grid.velocity.assign(blocks_.size(), Vec<D, Real>::Zero());
    grid.mass.assign(blocks_.size(), 0);
  };
  for (NodeVelocity<D, Real>& grid : grid_) clear(grid);
  if (flip_)
    for (NodeVelocity<D, Real>& grid : before_) clear(grid);
  const Lattice<D>& lattice = blocks_.lattice();
  std::array<std::vector<std::uint32_t>, Lattice<D>::kColours> colours;
  for (std::size_t b = 0; b < merged_.occupied.size(); ++b)
    colours[lattice.colour(lattice.block_at(merged_.occupied[b]))].push_back(std::uint32_t(b));
  for (const auto& same : colours)
    base::parallel_chunks(same.size(), 1, [&](std::size_t k, std::size_t) {
      const std::size_t b = same[k];
      const Cell<D> block = lattice.block_at(merged_.occupied[b]);
      for (std::size_t f = 0; f < grid_.size(); ++f) {
        const auto& bodies = bodies_.bodies(f);
        if (std::all_of(bodies.begin(), bodies.end(), [&](std::size_t g) { return at_[g][b] < 0; })) continue;
        NodeSums<D, Real> sums;
        for (const std::size_t g : bodies) {
          const std::int32_t own = at_[g][b];
          if (own < 0) continue;
          const double impulse = -dt * groups[g].rest_volume / (cell_ * unit_mass_);
          sums.add(groups[g], std::size_t(own), block, lattice, impulse);
        }
        NodeVelocity<D, Real>&grid = grid_[f], &before = before_[f];
        blocks_.template for_tile<NodeSums<D, Real>::kEdge>(block, [&](int from, std::size_t to, auto count) {
          const auto first = std::size_t(from * (D + 1));
          add_nodes<D>(&sums.carried[first], count, &grid.mass[to], grid.velocity[to].data());
          if (flip_) add_nodes<D>(&sums.before[first], count, &before.mass[to], before.velocity[to].data());
        });
      }
    });
}

template <int D, class Real>
PlaceSet<D> SolidStep<D, Real>::find_touched(const Groups& groups, std::size_t field) const {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  PlaceSet<D> touched(blocks_);
  for (const std::size_t body : bodies_.bodies(field)) {
    const Group<D, Real>& group = groups[body];
    base::parallel_chunks(group.ranges.occupied.size(), 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        if (!contacts_.is_near(blocks_.lattice().block_at(group.ranges.occupied[b]))) continue;
        for (std::size_t p = group.ranges.begin[b * per_block]; p < group.ranges.begin[(b + 1) * per_block]; ++p) {
          const Site<D, double> site{group.particles.cell[p], group.particles.offset[p].template cast<double>()};
          if (!contacts_.touches(site)) continue;
          Cell<D> first = site.cell;
          for (int a = 0; a < D; ++a) first[a] += int(site.offset[a] >= 0.5) - 1;
          for (const std::ptrdiff_t node : blocks_.template places<3>(first))
            if (node >= 0) touched.insert_beside_others(std::size_t(node));
        }
      }
    });
  }
  return touched;
}

template <int D, class Real>
void SolidStep<D, Real>::update(double dt, const base::Vec3& acceleration, const Groups& groups, base::Ledger& ledger) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  {
    const auto pass = ledger.pass("grid_update", 2 * grid_bytes());
    struct Sums {
      std::int64_t light = 0;
      double mass = 0;
      Vec<D, double> momentum = Vec<D, double>::Zero();
    };
    const auto divide = [](NodeVelocity<D, Real>& grid, std::size_t i) {   // momentum by mass; false where there is next to none
      const Real mass = grid.mass[i];
      const bool valid = double(mass) > kLightestNode;
      grid.velocity[i] = valid ? Vec<D, Real>(grid.velocity[i] / mass) : Vec<D, Real>(Vec<D, Real>::Zero());
      return valid;
    };
    const auto add = [](const Sums& a, const Sums& b) { return Sums{a.light + b.light, a.mass + b.mass, a.momentum + b.momentum}; };
    Sums sums;
    for (std::size_t f = 0; f < grid_.size(); ++f) {
      NodeVelocity<D, Real>& grid = grid_[f];
      sums = add(sums, base::ordered_reduce(blocks_.size(), 65536, Sums{}, [&](std::size_t begin, std::size_t end) {
        Sums s;
        for (std::size_t i = begin; i < end; ++i) {
          s.mass += double(grid.mass[i]), s.momentum += grid.velocity[i].template cast<double>();
          s.light += !divide(grid, i) && grid.mass[i] > 0;
          if (flip_) divide(before_[f], i);
        }
        return s;
      }, add));
    }
    counts_.light_nodes += sums.light;
    scattered_ = {unit_mass_ * sums.mass, base::Vec3::Zero()};
    scattered_.momentum.template head<D>() = unit_mass_ * sums.momentum;
  }
  audit_update("stress", ledger);
  if (!acceleration.isZero(0)) {
    const auto pass = ledger.pass("forces", 2 * grid_bytes());
    const Vec<D, Real> change = (dt * acceleration).head<D>().template cast<Real>();
    for (NodeVelocity<D, Real>& grid : grid_)
      base::parallel_chunks(blocks_.size(), 65536, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
          if (double(grid.mass[i]) > kLightestNode) grid.velocity[i] += change;
      });
  }
  audit_update("forces", ledger);
  if (grid_.size() > 1) {
    const auto pass = ledger.pass("contact", grid_bytes());
    bodies_.apply(blocks_, groups, grid_);
  }
  if (grid_.size() > 1) audit_update("contact", ledger);
  collider_work_ = 0;
  if (contacts_.empty()) return;
  {
    const auto pass = ledger.pass("collide", grid_bytes());
    contacts_.follow();
    for (std::size_t f = 0; f < grid_.size(); ++f) {
      const PlaceSet<D> touched = find_touched(groups, f);
      NodeVelocity<D, Real>& grid = grid_[f];
      collider_work_ += unit_mass_ * base::ordered_reduce(blocks_.count(), 64, 0.0, [&](std::size_t begin, std::size_t end) {
        double work = 0;
        for (std::size_t slot = begin; slot < end; ++slot)
          work += contacts_.apply(blocks_.block(slot), touched[slot], &grid.mass[slot * per_block], &grid.velocity[slot * per_block]);
        return work;
      }, [](double a, double b) { return a + b; });
    }
  }
  audit_update("collide", ledger);
}

template <int D, class Real>
SolidEnergy SolidStep<D, Real>::energy(const Groups& groups) const {
  SolidEnergy all;
  for (const Group<D, Real>& g : groups) all.add(energy_of(g, down_, cell_));
  return all;
}

template <int D, class Real>
double SolidStep<D, Real>::grid_energy(bool divided) const {
  double all = 0;
  for (const NodeVelocity<D, Real>& grid : grid_)
    all += base::ordered_reduce(blocks_.size(), 65536, 0.0, [&](std::size_t begin, std::size_t end) {
      double sum = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const double mass = double(grid.mass[i]), square = grid.velocity[i].template cast<double>().squaredNorm();
        if (mass > kLightestNode) sum += 0.5 * unit_mass_ * (divided ? mass * square : square / mass);
      }
      return sum;
    }, [](double a, double b) { return a + b; });
  return all;
}

template <int D, class Real>
void SolidStep<D, Real>::audit_update(std::string_view stage, base::Ledger& ledger) {
  if (!audits_) return;
  const auto pass = ledger.pass("audit", grid_bytes());
  audit_.reached(stage, grid_energy(/*divided=*/true));
}

template <int D, class Real>
std::string SolidStep<D, Real>::place_of(const Particles<D, Real>& particles, std::size_t p) const {
  base::Vec3 x = solids_.origin;
  x.template head<D>() += cell_ * particles.place(p);
  std::string cell = fmt::format("cell ({}", particles.cell[p][0]);
  for (int a = 1; a < D; ++a) cell += fmt::format(", {}", particles.cell[p][a]);
  return cell + fmt::format("), ({:.4g}, {:.4g}, {:.4g}) m", x.x(), x.y(), x.z());
}

template <int D, class Real>
LostParticle SolidStep<D, Real>::lost_particle(const Groups& groups, std::size_t group, std::int64_t id) const {
  const Particles<D, Real>& particles = groups[group].particles;
  const auto p = std::size_t(std::find(particles.id.begin(), particles.id.end(), id) - particles.id.begin());
  return {group, id, place_of(particles, p)};
}

template <int D, class Real>
StepLimits SolidStep<D, Real>::gather(double dt, double keep, Groups& groups, base::Ledger& ledger) {
  StepLimits limits;
  GatherAudit parts;
  {
    const auto pass = ledger.pass("g2p", 2 * bytes_of(groups, true) + grid_bytes());
    std::int64_t spare = 0;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      Group<D, Real>& group = groups[g];
      const std::size_t field = bodies_.field_of(g);
      group.rows.swap(group.particles.rows);
      group.particles.rows.clear();   // all are written anew; FLIP, which reads them, has rows so short that the sort moved them
      group.next.resize(group.deformation.size());
      spare += std::int64_t(group.next.capacity() * sizeof(group.next[0]) + group.spare_stress.capacity() * sizeof(group.spare_stress[0]));
      struct Part {
        StepLimits limits;
        SolidCounts counts;
        std::int64_t lost = -1;
        GatherAudit audit;
        double work = 0;
      };
      const Part all = base::ordered_reduce(group.ranges.occupied.size(), 8, Part{}, [&](std::size_t begin, std::size_t end) {
        BlockGather<D, Real> gathering(blocks_, grid_[field], before_[field].velocity, solids_, dt, keep);
        gathering.audits = audits_;
        for (std::size_t b = begin; b < end; ++b) gathering.run(group, b);
        return Part{gathering.limits, gathering.counts, gathering.lost, gathering.audit, gathering.collider_work};
      }, [](Part a, const Part& b) {
        a.limits.take(b.limits);
        a.limits.momentum += b.limits.momentum;
        a.counts.add(b.counts);
        a.audit.add(b.audit);
        a.work += b.work;
        if (a.lost < 0) a.lost = b.lost;
        return a;
      });
      if (all.lost >= 0) throw lost_particle(groups, g, all.lost);
      group.deformation.swap(group.next);
      group.rows.clear(), group.particles.rows.swap(group.rows);   // its storage serves the next sort
      limits.take(all.limits);
      limits.momentum += group.particles.mass * all.limits.momentum;
      counts_.add(all.counts);
      collider_work_ += all.work;
      parts.add(all.audit);
    }
    ledger.hold("spare", spare);
  }
  if (!audits_) return limits;
  const auto pass = ledger.pass("audit", bytes_of(groups, true));
  const SolidEnergy now = energy(groups);
  audit_.reached("g2p", parts.gathered);
  audit_.add("advect", parts.moved - parts.gathered);
  audit_.add("collide", parts.collided);
  audit_.add("carry", parts.carried);
  audit_.add("plasticity", parts.yielded);
  audit_.add("forces", now.place - before_step_.place);
  audit_.add("stress", now.elastic - before_step_.elastic - parts.yielded);
  return limits;
}

template struct Scheme<2>;
template struct Scheme<3>;
template class SolidStep<2, float>;
template class SolidStep<2, double>;
template class SolidStep<3, float>;
template class SolidStep<3, double>;

}  // namespace sim
