#include "sim/fluid/cells.h"

#include <algorithm>
#include <bitset>
#include <cmath>

#include "base/parallel.h"
#include "sim/transfer/place_set.h"

namespace sim {
namespace {

constexpr std::size_t kChunk = 256;   // blocks

using Cells = std::vector<std::size_t>;

Cells append(Cells all, const Cells& part) {
  all.insert(all.end(), part.begin(), part.end());
  return all;
}

/// Calls visit(index or kAbsent) for the neighbours across open faces.
template <int D, class Visit>
void across_open_faces(std::size_t i, const ActiveBlocks<D>& blocks, const OpenFaces<D>& open, const Visit& visit) {
  for (int a = 0; a < D; ++a) {
    if (open(a, i) > 0) visit(blocks.neighbour(i, a, 0));
    const std::ptrdiff_t above = blocks.neighbour(i, a, 1);
    if (above < 0 || open(a, std::size_t(above)) > 0) visit(above);
  }
}

template <int D>
bool is_closed(std::size_t i, const ActiveBlocks<D>& blocks, const OpenFaces<D>& open) {
  for (int a = 0; a < D; ++a) {
    const std::ptrdiff_t above = blocks.neighbour(i, a, 1);
    if (open(a, i) > 0 || (above >= 0 && open(a, std::size_t(above)) > 0)) return false;
  }
  return true;
}

/// Whether an air cell has liquid at an open face, and no air. Neighbours in `unsettled`, a flag a cell, are neither; empty: there are none.
template <int D>
bool is_gap(std::size_t i, const std::vector<CellKind>& kind, const std::vector<std::uint8_t>& unsettled, const ActiveBlocks<D>& blocks,
            const OpenFaces<D>& open) {
  if (kind[i] != CellKind::air) return false;
  bool wet = false, dry = false;
  across_open_faces(i, blocks, open, [&](std::ptrdiff_t j) {
    if (j >= 0 && !unsettled.empty() && unsettled[std::size_t(j)]) return;
    const CellKind near = value_at(kind, j, CellKind::air);
    wet = wet || near == CellKind::liquid;
    dry = dry || near == CellKind::air;
  });
  return wet && !dry;
}

/// No two cells of which this changes one are neighbours: their order does not matter.
template <int D>
void fill_gaps(std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks, const OpenFaces<D>& open) {
  const PlaceSet<D> air(blocks, kind, CellKind::air), liquid(blocks, kind, CellKind::liquid);
  const auto find = [&](std::size_t begin, std::size_t end) {
    Cells gaps;
    for (std::size_t slot = begin; slot < end; ++slot) {
      PlaceBits wet = air[slot] == 0 ? 0 : air[slot] & liquid.beside(blocks, slot);
      if (wet != 0 && open.is_open_around(slot, blocks)) wet &= ~air.beside(blocks, slot);
      for_places(wet, [&](std::size_t k) {
        if (const std::size_t i = slot * std::size_t(Lattice<D>::kCellsPerBlock) + k; is_gap(i, kind, {}, blocks, open)) gaps.push_back(i);
      });
    }
    return gaps;
  };
  const Cells gaps = base::ordered_reduce(blocks.count(), kChunk, Cells{}, find, append);
  for (const std::size_t i : gaps) kind[i] = CellKind::liquid;
}

/// The same of the cells beside `covered` ones, which are flagged in `unsettled`. In the wake of a body a cell whose middle has just come free is as
/// empty as its covered neighbour: each would take the other for air.
template <int D>
void fill_gaps_beside(const Cells& covered, const std::vector<std::uint8_t>& unsettled, std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks,
                      const OpenFaces<D>& open) {
  const auto find = [&](std::size_t begin, std::size_t end) {
    Cells gaps;
    for (std::size_t n = begin; n < end; ++n)
      across_open_faces(covered[n], blocks, open, [&](std::ptrdiff_t j) {
        if (j >= 0 && !unsettled[std::size_t(j)] && is_gap(std::size_t(j), kind, unsettled, blocks, open)) gaps.push_back(std::size_t(j));
      });
    return gaps;
  };
  const Cells gaps = base::ordered_reduce(covered.size(), kChunk, Cells{}, find, append);
  for (const std::size_t i : gaps) kind[i] = CellKind::liquid;
}

/// Cells without a particle that a moving collider may just have left: a cell further along its way, or as far as a step moves it, is inside it.
template <int D>
Cells just_freed(const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks, const Solids<D>& solids) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  constexpr double half = 0.5 * Lattice<D>::kBlock;
  struct Moving {
    const Shape* shape;
    const RigidMotion* motion;
  };
  std::vector<Moving> moving;
  const double longest = std::max(1.0, solids.longest_way()) * solids.cell;
  for (std::size_t s = 0; s < solids.shapes.size(); ++s)
    if (!solids.motions[s].rests()) moving.push_back({&solids.shapes[s], &solids.motions[s]});
  if (moving.empty()) return {};
  return base::ordered_reduce(blocks.count(), kChunk, Cells{}, [&](std::size_t begin, std::size_t end) {
    Cells found;
    for (std::size_t slot = begin; slot < end; ++slot) {
      const base::Vec3 centre = solids.place_in(Lattice<D>::cell_in(blocks.block(slot), 0), half);
      const double reach = half * std::sqrt(double(D)) * solids.cell + longest;
      for (const Moving& m : moving) {
        if (std::abs(m.shape->distance(centre)) > reach) continue;
        for (std::size_t i = slot * per_block; i < (slot + 1) * per_block; ++i) {
          if (kind[i] != CellKind::air) continue;
          const base::Vec3 middle = solids.place_in(blocks.cell_at(i), 0.5);
          if (m.shape->distance(middle) < 0) continue;
          const base::Vec3 velocity = m.motion->at(middle);
          const double speed = velocity.norm();
          if (speed == 0) continue;
          const base::Vec3 way = longest / speed * velocity;   // [m]
          if (m.shape->distance(middle + way) < 0 || m.shape->distance(middle + 0.5 * way) < 0) found.push_back(i);
        }
      }
    }
    return found;
  }, append);
}

/// Cells without a particle that a collider cuts. Not those before a face that advances: it presses together what is there, and gaps close.
template <int D>
Cells cut_empty(const std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks, const Solids<D>& solids, const OpenFaces<D>& open) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  if (solids.shapes.empty()) return {};
  const auto advances_on = [&](const Cell<D>& cell) {
    const base::Vec3 middle = solids.place_in(cell, 0.5);
    base::Vec3 normal;
    for (std::size_t s = 0; s < solids.shapes.size(); ++s) {
      if (solids.motions[s].rests() || solids.shapes[s].distance(middle, &normal) >= std::sqrt(double(D)) * solids.cell) continue;
      const base::Vec3 velocity = solids.motions[s].at(middle);
      if (normal.dot(velocity) > 0.1 * velocity.norm()) return true;
    }
    return false;
  };
  return base::ordered_reduce(blocks.count(), kChunk, Cells{}, [&](std::size_t begin, std::size_t end) {
    Cells found;
    for (std::size_t slot = begin; slot < end; ++slot) {
      const auto& around = blocks.neighbours(slot);
      if (std::all_of(around.begin(), around.end(), [&](std::int32_t b) { return b < 0 || open.is_open(std::size_t(b)); })) continue;
      for (std::size_t i = slot * per_block; i < (slot + 1) * per_block; ++i)
        if (kind[i] == CellKind::air && open.cut(i, blocks) && !advances_on(blocks.cell_at(i))) found.push_back(i);
    }
    return found;
  }, append);
}

