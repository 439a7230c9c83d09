#pragma once
// Light from all around as a lat-long picture: up is its upper edge, its middle is towards +y, and to the right of that is +x.
#include <filesystem>
#include <optional>
#include <vector>

#include "base/vec.h"
#include "render/sampling/sampler.h"

namespace render::trace {

using base::Vec3f;
struct LightSample;
struct LightHit;

/// Bilinear between the pixels. A direction is drawn with a pixel's brightness, averaged with its neighbours', and evenly within it, so that
/// all that shines can be drawn [PBRT4 12.5].
class Environment {
 public:
  /// Rows top-down.
  Environment(int width, int height, std::vector<Vec3f> pixels, double rotation_degrees);
  Vec3f radiance(const Vec3f& direction) const;
  float density(const Vec3f& direction) const;  // [1/sr]
  LightSample sample(const Vec3f& from, sampling::Point) const;
  std::optional<LightHit> find(const Vec3f& from, const Vec3f& direction) const;

 private:
  struct Place {
    float u, v;  // [1] across and down, in [0, 1)
  };
  Place place(const Vec3f& direction) const;
  const Vec3f& pixel(int x, int y) const;
  float pixel_share(int x, int y) const;
  int width_, height_;
  float rotation_;               // [1] of a turn
  std::vector<Vec3f> pixels_;
  std::vector<float> rows_;      // cumulated shares of the rows, from 0 to 1
  std::vector<float> columns_;   // of the pixels of each row
};

/// Throws base::Error (exit 2) for a picture that cannot be read, has no colours, or values that are negative or not finite.
Environment read_environment(const std::filesystem::path&, const Vec3f& tint, double rotation_degrees);

}  // namespace render::trace
