// P2G: particle after particle. Particles of a cell reach the same nodes, so their sums stay in registers until the cell is done; what a sum's vectors
// are is said in scatter_nodes-inl.h and scatter_faces-inl.h.
#if defined(SIM_TRANSFER_SCATTER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_SCATTER_LANES_INL_H
#undef SIM_TRANSFER_SCATTER_LANES_INL_H
#else
#define SIM_TRANSFER_SCATTER_LANES_INL_H
#endif

#include <type_traits>

#include "base/prefetch.h"
#include "sim/transfer/scatter_faces-inl.h"
#include "sim/transfer/scatter_nodes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

constexpr std::uint32_t kAhead = 48, kNear = 8;   // particles whose rows are called for before they are needed: all rows, and long ones once more

/// Calls for the row of a particle to come, line by line: it lies where the last sort left it, and no hardware guesses that.
template <class S, class CallFor>
HWY_INLINE void prefetch_row(const float* coefficients, const CallFor& call_for) {
  const char* const row = reinterpret_cast<const char*>(coefficients);
#pragma GCC unroll 6
  for (std::size_t byte = 0; byte < sizeof(float) * S::kRow; byte += 64) call_for(row + byte);
  call_for(row + sizeof(float) * S::kRow - 1);
}
template <class S>
HWY_INLINE void prefetch_row(const float* coefficients) {
  prefetch_row<S>(coefficients, [](const char* line) SIM_LANES_INLINED { base::prefetch(line); });
}

template <class S, bool stressed>
using SumsOf = std::conditional_t<!S::faces, SumsOnNodes<S, stressed>, std::conditional_t<S::n == 3, SumsOnFaces<S>, SumsOnLinearFaces<S>>>;

/// What is made ahead of a block's particles.
template <class S, bool stressed>
struct Ahead {
  using Sums = SumsOf<S, stressed>;
  using Rows = typename Sums::Rows;
  const Block& block;
  const float* stress;
  float factor;
  std::uint32_t end, first, staged;   // of the block's particles; rows hold [first, staged)
  Rows rows;

  HWY_INLINE Ahead(const Block& b, const float* of_block, float scale)
      : block(b), stress(of_block), factor(scale), end(b.begin[Lattice<3>::kCellsPerBlock]), first(b.begin[0]), staged(first) {}
  HWY_INLINE std::size_t row_of(std::uint32_t p) const { return block.row ? block.row[p] : p; }
  /// Stages the next ones.
  HWY_NOINLINE void stage() {
    first = staged, staged = end - first < std::uint32_t(Rows::kMost) ? end : first + Rows::kMost;
    prefetch_offsets(block, staged, Rows::kMost);
    rows.make(block, first, staged, [&](std::uint32_t p, const float* offset, float* own) SIM_LANES_INLINED {
      Sums::make_rows(offset, block.coefficients + row_of(p) * S::kRow, factor, own);
    });
  }
};

/// Adds particles [p, end) of a cell to its sums.
template <class S, bool stressed>
HWY_INLINE void add_particles(const Ahead<S, stressed>& made, std::uint32_t p, std::uint32_t end, SumsOf<S, stressed>& sums) {
  const Block& block = made.block;
  const std::uint32_t last = made.end - 1;
  for (; p < end; ++p) {
    const std::size_t number = made.row_of(p);
    if (block.row) {
      const std::size_t ahead = block.row[p + kAhead < last ? p + kAhead : last];
      prefetch_row<S>(block.coefficients + ahead * S::kRow);
      constexpr std::uint32_t read_ahead = SumsOf<S, stressed>::kReadAhead;
      if constexpr (S::kRow >= kLongRow || read_ahead > 0) {   // a particle would wait for its lines one by one, what is made ahead for each row
        constexpr std::uint32_t near_by = kNear + read_ahead;
        const std::size_t near = block.row[p + near_by < last ? p + near_by : last];
        prefetch_row<S>(block.coefficients + near * S::kRow, [](const char* line) SIM_LANES_INLINED { base::prefetch_near(line); });
      }
      if constexpr (stressed) base::prefetch(made.stress + 6 * ahead);
    }
    sums.add(made.rows, p - made.first, block.coefficients + number * S::kRow, stressed ? made.stress + 6 * number : nullptr);
  }
}

template <class S, bool stressed>
HWY_INLINE void scatter_particles(const Block& block, const float* stress, float factor, float* HWY_RESTRICT to) {
  using Sums = SumsOf<S, stressed>;
  constexpr int edge = Lattice<3>::kBlock;
  Ahead<S, stressed> made(block, stress, factor);
  if (block.row)
    for (std::uint32_t p = made.first; p < made.end && p < made.first + kAhead; ++p) prefetch_row<S>(block.coefficients + made.row_of(p) * S::kRow);
  prefetch_offsets(block, made.first, Sums::Rows::kMost);
  typename Sums::Tile tile(to);
  for (int cell = 0; cell < Lattice<3>::kCellsPerBlock; ++cell) {
    std::uint32_t p = block.begin[cell];
    const std::uint32_t end = block.begin[cell + 1];
    if (p == end) continue;
    Sums sums;
    while (p < end) {
      if (p == made.staged) made.stage();
      const std::uint32_t until = end < made.staged ? end : made.staged;
      add_particles<S, stressed>(made, p, until, sums);
      p = until;
    }
    sums.add_to(tile, {cell / (edge * edge), cell / edge % edge, cell % edge});
  }
  tile.finish();
}

template <class S>
void scatter_block(const Block& block, float* tile) {
  scatter_particles<S, false>(block, nullptr, 0, tile);
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
