#pragma once
// Particles of a frame -> points file -> level set file -> mesh. Every arrow is a file that other programs open.
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/ledger.h"
#include "base/params.h"
#include "base/vec.h"
#include "sim/frame.h"
#include "sim/scene.h"

namespace surface {

/// The keys of [surface].
struct Options {
  std::optional<double> voxel;    // [m] half of sim.cell when unset
  std::optional<double> radius;   // [m] of a particle's sphere; 0.98 of the particle spacing when unset
  std::int64_t smooth = 8;        // passes
  std::string vel_name = "vel";   // name of the velocity grid
  void params(base::Params&);
};

/// What the surface must know of the simulation.
struct Room {
  base::Box domain;   // [m] walls; the level set is cut flat there, half a voxel below the floor
  double cell = 0;    // [m]
  std::vector<sim::Shape> solids = {};   // [m] colliders: the level set goes on into them, so that no film of air parts them from the water
};

/// OpenVDB PointDataGrid "points": P and v float (no lossy codec, Blosc), id int64, pscale. Atomic.
void write_points(const std::filesystem::path&, const sim::Frame&, base::Ledger&);
/// What write_points wrote, in ascending id; throws base::Error ("PATH: reason") on anything else.
sim::Frame read_points(const std::filesystem::path&);

/// FloatGrid "surface" (level set, half, Blosc) and Vec3 grid `vel_name` in m/s. Atomic. A frame without particles gives empty grids.
void write_surface(const std::filesystem::path&, const sim::Frame&, const Options&, const Room&, base::Ledger&);

/// The zero set as quads with smooth normals; world metres, counter-clockwise seen from outside. Where a wall cuts the free
/// surface two vertices share a place, one with each normal.
struct Mesh {
  std::vector<base::Vec3f> position, normal, velocity;  // one each a vertex; velocity [m/s]
  std::vector<std::array<std::uint32_t, 4>> quads;      // a triangle repeats its last vertex
};
Mesh read_surface(const std::filesystem::path&, const Options&, base::Ledger&);

/// One grid of a .vdb file, for `info`.
struct GridInfo {
  std::string name, type, grid_class, compression;
  base::Vec3 voxel_size = base::Vec3::Zero();
  std::uint64_t active = 0;
  std::optional<double> min, max;                      // scalar grids: range of active values
  std::optional<std::array<std::array<int, 3>, 2>> bbox;  // of active voxels, index space, inclusive
  bool half = false;
  std::vector<std::array<std::string, 2>> metadata;    // name, value as text
  std::optional<std::uint64_t> points;                 // point grids
  std::vector<std::string> attributes;                 // point grids: "P vec3s"
};
std::vector<GridInfo> info(const std::filesystem::path&);

/// Starts the library once; call before any other function of this folder, from one thread.
void initialize();

}  // namespace surface
