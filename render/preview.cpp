// Particles coloured by speed, the room around them, a colour bar and a line of text. Two-dimensional shots go to flat/.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/flat/flat.h"
#include "render/raster/canvas.h"
#include "render/raster/colors.h"
#include "render/raster/rasterizer.h"
#include "render/render.h"

namespace render {
namespace {

using base::Vec3;
using base::Vec3f;

const Vec3f kTop(0.165f, 0.180f, 0.205f), kBottom(0.085f, 0.092f, 0.105f);  // background
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

}  // namespace

Image preview(const Setting& setting, const sim::Frame& frame, const std::string& caption, double top_speed) {
  if (setting.dimension == 2) return flat::draw(setting, frame, caption, top_speed);
  const Options& options = setting.options;
  const int factor = std::max(options.width, options.height) <= 4096 ? 2 : 1;  // samples across a pixel
  const double top = top_speed > 0 ? top_speed : 1;
  raster::Drawing drawing{.width = static_cast<int>(options.width) * factor, .height = static_cast<int>(options.height) * factor,
                           .view = view::resolve(setting.camera, setting.domain, options.width, options.height, static_cast<double>(frame.number)),
                           .radius = static_cast<float>(frame.pscale), .top = kTop, .bottom = kBottom, .discs = {}, .lines = outlines(setting)};
  drawing.discs.reserve(frame.position.size());
  for (std::size_t i = 0; i < frame.position.size(); ++i)
    drawing.discs.push_back({frame.position[i], raster::viridis(frame.velocity[i].norm() / static_cast<float>(top))});
  Image image = raster::shrink(raster::rasterize(drawing), options.width, options.height, factor);
  const raster::Canvas canvas{image, static_cast<int>(std::max<std::int64_t>(1, options.height / 500))};
  raster::draw_color_bar(canvas, top);
  canvas.write(12 * canvas.scale, image.height - 24 * canvas.scale, caption);
  return image;
}

}  // namespace render
