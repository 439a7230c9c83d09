#pragma once
// One level of the multigrid hierarchy: tiles of cells, how they touch, the coefficients of their equations, and the passes of a V-cycle
// over them. Tiles whose cells are all unknown and whose faces are all open store no coefficients.
#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "base/prefetch.h"
#include "sim/fluid/poisson_tiles.h"
#include "sim/transfer/blocks.h"

namespace sim {

template <int D>
constexpr int kNeighbours = D == 2 ? 9 : 27;
template <int D>
constexpr int kChildren = D == 2 ? 16 : 64;   // fine tiles that reach into a coarse one

/// Coefficients of a tile that is not plain. Cells that are not unknown have inverse_diagonal = interpolation = 0.
template <int D>
struct TileCoefficients {
  template <class Number>
  using PerCell = std::array<Number, std::size_t(Tile<D>::kCells)>;
  std::array<std::array<float, std::size_t(Tile<D>::kFaces)>, std::size_t(D)> face;
  PerCell<float> extra, inverse_diagonal;
  PerCell<float> interpolation;   // 1 / the weight that interpolation from the coarser level finds outside solids
  PerCell<PoissonCell> kind;
};

/// Part of a tile whose cells hang together: all of it, or the cells marked with `label`.
struct Piece {
  std::int32_t tile = 0;
  std::int32_t component = 0;     // among closed components
  std::int32_t mask = -1;         // index into Level::masks; -1: the whole tile
};

template <int D>
struct Level {
  using T = Tile<D>;
  static constexpr std::int32_t kAir = -1, kSolid = -2;
  static constexpr int kHalf = T::kEdge / 2 + 2;                     // coarse cells that a tile interpolates from, along an axis
  static constexpr int kCoarse = (D == 3 ? kHalf : 1) * kHalf * kHalf;

  Cell<D> cells{}, tiles_along{}, last{};        // last: cells of the last tile along each axis
  std::array<bool, D> periodic{};
  std::vector<Cell<D>> tile;                     // ascending
  KeyTable numbers;                              // of their keys
  std::vector<std::pair<std::int64_t, std::int32_t>> emptied;   // tiles that have finer ones but no unknown: key, and kAir or kSolid
  std::function<std::int32_t(const Cell<D>&)> elsewhere;        // kAir or kSolid, of any other tile
  std::vector<std::array<std::int32_t, kNeighbours<D>>> neighbour;   // kAir or kSolid where there is none; axis 0 slowest
  std::vector<std::array<std::int32_t, kNeighbours<D>>> parents;    // in the coarser level: the tiles around a tile's parent, likewise
  std::vector<std::array<std::int32_t, kChildren<D>>> children;     // in the finer level: four along each axis, from the one before
  std::vector<std::unique_ptr<TileCoefficients<D>>> coefficients;   // null where plain
  float face = 1;                                // of plain tiles, and the scale of all
  std::int64_t unknowns = 0;

  std::vector<float> x, t, b;                    // iterate, the one after it, right-hand side
  std::vector<float> restricted;                 // kCoarse a tile: what it adds to the coarser level's b

  std::vector<Piece> pieces;                     // of closed components, ascending
  std::vector<std::array<std::uint8_t, std::size_t(T::kCells)>> masks;
  std::vector<double> component_cells;           // of each closed component

  /// The number of a tile, or kAir or kSolid. Wraps around.
  std::int32_t number(Cell<D> at_tile) const;
  std::int64_t key(const Cell<D>& at_tile) const {
    std::int64_t k = 0;
    for (int a = 0; a < D; ++a) k = k * tiles_along[a] + at_tile[a];
    return k;
  }
  std::size_t size() const { return tile.size() * std::size_t(T::kCells); }
  std::ptrdiff_t begin(std::int32_t number) const { return std::ptrdiff_t(number) * T::kCells; }
  float plain_inverse_diagonal() const { return 1 / (2 * D * face); }
  bool wraps_short(int axis) const { return periodic[axis] && last[axis] != T::kEdge; }
  /// Cells of a tile along an axis, as its neighbours across a periodic side see them.
  int extent(const Cell<D>& of, int axis) const { return periodic[axis] && of[axis] == tiles_along[axis] - 1 ? last[axis] : T::kEdge; }
};

template <int D>
std::int32_t Level<D>::number(Cell<D> at_tile) const {
  bool inside = true;
  for (int a = 0; a < D; ++a) {
    if (periodic[a]) at_tile[a] = (at_tile[a] + tiles_along[a]) % tiles_along[a];
    inside = inside && at_tile[a] >= 0 && at_tile[a] < tiles_along[a];
  }
  if (!inside) return elsewhere(at_tile);
  const std::int64_t k = key(at_tile);
  if (const std::int32_t found = numbers.find(k); found >= 0) return found;
  const auto empty = std::lower_bound(emptied.begin(), emptied.end(), std::pair{k, std::int32_t(kSolid)});
  return empty != emptied.end() && empty->first == k ? empty->second : elsewhere(at_tile);
}

template <int D>
constexpr int neighbour_index(int axis, int side) {
  int middle = 0, step = 1;
  for (int a = D - 1; a >= 0; --a) middle = middle * 3 + 1;
  for (int a = D - 1; a > axis; --a) step *= 3;
  return middle + (side ? step : -step);
}

/// A tile and the cells around it, in the first-level cache.
template <int D, class Real>
struct Padded {
  using T = Tile<D>;
  static constexpr int kFirstLane = 4, kLane = T::kEdge + 8, kPlane = (T::kEdge + 2) * kLane, kPlanes = D == 3 ? T::kEdge + 2 : 1;
  static constexpr int at(int plane, int row, int lane) { return (plane + (D == 3 ? 1 : 0)) * kPlane + (row + 1) * kLane + lane + kFirstLane; }
  alignas(64) Real value[std::size_t(kPlanes * kPlane)];

