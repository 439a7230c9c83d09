#include "sim/fluid/face_filling.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"

namespace sim {
namespace {

/// The part of a cell, which is not solid, that is outside colliders, by its faces. Walls close whole faces and cut no cell.
template <int D>
float open_part(std::size_t i, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks) {
  constexpr float kLeast = 0.25f;
  float cut = 0, cuts = 0;
  for (int a = 0; a < D; ++a)
    for (const int side : {0, 1}) {
      const std::ptrdiff_t face = side ? blocks.neighbour(i, a, 1) : std::ptrdiff_t(i);
      const float w = face < 0 ? 1 : cells.open(a, std::size_t(face));
      if (w > 0 && w < 1) cut += w, ++cuts;
    }
  return cuts > 0 ? std::max(cut / cuts, kLeast) : 1;
}

/// What the next place along an axis holds, for the places of a block; 0 where no block is active.
template <int D, class Real>
void load_next(const std::vector<Real>& field, const ActiveBlocks<D>& blocks, std::size_t slot, int axis, std::array<Real, std::size_t(Lattice<D>::kCellsPerBlock)>& next) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock), last = Lattice<D>::kBlock - 1;
  const std::size_t shift = 2 * std::size_t(D - 1 - axis), step = std::size_t{1} << shift;
  if (!blocks.all_places()) {
    for (std::size_t k = 0; k < per_block; ++k) next[k] = value_at(field, blocks.neighbour(slot * per_block + k, axis, 1), Real(0));
    return;
  }
  const std::int32_t other = blocks.neighbour_block(slot, axis, 1);
  const Real* const own = &field[slot * per_block];
  std::copy_n(own + step, per_block - step, next.begin());
  for (std::size_t k = 0; k < per_block; ++k)
    if ((k >> shift & last) == last) next[k] = other < 0 ? Real(0) : field[std::size_t(other) * per_block + k - (last << shift)];
}

/// The cells that see no solid within two along any axis, and have no face that is cut or closed.
template <int D>
class FreeCells {
 public:
  FreeCells(const LiquidCells<D>& cells, const PlaceSet<D>& solid, const ActiveBlocks<D>& blocks) : solid_(solid), blocks_(blocks) {
    for (int a = 0; a < D; ++a) {
      open_[std::size_t(a)] = PlaceSet<D>(blocks);
      for (auto& beside : beside_[std::size_t(a)]) beside = PlaceSet<D>(blocks);
    }
    base::parallel_chunks(blocks.count(), PlaceSet<D>::kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slot = begin; slot < end; ++slot)
        for (int a = 0; a < D; ++a) {
          PlaceBits open = cells.open.is_open(slot) ? PlaceSet<D>::kAll : 0;
          for (std::size_t k = 0; k < kPerBlock && !cells.open.is_open(slot); ++k) open |= PlaceBits(cells.open(a, slot * kPerBlock + k) == 1) << k;
          open_[std::size_t(a)][slot] = open & PlaceSet<D>::places(blocks, slot);
          for (const int side : {0, 1}) beside_[std::size_t(a)][std::size_t(side)][slot] = solid.beside(blocks, slot, a, side) & PlaceSet<D>::places(blocks, slot);
        }
    });
  }
  PlaceBits operator()(std::size_t slot) const {
    PlaceBits found = PlaceSet<D>::places(blocks_, slot) & ~solid_[slot];
    for (std::size_t a = 0; a < std::size_t(D); ++a) {
      found &= open_[a][slot] & open_[a].beside(blocks_, slot, int(a), 1);
      for (const int side : {0, 1}) {
        const PlaceSet<D>& next = beside_[a][std::size_t(side)];
        found &= ~(next[slot] | next.beside(blocks_, slot, int(a), side));
      }
    }
    return found;
  }

 private:
  static constexpr std::size_t kPerBlock = std::size_t(Lattice<D>::kCellsPerBlock);
  const PlaceSet<D>& solid_;
  const ActiveBlocks<D>& blocks_;
  std::array<PlaceSet<D>, std::size_t(D)> open_;                        // lower faces
  std::array<std::array<PlaceSet<D>, 2>, std::size_t(D)> beside_;       // a solid is next along the axis, on that side
};

/// What particles leave beyond a solid side they would get back from their mirror images: it counts on this side.
template <int D, class Real>
class SidedFilling {
 public:
  SidedFilling(const FaceField<D, Real>& mass, double full, const LiquidCells<D>& cells, const ActiveBlocks<D>& blocks, FaceFilling& filling)
      : mass_(mass), full_(float(full)), cells_(cells), blocks_(blocks), filling_(filling) {}

