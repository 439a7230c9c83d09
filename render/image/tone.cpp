#include "render/image/tone.h"

#include <algorithm>
#include <cmath>

#include "render/render.h"

namespace render::image {
namespace {

constexpr float kGrey = 0.18f;      // scene-linear value that keeps its place
constexpr float kContrast = 1.5f;  // slope in log-log at the dark end
constexpr float kShare = 0.06f;     // of each colour that is mixed into the others before the curve, so that bright colours turn white

/// y = x^c / (x^c + k), a logistic curve over log x; k such that grey stays grey.
float response(float x) {
  static const float k = std::pow(kGrey, kContrast) * (1 / kGrey - 1);
  const float power = std::pow(std::max(x, 0.0f), kContrast);
  return std::isinf(power) ? 1 : power / (power + k);
}

}  // namespace

float srgb_code(float linear) {
  const float v = std::clamp(linear, 0.0f, 1.0f);
  return v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1 / 2.4f) - 0.055f;
}

float srgb_light(float code) { return code <= 0.04045f ? code / 12.92f : std::pow((code + 0.055f) / 1.055f, 2.4f); }

base::Vec3f filmic(const base::Vec3f& scene) {
  const float mean = scene.sum() / 3;
  base::Vec3f mixed;
  for (int c = 0; c < 3; ++c) mixed[c] = response(scene[c] + kShare * (mean - scene[c]));
  const float after = mixed.sum() / 3;
  base::Vec3f result;  // undo the mixing where the curve is still straight
  for (int c = 0; c < 3; ++c) result[c] = std::clamp(after + (mixed[c] - after) / (1 - kShare), 0.0f, 1.0f);
  return result;
}

}  // namespace render::image

namespace render {

Image scene_linear(const Image& display) {
  Image image = display;
  const std::size_t channels = image.channels.size();
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const std::string& channel = image.channels[i % channels];
    if (channel == "R" || channel == "G" || channel == "B") image.pixels[i] = image::srgb_light(image.pixels[i]);
  }
  return image;
}

}  // namespace render
