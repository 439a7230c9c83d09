// P2G on faces. Each component has nodes of its own: a lattice of faces a component, with stencils of its own.
#if defined(SIM_TRANSFER_SCATTER_FACES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_SCATTER_FACES_INL_H
#undef SIM_TRANSFER_SCATTER_FACES_INL_H
#else
#define SIM_TRANSFER_SCATTER_FACES_INL_H
#endif

#include <immintrin.h>

#include <algorithm>
#include <numeric>

#include "sim/transfer/scatter_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

// --- quadratic kernel ---------------------------------------------------------------------------------------------------

/// A line of a vector is a place along a lattice's own axis, of all three lattices at once: the momenta of x, y and z, and the mass of z. Across that axis
/// lattices have the same stencils, along the axes that follow theirs in turn: the first one (y of the faces of x, z of those of y, x of those of z)
/// and the second one.
struct Turn {
  static constexpr int first(int lattice) { return (lattice + 1) % 3; }
  static constexpr int second(int lattice) { return (lattice + 2) % 3; }
};

/// A particle's coefficients, turned: three of mode m along each lattice's own axis, a along its first one and b along its second one.
template <int count>
struct TurnedRow {
  static constexpr int kVectors = (3 * count + 15) / 16, kSize = 16 * kVectors;
  /// Where the mode's first number is. The set of 27 has gaps behind 15 and 24 modes, so that whole vectors are made of what lies together in a row.
  static constexpr int place(int m, int a, int b) {
    const int number = kNumber<count>.of[m][a][b];
    return 3 * number + (count < 27 || number < 15 ? 0 : number < 24 ? 3 : 8);
  }
  static constexpr std::array<int, kSize> kFrom = [] {
    std::array<int, kSize> from{};
    from.fill(-1);
    for (const auto& [m, a, b] : kModes<count>)
      for (int lattice = 0; lattice < 3; ++lattice) {
        int mode[3]{};
        mode[lattice] = m, mode[Turn::first(lattice)] = a, mode[Turn::second(lattice)] = b;
        from[std::size_t(place(m, a, b) + lattice)] = 3 * kNumber<count>.of[mode[0]][mode[1]][mode[2]] + lattice;
      }
    return from;
  }();

  HWY_INLINE static void make(const float* c, float* HWY_RESTRICT to) {
#if HWY_TARGET <= HWY_AVX3
    if constexpr (3 * count < 16) {
      constexpr hn::CappedTag<float, 16> tag;
      alignas(64) static constexpr auto places = [] {
        std::array<std::int32_t, 16> r{};
        for (std::size_t k = 0; k < 16; ++k) r[k] = std::max(kFrom[k], 0);
        return r;
      }();
      const auto row = hn::MaskedLoad(hn::FirstN(tag, 3 * count), tag, c);
      hn::Store(hn::TableLookupLanes(row, hn::SetTableIndices(tag, places.data())), tag, to);
      return;
    } else {
      for_each_number<kVectors>([&](auto v) SIM_LANES_INLINED {
        constexpr int own_place = 16 * decltype(v)::value;
        constexpr auto begin = kFrom.begin() + own_place, end = begin + 16;
        constexpr int lowest = std::accumulate(begin, end, 3 * count, [](int least, int k) { return k < 0 ? least : std::min(least, k); });
        constexpr int highest = *std::max_element(begin, end);
        constexpr int first = std::min(lowest, 3 * count - 16), second = std::min(first + 16, 3 * count - 16);
        static_assert(highest < second + 16);
        alignas(64) static constexpr auto places = [] {
          std::array<std::int32_t, 16> r{};
          for (std::size_t k = 0; k < 16; ++k) {
            const int own = kFrom[std::size_t(own_place) + k];
            r[k] = own < 0 ? 0 : own < first + 16 ? own - first : own - second + 16;
          }
          return r;
        }();
        const __m512 numbers = _mm512_permutex2var_ps(_mm512_loadu_ps(c + first), _mm512_load_si512(places.data()), _mm512_loadu_ps(c + second));
        _mm512_store_ps(to + 16 * v, numbers);
      });
      return;
    }
#endif
    for_each_number<kSize>([&](auto k) SIM_LANES_INLINED {
      if constexpr (kFrom[std::size_t(k)] >= 0) to[k] = c[kFrom[std::size_t(k)]];
    });
  }
};

