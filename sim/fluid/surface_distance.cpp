#include "sim/fluid/surface_distance.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/parallel.h"
#include "sim/fluid/face_filling.h"
#include "sim/transfer/place_set.h"

namespace sim {
namespace {

/// The nearest that a cell's middle is to the surface [cells]: the sign must not be lost.
constexpr float kBeside = 1e-3f;
/// And the farthest; 1 is what cells away from it have.
constexpr float kWithin = 0.999f;
/// How many standard deviations, of particles that lie at random, below its seeding liquid counts as thin.
constexpr double kThinDeviations = 2.7;
/// The average of fillings from which on air counts as a gap in the liquid: around one cell without particles, or two, and around no bubble.
constexpr float kGap = 0.642f;
constexpr std::size_t kBlocksAtOnce = 64;

/// 1, 2, 1 along each axis, of the cells around one.
template <int D>
constexpr std::array<int, std::size_t(ActiveBlocks<D>::kNeighbours)> kWeights = [] {
  std::array<int, std::size_t(ActiveBlocks<D>::kNeighbours)> weights{};
  for (int n = 0; n < int(weights.size()); ++n) {
    weights[std::size_t(n)] = 1;
    for (int a = 0, rest = n; a < D; ++a, rest /= 3) weights[std::size_t(n)] *= rest % 3 == 1 ? 2 : 1;
  }
  return weights;
}();

/// Averaged over the cells around one. A solid counts as what is on this side of it: its mirror image.
template <int D, class Places>
double mean_filling(const Places& places, const std::vector<float>& filling, const std::vector<CellKind>& kind) {
  constexpr int kAll = ActiveBlocks<D>::kNeighbours, kMiddle = kAll / 2;
  std::array<bool, std::size_t(kAll)> is_solid;
  bool any_solid = false;
  for (std::size_t n = 0; n < std::size_t(kAll); ++n) {
    is_solid[n] = places[n] >= 0 && kind[std::size_t(places[n])] == CellKind::solid;
    any_solid |= is_solid[n];
  }
  double sum = 0, weights = 0;
  for (int n = 0; n < kAll; ++n) {
    int image = n;
    if (any_solid && is_solid[std::size_t(n)]) {
      for (int a = 0, rest = n, step = 1; a < D; ++a, rest /= 3, step *= 3)
        if (const int towards = rest % 3 - 1; towards != 0 && is_solid[std::size_t(kMiddle + towards * step)]) image -= towards * step;
      if (is_solid[std::size_t(image)]) continue;   // an edge of a solid
    }
    const int weight = kWeights<D>[std::size_t(n)];
    sum += weight * double(value_at(filling, places[std::size_t(image)], 0.0f));
    weights += weight;
  }
  return sum / weights;
}

/// `kind` as sets.
template <int D>
class KindSets {
 public:
  PlaceSet<D> liquid, air, solid;

  KindSets(const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks)
      : liquid(blocks, kind, CellKind::liquid), air(blocks, kind, CellKind::air), solid(blocks, kind, CellKind::solid), blocks_(blocks) {}

  /// Of a block, liquid cells beside air and air cells beside liquid.
  PlaceBits meeting(std::size_t slot) const { return (liquid[slot] & air.beside(blocks_, slot)) | (air[slot] & liquid.beside(blocks_, slot)); }
  bool meets(std::size_t i) const {
    constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
    return meeting(i / per_block) >> (i % per_block) & 1;
  }
  /// Of a block, liquid cells between a solid and air.
  PlaceBits between(std::size_t slot) const {
    PlaceBits found = 0;
    for (int a = 0; a < D && liquid[slot] != 0; ++a)
      for (const int side : {0, 1}) found |= air.beside(blocks_, slot, a, side) & solid.beside(blocks_, slot, a, 1 - side);
    return found & liquid[slot];
  }

