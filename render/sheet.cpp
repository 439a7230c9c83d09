// Several pictures on one sheet.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "render/raster/canvas.h"
#include "render/raster/font.h"
#include "render/render.h"

namespace render {
namespace {

const base::Vec3f kPaper(0.105f, 0.114f, 0.130f);

/// Columns of the sheet that is nearest to 16 : 9; places left empty count against it.
std::int64_t columns_for(std::size_t count, double width, double height) {
  std::int64_t best = 1;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::int64_t columns = 1; columns <= static_cast<std::int64_t>(count); ++columns) {
    const double rows = std::ceil(static_cast<double>(count) / static_cast<double>(columns)),
                 empty = 1 - static_cast<double>(count) / (rows * static_cast<double>(columns)),
                 off = std::abs(std::log(static_cast<double>(columns) * width / (rows * height) * 9 / 16)) + 0.5 * empty;
    if (off >= nearest) continue;
    nearest = off;
    best = columns;
  }
  return best;
}

/// Cut, with two dots, to what fits.
std::string fitted(std::string label, std::int64_t letters) {
  if (static_cast<std::int64_t>(label.size()) <= letters) return label;
  return label.substr(0, static_cast<std::size_t>(std::max<std::int64_t>(0, letters - 2))) + "..";
}

}  // namespace

Image sheet(const std::vector<Image>& pictures, const std::vector<std::string>& labels) {
  const Image& first = pictures.front();
  const int scale = static_cast<int>(std::max<std::int64_t>(1, first.height / 400));
  const std::int64_t gap = 4 * scale, strip = (raster::kGlyphHeight + 8) * scale, width = first.width + gap, height = first.height + strip + gap;
  const std::int64_t columns = columns_for(pictures.size(), static_cast<double>(width), static_cast<double>(height)),
                     rows = (static_cast<std::int64_t>(pictures.size()) + columns - 1) / columns;
  Image image{.width = columns * width + gap, .height = rows * height + gap, .channels = {"R", "G", "B", "A"}, .pixels = {}};
  image.pixels.assign(static_cast<std::size_t>(image.width * image.height) * 4, 1);
  const raster::Canvas canvas{image, scale};
  canvas.fill(0, 0, image.width, image.height, kPaper);
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Image& picture = pictures[i];
    if (picture.width != first.width || picture.height != first.height)
      throw base::Error({.message = labels[i] + ": " + std::to_string(picture.width) + "x" + std::to_string(picture.height) + " pixels, but " +
                                    labels[0] + " has " + std::to_string(first.width) + "x" + std::to_string(first.height)});
    const std::int64_t left = gap + static_cast<std::int64_t>(i) % columns * width, top = gap + static_cast<std::int64_t>(i) / columns * height;
    const std::size_t channels = picture.channels.size();
    for (std::int64_t y = 0; y < picture.height; ++y)
      for (std::int64_t x = 0; x < picture.width; ++x) {
        const float* p = &picture.pixels[static_cast<std::size_t>(y * picture.width + x) * channels];
        canvas.set(left + x, top + y, {p[0], p[1], p[2]});
      }
    canvas.write(left + 4 * scale, top + picture.height + 4 * scale, fitted(labels[i], (first.width - 8 * scale) / (raster::kGlyphWidth * scale)));
  }
  return image;
}

}  // namespace render
