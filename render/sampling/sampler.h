#pragma once
// Points of the unit square for pixel (x, y), sample i and dimension d of a frame: Sobol's first two dimensions, counted along a
// Z-order curve over the image [Ahmed20], the order shuffled and the points scrambled as by Owen, by hashes [Burley20]. The samples
// of a pixel are a (0,2)-net when their number is a power of two, neighbouring pixels complete each other, and every dimension and
// frame is scrambled anew. A pure function: any tile order and any number of threads give the same points.
#include <cstdint>

namespace render::sampling {

struct Point {
  float x, y;  // within [0, 1)
};

/// A bijection of 64 bits without visible structure [Stafford11, variant 13].
std::uint64_t mix(std::uint64_t);

/// What all pixels of a frame share.
struct Sequence {
  Sequence(std::int64_t spp, std::int64_t frame);
  int sample_bits;     // log2 of the samples a pixel, rounded up
  std::uint64_t seed;  // of the frame
};

/// The points of one pixel.
class PixelSampler {
 public:
  PixelSampler(const Sequence& sequence, std::uint32_t x, std::uint32_t y);
  Point point(std::uint32_t sample, std::uint32_t dimension) const;

 private:
  std::uint64_t first_;  // number of the pixel's first sample
  std::uint64_t seed_;
};

}  // namespace render::sampling