 private:
  const ActiveBlocks<D>& blocks_;
};

/// Blocks with a cell within one of where liquid and air meet, or more.
template <int D>
std::vector<std::uint8_t> blocks_near_surface(const KindSets<D>& kinds, const ActiveBlocks<D>& blocks) {
  std::vector<std::uint8_t> near(blocks.count());
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      bool wet = false, dry = false;
      for (const std::int32_t other : blocks.neighbours(b)) {
        wet = wet || (other >= 0 && kinds.liquid[std::size_t(other)] != 0);
        dry = dry || other < 0 || kinds.air[std::size_t(other)] != 0;
      }
      near[b] = wet && dry;
    }
  });
  return near;
}

/// Those blocks and all around them. The average looks two cells far, which is beyond a neighbour that is one cell wide: the last of a periodic axis.
template <int D>
std::vector<std::uint8_t> with_neighbours(const std::vector<std::uint8_t>& near, const ActiveBlocks<D>& blocks) {
  std::vector<std::uint8_t> all(near.size());
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      for (const std::int32_t other : blocks.neighbours(b)) all[b] |= other >= 0 && near[std::size_t(other)];
  });
  return all;
}

/// The average fillings. Several ask for those of cells where liquid and air meet: they are kept.
template <int D>
class Averages {
 public:
  Averages(const std::vector<float>& filling, const std::vector<CellKind>& kind, const KindSets<D>& kinds, const ActiveBlocks<D>& blocks)
      : filling_(filling), kind_(kind), blocks_(blocks), kept_(blocks), average_(std::make_unique_for_overwrite<double[]>(blocks.size())) {
    base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slot = begin; slot < end; ++slot) {
        if (kept_[slot] = kinds.meeting(slot); kept_[slot] == 0) continue;
        const auto& around = blocks.neighbours(slot);
        const bool sees_solid = std::any_of(around.begin(), around.end(), [&](std::int32_t b) { return b >= 0 && kinds.solid[std::size_t(b)] != 0; });
        if (sees_solid || !blocks.all_places())
          for_places(kept_[slot], [&](std::size_t k) { average_[slot * kPerBlock + k] = mean(slot * kPerBlock + k); });
        else keep_in_the_open(slot);
      }
    });
  }
  double at(std::size_t i) const { return kept_.has(i) ? average_[i] : mean(i); }
  /// Across a level surface the average falls by a half from a cell to the next.
  float distance(std::size_t i) const { return float(1 - 2 * at(i)); }

 private:
  static constexpr std::size_t kPerBlock = std::size_t(Lattice<D>::kCellsPerBlock);

  double mean(std::size_t i) const { return mean_filling<D>(blocks_.places_around(i), filling_, kind_); }
  /// Of a block without a solid in or around it: mean_filling's sums, from a copy.
  void keep_in_the_open(std::size_t slot) {
    constexpr int kTile = Lattice<D>::kBlock + 2, kAll = ActiveBlocks<D>::kNeighbours;
    std::array<float, std::size_t(int_power(kTile, D))> tile{};
    blocks_.template for_tile<kTile, 1>(blocks_.block(slot), [&](int to, std::size_t from, auto count) {
      std::copy_n(&filling_[from], int(count), &tile[std::size_t(to)]);
    });
    for_places(kept_[slot], [&](std::size_t k) {
      const Cell<D> in_block = Lattice<D>::cell_in(Cell<D>{}, int(k));
      int first = 0;
      for (int a = 0; a < D; ++a) first = first * kTile + in_block[std::size_t(a)];
      double sum = 0;
      for (int n = 0; n < kAll; ++n) {
        int place = first;
        for (int a = 0, rest = n, step = 1; a < D; ++a, rest /= 3, step *= kTile) place += rest % 3 * step;
        sum += kWeights<D>[std::size_t(n)] * double(tile[std::size_t(place)]);
      }
      average_[slot * kPerBlock + k] = sum / double(int_power(4, D));
    });
  }

  const std::vector<float>& filling_;
  const std::vector<CellKind>& kind_;
  const ActiveBlocks<D>& blocks_;
  PlaceSet<D> kept_;
  std::unique_ptr<double[]> average_;   // of the cells kept
};

