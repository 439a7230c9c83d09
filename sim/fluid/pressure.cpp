#include "sim/fluid/pressure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "sim/transfer/place_set.h"

namespace sim {
namespace {

constexpr std::size_t kBlocksAtOnce = 64;

template <int D>
constexpr int kBlocksPerTile = Tile<D>::kEdge / Lattice<D>::kBlock;   // along an edge

CellKind kind_of(const std::vector<CellKind>& kind, std::ptrdiff_t index) { return value_at(kind, index, CellKind::air); }

/// 1 / theta between a liquid cell and an air cell along an axis. How low a film lies says nothing about where it ends.
template <int D>
double inverse_theta(const LiquidCells<D>& cells, int axis, std::ptrdiff_t liquid, std::ptrdiff_t air) {
  constexpr double kLeastBesideFilm = 0.5;
  if (cells.distance.empty() || air < 0) return 1;
  const double t = theta(cells.distance[std::size_t(liquid)], cells.distance[std::size_t(air)]);
  const int film = cells.film_at(std::size_t(liquid));
  return 1 / (film > 0 && !(film >> axis & 1) ? std::max(t, kLeastBesideFilm) : t);
}

/// The places of a tile of the solver and of the cells around it, as indices of fields.
template <int D>
class TilePlaces {
 public:
  using T = Tile<D>;
  static constexpr int kAlong = T::kEdge + 2;
  static constexpr int at(int plane, int row, int lane) {
    return ((D == 3 ? plane + 1 : 0) * kAlong + row + 1) * kAlong + lane + 1;
  }
  /// 1 behind the last cell of a periodic axis stands the first one; what is farther is nowhere.
  void load(const Cell<D>& tile, const ActiveBlocks<D>& blocks) {
    const Lattice<D>& lattice = blocks.lattice();
    Cell<D> first;
    bool plain = true;
    for (int a = 0; a < D; ++a) {
      first[a] = tile[a] * T::kEdge - 1;
      plain = plain && (!lattice.periodic[a] || (first[a] >= 0 && first[a] + kAlong <= lattice.cells[a]));
    }
    for (int p = 0; p < (D == 3 ? kAlong : 1); ++p)
      for (int r = 0; r < kAlong; ++r)
        for (int l = 0; l < kAlong;) {
          Cell<D> place;
          place[D - 1] = first[D - 1] + l, place[D - 2] = first[D - 2] + r;
          if constexpr (D == 3) place[0] = first[0] + p;
          const int to = (p * kAlong + r) * kAlong + l;
          if (plain && l > 0 && l + Lattice<D>::kBlock <= kAlong - 1) {   // a row of a block
            const std::ptrdiff_t found = blocks.index(place);
            for (int n = 0; n < Lattice<D>::kBlock; ++n) index[std::size_t(to + n)] = found < 0 ? found : found + n;
            l += Lattice<D>::kBlock;
            continue;
          }
          bool nowhere = false;
          for (int a = 0; a < D && !plain; ++a) nowhere = nowhere || (lattice.periodic[a] && place[a] > lattice.cells[a]);
          index[std::size_t(to)] = nowhere ? ActiveBlocks<D>::kAbsent : blocks.index(place);
          ++l;
        }
  }
  std::array<std::ptrdiff_t, std::size_t((D == 3 ? kAlong : 1) * kAlong * kAlong)> index;
};

/// The equations of one tile.
template <int D, class Real>
class TileEquations {
 public:
  using T = Tile<D>;
  using P = TilePlaces<D>;
  TileEquations(const FaceField<D, Real>& velocity, const std::vector<float>* source, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks)
      : velocity_(velocity), source_(source), cells_(cells), blocks_(blocks) {}

