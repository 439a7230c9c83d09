#pragma once
// Interpolation between levels of the multigrid hierarchy: trilinear between cell middles (bilinear in two dimensions), tile by tile, and
// its transpose.
#include "sim/fluid/multigrid_level.h"

namespace sim {

/// Weights of interpolation from cells twice as wide: 3/4 of the parent, 1/4 of the next one on the cell's side of it.
inline constexpr float kNear = 0.75f, kFar = 0.25f;

/// Fine cell i lies in coarse cell parent(i) of the buffer and leans towards lean(i).
constexpr int parent(int i) { return i / 2 + 1; }
constexpr int lean(int i) { return parent(i) + (i % 2 ? 1 : -1); }

template <int D>
struct Interpolation {
  using T = Tile<D>;
  static constexpr int E = T::kEdge, H = Level<D>::kHalf, kCoarsePlanes = D == 3 ? H : 1;

  /// kCoarse values -> kCells.
  static void widen(const float* __restrict coarse, float* __restrict fine) {
    alignas(64) float lanes[kCoarsePlanes * H * E], rows[kCoarsePlanes * E * E];
    for (int i = 0; i < kCoarsePlanes * H; ++i)
      for (int l = 0; l < E; ++l) lanes[i * E + l] = kNear * coarse[i * H + parent(l)] + kFar * coarse[i * H + lean(l)];
    float* const all = D == 3 ? rows : fine;
    for (int p = 0; p < kCoarsePlanes; ++p)
      for (int r = 0; r < E; ++r) {
        const float* near = lanes + (p * H + parent(r)) * E;
        const float* far = lanes + (p * H + lean(r)) * E;
        for (int l = 0; l < E; ++l) all[(p * E + r) * E + l] = kNear * near[l] + kFar * far[l];
      }
    if constexpr (D == 3)
      for (int p = 0; p < E; ++p) {
        const float* near = rows + parent(p) * E * E;
        const float* far = rows + lean(p) * E * E;
        for (int i = 0; i < E * E; ++i) fine[p * E * E + i] = kNear * near[i] + kFar * far[i];
      }
  }

  /// Its transpose.
  static void narrow(const float* __restrict fine, float* __restrict coarse) {
    alignas(64) float lanes[kCoarsePlanes * H * E] = {}, rows[kCoarsePlanes * E * E] = {};
    const float* all = fine;
    if constexpr (D == 3) {
      for (int p = 0; p < E; ++p) {
        float* near = rows + parent(p) * E * E;
        float* far = rows + lean(p) * E * E;
        for (int i = 0; i < E * E; ++i) near[i] += kNear * fine[p * E * E + i];
        for (int i = 0; i < E * E; ++i) far[i] += kFar * fine[p * E * E + i];
      }
      all = rows;
    }
    for (int p = 0; p < kCoarsePlanes; ++p)
      for (int r = 0; r < E; ++r) {
        const float* from = all + (p * E + r) * E;
        float* near = lanes + (p * H + parent(r)) * E;
        float* far = lanes + (p * H + lean(r)) * E;
        for (int l = 0; l < E; ++l) near[l] += kNear * from[l];
        for (int l = 0; l < E; ++l) far[l] += kFar * from[l];
      }
    for (int i = 0; i < kCoarsePlanes * H; ++i) {
      float* const to = coarse + i * H;
      const float* const from = lanes + i * E;
      for (int c = 0; c < H; ++c) to[c] = 0;
      for (int l = 0; l < E; ++l) to[parent(l)] += kNear * from[l], to[lean(l)] += kFar * from[l];
    }
  }
};

/// A coarse tile and a cell in it, both along one axis: step is from the parent of a fine tile, -1, 0 or 1.
struct Slot {
  int step = 0, local = 0;
};
template <int D>
using Slots = std::array<std::array<Slot, std::size_t(Level<D>::kHalf)>, std::size_t(D)>;

/// Where the coarse cells lie that a fine tile interpolates from, along each axis.
template <int D>
Slots<D> slots(const Level<D>& coarse, const Cell<D>& tile) {
  constexpr int E = Tile<D>::kEdge, H = Level<D>::kHalf;
  Slots<D> out;
  for (int a = 0; a < D; ++a)
    for (int s = 0; s < H; ++s) {
      int local = (tile[a] % 2) * (E / 2) - 1 + s, step = local < 0 ? -1 : local >= E ? 1 : 0;
      if (coarse.periodic[a]) {
        const int n = coarse.cells[a], global = tile[a] / 2 * E + local;
        step = global < 0 ? -1 : global >= n ? 1 : step;
        local = (global % n + n) % n;
      }
      out[std::size_t(a)][std::size_t(s)] = {step, local & (E - 1)};
    }
  return out;
}

}  // namespace sim