/// A film is a liquid cell between a solid and air along an axis across which the average changes most: beside a wall the top of deep liquid is none. In
/// a corner it may be one along several.
struct Film {
  std::ptrdiff_t above = -1;   // the air cell; none where the cell is no film along the axis
  float height = 0;            // [cells]
};

/// By axis. The average keeps the sum of a column and its mirror image, but takes both surfaces of what is thinner than it is wide for lower than they
/// are. Of the column's fillings f, g, 0 ... it makes (3 f + g) / 4 and (f + 2 g) / 4, which give f + g.
template <int D>
std::array<Film, std::size_t(D)> films_of(std::size_t i, const Averages<D>& averages, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  const auto kind_at = [&](std::ptrdiff_t j) { return value_at(kind, j, CellKind::air); };
  const auto mean_at = [&](std::ptrdiff_t j) { return j < 0 ? 0.0 : averages.at(std::size_t(j)); };
  std::array<Film, std::size_t(D)> films;
  if (kind[i] != CellKind::liquid) return films;
  for (int a = 0; a < D; ++a)
    for (const int side : {0, 1}) {
      const std::ptrdiff_t above = blocks.neighbour(i, a, side);
      if (above < 0 || kind_at(above) != CellKind::air || kind_at(blocks.neighbour(i, a, 1 - side)) != CellKind::solid) continue;
      const double low = mean_at(std::ptrdiff_t(i)), high = mean_at(above);
      double slope = 0;
      for (int b = 0; b < D; ++b)
        if (b != a) {
          std::array<double, 2> beside;
          for (const int s : {0, 1}) {
            const std::ptrdiff_t j = blocks.neighbour(i, b, s);
            beside[std::size_t(s)] = kind_at(j) == CellKind::solid ? low : mean_at(j);
          }
          if (std::max(beside[0], beside[1]) > 0.5) slope = std::max(slope, std::abs(beside[1] - beside[0]) / 2);
        }
      if (low - high > slope) films[std::size_t(a)] = {above, float(0.8 * low + 1.6 * high)};
    }
  return films;
}

/// The axes along which a cell is a film, a bit each.
template <int D>
std::uint8_t film_axes(std::size_t i, const Averages<D>& averages, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  const auto films = films_of(i, averages, kind, blocks);
  unsigned axes = 0;
  for (std::size_t a = 0; a < std::size_t(D); ++a) axes |= unsigned(films[a].above >= 0) << a;
  return std::uint8_t(axes);
}

/// What a cell has for a distance where liquid and air do not meet.
constexpr float distance_away(CellKind kind) { return kind == CellKind::liquid ? -1.0f : kind == CellKind::air ? 1.0f : 0.0f; }

/// The distance of a cell where they do from the surface that `kind` and the averages give.
template <int D>
float distance_at(std::size_t i, const Averages<D>& averages, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  const bool wet = kind[i] == CellKind::liquid;
  float far = averages.distance(i);
  float thickest = -1;   // [cells] of the films that this cell is, or bounds
  const auto take = [&](std::size_t cell, std::ptrdiff_t bound) {
    for (const Film& film : films_of(cell, averages, kind, blocks))
      if (film.above >= 0 && (bound < 0 || film.above == bound)) thickest = std::max(thickest, film.height);
  };
  if (wet) {
    take(i, -1);
  } else {
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1})
        if (const std::ptrdiff_t j = blocks.neighbour(i, a, side); j >= 0) take(std::size_t(j), std::ptrdiff_t(i));
  }
  if (thickest >= 0) far = (wet ? 0.5f : 1.5f) - thickest;
  return wet ? std::clamp(far, -kWithin, -kBeside) : std::clamp(far, kBeside, kWithin);
}

