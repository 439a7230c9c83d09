// Vectors of two or four lines of four numbers: nodes, or cells, of a plane across x, z running fastest; or nodes of a row, four numbers each.
#if defined(SIM_TRANSFER_PLANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_PLANES_INL_H
#undef SIM_TRANSFER_PLANES_INL_H
#else
#define SIM_TRANSFER_PLANES_INL_H
#endif

#include <hwy/highway.h>

#include <type_traits>

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// A line.
using Line = hn::FixedTag<float, 4>;
constexpr Line kLine{};

/// Adds four numbers.
HWY_INLINE void add_line(float* HWY_RESTRICT to, hn::Vec<Line> v) { hn::StoreU(hn::Add(hn::LoadU(kLine, to), v), kLine, to); }

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
  HWY_INLINE friend Vectors operator+(Vectors a, Vectors b) { return each([&](int p) { return hn::Add(a.part[p], b.part[p]); }); }
  HWY_INLINE friend Vectors operator-(Vectors a, Vectors b) { return each([&](int p) { return hn::Sub(a.part[p], b.part[p]); }); }
  HWY_INLINE friend Vectors operator*(Vectors a, Vectors b) { return each([&](int p) { return hn::Mul(a.part[p], b.part[p]); }); }
  /// a b + c, rounded once.
  HWY_INLINE friend Vectors fused(Vectors a, Vectors b, Vectors c) {
    return each([&](int p) { return hn::MulAdd(a.part[p], b.part[p], c.part[p]); });
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
  /// The first number of every line 0.
  HWY_INLINE Vectors without_first() const {
    return each([&](int p) { return hn::IfThenElseZero(of_line<0b1110>(), part[p]); });
  }
  HWY_INLINE void store(float* to) const {
#pragma GCC unroll 2
    for (int p = 0; p < parts; ++p) hn::StoreU(part[p], Tag{}, to + p * kLanes);
  }
  /// Adds all lines to numbers in memory.
  HWY_INLINE void add_to(float* HWY_RESTRICT to) const { (load(to) + *this).store(to); }
  /// Adds the first `lines`, `step` numbers from one to the next.
  template <int lines>
  HWY_INLINE void add_to(float* HWY_RESTRICT to, int step) const {
    static_assert(lines >= 2 && lines <= kLines);
    add_line(to, line<0>()), add_line(to + step, line<1>());
    if constexpr (lines > 2) add_line(to + 2 * step, line<2>());
    if constexpr (lines > 3) add_line(to + 3 * step, line<3>());
  }
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

 private:
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