  /// Calls for what load() of a tile will be the first to read: the tile, and the sides of those behind it, which lie far apart. Without it
  /// a fifth of a solve waits here for memory.
  static void call_for(const Level<D>& level, const Real* field, std::size_t number) {
    constexpr std::ptrdiff_t kLine = 64 / sizeof(Real);
    if (number >= level.tile.size()) return;
    const Real* own = field + level.begin(std::int32_t(number));
    for (std::ptrdiff_t i = 0; i < T::kCells; i += kLine) base::prefetch(own + i);
    const auto& near = level.neighbour[number];
    if (const std::int32_t row = near[std::size_t(neighbour_index<D>(D - 2, 1))]; row >= 0)
      for (int p = 0; p < T::kPlanes; ++p)
        for (std::ptrdiff_t l = 0; l < T::kEdge; l += kLine) base::prefetch(field + level.begin(row) + T::cell(p, 0, int(l)));
    if constexpr (D == 3)
      if (const std::int32_t plane = near[std::size_t(neighbour_index<D>(0, 1))]; plane >= 0)
        for (std::ptrdiff_t i = 0; i < T::kEdge * T::kEdge; i += kLine) base::prefetch(field + level.begin(plane) + i);
  }

  void load(const Level<D>& level, const Real* field, std::int32_t number) {
    constexpr int E = T::kEdge;
    const Real* own = field + level.begin(number);
    for (int p = 0; p < T::kPlanes; ++p)
      for (int r = 0; r < E; ++r)
        for (int l = 0; l < E; ++l) value[at(p, r, l)] = own[T::cell(p, r, l)];
    const Cell<D>& where = level.tile[std::size_t(number)];
    const auto& near = level.neighbour[std::size_t(number)];
    for (int a = 0; a < D; ++a)
      for (int side = 0; side < 2; ++side) {
        const std::int32_t other = near[std::size_t(neighbour_index<D>(a, side))];
        const int to = side ? level.extent(where, a) : -1;
        int from = side ? 0 : E - 1;
        if (!side && other >= 0) from = level.extent(level.tile[std::size_t(other)], a) - 1;
        if (side && to != E) load_side(nullptr, a, 0, E);   // what lies behind cells outside the domain is read, and must be a number
        load_side(other >= 0 ? field + level.begin(other) : nullptr, a, from, to);
      }
  }