template <int D>
void set_distances(const Averages<D>& averages, const KindSets<D>& kinds, LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  cells.distance.resize(blocks.size());
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const std::size_t first = slot * per_block;
      for (std::size_t i = first; i < first + per_block; ++i) cells.distance[i] = distance_away(cells.kind[i]);
      for_places(kinds.meeting(slot), [&](std::size_t k) { cells.distance[first + k] = distance_at(first + k, averages, cells.kind, blocks); });
    }
  });
}

/// The cells among candidates(slot), of a block, that are wanted, ascending.
template <int D, class Candidates, class Wanted>
std::vector<std::size_t> cells_among(const ActiveBlocks<D>& blocks, const Candidates& candidates, const Wanted& is_wanted) {
  using Cells = std::vector<std::size_t>;
  return base::ordered_reduce(blocks.count(), kBlocksAtOnce, Cells{}, [&](std::size_t begin, std::size_t end) {
    Cells found;
    for (std::size_t slot = begin; slot < end; ++slot)
      for_places(candidates(slot), [&](std::size_t k) {
        const std::size_t i = slot * std::size_t(Lattice<D>::kCellsPerBlock) + k;
        if (is_wanted(i)) found.push_back(i);
      });
    return found;
  }, [](Cells all, const Cells& part) {
    all.insert(all.end(), part.begin(), part.end());
    return all;
  });
}

template <int D>
void set_films(const Averages<D>& averages, const KindSets<D>& kinds, LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  const std::vector<std::size_t> films =
      cells_among(blocks, [&](std::size_t slot) { return kinds.between(slot); }, [&](std::size_t i) { return film_axes(i, averages, cells.kind, blocks) != 0; });
  cells.film.assign(films.empty() ? 0 : blocks.size(), 0);
  for (const std::size_t i : films) cells.film[i] = film_axes(i, averages, cells.kind, blocks);
}

/// Air cells that the average puts well inside: gaps between particles. Of what a collider cuts it is not exact.
template <int D>
std::vector<std::size_t> air_inside(const Averages<D>& averages, const KindSets<D>& kinds, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  return cells_among(blocks, [&](std::size_t slot) { return kinds.air[slot] == 0 ? 0 : kinds.air[slot] & kinds.liquid.beside(blocks, slot); },
                     [&](std::size_t i) { return averages.distance(i) < 1 - 2 * kGap && !cells.open.cut(i, blocks); });
}

/// Liquid cells that the average puts outside, beside liquid that is inside.
template <int D>
std::vector<std::size_t> liquid_outside(const FaceFilling& filling, const Averages<D>& averages, const KindSets<D>& kinds, const LiquidCells<D>& cells,
                                        const ActiveBlocks<D>& blocks) {
  // The least filling of a cell that counts as inside: less is spray. No value that regular particles give, lest rounding decide.
  constexpr float kInside = 0.45f;
  const auto is_outside = [&](std::size_t i) {
    if (cells.distance[i] < -kBeside) return false;
    bool on_liquid = false;
    for (int a = 0; a < D && !on_liquid; ++a)
      for (const int side : {0, 1}) {
        const std::ptrdiff_t j = blocks.neighbour(i, a, side);
        on_liquid = on_liquid || (j >= 0 && cells.kind[std::size_t(j)] == CellKind::liquid && cells.distance[std::size_t(j)] < -kBeside &&
                                  filling.mean[std::size_t(j)] > kInside);
      }
    return on_liquid && averages.distance(i) > kBeside &&
           !(cells.film_at(i) > 0 && filling.on_walls[i] > kInside);
  };
  return cells_among(blocks, [&](std::size_t slot) { return kinds.liquid[slot] == 0 ? 0 : kinds.liquid[slot] & kinds.air.beside(blocks, slot); }, is_outside);
}