/// What particles of a block bring to faces: of each face its momentum and its mass. Lattices lie in an order of their own, by the second axis behind the
/// first one and their own behind both, until all are there.
template <class S>
class FaceTile {
 public:
  static constexpr int kEdge = S::tile, kStep = kEdge * kEdge;

  HWY_INLINE explicit FaceTile(float* tile) : tile_(tile) { std::memset(turned_, 0, sizeof turned_); }
  /// A cell's first faces of a lattice, by its coordinates in the block.
  HWY_INLINE float* first(int lattice, const int (&cell)[3]) {
    return turned_[lattice][(cell[Turn::first(lattice)] * kEdge + cell[Turn::second(lattice)]) * kEdge + cell[lattice]];
  }
  /// From it, of the face (i, j) across.
  static constexpr int step(int i, int j) { return 2 * (i * kEdge + j) * kEdge; }

  /// Puts them in the tile's order.
  HWY_INLINE void finish() {
    for (int p = 0; p < kEdge; ++p) {   // a plane across y of the faces of x, across x of those of y
      transpose_plane(turned_[0] + p * kStep, kEdge, tile_ + p * kEdge, kStep);
      transpose_plane(turned_[1] + p * kEdge, kStep, tile_ + S::places + p * kStep, kEdge);
    }
    float* const masses = tile_ + 2 * S::places;
    for (int place = 0; place < S::places; ++place) masses[place] = turned_[2][place][1], masses[3 * S::places + place] = turned_[2][place][0];
  }

 private:
  /// Face (i, j) to (j, i): faces of a line follow each other, lines come by steps.
  HWY_INLINE static void transpose_plane(const float (*from)[2], int from_step, float* HWY_RESTRICT mass_and_momentum, int to_step) {
    static_assert(kEdge > 4 && kEdge <= 8);
    for (const int i : {0, kEdge - 4})   // lines 0 to 3 and 3 to 6
      for (const int j : {0, kEdge - 4}) {
        hn::Vec<Line> momentum[4], mass[4];
#pragma GCC unroll 4
        for (int k = 0; k < 4; ++k) {
          const float* const line = from[(i + k) * from_step + j];
          const auto first = hn::LoadU(kLine, line), last = hn::LoadU(kLine, line + 4);
          momentum[k] = hn::ConcatEven(kLine, last, first), mass[k] = hn::ConcatOdd(kLine, last, first);
        }
        float* const to = mass_and_momentum + j * to_step + i;
        transpose_lines(mass), transpose_lines(momentum);
#pragma GCC unroll 4
        for (int k = 0; k < 4; ++k) hn::StoreU(mass[k], kLine, to + k * to_step), hn::StoreU(momentum[k], kLine, to + 3 * S::places + k * to_step);
      }
  }

  float* tile_;
  alignas(64) float turned_[3][S::places][2];
};

/// What particles of one cell bring to the faces. Coefficients go to faces along the lattices' own axes, then along the first axis, then the second.
template <class S>
class SumsOnFaces {
  using P = Plane<4>;
  using Pairs = Plane<2>;
  using Turned = TurnedRow<S::count>;

 public:
  using Tile = FaceTile<S>;
  /// Of the first axes: weights, a line a node, and x. The same of the second ones. Of both, two lines each: s. Of the own axes: weights, w times the
  /// weights, s e. Weights of x and y in turn. Coefficients.
  static constexpr int kFirst = 0, kSecond = 1, kS = 2, kOwn = S::modes > 2 ? 3 : 2, kPairs = kOwn + S::modes, kCoefficients = kPairs + 1,
                       kRows = kCoefficients + Turned::kVectors;
  using Rows = StagedRows<kRows, 16>;   // of more, coefficients and all, the nearest cache would not hold rows and tile
  static constexpr std::uint32_t kReadAhead = Rows::kMost;   // particles whose coefficients are read before they are added

  HWY_INLINE SumsOnFaces() : momentum_(), mass_() {}
  HWY_INLINE static void make_rows(const float* offset, const float* c, float, float* HWY_RESTRICT to) {
    const P t = P::same_lines(offset).third_twice();
    const AlongAxes<3, Axis::shared_middle, LinesOf::nodes> across(t);
    const P numbers = across.weights().with_fourth_line(across.x);
    numbers.turned().store(to + 16 * kFirst), numbers.turned_twice().store(to + 16 * kSecond);
    if constexpr (S::modes > 2) {
      const P s = across.s();
      s.turned().with_upper_lines(s.turned_twice()).store(to + 16 * kS);
    }
    const AlongAxes<3, Axis::wide_corner, LinesOf::nodes> own(t);
    const P weights = own.weights();
    weights.store(to + 16 * kOwn);
    weights.first_pairs().store(to + 16 * kPairs);
    if constexpr (S::modes > 1) own.weighted_offsets(weights).store(to + 16 * (kOwn + 1));
    if constexpr (S::modes > 2) own.s_e().store(to + 16 * (kOwn + 2));
    Turned::make(c, to + 16 * kCoefficients);
  }

