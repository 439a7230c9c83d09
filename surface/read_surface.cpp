#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "base/error.h"
#include "base/parallel.h"
#include "surface/files/vdb_file.h"
#include "surface/mesh/quads.h"
#include "surface/surface.h"

namespace surface {
namespace {

using base::Vec3f;
using openvdb::Coord;
using openvdb::Vec3d;

Vec3f to_eigen(const openvdb::Vec3f& v) { return {v[0], v[1], v[2]}; }

/// Gradient by central differences at the eight voxels around `x` [index], interpolated: continuous from voxel to voxel. On the
/// ridge inside a sheet the differences are short and say little; the square of their length leaves them out.
template <class Accessor>
Vec3f gradient(Accessor& level, const Vec3d& x) {
  const Coord base = Coord::floor(x);
  const Vec3d t = x - base.asVec3d();
  Vec3f sum = Vec3f::Zero();
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k) {
        const Coord c = base.offsetBy(i, j, k);
        const float weight = float((i ? t[0] : 1 - t[0]) * (j ? t[1] : 1 - t[1]) * (k ? t[2] : 1 - t[2]));
        const Vec3f difference(level.getValue(c.offsetBy(1, 0, 0)) - level.getValue(c.offsetBy(-1, 0, 0)),
                               level.getValue(c.offsetBy(0, 1, 0)) - level.getValue(c.offsetBy(0, -1, 0)),
                               level.getValue(c.offsetBy(0, 0, 1)) - level.getValue(c.offsetBy(0, 0, -1)));
        sum += weight * difference.squaredNorm() * difference;
      }
  return sum;
}

}  // namespace

Mesh read_surface(const std::filesystem::path& path, const Options& options, base::Ledger& ledger) {
  const auto timer = ledger.pass("mesh");
  const files::Contents contents = files::read(path);
  const openvdb::FloatGrid::Ptr level = files::find<openvdb::FloatGrid>(contents, "surface");
  if (!level || level->getGridClass() != openvdb::GRID_LEVEL_SET) base::throw_input(path.string(), "has no level set named surface");
  const openvdb::Vec3SGrid::Ptr velocity = files::find<openvdb::Vec3SGrid>(contents, options.vel_name);
  const mesh::Quads quads = mesh::quads_of(*level);

  Mesh result;
  result.position.resize(quads.points.size());
  result.normal.resize(quads.points.size());
  result.velocity.assign(quads.points.size(), Vec3f::Zero());
  base::parallel_chunks(quads.points.size(), 4096, [&](std::size_t begin, std::size_t end) {
    const auto level_at = level->getConstAccessor();
    for (std::size_t v = begin; v < end; ++v) {
      result.position[v] = to_eigen(quads.points[v]);
      result.normal[v] = gradient(level_at, level->worldToIndex(Vec3d(quads.points[v]))).stableNormalized();
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
