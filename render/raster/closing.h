#pragma once
// Morphology on the samples of a picture.
#include <cstdint>
#include <vector>

namespace render::raster {

/// Clears the samples of `mask` (rows of `width`, 0 or 1) that lie within `radius` of one that is 0. What is beyond the edges of the
/// mask counts as 1. Time does not depend on the radius.
void erode(std::vector<std::uint8_t>& mask, std::int64_t width, std::int64_t radius);

}  // namespace render::raster
