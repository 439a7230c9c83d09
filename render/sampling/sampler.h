#pragma once
// Points of the unit square for pixel (x, y), sample i and dimension d of a frame: Sobol's first two dimensions, indexed along a
// Z-order curve over the image and Owen-scrambled [Ahmed20, Burley20]. The samples of a pixel are a (0,2)-net when their number is
// a power of two, neighbouring pixels complete each other, and every frame is scrambled anew. A pure function: no state is kept
// between pixels, so any tile order and any number of threads give the same points.
#include <array>
#include <cstdint>

namespace render::sampling {

struct Point {
  float x, y;  // within [0, 1)
};

/// What all pixels of a frame share.
struct Sequence {
  Sequence(std::int64_t width, std::int64_t height, std::int64_t spp, std::int64_t frame);
  int sample_bits;      // log2 of the samples a pixel, rounded up
  int digits;           // base-4 digits of an index that counts all samples of the image
  std::uint32_t seed;   // of the frame
};

/// The points of one pixel. The part of each dimension that all samples share is computed once.
class PixelSampler {
 public:
  PixelSampler(const Sequence& sequence, std::uint32_t x, std::uint32_t y);
  Point point(std::uint32_t sample, std::uint32_t dimension);

 private:
  struct Prefix {
    std::uint64_t salt;
    std::uint32_t sobol0, sobol1;      // bit-reversed partial sums over the pixel's digits
    std::uint32_t scramble0, scramble1;
  };
  Prefix prefix(std::uint32_t dimension) const;

  static constexpr std::uint32_t kCached = 24;
  const Sequence& sequence_;
  std::uint64_t pixel_;                // Z-order number
  std::uint32_t cached_ = 0;           // bit d: prefixes_[d] is there
  std::array<Prefix, kCached> prefixes_;
};

}  // namespace render::sampling
