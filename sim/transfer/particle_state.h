#pragma once
// Particles as columns of a checkpoint, and as one number that says whether two states are the same to the bit.
#include <algorithm>
#include <bit>
#include <cassert>
#include <string>
#include <type_traits>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/random.h"
#include "sim/state.h"
#include "sim/transfer/particles.h"

namespace sim {

/// Columns "cell", "offset", "coefficients", "id". Every row must be its particle's (Particles::rows empty).
template <int D, class Real>
void add_particles(const Particles<D, Real>& particles, State& state) {
  assert(particles.rows.empty() && "between steps every row is its particle's");
  state.columns.push_back(make_column<std::int32_t>("cell", particles.cell, D));
  state.columns.push_back(make_column<Real>("offset", particles.offset, D));
  state.columns.push_back(make_column<Real>("coefficients", particles.coefficients, std::int64_t(particles.row())));
  state.columns.push_back(make_column<std::int64_t>("id", particles.id, 1));
}

/// Throws base::Error when two are equal: the canonical order, by cell and id, would lose one of the two particles.
inline void check_unique(std::vector<std::int64_t> ids) {
  std::sort(ids.begin(), ids.end());
  const auto twice = std::adjacent_find(ids.begin(), ids.end());
  if (twice != ids.end()) throw base::Error({.message = "two particles have id " + std::to_string(*twice)});
}

/// `count` particles back, with the modes that `particles` has; false when the columns do not fit or a particle is outside the domain.
/// Throws base::Error when two particles have one id.
template <int D, class Real>
bool read_particles(const State& state, std::int64_t count, const Lattice<D>& lattice, Particles<D, Real>& particles) {
  particles.rows.clear();
  if (!read_column<std::int64_t>(state, "id", count, 1, particles.id)) return false;
  check_unique(particles.id);
  return read_column<std::int32_t>(state, "cell", count, D, particles.cell) &&
         read_column<Real>(state, "offset", count, D, particles.offset) &&
         read_column<Real>(state, "coefficients", count, std::int64_t(particles.row()), particles.coefficients) &&
         std::all_of(particles.cell.begin(), particles.cell.end(), [&](const Cell<D>& c) { return lattice.inside(c); });
}

/// `hash` and the bits of a number.
template <class Real>
std::uint64_t hash_with(std::uint64_t hash, Real number) {
  return scramble(hash ^ std::bit_cast<std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>>(number));
}

/// A hash of each particle's id, place, coefficients and of what more(particle, hash) adds to them, summed: the order of storage does not matter.
template <int D, class Real, class More>
std::uint64_t hash_of(const Particles<D, Real>& particles, const More& more) {
  return base::ordered_reduce(particles.size(), 16384, std::uint64_t{0}, [&](std::size_t begin, std::size_t end) {
    std::uint64_t sum = 0;
    for (std::size_t p = begin; p < end; ++p) {
      std::uint64_t h = scramble(std::uint64_t(particles.id[p]));
      for (int a = 0; a < D; ++a) h = hash_with(scramble(h ^ std::uint64_t(particles.cell[p][a])), particles.offset[p][a]);
      for (std::size_t k = 0; k < particles.row(); ++k) h = hash_with(h, particles.coefficients[particles.row_of(p) * particles.row() + k]);
      sum += more(p, h);
    }
    return sum;
  }, [](std::uint64_t a, std::uint64_t b) { return a + b; });
}

}  // namespace sim
