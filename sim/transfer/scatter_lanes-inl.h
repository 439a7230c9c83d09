// P2G: particle after particle. On nodes the lanes of a vector are the nodes of a row along z, with a mass and three momenta each; on faces, where a
// component has nodes of its own, those of a plane. Particles of a cell reach the same nodes, so their sums stay in registers until the cell
// is done. Weights and polynomials of some particles are made ahead, whatever cells these are in.
#if defined(SIM_TRANSFER_SCATTER_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_SCATTER_LANES_INL_H
#undef SIM_TRANSFER_SCATTER_LANES_INL_H
#else
#define SIM_TRANSFER_SCATTER_LANES_INL_H
#endif

#include "base/prefetch.h"
#include "sim/transfer/lanes-inl.h"
#include "sim/transfer/planes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

/// A number for each node of a stencil, in four lines: of the lower one, or of the upper one of a wide axis, a node further.
struct OfNodes {
  alignas(64) float lower[16], upper[16];
};
template <int n>
constexpr OfNodes of_nodes(float first, float middle, float last) {
  OfNodes r{};
  for (int line = 0; line < 4; ++line)
    for (int k = 0; k < n; ++k) r.lower[4 * line + k] = r.upper[4 * line + k + 1] = k == 0 ? first : k == n - 1 ? last : middle;
  return r;
}

/// What a particle at x from the middle of its stencil has at the nodes, as basis.h has it: the weights are c (a + b x)^2 + d, of the linear kernel
/// a + b x, the mode w the weight times node - x, the mode g the weight times (1 + p x)^2 (1 + q x)^2 (r + s x^2), the slope e + f x.
template <int n>
struct NodeNumbers;
template <>
struct NodeNumbers<2> {
  static constexpr OfNodes node = of_nodes<2>(0, 0, 1), a = of_nodes<2>(1, 0, 0), b = of_nodes<2>(-1, 0, 1);
};
template <>
struct NodeNumbers<3> {
  static constexpr OfNodes node = of_nodes<3>(-1, 0, 1), a = of_nodes<3>(0.5f, 0, 0.5f), b = of_nodes<3>(-1, 1, 1), c = of_nodes<3>(0.5f, -1, 0.5f),
                           d = of_nodes<3>(0, 0.75f, 0), p = of_nodes<3>(2, 2, -2), q = of_nodes<3>(0, -2, 0), r = of_nodes<3>(0.75f, -0.25f, 0.75f),
                           s = of_nodes<3>(-1, 0, -1), e = of_nodes<3>(-0.5f, 0, 0.5f), f = of_nodes<3>(1, -2, 1);
};

/// Rows of the three axes for the next particles of a block, four numbers each: weight times polynomial at the nodes, 0 where there is none.
template <class S, bool stressed>
class StagedRows {
 public:
  static constexpr int kMost = 64;                         // particles
  static constexpr int kRows = S::modes + stressed;        // of an axis: the modes', then the weights' slopes times a factor [1/cell]
  static constexpr int kNext = 16 * kMost;                 // numbers from a row to the same particle's next

  /// Those of particles [first, first + count) of all.
  HWY_INLINE void make(const Block& block, std::uint32_t first, std::uint32_t count, float factor) {
    const std::uint32_t last = block.begin[Lattice<3>::kCellsPerBlock] - 1;
    for (std::uint32_t at = 0; at < count; ++at) {
      const float* offset = block.offset + 3 * std::size_t(first + at);
      float alone[4] = {};
      if (first + at == last) offset = static_cast<const float*>(std::memcpy(alone, offset, 3 * sizeof(float)));   // four are read
      const P t = P::whole_lines(offset);
      make_of<S::kind(0, 0)>(t, factor, rows_[kKinds - 1][0][at]);
      if constexpr (S::faces) make_of<S::kind(0, 1)>(t, factor, rows_[0][0][at]);
    }
  }
  /// Row m of an axis on lattice l, of particle `at` of those.
  template <int l, int axis>
  HWY_INLINE const float* row(int m, std::uint32_t at) const {
    return rows_[S::faces && axis == l][m][at] + 4 * axis;
  }

 private:
  using P = Plane<4>;
  using Number = NodeNumbers<S::n>;
  static constexpr int kKinds = S::faces ? 2 : 1;          // of lattices, as an axis sees them: others, its own