/// A face that trails leaves a row of empty cells at once, each of which would take the next for air. What hangs together of `freed`, and single gaps
/// beside it, is liquid where liquid is around it and no air; cells in `unsettled`, a flag a cell, are neither. So are up to kByChance `cut`
/// cells: particles miss what is left of them now and then.
template <int D>
void fill_pockets(const Cells& freed, const Cells& cut, const std::vector<std::uint8_t>& unsettled, std::vector<CellKind>& kind,
                  const ActiveBlocks<D>& blocks, const OpenFaces<D>& open) {
  constexpr std::size_t kByChance = 3;
  if (freed.empty() && cut.empty()) return;
  enum : std::uint8_t { no, waits, is_of_a_group };
  std::vector<std::uint8_t> is_freed(kind.size());
  const auto is_air = [&](std::ptrdiff_t j) { return value_at(kind, j, CellKind::air) == CellKind::air && (j < 0 || !unsettled[std::size_t(j)]); };
  const auto is_single = [&](std::ptrdiff_t j) {   // no air beside it but what came free
    bool other = j < 0;
    if (j >= 0) across_open_faces(std::size_t(j), blocks, open, [&](std::ptrdiff_t k) { other = other || (is_air(k) && (k < 0 || !is_freed[std::size_t(k)])); });
    return !other;
  };
  for (const Cells* from : {&freed, &cut}) {
    std::fill(is_freed.begin(), is_freed.end(), no);
    for (const std::size_t i : *from) is_freed[i] = kind[i] == CellKind::air && !unsettled[i] ? waits : no;
    for (const std::size_t first : *from) {
      if (is_freed[first] != waits) continue;
      Cells group{first};
      is_freed[first] = is_of_a_group;
      bool wet = false, dry = false;
      for (std::size_t n = 0; n < group.size(); ++n)
        across_open_faces(group[n], blocks, open, [&](std::ptrdiff_t j) {
          wet = wet || (j >= 0 && kind[std::size_t(j)] == CellKind::liquid);
          if (!is_air(j) || (j >= 0 && is_freed[std::size_t(j)] == is_of_a_group)) return;
          if (j >= 0 && (is_freed[std::size_t(j)] || is_single(j))) is_freed[std::size_t(j)] = is_of_a_group, group.push_back(std::size_t(j));
          else dry = true;
        });
      if (wet && !dry && (from == &freed || group.size() <= kByChance))
        for (const std::size_t i : group) kind[i] = CellKind::liquid;
    }
  }
}

