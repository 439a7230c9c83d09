#pragma once
// The bodies of GridTransfer's members, for the two files that instantiate them: a layout each, because they take long to compile.
#include <algorithm>
#include <cassert>
#include <type_traits>

#include "base/parallel.h"
#include "base/past_caches.h"
#include "sim/transfer/block_sums.h"
#include "sim/transfer/carry.h"
#include "sim/transfer/grid_transfer.h"
#include "sim/transfer/tiles.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 4096;

/// Calls body with a type tag for the kernel's basis: the choice is made once, outside the particle loops.
template <class Real, class Body>
auto with_basis(Kernel kernel, const Body& body) {
  if (kernel == Kernel::linear) return body(LinearBasis<Real>{});
  return body(QuadraticBasis<Real>{});
}

/// Calls body(place in the list of occupied blocks, its coordinates), one colour after another.
template <int D, class Body>
void for_blocks_by_colour(const CellRanges& ranges, const Lattice<D>& lattice, const Body& body) {
  std::array<std::vector<std::uint32_t>, Lattice<D>::kColours> colours;
  for (std::size_t b = 0; b < ranges.occupied.size(); ++b) colours[lattice.colour(lattice.block_at(ranges.occupied[b]))].push_back(std::uint32_t(b));
  for (const auto& same : colours)
    base::parallel_chunks(same.size(), 1, [&](std::size_t k, std::size_t) { body(same[k], lattice.block_at(ranges.occupied[same[k]])); });
}

/// The fast path's kernels for a mode set; null where there are none.
template <class Layout>
lanes::Kernels kernels_of(Kernel kernel, const std::vector<ModeIndex<Layout::kDimension>>& modes) {
  if constexpr (Layout::kDimension == 3 && std::is_same_v<typename Layout::Real, float>) {
    const int set = fast_set(modes);
    constexpr bool faces = Layout::kLattices == 3;
    if (kernel == Kernel::linear) return faces ? lanes::faces_linear(set) : lanes::nodes_linear(set);
    if (set <= 8) return faces ? lanes::faces_quadratic(set) : lanes::nodes_quadratic(set);
    return faces ? lanes::faces_bent(set) : lanes::nodes_bent(set);
  }
  return {};
}

/// What the fast path needs to know of a block's particles.
template <int D, class Real>
lanes::Block lanes_of(const CellRanges& ranges, std::size_t block, const Particles<D, Real>& particles, Real* coefficients) {
  lanes::Block b;
  if constexpr (std::is_same_v<Real, float>) {
    b.begin = &ranges.begin[block * Lattice<D>::kCellsPerBlock];
    b.offset = particles.offset.front().data();
    b.row = particles.rows.empty() ? nullptr : particles.rows.data();
    b.coefficients = coefficients;
  }
  return b;
}

template <class Value>
void fill(std::vector<Value>& field, std::size_t size, const Value& value) {
  field.resize(size);
  base::parallel_chunks(size, 65536, [&](std::size_t begin, std::size_t end) { std::fill(field.begin() + begin, field.begin() + end, value); });
}

/// A component's value at an index, 0 where no block is active.
template <class Layout>
typename Layout::Real read(const typename Layout::Field& field, int component, std::ptrdiff_t index) {
  return index < 0 ? typename Layout::Real(0) : Layout::at(field, component, std::size_t(index));
}

/// The fast path: a block's particles from a tile of the field around it. n nodes a stencil and axis.
template <class Layout, int n>
void gather_block(lanes::Gather kernel, const CellRanges& ranges, std::size_t b, const ActiveBlocks<Layout::kDimension>& blocks,
                  const typename Layout::Field& velocity, const typename Layout::Field* before, const GatherRule& rule,
                  Particles<Layout::kDimension, typename Layout::Real>& particles, bool streams) {
  using Real = typename Layout::Real;
  constexpr int D = Layout::kDimension, kTile = Lattice<D>::kBlock + n;
  if constexpr (std::is_same_v<Real, float>) {
    std::array<Real, std::size_t(D * int_power(kTile, D))> now{}, then;
    const Cell<D> block = blocks.lattice().block_at(ranges.occupied[b]);
    load_tile<Layout, kTile>(blocks, block, velocity, now.data());
    lanes::Gathering g{.tile = now.data(), .keep = float(rule.keep)};
    if (rule.flip) {
      then.fill(0);
      load_tile<Layout, kTile>(blocks, block, *before, then.data());
      g.before = then.data();
    }
    lanes::Block own = lanes_of(ranges, b, particles, particles.coefficients.data());
    own.streams = streams;
    kernel(own, g);
  }
}