  /// The rows of axes that all are as one lattice sees them.
  template <Axis axis>
  HWY_INLINE static void make_of(P t, float factor, float* HWY_RESTRICT to) {
    constexpr FromMiddle kShift = kFromMiddle<axis>;
    const P x = t + P::chosen(t, P::all(kShift.upper), P::all(kShift.lower));
    const auto of = [&](const OfNodes& number) SIM_LANES_INLINED {
      if constexpr (kIsWide<axis>) return P::chosen(t, P::load(number.upper), P::load(number.lower));
      else return P::load(number.lower);
    };
    P weight = fused(of(Number::b), x, of(Number::a));
    if constexpr (S::n == 3) weight = fused(of(Number::c) * weight, weight, of(Number::d));
    weight.store(to);
    if constexpr (S::modes > 1) (weight * (of(Number::node) - x)).store(to + kNext);
    if constexpr (S::modes > 2) {
      const P one = P::all(1.0f), root = fused(of(Number::p), x, one) * fused(of(Number::q), x, one);
      (weight * (root * root * fused(of(Number::s) * x, x, of(Number::r)))).store(to + 2 * kNext);
    }
    if constexpr (stressed) (P::all(factor) * fused(of(Number::f), x, of(Number::e))).store(to + S::modes * kNext);
  }

  alignas(64) float rows_[kKinds][kRows][kMost][16];
};

/// The numbers of products among a particle's coefficients.
template <int count>
constexpr auto kNumber = [] {
  struct {
    int of[3][3][3];
  } number{};
  for (int r = 0; r < count; ++r) number.of[kModes<count>[r][0]][kModes<count>[r][1]][kModes<count>[r][2]] = r;
  return number;
}();

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

/// What particles of one cell bring to nodes: vectors are nodes (i, j) of all k, of each its mass and momenta. A particle's are
/// sum_a X_a(i) sum_b Y_b(j) sum_m Z_m(k) C_abm, X, Y and Z being weight times polynomial along the axes and C_abm the mode's three coefficients
/// behind a mass, which is 1 for the constant mode and else 0. A stress adds its three columns, each with the slope of the weights along its axis.
template <class S, bool stressed>
class SumsOnNodes {
  using P = Plane<S::n == 2 ? 2 : 4>;

 public:
  using Staged = StagedRows<S, stressed>;

  HWY_INLINE SumsOnNodes() {
#pragma GCC unroll 3
    for (int i = 0; i < S::n; ++i)
#pragma GCC unroll 3
      for (int j = 0; j < S::n; ++j) sum_[i][j] = P::zero();
  }
  /// A particle by its number among the staged ones, its coefficients and its stress.
  HWY_INLINE void add(const Staged& rows, std::uint32_t at, const float* c, const float* stress) {
    const AlongZ along_z(rows, at, c, stress);
    constexpr int next = Staged::kNext;
    const float* const x = rows.template row<0, 0>(0, at);
    const float* const y = rows.template row<0, 1>(0, at);
#pragma GCC unroll 3
    for (int j = 0; j < S::n; ++j) {
      P along_yz[S::modes], slope;   // sums over b and m, by a
#pragma GCC unroll 3
      for (int a = 0; a < S::modes; ++a) {
        along_yz[a] = P::all(y[j]) * along_z.sum[a][0];
#pragma GCC unroll 3
        for (int b = 1; b < S::modes; ++b)
          if (keeps<S::count>(a, b, 0)) along_yz[a] = fused(P::all(y[b * next + j]), along_z.sum[a][b], along_yz[a]);
      }
      if constexpr (stressed) {
        along_yz[0] = fused(P::all(y[S::modes * next + j]), along_z.column_y, along_yz[0]);
        slope = P::all(y[j]) * along_z.column_x;
      }
#pragma GCC unroll 3
      for (int i = 0; i < S::n; ++i) {
#pragma GCC unroll 3
        for (int a = 0; a < S::modes; ++a) sum_[i][j] = fused(P::all(x[a * next + i]), along_yz[a], sum_[i][j]);
        if constexpr (stressed) sum_[i][j] = fused(P::all(x[S::modes * next + i]), slope, sum_[i][j]);
      }
    }
  }
  /// To the tile, at the cell's place in it. A fourth node of a row gets zeros.
  HWY_INLINE void add_to(float* HWY_RESTRICT tile, std::ptrdiff_t place) const {
    const std::ptrdiff_t first = place + S::first_place(0);
#pragma GCC unroll 3
    for (int i = 0; i < S::n; ++i)
#pragma GCC unroll 3
      for (int j = 0; j < S::n; ++j) sum_[i][j].add_to(tile + 4 * (first + (i * S::tile + j) * S::tile));
  }

