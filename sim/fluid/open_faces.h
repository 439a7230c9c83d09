#pragma once
// How much of every face is open: 1 in the free, 0 on walls, inside colliders and where a source gives the velocity, the fraction of its area where a
// collider cuts it.
#include <array>
#include <bitset>
#include <cstdint>
#include <vector>

#include "sim/colliders/solids.h"
#include "sim/fluid/sources.h"
#include "sim/transfer/blocks.h"

namespace sim {

/// Open fractions [1] of the lower faces of all places of the active blocks, and what a moving collider or a source pushes through the rest. Blocks
/// that neither a solid nor a source touches store nothing. A collider's distances at a face's corners and middle are taken as linear between them [Batty07]; less
/// than kLeastOpening counts as closed.
template <int D>
class OpenFaces {
 public:
  using Fractions = std::array<std::array<float, std::size_t(Lattice<D>::kCellsPerBlock)>, std::size_t(D)>;

  /// For the blocks, solids and sources as they are now. Fractions of blocks that were there before are kept where no solid moves.
  void update(const Solids<D>&, const ActiveBlocks<D>&, const Sources<D>* = nullptr);

  float operator()(int axis, std::size_t index) const {
    const std::int32_t part = part_[index / kPerBlock];
    return part < 0 ? 1.0f : fractions_[std::size_t(part)][std::size_t(axis)][index % kPerBlock];
  }
  /// What colliders move through the part of a face that they cover: that fraction times their speed along the axis [m/s]; or sources through all of it.
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
  /// The part of a cell that colliders leave open [1]: the mean of its faces, of which those that walls and sources close count as open.
  float open_part(std::size_t index, const ActiveBlocks<D>& blocks) const {
    float sum = 0;
    for (int a = 0; a < D; ++a)
      for (const int side : {0, 1}) {
        const std::ptrdiff_t face = side ? blocks.neighbour(index, a, 1) : std::ptrdiff_t(index);
        sum += face < 0 || !plane(a, std::size_t(face)) ? 1.0f : (*this)(a, std::size_t(face));
      }
    return sum / (2 * D);
  }
  /// The plane in which what is beside a collider slips that covers all or part of a face. Null of a face that is open, a wall's or a source's.
  struct Plane {
    std::array<float, std::size_t(D)> normal{};     // outward; 0: there is none
    std::array<float, std::size_t(D)> velocity{};   // [m/s] of the collider
  };
  const Plane* plane(int axis, std::size_t index) const {
    const std::int32_t part = part_[index / kPerBlock], at = part < 0 ? kOpen : planes_at_[std::size_t(part)];
    if (at < 0) return nullptr;
    const Plane& found = planes_[std::size_t(at)][std::size_t(axis)][index % kPerBlock];
    return found.normal == decltype(found.normal){} ? nullptr : &found;
  }
  /// Whether a source gives a face its velocity.
  bool held(int axis, std::size_t index) const {
    const std::int32_t part = held_.empty() ? kOpen : part_[index / kPerBlock];
    return part >= 0 && held_[std::size_t(part)][std::size_t(axis)][index % kPerBlock];
  }
  /// Whether a place that is closed on all sides is a source's.
  bool in_source(std::size_t index, const ActiveBlocks<D>& blocks) const {
    for (int a = 0; a < D && !held_.empty(); ++a) {
      const std::ptrdiff_t above = blocks.neighbour(index, a, 1);
      if (held(a, index) || (above >= 0 && held(a, std::size_t(above)))) return true;
    }
    return false;
  }
  /// Whether any collider moves, or a source acts.
  bool pushes() const { return !pushed_.empty(); }
  /// Whether all lower faces of a block's places are open.
  bool is_open(std::size_t slot) const { return part_[slot] < 0; }
  /// Whether all faces of its places are, upper ones too.
  bool is_open_around(std::size_t slot, const ActiveBlocks<D>& blocks) const {
    bool open = is_open(slot);
    for (int a = 0; a < D; ++a)
      if (const std::int32_t above = blocks.neighbour_block(slot, a, 1); above >= 0) open = open && is_open(std::size_t(above));
    return open;
  }

 private:
  static constexpr std::size_t kPerBlock = std::size_t(Lattice<D>::kCellsPerBlock);
  static constexpr std::int32_t kOpen = -1, kNew = -2;
  std::vector<std::int64_t> keys_;
  std::vector<std::int32_t> part_;      // of each slot, or kOpen
  using Flags = std::array<std::bitset<kPerBlock>, std::size_t(D)>;
  using Planes = std::array<std::array<Plane, kPerBlock>, std::size_t(D)>;
  std::vector<std::int32_t> planes_at_;         // of each of fractions_, or kOpen: no collider is near
  std::vector<Planes> planes_;
  std::vector<Fractions> fractions_, pushed_;   // pushed_: empty where no solid moves and no source acts
  std::vector<Flags> held_;                     // empty where no source acts
  double time_ = 0;                             // [s] of the solids
  std::int64_t generation_ = 0;                 // of the sources
};

inline constexpr double kLeastOpening = 0.01;

/// The part of a segment, or of a triangle, where a linear function with these values at its ends is above 0; 0 where it is 0 throughout.
double positive_part(double a, double b);
double positive_part(double a, double b, double c);
/// The integral of another linear function, v at the ends, over the rest of it, as a part of the segment or triangle.
double integral_of_rest(std::array<double, 2> distance, std::array<double, 2> v);
double integral_of_rest(std::array<double, 3> distance, std::array<double, 3> v);

}  // namespace sim
