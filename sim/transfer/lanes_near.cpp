#define HWY_TARGET_INCLUDE "sim/transfer/lanes_near.cpp"
#include <hwy/foreach_target.h>   // includes this file once for every instruction set

#include "sim/transfer/scatter_rows-inl.h"

// Interpolation at places that no batch shares, on faces with the quadratic kernel. All three components at once: a line of a vector is what a lattice
// has along its own axis, and the two other axes come in the same turn for all three, y and z for the faces of x, z and x for those of y, x and y for
// those of z.
HWY_BEFORE_NAMESPACE();
namespace sim::lanes::HWY_NAMESPACE {
namespace {

using P = Plane<4>;
constexpr Axis kOwn = Axis::wide_corner, kAcross = Axis::shared_middle;
constexpr int kPlane = NearFaces::kEdge * NearFaces::kEdge, kComponent = NearFaces::kEdge * kPlane;

void turn(NearFaces& near) {
  constexpr int edge = NearFaces::kEdge;
  for (int i = 0; i < edge; ++i)
    for (int jk = 0; jk < kPlane; ++jk) {
      near.along[0][jk * edge + i] = near.velocity[i * kPlane + jk];
      near.along[1][i * kPlane + jk] = near.velocity[kComponent + jk * edge + i];
    }
  near.turned = true;
}

/// Puts together what places of a cell read.
void prepare(NearFaces& near, std::uint32_t number) {
  constexpr std::uint32_t cells = NearFaces::kCells;
  const int cell[3] = {int(number / (cells * cells)), int(number / cells % cells), int(number % cells)};   // its stencils' first nodes, too
  const auto line = [&](const float* values, int own, int first, int second) {
    return hn::LoadU(kLine, values + (first * NearFaces::kEdge + second) * NearFaces::kEdge + own);
  };
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      float* const to = near.read[number][3 * a + b];
      hn::Store(line(near.along[0], cell[0], cell[1] + a, cell[2] + b), kLine, to);
      hn::Store(line(near.along[1], cell[1], cell[2] + a, cell[0] + b), kLine, to + 4);
      hn::Store(line(near.velocity + 2 * kComponent, cell[2], cell[0] + a, cell[1] + b), kLine, to + 8);
      hn::Store(hn::Zero(kLine), kLine, to + 12);
    }
  near.known[number] = true;
}

/// The weights of the axes across each lattice's own, the first and the second one in its turn: a node's in all of a line.
struct Across {
#if HWY_TARGET <= HWY_AVX3
  P weights;
  HWY_INLINE explicit Across(hn::Vec<Line> offset) : weights(AlongAxes<3, kAcross, LinesOf::axes>(P::whole_lines_of<0>(offset)).weights()) {}
  HWY_INLINE P first(int node) const { return weights.from_lines<1>(node); }
  HWY_INLINE P second(int node) const { return weights.from_lines<2>(node); }
#else   // lines would have to go from one vector to the other
  P of_first, of_second;
  HWY_INLINE explicit Across(hn::Vec<Line> offset)
      : of_first(AlongAxes<3, kAcross, LinesOf::axes>(P::whole_lines_of<1>(offset)).weights()),
        of_second(AlongAxes<3, kAcross, LinesOf::axes>(P::whole_lines_of<2>(offset)).weights()) {}
  HWY_INLINE static P of(P weights, int node) {
    return node == 0 ? weights.same_of_lines<0>() : node == 1 ? weights.same_of_lines<1>() : weights.same_of_lines<2>();
  }
  HWY_INLINE P first(int node) const { return of(of_first, node); }
  HWY_INLINE P second(int node) const { return of(of_second, node); }
#endif
};

/// What each lattice has at the nodes along its own axis, times their weights.
HWY_INLINE P along_own(const float (*read)[16], hn::Vec<Line> offset) {
  const AlongAxes<3, kOwn, LinesOf::axes> own(P::whole_lines_of<0>(offset));
  const Across across(offset);
  const auto sum = [](P w0, P v0, P w1, P v1, P w2, P v2) SIM_LANES_INLINED { return fused(w2, v2, fused(w1, v1, w0 * v0)); };
  const auto row = [&](int a) SIM_LANES_INLINED {
    return sum(across.second(0), P::load(read[3 * a]), across.second(1), P::load(read[3 * a + 1]), across.second(2), P::load(read[3 * a + 2]));
  };
  return own.weights() * sum(across.first(0), row(0), across.first(1), row(1), across.first(2), row(2));
}

void interpolate(NearFaces& near, const Places& places, float (*velocity)[kMostPlaces]) {
  if (!near.turned) turn(near);
  for (std::size_t p = 0; p < places.count; p += 4) {
    hn::Vec<Line> offset[4] = {hn::LoadU(kLine, places.offset[0] + p), hn::LoadU(kLine, places.offset[1] + p), hn::LoadU(kLine, places.offset[2] + p),
                               hn::Zero(kLine)};
    transpose_lines(offset);
    P products[4];
#pragma GCC unroll 4
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t cell = places.cell[p + std::size_t(k)];
      if (!near.known[cell]) prepare(near, cell);
      products[k] = along_own(near.read[cell], offset[k]);
    }
    const P sums = P::sums_of_lines(products);
    hn::StoreU(sums.line<0>(), kLine, velocity[0] + p);
    hn::StoreU(sums.line<1>(), kLine, velocity[1] + p);
    hn::StoreU(sums.line<2>(), kLine, velocity[2] + p);
  }
}

}  // namespace

Interpolate find_interpolation() { return interpolate; }

}  // namespace sim::lanes::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim::lanes {
HWY_EXPORT(find_interpolation);
Interpolate interpolation() { return HWY_DYNAMIC_DISPATCH(find_interpolation)(); }
}  // namespace sim::lanes
#endif
