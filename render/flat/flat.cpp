#include "render/flat/flat.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "render/raster/canvas.h"
#include "render/raster/closing.h"
#include "render/raster/rasterizer.h"
#include "render/view/plane.h"

namespace render::flat {
namespace {

using base::Vec3f;
using Vec2 = Eigen::Vector2d;

const Vec3f kPage(0.105f, 0.114f, 0.130f), kAir(0.85f, 0.86f, 0.875f);  // outside and inside of the domain
const Vec3f kFrame(0.46f, 0.49f, 0.54f), kSolid(0.62f, 0.60f, 0.57f);     // outline of the domain, colliders
constexpr double kClosing = 1.6;  // of a particle's spacing: cells that lose their particles for a moment are liquid to the pressure, too

/// Where the domain stands in the picture, and what fits beside it.
struct Layout {
  int scale;      // of letters
  bool axes;      // ticks, colour bar and caption as well
  Vec2 margin;    // [pixels]
};

Layout layout_of(const Options& options) {
  const double width = static_cast<double>(options.width), height = static_cast<double>(options.height);
  const int scale = static_cast<int>(std::max<std::int64_t>(1, options.height / 500));
  const Vec2 margin = scale * Vec2(80, 48);
  if (4 * margin.x() <= width && 4 * margin.y() <= height) return {scale, true, margin};
  return {scale, false, Vec2::Constant(std::max(1.0, std::round(0.03 * std::min(width, height))))};
}

bool inside(const sim::Shape& shape, const Vec2& p) { return shape.distance(base::Vec3(p.x(), p.y(), 0)) < 0; }

/// The picture before its margins are written on: `factor` samples across a pixel, RGBA.
class Samples {
 public:
  Samples(const Setting& setting, const view::Plane& plane, int factor)
      : setting_(setting), plane_(plane), factor_(factor), width_(setting.options.width * factor), height_(setting.options.height * factor) {}

  std::vector<std::uint8_t> draw(const sim::Frame& frame, const attribute::Scale& scale) const {
    const std::vector<float> values = attribute::values(setting_, frame);
    const double spacing = frame.pscale * std::sqrt(std::numbers::pi) * plane_.scale * factor_;  // [samples]
    const double radius = std::max(1.0, frame.pscale * plane_.scale * factor_);
    const auto gap = static_cast<std::int64_t>(std::ceil(kClosing * spacing));
    raster::FlatDrawing drawing{.width = static_cast<int>(width_), .height = static_cast<int>(height_),
                                .radius = static_cast<float>(radius + static_cast<double>(gap)), .discs = {}};
    drawing.discs.reserve(frame.position.size());
    for (std::size_t i = 0; i < frame.position.size(); ++i) {
      const Vec2 at = factor_ * plane_.pixel(frame.position[i].head<2>().cast<double>());
      drawing.discs.push_back({Vec3f(static_cast<float>(at.x()), static_cast<float>(at.y()), 0), scale.color(values[i])});
    }
    std::vector<std::uint8_t> rgba = raster::rasterize(drawing);
    paint_ground(gap, rgba);
    return rgba;
  }

 private:
  enum class Ground : std::uint8_t { page, solid, open };

  Ground ground(std::int64_t x, std::int64_t y) const {
    const Vec2 p = plane_.place(Vec2(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5) / factor_);
    if (!plane_.holds(p)) return Ground::page;
    for (const sim::Collider& collider : setting_.colliders)
      if (inside(collider.shape, p)) return Ground::solid;
    for (const ColliderImage& image : setting_.images)
      if (inside(image.shape, p)) return Ground::solid;
    return Ground::open;
  }

