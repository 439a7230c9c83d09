#pragma once
// Bodies of jittered particles, eight a cell, and measures of their meshes.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <random>

#include "base/parallel.h"
#include "surface/surface.h"

namespace surface_test {

using base::Vec3;
using base::Vec3f;

constexpr double kCell = 0.02, kVoxel = kCell / 2;   // [m]; the voxel is also the spacing of the particles

inline surface::Room room() { return {{Vec3(0, 0, 0), Vec3(0.8, 0.6, 0.6)}, kCell}; }

/// One particle in each cube of the spacing whose place `keep`s, moving at `velocity`.
inline sim::Frame fill(const std::function<bool(const Vec3&)>& keep, const Vec3f& velocity = Vec3f(1, 2, -3)) {
  sim::Frame frame;
  frame.number = 7;
  frame.time = 0.25;
  frame.pscale = kVoxel * std::cbrt(3 / (4 * M_PI));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const Eigen::Vector3i n = (room().domain.size() / kVoxel).array().round().cast<int>();
  for (int i = 0; i < n[0]; ++i)
    for (int j = 0; j < n[1]; ++j)
      for (int k = 0; k < n[2]; ++k) {
        const double a = unit(random), b = unit(random), c = unit(random);
        const Vec3 x = kVoxel * Vec3(i + a, j + b, k + c);
        if (!keep(x)) continue;
        frame.position.push_back(x.cast<float>());
        frame.velocity.push_back(velocity);
        frame.id.push_back(static_cast<std::int64_t>(frame.id.size()));
      }
  return frame;
}
inline sim::Frame ball(double radius) {
  return fill([=](const Vec3& x) { return (x - Vec3(0.4, 0.3, 0.3)).norm() < radius; });
}
inline sim::Frame tank(double height) {
  return fill([=](const Vec3& x) { return x[2] < height; });
}
inline sim::Frame single(const Vec3f& x) {
  sim::Frame frame = fill([](const Vec3&) { return false; });
  frame.position = {x};
  frame.velocity = {Vec3f(0, 0, -1)};
  frame.id = {0};
  return frame;
}
inline double particle_volume(const sim::Frame& frame) { return double(frame.id.size()) * std::pow(kVoxel, 3); }

/// A file that is gone when the test is over; its name is the test's, so that tests run side by side.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& end = ".vdb") {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() / (std::string("polypic_") + test->test_suite_name() + "_" + test->name() + end);
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline surface::Mesh mesh_of(const sim::Frame& frame, const surface::Options& options = {}, const surface::Room& walls = room()) {
  surface::initialize();
  const TemporaryFile file(".mesh.vdb");
  base::Ledger ledger;
  surface::write_surface(file.path(), frame, options, walls, ledger);
  return surface::read_surface(file.path(), options, ledger);
}

inline Vec3 corner(const surface::Mesh& mesh, const std::array<std::uint32_t, 4>& quad, int i) {
  return mesh.position[quad[std::size_t(i)]].cast<double>();
}

/// Twice the vector area is the cross product of the diagonals; a triangle's last vertex is repeated.
inline Vec3 vector_area(const surface::Mesh& mesh, const std::array<std::uint32_t, 4>& quad) {
  return 0.5 * (corner(mesh, quad, 2) - corner(mesh, quad, 0)).cross(corner(mesh, quad, 3) - corner(mesh, quad, 1));
}

/// Divergence theorem over the triangles of each quad; positive when the mesh faces outwards.
inline double volume(const surface::Mesh& mesh) {
  double six = 0;
  for (const auto& q : mesh.quads) {
    const Vec3 a = corner(mesh, q, 0), b = corner(mesh, q, 1), c = corner(mesh, q, 2), d = corner(mesh, q, 3);
    six += a.dot(b.cross(c)) + a.dot(c.cross(d));
  }
  return six / 6;
}

}  // namespace surface_test
