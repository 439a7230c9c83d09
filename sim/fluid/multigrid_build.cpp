#include <mutex>

#include "sim/fluid/multigrid_interpolation.h"

namespace sim {
namespace {

template <int D>
using Coefficients = std::unique_ptr<TileCoefficients<D>>;

/// Coefficients that are free to be used again: fresh pages cost more than filling them.
template <int D>
class Spares {
 public:
  explicit Spares(std::vector<Coefficients<D>> from) {
    for (Coefficients<D>& one : from)
      if (one) spare_.push_back(std::move(one));
  }
  Coefficients<D> take() {
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        Coefficients<D> one = std::move(spare_.back());
        spare_.pop_back();
        return one;
      }
    }
    return Coefficients<D>(new TileCoefficients<D>);
  }

 private:
  std::mutex mutex_;
  std::vector<Coefficients<D>> spare_;
};

template <int D>
void set_extent(Level<D>& level, const Cell<D>& cells) {
  constexpr int E = Tile<D>::kEdge;
  level.cells = cells;
  for (int a = 0; a < D; ++a) {
    level.tiles_along[a] = (cells[a] + E - 1) / E;
    level.last[a] = cells[a] - (level.tiles_along[a] - 1) * E;
  }
}

template <int D>
Cell<D> moved(Cell<D> tile, int number, int base) {   // to a place of a cube of base^D around it, number being row-major
  for (int a = D - 1, rest = number; a >= 0; --a, rest /= base) tile[a] += rest % base - 1;
  return tile;
}

template <int D>
void link_tiles(Level<D>& level) {
  level.neighbour.resize(level.tile.size());
  base::parallel_chunks(level.tile.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for (int m = 0; m < kNeighbours<D>; ++m) level.neighbour[n][std::size_t(m)] = level.number(moved<D>(level.tile[n], m, 3));
  });
  level.x.resize(level.size());
  level.t.resize(level.size());
  level.b.resize(level.size());
  level.restricted.resize(level.tile.size() * std::size_t(Level<D>::kCoarse));
}

template <int D>
void set_tiles(Level<D>& level, std::vector<Cell<D>> tiles) {
  level.tile = std::move(tiles);
  std::vector<std::int64_t> keys(level.tile.size());
  for (std::size_t n = 0; n < keys.size(); ++n) keys[n] = level.key(level.tile[n]);
  level.numbers.build(keys);
}

/// Who restricts to whom.
template <int D>
void link_levels(Level<D>& fine, Level<D>& coarse) {
  fine.parents.resize(fine.tile.size());
  base::parallel_chunks(fine.tile.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Cell<D> parent = fine.tile[n];
      for (int& at : parent) at /= 2;
      for (int m = 0; m < kNeighbours<D>; ++m) fine.parents[n][std::size_t(m)] = coarse.number(moved<D>(parent, m, 3));
    }
  });
  coarse.children.resize(coarse.tile.size());
  base::parallel_chunks(coarse.tile.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Cell<D> first = coarse.tile[n];
      for (int& at : first) at *= 2;
      for (int m = 0; m < kChildren<D>; ++m) coarse.children[n][std::size_t(m)] = fine.number(moved<D>(first, m, 4));
    }
  });
}

/// Whether all is as in a plain tile with faces of `face`.
template <int D>
bool is_plain(const std::array<PoissonCell, std::size_t(Tile<D>::kCells)>& kind,
              const std::array<std::array<float, std::size_t(Tile<D>::kFaces)>, std::size_t(D)>& faces, float face) {
  bool plain = true;
  for (const PoissonCell k : kind) plain &= k == PoissonCell::unknown;
  for (const auto& axis : faces)
    for (const float w : axis) plain &= w == face;
  return plain;
}

