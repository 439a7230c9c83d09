#pragma once
// Where in and around a pixel its samples fall: density proportional to a Blackman-Harris window, so all samples weigh the same and
// no sample belongs to two pixels.
#include <array>

namespace render::trace {

class PixelFilter {
 public:
  PixelFilter();
  /// Offset from the pixel's centre [pixels] for u in [0, 1).
  float offset(float u) const;

 private:
  static constexpr int kCells = 1024;
  std::array<float, kCells + 1> inverse_;  // offsets at equal steps of the cumulated window
};

}  // namespace render::trace
