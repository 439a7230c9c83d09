// What the kernels of lanes.h are made of: rows of an axis, shapes of stencils, batches of particles. Compiled, like all *-inl.h here, once
// for every instruction set by the files that include kernels-inl.h (Highway's foreach_target).
#if defined(SIM_TRANSFER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_LANES_INL_H
#undef SIM_TRANSFER_LANES_INL_H
#else
#define SIM_TRANSFER_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <array>
#include <cstring>

#include "sim/transfer/lanes.h"
#include "sim/transfer/modes.h"

// Of lambdas whose captures would go through memory. Under the sanitizers, which look at every access, it would take minutes to compile.
#undef SIM_LANES_INLINED
#ifdef __SANITIZE_ADDRESS__
#define SIM_LANES_INLINED
#else
#define SIM_LANES_INLINED __attribute__((always_inline))
#endif

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
constexpr int kLanes = 8;
using Lanes = hn::FixedTag<float, kLanes>;
using Half = hn::FixedTag<float, kLanes / 2>;
using V = hn::Vec<Lanes>;
constexpr Lanes kTag{};

// --- one axis ---------------------------------------------------------------------------------------------------------

/// Where lanes of one cell find their nodes along an axis: all at the same (shared), or some one node further (wide: a row has an entry more,
/// which is 0 for those that do not reach it).
enum class Axis { shared_node, shared_middle, shared_corner, wide_corner, wide_middle };

template <Axis axis>
constexpr bool kIsWide = axis == Axis::wide_corner || axis == Axis::wide_middle;

/// From a particle's offset in its cell to its place from the middle of its stencil, as basis.h has it: in the lower half of the cell, in the upper one.
struct FromMiddle {
  float lower, upper;
};
template <Axis axis>
constexpr FromMiddle kFromMiddle = axis == Axis::shared_middle ? FromMiddle{-0.5f, -0.5f}
                                   : axis == Axis::wide_middle ? FromMiddle{0.5f, -0.5f}
                                   : axis == Axis::shared_corner ? FromMiddle{0, 0} : FromMiddle{0, -1};

// --- shapes -----------------------------------------------------------------------------------------------------------

/// The products a particle carries, by their number: 1, 4, 8, 10 or 27. All sets hold with a product every one below it.
template <int count>
constexpr bool keeps(int a, int b, int c) {
  if (count == 1) return a + b + c == 0;
  if (count == 4) return a + b + c <= 1;
  if (count == 8) return a <= 1 && b <= 1 && c <= 1;
  if (count == 10) return a + b + c <= 2;
  return true;
}
/// Whether a set has the mode g.
template <int count>
constexpr bool kBends = keeps<count>(2, 0, 0);

/// The set's modes in their order.
template <int count>
constexpr auto kModes = [] {
  std::array<ModeIndex<3>, count> modes{};
  std::size_t kept = 0;
  for (const ModeIndex<3>& mode : kSupplementOrder3)
    if (keeps<count>(mode[0], mode[1], mode[2])) modes[kept++] = mode;
  return modes;
}();

/// Nodes on one lattice (faces: one a component).
template <int n_, int count_, bool faces_>
struct Shape {
  static constexpr int n = n_, count = count_, tile = Lattice<3>::kBlock + n, places = tile * tile * tile;
  static constexpr bool faces = faces_;
  static constexpr int kRow = 3 * count;                               // numbers of a particle
  static constexpr int modes = count == 1 ? 1 : kBends<count> ? 3 : 2;   // of an axis
  static constexpr int lattices = faces ? 3 : 1, fields = lattices + 3;
  /// Of axis `axis` on lattice l.
  static constexpr Axis kind(int l, int axis) {
    if (!faces) return n == 3 ? Axis::shared_node : Axis::shared_corner;
    if (n == 3) return axis == l ? Axis::wide_corner : Axis::shared_middle;
    return axis == l ? Axis::shared_corner : Axis::wide_middle;
  }
  static constexpr int width(int l, int axis) { return n + (kind(l, axis) == Axis::wide_corner || kind(l, axis) == Axis::wide_middle); }
  /// First node of a cell's lanes, from the cell's own place in the tile.
  static constexpr int first(int l, int axis) { return kind(l, axis) == Axis::shared_corner ? 0 : -1; }
  static constexpr int first_place(int l) { return (first(l, 0) * tile + first(l, 1)) * tile + first(l, 2); }
};

// --- particles <-> lanes ----------------------------------------------------------------------------------------------

/// r[l] holds four numbers of lane l and four of lane l + 4; afterwards number l of all eight lanes. Its own inverse.
HWY_INLINE void transpose(V& r0, V& r1, V& r2, V& r3) {
  const hn::Repartition<double, Lanes> pairs;
  const auto t0 = hn::BitCast(pairs, hn::InterleaveLower(kTag, r0, r1)), t1 = hn::BitCast(pairs, hn::InterleaveUpper(kTag, r0, r1));
  const auto t2 = hn::BitCast(pairs, hn::InterleaveLower(kTag, r2, r3)), t3 = hn::BitCast(pairs, hn::InterleaveUpper(kTag, r2, r3));
  r0 = hn::BitCast(kTag, hn::InterleaveLower(pairs, t0, t2)), r1 = hn::BitCast(kTag, hn::InterleaveUpper(pairs, t0, t2));
  r2 = hn::BitCast(kTag, hn::InterleaveLower(pairs, t1, t3)), r3 = hn::BitCast(kTag, hn::InterleaveUpper(pairs, t1, t3));
}