/// Momenta become velocities; what is too light becomes 0 and is counted where a particle reached it.
template <class Layout>
std::int64_t divide_by_mass(typename Layout::Grid& grid, std::size_t size) {
  using Real = typename Layout::Real;
  std::int64_t light = 0;
  for (int l = 0; l < Layout::kLattices; ++l) {
    const std::vector<Real>& mass = Layout::mass(grid.mass, l);
    light = base::ordered_reduce(size, 65536, light, [&](std::size_t begin, std::size_t end) {
      std::int64_t found = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const bool valid = double(mass[i]) > kLightestNode;
        found += !valid && mass[i] > 0;
        for (int k = 0; k < Layout::kComponents; ++k) {
          Real& v = Layout::at(grid.velocity, Layout::component(l, k), i);
          v = valid ? v / mass[i] : Real(0);
        }
      }
      return found;
    }, [](std::int64_t a, std::int64_t b) { return a + b; });
  }
  return light;
}

}  // namespace

template <class Layout>
GridTransfer<Layout>::GridTransfer(Kernel kernel, std::vector<ModeIndex<D>> modes, Path path) : kernel_(kernel), modes_(std::move(modes)) {
  if (path == Path::fast) {
    kernels_ = kernels_of<Layout>(kernel, modes_);
    if (Layout::kLattices == 3 && std::is_same_v<Real, float> && kernel == Kernel::quadratic) interpolation_ = lanes::interpolation();
  }
  for (const ModeIndex<D>& mode : modes_)
    place_.push_back(kernel == Kernel::linear ? tensor_place<2, D>(mode) : tensor_place<3, D>(mode));
}

template <class Layout>
void GridTransfer<Layout>::scatter(const Particles<D, Real>& particles, const CellRanges& ranges, const ActiveBlocks<D>& blocks, Grid& grid) const {
  assert(particles.modes == int(modes_.size()));
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  const bool fast = is_fast() && ranges.home == home();
  Layout::clear(grid.velocity, blocks.size());
  for (int l = 0; l < Layout::kLattices; ++l) fill(Layout::mass(grid.mass, l), blocks.size(), Real(0));
  with_basis<Real>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    for_blocks_by_colour<D>(ranges, blocks.lattice(), [&](std::size_t b, const Cell<D>& block) {
      BlockSums<Layout, Basis::kNodes> sums(block, blocks.lattice());
      if (fast) {
        sums.prefetch(grid, blocks, block);
        if constexpr (std::is_same_v<Real, float>)   // the kernels only read
          kernels_.scatter(lanes_of(ranges, b, particles, const_cast<Real*>(particles.coefficients.data())), sums.data());
      } else {
        sums.clear();
        for (std::size_t p = ranges.begin[b * per_block]; p < ranges.begin[(b + 1) * per_block]; ++p) sums.template add<Basis>(particles, p, place_);
      }
      sums.add_to(grid, blocks, block);
    });
  });
  Layout::light(grid) = divide_by_mass<Layout>(grid, blocks.size());
}

template <class Layout>
void GridTransfer<Layout>::gather(const ActiveBlocks<D>& blocks, const Field& velocity, const Field* before, const GatherRule& rule,
                                  Particles<D, Real>& particles) const {
  assert(!rule.flip || before);
  if (rule.flip) particles.settle();
  particles.rows.clear();
  base::parallel_chunks(particles.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    gather_plainly(blocks, velocity, before, rule, begin, end, particles);
  });
}

