// Vectors of two or four lines of four numbers: cells of a plane across x, z running fastest; nodes of a row, or faces, four numbers each.
#if defined(SIM_TRANSFER_PLANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_PLANES_INL_H
#undef SIM_TRANSFER_PLANES_INL_H
#else
#define SIM_TRANSFER_PLANES_INL_H
#endif

#include <hwy/highway.h>

#include <cstring>
#include <type_traits>

#include "sim/transfer/lanes-inl.h"   // SIM_LANES_INLINED

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// A line.
using Line = hn::FixedTag<float, 4>;
constexpr Line kLine{};

/// Adds four numbers.
HWY_INLINE void add_line(float* HWY_RESTRICT to, hn::Vec<Line> v) { hn::StoreU(hn::Add(hn::LoadU(kLine, to), v), kLine, to); }

/// Number k of line l becomes number l of line k.
HWY_INLINE void transpose_lines(hn::Vec<Line> (&line)[4]) {
  const hn::Repartition<double, Line> pairs;
  const auto lower = [&](int k) SIM_LANES_INLINED { return hn::BitCast(pairs, hn::InterleaveLower(kLine, line[k], line[k + 1])); };
  const auto upper = [&](int k) SIM_LANES_INLINED { return hn::BitCast(pairs, hn::InterleaveUpper(kLine, line[k], line[k + 1])); };
  const auto l0 = lower(0), l2 = lower(2), u0 = upper(0), u2 = upper(2);
  line[0] = hn::BitCast(kLine, hn::InterleaveLower(pairs, l0, l2)), line[1] = hn::BitCast(kLine, hn::InterleaveUpper(pairs, l0, l2));
  line[2] = hn::BitCast(kLine, hn::InterleaveLower(pairs, u0, u2)), line[3] = hn::BitCast(kLine, hn::InterleaveUpper(pairs, u0, u2));
}

/// Lines in vectors of Tag: one, or as many as `parts` says.
template <class Tag, int parts>
struct Vectors {
  static constexpr int kLanes = int(hn::MaxLanes(Tag{})), kLines = parts * kLanes / 4;
  hn::Vec<Tag> part[parts];

