#pragma once
// Pressure equations on dense arrays, for tests and benchmarks: every number can be looked up cell by cell, and the residual is computed
// without any of the solver's code.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "sim/fluid/poisson_tiles.h"

namespace sim {

/// A box of cells with a ring of one around it; faces belong to the cell above them.
template <int D>
struct DensePoisson {
  Cell<D> cells{};
  std::array<bool, D> periodic{};
  std::array<std::size_t, D> stride{};
  std::vector<PoissonCell> kind;                          // the ring: solid, or images
  std::array<std::vector<float>, std::size_t(D)> face;    // open fraction
  std::vector<float> extra;
  std::vector<double> rhs;

  explicit DensePoisson(const Cell<D>& n, const std::array<bool, D>& around = {}) : cells(n), periodic(around) {
    std::size_t size = 1;
    for (int a = D - 1; a >= 0; --a) stride[std::size_t(a)] = size, size *= std::size_t(cells[std::size_t(a)] + 2);
    kind.assign(size, PoissonCell::solid), extra.assign(size, 0), rhs.assign(size, 0);
    for (auto& axis : face) axis.assign(size, 0);
  }
  std::size_t index(const Cell<D>& at) const {
    std::size_t i = 0;
    for (std::size_t a = 0; a < D; ++a) i += std::size_t(at[a] + 1) * stride[a];
    return i;
  }
  bool inside(const Cell<D>& at) const {
    for (std::size_t a = 0; a < D; ++a)
      if (at[a] < 0 || at[a] >= cells[a]) return false;
    return true;
  }
  template <class Body>
  void for_cells(const Body& body) const {
    Cell<D> at{};
    for (;;) {
      body(at, index(at));
      int a = D - 1;
      while (a >= 0 && ++at[std::size_t(a)] == cells[std::size_t(a)]) at[std::size_t(a--)] = 0;
      if (a < 0) return;
    }
  }
  Cell<D> wrapped(Cell<D> at) const {
    for (std::size_t a = 0; a < D; ++a)
      if (periodic[a]) at[a] = (at[a] + cells[a]) % cells[a];
    return at;
  }
  /// The cell across a face, its place, and the face's.
  struct Across {
    std::size_t cell, face;
  };
  Across across(const Cell<D>& at, int axis, int side) const {
    Cell<D> other = at;
    other[std::size_t(axis)] += side ? 1 : -1;
    other = wrapped(other);
    return {index(other), side ? index(other) : index(at)};
  }
  /// Opens all faces between cells that are not solid.
  void open_faces() {
    for_cells([&](const Cell<D>& at, std::size_t i) {
      for (int a = 0; a < D; ++a) {
        const std::size_t below = across(at, a, 0).cell;
        face[std::size_t(a)][i] = kind[i] != PoissonCell::solid && kind[below] != PoissonCell::solid;
      }
    });
  }
  /// Numbers between -1 and 1 that depend on the place alone.
  static double noise(const Cell<D>& at) {
    std::uint64_t h = 0x9e3779b97f4a7c15u;
    for (const int c : at) h = (h ^ std::uint64_t(c)) * 0xff51afd7ed558ccdu, h ^= h >> 32;
    return double(h >> 11) / double(1ull << 52) - 1;
  }
  void set_noise() {
    for_cells([&](const Cell<D>& at, std::size_t i) { rhs[i] = kind[i] == PoissonCell::unknown ? noise(at) : 0; });
  }
  /// What gravity along the last axis gives: inflow through the floor that must not be.
  void set_hydrostatic() {
    for_cells([&](const Cell<D>& at, std::size_t i) {
      const double below = face[D - 1][across(at, D - 1, 0).face], above = face[D - 1][across(at, D - 1, 1).face];
      rhs[i] = kind[i] == PoissonCell::unknown ? above - below : 0;
    });
  }
  /// b - A x, of x by dense index.
  std::vector<double> residual(const std::vector<double>& x) const {
    std::vector<double> r(kind.size(), 0.0);
    for_cells([&](const Cell<D>& at, std::size_t i) {
      if (kind[i] != PoissonCell::unknown) return;
      r[i] = rhs[i] - double(extra[i]) * x[i];
      for (int a = 0; a < D; ++a)
        for (int side = 0; side < 2; ++side) {
          const Across to = across(at, a, side);
          r[i] -= double(face[std::size_t(a)][to.face]) * (x[i] - (kind[to.cell] == PoissonCell::unknown ? x[to.cell] : 0));
        }
    });
    return r;
  }
  double norm(const std::vector<double>& v) const {
    double sum = 0;
    for (const double value : v) sum += value * value;
    return std::sqrt(sum);
  }

