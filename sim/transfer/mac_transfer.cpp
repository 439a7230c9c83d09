#include "sim/transfer/mac_transfer.h"

#include <cassert>

#include "base/parallel.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 4096;

/// The two bases an axis has, for uncentred and centred lattices: evaluated once a particle, shared by the components.
template <class Basis, int D>
struct ParticleStencils {
  std::array<Basis, D> corner, middle;

  template <class Real>
  ParticleStencils(const Cell<D>& cell, const Vec<D, Real>& offset) {
    for (int a = 0; a < D; ++a) {
      corner[a] = Basis(cell[a], offset[a], false);
      middle[a] = Basis(cell[a], offset[a], true);
    }
  }
  Stencil<Basis, D> of(int component) const {
    Stencil<Basis, D> s = middle;
    s[component] = corner[component];
    return s;
  }
};

/// Array index of each node of a stencil, relative to the first.
template <int n, int D>
std::array<std::ptrdiff_t, std::size_t(int_power(n, D))> node_steps(const Lattice<D>& lattice) {
  std::array<std::ptrdiff_t, std::size_t(int_power(n, D))> steps{};
  for (int node = 0; node < int(steps.size()); ++node)
    for (int a = D - 1, rest = node; a >= 0; --a, rest /= n) steps[node] += (rest % n) * lattice.stride[a];
  return steps;
}

template <class Basis, int D>
std::ptrdiff_t first_node(const Stencil<Basis, D>& s, const Lattice<D>& lattice) {
  Cell<D> at;
  for (int a = 0; a < D; ++a) at[a] = s[a].base;
  return lattice.index(at);
}

/// Calls body with a type tag for the kernel's basis: the choice is made once, outside the particle loops.
template <class Real, class Body>
auto with_basis(Kernel kernel, const Body& body) {
  if (kernel == Kernel::linear) return body(LinearBasis<Real>{});
  return body(QuadraticBasis<Real>{});
}

/// Calls body(block) for the occupied blocks, one colour after another; blocks of a colour share no face.
template <int D, class Body>
void for_blocks_by_colour(const CellRanges& ranges, const Lattice<D>& lattice, const Body& body) {
  std::array<std::vector<std::uint32_t>, std::size_t(int_power(2, D))> colours;
  for (const std::uint32_t block : ranges.occupied) {
    const Cell<D> at = lattice.block_at(block);
    std::size_t colour = 0;
    for (int a = D - 1; a >= 0; --a) colour = colour * 2 + std::size_t(at[a] % 2);
    colours[colour].push_back(block);
  }
  for (const auto& blocks : colours)
    base::parallel_chunks(blocks.size(), 1, [&](std::size_t begin, std::size_t) { body(blocks[begin]); });
}

}  // namespace

template <int D, class Real>
MacTransfer<D, Real>::MacTransfer(const Lattice<D>& lattice, Kernel kernel, std::vector<ModeIndex<D>> modes)
    : lattice_(lattice), kernel_(kernel), modes_(std::move(modes)) {
  for (const ModeIndex<D>& mode : modes_)
    place_.push_back(kernel == Kernel::linear ? tensor_place<2, D>(mode) : tensor_place<3, D>(mode));
}

template <int D, class Real>
void MacTransfer<D, Real>::scatter(const Particles<D, Real>& particles, const CellRanges& ranges, MacVelocity<D, Real>& grid) const {
  assert(particles.modes == int(modes_.size()));
  for (int a = 0; a < D; ++a) {
    grid.velocity[a].assign(lattice_.size, 0);
    grid.mass[a].assign(lattice_.size, 0);
  }
  with_basis<Real>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    constexpr int n = Basis::kNodes;
    const auto steps = node_steps<n, D>(lattice_);
    for_blocks_by_colour<D>(ranges, lattice_, [&](std::size_t block) {
      const std::size_t begin = ranges.begin[block * Lattice<D>::kCellsPerBlock], end = ranges.begin[(block + 1) * Lattice<D>::kCellsPerBlock];
      for (std::size_t p = begin; p < end; ++p) {
        const ParticleStencils<Basis, D> stencils(particles.cell[p], particles.offset[p]);
        for (int a = 0; a < D; ++a) {
          const Stencil<Basis, D> stencil = stencils.of(a);
          const std::span<const Real> c = particles.component(p, a);
          Tensor<Real, n, D> value{};
          for (std::size_t r = 0; r < place_.size(); ++r) value[place_[r]] = c[r];
          evaluate<D>(stencil, value);
          const Tensor<Real, n, D> w = weights<D>(stencil);
          const std::ptrdiff_t first = first_node<Basis, D>(stencil, lattice_);
          for (std::size_t node = 0; node < w.size(); ++node) {
            grid.velocity[a][first + steps[node]] += w[node] * value[node];
            grid.mass[a][first + steps[node]] += w[node];
          }
        }
      }
    });
  });
  for (int a = 0; a < D; ++a)
    base::parallel_chunks(lattice_.size, 65536, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        grid.velocity[a][i] = double(grid.mass[a][i]) > kLightestNode ? grid.velocity[a][i] / grid.mass[a][i] : Real(0);
    });
}