/// Cells that are open but whose middle is in a collider, and hold no particle; and those beside them.
template <int D>
void settle_covered(const Cells& covered, const Cells& freed, const Cells& cut, std::vector<CellKind>& kind, const ActiveBlocks<D>& blocks,
                    const OpenFaces<D>& open) {
  if (covered.empty() && freed.empty() && cut.empty()) return;
  std::vector<CellKind> settled(covered.size(), CellKind::air);
  std::vector<std::uint8_t> is_covered(kind.size());
  for (const std::size_t i : covered) is_covered[i] = 1;
  fill_pockets(freed, cut, is_covered, kind, blocks, open);
  fill_gaps_beside(covered, is_covered, kind, blocks, open);
  base::parallel_chunks(covered.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      int wetter = 0;
      across_open_faces(covered[n], blocks, open, [&](std::ptrdiff_t j) {
        if (j < 0 || !is_covered[std::size_t(j)]) wetter += value_at(kind, j, CellKind::air) == CellKind::liquid ? 1 : -1;
      });
      if (wetter > 0) settled[n] = CellKind::liquid;
    }
  });
  for (std::size_t n = 0; n < covered.size(); ++n) kind[covered[n]] = settled[n];
}

}  // namespace

template <int D>
std::vector<CellKind> classify_cells(const CellRanges& ranges, const ActiveBlocks<D>& blocks, const Solids<D>& solids, const OpenFaces<D>& open,
                                     bool free_surface) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  std::vector<CellKind> kind(blocks.size());
  const CellKind free = free_surface ? CellKind::air : CellKind::liquid;
  Cells covered = base::ordered_reduce(blocks.count(), kChunk, Cells{}, [&](std::size_t begin, std::size_t end) {
    Cells found;
    for (std::size_t slot = begin; slot < end; ++slot) {
      if (open.is_open(slot)) {
        std::fill_n(&kind[slot * per_block], per_block, free);
        for (std::size_t i = slot * per_block; !blocks.all_places() && i < (slot + 1) * per_block; ++i)
          if (!blocks.is_place(i)) kind[i] = CellKind::solid;
        continue;
      }
      std::bitset<per_block> middle_is_solid;   // what no collider covers is solid only behind a wall, where no face is open
      if (!solids.shapes.empty()) middle_is_solid = solids.solid_cells(blocks.block(slot));
      for (std::size_t local = 0; local < per_block; ++local) {
        const std::size_t i = slot * per_block + local;
        kind[i] = !blocks.is_place(i) || is_closed(i, blocks, open) ? CellKind::solid : free;
        if (middle_is_solid[local] && kind[i] == CellKind::air) found.push_back(i);
      }
    }
    return found;
  }, append);
  if (!free_surface) return kind;
  base::parallel_chunks(ranges.occupied.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const auto first = std::size_t(blocks.slot(ranges.occupied[b])) * per_block;
      for (std::size_t local = 0; local < per_block; ++local) {
        const bool empty = ranges.begin[b * per_block + local] == ranges.begin[b * per_block + local + 1];
        CellKind& k = kind[first + local];
        if (!empty && k == CellKind::air) k = CellKind::liquid;
      }
    }
  });
  std::erase_if(covered, [&](std::size_t i) { return kind[i] != CellKind::air; });
  settle_covered(covered, just_freed(kind, blocks, solids), cut_empty(kind, blocks, solids, open), kind, blocks, open);
  fill_gaps(kind, blocks, open);
  return kind;
}

template std::vector<CellKind> classify_cells(const CellRanges&, const ActiveBlocks<2>&, const Solids<2>&, const OpenFaces<2>&, bool);
template std::vector<CellKind> classify_cells(const CellRanges&, const ActiveBlocks<3>&, const Solids<3>&, const OpenFaces<3>&, bool);

}  // namespace sim
