#pragma once
// Letters, axes and a colour bar on a picture, pixel by pixel.
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "render/attribute/attribute.h"
#include "render/render.h"

namespace render::raster {

/// A picture of display-referred colours that is drawn on; what lies outside it is dropped.
struct Canvas {
  Image& image;
  int scale;  // of letters and of the bar

  void set(std::int64_t x, std::int64_t y, const base::Vec3f& color) const;
  void fill(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height, const base::Vec3f& color) const;
  /// (x, y) is the upper left corner of the first letter.
  void write(std::int64_t x, std::int64_t y, std::string_view text) const;
  /// Straight, both ends included.
  void line(std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1, const base::Vec3f& color) const;
  std::int64_t width_of(std::string_view text) const;
};

/// Texts on a picture that keep clear of each other: what would touch an earlier one, or not be whole, is left out.
class Labels {
 public:
  explicit Labels(const Canvas& canvas) : canvas_(canvas) {}
  /// As Canvas::write. Whether there was room.
  bool write(std::int64_t x, std::int64_t y, std::string_view text);
  /// A line of parts with two blanks between them, of which the last ones are left out where the picture is too narrow.
  void write_parts(std::int64_t x, std::int64_t y, std::string_view text);
  /// No text is to stand here any more.
  void keep_clear(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height) { taken_.push_back({x, y, x + width, y + height}); }

 private:
  struct Place {
    std::int64_t left, top, right, bottom;
  };
  const Canvas& canvas_;
  std::vector<Place> taken_;
};

/// A step of 1, 2 or 5 times a power of ten that cuts `range` into about `parts`.
double tick_step(double range, double parts);
/// A tick's value in as few digits as it takes.
std::string tick_label(double value, double step);

/// [pixels] From where draw_color_bar begins to the right edge, with letters of a size (Canvas::scale).
std::int64_t color_bar_width(const attribute::Scale&, int letters);
/// At the right edge, half as high as the picture, with the unit above it.
void draw_color_bar(const Canvas&, const attribute::Scale&, Labels&);

/// Means of factor x factor samples (RGBA, 8 bits), display-referred.
Image shrink(const std::vector<std::uint8_t>& samples, std::int64_t width, std::int64_t height, int factor);

}  // namespace render::raster