template <class Layout>
void GridTransfer<Layout>::gather(const CellRanges& ranges, const ActiveBlocks<D>& blocks, const Field& velocity, const Field* before,
                                  const GatherRule& rule, Particles<D, Real>& particles, const After& after) const {
  assert(!rule.flip || before);
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  if (rule.flip) particles.settle();
  particles.rows.clear();
  const bool fast = is_fast() && ranges.home == home();
  const bool streams = !after && particles.coefficients.size() * sizeof(Real) > base::kHeldByCaches;
  base::parallel_chunks(ranges.occupied.size(), 1, [&](std::size_t b, std::size_t) {
    const std::size_t begin = ranges.begin[b * per_block], end = ranges.begin[(b + 1) * per_block];
    if (!fast) gather_plainly(blocks, velocity, before, rule, begin, end, particles);
    else if (kernel_ == Kernel::linear) gather_block<Layout, 2>(kernels_.gather, ranges, b, blocks, velocity, before, rule, particles, streams);
    else gather_block<Layout, 3>(kernels_.gather, ranges, b, blocks, velocity, before, rule, particles, streams);
    if (after) after(b);
  });
}

template <class Layout>
void GridTransfer<Layout>::gather_plainly(const ActiveBlocks<D>& blocks, const Field& velocity, const Field* before, const GatherRule& rule,
                                          std::size_t begin, std::size_t end, Particles<D, Real>& particles) const {
  with_basis<Real>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    constexpr int n = Basis::kNodes;
    for (std::size_t p = begin; p < end; ++p) {
      const ParticleStencils<Basis, Layout> stencils(particles.cell[p], particles.offset[p]);
      for (int l = 0; l < Layout::kLattices; ++l) {
        const Stencil<Basis, D> stencil = stencils.of(l);
        const auto at = blocks.template places<n>(first_node<Basis, D>(stencil));
        for (int k = 0; k < Layout::kComponents; ++k) {
          const int component = Layout::component(l, k);
          const auto c = particles.component(p, component);
          Tensor<Real, n, D> value;
          for (std::size_t node = 0; node < value.size(); ++node) value[node] = read<Layout>(velocity, component, at[node]);
          if (rule.flip) {
            const Tensor<Real, n, D> w = weights<D>(stencil);
            Real now = 0, then = 0;
            for (std::size_t node = 0; node < value.size(); ++node) {
              now += w[node] * value[node];
              then += w[node] * read<Layout>(*before, component, at[node]);
            }
            c[0] = now + Real(rule.keep) * (c[0] - then);
            continue;
          }
          analyse<D>(stencil, value);
          for (std::size_t r = 0; r < place_.size(); ++r) c[r] = value[place_[r]];
        }
      }
    }
  });
}