  void fill(const Cell<D>& tile, PoissonTile<D>& to) {
    places_.load(tile, blocks_);
    const Lattice<D>& lattice = blocks_.lattice();
    for (std::size_t n = 0; n < places_.index.size(); ++n) kind_[n] = kind_of(cells_.kind, places_.index[n]);
    for (int p = 0; p < T::kPlanes; ++p)
      for (int r = 0; r < T::kEdge; ++r)
        for (int l = 0; l < T::kEdge; ++l) {
          const CellKind kind = kind_[std::size_t(P::at(p, r, l))];
          const std::array<int, 3> local{p, r, l};
          bool there = true;   // not beyond a wall
          for (int a = 0; a < D; ++a)
            there = there && (tile[a] * T::kEdge + local[std::size_t(a + 3 - D)] < lattice.cells[a] || cells_.open_sides[std::size_t(a)][1]);
          const auto i = std::size_t(T::cell(p, r, l));
          to.kind[i] = !there || kind == CellKind::solid ? PoissonCell::solid : kind == CellKind::liquid ? PoissonCell::unknown : PoissonCell::air;
          to.extra[i] = 0;
          to.rhs[i] = source_ && kind == CellKind::liquid ? double((*source_)[std::size_t(places_.index[std::size_t(P::at(p, r, l))])]) : 0;
        }
    faces<D - 1>(to);
    faces<D - 2>(to);
    if constexpr (D == 3) faces<0>(to);
  }

 private:
  /// Every face of an axis gives its outflow to the cells on both sides and, where air is on one, what the surface is nearer than it.
  template <int axis>
  void faces(PoissonTile<D>& to) {
    constexpr int step = axis == D - 1 ? 1 : axis == D - 2 ? P::kAlong : P::kAlong * P::kAlong;
    constexpr bool is_plane = D == 3 && axis == 0, is_row = axis == D - 2, is_lane = axis == D - 1;
    for (int p = 0; p < T::kPlanes + is_plane; ++p)
      for (int r = 0; r < T::kEdge + is_row; ++r)
        for (int l = 0; l < T::kEdge + is_lane; ++l) {
          const auto above = std::size_t(P::at(p, r, l)), below = above - std::size_t(step);
          const std::ptrdiff_t face = places_.index[above];
          const CellKind over = kind_[above], under = kind_[below];
          float w = 0;
          if (face >= 0 && over != CellKind::solid && under != CellKind::solid) w = cells_.open(axis, std::size_t(face));
          to.face[axis][std::size_t(T::template face<axis>(p, r, l))] = w;
          if (face < 0 || (over != CellKind::liquid && under != CellKind::liquid)) continue;
          const double pushed = source_ ? 0 : cells_.open.pushed(axis, std::size_t(face));
          if (w == 0 && pushed == 0) continue;
          const double flow = double(w) * double(velocity_[axis][std::size_t(face)]) + pushed;
          const bool has_over = is_plane ? p < T::kEdge : is_row ? r < T::kEdge : l < T::kEdge;
          const bool has_under = is_plane ? p > 0 : is_row ? r > 0 : l > 0;
          if (has_over && over == CellKind::liquid) {
            const auto i = std::size_t(T::cell(p, r, l));
            to.rhs[i] += flow;
            if (under == CellKind::air) to.extra[i] += float(double(w) * (inverse_theta(cells_, axis, face, places_.index[below]) - 1));
          }
          if (has_under && under == CellKind::liquid) {
            const auto i = std::size_t(T::cell(p - is_plane, r - is_row, l - is_lane));
            to.rhs[i] -= flow;
            if (over == CellKind::air) to.extra[i] += float(double(w) * (inverse_theta(cells_, axis, places_.index[below], face) - 1));
          }
        }
  }