  /// The same as the solver wants it. Must not outlive this.
  PoissonProblem<D> problem() const {
    using T = Tile<D>;
    PoissonProblem<D> p;
    p.cells = cells, p.periodic = periodic;
    Cell<D> tiles;
    for (std::size_t a = 0; a < D; ++a) tiles[a] = (cells[a] + T::kEdge - 1) / T::kEdge;
    DensePoisson<D> all(tiles);   // kinds of whole tiles: solid outside
    all.for_cells([&](const Cell<D>& tile, std::size_t n) {
      bool any = false;
      visit_rows(tile, [&](int, std::size_t i, int count) {
        for (int l = 0; l < count; ++l) {
          any = any || kind[i + std::size_t(l)] == PoissonCell::unknown;
          if (kind[i + std::size_t(l)] == PoissonCell::air) all.kind[n] = PoissonCell::air;
        }
      });
      if (any) p.tiles.push_back(tile);
    });
    p.elsewhere = [all = std::move(all)](const Cell<D>& tile) { return all.inside(tile) ? all.kind[all.index(tile)] : PoissonCell::solid; };
    p.fill = [this](const Cell<D>& tile, PoissonTile<D>& to) { fill(tile, to); };
    return p;
  }
  /// A solver's solution by dense index.
  template <class Solver>
  std::vector<double> gathered(const PoissonProblem<D>& p, const Solver& solver) const {
    std::vector<double> x(kind.size(), 0.0);
    for (std::size_t n = 0; n < p.tiles.size(); ++n)
      visit_rows(p.tiles[n], [&](int at, std::size_t i, int count) { std::copy_n(solver.solution(n).data() + at, count, x.data() + i); });
    return x;
  }

 private:
  /// visit(place in the tile, index, how many) of the rows of a tile, as far as they lie inside the box.
  template <class Visit>
  void visit_rows(const Cell<D>& tile, const Visit& to) const {
    using T = Tile<D>;
    const int first = tile[D - 1] * T::kEdge, count = std::min(T::kEdge, cells[D - 1] - first);
    for (int p = 0; p < T::kPlanes; ++p)
      for (int r = 0; r < T::kEdge; ++r) {
        Cell<D> at;
        at[D - 1] = first, at[D - 2] = tile[D - 2] * T::kEdge + r;
        if constexpr (D == 3) at[0] = tile[0] * T::kEdge + p;
        if (inside(at)) to(T::cell(p, r, 0), index(at), count);
      }
  }
  void fill(const Cell<D>& tile, PoissonTile<D>& to) const {
    to.kind.fill(PoissonCell::solid), to.extra.fill(0), to.rhs.fill(0);
    for (auto& axis : to.face) axis.fill(0);
    visit_rows(tile, [&](int at, std::size_t i, int count) {
      std::copy_n(kind.data() + i, count, to.kind.data() + at);
      std::copy_n(extra.data() + i, count, to.extra.data() + at);
      std::copy_n(rhs.data() + i, count, to.rhs.data() + at);
    });
    fill_faces<D - 1>(tile, to);
    fill_faces<D - 2>(tile, to);
    if constexpr (D == 3) fill_faces<0>(tile, to);
  }
  template <int axis>
  void fill_faces(const Cell<D>& tile, PoissonTile<D>& to) const {
    using T = Tile<D>;
    const int first = tile[D - 1] * T::kEdge, here = T::kEdge + (axis == D - 1), count = std::min(here, cells[D - 1] - first);
    for (int p = 0; p < T::kPlanes + (D == 3 && axis == 0); ++p)
      for (int r = 0; r < T::kEdge + (axis == D - 2); ++r) {
        Cell<D> at;
        at[D - 1] = first, at[D - 2] = tile[D - 2] * T::kEdge + r;
        if constexpr (D == 3) at[0] = tile[0] * T::kEdge + p;
        // The face behind the last cell of a periodic axis is that before the first.
        if (axis != D - 1 && periodic[axis] && at[axis] == cells[axis]) at[axis] = 0;
        if (!inside(at)) continue;
        float* const row = to.face[axis].data() + T::template face<axis>(p, r, 0);
        std::copy_n(face[axis].data() + index(at), count, row);
        if (axis != D - 1 || !periodic[axis] || count == here) continue;
        at[axis] = 0;
        row[count] = face[axis][index(at)];
      }
  }
};

}  // namespace sim