  /// A particle by its number among the staged ones.
  HWY_INLINE void add(const Rows& rows, std::uint32_t at, const float*, const float*) {
    const AtNodes<3, P> first = across(rows.row(kFirst, at), rows.row(kS, at)), second = across(rows.row(kSecond, at), rows.row(kS, at) + 8);
    const float* const c = rows.row(kCoefficients, at);
    P own[S::modes], along_first[3][3];
#pragma GCC unroll 3
    for (int m = 0; m < S::modes; ++m) own[m] = P::load(rows.row(kOwn + m, at));
    spread<3, S::count>(own, first, along_first, [&](auto m, auto a, auto b) SIM_LANES_INLINED {
      const P three = P::same_lines(c + Turned::place(m, a, b));
      if constexpr (m + a + b > 0) return three.without_last();
      else return three.template with<0b1000>(P::all(1.0f));   // a mass of its own
    }, [](auto, P (&)[3]) SIM_LANES_INLINED {});
    momentum_.add(along_first, second);
    const Pairs pairs = Pairs::load(rows.row(kPairs, at));
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) {
      const Pairs mass = Pairs::same_pairs(rows.row(kFirst, at) + 4 * i) * pairs;
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j) mass_.add(i, j, Pairs::same_pairs(rows.row(kSecond, at) + 4 * j), mass);
    }
  }
  /// To the tile of a cell, by its coordinates in the block.
  HWY_INLINE void add_to(Tile& tile, const int (&cell)[3]) const {
    float *const x = tile.first(0, cell), *const y = tile.first(1, cell), *const z = tile.first(2, cell);
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i)
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j) {
        const P momentum = momentum_.at(i, j);
        const P xy = momentum.with_between(mass_.at(i, j));   // line after line momentum and mass of x, of y
        xy.first_pairs().add_to(x + Tile::step(i, j)), xy.second_pairs().add_to(y + Tile::step(i, j));
        momentum.second_pairs().add_to(z + Tile::step(i, j));
      }
  }

 private:
  HWY_INLINE static AtNodes<3, P> across(const float* row, const float* s) {
    AtNodes<3, P> r;
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) r.weight[i] = P::same_lines(row + 4 * i);
    if constexpr (S::modes > 1) r.x = P::same_lines(row + 12);
    if constexpr (S::modes > 2) r.s = P::same_lines(s);
    return r;
  }

  Sums<3, S::count, P> momentum_;
  Sums<3, 1, Pairs> mass_;
};

// --- linear kernel ------------------------------------------------------------------------------------------------------

/// Of a particle in a row of its own: weights, and w times the weights, as a lattice's own axis sees them and as others do.
template <class S>
struct LinearRows {
  static constexpr int kRows = 2 * S::modes;
  using Rows = StagedRows<kRows>;

  HWY_INLINE static void make(const float* offset, float* HWY_RESTRICT to) {
    const Plane<4> t = Plane<4>::whole_lines(offset);
    make_of<Axis::shared_corner>(t, to), make_of<Axis::wide_middle>(t, to + 16 * S::modes);
  }
  template <int l, int axis>
  HWY_INLINE static const float* row(const Rows& rows, int mode, std::uint32_t at) {
    return rows.row((l == axis ? 0 : S::modes) + mode, at) + 4 * axis;
  }

 private:
  template <Axis axis>
  HWY_INLINE static void make_of(Plane<4> t, float* HWY_RESTRICT to) {
    const AlongAxes<2, axis, LinesOf::axes> along(t);
    const Plane<4> weights = along.weights();
    weights.store(to);
    if constexpr (S::modes > 1) along.weighted_offsets(weights).store(to + 16);
  }
};