/// Calls for the offsets of particles [p, p + count).
HWY_INLINE void prefetch_offsets(const Block& block, std::uint32_t p, std::uint32_t count) {
  const char* const first = reinterpret_cast<const char*>(block.offset + 3 * std::size_t(p));
  for (std::size_t byte = 0; byte < 3 * sizeof(float) * count; byte += 64) __builtin_prefetch(first + byte);
}

/// Offsets of eight particles from p on, 0 behind the block's last one: the next block's may be on the move.
HWY_INLINE void load_offsets(const Block& block, std::uint32_t p, V (&t)[3]) {
  const std::uint32_t end = block.begin[Lattice<3>::kCellsPerBlock];
  if (p + kLanes <= end) {
    hn::LoadInterleaved3(kTag, block.offset + 3 * std::size_t(p), t[0], t[1], t[2]);
    return;
  }
  HWY_ALIGN float some[3 * kLanes] = {};
  std::memcpy(some, block.offset + 3 * std::size_t(p), sizeof(float) * 3 * std::size_t(end - p));
  hn::LoadInterleaved3(kTag, some, t[0], t[1], t[2]);
}

constexpr int kLongRow = 48;   // numbers: rows of this many and more are stored, and called for, in ways that cost shorter ones more than they save

/// Eight particles: where their coefficients are, and which lanes count.
template <class S>
struct Batch {
  static constexpr int kRow = S::kRow;
  float* at[kLanes];
  V t[3];
  int size;

  /// Particles [p, p + lanes), whose rows follow each other from `first` on; lanes that do not count have `spare` for one.
  HWY_INLINE Batch(const Block& block, std::uint32_t p, int lanes, float* first, float* spare) : size(lanes) {
    for (int l = 0; l < kLanes; ++l) at[l] = l < lanes ? first + l * kRow : spare;
    load_offsets(block, p, t);   // lanes that do not count get the offsets of others, or 0
  }

  HWY_INLINE void store4(int from, const V* c) const {
    constexpr Half half{};
    V c0 = c[0], c1 = c[1], c2 = c[2], c3 = c[3];
    transpose(c0, c1, c2, c3);
    hn::StoreU(hn::LowerHalf(half, c0), half, at[0] + from), hn::StoreU(hn::UpperHalf(half, c0), half, at[4] + from);
    hn::StoreU(hn::LowerHalf(half, c1), half, at[1] + from), hn::StoreU(hn::UpperHalf(half, c1), half, at[5] + from);
    hn::StoreU(hn::LowerHalf(half, c2), half, at[2] + from), hn::StoreU(hn::UpperHalf(half, c2), half, at[6] + from);
    hn::StoreU(hn::LowerHalf(half, c3), half, at[3] + from), hn::StoreU(hn::UpperHalf(half, c3), half, at[7] + from);
  }
  /// Eight numbers of each row: half as many stores, which is what a batch of long rows waits for.
  HWY_INLINE void store8(int from, const V* c) const {
#pragma GCC unroll 2
    for (int upper = 0; upper < 2; ++upper) {   // particles 0 to 3, 4 to 7
      V of[4];
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) of[k] = upper ? hn::ConcatUpperUpper(kTag, c[k + 4], c[k]) : hn::ConcatLowerLower(kTag, c[k + 4], c[k]);
      transpose(of[0], of[1], of[2], of[3]);
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) hn::StoreU(of[k], kTag, at[4 * upper + k] + from);
    }
  }
};

/// Calls body(first particle, lanes, number of the cell) for the batches of a block's cells [first, end), cell by cell. They are listed first: how
/// many a cell has is as chance wants it, and a wrong guess there costs nothing while no batch is under way.
template <class Body>
HWY_INLINE void for_batches(const Block& block, int first, int end, const Body& body) {
  struct Listed {
    std::uint32_t first;
    std::uint16_t cell, size;
  };
  constexpr int kMost = 256;
  Listed list[kMost + 1];
  std::uint32_t p = block.begin[first];
  for (int cell = first; cell < end;) {
    int count = 0;
    while (cell < end && count < kMost) {   // no branch depends on a cell's particles: an entry that holds none is written over
      const std::uint32_t last = block.begin[cell + 1], left = last - p;
      list[count] = {p, std::uint16_t(cell), std::uint16_t(left < kLanes ? left : kLanes)};
      const bool more = left > kLanes;
      count += left > 0, cell += !more;
      p = more ? p + kLanes : last;
    }
    for (int b = 0; b < count; ++b) body(list[b].first, int(list[b].size), int(list[b].cell));
  }
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