  const FaceField<D, Real>& velocity_;
  const std::vector<float>* source_;   // or null: 0
  const LiquidCells<D>& cells_;
  const ActiveBlocks<D>& blocks_;
  P places_;
  std::array<CellKind, std::tuple_size_v<decltype(P::index)>> kind_;
};

template <int D>
std::vector<Cell<D>> tiles_with_liquid(const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  std::vector<Cell<D>> tiles = base::ordered_reduce(blocks.count(), kBlocksAtOnce, std::vector<Cell<D>>{}, [&](std::size_t begin, std::size_t end) {
    std::vector<Cell<D>> found;
    for (std::size_t slot = begin; slot < end; ++slot) {
      if (std::none_of(&kind[slot * per_block], &kind[slot * per_block] + per_block, [](CellKind k) { return k == CellKind::liquid; })) continue;
      Cell<D> tile = blocks.block(slot);
      for (int& at : tile) at /= kBlocksPerTile<D>;
      if (found.empty() || found.back() != tile) found.push_back(tile);
    }
    return found;
  }, [](std::vector<Cell<D>> all, const std::vector<Cell<D>>& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
  std::sort(tiles.begin(), tiles.end());
  tiles.erase(std::unique(tiles.begin(), tiles.end()), tiles.end());
  return tiles;
}

/// Air, where the tile has any or is not active; beyond walls solid.
template <int D>
PoissonCell tile_without_liquid(const Cell<D>& tile, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  const Lattice<D>& lattice = blocks.lattice();
  const std::vector<CellKind>& kind = cells.kind;
  bool outside = false;
  for (std::size_t a = 0; a < std::size_t(D); ++a) {
    const bool below = tile[a] < 0, above = tile[a] * Tile<D>::kEdge >= lattice.cells[a];
    if ((below && !cells.open_sides[a][0]) || (above && !cells.open_sides[a][1])) return PoissonCell::solid;
    outside = outside || below || above;
  }
  if (outside) return PoissonCell::air;
  constexpr int n = kBlocksPerTile<D>;
  bool active = false;
  for (int b = 0; b < (D == 3 ? n * n * n : n * n); ++b) {
    Cell<D> block;
    bool inside = true;
    for (int a = D - 1, rest = b; a >= 0; --a, rest /= n) {
      block[a] = tile[a] * n + rest % n;
      inside = inside && block[a] <= lattice.highest_block(a);
    }
    const std::int32_t slot = inside ? blocks.slot(lattice.block_key(block)) : -1;
    if (slot < 0) continue;
    active = true;
    const CellKind* first = &kind[std::size_t(slot) * per_block];
    if (std::find(first, first + per_block, CellKind::air) != first + per_block) return PoissonCell::air;
  }
  return active ? PoissonCell::solid : PoissonCell::air;
}

/// Closed faces get the solid's velocity or the source's, or 0 where nothing moves. A face is valid when liquid touches it, thin liquid and that in a
/// source too.
template <int D, class Real>
void hold_solids(FaceField<D, Real>& v, bool moves, const LiquidCells<D>& cells, const PlaceSet<D>& liquid, const ActiveBlocks<D>& blocks, FaceMask<D>& valid) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  for (int a = 0; a < D; ++a) {
    valid[a].resize(blocks.size());
    base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slot = begin; slot < end; ++slot) {
        const std::size_t first = slot * per_block;
        write_flags(liquid[slot] | liquid.beside(blocks, slot, a, 0), per_block, &valid[a][first]);
        for (std::size_t i = first; i < first + per_block && !cells.open.is_open(slot); ++i) {
          if (cells.open(a, i) == 0) v[a][i] = moves ? Real(cells.open.pushed(a, i)) : Real(0);
          if (cells.open.held(a, i)) valid[a][i] = 1;
        }
      }
    });
    for (const std::size_t i : cells.thin) {
      valid[a][i] = 1;
      if (const std::ptrdiff_t above = blocks.neighbour(i, a, 1); above >= 0) valid[a][std::size_t(above)] = 1;
    }
  }
}

