#pragma once
// Closed surfaces of triangles, for tests of bodies and colliders that are made from them.
#include <cmath>
#include <memory>
#include <vector>

#include "sim/scene.h"

namespace mesh_test {

struct Surface {
  std::vector<base::Vec3f> corners;
  std::vector<sim::ClosedMesh::Triangle> triangles;
  void add(const Surface& o) {
    const auto from = std::uint32_t(corners.size());
    corners.insert(corners.end(), o.corners.begin(), o.corners.end());
    for (const auto& t : o.triangles) triangles.push_back({t[0] + from, t[1] + from, t[2] + from});
  }
};

inline Surface box(const base::Vec3f& low, const base::Vec3f& high) {
  Surface s;
  for (int k = 0; k < 8; ++k) s.corners.emplace_back(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z());
  s.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return s;
}

/// A ring about z, radius 1, its tube `tube`, of n by n / 2 squares.
inline Surface ring(int n, double tube) {
  Surface s;
  const int m = n / 2;
  const auto corner = [&](int i, int j) { return std::uint32_t(i % n * m + j % m); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < m; ++j) {
      const double a = 2 * M_PI * i / n, b = 2 * M_PI * j / m, r = 1 + tube * std::cos(b);
      s.corners.emplace_back(float(r * std::cos(a)), float(r * std::sin(a)), float(tube * std::sin(b)));
      s.triangles.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      s.triangles.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  return s;
}

inline sim::ClosedMesh closed(const Surface& s, double scale = 1, const base::Vec3& translate = base::Vec3::Zero()) {
  return {s.corners, s.triangles, scale, translate};
}

/// A ball of radius 1, of 2 n by n squares.
inline Surface ball(int n) {
  Surface s;
  s.corners = {{0, 0, -1}, {0, 0, 1}};
  const int around = 2 * n;
  const auto corner = [&](int i, int j) { return j == 0 ? 0u : j == n ? 1u : std::uint32_t(2 + (j - 1) * around + i % around); };
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < around; ++i) {
      const double a = 2 * M_PI * i / around, b = M_PI * j / n;
      s.corners.emplace_back(float(std::sin(b) * std::cos(a)), float(std::sin(b) * std::sin(a)), float(-std::cos(b)));
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < around; ++i) {
      if (j > 0) s.triangles.push_back({corner(i, j), corner(i + 1, j), corner(i, j + 1)});
      if (j < n - 1) s.triangles.push_back({corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  return s;
}

/// As a collider's or a body's shape, read and placed.
inline sim::Shape::Mesh shape_of(const Surface& s, double scale, const base::Vec3& translate) {
  sim::Shape::Mesh mesh;
  mesh.scale = scale, mesh.translate = translate;
  mesh.solid = std::make_shared<const sim::ClosedMesh>(s.corners, s.triangles, scale, translate);
  return mesh;
}
inline base::Box everywhere() { return {base::Vec3::Constant(-1e9), base::Vec3::Constant(1e9)}; }
/// The same, with distances for cells of `cell` [m] of a domain that begins at 0.
inline sim::Shape::Mesh collider_of(const Surface& s, double scale, const base::Vec3& translate, double cell) {
  sim::Shape::Mesh mesh = shape_of(s, scale, translate);
  mesh.distances = std::make_shared<const sim::MeshDistance>(mesh.solid, cell, base::Vec3::Zero(), everywhere());
  mesh.distances->prepare();
  return mesh;
}

}  // namespace mesh_test
