#pragma once
// How coefficients change on the way to the next step. A particle keeps its coefficients c_r while the basis is evaluated anew at its
// new offset, so the energy 1/2 m c_r^2 D_r(x) of a mode with a g factor changes with x alone. The limiter never lets it grow.
#include <algorithm>
#include <cmath>

#include "sim/transfer/modes.h"

namespace sim {

/// d(x): root of the norm of g at offset x from the middle node. Products of the norms themselves would underflow in float.
template <class Real>
Real root_norm_of_g(Real x) {
  return std::max(Real(0), (1 - 2 * x) * (1 + 2 * x)) * std::sqrt(3 - 4 * x * x) / 4;
}

/// The factor for a mode whose root norm was `before` and is `now`: 1 where nothing moved, and where the mode has no energy now.
template <class Real>
Real limited_factor(Real before, Real now) {
  return now <= 0 ? Real(1) : std::min(Real(1), before / now);
}

/// [cells] A particle that is pushed so far is no longer about where its polynomial was fitted, and loses the modes that bend.
inline constexpr double kFarPush = 0.25;

/// The axes on which a mode has a g factor, a bit each: modes with the same axes share a factor.
template <int D>
unsigned bent_axes(const ModeIndex<D>& mode) {
  unsigned axes = 0;
  for (int a = 0; a < D; ++a) axes |= unsigned(mode[a] == 2) << a;
  return axes;
}

}  // namespace sim