 private:
  /// What is summed over m, by a and b; and the columns of the stress whose slopes are those along x and y.
  struct AlongZ {
    P sum[S::modes][S::modes], column_x, column_y;

    HWY_INLINE AlongZ(const Staged& rows, std::uint32_t at, const float* c, const float* stress) {
      P z[Staged::kRows];
#pragma GCC unroll 4
      for (int m = 0; m < Staged::kRows; ++m) z[m] = P::whole_lines(rows.template row<0, 2>(m, at));
#pragma GCC unroll 3
      for (int a = 0; a < S::modes; ++a)
#pragma GCC unroll 3
        for (int b = 0; b < S::modes; ++b) {
          if (!keeps<S::count>(a, b, 0)) continue;
          sum[a][b] = coefficients(c, kNumber<S::count>.of[a][b][0]) * z[0];
#pragma GCC unroll 3
          for (int m = 1; m < S::modes; ++m)
            if (keeps<S::count>(a, b, m)) sum[a][b] = fused(coefficients(c, kNumber<S::count>.of[a][b][m]), z[m], sum[a][b]);
        }
      if constexpr (stressed) {
        const P first = P::same_lines(stress), last = P::same_lines(stress + 2);   // xx xy xz yy, xz yy yz zz
        column_x = first.moved_up().without_first() * z[0];
        column_y = last.moved_up().template with<0b0010>(first).without_first() * z[0];
        sum[0][0] = fused(last.template with<0b0010>(last.moved_up()).without_first(), z[S::modes], sum[0][0]);
      }
    }
    /// Of a mode, behind its mass. Four numbers are read, the first of them another mode's; before the constant mode there is none.
    HWY_INLINE static P coefficients(const float* c, int number) {
      if (number > 0) return P::same_lines(c + 3 * number - 1).without_first();
      const P one = P::all(1.0f);
      if constexpr (S::count > 1) return P::same_lines(c).moved_up().template with<0b0001>(one);
      else return one.template with<0b0010>(P::all(c[0])).template with<0b0100>(P::all(c[1])).template with<0b1000>(P::all(c[2]));
    }
  };

  P sum_[S::n][S::n];
};

/// How the faces that a cell's particles reach on lattice l lie in vectors: lines of up to four along axis `along`, one vector a place of axis
/// `across`, which is not the lattice's own: that one has most places with the quadratic kernel, and with the linear one two, which take but half a
/// vector.
template <class S, int l>
struct FacePlanes {
  static constexpr int across = l == 0 ? 1 : 0, line = S::n == 2 || l == 0 ? l : 1, along = 3 - across - line;
  static constexpr int kWide = S::width(l, across), kLines = S::width(l, line), kLong = S::width(l, along);
  /// By axis what is given by its part.
  static constexpr std::array<int, 3> by_axis(int of_across, int of_line, int of_along) {
    std::array<int, 3> of{};
    of[across] = of_across, of[line] = of_line, of[along] = of_along;
    return of;
  }
};

/// What particles of one cell bring to the faces of lattice l. A particle's momentum at face (i, j, k) is sum_a X_a(i) sum_bm c_abm Y_b(j) Z_m(k), x
/// being the axis across, y that of lines: products of Y and Z are vectors over the plane, coefficients and X are numbers.
template <class S, int l>
class SumsOnFaces {
  using At = FacePlanes<S, l>;
  using P = Plane<(At::kLines > 2 ? 4 : 2)>;

