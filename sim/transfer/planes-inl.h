// Vectors of 4 x 4 or 2 x 2 numbers: the nodes, or cells, of a plane across x. z runs fastest.
#if defined(SIM_TRANSFER_PLANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SIM_TRANSFER_PLANES_INL_H
#undef SIM_TRANSFER_PLANES_INL_H
#else
#define SIM_TRANSFER_PLANES_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Four nodes of a line, or both lines of a plane of 2 x 2.
using Line = hn::FixedTag<float, 4>;
constexpr Line kLine{};

/// A plane of `edge` lines of `edge` nodes: one vector where the processor has it, else two.
template <int edge>
struct Plane;

template <>
struct Plane<2> {
  hn::Vec<Line> v;

  HWY_INLINE static Plane zero() { return {hn::Zero(kLine)}; }
  HWY_INLINE static Plane all(float x) { return {hn::Set(kLine, x)}; }
  /// Of four numbers each, as they come: a row that is to be the same in all lines is stored twice, one of numbers for whole lines spread.
  HWY_INLINE static Plane same_lines(const float* row) { return {hn::Load(kLine, row)}; }
  HWY_INLINE static Plane whole_lines(const float* row) { return {hn::Load(kLine, row)}; }
  HWY_INLINE friend Plane operator*(Plane a, Plane b) { return {hn::Mul(a.v, b.v)}; }
  /// a b + c, rounded once.
  HWY_INLINE friend Plane fused(Plane a, Plane b, Plane c) { return {hn::MulAdd(a.v, b.v, c.v)}; }
  /// Adds the first `lines` lines to nodes in memory, `step` numbers from one to the next.
  template <int lines>
  HWY_INLINE void add_to(float* HWY_RESTRICT nodes, int step) const {
    constexpr hn::FixedTag<float, 2> pair{};
    hn::StoreU(hn::Add(hn::LoadU(pair, nodes), hn::LowerHalf(pair, v)), pair, nodes);
    hn::StoreU(hn::Add(hn::LoadU(pair, nodes + step), hn::UpperHalf(pair, v)), pair, nodes + step);
  }
};

/// Adds four numbers.
HWY_INLINE void add_line(float* HWY_RESTRICT nodes, hn::Vec<Line> v) { hn::StoreU(hn::Add(hn::LoadU(kLine, nodes), v), kLine, nodes); }

#if HWY_TARGET <= HWY_AVX3   // the better a set of instructions, the smaller its number
template <>
struct Plane<4> {
  using Tag = hn::FixedTag<float, 16>;
  hn::Vec<Tag> v;

  HWY_INLINE static Plane zero() { return {hn::Zero(Tag{})}; }
  HWY_INLINE static Plane load(const float* from) { return {hn::LoadU(Tag{}, from)}; }
  HWY_INLINE void store(float* to) const { hn::StoreU(v, Tag{}, to); }
  HWY_INLINE static Plane all(float x) { return {hn::Set(Tag{}, x)}; }
  HWY_INLINE static Plane same_lines(const float* row) { return {hn::LoadDup128(Tag{}, row)}; }
  HWY_INLINE static Plane whole_lines(const float* row) {
    alignas(64) static constexpr std::int32_t kFrom[16] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};
    return {hn::TableLookupLanes(hn::LoadDup128(Tag{}, row), hn::SetTableIndices(Tag{}, kFrom))};
  }
  HWY_INLINE friend Plane operator+(Plane a, Plane b) { return {hn::Add(a.v, b.v)}; }
  HWY_INLINE friend Plane operator-(Plane a, Plane b) { return {hn::Sub(a.v, b.v)}; }
  HWY_INLINE friend Plane operator*(Plane a, Plane b) { return {hn::Mul(a.v, b.v)}; }
  HWY_INLINE friend Plane fused(Plane a, Plane b, Plane c) { return {hn::MulAdd(a.v, b.v, c.v)}; }
  template <int lines>
  HWY_INLINE void add_to(float* HWY_RESTRICT nodes, int step) const {
    constexpr hn::FixedTag<float, 8> half{};
    const auto lower = hn::LowerHalf(half, v), upper = hn::UpperHalf(half, v);
    add_line(nodes, hn::LowerHalf(kLine, lower)), add_line(nodes + step, hn::UpperHalf(kLine, lower));
    if constexpr (lines > 2) add_line(nodes + 2 * step, hn::LowerHalf(kLine, upper));
    if constexpr (lines == 4) add_line(nodes + 3 * step, hn::UpperHalf(kLine, upper));
  }
};
#else
template <>
struct Plane<4> {
  using Tag = hn::FixedTag<float, 8>;
  hn::Vec<Tag> lower, upper;

  HWY_INLINE static Plane zero() { return {hn::Zero(Tag{}), hn::Zero(Tag{})}; }
  HWY_INLINE static Plane load(const float* from) { return {hn::LoadU(Tag{}, from), hn::LoadU(Tag{}, from + 8)}; }
  HWY_INLINE void store(float* to) const { hn::StoreU(lower, Tag{}, to), hn::StoreU(upper, Tag{}, to + 8); }
  HWY_INLINE static Plane all(float x) { return {hn::Set(Tag{}, x), hn::Set(Tag{}, x)}; }
  HWY_INLINE static Plane same_lines(const float* row) {
    const auto both = hn::LoadDup128(Tag{}, row);
    return {both, both};
  }
  HWY_INLINE static Plane whole_lines(const float* row) {
    alignas(32) static constexpr std::int32_t kFrom[2][8] = {{0, 0, 0, 0, 1, 1, 1, 1}, {2, 2, 2, 2, 3, 3, 3, 3}};
    const auto both = hn::LoadDup128(Tag{}, row);
    return {hn::TableLookupLanes(both, hn::SetTableIndices(Tag{}, kFrom[0])), hn::TableLookupLanes(both, hn::SetTableIndices(Tag{}, kFrom[1]))};
  }
  HWY_INLINE friend Plane operator+(Plane a, Plane b) { return {hn::Add(a.lower, b.lower), hn::Add(a.upper, b.upper)}; }
  HWY_INLINE friend Plane operator-(Plane a, Plane b) { return {hn::Sub(a.lower, b.lower), hn::Sub(a.upper, b.upper)}; }
  HWY_INLINE friend Plane operator*(Plane a, Plane b) { return {hn::Mul(a.lower, b.lower), hn::Mul(a.upper, b.upper)}; }
  HWY_INLINE friend Plane fused(Plane a, Plane b, Plane c) { return {hn::MulAdd(a.lower, b.lower, c.lower), hn::MulAdd(a.upper, b.upper, c.upper)}; }
  template <int lines>
  HWY_INLINE void add_to(float* HWY_RESTRICT nodes, int step) const {
    add_line(nodes, hn::LowerHalf(kLine, lower)), add_line(nodes + step, hn::UpperHalf(kLine, lower));
    if constexpr (lines > 2) add_line(nodes + 2 * step, hn::LowerHalf(kLine, upper));
    if constexpr (lines == 4) add_line(nodes + 3 * step, hn::UpperHalf(kLine, upper));
  }
};
#endif

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
