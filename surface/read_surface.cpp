#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <bit>
#include <map>

#include "base/error.h"
#include "base/parallel.h"
#include "surface/files/names.h"
#include "surface/files/vdb_file.h"
#include "surface/mesh/quads.h"
#include "surface/mesh/walls.h"
#include "surface/surface.h"

namespace surface {
namespace {

using base::Vec3f;
using files::kSurface;
using files::name_of_body;
using openvdb::Vec3d;

Vec3f to_eigen(const openvdb::Vec3f& v) { return {v[0], v[1], v[2]}; }
Vec3d to_vdb(const Vec3f& v) { return {v[0], v[1], v[2]}; }

/// Quads that lie on a wall get vertices of their own where the wall's normal differs: the edge to the free surface is sharp.
void split_edges(const std::vector<std::uint8_t>& walls, Mesh& mesh) {
  std::map<std::pair<std::uint32_t, int>, std::uint32_t> copies;   // of a vertex, for a wall
  for (auto& quad : mesh.quads) {
    const auto common = static_cast<std::uint8_t>(walls[quad[0]] & walls[quad[1]] & walls[quad[2]] & walls[quad[3]]);
    if (common == 0) continue;
    const Vec3f normal = mesh::wall_normal(common);
    for (std::uint32_t& v : quad) {
      if (mesh.normal[v] == normal) continue;
      const auto [copy, fresh] = copies.try_emplace({v, std::countr_zero(common)}, static_cast<std::uint32_t>(mesh.position.size()));
      if (fresh) {
        mesh.position.push_back(Vec3f(mesh.position[v]));
        mesh.velocity.push_back(Vec3f(mesh.velocity[v]));
        mesh.normal.push_back(normal);
      }
      v = copy->second;
    }
  }
}

/// Of the grids called `name` and `vel_name`.
Mesh mesh_of(const files::Contents& contents, const std::string& name, const std::string& vel_name, const std::filesystem::path& path) {
  const openvdb::FloatGrid::Ptr level = files::find<openvdb::FloatGrid>(contents, name);
  if (!level || level->getGridClass() != openvdb::GRID_LEVEL_SET) base::throw_input(path.string(), "has no level set named " + name);
  const openvdb::Vec3SGrid::Ptr velocity = files::find<openvdb::Vec3SGrid>(contents, vel_name);
  const std::optional<mesh::Walls> walls = mesh::walls_of(*level);
  const mesh::Quads quads = mesh::quads_of(*level);

  Mesh result;
  result.position.resize(quads.points.size());
  result.normal.resize(quads.points.size());
  result.velocity.assign(quads.points.size(), Vec3f::Zero());
  std::vector<std::uint8_t> on(quads.points.size());   // walls of each vertex
  base::parallel_chunks(quads.points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    const mesh::Level level_at(*level, walls);
    for (std::size_t v = begin; v < end; ++v) {
      const mesh::Vertex vertex = level_at.vertex(level->worldToIndex(Vec3d(quads.points[v])));
      result.position[v] = to_eigen(openvdb::Vec3f(level->indexToWorld(vertex.position)));
      result.normal[v] = vertex.normal;
      on[v] = vertex.walls;
    }
    if (!velocity) return;
    const auto velocity_at = velocity->getConstAccessor();
    for (std::size_t v = begin; v < end; ++v)
      result.velocity[v] = to_eigen(openvdb::tools::BoxSampler::sample(velocity_at, velocity->worldToIndex(to_vdb(result.position[v]))));
  });
  result.quads.reserve(quads.quads.size());
  for (const openvdb::Vec4I& q : quads.quads) result.quads.push_back({q[0], q[1], q[2], q[3]});
  split_edges(on, result);
  return result;
}

std::int64_t bytes_of(const Mesh& mesh) {
  return static_cast<std::int64_t>(mesh.position.size() * 3 * sizeof(Vec3f) + mesh.quads.size() * sizeof(mesh.quads[0]));
}

}  // namespace

Mesh read_surface(const std::filesystem::path& path, const Options& options, base::Ledger& ledger) {
  auto timer = ledger.pass("mesh");
  Mesh mesh = mesh_of(files::read(path), kSurface, options.vel_name, path);
  timer.count(std::int64_t(std::filesystem::file_size(path)) + bytes_of(mesh));
  return mesh;
}

std::vector<Mesh> read_surfaces(const std::filesystem::path& path, const Options& options, const std::vector<std::string>& bodies,
                                base::Ledger& ledger) {
  auto timer = ledger.pass("mesh");
  const files::Contents contents = files::read(path);
  std::vector<Mesh> meshes(bodies.size());
  timer.count(std::int64_t(std::filesystem::file_size(path)));
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].empty()) continue;
    meshes[i] = mesh_of(contents, name_of_body(kSurface, bodies[i]), name_of_body(options.vel_name, bodies[i]), path);
    timer.count(bytes_of(meshes[i]));
  }
  return meshes;
}

}  // namespace surface