/// v -= difference of pressure across every face that is open and that liquid touches.
template <int D, class Real>
void subtract_gradient(FaceField<D, Real>& v, const LiquidCells<D>& cells, const PlaceSet<D>& liquid, const std::vector<double>& p,
                       const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot)
      for (int a = 0; a < D; ++a)
        for_places(liquid[slot] | liquid.beside(blocks, slot, a, 0), [&](std::size_t k) {
          const std::size_t i = slot * per_block + k;
          const std::ptrdiff_t lower = blocks.neighbour(i, a, 0);
          const CellKind below = kind_of(cells.kind, lower), above = cells.kind[i];
          if (below == CellKind::solid || above == CellKind::solid || cells.open(a, i) == 0) return;
          double change = 0;
          if (below == CellKind::liquid && above == CellKind::liquid) change = p[i] - p[std::size_t(lower)];
          else if (above == CellKind::liquid) change = p[i] * inverse_theta(cells, a, std::ptrdiff_t(i), lower);
          else change = -p[std::size_t(lower)] * inverse_theta(cells, a, lower, std::ptrdiff_t(i));
          v[a][i] = Real(double(v[a][i]) - change);
        });
  });
}

/// The mean of a component over the faces around one which liquid touches, each for as much as it is open; none where none is.
template <int D, class Real, std::size_t N>
std::optional<double> mean_of_open(const std::vector<Real>& v, int axis, const std::array<std::ptrdiff_t, N>& faces, const LiquidCells<D>& cells,
                                   const std::vector<std::uint8_t>& valid) {
  double sum = 0, weights = 0;
  for (const std::ptrdiff_t face : faces) {
    if (face < 0 || !valid[std::size_t(face)]) continue;
    const double weight = cells.open(axis, std::size_t(face));
    sum += weight * double(v[std::size_t(face)]), weights += weight;
  }
  return weights > 0 ? std::optional(sum / weights) : std::nullopt;
}

}  // namespace

template <int D, class Real>
void see_covered_parts(FaceField<D, Real>& v, bool moves, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks, const FaceMask<D>& valid) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  using Seen = std::vector<std::pair<std::size_t, Real>>;
  std::array<Seen, std::size_t(D)> seen;
  const auto meets_air = [&](std::ptrdiff_t i) {   // of liquid
    return i >= 0 && !cells.distance.empty() && cells.kind[std::size_t(i)] == CellKind::liquid && cells.distance[std::size_t(i)] > -1;
  };
  for (int a = 0; a < D; ++a)
    seen[std::size_t(a)] = base::ordered_reduce(blocks.count(), kBlocksAtOnce, Seen{}, [&](std::size_t begin, std::size_t end) {
      Seen found;
      for (std::size_t slot = begin; slot < end; ++slot) {
        if (cells.open.is_open(slot)) continue;
        for (std::size_t i = slot * per_block; i < (slot + 1) * per_block; ++i) {
          const auto* const plane = valid[a][i] ? cells.open.plane(a, i) : nullptr;
          if (!plane) continue;
          std::array<std::ptrdiff_t, std::size_t(2 * D)> around;
          for (int b = 0; b < D; ++b)
            for (const int side : {0, 1}) around[std::size_t(2 * b + side)] = blocks.neighbour(i, b, side);
          const std::optional<double> own = mean_of_open<D>(v[a], a, around, cells, valid[a]);
          if (!own) continue;
          const std::ptrdiff_t lower = around[std::size_t(2 * a)];
          double outwards = 0;   // seen from the collider; what is not known moves with it
          for (int b = 0; b < D; ++b) {
            std::optional<double> there = own;
            if (b != a) {
              const std::ptrdiff_t next = lower < 0 ? lower : blocks.neighbour(std::size_t(lower), b, 1);
              there = mean_of_open<D>(v[b], b, std::array{std::ptrdiff_t(i), around[std::size_t(2 * b + 1)], lower, next}, cells, valid[b]);
            }
            const double solid = moves ? double(plane->velocity[std::size_t(b)]) : 0;
            outwards += double(plane->normal[std::size_t(b)]) * (there.value_or(solid) - solid);
          }
          double taken = double(plane->normal[std::size_t(a)]) * outwards;
          if (outwards > 0 && (meets_air(std::ptrdiff_t(i)) || meets_air(lower))) {   // it may leave: nothing turns it, or a film at a rim feeds itself
            const double most = *own - (moves ? double(plane->velocity[std::size_t(a)]) : 0);
            taken = std::clamp(taken, std::min(most, 0.0), std::max(most, 0.0));
          }
          const double open = cells.open(a, i);
          found.emplace_back(i, Real(open * double(v[a][i]) + (1 - open) * (*own - taken)));
        }
      }
      return found;
    }, [](Seen all, const Seen& part) {
      all.insert(all.end(), part.begin(), part.end());
      return all;
    });
  for (int a = 0; a < D; ++a)
    for (const auto& [face, velocity] : seen[std::size_t(a)]) v[a][face] = velocity;
}

