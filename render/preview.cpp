// Particles or their surface in colours of what they do, the room around them, a colour bar and a line of text. Two-dimensional shots go to flat/.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "render/flat/flat.h"
#include "render/raster/canvas.h"
#include "render/raster/rasterizer.h"
#include "render/render.h"

namespace render {
namespace {

using base::Vec3;
using base::Vec3f;

const Vec3f kTop(0.165f, 0.180f, 0.205f), kBottom(0.085f, 0.092f, 0.105f);  // background
const Vec3f kRoom(0.46f, 0.49f, 0.54f), kSolid(0.93f, 0.62f, 0.38f);  // outlines of the domain and of colliders

void outline_box(const sim::Shape& box, const Vec3f& color, std::vector<raster::Line>& lines) {
  const auto corners = box.corners();
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t bit = 1; bit < 8; bit *= 2)
      if (!(i & bit)) lines.push_back({corners[i].cast<float>(), corners[i | bit].cast<float>(), color});
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

/// Where planes across the axes, evenly spaced, cut it.
void outline_mesh(const sim::Shape& shape, const Vec3f& color, std::vector<raster::Line>& lines) {
  constexpr int kPlanes = 8;   // across the longest axis
  const base::Box bounds = shape.bounds();
  const double apart = bounds.size().maxCoeff() / kPlanes;
  for (std::size_t t = 0; t < shape.mesh->solid->triangles(); ++t) {
    std::array<Vec3, 3> corners = shape.mesh->solid->triangle(t);
    for (Vec3& corner : corners) corner = shape.mesh->place_of(corner);
    for (int axis = 0; axis < 3; ++axis) {
      std::sort(corners.begin(), corners.end(), [&](const Vec3& a, const Vec3& b) { return a[axis] < b[axis]; });
      const double first = std::floor((corners[0][axis] - bounds.lower[axis]) / apart + 0.5);
      for (double plane = bounds.lower[axis] + (first + 0.5) * apart; plane < corners[2][axis]; plane += apart) {
        const auto at = [&](const Vec3& a, const Vec3& b) { return Vec3f((a + (plane - a[axis]) / (b[axis] - a[axis]) * (b - a)).cast<float>()); };
        const Vec3f other = plane < corners[1][axis] ? at(corners[0], corners[1]) : at(corners[1], corners[2]);
        if (plane > corners[0][axis]) lines.push_back({at(corners[0], corners[2]), other, color});
      }
    }
  }
}

std::vector<raster::Line> outlines(const Setting& setting) {
  std::vector<raster::Line> lines;
  sim::Shape room;
  room.box = setting.domain;
  outline_box(room, kRoom, lines);
  const auto outline = [&](const sim::Shape& shape) {
    if (shape.box) outline_box(shape, kSolid, lines);
    if (shape.sphere) outline_sphere(*shape.sphere, kSolid, lines);
    if (shape.mesh) outline_mesh(shape, kSolid, lines);
  };
  for (const sim::Collider& c : setting.colliders) outline(c.shape);
  for (const ColliderImage& image : setting.images) outline(image.shape);
  return lines;
}

}  // namespace

namespace {

/// Where the axes stand: the domain's lower edges that face the camera, and the upright edge farthest to the left in the picture.
struct Axis {
  Vec3 from, outward;  // [m]; unit vector away from the domain
  int along;
};

std::array<Axis, 3> axes(const base::Box& box, const view::View& v) {
  const Vec3 middle = 0.5 * (box.lower + box.upper);
  const auto side = [&](int axis, bool high) { return high ? box.upper[axis] : box.lower[axis]; };
  const bool x_high = v.position.x() > middle.x(), y_high = v.position.y() > middle.y();
  std::array<Axis, 3> all{Axis{Vec3(box.lower.x(), side(1, y_high), box.lower.z()), (y_high ? 1 : -1) * Vec3::UnitY(), 0},
                          Axis{Vec3(side(0, x_high), box.lower.y(), box.lower.z()), (x_high ? 1 : -1) * Vec3::UnitX(), 1}, Axis{}};
  double leftmost = std::numeric_limits<double>::infinity();
  for (int corner = 0; corner < 4; ++corner) {
    const Vec3 p(side(0, corner & 1), side(1, corner & 2), box.lower.z());
    const double x = (p - v.position).dot(v.right) / std::max(1e-9, (p - v.position).dot(v.forward));
    if (x >= leftmost) continue;
    leftmost = x;
    all[2] = {p, -v.right, 2};
  }
  return all;
}

/// Ticks and their labels in metres, as many as there is room for; the last of them says which axis it is, and comes first.
void draw_axes(const raster::Canvas& canvas, const base::Box& box, const view::View& v, raster::Labels& labels) {
  const double reach = box.size().maxCoeff();
  const auto pixel = [&](const Vec3& p) -> std::optional<Eigen::Vector2d> {
    const Vec3 way = p - v.position;
    const double depth = way.dot(v.forward);
    if (depth < 0.01 * reach) return {};
    return Eigen::Vector2d((1 + way.dot(v.right) / depth / v.tan_x) * 0.5 * static_cast<double>(canvas.image.width),
                           (1 - way.dot(v.up) / depth / v.tan_y) * 0.5 * static_cast<double>(canvas.image.height));
  };
  for (const Axis& axis : axes(box, v)) {
    const double low = box.lower[axis.along], high = box.upper[axis.along], step = raster::tick_step(reach, 4);
    const auto last = static_cast<int>(std::floor(high / step + 1e-9)), first = static_cast<int>(std::ceil(low / step - 1e-9));
    bool is_named = false;
    for (int i = last; i >= first; --i) {
      Vec3 place = axis.from;
      place[axis.along] = i * step;
      const auto at = pixel(place), end = pixel(place + 0.02 * reach * axis.outward), text = pixel(place + 0.05 * reach * axis.outward);
      if (!at || !end || !text) continue;
      const std::string label = raster::tick_label(i * step, step) + (is_named ? "" : std::string(" m ") + "xyz"[axis.along]);
      const std::int64_t left = std::lround(text->x()) - canvas.width_of(label) / (axis.along == 2 ? 1 : 2);
      if (!labels.write(left, std::lround(text->y()) - 6 * canvas.scale, label)) continue;
      canvas.line(std::lround(at->x()), std::lround(at->y()), std::lround(end->x()), std::lround(end->y()), kRoom);
      is_named = true;
    }
  }
}

Image draw(const Setting& setting, const sim::Frame& frame, const surface::Mesh* mesh, const std::string& caption, double top_speed) {
  const Options& options = setting.options;
  const int factor = std::max(options.width, options.height) <= 4096 ? 2 : 1;  // samples across a pixel
  const attribute::Scale scale = attribute::scale_of(setting, top_speed);
  raster::Drawing drawing{.width = static_cast<int>(options.width) * factor, .height = static_cast<int>(options.height) * factor,
                          .view = view::resolve(setting.camera, setting.domain, options.width, options.height, static_cast<double>(frame.number)),
                          .radius = static_cast<float>(frame.pscale), .top = kTop, .bottom = kBottom, .discs = {}, .lines = outlines(setting),
                          .corners = {}, .facets = {}};
  const std::vector<float> values = mesh ? attribute::values(setting, frame, *mesh) : attribute::values(setting, frame);
  if (mesh) {
    for (std::size_t i = 0; i < values.size(); ++i) drawing.corners.push_back({mesh->position[i], mesh->normal[i], scale.color(values[i])});
    for (const auto& q : mesh->quads) {
      drawing.facets.push_back({q[0], q[1], q[2]});
      drawing.facets.push_back({q[0], q[2], q[3]});
    }
  } else {
    drawing.discs.reserve(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) drawing.discs.push_back({frame.position[i], scale.color(values[i])});
  }
  Image image = raster::shrink(raster::rasterize(drawing), options.width, options.height, factor);
  const raster::Canvas canvas{image, static_cast<int>(std::max<std::int64_t>(1, options.height / 500))};
  raster::Labels labels(canvas);
  labels.write_parts(12 * canvas.scale, image.height - 24 * canvas.scale, caption);
  raster::draw_color_bar(canvas, scale, labels);
  draw_axes(canvas, setting.domain, drawing.view, labels);
  return image;
}

}  // namespace

Image preview(const Setting& setting, const sim::Frame& frame, const std::string& caption, double top_speed) {
  return setting.dimension == 2 ? flat::draw(setting, frame, caption, top_speed) : draw(setting, frame, nullptr, caption, top_speed);
}

Image preview(const Setting& setting, const sim::Frame& frame, const surface::Mesh& mesh, const std::string& caption, double top_speed) {
  return draw(setting, frame, &mesh, caption, top_speed);
}

bool has_caption(const Setting& setting) { return setting.dimension == 3 || flat::has_caption(setting.options); }

}  // namespace render
