#pragma once
// Sets of places of the active blocks, a bit each. What lies beside a set comes a block's places at a time, and blocks that hold none cost a word.
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/parallel.h"
#include "sim/transfer/blocks.h"

namespace sim {

/// Of a block, its places in a set: bit k is the place k in the block.
using PlaceBits = std::uint64_t;

/// Calls body(k) for the places k of a block, ascending.
template <class Body>
void for_places(PlaceBits bits, const Body& body) {
  for (; bits != 0; bits &= bits - 1) body(std::size_t(std::countr_zero(bits)));
}

/// 1 or 0 for each of `count` places, a multiple of eight.
inline void write_flags(PlaceBits bits, std::size_t count, std::uint8_t* flags) {
  for (std::size_t k = 0; k < count; k += 8) {   // eight bytes at a time: byte n keeps bit n of a copy of all eight, and becomes 1 if it is not 0
    const PlaceBits own = ((bits >> k & 0xff) * 0x0101010101010101u) & 0x8040201008040201u;
    const PlaceBits ones = (own + 0x7f7f7f7f7f7f7f7fu) >> 7 & 0x0101010101010101u;
    std::memcpy(flags + k, &ones, 8);
  }
}

/// Holds places alone, no bits of a cut block that are none.
template <int D>
class PlaceSet {
 public:
  static constexpr int kEdge = Lattice<D>::kBlock, kCells = Lattice<D>::kCellsPerBlock;
  static constexpr PlaceBits kAll = ~PlaceBits{0} >> (64 - kCells);
  static constexpr std::size_t kBlocksAtOnce = 64;

  PlaceSet() = default;
  explicit PlaceSet(const ActiveBlocks<D>& blocks) : bits_(blocks.count()) {}
  /// The places where a field of small numbers, below 4, has `value`.
  template <class Byte>
  PlaceSet(const ActiveBlocks<D>& blocks, const std::vector<Byte>& field, Byte value) : PlaceSet(blocks) {
    static_assert(sizeof(Byte) == 1);
    constexpr PlaceBits kOnes = 0x0101010101010101u;
    base::parallel_chunks(blocks.count(), kBlocksAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t slot = begin; slot < end; ++slot) {
        PlaceBits own = 0;
        for (std::size_t k = 0; k < std::size_t(kCells); k += 8) {   // eight bytes at a time, whose lowest bits a product gathers in its highest byte
          PlaceBits bytes;
          std::memcpy(&bytes, &field[slot * std::size_t(kCells) + k], 8);
          bytes ^= kOnes * PlaceBits(value);
          own |= ((~(bytes | bytes >> 1) & kOnes) * 0x0102040810204080u >> 56) << k;
        }
        bits_[slot] = own & places(blocks, slot);
      }
    });
  }

  PlaceBits operator[](std::size_t slot) const { return bits_[slot]; }
  PlaceBits& operator[](std::size_t slot) { return bits_[slot]; }
  bool has(std::size_t index) const { return bits_[index / std::size_t(kCells)] >> (index % std::size_t(kCells)) & 1; }
  bool any() const {
    return std::any_of(bits_.begin(), bits_.end(), [](PlaceBits bits) { return bits != 0; });
  }
  void insert(std::size_t index) { bits_[index / std::size_t(kCells)] |= PlaceBits{1} << (index % std::size_t(kCells)); }
  /// An insertion while other threads insert, too.
  void insert_beside_others(std::size_t index) {
    std::atomic_ref<PlaceBits>(bits_[index / std::size_t(kCells)]).fetch_or(PlaceBits{1} << (index % std::size_t(kCells)), std::memory_order_relaxed);
  }
  void erase(std::size_t index) { bits_[index / std::size_t(kCells)] &= ~(PlaceBits{1} << (index % std::size_t(kCells))); }

  /// The places of a block that have one of the set before (side 0) or after (1) them along an axis. Bits that are no place mean nothing.
  PlaceBits beside(const ActiveBlocks<D>& blocks, std::size_t slot, int axis, int side) const {
    const int stride = 1 << 2 * (D - 1 - axis);
    const std::int32_t other = blocks.neighbour_block(slot, axis, side);
    if (side) {
      const PlaceBits inside = (bits_[slot] & ~layer(axis, 0)) >> stride;
      return other < 0 ? inside : inside | (bits_[std::size_t(other)] & layer(axis, 0)) << stride * blocks.last_of(slot, axis);
    }
    const PlaceBits inside = (bits_[slot] & ~layer(axis, kEdge - 1)) << stride;
    if (other < 0) return inside;
    const int last = blocks.last_of(std::size_t(other), axis);
    return inside | (bits_[std::size_t(other)] & layer(axis, last)) >> stride * last;
  }
  /// The same along any axis.
  PlaceBits beside(const ActiveBlocks<D>& blocks, std::size_t slot) const {
    PlaceBits found = 0;
    for (int a = 0; a < D; ++a) found |= beside(blocks, slot, a, 0) | beside(blocks, slot, a, 1);
    return found;
  }
  /// All of a block that are places.
  static PlaceBits places(const ActiveBlocks<D>& blocks, std::size_t slot) {
    PlaceBits found = kAll;
    if (blocks.all_places()) return found;
    for (int a = 0; a < D; ++a)
      for (int k = kEdge - 1; k > blocks.last_of(slot, a); --k) found &= ~layer(a, k);
    return found;
  }

 private:
  /// The places of a block whose coordinate along an axis is k.
  static constexpr PlaceBits layer(int axis, int k) {
    constexpr std::array<PlaceBits, 3> kFirst{0x000000000000ffffu, 0x000f000f000f000fu, 0x1111111111111111u};   // of three axes; two are the last ones
    return (kFirst[std::size_t(axis + 3 - D)] & kAll) << (k << 2 * (D - 1 - axis));
  }

  std::vector<PlaceBits> bits_;
};

}  // namespace sim