namespace {

/// Largest net outflow of a liquid cell [m/s].
template <int D, class Real>
double largest_outflow(const FaceField<D, Real>& v, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  return base::ordered_reduce(blocks.count(), kBlocksAtOnce, 0.0, [&](std::size_t begin, std::size_t end) {
    double most = 0;
    for (std::size_t i = begin * per_block; i < end * per_block; ++i) {
      if (cells.kind[i] != CellKind::liquid) continue;
      double out = 0;
      for (int a = 0; a < D; ++a) {
        const std::ptrdiff_t above = blocks.neighbour(i, a, 1);
        out -= double(cells.open(a, i)) * double(v[a][i]) + cells.open.pushed(a, i);
        if (above >= 0) out += double(cells.open(a, std::size_t(above))) * double(v[a][std::size_t(above)]) + cells.open.pushed(a, std::size_t(above));
      }
      most = std::max(most, std::abs(out));
    }
    return most;
  }, [](double s, double t) { return std::max(s, t); });
}

/// Pressure times what moving solids push into each liquid cell.
template <int D>
double work_of_solids(const LiquidCells<D>& cells, const std::vector<double>& p, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  return base::ordered_reduce(blocks.count(), kBlocksAtOnce, 0.0, [&](std::size_t begin, std::size_t end) {
    double work = 0;
    for (std::size_t i = begin * per_block; i < end * per_block; ++i) {
      if (cells.kind[i] != CellKind::liquid) continue;
      for (int a = 0; a < D; ++a) {
        const std::ptrdiff_t above = blocks.neighbour(i, a, 1);
        work += p[i] * (cells.open.pushed(a, i) - (above >= 0 ? cells.open.pushed(a, std::size_t(above)) : 0));
      }
    }
    return work;
  }, [](double s, double t) { return s + t; });
}

}  // namespace

template <int D>
LiquidVolume liquid_volume(const LiquidCells<D>& cells, const std::vector<float>& filling, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  constexpr float kDeep = -0.45f;   // [cells] under the surface
  const auto is_deep = [&](std::ptrdiff_t i) {
    return i >= 0 && cells.kind[std::size_t(i)] == CellKind::liquid && (cells.distance.empty() || cells.distance[std::size_t(i)] <= kDeep);
  };
  const auto is_beside_deep = [&](std::size_t i) {
    for (int a = 0; a < D; ++a)
      if (is_deep(blocks.neighbour(i, a, 0)) || is_deep(blocks.neighbour(i, a, 1))) return true;
    return false;
  };
  return base::ordered_reduce(blocks.count(), kBlocksAtOnce, LiquidVolume{}, [&](std::size_t begin, std::size_t end) {
    LiquidVolume volume;
    for (std::size_t i = begin * per_block; i < end * per_block; ++i) {
      if (cells.kind[i] == CellKind::air && filling[i] > 0) {
        const bool on_top = is_beside_deep(i);   // of liquid whose surface lies in this cell
        if (on_top) volume.bulk_filling += double(filling[i]);
        if (!on_top || std::binary_search(cells.thin.begin(), cells.thin.end(), i)) volume.all += double(filling[i]);
      }
      if (cells.kind[i] == CellKind::solid && filling[i] > 0 && cells.open.in_source(i, blocks)) volume.all += double(filling[i]);
      if (cells.kind[i] != CellKind::liquid) continue;
      double excess = 0, slopes = 0;
      for (int a = 0; a < D; ++a)
        for (const int side : {0, 1}) {
          const std::ptrdiff_t j = blocks.neighbour(i, a, side), face = side ? j : std::ptrdiff_t(i);
          const double w = face < 0 ? 1 : double(cells.open(a, std::size_t(face)));
          if (w == 0 || j < 0 || cells.distance.empty() || cells.kind[std::size_t(j)] != CellKind::air) continue;
          const double slope = double(cells.distance[std::size_t(j)]) - double(cells.distance[i]);
          excess += (theta(cells.distance[i], cells.distance[std::size_t(j)]) - 0.5) * slope * slope;
          slopes += slope * slope;
        }
      // Walls cut no cell: only where a face is cut is part of the cell covered.
      const bool covered = !cells.open.is_open(i / per_block) && cells.open.cut(i, blocks);
      const double here = (covered ? double(cells.open.open_part(i, blocks)) : 1) * (1 + (slopes > 0 ? excess / slopes : 0));
      volume.all += here;
      if (!covered && (is_deep(std::ptrdiff_t(i)) || is_beside_deep(i))) volume.bulk += here, volume.bulk_filling += double(filling[i]);
    }
    return volume;
  }, [](const LiquidVolume& s, const LiquidVolume& t) {
    return LiquidVolume{s.all + t.all, s.bulk + t.bulk, s.bulk_filling + t.bulk_filling};
  });
}

