// Particles coloured by speed, the room around them, a colour bar and a line of text.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string_view>

#include "render/raster/colors.h"
#include "render/raster/font.h"
#include "render/raster/rasterizer.h"
#include "render/render.h"

namespace render {
namespace {

using base::Vec3;
using base::Vec3f;

const Vec3f kTop(0.165f, 0.180f, 0.205f), kBottom(0.085f, 0.092f, 0.105f);  // background
const Vec3f kInk(0.90f, 0.91f, 0.93f);
const Vec3f kRoom(0.46f, 0.49f, 0.54f), kSolid(0.93f, 0.62f, 0.38f);  // outlines of the domain and of colliders

void outline_box(const base::Box& box, const Vec3f& color, std::vector<raster::Line>& lines) {
  const auto corner = [&](int i) {
    return Vec3f(Vec3((i & 1 ? box.upper : box.lower).x(), (i & 2 ? box.upper : box.lower).y(), (i & 4 ? box.upper : box.lower).z()).cast<float>());
  };
  for (int i = 0; i < 8; ++i)
    for (int bit = 1; bit < 8; bit *= 2)
      if (!(i & bit)) lines.push_back({corner(i), corner(i | bit), color});
}

void outline_sphere(const sim::Shape::Sphere& sphere, const Vec3f& color, std::vector<raster::Line>& lines) {
  constexpr int kSides = 48;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [&](int i) {
      const double angle = 2 * std::numbers::pi * i / kSides;
      Vec3 p = sphere.center;
      p[(axis + 1) % 3] += sphere.radius * std::cos(angle);
      p[(axis + 2) % 3] += sphere.radius * std::sin(angle);
      return Vec3f(p.cast<float>());
    };
    for (int i = 0; i < kSides; ++i) lines.push_back({at(i), at(i + 1), color});
  }
}

std::vector<raster::Line> outlines(const Setting& setting) {
  std::vector<raster::Line> lines;
  outline_box(setting.domain, kRoom, lines);
  for (const sim::Collider& c : setting.colliders) {
    if (c.shape.box) outline_box(*c.shape.box, kSolid, lines);
    if (c.shape.sphere) outline_sphere(*c.shape.sphere, kSolid, lines);
  }
  return lines;
}

/// A picture of display-referred colours that is drawn on, pixel by pixel.
struct Canvas {
  Image& image;
  int scale;  // of letters and of the bar

  void set(std::int64_t x, std::int64_t y, const Vec3f& color) const {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
    float* p = &image.pixels[static_cast<std::size_t>(y * image.width + x) * 4];
    for (int c = 0; c < 3; ++c) p[c] = color[c];
  }
  void write(std::int64_t x, std::int64_t y, std::string_view text) const {
    for (const char c : text) {
      const auto& rows = raster::glyph(c);
      for (int j = 0; j < raster::kGlyphHeight * scale; ++j)
        for (int i = 0; i < raster::kGlyphWidth * scale; ++i)
          if (rows[static_cast<std::size_t>(j / scale)] >> (raster::kGlyphWidth - 1 - i / scale) & 1) set(x + i, y + j, kInk);
      x += raster::kGlyphWidth * scale;
    }
  }
  std::int64_t width_of(std::string_view text) const { return static_cast<std::int64_t>(text.size()) * raster::kGlyphWidth * scale; }
};

/// A step of 1, 2 or 5 times a power of ten that cuts `range` into about `parts`.
double tick_step(double range, double parts) {
  const double raw = range / parts, power = std::pow(10.0, std::floor(std::log10(raw))), digit = raw / power;
  return (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10) * power;
}

void draw_color_bar(const Canvas& canvas, double top_speed) {
  const Image& image = canvas.image;
  const std::int64_t s = canvas.scale, width = 12 * s, height = std::max<std::int64_t>(8 * s, image.height / 2);
  const std::int64_t left = image.width - 64 * s, top = (image.height - height) / 2;
  for (std::int64_t y = 0; y < height; ++y)
    for (std::int64_t x = 0; x < width; ++x)
      canvas.set(left + x, top + y, raster::viridis(1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(height)));
  const double step = tick_step(top_speed, 5);
  for (int i = 0; i * step <= top_speed * (1 + 1e-9); ++i) {
    const auto y = top + std::lround(static_cast<double>(height) * (1 - i * step / top_speed));
    for (std::int64_t x = 0; x < 4 * s; ++x) canvas.set(left + width + x, std::min(y, top + height - 1), kInk);
    char number[32];
    std::snprintf(number, sizeof number, "%.4g", i * step);
    canvas.write(left + width + 7 * s, y - 6 * s, number);
  }
  canvas.write(left, top - 22 * s, "m/s");
}

/// Means of 2 x 2 (or 1 x 1) pixels, display-referred.
Image shrink(const std::vector<std::uint8_t>& pixels, std::int64_t width, std::int64_t height, int factor) {
  Image image{.width = width, .height = height, .channels = {"R", "G", "B", "A"}, .pixels = std::vector<float>(static_cast<std::size_t>(width * height) * 4)};
  for (std::int64_t y = 0; y < height * factor; ++y)
    for (std::int64_t x = 0; x < width * factor; ++x)
      for (std::int64_t c = 0; c < 4; ++c)
        image.pixels[static_cast<std::size_t>((y / factor * width + x / factor) * 4 + c)] +=
            static_cast<float>(pixels[static_cast<std::size_t>((y * width * factor + x) * 4 + c)]) / static_cast<float>(255 * factor * factor);
  return image;
}

}  // namespace

Image preview(const Setting& setting, const sim::Frame& frame, const std::string& caption, double top_speed) {
  const Options& options = setting.options;
  const int factor = std::max(options.width, options.height) <= 4096 ? 2 : 1;  // samples across a pixel
  const double top = top_speed > 0 ? top_speed : 1;
  raster::Drawing drawing{.width = static_cast<int>(options.width) * factor, .height = static_cast<int>(options.height) * factor,
                           .view = view::resolve(setting.camera, setting.domain, options.width, options.height),
                           .radius = static_cast<float>(frame.pscale), .top = kTop, .bottom = kBottom, .discs = {}, .lines = outlines(setting)};
  drawing.discs.reserve(frame.position.size());
  for (std::size_t i = 0; i < frame.position.size(); ++i)
    drawing.discs.push_back({frame.position[i], raster::viridis(frame.velocity[i].norm() / static_cast<float>(top))});
  Image image = shrink(raster::rasterize(drawing), options.width, options.height, factor);
  const Canvas canvas{image, static_cast<int>(std::max<std::int64_t>(1, options.height / 500))};
  draw_color_bar(canvas, top);
  canvas.write(12 * canvas.scale, image.height - 24 * canvas.scale, caption);
  return image;
}

}  // namespace render
