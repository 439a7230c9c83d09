#pragma once
// Letters on a bare machine: a fixed bitmap font, seven by thirteen pixels, printable ASCII.
#include <array>
#include <cstdint>

namespace render::raster {

constexpr int kGlyphWidth = 7, kGlyphHeight = 13;

/// Rows from the top; bit 6 is the leftmost pixel. What is not printable ASCII looks like '?'.
const std::array<std::uint8_t, kGlyphHeight>& glyph(char);

}  // namespace render::raster
