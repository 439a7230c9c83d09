// P2G: particle after particle, the nodes of a plane across x in the lanes of a vector. Particles of a cell reach the same nodes, so their sums stay in
// registers until the cell is done. Weights and polynomials are made for eight particles at a time, whatever cells these are in.
#if defined(SIM_TRANSFER_SCATTER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_SCATTER_LANES_INL_H
#undef SIM_TRANSFER_SCATTER_LANES_INL_H
#else
#define SIM_TRANSFER_SCATTER_LANES_INL_H
#endif

#include "sim/transfer/lanes-inl.h"
#include "sim/transfer/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

/// Rows of an axis for the next particles of a block, four numbers each: weight times polynomial at the nodes, 0 where there is none.
template <class S, bool stressed>
class StagedRows {
 public:
  static constexpr int kMost = 64;                         // particles
  static constexpr int kRows = S::modes + stressed;        // of an axis: the modes', then the weights' slopes times a factor [1/cell]
  static constexpr int kKinds = S::faces ? 2 : 1;          // of lattices, as an axis sees them: others, its own
  static constexpr int kEdge = S::width(0, 1) == 2 ? 2 : 4;   // of the plane that a vector holds

  /// Those of particles [p, p + count) of all.
  HWY_INLINE void make(const Block& block, std::uint32_t p, std::uint32_t count, float factor) {
    for (std::uint32_t at = 0; at < count; at += kLanes) {
      V t[3];
      load_offsets(block, p + at, t);
      make_axis<0>(t[0], at, factor), make_axis<1>(t[1], at, factor), make_axis<2>(t[2], at, factor);
    }
  }
  /// Row m of an axis on lattice l, of particle `at` of those.
  template <int l, int axis>
  HWY_INLINE const float* row(int m, std::uint32_t at) const {
    return rows_[S::faces && axis == l][axis][m][at];
  }

 private:
  template <int axis>
  HWY_INLINE void make_axis(V t, std::uint32_t at, float factor) {
    for_kind<axis, S::faces ? (axis + 1) % 3 : 0>(t, at, factor, 0);
    if constexpr (S::faces) for_kind<axis, axis>(t, at, factor, 1);
  }
  /// Of an axis as lattice l sees it.
  template <int axis, int l>
  HWY_INLINE void for_kind(V t, std::uint32_t at, float factor, int kind) {
    constexpr int width = S::width(l, axis);
    Rows<S::modes, width> rows;
    axis_rows<S::n, S::kind(l, axis), S::modes>(t, rows);
#pragma GCC unroll 3
    for (int m = 0; m < S::modes; ++m) store<axis, width>(rows.at[m], rows_[kind][axis][m][at]);
    if constexpr (stressed) {
      const V half = hn::Set(kTag, 0.5f), x = hn::IfThenElse(hn::Ge(t, half), hn::Sub(t, hn::Set(kTag, 1.0f)), t), f = hn::Set(kTag, factor);
      const V slope[3] = {hn::Mul(f, hn::Sub(x, half)), hn::Mul(f, hn::Mul(hn::Set(kTag, -2.0f), x)), hn::Mul(f, hn::Add(x, half))};
      store<axis, 3>(slope, rows_[kind][axis][S::modes][at]);
    }
  }
  /// For each lane its row. Where planes are 2 x 2 rows of y and z are stored as the plane has them.
  template <int axis, int width>
  HWY_INLINE static void store(const V (&row)[width], float* HWY_RESTRICT to) {
    constexpr Half half{};
    const V none = hn::Zero(kTag);
    V r[4] = {row[0], row[1], none, none};
    if constexpr (width > 2) r[2] = row[2];
    if constexpr (width > 3) r[3] = row[3];
    if constexpr (kEdge == 2 && axis == 1) r[1] = row[0], r[2] = r[3] = row[1];
    if constexpr (kEdge == 2 && axis == 2) r[2] = row[0], r[3] = row[1];
    transpose(r[0], r[1], r[2], r[3]);
#pragma GCC unroll 4
    for (int lane = 0; lane < 4; ++lane) {
      hn::Store(hn::LowerHalf(half, r[lane]), half, to + 4 * lane);
      hn::Store(hn::UpperHalf(half, r[lane]), half, to + 4 * (lane + 4));
    }
  }

