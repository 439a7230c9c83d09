#include "render/raster/canvas.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "render/raster/font.h"

namespace render::raster {
namespace {

const base::Vec3f kInk(0.90f, 0.91f, 0.93f);

}  // namespace

void Canvas::set(std::int64_t x, std::int64_t y, const base::Vec3f& color) const {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  float* p = &image.pixels[static_cast<std::size_t>(y * image.width + x) * 4];
  for (int c = 0; c < 3; ++c) p[c] = color[c];
}

void Canvas::fill(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height, const base::Vec3f& color) const {
  for (std::int64_t j = 0; j < height; ++j)
    for (std::int64_t i = 0; i < width; ++i) set(x + i, y + j, color);
}

void Canvas::write(std::int64_t x, std::int64_t y, std::string_view text) const {
  for (const char c : text) {
    const auto& rows = glyph(c);
    for (int j = 0; j < kGlyphHeight * scale; ++j)
      for (int i = 0; i < kGlyphWidth * scale; ++i)
        if (rows[static_cast<std::size_t>(j / scale)] >> (kGlyphWidth - 1 - i / scale) & 1) set(x + i, y + j, kInk);
    x += kGlyphWidth * scale;
  }
}

std::int64_t Canvas::width_of(std::string_view text) const { return static_cast<std::int64_t>(text.size()) * kGlyphWidth * scale; }

void Canvas::line(std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1, const base::Vec3f& color) const {
  const std::int64_t steps = std::max({std::abs(x1 - x0), std::abs(y1 - y0), std::int64_t{1}});
  for (std::int64_t i = 0; i <= steps; ++i)
    set(x0 + std::lround(static_cast<double>(i * (x1 - x0)) / static_cast<double>(steps)),
        y0 + std::lround(static_cast<double>(i * (y1 - y0)) / static_cast<double>(steps)), color);
}

bool Labels::write(std::int64_t x, std::int64_t y, std::string_view text) {
  const std::int64_t s = canvas_.scale;
  const Place place{x, y, x + canvas_.width_of(text), y + kGlyphHeight * s};
  if (place.left < 0 || place.top < 0 || place.right > canvas_.image.width || place.bottom > canvas_.image.height) return false;
  const auto touches = [&](const Place& other) {
    return place.left < other.right + s && other.left < place.right + s && place.top < other.bottom && other.top < place.bottom;
  };
  if (std::any_of(taken_.begin(), taken_.end(), touches)) return false;
  taken_.push_back(place);
  canvas_.write(x, y, text);
  return true;
}

void Labels::write_parts(std::int64_t x, std::int64_t y, std::string_view text) {
  while (!text.empty() && !write(x, y, text)) {
    const std::size_t end = text.rfind("  ");
    text = text.substr(0, end == std::string_view::npos ? 0 : text.find_last_not_of(' ', end) + 1);
  }
}

double tick_step(double range, double parts) {
  const double raw = range / parts, power = std::pow(10.0, std::floor(std::log10(raw))), digit = raw / power;
  return (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10) * power;
}

std::string tick_label(double value, double step) {
  const double digits = value != 0 ? std::floor(std::log10(std::abs(value)) + 1e-9) - std::floor(std::log10(step) + 1e-9) + 1 : 1;
  char number[40];
  std::snprintf(number, sizeof number, "%.*g", static_cast<int>(std::clamp(digits, 6.0, 17.0)), value == 0 ? 0.0 : value);   // nor -0
  return number;
}

std::int64_t color_bar_width(const attribute::Scale& scale, int letters) {
  std::int64_t width = 32;
  for (const std::string& name : scale.names) width = std::max(width, static_cast<std::int64_t>(name.size()) * kGlyphWidth);
  return (width + 32) * letters;
}

namespace {

/// A patch of each kind's colour before its name.
void draw_legend(const Canvas& canvas, const attribute::Scale& scale, Labels& labels) {
  const std::int64_t s = canvas.scale, step = 18 * s;
  const std::int64_t left = canvas.image.width - color_bar_width(scale, canvas.scale);
  std::int64_t y = (canvas.image.height - step * static_cast<std::int64_t>(scale.names.size())) / 2;
  for (std::size_t i = 0; i < scale.names.size(); ++i, y += step) {
    canvas.fill(left, y, 12 * s, 12 * s, scale.color(static_cast<float>(i)));
    labels.keep_clear(left, y, 12 * s, 12 * s);
    labels.write(left + 18 * s, y, scale.names[i]);
  }
}

}  // namespace

void draw_color_bar(const Canvas& canvas, const attribute::Scale& scale, Labels& labels) {
  if (!scale.names.empty()) return draw_legend(canvas, scale, labels);
  const Image& image = canvas.image;
  const std::int64_t s = canvas.scale, width = 12 * s, height = std::max<std::int64_t>(8 * s, image.height / 2);
  const std::int64_t left = image.width - color_bar_width(scale, canvas.scale), top = (image.height - height) / 2;
  const double low = scale.is_signed ? -scale.top : 0, range = scale.top - low;
  for (std::int64_t y = 0; y < height; ++y)
    canvas.fill(left, top + y, width, 1,
                scale.color(static_cast<float>(scale.top - range * (static_cast<double>(y) + 0.5) / static_cast<double>(height))));
  labels.keep_clear(left, top, width + 6 * s, height);
  const double room = static_cast<double>(height) / static_cast<double>((kGlyphHeight + 4) * s);   // for labels, one over the other
  double step = tick_step(range, std::min(5.0, room));
  if (range / step > room) step = tick_step(step, 0.5);
  for (auto i = static_cast<int>(std::ceil(low / step - 1e-9)); i * step <= scale.top * (1 + 1e-9); ++i) {
    const auto y = top + std::lround(static_cast<double>(height) * (scale.top - i * step) / range);
    canvas.fill(left + width, std::min(y, top + height - 1), 4 * s, 1, kInk);
    labels.write(left + width + 7 * s, y - 6 * s, tick_label(i * step, step));
  }
  labels.write(left, top - 22 * s, scale.unit);
}

Image shrink(const std::vector<std::uint8_t>& samples, std::int64_t width, std::int64_t height, int factor) {
  Image image{
      .width = width, .height = height, .channels = {"R", "G", "B", "A"}, .pixels = std::vector<float>(static_cast<std::size_t>(width * height) * 4)};
  for (std::int64_t y = 0; y < height * factor; ++y)
    for (std::int64_t x = 0; x < width * factor; ++x)
      for (std::int64_t c = 0; c < 4; ++c)
        image.pixels[static_cast<std::size_t>((y / factor * width + x / factor) * 4 + c)] +=
            static_cast<float>(samples[static_cast<std::size_t>((y * width * factor + x) * 4 + c)]) / static_cast<float>(255 * factor * factor);
  return image;
}

}  // namespace render::raster
