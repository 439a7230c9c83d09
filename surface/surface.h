#pragma once
// Particles of a frame -> points file -> level set file -> mesh. Every arrow is a file that other programs open.
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/differences.h"
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

/// A collider as it is at the frame.
struct Solid {
  sim::Shape shape;        // [m]
  sim::RigidMotion motion = {};
};

/// What the surface must know of the simulation.
struct Room {
  base::Box domain;   // [m] its sides; the level set is cut flat there, half a voxel below the floor
  double cell = 0;    // [m]
  std::vector<Solid> solids = {};        // the level set goes on into them, so that no film of air parts them from the water
  std::array<std::array<bool, 2>, 3> walls = {{{true, true}, {true, true}, {true, true}}};   // lower and upper side by axis: nothing flows through
  std::array<bool, 3> periodic = {};     // axes whose lower side is the upper one: beyond it lies what is at the other
  std::vector<bool> dry = {};            // by number of the body: it touches walls, solids and other bodies and does not cling to them; none: all cling, as liquids do, and go on to the others
  std::vector<std::string> bodies = {};  // names of all, where each gets a surface of its own; none: one surface around all particles
};

/// OpenVDB PointDataGrid "points": P and v float (no lossy codec, Blosc), id int64, pscale, and what else the frame holds (body int32; pressure,
/// strain, mode_energy float). Atomic.
void write_points(const std::filesystem::path&, const sim::Frame&, base::Ledger&);
/// What write_points wrote, in ascending id; throws base::Error ("PATH: reason") on anything else.
sim::Frame read_points(const std::filesystem::path&);

/// FloatGrid "surface" (level set, half, Blosc) and Vec3 grid `vel_name` in m/s. Where bodies have surfaces of their own these are the union of
/// theirs, and the velocity of the body that is nearer; then come "surface_NAME" and "vel_NAME" of each, made from its particles
/// alone, but that liquids go on to the others. Atomic. A frame, or a body, without particles gives empty grids.
void write_surface(const std::filesystem::path&, const sim::Frame&, const Options&, const Room&, base::Ledger&);

/// The zero set as quads with smooth normals; world metres, counter-clockwise seen from outside. Where a wall cuts the free
/// surface two vertices share a place, one with each normal.
struct Mesh {
  std::vector<base::Vec3f> position, normal, velocity;  // one each a vertex; velocity [m/s]
  std::vector<std::array<std::uint32_t, 4>> quads;      // a triangle repeats its last vertex
};
Mesh read_surface(const std::filesystem::path&, const Options&, base::Ledger&);
/// Of each body that is named its own, in that order; an empty name gives an empty mesh.
std::vector<Mesh> read_surfaces(const std::filesystem::path&, const Options&, const std::vector<std::string>& bodies, base::Ledger&);

/// One grid of a .vdb file, for `info`.
struct GridInfo {
  std::string name, type, grid_class, compression;
  base::Vec3 voxel_size = base::Vec3::Zero();
  std::uint64_t active = 0;
  std::optional<double> min, max;                      // scalar grids: range of active values, where both are finite
  std::uint64_t not_finite = 0;                        // active values that are NaN or infinite, of scalars and vectors
  std::optional<std::array<std::array<int, 3>, 2>> bbox;  // of active voxels, index space, inclusive
  bool half = false;
  std::vector<std::array<std::string, 2>> metadata;    // name, value as text
  std::optional<std::uint64_t> points;                 // point grids
  std::vector<std::string> attributes;                 // point grids: "P vec3s"
};
std::vector<GridInfo> info(const std::filesystem::path&);

/// A .vdb file is one or the other, whoever wrote it.
bool holds_points(const std::filesystem::path&);

/// Two grids of one name.
struct GridDifference {
  std::string name, unit;                              // "m" of a level set, "m/s" of a velocity; empty when the file does not say
  std::vector<std::string> unlike;                     // what cannot be measured: "voxels: ...", "type: ...", "class", "background"
  std::uint64_t active_a = 0, active_b = 0;            // voxels
  std::uint64_t active_only_a = 0, active_only_b = 0;  // counted, like the values, only where type and voxels are the same
  base::Differences values;                            // of voxels active in either, and of others that differ; vectors by length
};
struct VolumeDifference {
  std::vector<std::string> only_a, only_b;             // names of grids
  std::vector<GridDifference> grids;
};
/// Throws base::Error (exit 2) for a file that cannot be read and a type of grid that is not known.
VolumeDifference compare_volumes(const std::filesystem::path& a, const std::filesystem::path& b, double limit);

/// Particles paired by id.
struct PointDifference {
  std::vector<std::string> unlike;                     // "pscale: ..."
  std::uint64_t count_a = 0, count_b = 0, only_a = 0, only_b = 0;
  std::uint64_t over = 0;                              // pairs of which something is over the limit, or whose bodies differ
  base::Differences position, velocity;                // [m], [m/s]
  std::vector<std::pair<std::string, base::Differences>> scalars;   // of what both hold: "pressure" ...; [1] of the largest of both files
};
PointDifference compare_points(const std::filesystem::path& a, const std::filesystem::path& b, double limit);

/// Starts the library once; call before any other function of this folder, from one thread.
void initialize();

}  // namespace surface