/// Inverse diagonals; an unknown that no face links to anything is none. Returns how many unknowns there are.
template <int D>
std::int64_t finish(TileCoefficients<D>& k) {
  using T = Tile<D>;
  std::int64_t unknowns = 0;
  for (int p = 0; p < T::kPlanes; ++p)
    for (int r = 0; r < T::kEdge; ++r)
      for (int l = 0; l < T::kEdge; ++l) {
        const auto i = std::size_t(T::cell(p, r, l));
        float sum = k.extra[i] + k.face[D - 1][T::template face<D - 1>(p, r, l)] + k.face[D - 1][T::template face<D - 1>(p, r, l + 1)] +
                    k.face[D - 2][T::template face<D - 2>(p, r, l)] + k.face[D - 2][T::template face<D - 2>(p, r + 1, l)];
        if constexpr (D == 3) sum += k.face[0][T::template face<0>(p, r, l)] + k.face[0][T::template face<0>(p + 1, r, l)];
        if (k.kind[i] == PoissonCell::unknown && sum <= 0) k.kind[i] = PoissonCell::solid;
        const bool unknown = k.kind[i] == PoissonCell::unknown;
        k.inverse_diagonal[i] = unknown ? 1 / sum : 0;
        k.interpolation[i] = unknown;
        unknowns += unknown;
      }
  return unknowns;
}

/// A tile of the finer level as its parent sees it.
template <int D>
struct Child {
  std::int32_t number = Level<D>::kSolid;
  const TileCoefficients<D>* k = nullptr;   // null where plain or absent
  bool present() const { return number >= 0; }
  PoissonCell kind(int cell) const {
    if (k) return k->kind[std::size_t(cell)];
    return number >= 0 ? PoissonCell::unknown : number == Level<D>::kAir ? PoissonCell::air : PoissonCell::solid;
  }
};
template <int D>
using Children = std::array<Child<D>, std::size_t(1 << D)>;   // axis 0 is the highest bit

template <int D>
Children<D> children_of(const Level<D>& fine, const Cell<D>& coarse_tile) {
  Children<D> children;
  for (int c = 0; c < 1 << D; ++c) {
    Cell<D> tile;
    bool inside = true;   // a periodic axis may end between the children
    for (int a = 0; a < D; ++a) {
      tile[a] = 2 * coarse_tile[a] + (c >> (D - 1 - a) & 1);
      inside = inside && tile[a] < fine.tiles_along[a];
    }
    Child<D>& child = children[std::size_t(c)];
    if (inside) child.number = fine.number(tile);
    if (child.number >= 0) child.k = fine.coefficients[std::size_t(child.number)].get();
  }
  return children;
}

template <int D>
void coarsen_kinds(const Children<D>& children, TileCoefficients<D>& k) {
  using T = Tile<D>;
  constexpr int half = T::kEdge / 2;
  for (int p = 0; p < T::kPlanes; ++p)
    for (int r = 0; r < T::kEdge; ++r)
      for (int l = 0; l < T::kEdge; ++l) {
        const Child<D>& child = children[std::size_t((D == 3 ? p / half * 4 : 0) + r / half * 2 + l / half)];
        PoissonCell kind = PoissonCell::solid;
        for (int c = 0; c < 1 << D; ++c) {
          const int cell = T::cell(D == 3 ? 2 * p % T::kEdge + (c >> 2) : 0, 2 * r % T::kEdge + (c >> 1 & 1), 2 * l % T::kEdge + (c & 1));
          const PoissonCell fine = child.kind(cell);
          if (fine == PoissonCell::air || kind == PoissonCell::air) kind = PoissonCell::air;
          else if (fine == PoissonCell::unknown) kind = PoissonCell::unknown;
        }
        k.kind[std::size_t(T::cell(p, r, l))] = kind;
      }
}

