// P2G: particle after particle, the nodes of a plane across x in the lanes of a vector. Particles of a cell reach the same nodes, so their sums stay
// in registers until the cell is done. Weights and polynomials are made for eight particles at a time, whatever cells these are in.
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

/// What particles of one cell bring to the nodes of lattice l. A particle's momentum at node (i, j, k) is sum_a X_a(i) sum_bm c_abm Y_b(j) Z_m(k), X,
/// Y and Z being weight times polynomial along the axes: products of Y and Z are vectors over the plane, coefficients and X are numbers.
template <class S, int l, bool stressed>
class CellSums {
 public:
  using Staged = StagedRows<S, stressed>;
  using P = Plane<Staged::kEdge>;

  HWY_INLINE CellSums() {
#pragma GCC unroll 4
    for (int i = 0; i < kWide; ++i) {
      mass_[i] = P::zero();
#pragma GCC unroll 3
      for (int k = 0; k < kComponents; ++k) momentum_[k][i] = P::zero();
    }
  }
  /// A particle by its number among the staged ones, its coefficients and its stress.
  HWY_INLINE void add(const Staged& rows, std::uint32_t at, const float* c, const float* stress) {
    P product[S::modes][S::modes];   // of y and z
#pragma GCC unroll 3
    for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 3
      for (int m = 0; m < S::modes; ++m)
        if (keeps<S::count>(0, b, m)) product[b][m] = in_plane(rows, at, b, m);
    P slope_y, slope_z;
    if constexpr (stressed) slope_y = in_plane(rows, at, S::modes, 0), slope_z = in_plane(rows, at, 0, S::modes);
    const float* const x = rows.template row<l, 0>(0, at);
    constexpr int next = Staged::kMost * 4;   // from mode to mode
#pragma GCC unroll 3
    for (int k = 0; k < kComponents; ++k) {
#pragma GCC unroll 3
      for (int a = 0; a < S::modes; ++a) {
        P sum = P::all(c[k * S::count + kNumber.of[a][0][0]]) * product[0][0];
#pragma GCC unroll 3
        for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 3
          for (int m = 0; m < S::modes; ++m)
            if (b + m > 0 && keeps<S::count>(a, b, m)) sum = fused(P::all(c[k * S::count + kNumber.of[a][b][m]]), product[b][m], sum);
        if constexpr (stressed) {
          if (a == 0) sum = fused(P::all(stress[kRow[k][2]]), slope_z, fused(P::all(stress[kRow[k][1]]), slope_y, sum));
        }
        add_along_x(x + a * next, sum, momentum_[k]);
      }
      if constexpr (stressed) add_along_x(x + S::modes * next, P::all(stress[kRow[k][0]]) * product[0][0], momentum_[k]);
    }
    add_along_x(x, product[0][0], mass_);
  }
  /// To the tile, from the cell's first node on.
  HWY_INLINE void add_to(float* HWY_RESTRICT first) const {
#pragma GCC unroll 4
    for (int i = 0; i < kWide; ++i) {
      float* const plane = first + i * S::tile * S::tile;
      mass_[i].template add_to<S::width(l, 1)>(plane + l * S::places, S::tile);
#pragma GCC unroll 3
      for (int k = 0; k < kComponents; ++k)
        momentum_[k][i].template add_to<S::width(l, 1)>(plane + (S::lattices + (S::faces ? l : k)) * S::places, S::tile);
    }
  }

 private:
  static constexpr int kWide = S::width(l, 0), kComponents = S::faces ? 1 : 3;
  static constexpr int kRow[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};   // of a symmetric matrix

  HWY_INLINE static P in_plane(const Staged& rows, std::uint32_t at, int y, int z) {
    return P::whole_lines(rows.template row<l, 1>(y, at)) * P::same_lines(rows.template row<l, 2>(z, at));
  }
  HWY_INLINE static void add_along_x(const float* x, P plane, P (&sum)[kWide]) {
#pragma GCC unroll 4
    for (int i = 0; i < kWide; ++i) sum[i] = fused(P::all(x[i]), plane, sum[i]);
  }

  P mass_[kWide], momentum_[kComponents][kWide];
};

/// Adds particles [p, end) of one cell to the tile, at the cell's place in it; `at` is the number of p's staged rows.
template <class S, int l, bool stressed>
HWY_INLINE void scatter_cell(const Block& block, const StagedRows<S, stressed>& rows, const float* stress, std::uint32_t p, std::uint32_t end,
                             std::uint32_t at, std::size_t place, float* HWY_RESTRICT tile) {
  const std::uint32_t last = block.begin[Lattice<3>::kCellsPerBlock] - 1;
  CellSums<S, l, stressed> sums;
  for (; p < end; ++p, ++at) {
    const std::size_t number = block.row ? block.row[p] : p;
    if (l == 0 && block.row) {
      const std::size_t ahead = block.row[p + kAhead < last ? p + kAhead : last];
      prefetch_row<S>(block.coefficients + ahead * S::kRow);
      if constexpr (stressed) __builtin_prefetch(stress + 6 * ahead);
    }
    sums.add(rows, at, block.coefficients + number * S::kRow + (S::faces ? l * S::count : 0), stressed ? stress + 6 * number : nullptr);
  }
  sums.add_to(tile + std::ptrdiff_t(place) + S::first_place(l));
}

template <class S, bool stressed>
HWY_INLINE void scatter_particles(const Block& block, const float* stress, float factor, float* HWY_RESTRICT tile) {
  constexpr int edge = Lattice<3>::kBlock, cells = Lattice<3>::kCellsPerBlock;
  const std::uint32_t end = block.begin[cells];
  if (block.row)
    for (std::uint32_t p = block.begin[0]; p < end && p < block.begin[0] + kAhead; ++p)
      prefetch_row<S>(block.coefficients + std::size_t(block.row[p]) * S::kRow);
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
