#pragma once
// What a ray flies through where dielectrics overlap: the one of highest priority is there, the others are not [Schmidt02].
#include <bit>
#include <cstdint>

#include "render/trace/material.h"

namespace render::trace {

/// The dielectrics a point is inside of, as a set of ranks from 0: rank k is bit k, and the highest is the one that is there.
struct Media {
  static constexpr int kMost = 64;
  std::uint64_t inside = 0;
  Media with(int rank) const { return {inside | (std::uint64_t{1} << rank)}; }
  Media without(int rank) const { return {inside & ~(std::uint64_t{1} << rank)}; }
  int top() const { return std::bit_width(inside) - 1; }  // -1: none, air
};

/// Media on the two sides of a surface that a ray crosses. The side that was hit says what the ray was in, whatever it met before.
struct Boundary {
  Media before, after;
  bool real() const { return before.top() != after.top(); }  // false where a higher priority hides it
};
inline Boundary boundary(Media around, int rank, bool entering) {
  return {entering ? around.without(rank) : around.with(rank), entering ? around.with(rank) : around.without(rank)};
}

}  // namespace render::trace
