#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "base/error.h"
#include "base/parallel.h"
#include "surface/files/vdb_file.h"
#include "surface/mesh/quads.h"
#include "surface/mesh/walls.h"
#include "surface/surface.h"

namespace surface {
namespace {

using base::Vec3f;
using openvdb::Vec3d;

Vec3f to_eigen(const openvdb::Vec3f& v) { return {v[0], v[1], v[2]}; }

}  // namespace

Mesh read_surface(const std::filesystem::path& path, const Options& options, base::Ledger& ledger) {
  const auto timer = ledger.pass("mesh");
  const files::Contents contents = files::read(path);
  const openvdb::FloatGrid::Ptr level = files::find<openvdb::FloatGrid>(contents, "surface");
  if (!level || level->getGridClass() != openvdb::GRID_LEVEL_SET) base::throw_input(path.string(), "has no level set named surface");
  const openvdb::Vec3SGrid::Ptr velocity = files::find<openvdb::Vec3SGrid>(contents, options.vel_name);
  const std::optional<mesh::Walls> walls = mesh::walls_of(*level);
  const mesh::Quads quads = mesh::quads_of(*level);

  Mesh result;
  result.position.resize(quads.points.size());
  result.normal.resize(quads.points.size());
  result.velocity.assign(quads.points.size(), Vec3f::Zero());
  base::parallel_chunks(quads.points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    const mesh::Level level_at(*level, walls);
    for (std::size_t v = begin; v < end; ++v) {
      const mesh::Vertex vertex = level_at.vertex(level->worldToIndex(Vec3d(quads.points[v])));
      result.position[v] = to_eigen(openvdb::Vec3f(level->indexToWorld(vertex.position)));
      result.normal[v] = vertex.normal;
    }
    if (!velocity) return;
    const auto velocity_at = velocity->getConstAccessor();
    for (std::size_t v = begin; v < end; ++v)
      result.velocity[v] = to_eigen(openvdb::tools::BoxSampler::sample(velocity_at, velocity->worldToIndex(Vec3d(quads.points[v]))));
  });
  result.quads.reserve(quads.quads.size());
  for (const openvdb::Vec4I& q : quads.quads) result.quads.push_back({q[0], q[1], q[2], q[3]});
  return result;
}

}  // namespace surface
