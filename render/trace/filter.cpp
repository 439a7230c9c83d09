#include "render/trace/filter.h"

#include <cmath>
#include <numbers>

namespace render::trace {
namespace {

constexpr double kRadius = 1.5;  // [pixels]

/// Integral from 0 to s of the window over [0, 1] [Harris78], 1 at s = 1.
double cumulated(double s) {
  const double pi = std::numbers::pi;
  constexpr double a0 = 0.35875, a1 = 0.48829, a2 = 0.14128, a3 = 0.01168;
  return s - a1 / a0 * std::sin(2 * pi * s) / (2 * pi) + a2 / a0 * std::sin(4 * pi * s) / (4 * pi) - a3 / a0 * std::sin(6 * pi * s) / (6 * pi);
}

}  // namespace

PixelFilter::PixelFilter() {
  for (int i = 0; i <= kCells; ++i) {
    double low = 0, high = 1;
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (low + high);
      (cumulated(middle) < static_cast<double>(i) / kCells ? low : high) = middle;
    }
    inverse_[static_cast<std::size_t>(i)] = static_cast<float>((0.5 * (low + high) * 2 - 1) * kRadius);
  }
}

float PixelFilter::offset(float u) const {
  const float at = u * kCells;
  const auto cell = static_cast<std::size_t>(at);
  return inverse_[cell] + (at - static_cast<float>(cell)) * (inverse_[cell + 1] - inverse_[cell]);
}

}  // namespace render::trace