template <int D, class Real>
void MacTransfer<D, Real>::gather(const FaceField<D, Real>& velocity, const FaceField<D, Real>* before, const GatherRule& rule,
                                  Particles<D, Real>& particles) const {
  assert(!rule.flip || before);
  with_basis<Real>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    constexpr int n = Basis::kNodes;
    const auto steps = node_steps<n, D>(lattice_);
    base::parallel_chunks(particles.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const ParticleStencils<Basis, D> stencils(particles.cell[p], particles.offset[p]);
        for (int a = 0; a < D; ++a) {
          const Stencil<Basis, D> stencil = stencils.of(a);
          const std::ptrdiff_t first = first_node<Basis, D>(stencil, lattice_);
          const std::span<Real> c = particles.component(p, a);
          Tensor<Real, n, D> value;
          for (std::size_t node = 0; node < value.size(); ++node) value[node] = velocity[a][first + steps[node]];
          if (rule.flip) {
            const Tensor<Real, n, D> w = weights<D>(stencil);
            Real now = 0, then = 0;
            for (std::size_t node = 0; node < value.size(); ++node) {
              now += w[node] * value[node];
              then += w[node] * (*before)[a][first + steps[node]];
            }
            c[0] = now + Real(rule.keep) * (c[0] - then);
            continue;
          }
          analyse<D>(stencil, value);
          for (std::size_t r = 0; r < place_.size(); ++r) c[r] = value[place_[r]];
        }
      }
    });
  });
}

template <int D, class Real>
Vec<D, Real> MacTransfer<D, Real>::velocity_at(const FaceField<D, Real>& velocity, const Site<D, Real>& site) const {
  return with_basis<Real>(kernel_, [&](auto basis) {
    using Basis = decltype(basis);
    constexpr int n = Basis::kNodes;
    const auto steps = node_steps<n, D>(lattice_);
    const ParticleStencils<Basis, D> stencils(site.cell, site.offset);
    Vec<D, Real> v;
    for (int a = 0; a < D; ++a) {
      const Stencil<Basis, D> stencil = stencils.of(a);
      const std::ptrdiff_t first = first_node<Basis, D>(stencil, lattice_);
      const Tensor<Real, n, D> w = weights<D>(stencil);
      const Real* const field = velocity[a].data() + first;
      v[a] = 0;
      for (std::size_t node = 0; node < w.size(); ++node) v[a] += w[node] * field[steps[node]];
    }
    return v;
  });
}

template <int D, class Real>
auto MacTransfer<D, Real>::sums(const Particles<D, Real>& particles, double h) const -> Sums {
  const auto add = [](Sums s, const Sums& t) {
    s.kinetic_energy += t.kinetic_energy;
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
        const ParticleStencils<Basis, D> stencils(particles.cell[p], offset);
        base::Vec3 place = base::Vec3::Zero(), momentum = base::Vec3::Zero(), spin = base::Vec3::Zero();
        place.head<D>() = h * particles.place(p);
        for (int a = 0; a < D; ++a) {
          const Stencil<Basis, D> stencil = stencils.of(a);
          const std::span<const Real> c = particles.component(p, a);
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

template <int D, class Real>
auto MacTransfer<D, Real>::sums(const MacVelocity<D, Real>& grid, double particle_mass, double h) const -> Sums {
  Sums s;
  for (int a = 0; a < D; ++a)
    for (std::size_t i = 0; i < lattice_.size; ++i) {
      if (double(grid.mass[a][i]) <= kLightestNode) continue;
      const Cell<D> at = lattice_.cell_at(std::ptrdiff_t(i));
      base::Vec3 place = base::Vec3::Zero();
      for (int b = 0; b < D; ++b) place[b] = h * (at[b] + (b == a ? 0.0 : 0.5));
      const double m = particle_mass * double(grid.mass[a][i]), v = double(grid.velocity[a][i]);
      s.kinetic_energy += 0.5 * m * v * v;
      s.linear_momentum[a] += m * v;
      s.angular_momentum += place.cross(base::Vec3::Unit(a) * (m * v));
    }
  return s;
}

template class MacTransfer<2, float>;
template class MacTransfer<3, float>;
template class MacTransfer<2, double>;
template class MacTransfer<3, double>;

}  // namespace sim
