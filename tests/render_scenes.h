#pragma once
// Small scenes with known answers, shared by the tests of render/.
#include <cmath>
#include <numbers>

#include "render/render.h"

namespace tests {

using base::Vec3;
using base::Vec3f;

/// A closed box with flat normals.
inline surface::Mesh box_mesh(const base::Box& box) {
  surface::Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::array<std::uint32_t, 4> quad{};
      for (std::uint32_t k = 0; k < 4; ++k) {
        Vec3 p;
        p[axis] = (side ? box.upper : box.lower)[axis];
        p[u] = ((k == 1 || k == 2) ? box.upper : box.lower)[u];
        p[v] = (k >= 2 ? box.upper : box.lower)[v];
        quad[side ? k : 3 - k] = static_cast<std::uint32_t>(mesh.position.size());
        mesh.position.push_back(p.cast<float>());
        mesh.normal.push_back((side ? 1.0f : -1.0f) * Vec3f::Unit(axis));
        mesh.velocity.push_back(Vec3f::Zero());
      }
      mesh.quads.push_back(quad);
    }
  return mesh;
}

inline surface::Mesh sphere_mesh(const Vec3& middle, double radius, std::uint32_t sides = 48) {
  surface::Mesh mesh;
  const std::uint32_t rings = sides / 2;
  for (std::uint32_t i = 0; i <= rings; ++i)
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / sides;
      const Vec3 n(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      mesh.position.push_back((middle + radius * n).cast<float>());
      mesh.normal.push_back(n.cast<float>());
      mesh.velocity.push_back(Vec3f::Zero());
    }
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t j = 0; j < sides; ++j) {
      const std::uint32_t a = i * sides + j, b = (i + 1) * sides + j, c = (i + 1) * sides + (j + 1) % sides, d = i * sides + (j + 1) % sides;
      mesh.quads.push_back({a, b, c, d});
    }
  return mesh;
}

inline render::Light uniform_sky(double radiance) {
  return {.kind = "sky", .color = Vec3::Ones(), .horizon = Vec3::Ones(), .intensity = radiance};
}

/// A domain around the origin with its floor at z = 0, nothing in it, no light.
inline render::Setting empty_setting() {
  render::Setting setting;
  setting.options.width = 64;
  setting.options.height = 36;
  setting.domain = {Vec3(-1, -1, 0), Vec3(1, 1, 1)};
  setting.lights = {uniform_sky(0)};
  return setting;
}

inline render::Image traced(const render::Setting& setting, const surface::Mesh& mesh, int threads = 2, std::int64_t frame = 1) {
  base::Ledger ledger;
  return render::PathTracer(setting, threads).trace(mesh, frame, ledger);
}

/// Mean colour over pixels [x0, x1) x [y0, y1).
inline Vec3 mean_color(const render::Image& image, std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
  Vec3 sum = Vec3::Zero();
  for (std::int64_t y = y0; y < y1; ++y)
    for (std::int64_t x = x0; x < x1; ++x)
      for (std::int64_t c = 0; c < 3; ++c)
        sum[c] += image.pixels[static_cast<std::size_t>((y * image.width + x) * static_cast<std::int64_t>(image.channels.size()) + c)];
  return sum / static_cast<double>((x1 - x0) * (y1 - y0));
}
inline Vec3 mean_color(const render::Image& image) { return mean_color(image, 0, 0, image.width, image.height); }

}  // namespace tests
