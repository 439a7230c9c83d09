#include "render/raster/closing.h"

#include <algorithm>
#include <cmath>

namespace render::raster {
namespace {

/// Distance from each sample to the nearest 0 in its column, at most `most`.
std::vector<std::int32_t> distance_in_column(const std::vector<std::uint8_t>& mask, std::int64_t width, std::int32_t most) {
  const auto row = static_cast<std::size_t>(width);
  std::vector<std::int32_t> distance(mask.size());
  for (std::size_t i = 0; i < mask.size(); ++i) distance[i] = mask[i] == 0 ? 0 : std::min(most, i < row ? most : distance[i - row] + 1);
  for (std::size_t i = mask.size(); i-- > row;) distance[i - row] = std::min(distance[i - row], distance[i] + 1);
  return distance;
}

}  // namespace

void erode(std::vector<std::uint8_t>& mask, std::int64_t width, std::int64_t radius) {
  const std::vector<std::int32_t> distance = distance_in_column(mask, width, static_cast<std::int32_t>(radius) + 1);
  std::vector<std::int64_t> reach;  // half the width of the disc's row at a height
  for (std::int64_t y = 0; y <= radius; ++y) reach.push_back(static_cast<std::int64_t>(std::sqrt(static_cast<double>(radius * radius - y * y))));
  std::vector<std::int32_t> change(static_cast<std::size_t>(width) + 1);  // of the number of discs that cover a sample of the row
  for (std::size_t start = 0; start < mask.size(); start += static_cast<std::size_t>(width)) {
    std::fill(change.begin(), change.end(), 0);
    for (std::int64_t x = 0; x < width; ++x) {
      const std::int32_t far = distance[start + static_cast<std::size_t>(x)];
      if (far > radius) continue;
      const std::int64_t half = reach[static_cast<std::size_t>(far)];
      ++change[static_cast<std::size_t>(std::max<std::int64_t>(0, x - half))];
      --change[static_cast<std::size_t>(std::min(width, x + half + 1))];
    }
    std::int32_t covers = 0;
    for (std::int64_t x = 0; x < width; ++x) {
      covers += change[static_cast<std::size_t>(x)];
      if (covers > 0) mask[start + static_cast<std::size_t>(x)] = 0;
    }
  }
}

}  // namespace render::raster