/// Whether air is within three cells along every axis.
template <int D>
bool is_near_air(std::size_t i, const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks) {
  constexpr int kReach = 3;
  for (int corner = 0; corner < 1 << D; ++corner) {
    Cell<D> first = blocks.cell_at(i);
    for (int a = 0; a < D; ++a) first[a] -= corner >> a & 1 ? kReach : 0;
    for (const std::ptrdiff_t at : blocks.template places<kReach + 1>(first))
      if (value_at(kind, at, CellKind::solid) == CellKind::air) return true;
  }
  return false;
}

/// Liquid cells near air in and beside which the liquid is thinner than chance makes it. How thin it is in a cell the particles of the liquid cells
/// around say, with weights 1, 2, 1 along each axis.
template <int D>
std::vector<std::size_t> thin_liquid(const std::vector<float>& count, const std::vector<float>& on_walls, double full, const std::vector<std::uint8_t>& near,
                                     const KindSets<D>& kinds, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  constexpr double kSquares = 0.375;   // the sum of the squared weights along an axis
  const auto least = float(1 - kThinDeviations * std::sqrt(std::pow(kSquares, D) / full));
  if (least <= 0) return {};
  const auto is_liquid = [&](std::ptrdiff_t j) { return j >= 0 && cells.kind[std::size_t(j)] == CellKind::liquid; };
  const auto is_thin = [&](std::size_t i) {
    if (!cells.open.is_open_around(i / std::size_t(Lattice<D>::kCellsPerBlock), blocks) && cells.open.cut(i, blocks)) return false;
    const auto places = blocks.places_around(i);
    int weights = 0;
    float sum = 0;
    for (int n = 0; n < ActiveBlocks<D>::kNeighbours; ++n) {
      const std::ptrdiff_t at = places[std::size_t(n)];
      if (!is_liquid(at)) continue;
      const int weight = kWeights<D>[std::size_t(n)];
      const float packed = cells.film_at(std::size_t(at)) > 0 ? on_walls[std::size_t(at)] : 0;
      sum += float(weight) * std::max(count[std::size_t(at)], packed);
      weights += weight;
    }
    return sum / float(weights) < least;
  };
  return cells_among(blocks, [&](std::size_t slot) { return near[slot] ? kinds.liquid[slot] : 0; }, [&](std::size_t i) {
    if (!is_thin(i)) return false;
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1})
        if (const std::ptrdiff_t j = blocks.neighbour(i, a, side); is_liquid(j) && !is_thin(std::size_t(j))) return false;
    return is_near_air(i, cells.kind, blocks);
  });
}

}  // namespace

template <int D>
std::vector<float> cell_filling(const CellRanges& ranges, const ActiveBlocks<D>& blocks, double full) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  std::vector<float> filling(blocks.size());
  base::parallel_chunks(ranges.occupied.size(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      float* const to = &filling[std::size_t(blocks.slot(ranges.occupied[b])) * per_block];
      for (std::size_t local = 0; local < per_block; ++local)
        to[local] = float(double(ranges.begin[b * per_block + local + 1] - ranges.begin[b * per_block + local]) / full);
    }
  });
  return filling;
}

template <int D>
std::vector<float> excess_filling(const std::vector<float>& filling, double aim, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  std::vector<float> excess(blocks.size());
  // What may not be around a cell inside: air, what meets it, and what a collider cuts.
  std::vector<std::uint8_t> is_rim(blocks.size());
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * per_block; i < end * per_block; ++i) {
      const bool meets_air = cells.kind[i] == CellKind::air || (!cells.distance.empty() && std::abs(cells.distance[i]) < 1);
      is_rim[i] = cells.kind[i] != CellKind::solid && (meets_air || cells.open.cut(i, blocks));
    }
  });
  base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * per_block; i < end * per_block; ++i) {
      if (cells.kind[i] != CellKind::liquid) continue;
      if (is_rim[i]) {
        if (cells.open.cut(i, blocks)) {
          const double full = double(cells.open.open_part(i, blocks)) * aim;
          excess[i] = float(std::clamp(double(filling[i]) - full - kByChance, 0.0, kMostPiled));
        }
        continue;
      }
      const auto places = blocks.places_around(i);
      const bool inside = std::all_of(places.begin(), places.end(), [&](std::ptrdiff_t at) { return at >= 0 && !is_rim[std::size_t(at)]; });
      if (inside) excess[i] = float(std::clamp(mean_filling<D>(places, filling, cells.kind) - aim, -kMostExcess, kMostExcess));
    }
  });
  return excess;
}

