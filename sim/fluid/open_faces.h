#pragma once
// How much of every face is open: 1 in the free, 0 on walls and inside colliders, the fraction of its area where a collider cuts it.
#include <array>
#include <cstdint>
#include <vector>

#include "sim/colliders/solids.h"
#include "sim/transfer/blocks.h"

namespace sim {

/// Open fractions [1] of the lower faces of all places of the active blocks, and what a moving collider pushes through the rest. Blocks that
/// no solid touches store nothing. A collider's distances at a face's corners and middle are taken as linear between them [Batty07]; less
/// than kLeastOpening counts as closed.
template <int D>
class OpenFaces {
 public:
  using Fractions = std::array<std::array<float, std::size_t(Lattice<D>::kCellsPerBlock)>, std::size_t(D)>;

  /// For the blocks and solids as they are now. Fractions of blocks that were there before are kept where no solid moves.
  void update(const Solids<D>&, const ActiveBlocks<D>&);

  float operator()(int axis, std::size_t index) const {
    const std::int32_t part = part_[index / kPerBlock];
    return part < 0 ? 1.0f : fractions_[std::size_t(part)][std::size_t(axis)][index % kPerBlock];
  }
  /// What colliders move through the part of a face that they cover: that fraction times their speed along the axis [m/s].
  double pushed(int axis, std::size_t index) const {
    const std::int32_t part = pushed_.empty() ? kOpen : part_[index / kPerBlock];
    return part < 0 ? 0.0 : double(pushed_[std::size_t(part)][std::size_t(axis)][index % kPerBlock]);
  }
  /// Whether a collider cuts any face of a place's cell.
  bool cut(std::size_t index, const ActiveBlocks<D>& blocks) const {
    const auto is_part = [](float w) { return w > 0 && w < 1; };
    for (int a = 0; a < D; ++a) {
      const std::ptrdiff_t above = blocks.neighbour(index, a, 1);
      if (is_part((*this)(a, index)) || (above >= 0 && is_part((*this)(a, std::size_t(above))))) return true;
    }
    return false;
  }
  /// Whether any collider moves.
  bool pushes() const { return !pushed_.empty(); }
  /// Whether all lower faces of a block's places are open.
  bool is_open(std::size_t slot) const { return part_[slot] < 0; }

 private:
  static constexpr std::size_t kPerBlock = std::size_t(Lattice<D>::kCellsPerBlock);
  static constexpr std::int32_t kOpen = -1, kNew = -2;
  std::vector<std::int64_t> keys_;
  std::vector<std::int32_t> part_;      // of each slot, or kOpen
  std::vector<Fractions> fractions_, pushed_;   // pushed_: empty where no solid moves
  double time_ = 0;                             // [s] of the solids
};

inline constexpr double kLeastOpening = 0.01;

/// The part of a segment, or of a triangle, where a linear function with these values at its ends is above 0; 0 where it is 0 throughout.
double positive_part(double a, double b);
double positive_part(double a, double b, double c);

}  // namespace sim
