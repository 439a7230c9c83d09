#define HWY_TARGET_INCLUDE "sim/transfer/lanes_near.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/scatter_rows-inl.h"

// Interpolation at places that no batch shares. All three components at once: a line of a vector is what a lattice has along its own axis, and the two
// other axes come in the same turn for all three, y and z for the faces of x, z and x for those of y, x and y for those of z. A cell's nine vectors
// are put together once for all who ask there.
HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
namespace {

template <int n>
struct Near {
  using P = Plane<4>;
  static constexpr int kEdge = NearFaces::kEdge + n, kPlane = kEdge * kEdge, kComponent = kEdge * kPlane;
  static constexpr Axis kOwn = n == 3 ? Axis::wide_corner : Axis::shared_corner, kAcross = n == 3 ? Axis::shared_middle : Axis::wide_middle;

  static void turn(NearFaces& near) {
    for (int i = 0; i < kEdge; ++i)
      for (int jk = 0; jk < kPlane; ++jk) {
        near.along[0][jk * kEdge + i] = near.velocity[i * kPlane + jk];
        near.along[1][i * kPlane + jk] = near.velocity[kComponent + jk * kEdge + i];
      }
    near.turned = true;
  }
  static void copy(NearFaces& near, std::uint32_t number) {
    constexpr std::uint32_t edge = NearFaces::kEdge;
    const int cell[3] = {int(number / (edge * edge)), int(number / edge % edge), int(number % edge)};
    const auto line = [&](const float* values, int own, int first, int second) {   // from the stencil's first node on
      return hn::LoadU(kLine, values + (first * kEdge + second) * kEdge + own + (n == 3 ? 0 : 1));
    };
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        float* const to = near.cell[number][3 * a + b];
        hn::Store(line(near.along[0], cell[0], cell[1] + a, cell[2] + b), kLine, to);
        hn::Store(line(near.along[1], cell[1], cell[2] + a, cell[0] + b), kLine, to + 4);
        hn::Store(line(near.velocity + 2 * kComponent, cell[2], cell[0] + a, cell[1] + b), kLine, to + 8);
        hn::Store(hn::Zero(kLine), kLine, to + 12);
      }
    near.copied[number] = true;
  }
  static void interpolate(NearFaces& near, const Places& places, float (*velocity)[kPlaces]) {
    if (!near.turned) turn(near);
    for (std::size_t p = 0; p < places.count; p += 4) {
      hn::Vec<Line> offset[4] = {hn::LoadU(kLine, places.offset[0] + p), hn::LoadU(kLine, places.offset[1] + p), hn::LoadU(kLine, places.offset[2] + p),
                                 hn::Zero(kLine)};
      transpose_lines(offset);
      P products[4];
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) {
        const std::uint32_t number = places.cell[p + std::size_t(k)];
        if (!near.copied[number]) copy(near, number);
        products[k] = along_own(near.cell[number], offset[k]);
      }
      const P sums = P::sums_of_lines(products);
      hn::StoreU(sums.template line<0>(), kLine, velocity[0] + p);
      hn::StoreU(sums.template line<1>(), kLine, velocity[1] + p);
      hn::StoreU(sums.template line<2>(), kLine, velocity[2] + p);
    }
  }
  /// What each lattice has at the places along its own axis, times the weights.
  HWY_INLINE static P along_own(const float (*values)[16], hn::Vec<Line> offset) {
    const AlongAxes<n, kOwn, LinesOf::axes> own(P::template whole_lines_of<0>(offset));
    const Across across(offset);
    const auto plane = [&](int a) SIM_LANES_INLINED {
      const P two = fused(across.second(1), P::load(values[3 * a + 1]), across.second(0) * P::load(values[3 * a]));
      return fused(across.second(2), P::load(values[3 * a + 2]), two);
    };
    const P two = fused(across.first(1), plane(1), across.first(0) * plane(0));
    return own.weights() * fused(across.first(2), plane(2), two);
  }
  HWY_INLINE static void transpose_lines(hn::Vec<Line> (&line)[4]) {
    const hn::Repartition<double, Line> pairs;
    const auto lower = [&](int k) SIM_LANES_INLINED { return hn::BitCast(pairs, hn::InterleaveLower(kLine, line[k], line[k + 1])); };
    const auto upper = [&](int k) SIM_LANES_INLINED { return hn::BitCast(pairs, hn::InterleaveUpper(kLine, line[k], line[k + 1])); };
    const auto l0 = lower(0), l2 = lower(2), u0 = upper(0), u2 = upper(2);
    line[0] = hn::BitCast(kLine, hn::InterleaveLower(pairs, l0, l2)), line[1] = hn::BitCast(kLine, hn::InterleaveUpper(pairs, l0, l2));
    line[2] = hn::BitCast(kLine, hn::InterleaveLower(pairs, u0, u2)), line[3] = hn::BitCast(kLine, hn::InterleaveUpper(pairs, u0, u2));
  }
  /// The weights of the two axes across each lattice's own.
  struct Across {
#if HWY_TARGET <= HWY_AVX3
    P weights;
    HWY_INLINE explicit Across(hn::Vec<Line> offset) : weights(AlongAxes<n, kAcross, LinesOf::axes>(P::template whole_lines_of<0>(offset)).weights()) {}
    HWY_INLINE P first(int node) const { return weights.template from_lines<1>(node); }
    HWY_INLINE P second(int node) const { return weights.template from_lines<2>(node); }
#else
    P of_first, of_second;
    HWY_INLINE explicit Across(hn::Vec<Line> offset)
        : of_first(AlongAxes<n, kAcross, LinesOf::axes>(P::template whole_lines_of<1>(offset)).weights()),
          of_second(AlongAxes<n, kAcross, LinesOf::axes>(P::template whole_lines_of<2>(offset)).weights()) {}
    HWY_INLINE static P pick(P weights, int node) {
      return node == 0 ? weights.template same_of_lines<0>() : node == 1 ? weights.template same_of_lines<1>() : weights.template same_of_lines<2>();
    }
    HWY_INLINE P first(int node) const { return pick(of_first, node); }
    HWY_INLINE P second(int node) const { return pick(of_second, node); }
#endif
  };
};

}  // namespace

Interpolate find_linear() { return Near<2>::interpolate; }
Interpolate find_quadratic() { return Near<3>::interpolate; }

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_linear);
HWY_EXPORT(find_quadratic);
Interpolate interpolate_linear() { return HWY_DYNAMIC_DISPATCH(find_linear)(); }
Interpolate interpolate_quadratic() { return HWY_DYNAMIC_DISPATCH(find_quadratic)(); }
}  // namespace sim::lanes
#endif