  alignas(64) float rows_[kKinds][3][kRows][kMost][4];
};

/// The numbers of products among a particle's coefficients.
constexpr auto kNumber = [] {
  struct {
    int of[3][3][3];
  } number{};
  for (int r = 0; r < 27; ++r) number.of[kSupplementOrder3[r][0]][kSupplementOrder3[r][1]][kSupplementOrder3[r][2]] = r;
  return number;
}();

constexpr std::uint32_t kAhead = 32;   // particles whose rows are called for before they are needed

/// Calls for the row of a particle to come: it lies where the last sort left it, and no hardware guesses that.
template <class S>
HWY_INLINE void prefetch_row(const float* coefficients) {
  const char* const row = reinterpret_cast<const char*>(coefficients);
#pragma GCC unroll 6
  for (std::size_t byte = 0; byte < sizeof(float) * S::kRow; byte += 64) __builtin_prefetch(row + byte);
  __builtin_prefetch(row + sizeof(float) * S::kRow - 1);
}

/// Adds particles [p, end) of one cell to the tile, at the cell's place in it; `at` is the number of p's staged rows.
template <class S, int l, bool stressed>
HWY_INLINE void scatter_cell(const Block& block, const StagedRows<S, stressed>& rows, const float* stress, std::uint32_t p, std::uint32_t end,
                             std::uint32_t at, std::size_t place, float* HWY_RESTRICT tile) {
  using P = Plane<StagedRows<S, stressed>::kEdge>;
  constexpr int wx = S::width(l, 0), wy = S::width(l, 1), components = S::faces ? 1 : 3;
  const std::uint32_t last = block.begin[Lattice<3>::kCellsPerBlock] - 1;
  P mass[wx], momentum[components][wx];
#pragma GCC unroll 4
  for (int i = 0; i < wx; ++i) {
    mass[i] = P::zero();
#pragma GCC unroll 3
    for (int k = 0; k < components; ++k) momentum[k][i] = P::zero();
  }
  for (; p < end; ++p, ++at) {
    const std::size_t number = block.row ? block.row[p] : p;
    if (l == 0 && block.row) {
      const std::size_t ahead = block.row[p + kAhead < last ? p + kAhead : last];
      prefetch_row<S>(block.coefficients + ahead * S::kRow);
      if constexpr (stressed) __builtin_prefetch(stress + 6 * ahead);
    }
    const float* const c = block.coefficients + number * S::kRow + (S::faces ? l * S::count : 0);
    P product[S::modes][S::modes];   // of the other two axes
#pragma GCC unroll 3
    for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 3
      for (int m = 0; m < S::modes; ++m)
        if (keeps<S::count>(0, b, m))
          product[b][m] = P::whole_lines(rows.template row<l, 1>(b, at)) * P::same_lines(rows.template row<l, 2>(m, at));
    const float* const x = rows.template row<l, 0>(0, at);
    constexpr int next = StagedRows<S, stressed>::kMost * 4;   // from mode to mode
    P slope_y, slope_z;
    if constexpr (stressed) {
      slope_y = P::whole_lines(rows.template row<l, 1>(S::modes, at)) * P::same_lines(rows.template row<l, 2>(0, at));
      slope_z = P::whole_lines(rows.template row<l, 1>(0, at)) * P::same_lines(rows.template row<l, 2>(S::modes, at));
    }
#pragma GCC unroll 3
    for (int k = 0; k < components; ++k) {
      constexpr int symmetric[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
#pragma GCC unroll 3
      for (int a = 0; a < S::modes; ++a) {
        P sum = P::all(c[k * S::count + kNumber.of[a][0][0]]) * product[0][0];
#pragma GCC unroll 3
        for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 3
          for (int m = 0; m < S::modes; ++m)
            if (b + m > 0 && keeps<S::count>(a, b, m)) sum = fused(P::all(c[k * S::count + kNumber.of[a][b][m]]), product[b][m], sum);
        if constexpr (stressed) {
          if (a == 0) {
            sum = fused(P::all(stress[6 * number + std::size_t(symmetric[k][1])]), slope_y, sum);
            sum = fused(P::all(stress[6 * number + std::size_t(symmetric[k][2])]), slope_z, sum);
          }
        }
#pragma GCC unroll 4
        for (int i = 0; i < wx; ++i) momentum[k][i] = fused(P::all(x[a * next + i]), sum, momentum[k][i]);
      }
      if constexpr (stressed) {
        const P along = P::all(stress[6 * number + std::size_t(symmetric[k][0])]) * product[0][0];
#pragma GCC unroll 3
        for (int i = 0; i < wx; ++i) momentum[k][i] = fused(P::all(x[S::modes * next + i]), along, momentum[k][i]);
      }
    }
#pragma GCC unroll 4
    for (int i = 0; i < wx; ++i) mass[i] = fused(P::all(x[i]), product[0][0], mass[i]);
  }
  float* HWY_RESTRICT first = tile + std::ptrdiff_t(place) + S::first_place(l);
#pragma GCC unroll 4
  for (int i = 0; i < wx; ++i) {
    mass[i].template add_to<wy>(first + l * S::places + i * S::tile * S::tile, S::tile);
#pragma GCC unroll 3
    for (int k = 0; k < components; ++k)
      momentum[k][i].template add_to<wy>(first + (S::lattices + (S::faces ? l : k)) * S::places + i * S::tile * S::tile, S::tile);
  }
}

template <class S, bool stressed>
HWY_INLINE void scatter_particles(const Block& block, const float* stress, float factor, float* HWY_RESTRICT tile) {
  constexpr int edge = Lattice<3>::kBlock, cells = Lattice<3>::kCellsPerBlock;
  const std::uint32_t end = block.begin[cells];
  if (block.row)
    for (std::uint32_t p = block.begin[0]; p < end && p < block.begin[0] + kAhead; ++p) prefetch_row<S>(block.coefficients + std::size_t(block.row[p]) * S::kRow);
  prefetch_offsets(block, block.begin[0], StagedRows<S, stressed>::kMost);
  std::memset(tile, 0, sizeof(float) * std::size_t(S::fields * S::places + kTileSlack));
  StagedRows<S, stressed> rows;
  int cell = 0;
  for (std::uint32_t first = block.begin[0]; first < end; first += rows.kMost) {
    const std::uint32_t staged = end - first < std::uint32_t(rows.kMost) ? end - first : std::uint32_t(rows.kMost), stop = first + staged;
    prefetch_offsets(block, stop, std::uint32_t(rows.kMost));
    rows.make(block, first, staged, factor);
    for (std::uint32_t p = first; p < stop;) {
      while (block.begin[cell + 1] <= p) ++cell;
      const std::uint32_t until = block.begin[cell + 1] < stop ? block.begin[cell + 1] : stop;
      const std::size_t place = std::size_t(((cell / (edge * edge) + 1) * S::tile + cell / edge % edge + 1) * S::tile + cell % edge + 1);
      scatter_cell<S, 0, stressed>(block, rows, stress, p, until, p - first, place, tile);
      if constexpr (S::faces) {
        scatter_cell<S, 1, stressed>(block, rows, stress, p, until, p - first, place, tile);
        scatter_cell<S, 2, stressed>(block, rows, stress, p, until, p - first, place, tile);
      }
      p = until;
    }
  }
}

template <class S>
void scatter_block(const Block& block, float* tile) {
  scatter_particles<S, false>(block, nullptr, 0, tile);
}

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
