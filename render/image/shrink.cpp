// A picture made smaller.
#include <algorithm>
#include <array>
#include <cmath>

#include "render/image/tone.h"
#include "render/render.h"

namespace render {
namespace {

/// Light of the 256 codes of a display.
const std::array<float, 256>& light_of_codes() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> t{};
    for (std::size_t i = 0; i < t.size(); ++i) t[i] = image::srgb_light(static_cast<float>(i) / 255);
    return t;
  }();
  return table;
}

struct Share {
  std::int64_t first = 0;
  std::vector<float> weight;   // of the pixels from `first` on; sum 1
};

/// What each of `to` pixels covers of `from`.
std::vector<Share> shares(std::int64_t from, std::int64_t to) {
  std::vector<Share> all;
  const double step = static_cast<double>(from) / static_cast<double>(to);
  for (std::int64_t i = 0; i < to; ++i) {
    const double begin = static_cast<double>(i) * step, end = std::min(static_cast<double>(from), begin + step);
    Share share{.first = static_cast<std::int64_t>(begin), .weight = {}};
    for (std::int64_t p = share.first; p < from && static_cast<double>(p) < end - 1e-9; ++p)
      share.weight.push_back(static_cast<float>((std::min(end, static_cast<double>(p + 1)) - std::max(begin,
          static_cast<double>(p))) / (end - begin)));
    all.push_back(std::move(share));
  }
  return all;
}

}  // namespace

Image shrunk(const Image& image, std::int64_t width) {
  const std::int64_t w = std::min(width, image.width);
  const std::int64_t h = std::max<std::int64_t>(1,
      std::llround(static_cast<double>(image.height) * static_cast<double>(w) / static_cast<double>(image.width)));
  const std::vector<Share> across = shares(image.width, w), down = shares(image.height, h);
  const std::array<float, 256>& light = light_of_codes();
  const std::size_t channels = image.channels.size(), row = static_cast<std::size_t>(w) * 3;
  std::vector<float> narrow(static_cast<std::size_t>(image.height) * row, 0);
  for (std::int64_t y = 0; y < image.height; ++y)
    for (std::int64_t x = 0; x < w; ++x) {
      const Share& share = across[static_cast<std::size_t>(x)];
      float* out = &narrow[static_cast<std::size_t>(y) * row + static_cast<std::size_t>(x) * 3];
      for (std::size_t k = 0; k < share.weight.size(); ++k) {
        const float* in = &image.pixels[(static_cast<std::size_t>(y * image.width + share.first) + k) * channels];
        for (std::size_t c = 0; c < 3; ++c) out[c] += share.weight[k] * light[static_cast<std::size_t>(std::clamp(255 * in[c] + 0.5f, 0.0f, 255.0f))];
      }
    }
  Image result{.width = w, .height = h, .channels = {"R", "G", "B"}, .pixels = std::vector<float>(static_cast<std::size_t>(h) * row, 0)};
  for (std::int64_t y = 0; y < h; ++y) {
    const Share& share = down[static_cast<std::size_t>(y)];
    float* out = &result.pixels[static_cast<std::size_t>(y) * row];
    for (std::size_t k = 0; k < share.weight.size(); ++k) {
      const float* in = &narrow[(static_cast<std::size_t>(share.first) + k) * row];
      for (std::size_t i = 0; i < row; ++i) out[i] += share.weight[k] * in[i];
    }
    for (std::size_t i = 0; i < row; ++i) out[i] = image::srgb_code(out[i]);
  }
  return result;
}

}  // namespace render