/// Half the sum of the fine faces that make a coarse one. `extent` is how many cells the children have along the axis in all: behind a
/// side that comes around at an odd place, the last coarse cell has one child.
template <int D, int axis>
void coarsen_faces(const Children<D>& children, float plain, int extent, TileCoefficients<D>& k) {
  using T = Tile<D>;
  constexpr int E = T::kEdge, kPlaneEnd = T::kPlanes + (D == 3 && axis == 0), kRowEnd = E + (axis == D - 2), kLaneEnd = E + (axis == D - 1);
  for (int p = 0; p < kPlaneEnd; ++p)
    for (int r = 0; r < kRowEnd; ++r)
      for (int l = 0; l < kLaneEnd; ++l) {
        std::array<int, 3> first{D == 3 ? 2 * p : 0, 2 * r, 2 * l};   // fine, counted from the first child
        constexpr int along = axis + 3 - D;
        first[along] = std::min(first[along], extent);
        std::array<int, 3> half{first[0] / E, first[1] / E, first[2] / E};
        half[along] = std::min(half[along], 1);
        const auto child_at = [&](const std::array<int, 3>& h) { return &children[std::size_t((D == 3 ? h[0] * 4 : 0) + h[1] * 2 + h[2])]; };
        const Child<D>* child = child_at(half);
        if (!child->present() && first[along] == E) half[along] = 0, child = child_at(half);
        float sum = 0;
        if (child->present() && !child->k) sum = plain * (1 << (D - 1));
        if (child->k) {
          const std::array<int, 3> in{first[0] - half[0] * E, first[1] - half[1] * E, first[2] - half[2] * E};
          for (int c = 0; c < 1 << D; ++c) {
            const std::array<int, 3> step{c >> 2 & 1, c >> 1 & 1, c & 1};
            if (step[along]) continue;
            sum += child->k->face[axis][std::size_t(T::template face<axis>(in[0] + step[0], in[1] + step[1], in[2] + step[2]))];
          }
        }
        k.face[axis][std::size_t(T::template face<axis>(p, r, l))] = sum / 2;
      }
}

/// Where interpolation finds solids on the coarser level it does not count them: weights are scaled to sum to 1.
template <int D>
void set_interpolation(const Level<D>& coarse, const Cell<D>& tile, const std::array<std::int32_t, kNeighbours<D>>& numbers, TileCoefficients<D>& k) {
  using T = Tile<D>;
  constexpr int H = Level<D>::kHalf;
  alignas(64) float there[Level<D>::kCoarse], weight[T::kCells];
  const Slots<D> slot = slots<D>(coarse, tile);
  for (int p = 0; p < (D == 3 ? H : 1); ++p)
    for (int r = 0; r < H; ++r)
      for (int l = 0; l < H; ++l) {
        const Slot sp = D == 3 ? slot[0][std::size_t(p)] : Slot{-1, 0}, sr = slot[D - 2][std::size_t(r)], sl = slot[D - 1][std::size_t(l)];
        const std::int32_t number = numbers[std::size_t((sp.step + 1) * 9 + (sr.step + 1) * 3 + sl.step + 1)];
        bool is_there = number != Level<D>::kSolid;
        if (number >= 0)
          if (const TileCoefficients<D>* near = coarse.coefficients[std::size_t(number)].get())
            is_there = near->kind[std::size_t(T::cell(sp.local, sr.local, sl.local))] != PoissonCell::solid;
        there[(p * H + r) * H + l] = is_there;
      }
  Interpolation<D>::widen(there, weight);
  for (int i = 0; i < T::kCells; ++i)
    k.interpolation[std::size_t(i)] = k.kind[std::size_t(i)] == PoissonCell::unknown && weight[i] > 0 ? 1 / weight[i] : 0;
}

}  // namespace

template <int D>
Level<D> make_finest(const PoissonProblem<D>& problem, Level<D> level, std::vector<double>& rhs) {
  using T = Tile<D>;
  set_extent<D>(level, problem.cells);
  level.periodic = problem.periodic;
  level.face = 1;
  set_tiles<D>(level, problem.tiles);
  level.emptied.clear();
  level.elsewhere = [&problem](const Cell<D>& tile) { return problem.elsewhere(tile) == PoissonCell::air ? Level<D>::kAir : Level<D>::kSolid; };
  link_tiles(level);
  Spares<D> spares(std::move(level.coefficients));
  level.coefficients.clear();
  level.coefficients.resize(level.tile.size());
  rhs.resize(level.size());
  level.unknowns = base::ordered_reduce(level.tile.size(), kTilesAtOnce, std::int64_t{0}, [&](std::size_t begin, std::size_t end) {
    std::int64_t unknowns = 0;
    const auto tile = std::make_unique<PoissonTile<D>>();
    for (std::size_t n = begin; n < end; ++n) {
      problem.fill(level.tile[n], *tile);
      double* const b = rhs.data() + level.begin(std::int32_t(n));
      bool is_level = true;
      for (const float extra : tile->extra) is_level &= extra == 0;
      if (is_level && is_plain<D>(tile->kind, tile->face, level.face)) {
        std::copy(tile->rhs.begin(), tile->rhs.end(), b);
        unknowns += T::kCells;
        continue;
      }
      Coefficients<D> k = spares.take();
      k->face = tile->face;
      k->kind = tile->kind;
      for (std::size_t i = 0; i < std::size_t(T::kCells); ++i) k->extra[i] = tile->kind[i] == PoissonCell::unknown ? tile->extra[i] : 0;
      unknowns += finish(*k);
      for (std::size_t i = 0; i < std::size_t(T::kCells); ++i) b[i] = k->kind[i] == PoissonCell::unknown ? tile->rhs[i] : 0;
      level.coefficients[n] = std::move(k);
    }
    return unknowns;
  }, [](std::int64_t s, std::int64_t more) { return s + more; });
  return level;
}