template <class Layout>
std::int64_t GridTransfer<Layout>::limit(const CellRanges& ranges, const ActiveBlocks<D>& blocks, const Departure<D, Real>& from, const Mass& mass,
                                         Carry carry, Particles<D, Real>& particles) const {
  if (carry == Carry::fixed) return 0;
  assert(kernel_ == Kernel::quadratic && "the scene refuses other carries with the linear kernel");
  assert(from.cell.size() == particles.size() && from.offset.size() == particles.size());
  using Weights = QuadraticWeights<Real>;
  std::vector<unsigned> axes;   // of each mode
  for (const ModeIndex<D>& mode : modes_) axes.push_back(bent_axes<D>(mode));

  const Real light = Real(kLightNode);
  const auto look_up = [&](int l, const Stencil<Weights, D>& stencil) {
    const auto nodes = blocks.template places<Weights::kNodes>(first_node<Weights, D>(stencil));
    return std::any_of(nodes.begin(), nodes.end(), [&](std::ptrdiff_t i) { return value_at(Layout::mass(mass, l), i, Real(0)) < light; });
  };
  const auto limit_some = [&](std::size_t begin, std::size_t end, const auto& beside_light) {
    std::int64_t scaled = 0;
    for (std::size_t p = begin; p < end; ++p) {
      const ParticleStencils<Weights, Layout> there(from.cell[p], from.offset[p]), here(particles.cell[p], particles.offset[p]);
      for (int l = 0; l < Layout::kLattices; ++l) {
        const Stencil<Weights, D> before = there.of(l), now = here.of(l);
        if (carry == Carry::hybrid && !beside_light(l, before)) continue;
        std::array<Real, std::size_t(int_power(2, D))> factor{};   // by bent axes
        for (unsigned bent = 1; bent < factor.size(); ++bent) {
          Real product_before = 1, product_now = 1;
          for (int a = 0; a < D; ++a) {
            if (!(bent >> a & 1)) continue;
            product_before *= root_norm_of_g(before[a].x);
            product_now *= root_norm_of_g(now[a].x);
          }
          factor[bent] = limited_factor(product_before, product_now);
        }
        for (int k = 0; k < Layout::kComponents; ++k) {
          const auto c = particles.component(p, Layout::component(l, k));
          for (std::size_t r = 0; r < axes.size(); ++r) {
            if (axes[r] == 0 || factor[axes[r]] >= 1) continue;
            c[r] *= factor[axes[r]];
            ++scaled;
          }
        }
      }
    }
    return scaled;
  };
  const auto add = [](std::int64_t a, std::int64_t b) { return a + b; };
  if (ranges.occupied.empty() || carry == Carry::limited)
    return base::ordered_reduce(particles.size(), kChunk, std::int64_t{0}, [&](std::size_t begin, std::size_t end) {
      return limit_some(begin, end, look_up);
    }, add);
  constexpr std::size_t per_block = Lattice<D>::kCellsPerBlock;
  return base::ordered_reduce(ranges.occupied.size(), 1, std::int64_t{0}, [&](std::size_t b, std::size_t) {
    const Cell<D> block = blocks.lattice().block_at(ranges.occupied[b]);
    const LeastMasses<Layout> least(blocks, block, mass);
    std::int64_t scaled = 0;
    for (std::size_t home = b * per_block; home < (b + 1) * per_block; ++home) {
      const std::size_t begin = ranges.begin[home], end = ranges.begin[home + 1];
      if (begin == end || !(least.at_home(ranges.home, int(home % per_block)) < light)) continue;   // in most of a liquid
      scaled += limit_some(begin, end, [&](int l, const Stencil<Weights, D>& stencil) {
        const std::ptrdiff_t place = least.place(stencil);
        return place < 0 ? look_up(l, stencil) : least.at(l, place) < light;
      });
    }
    return scaled;
  }, add);
}

template <class Layout>
auto GridTransfer<Layout>::velocity_at(const ActiveBlocks<D>& blocks, const Field& velocity, const Site<D, Real>& site) const
    -> Vec<D, Real> {
  return with_basis<Real>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    const ParticleStencils<Basis, Layout> stencils(site.cell, site.offset);
    Vec<D, Real> v = Vec<D, Real>::Zero();
    for (int l = 0; l < Layout::kLattices; ++l) {
      const Stencil<Basis, D> stencil = stencils.of(l);
      const auto at = blocks.template places<Basis::kNodes>(first_node<Basis, D>(stencil));
      const auto w = weights<D>(stencil);
      for (int k = 0; k < Layout::kComponents; ++k)
        for (std::size_t node = 0; node < w.size(); ++node)
          v[Layout::component(l, k)] += w[node] * read<Layout>(velocity, Layout::component(l, k), at[node]);
    }
    return v;
  });
}