template <int D, class Real>
void find_surface(const FaceField<D, Real>& mass, const std::vector<float>& count, double full, LiquidCells<D>& cells,
                  const ActiveBlocks<D>& blocks) {
  KindSets<D> kinds(cells.kind, blocks);
  const std::vector<std::uint8_t> near = blocks_near_surface(kinds, blocks);
  const FaceFilling filling = face_filling(mass, full, cells, kinds.solid, blocks.all_places() ? near : with_neighbours(near, blocks), blocks);
  const auto become = [&](const std::vector<std::size_t>& changed, CellKind kind) {
    for (const std::size_t i : changed) {
      cells.kind[i] = kind;
      (kind == CellKind::liquid ? kinds.air : kinds.liquid).erase(i);
      (kind == CellKind::liquid ? kinds.liquid : kinds.air).insert(i);
    }
  };
  const Averages<D> averages(filling.mean, cells.kind, kinds, blocks);
  become(air_inside(averages, kinds, cells, blocks), CellKind::liquid);
  set_distances(averages, kinds, cells, blocks);
  set_films(averages, kinds, cells, blocks);
  const std::vector<std::size_t> outside = liquid_outside(filling, averages, kinds, cells, blocks);
  become(outside, CellKind::air);
  set_films(averages, kinds, cells, blocks);
  cells.thin = thin_liquid(count, filling.on_walls, full, near, kinds, cells, blocks);
  become(cells.thin, CellKind::air);
  // The average knows no kind but solid: the only distances that change are theirs and their neighbours'.
  const auto renew = [&](std::size_t i) {
    cells.distance[i] = kinds.meets(i) ? distance_at(i, averages, cells.kind, blocks) : distance_away(cells.kind[i]);
  };
  for (const std::vector<std::size_t>* changed : {&outside, &std::as_const(cells.thin)})
    for (const std::size_t i : *changed) {
      renew(i);
      for (int a = 0; a < D; ++a)
        for (const int side : {0, 1})
          if (const std::ptrdiff_t j = blocks.neighbour(i, a, side); j >= 0) renew(std::size_t(j));
    }
  set_films(averages, kinds, cells, blocks);
}

template void find_surface(const FaceField<2, float>&, const std::vector<float>&, double, LiquidCells<2>&, const ActiveBlocks<2>&);
template void find_surface(const FaceField<2, double>&, const std::vector<float>&, double, LiquidCells<2>&, const ActiveBlocks<2>&);
template void find_surface(const FaceField<3, float>&, const std::vector<float>&, double, LiquidCells<3>&, const ActiveBlocks<3>&);
template void find_surface(const FaceField<3, double>&, const std::vector<float>&, double, LiquidCells<3>&, const ActiveBlocks<3>&);
template std::vector<float> cell_filling(const CellRanges&, const ActiveBlocks<2>&, double);
template std::vector<float> excess_filling(const std::vector<float>&, double, const LiquidCells<2>&, const ActiveBlocks<2>&);
template std::vector<float> cell_filling(const CellRanges&, const ActiveBlocks<3>&, double);
template std::vector<float> excess_filling(const std::vector<float>&, double, const LiquidCells<3>&, const ActiveBlocks<3>&);

}  // namespace sim