template <int D>
template <class Real>
PressureReport Projection<D>::project(FaceField<D, Real>& velocity, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks, double tolerance,
                                      FaceMask<D>& valid) {
  PressureReport report = solve(velocity, nullptr, cells, blocks, tolerance, valid);
  report.max_divergence = largest_outflow<D, Real>(velocity, cells, blocks);
  return report;
}

template <int D>
template <class Real>
PressureReport Projection<D>::displace(FaceField<D, Real>& displacement, const std::vector<float>& source, const LiquidCells<D>& cells,
                                       const ActiveBlocks<D>& blocks, double tolerance, FaceMask<D>& valid) {
  for (auto& component : displacement) component.assign(blocks.size(), Real(0));
  return solve(displacement, &source, cells, blocks, tolerance, valid);
}

template <int D>
template <class Real>
PressureReport Projection<D>::solve(FaceField<D, Real>& velocity, const std::vector<float>* source, const LiquidCells<D>& cells,
                                    const ActiveBlocks<D>& blocks, double tolerance, FaceMask<D>& valid) {
  using T = Tile<D>;
  const PlaceSet<D> liquid(blocks, cells.kind, CellKind::liquid);
  hold_solids<D, Real>(velocity, /*moves=*/!source, cells, liquid, blocks, valid);
  PoissonProblem<D> problem;
  problem.cells = blocks.lattice().cells, problem.periodic = blocks.lattice().periodic;
  problem.tiles = tiles_with_liquid<D>(cells.kind, blocks);
  PressureReport report;
  if (problem.tiles.empty()) {
    pressure_.clear();
    return report;
  }
  problem.elsewhere = [&](const Cell<D>& tile) { return tile_without_liquid<D>(tile, cells, blocks); };
  problem.fill = [&](const Cell<D>& tile, PoissonTile<D>& to) { TileEquations<D, Real>(velocity, source, cells, blocks).fill(tile, to); };

  const PoissonReport solved = solver_.solve(problem, tolerance);
  report.unknowns = solved.unknowns;
  report.iterations = solved.iterations;
  report.residual = solved.residual;
  report.closed_pockets = solved.closed_components;
  report.imbalance = solved.imbalance;
  report.fell_back = solved.fell_back;
  if (!std::isfinite(solved.residual))
    throw base::Error({.code = base::Exit::unstable, .message = "pressure: the velocity before the projection is not finite"});
  // An unknown of an iteration: the V-cycle's floats, over all levels, about 110 B; product, updates and sums in double 104 B.
  report.bytes = report.unknowns * (64 + 214 * solved.iterations);
  if (!solved.converged)
    throw base::Error({.code = base::Exit::unstable,
                       .message = fmt::format("pressure: {} unknowns, residual {:.3g} after {} iterations, asked {:.3g}", solved.unknowns,
                                              solved.residual, solved.iterations, tolerance)});
  pressure_.assign(blocks.size(), 0.0);
  base::parallel_chunks(problem.tiles.size(), 8, [&](std::size_t begin, std::size_t end) {
    TilePlaces<D> places;
    for (std::size_t n = begin; n < end; ++n) {
      places.load(problem.tiles[n], blocks);
      const std::span<const double> found = solver_.solution(n);
      for (int p = 0; p < T::kPlanes; ++p)
        for (int r = 0; r < T::kEdge; ++r)
          for (int l = 0; l < T::kEdge; ++l) {
            const std::array<int, 3> local{p, r, l};
            bool inside = true;
            for (int a = 0; a < D; ++a) inside = inside && problem.tiles[n][a] * T::kEdge + local[std::size_t(a + 3 - D)] < problem.cells[a];
            const std::ptrdiff_t to = places.index[std::size_t(TilePlaces<D>::at(p, r, l))];
            if (inside && to >= 0) pressure_[std::size_t(to)] = found[std::size_t(T::cell(p, r, l))];
          }
    }
  });
  subtract_gradient<D, Real>(velocity, cells, liquid, pressure_, blocks);
  if (!source && cells.open.pushes()) report.solid_work = work_of_solids<D>(cells, pressure_, blocks);
  return report;
}