template <class Layout>
auto GridTransfer<Layout>::sums(const Particles<D, Real>& particles, double h) const -> Sums {
  const auto add = [](Sums s, const Sums& t) {
    s.kinetic_energy += t.kinetic_energy;
    s.largest_coefficient = std::max(s.largest_coefficient, t.largest_coefficient);
    s.linear_momentum += t.linear_momentum;
    s.angular_momentum += t.angular_momentum;
    return s;
  };
  return with_basis<double>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    return base::ordered_reduce(particles.size(), kChunk, Sums{}, [&](std::size_t begin, std::size_t end) {
      Sums s;
      for (std::size_t p = begin; p < end; ++p) {
        const Vec<D, double> offset = particles.offset[p].template cast<double>();
        const ParticleStencils<Basis, Layout> stencils(particles.cell[p], offset);
        base::Vec3 place = base::Vec3::Zero(), momentum = base::Vec3::Zero(), spin = base::Vec3::Zero();
        place.head<D>() = h * particles.place(p);
        for (int i = 0; i < D; ++i) {
          const int l = i / Layout::kComponents, a = Layout::component(l, i % Layout::kComponents);
          const Stencil<Basis, D> stencil = stencils.of(l);
          const auto c = particles.component(p, a);
          momentum[a] = particles.mass * double(c[0]);
          for (std::size_t r = 0; r < modes_.size(); ++r) {
            double norm = 1;
            int degree = 0, axis = 0;
            for (int b = 0; b < D; ++b) {
              norm *= stencil[b].norm(modes_[r][b]);
              degree += modes_[r][b];
              if (modes_[r][b]) axis = b;
            }
            s.kinetic_energy += 0.5 * particles.mass * double(c[r]) * double(c[r]) * norm;
            s.largest_coefficient = std::max(s.largest_coefficient, std::abs(double(c[r])));
            // The mode w_axis of component a carries the moment m h c <w, w> about the particle itself.
            if (degree == 1) spin += base::Vec3::Unit(axis).cross(base::Vec3::Unit(a)) * (particles.mass * h * double(c[r]) * norm);
          }
        }
        s.linear_momentum += momentum;
        s.angular_momentum += place.cross(momentum) + spin;
      }
      return s;
    }, add);
  });
}

template <class Layout>
std::vector<float> GridTransfer<Layout>::mode_energies(const Particles<D, Real>& particles) const {
  std::vector<float> energies(particles.size());
  with_basis<double>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    base::parallel_chunks(particles.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const ParticleStencils<Basis, Layout> stencils(particles.cell[p], Vec<D, double>(particles.offset[p].template cast<double>()));
        double sum = 0;
        for (int i = 0; i < D; ++i) {
          const int l = i / Layout::kComponents;
          const Stencil<Basis, D> stencil = stencils.of(l);
          const auto c = particles.component(p, Layout::component(l, i % Layout::kComponents));
          for (std::size_t r = 1; r < modes_.size(); ++r) {
            double norm = 1;
            for (int b = 0; b < D; ++b) norm *= stencil[b].norm(modes_[r][b]);
            sum += 0.5 * double(c[r]) * double(c[r]) * norm;
          }
        }
        energies[p] = float(sum);
      }
    });
  });
  return energies;
}

template <class Layout>
auto GridTransfer<Layout>::sums(const ActiveBlocks<D>& blocks, const Grid& grid, double particle_mass, double h) const -> Sums {
  Sums s;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!blocks.is_place(i)) continue;
    const Cell<D> at = blocks.cell_at(i);
    for (int l = 0; l < Layout::kLattices; ++l) {
      const double mass = double(Layout::mass(grid.mass, l)[i]);
      if (mass <= kLightestNode) continue;
      base::Vec3 place = base::Vec3::Zero(), momentum = base::Vec3::Zero();
      for (int b = 0; b < D; ++b) place[b] = h * (at[b] + (Layout::centred(l, b) ? 0.5 : 0.0));
      for (int k = 0; k < Layout::kComponents; ++k) {
        const int a = Layout::component(l, k);
        const double v = double(Layout::at(grid.velocity, a, i));
        momentum[a] = particle_mass * mass * v;
        s.kinetic_energy += 0.5 * momentum[a] * v;
      }
      s.linear_momentum += momentum;
      s.angular_momentum += place.cross(momentum);
    }
  }
  return s;
}

}  // namespace sim