  void set(std::size_t i) const {
    const float part = open_part(i, cells_, blocks_);
    float sum = 0;
    int axes = 0;
    for (int a = 0; a < D; ++a) {
      std::array<std::ptrdiff_t, std::size_t(int_power(3, D - 1))> images;   // the cell, and those beyond solid sides along the other axes
      std::size_t count = 0;
      images[count++] = std::ptrdiff_t(i);
      for (int b = 0; b < D; ++b) {
        if (b == a) continue;
        const std::size_t before = count;
        for (const int side : {0, 1})
          for (std::size_t k = 0; k < before && is_solid(blocks_.neighbour(i, b, side)); ++k) images[count++] = next(images[k], b, side);
      }
      float on_faces = 0;
      int faces = 0;
      for (const int side : {0, 1}) {
        float on_face = 0;
        const std::ptrdiff_t face = side ? blocks_.neighbour(i, a, 1) : std::ptrdiff_t(i);
        const bool is_wall = face >= 0 && !(cells_.open(a, std::size_t(face)) > 0);   // of whose stencil half is solid
        if (is_wall && (part < 1 || !is_solid(next(std::ptrdiff_t(i), a, side)))) continue;
        const std::ptrdiff_t before = side ? std::ptrdiff_t(i) : next(std::ptrdiff_t(i), a, 0), after = face;
        const bool reflects_before = is_solid(next(before, a, 0)), reflects_after = is_solid(next(after, a, 1));
        for (std::size_t k = 0; k < count; ++k) {
          const std::ptrdiff_t own = images[k], other = next(own, a, side);
          if (is_wall) on_face += 2 * float(on(a, side ? other : own));
          else on_face += side ? carried(a, own, other, reflects_before, reflects_after) : carried(a, other, own, reflects_before, reflects_after);
        }
        if (is_wall) filling_.on_walls[i] = std::max(filling_.on_walls[i], on_face / full_);
        on_faces += on_face, ++faces;
      }
      if (faces > 0) sum += on_faces / float(faces), ++axes;
    }
    filling_.mean[i] = axes > 0 ? sum / (float(axes) * full_ * part) : 0;
  }

 private:
  bool is_solid(std::ptrdiff_t j) const { return j >= 0 && cells_.kind[std::size_t(j)] == CellKind::solid; }
  std::ptrdiff_t next(std::ptrdiff_t cell, int axis, int side) const { return cell < 0 ? cell : blocks_.neighbour(std::size_t(cell), axis, side); }
  Real on(int axis, std::ptrdiff_t face) const { return face < 0 ? Real(0) : mass_[std::size_t(axis)][std::size_t(face)]; }
  /// By a face of cells (before, after) along an axis; a solid beside either reflects: its far face has what this one lacks.
  float carried(int axis, std::ptrdiff_t before, std::ptrdiff_t after, bool reflects_before, bool reflects_after) const {
    Real sum = on(axis, after);
    if (reflects_before) sum += on(axis, next(before, axis, 0));
    if (reflects_after) sum += on(axis, next(next(after, axis, 1), axis, 1));
    return float(sum);
  }

  const FaceField<D, Real>& mass_;
  float full_;
  const LiquidCells<D>& cells_;
  const ActiveBlocks<D>& blocks_;
  FaceFilling& filling_;
};

}  // namespace

template <int D, class Real>
FaceFilling face_filling(const FaceField<D, Real>& mass, double full, const LiquidCells<D>& cells, const PlaceSet<D>& solid, const std::vector<std::uint8_t>& near,
                         const ActiveBlocks<D>& blocks) {
  constexpr std::size_t per_block = std::size_t(Lattice<D>::kCellsPerBlock);
  FaceFilling filling{std::vector<float>(blocks.size()), std::vector<float>(blocks.size())};
  const SidedFilling<D, Real> sided(mass, full, cells, blocks, filling);
  const FreeCells<D> free_cells(cells, solid, blocks);
  base::parallel_chunks(blocks.count(), PlaceSet<D>::kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
    std::array<std::array<Real, per_block>, std::size_t(D)> next;
    for (std::size_t slot = begin; slot < end; ++slot) {
      if (!near[slot]) continue;
      const std::size_t first = slot * per_block;
      const PlaceBits free = free_cells(slot);
      if (free != 0) {
        for (int a = 0; a < D; ++a) load_next(mass[std::size_t(a)], blocks, slot, a, next[std::size_t(a)]);
        for (std::size_t k = 0; k < per_block; ++k) {
          float sum = 0;
          for (std::size_t a = 0; a < std::size_t(D); ++a) sum += (float(mass[a][first + k]) + float(next[a][k])) / 2;
          filling.mean[first + k] = free >> k & 1 ? sum / (float(D) * float(full)) : 0;
        }
      }
      for_places(PlaceSet<D>::places(blocks, slot) & ~(free | solid[slot]), [&](std::size_t k) { sided.set(first + k); });
    }
  });
  return filling;
}

template FaceFilling face_filling(const FaceField<2, float>&, double, const LiquidCells<2>&, const PlaceSet<2>&, const std::vector<std::uint8_t>&, const ActiveBlocks<2>&);
template FaceFilling face_filling(const FaceField<2, double>&, double, const LiquidCells<2>&, const PlaceSet<2>&, const std::vector<std::uint8_t>&, const ActiveBlocks<2>&);
template FaceFilling face_filling(const FaceField<3, float>&, double, const LiquidCells<3>&, const PlaceSet<3>&, const std::vector<std::uint8_t>&, const ActiveBlocks<3>&);
template FaceFilling face_filling(const FaceField<3, double>&, double, const LiquidCells<3>&, const PlaceSet<3>&, const std::vector<std::uint8_t>&, const ActiveBlocks<3>&);

}  // namespace sim