template <int D>
Level<D> make_coarser(Level<D>& fine, Level<D> level) {
  using T = Tile<D>;
  Cell<D> cells;
  for (int a = 0; a < D; ++a) cells[a] = (fine.cells[a] + 1) / 2;
  set_extent<D>(level, cells);
  level.periodic = fine.periodic;
  level.face = fine.face * (1 << (D - 1)) / 2;
  std::vector<Cell<D>> candidates = fine.tile;
  for (Cell<D>& tile : candidates)
    for (int& at : tile) at /= 2;
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  Spares<D> spares(std::move(level.coefficients));
  std::vector<Coefficients<D>> made(candidates.size());
  std::vector<std::int64_t> unknowns(candidates.size());
  base::parallel_chunks(candidates.size(), 1, [&](std::size_t n, std::size_t) {
    const Children<D> children = children_of<D>(fine, candidates[n]);
    unknowns[n] = T::kCells;
    if (std::all_of(children.begin(), children.end(), [](const Child<D>& c) { return c.present() && !c.k; })) return;
    Coefficients<D> k = spares.take();
    k->extra.fill(0);
    coarsen_kinds<D>(children, *k);
    const auto extent = [&](int a) {
      return fine.periodic[a] ? std::min(fine.cells[a] - 2 * candidates[n][a] * T::kEdge, 2 * T::kEdge) : 2 * T::kEdge;
    };
    coarsen_faces<D, D - 1>(children, fine.face, extent(D - 1), *k);
    coarsen_faces<D, D - 2>(children, fine.face, extent(D - 2), *k);
    if constexpr (D == 3) coarsen_faces<D, 0>(children, fine.face, extent(0), *k);
    if (is_plain<D>(k->kind, k->face, level.face)) return;
    unknowns[n] = finish(*k);
    made[n] = std::move(k);
  });
  level.coefficients.clear(), level.emptied.clear();
  level.unknowns = 0;
  std::vector<Cell<D>> tiles;
  for (std::size_t n = 0; n < candidates.size(); ++n) {
    if (unknowns[n] == 0) {
      const auto& kind = made[n]->kind;
      const bool has_air = std::find(kind.begin(), kind.end(), PoissonCell::air) != kind.end();
      level.emptied.push_back({level.key(candidates[n]), has_air ? Level<D>::kAir : Level<D>::kSolid});
      continue;
    }
    level.unknowns += unknowns[n];
    tiles.push_back(candidates[n]);
    level.coefficients.push_back(std::move(made[n]));
  }
  set_tiles<D>(level, std::move(tiles));
  level.elsewhere = [&fine](const Cell<D>& tile) {
    for (const Child<D>& child : children_of<D>(fine, tile))
      if (child.number == Level<D>::kAir) return Level<D>::kAir;
    return Level<D>::kSolid;
  };
  link_tiles(level);
  link_levels(fine, level);
  base::parallel_chunks(fine.tile.size(), kTilesAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      if (fine.coefficients[n]) set_interpolation<D>(level, fine.tile[n], fine.parents[n], *fine.coefficients[n]);
  });
  return level;
}

template Level<2> make_finest(const PoissonProblem<2>&, Level<2>, std::vector<double>&);
template Level<3> make_finest(const PoissonProblem<3>&, Level<3>, std::vector<double>&);
template Level<2> make_coarser(Level<2>&, Level<2>);
template Level<3> make_coarser(Level<3>&, Level<3>);

}  // namespace sim