/// What particles of one cell bring to the faces of lattice l: its own axis has two places, which are lines of half a vector; along another axis are
/// its three numbers, and there are three such vectors across. A particle's momentum at face (i, j, k) is sum_a X_a(i) sum_bm c_abm Y_b(j) Z_m(k), x
/// being the axis across, y the own one: products of Y and Z are vectors, coefficients and X are numbers.
template <class S, int l>
class SumsOnLattice {
  static constexpr int across = l == 0 ? 1 : 0, along = 3 - across - l, kWide = 3;
  using P = Plane<2>;
  using Own = LinearRows<S>;

 public:
  HWY_INLINE SumsOnLattice() {
#pragma GCC unroll 3
    for (int i = 0; i < kWide; ++i) mass_[i] = momentum_[i] = P::zero();
  }
  HWY_INLINE void add(const typename Own::Rows& rows, std::uint32_t at, const float* c) {
    P product[S::modes][S::modes];   // of y and z
#pragma GCC unroll 2
    for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 2
      for (int m = 0; m < S::modes; ++m)
        if (keeps<S::count>(0, b, m))
          product[b][m] = P::whole_lines(Own::template row<l, l>(rows, b, at)) * P::same_lines(Own::template row<l, along>(rows, m, at));
    const float* const x = Own::template row<l, across>(rows, 0, at);
#pragma GCC unroll 2
    for (int a = 0; a < S::modes; ++a) {
      P sum = P::all(c[number(a, 0, 0)]) * product[0][0];
#pragma GCC unroll 2
      for (int b = 0; b < S::modes; ++b)
#pragma GCC unroll 2
        for (int m = 0; m < S::modes; ++m)
          if (b + m > 0 && keeps<S::count>(a, b, m)) sum = fused(P::all(c[number(a, b, m)]), product[b][m], sum);
      add_across(x + 16 * a, sum, momentum_);
    }
    add_across(x, product[0][0], mass_);
  }
  HWY_INLINE void add_to(float* HWY_RESTRICT tile, std::ptrdiff_t place) const {
    constexpr int kStride[3] = {S::tile * S::tile, S::tile, 1};
#pragma GCC unroll 3
    for (int i = 0; i < kWide; ++i) {
      float* const first = tile + place + S::first_place(l) + i * kStride[across];
      const auto add = [&](const P& sum, int field) SIM_LANES_INLINED {
        float* const to = first + field * S::places;
        if constexpr (along == 2) add_line(to, sum.template line<0>()), add_line(to + kStride[l], sum.template line<1>());
        else sum.template add_pairs_to<kWide>(to, kStride[along]);
      };
      add(mass_[i], l), add(momentum_[i], 3 + l);
    }
  }

 private:
  /// The number of a product's coefficient in a row.
  static constexpr int number(int a, int b, int m) {
    int mode[3]{};
    mode[across] = a, mode[l] = b, mode[along] = m;
    return 3 * kNumber<S::count>.of[mode[0]][mode[1]][mode[2]] + l;
  }
  HWY_INLINE static void add_across(const float* x, P plane, P (&sum)[kWide]) {
#pragma GCC unroll 3
    for (int i = 0; i < kWide; ++i) sum[i] = fused(P::all(x[i]), plane, sum[i]);
  }

  P mass_[kWide], momentum_[kWide];
};

/// The same of all three lattices, in one pass.
template <class S>
class SumsOnLinearFaces : SumsOnLattice<S, 0>, SumsOnLattice<S, 1>, SumsOnLattice<S, 2> {
 public:
  using Tile = PlainTile<S>;
  using Rows = typename LinearRows<S>::Rows;
  static constexpr std::uint32_t kReadAhead = 0;

  HWY_INLINE SumsOnLinearFaces() : SumsOnLattice<S, 0>(), SumsOnLattice<S, 1>(), SumsOnLattice<S, 2>() {}
  HWY_INLINE static void make_rows(const float* offset, const float*, float, float* HWY_RESTRICT to) { LinearRows<S>::make(offset, to); }
  HWY_INLINE void add(const Rows& rows, std::uint32_t at, const float* c, const float*) {
    SumsOnLattice<S, 0>::add(rows, at, c), SumsOnLattice<S, 1>::add(rows, at, c), SumsOnLattice<S, 2>::add(rows, at, c);
  }
  HWY_INLINE void add_to(Tile& tile, const int (&cell)[3]) const {
    const std::ptrdiff_t place = Tile::place(cell);
    SumsOnLattice<S, 0>::add_to(tile.numbers, place), SumsOnLattice<S, 1>::add_to(tile.numbers, place);
    SumsOnLattice<S, 2>::add_to(tile.numbers, place);
  }
};

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