 public:
  HWY_INLINE SumsOnFaces() {
#pragma GCC unroll 4
    for (int i = 0; i < At::kWide; ++i) mass_[i] = momentum_[i] = P::zero();
  }
  /// A particle by its number among the staged ones, and its coefficients.
  HWY_INLINE void add(const StagedRows<S, false>& rows, std::uint32_t at, const float* c) {
    P product[S::modes][S::modes];   // of y and z
#pragma GCC unroll 3
    for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 3
      for (int m = 0; m < S::modes; ++m)
        if (keeps<S::count>(0, b, m))
          product[b][m] = P::whole_lines(rows.template row<l, At::line>(b, at)) * P::same_lines(rows.template row<l, At::along>(m, at));
    const float* const x = rows.template row<l, At::across>(0, at);
#pragma GCC unroll 3
    for (int a = 0; a < S::modes; ++a) {
      P sum = P::all(c[number(a, 0, 0)]) * product[0][0];
#pragma GCC unroll 3
      for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 3
        for (int m = 0; m < S::modes; ++m)
          if (b + m > 0 && keeps<S::count>(a, b, m)) sum = fused(P::all(c[number(a, b, m)]), product[b][m], sum);
      add_along_x(x + a * StagedRows<S, false>::kNext, sum, momentum_);
    }
    add_along_x(x, product[0][0], mass_);
  }
  /// To the tile, at the cell's place in it.
  HWY_INLINE void add_to(float* HWY_RESTRICT tile, std::ptrdiff_t place) const {
    constexpr int kStride[3] = {S::tile * S::tile, S::tile, 1};
#pragma GCC unroll 4
    for (int i = 0; i < At::kWide; ++i) {
      float* const first = tile + place + S::first_place(l) + i * kStride[At::across];
      const auto add = [&](const P& sum, int field) SIM_LANES_INLINED {
        if constexpr (At::along == 2) sum.template add_to<At::kLines>(first + field * S::places, kStride[At::line]);
        else sum.template add_pairs_to<At::kLong>(first + field * S::places, kStride[At::along]);
      };
      add(mass_[i], l), add(momentum_[i], 3 + l);
    }
  }

 private:
  /// The number of a product's coefficient in a row.
  static constexpr int number(int a, int b, int m) {
    const auto [x, y, z] = At::by_axis(a, b, m);
    return 3 * kNumber<S::count>.of[x][y][z] + l;
  }
  HWY_INLINE static void add_along_x(const float* x, P plane, P (&sum)[At::kWide]) {
#pragma GCC unroll 4
    for (int i = 0; i < At::kWide; ++i) sum[i] = fused(P::all(x[i]), plane, sum[i]);
  }

  P mass_[At::kWide], momentum_[At::kWide];
};

/// The same of all three lattices, in one pass.
template <class S>
class SumsOnAllFaces : SumsOnFaces<S, 0>, SumsOnFaces<S, 1>, SumsOnFaces<S, 2> {
 public:
  HWY_INLINE SumsOnAllFaces() : SumsOnFaces<S, 0>(), SumsOnFaces<S, 1>(), SumsOnFaces<S, 2>() {}
  HWY_INLINE void add(const StagedRows<S, false>& rows, std::uint32_t at, const float* c, const float*) {
    SumsOnFaces<S, 0>::add(rows, at, c), SumsOnFaces<S, 1>::add(rows, at, c), SumsOnFaces<S, 2>::add(rows, at, c);
  }
  HWY_INLINE void add_to(float* HWY_RESTRICT tile, std::ptrdiff_t place) const {
    SumsOnFaces<S, 0>::add_to(tile, place), SumsOnFaces<S, 1>::add_to(tile, place), SumsOnFaces<S, 2>::add_to(tile, place);
  }
};

/// Adds particles [p, end) of one cell to the tile, at the cell's place in it; `at` is the number of p's staged rows.
template <class S, bool stressed>
HWY_INLINE void scatter_cell(const Block& block, const StagedRows<S, stressed>& rows, const float* stress, std::uint32_t p, std::uint32_t end,
                             std::uint32_t at, std::size_t place, float* HWY_RESTRICT tile) {
  const std::uint32_t last = block.begin[Lattice<3>::kCellsPerBlock] - 1;
  std::conditional_t<S::faces, SumsOnAllFaces<S>, SumsOnNodes<S, stressed>> sums;
  for (; p < end; ++p, ++at) {
    const std::size_t number = block.row ? block.row[p] : p;
    if (block.row) {
      const std::size_t ahead = block.row[p + kAhead < last ? p + kAhead : last];
      prefetch_row<S>(block.coefficients + ahead * S::kRow);
      if constexpr (S::kRow >= kLongRow) {   // a particle would wait for its lines one by one
        const std::size_t near = block.row[p + kNear < last ? p + kNear : last];
        prefetch_row<S>(block.coefficients + near * S::kRow, [](const char* line) SIM_LANES_INLINED { base::prefetch_near(line); });
      }
      if constexpr (stressed) base::prefetch(stress + 6 * ahead);
    }
    sums.add(rows, at, block.coefficients + number * S::kRow, stressed ? stress + 6 * number : nullptr);
  }
  sums.add_to(tile, std::ptrdiff_t(place));
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
      scatter_cell<S, stressed>(block, rows, stress, p, until, p - first, place, tile);
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