template class Projection<2>;
template class Projection<3>;
template void see_covered_parts(FaceField<2, float>&, bool, const LiquidCells<2>&, const ActiveBlocks<2>&, const FaceMask<2>&);
template void see_covered_parts(FaceField<2, double>&, bool, const LiquidCells<2>&, const ActiveBlocks<2>&, const FaceMask<2>&);
template void see_covered_parts(FaceField<3, float>&, bool, const LiquidCells<3>&, const ActiveBlocks<3>&, const FaceMask<3>&);
template void see_covered_parts(FaceField<3, double>&, bool, const LiquidCells<3>&, const ActiveBlocks<3>&, const FaceMask<3>&);
template LiquidVolume liquid_volume(const LiquidCells<2>&, const std::vector<float>&, const ActiveBlocks<2>&);
template LiquidVolume liquid_volume(const LiquidCells<3>&, const std::vector<float>&, const ActiveBlocks<3>&);
template PressureReport Projection<2>::project(FaceField<2, float>&, const LiquidCells<2>&, const ActiveBlocks<2>&, double, FaceMask<2>&);
template PressureReport Projection<2>::displace(FaceField<2, float>&, const std::vector<float>&, const LiquidCells<2>&, const ActiveBlocks<2>&, double, FaceMask<2>&);
template PressureReport Projection<2>::project(FaceField<2, double>&, const LiquidCells<2>&, const ActiveBlocks<2>&, double, FaceMask<2>&);
template PressureReport Projection<2>::displace(FaceField<2, double>&, const std::vector<float>&, const LiquidCells<2>&, const ActiveBlocks<2>&, double, FaceMask<2>&);
template PressureReport Projection<3>::project(FaceField<3, float>&, const LiquidCells<3>&, const ActiveBlocks<3>&, double, FaceMask<3>&);
template PressureReport Projection<3>::displace(FaceField<3, float>&, const std::vector<float>&, const LiquidCells<3>&, const ActiveBlocks<3>&, double, FaceMask<3>&);
template PressureReport Projection<3>::project(FaceField<3, double>&, const LiquidCells<3>&, const ActiveBlocks<3>&, double, FaceMask<3>&);
template PressureReport Projection<3>::displace(FaceField<3, double>&, const std::vector<float>&, const LiquidCells<3>&, const ActiveBlocks<3>&, double, FaceMask<3>&);

}  // namespace sim