  template <class Make>
  HWY_INLINE static Vectors each(const Make& make) {
    Vectors r;
#pragma GCC unroll 2
    for (int p = 0; p < parts; ++p) r.part[p] = make(p);
    return r;
  }
  HWY_INLINE static Vectors zero() { return each([](int) { return hn::Zero(Tag{}); }); }
  HWY_INLINE static Vectors all(float x) { return each([=](int) { return hn::Set(Tag{}, x); }); }
  HWY_INLINE static Vectors load(const float* from) { return each([=](int p) { return hn::LoadU(Tag{}, from + p * kLanes); }); }
  /// Four numbers in every line.
  HWY_INLINE static Vectors same_lines(const float* line) { return each([=](int) { return hn::LoadDup128(Tag{}, line); }); }
  /// A number for every line, of four in memory.
  HWY_INLINE static Vectors whole_lines(const float* number) {
    alignas(64) static constexpr std::int32_t kFrom[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
    return each([=](int p) { return hn::TableLookupLanes(hn::LoadDup128(Tag{}, number), hn::SetTableIndices(Tag{}, kFrom + p * kLanes)); });
  }
  /// Two numbers in every half of a line.
  HWY_INLINE static Vectors same_pairs(const float* pair) {
    double both;
    std::memcpy(&both, pair, sizeof both);
    return each([=](int) { return hn::BitCast(Tag{}, hn::Set(Twos{}, both)); });
  }
  HWY_INLINE friend Vectors operator+(Vectors a, Vectors b) { return each([&](int p) { return hn::Add(a.part[p], b.part[p]); }); }
  HWY_INLINE friend Vectors operator-(Vectors a, Vectors b) { return each([&](int p) { return hn::Sub(a.part[p], b.part[p]); }); }
  HWY_INLINE friend Vectors operator*(Vectors a, Vectors b) { return each([&](int p) { return hn::Mul(a.part[p], b.part[p]); }); }
  /// a b + c, rounded once.
  HWY_INLINE friend Vectors fused(Vectors a, Vectors b, Vectors c) {
    return each([&](int p) { return hn::MulAdd(a.part[p], b.part[p], c.part[p]); });
  }
  /// c - a b, and a b - c, rounded once.
  HWY_INLINE friend Vectors less_product(Vectors c, Vectors a, Vectors b) {
    return each([&](int p) { return hn::NegMulAdd(a.part[p], b.part[p], c.part[p]); });
  }
  HWY_INLINE friend Vectors fused_less(Vectors a, Vectors b, Vectors c) {
    return each([&](int p) { return hn::MulSub(a.part[p], b.part[p], c.part[p]); });
  }
  /// The numbers of `upper` where those of t are 1/2 at least, else of `lower`.
  HWY_INLINE static Vectors chosen(Vectors t, Vectors upper, Vectors lower) {
    return each([&](int p) { return hn::IfThenElse(hn::Ge(t.part[p], hn::Set(Tag{}, 0.5f)), upper.part[p], lower.part[p]); });
  }
  /// Numbers 3, 0, 1, 2 of every line: three make place for one before them.
  HWY_INLINE Vectors moved_up() const { return each([&](int p) { return hn::Shuffle2103(part[p]); }); }
  /// The numbers of `other` where `numbers`, a bit for each of a line, says so.
  template <unsigned numbers>
  HWY_INLINE Vectors with(Vectors other) const {
    return each([&](int p) { return hn::IfThenElse(of_line<numbers>(), other.part[p], part[p]); });
  }
  /// The last number of every line 0; the first one.
  HWY_INLINE Vectors without_last() const {
    return each([&](int p) { return hn::IfThenElseZero(of_line<0b0111>(), part[p]); });
  }
  HWY_INLINE Vectors without_first() const {
    return each([&](int p) { return hn::IfThenElseZero(of_line<0b1110>(), part[p]); });
  }
  /// Of four lines, the last one's numbers 0, or those of `other`; the last two lines those of `other`.
  HWY_INLINE Vectors without_fourth_line() const {
    if constexpr (kLines < 4) return *this;
    return each([&](int p) { return p + 1 < parts ? part[p] : hn::IfThenElseZero(first_of_last(), part[p]); });
  }
  HWY_INLINE Vectors with_fourth_line(Vectors other) const {
    return each([&](int p) { return p + 1 < parts ? part[p] : hn::IfThenElse(first_of_last(), part[p], other.part[p]); });
  }
  HWY_INLINE Vectors with_upper_lines(Vectors other) const {
    if constexpr (parts == 2) return {{part[0], other.part[1]}};
    else return {{hn::ConcatUpperLower(Tag{}, other.part[0], part[0])}};
  }
  /// A number of a line for every line: those from `first` on, in the turn of three.
  template <int first>
  HWY_INLINE static Vectors whole_lines_of(hn::Vec<Line> line) {
    constexpr int n0 = first % 3, n1 = (first + 1) % 3, n2 = (first + 2) % 3;
    alignas(64) static constexpr std::int32_t kFrom[16] = {n0, n0, n0, n0, n1, n1, n1, n1, n2, n2, n2, n2, 3, 3, 3, 3};
    const auto wide = hn::ZeroExtendVector(hn::FixedTag<float, 8>{}, line);
    return each([&](int p) SIM_LANES_INLINED {
      if constexpr (parts == 2) return hn::TableLookupLanes(wide, hn::SetTableIndices(Tag{}, kFrom + p * kLanes));
      else return hn::TableLookupLanes(hn::ZeroExtendVector(Tag{}, wide), hn::SetTableIndices(Tag{}, kFrom));
    });
  }
  /// Of one vector of four lines: in all of a line, a number of the line that comes `step` later in the turn of the first three.
  template <int step>
  HWY_INLINE Vectors from_lines(int number) const {
    alignas(64) static constexpr auto kFrom = [] {
      std::array<std::array<std::int32_t, 16>, 4> from{};
      for (int k = 0; k < 4; ++k)
        for (int lane = 0; lane < 16; ++lane) from[std::size_t(k)][std::size_t(lane)] = lane < 12 ? 4 * ((lane / 4 + step) % 3) + k : lane;
      return from;
    }();
    return each([&](int p) SIM_LANES_INLINED { return hn::TableLookupLanes(part[p], hn::SetTableIndices(Tag{}, kFrom[std::size_t(number)].data())); });
  }
  /// One number of every line in all of it.
  template <int number>
  HWY_INLINE Vectors same_of_lines() const { return each([&](int p) { return hn::Broadcast<number>(part[p]); }); }
  /// Of four vectors, line by line, a number each: the sum of the line's, (0 + 2) + (1 + 3).
  HWY_INLINE static Vectors sums_of_lines(const Vectors (&of)[4]) {
    return each([&](int p) SIM_LANES_INLINED {
      const auto halves = [&](int k) SIM_LANES_INLINED {
        const auto a = of[k].part[p], b = of[k + 1].part[p];
        return hn::BitCast(Twos{}, hn::Add(hn::InterleaveLower(Tag{}, a, b), hn::InterleaveUpper(Tag{}, a, b)));
      };
      const auto first = halves(0), last = halves(2);
      return hn::Add(hn::BitCast(Tag{}, hn::InterleaveLower(Twos{}, first, last)), hn::BitCast(Tag{}, hn::InterleaveUpper(Twos{}, first, last)));
    });
  }
  /// Of every line numbers 0, 1, 2, 2; the next ones in the turn of three, 1, 2, 0, 0; those after them.
  HWY_INLINE Vectors third_twice() const { return shuffled<0, 1, 2, 2>(); }
  HWY_INLINE Vectors turned() const { return shuffled<1, 2, 0, 0>(); }
  HWY_INLINE Vectors turned_twice() const { return shuffled<2, 0, 1, 1>(); }
  /// Numbers 0 and 1, or 2 and 3, of each of four lines.
  HWY_INLINE Vectors<hn::FixedTag<float, 8>, 1> first_pairs() const { return pairs<0>(); }
  HWY_INLINE Vectors<hn::FixedTag<float, 8>, 1> second_pairs() const { return pairs<1>(); }
  /// Numbers 0 and 1 of each of four lines, and behind each a number of `others`.
  HWY_INLINE Vectors with_between(Vectors<hn::FixedTag<float, 8>, 1> others) const {
    const hn::FixedTag<double, 4> twos;
    const auto pairs = hn::BitCast(twos, others.part[0]);
    return each([&](int p) SIM_LANES_INLINED {
      alignas(64) static constexpr std::int64_t kFrom[8] = {0, 0, 1, 1, 2, 2, 3, 3};
      const auto all = [&] {
        if constexpr (parts == 1) return hn::ZeroExtendVector(Twos{}, pairs);
        else return pairs;
      }();
      const auto lines = hn::TableLookupLanes(all, hn::SetTableIndices(Twos{}, kFrom + p * kLanes / 2));
      return hn::InterleaveLower(Tag{}, part[p], hn::BitCast(Tag{}, lines));
    });
  }
  HWY_INLINE void store(float* to) const {
#pragma GCC unroll 2
    for (int p = 0; p < parts; ++p) hn::StoreU(part[p], Tag{}, to + p * kLanes);
  }
  /// Adds all lines to numbers in memory.
  HWY_INLINE void add_to(float* HWY_RESTRICT to) const { (load(to) + *this).store(to); }
  /// Adds the first `pairs` pairs of a number of the first line and one of the second, `step` numbers from one to the next.
  template <int pairs>
  HWY_INLINE void add_pairs_to(float* HWY_RESTRICT to, int step) const {
    static_assert(pairs >= 2 && pairs <= 4);
    constexpr hn::FixedTag<float, 2> pair{};
    const auto lower = hn::InterleaveLower(kLine, line<0>(), line<1>()), upper = hn::InterleaveUpper(kLine, line<0>(), line<1>());
    const auto add = [&](float* at, hn::Vec<decltype(pair)> v) { hn::StoreU(hn::Add(hn::LoadU(pair, at), v), pair, at); };
    add(to, hn::LowerHalf(pair, lower)), add(to + step, hn::UpperHalf(pair, lower));
    if constexpr (pairs > 2) add(to + 2 * step, hn::LowerHalf(pair, upper));
    if constexpr (pairs > 3) add(to + 3 * step, hn::UpperHalf(pair, upper));
  }
  /// A line by its number.
  template <int number>
  HWY_INLINE hn::Vec<Line> line() const {
    constexpr hn::FixedTag<float, 8> two{};
    const auto lines = [&] {
      if constexpr (kLanes == 8) return part[number / 2];
      else if constexpr (number < 2) return hn::LowerHalf(two, part[0]);
      else return hn::UpperHalf(two, part[0]);
    }();
    if constexpr (number % 2) return hn::UpperHalf(kLine, lines);
    else return hn::LowerHalf(kLine, lines);
  }

 private:
  using Twos = hn::Repartition<double, Tag>;

  template <int which>
  HWY_INLINE Vectors<hn::FixedTag<float, 8>, 1> pairs() const {
    const hn::FixedTag<float, 8> half;
    const auto of = [&](int lower, int upper) SIM_LANES_INLINED {
      const auto a = hn::BitCast(Twos{}, part[lower]), b = hn::BitCast(Twos{}, part[upper]);
      return hn::BitCast(Tag{}, which == 0 ? hn::ConcatEven(Twos{}, b, a) : hn::ConcatOdd(Twos{}, b, a));
    };
    if constexpr (parts == 2) return {{of(0, 1)}};
    else return {{hn::LowerHalf(half, of(0, 0))}};
  }
  template <int n0, int n1, int n2, int n3>
  HWY_INLINE Vectors shuffled() const {
    alignas(64) static constexpr std::int32_t kFrom[16] = {n0,     n1,     n2,     n3,     n0 + 4,  n1 + 4,  n2 + 4,  n3 + 4,
                                                           n0 + 8, n1 + 8, n2 + 8, n3 + 8, n0 + 12, n1 + 12, n2 + 12, n3 + 12};
    return each([&](int p) { return hn::TableLookupLanes(part[p], hn::SetTableIndices(Tag{}, kFrom)); });
  }
  /// All lines of the last vector but its last one.
  HWY_INLINE static hn::Mask<Tag> first_of_last() {
    static constexpr std::uint8_t kBits[8] = {kLanes == 8 ? 0x0f : 0xff, 0x0f};
    return hn::LoadMaskBits(Tag{}, kBits);
  }
  template <unsigned numbers>
  HWY_INLINE static hn::Mask<Tag> of_line() {
    static constexpr std::uint8_t kBits[8] = {numbers << 4 | numbers, numbers << 4 | numbers};
    return hn::LoadMaskBits(Tag{}, kBits);
  }
};

/// `lines` lines: one vector where the processor has it, else two.
template <int lines>
using Plane = std::conditional_t<lines == 2, Vectors<hn::FixedTag<float, 8>, 1>,
                                 std::conditional_t<HWY_TARGET <= HWY_AVX3,   // the better a set of instructions, the smaller its number
                                                    Vectors<hn::CappedTag<float, 16>, 1>, Vectors<hn::FixedTag<float, 8>, 2>>>;

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