 private:
  void load_side(const Real* other, int axis, int from, int to) {
    constexpr int E = T::kEdge;
    if (axis == D - 1) {
      for (int p = 0; p < T::kPlanes; ++p)
        for (int r = 0; r < E; ++r) value[at(p, r, to)] = other ? other[T::cell(p, r, from)] : Real(0);
    } else if (axis == D - 2) {
      for (int p = 0; p < T::kPlanes; ++p)
        for (int l = 0; l < E; ++l) value[at(p, to, l)] = other ? other[T::cell(p, from, l)] : Real(0);
    } else {
      for (int r = 0; r < E; ++r)
        for (int l = 0; l < E; ++l) value[at(to, r, l)] = other ? other[T::cell(from, r, l)] : Real(0);
    }
  }
};

/// Some cells of a row side by side: one register.
template <class Real>
struct Lanes {
  static constexpr int kWidth = int(32 / sizeof(Real));
  typedef Real V __attribute__((vector_size(32)));
  template <class From>
  static V load(const From* from) {
    typedef From W __attribute__((vector_size(kWidth * int(sizeof(From)))));
    W w;
    std::memcpy(&w, from, sizeof w);
    if constexpr (std::is_same_v<From, Real>) return w;
    else return __builtin_convertvector(w, V);
  }
  template <class To>
  static void store(const V& v, To* to) {
    typedef To W __attribute__((vector_size(kWidth * int(sizeof(To)))));
    const W w = __builtin_convertvector(v, W);
    std::memcpy(to, &w, sizeof w);
  }
};

/// A x of the cells from `lane` on, c being x at the first of them.
template <int D, class Real>
inline typename Lanes<Real>::V apply_lanes(const Real* c, const TileCoefficients<D>* k, Real plain, int p, int r, int lane) {
  using T = Tile<D>;
  using P = Padded<D, Real>;
  using L = Lanes<Real>;
  const auto own = L::load(c);
  if (!k) {
    auto sum = (L::load(c - 1) + L::load(c + 1)) + (L::load(c - P::kLane) + L::load(c + P::kLane));
    if constexpr (D == 3) sum += L::load(c - P::kPlane) + L::load(c + P::kPlane);
    return plain * (Real(2 * D) * own - sum);
  }
  const float* along = k->face[D - 1].data() + T::template face<D - 1>(p, r, lane);
  const float* row = k->face[D - 2].data() + T::template face<D - 2>(p, r, lane);
  auto sum = L::load(k->extra.data() + T::cell(p, r, lane)) * own;
  sum += L::load(along) * (own - L::load(c - 1)) + L::load(along + 1) * (own - L::load(c + 1));
  sum += L::load(row) * (own - L::load(c - P::kLane)) + L::load(row + T::kEdge) * (own - L::load(c + P::kLane));
  if constexpr (D == 3) {
    const float* plane = k->face[0].data() + T::template face<0>(p, r, lane);
    sum += L::load(plane) * (own - L::load(c - P::kPlane)) + L::load(plane + T::kEdge * T::kEdge) * (own - L::load(c + P::kPlane));
  }
  return sum;
}

/// Calls body(place in the tile, x there, A x there) for the cells of a tile, Lanes::kWidth at a time.
template <int D, class Real, class Body>
inline void visit_lanes(const Padded<D, Real>& x, const TileCoefficients<D>* k, Real plain, const Body& body) {
  using T = Tile<D>;
  const auto all = [&](const TileCoefficients<D>* coefficients) {
    for (int p = 0; p < T::kPlanes; ++p)
      for (int r = 0; r < T::kEdge; ++r)
        for (int l = 0; l < T::kEdge; l += Lanes<Real>::kWidth) {
          const Real* c = x.value + Padded<D, Real>::at(p, r, l);
          body(T::cell(p, r, l), Lanes<Real>::load(c), apply_lanes<D, Real>(c, coefficients, plain, p, r, l));
        }
  };
  if (k) all(k);
  else all(nullptr);
}

constexpr std::size_t kTilesAtOnce = 8;   // of a chunk: fixed, so that sums do not follow the threads
constexpr std::size_t kTilesAhead = 2;    // how far before its turn a tile is called for

// The passes of a V-cycle.

/// to = from + omega D^-1 (b - A from).
template <int D>
void smooth(const Level<D>&, const std::vector<float>& from, float omega, std::vector<float>& to);
/// The same, and the sum of to . r.
template <int D>
double smooth_and_dot(const Level<D>&, const std::vector<float>& from, float omega, const std::vector<double>& r, std::vector<float>& to);
/// restricted = what each tile's residual b - A x adds to the coarser right-hand side.
template <int D>
void restrict_residual(Level<D>&, const std::vector<float>& x);
/// coarse.b = sum of `restricted` over the finer level's tiles; coarse.x = omega D^-1 b.
template <int D>
void gather_restricted(const Level<D>& fine, float omega, Level<D>& coarse);
/// fine += interpolated coarse.
template <int D>
void add_interpolated(const Level<D>& coarse, const std::vector<float>& from, const Level<D>& fine, std::vector<float>& to);

/// The finest level, from the problem; `rhs` in its layout, 0 where nothing is unknown. Coefficients of `reused` are taken over.
template <int D>
Level<D> make_finest(const PoissonProblem<D>&, Level<D> reused, std::vector<double>& rhs);
/// The level of cells twice as wide: air where any of a cell's children is, unknown where any other child is. Sets the finer
/// level's interpolation. Coarse faces are half the sum of the fine ones: their mean, times area over distance.
template <int D>
Level<D> make_coarser(Level<D>& fine, Level<D> reused);
/// Notes the components of unknowns that touch no air.
template <int D>
void find_closed_components(Level<D>&);
/// Takes its mean off each closed component. Returns the largest mean.
template <int D, class Real>
double remove_means(const Level<D>&, std::vector<Real>& field);

}  // namespace sim