  /// Discs grown by `gap` have merged; taking as much away again leaves the gaps closed, also those to walls and colliders.
  void paint_ground(std::int64_t gap, std::vector<std::uint8_t>& rgba) const {
    std::vector<Ground> grounds(rgba.size() / 4);
    std::vector<std::uint8_t> liquid(rgba.size() / 4);
    constexpr std::size_t kChunk = 65536;
    base::parallel_chunks(liquid.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        grounds[i] = ground(static_cast<std::int64_t>(i) % width_, static_cast<std::int64_t>(i) / width_);
        liquid[i] = rgba[4 * i + 3] != 0 || grounds[i] != Ground::open;
      }
    });
    raster::erode(liquid, width_, gap);
    base::parallel_chunks(liquid.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        rgba[4 * i + 3] = 255;
        if (grounds[i] == Ground::open && liquid[i]) continue;
        const Vec3f& color = grounds[i] == Ground::page ? kPage : grounds[i] == Ground::solid ? kSolid : kAir;
        for (std::size_t c = 0; c < 3; ++c) rgba[4 * i + c] = static_cast<std::uint8_t>(255 * color[static_cast<int>(c)] + 0.5f);
      }
    });
  }

  const Setting& setting_;
  const view::Plane& plane_;
  int factor_;
  std::int64_t width_, height_;
};

/// The domain's outline, just outside it.
void draw_frame(const raster::Canvas& canvas, const view::Plane& plane) {
  const Vec2 a = plane.pixel(plane.lower), b = plane.pixel(plane.upper);
  const std::int64_t s = canvas.scale, left = std::lround(a.x()), right = std::lround(b.x()), top = std::lround(b.y()), bottom = std::lround(a.y());
  canvas.fill(left - s, top - s, right - left + 2 * s, s, kFrame);
  canvas.fill(left - s, bottom, right - left + 2 * s, s, kFrame);
  canvas.fill(left - s, top, s, bottom - top, kFrame);
  canvas.fill(right, top, s, bottom - top, kFrame);
}

/// Ticks every so many metres, about 90 pixels apart; the last label of an axis says the unit.
void draw_ticks(const raster::Canvas& canvas, const view::Plane& plane, int axis, raster::Labels& labels) {
  const std::int64_t s = canvas.scale;
  const double length = plane.upper[axis] - plane.lower[axis],
               step = raster::tick_step(length, std::max(1.0, plane.scale * length / (90.0 * canvas.scale)));
  const auto last = static_cast<std::int64_t>(std::floor(plane.upper[axis] / step + 1e-6));
  for (auto i = static_cast<std::int64_t>(std::ceil(plane.lower[axis] / step - 1e-6)); i <= last; ++i) {
    Vec2 place = plane.lower;
    place[axis] = static_cast<double>(i) * step;
    const Vec2 at = plane.pixel(place);
    const std::int64_t x = std::lround(at.x()), y = std::lround(at.y());
    const std::string label = raster::tick_label(static_cast<double>(i) * step, step) + (i == last ? " m" : "");
    if (axis == 0) {
      canvas.fill(x, y, s, 6 * s, kFrame);
      labels.write(x - canvas.width_of(label) / 2, y + 8 * s, label);
    } else {
      canvas.fill(x - 6 * s, y, 6 * s, s, kFrame);
      labels.write(x - 10 * s - canvas.width_of(label), y - 6 * s, label);
    }
  }
}

}  // namespace

Image draw(const Setting& setting, const sim::Frame& frame, const std::string& caption, double top_speed) {
  const Options& options = setting.options;
  Layout layout = layout_of(options);
  const attribute::Scale scale = attribute::scale_of(setting, top_speed);
  if (layout.axes) {
    const auto beside = static_cast<double>(raster::color_bar_width(scale, layout.scale) + 12 * layout.scale);
    layout.margin.x() = std::min(std::max(layout.margin.x(), beside), 0.3 * static_cast<double>(options.width));
  }
  const view::Plane plane = view::fit(setting.domain, options.width, options.height, layout.margin);
  const int factor = std::max(options.width, options.height) <= 4096 ? 2 : 1;  // samples across a pixel
  Image image = raster::shrink(Samples(setting, plane, factor).draw(frame, scale), options.width, options.height, factor);
  const raster::Canvas canvas{image, layout.scale};
  draw_frame(canvas, plane);
  if (!layout.axes) return image;
  raster::Labels labels(canvas);
  labels.write_parts(12 * canvas.scale, image.height - 20 * canvas.scale, caption);
  raster::draw_color_bar(canvas, scale, labels);
  draw_ticks(canvas, plane, 0, labels);
  draw_ticks(canvas, plane, 1, labels);
  return image;
}

bool has_caption(const Options& options) { return layout_of(options).axes; }

}  // namespace render::flat
