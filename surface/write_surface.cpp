#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

#include "surface/field/level_set.h"
#include "surface/files/vdb_file.h"
#include "surface/surface.h"

namespace surface {
namespace {

constexpr float kBand = 3;      // [voxels] half-width of the narrow band that is written
constexpr float kBelow = 0.5f;  // [voxels] the cut lies this far below the floor: no light between water and ground

openvdb::Vec3d to_vdb(const base::Vec3& v) { return {v[0], v[1], v[2]}; }

field::Scale make_scale(const sim::Frame& frame, const Options& options, const Room& room, double voxel) {
  const double edge = frame.pscale > 0 ? frame.pscale * std::cbrt(4 * M_PI / 3) : room.cell / 2;   // [m] of a cube with a particle's volume
  field::Scale s;
  s.spacing = float(edge / voxel);
  s.search = std::max(4 * s.spacing, 2.0f);
  // Far from the ends of a half-space of particles |x - mean| = 0.246 search at its boundary, for weights (1 - s^2)^3.
  s.radius = options.radius ? float(*options.radius / voxel) : 0.246f * s.search;
  s.lone = std::max({0.75f * s.spacing, 1.25f, s.radius});
  s.gap = std::max(1.5f * s.spacing, s.lone);
  s.limit = 0.35f;
  s.reach = field::kFar + s.lone;
  return s;
}

openvdb::math::Transform::Ptr make_transform(const field::Lattice& lattice) {
  auto transform = openvdb::math::Transform::createLinearTransform(lattice.voxel);
  transform->postTranslate(to_vdb(lattice.origin));
  return transform;
}

openvdb::Coord first_voxel(const field::Index3& block) { return {block[0] * field::kBlock, block[1] * field::kBlock, block[2] * field::kBlock}; }

openvdb::FloatGrid::Ptr level_set_grid(const field::Blocks& blocks, const field::Field& distance, const field::Lattice& lattice) {
  const float background = kBand * float(lattice.voxel);
  auto grid = openvdb::FloatGrid::create(background);
  grid->setName("surface");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const float* d = distance.data() + b * field::kVoxels;
    if (std::none_of(d, d + field::kVoxels, [](float x) { return std::fabs(x) < kBand; })) continue;
    auto* leaf = grid->tree().touchLeaf(first_voxel(blocks.coordinate[b]));
    for (openvdb::Index v = 0; v < field::kVoxels; ++v)
      if (std::fabs(d[v]) < kBand) leaf->setValueOn(v, d[v] * float(lattice.voxel));
      else leaf->setValueOff(v, std::copysign(background, d[v]));
  }
  openvdb::tools::signedFloodFill(grid->tree());
  return grid;
}

openvdb::Vec3SGrid::Ptr velocity_grid(const field::Blocks& blocks, const field::Field& distance, const std::array<field::Field, 3>& velocity, const std::string& name) {
  auto grid = openvdb::Vec3SGrid::create();
  grid->setName(name);
  grid->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  for (std::size_t b = 0; b < blocks.count(); ++b) {
    const float* d = distance.data() + b * field::kVoxels;
    if (std::none_of(d, d + field::kVoxels, [](float x) { return std::fabs(x) < kBand; })) continue;
    auto* leaf = grid->tree().touchLeaf(first_voxel(blocks.coordinate[b]));
    for (openvdb::Index v = 0; v < field::kVoxels; ++v)
      if (const std::size_t at = b * field::kVoxels + v; std::fabs(d[v]) < kBand)
        leaf->setValueOn(v, openvdb::Vec3f(velocity[0][at], velocity[1][at], velocity[2][at]));
  }
  return grid;
}

}  // namespace

void write_surface(const std::filesystem::path& path, const sim::Frame& frame, const Options& options, const Room& room, base::Ledger& ledger) {
  const field::Lattice lattice = {room.domain.lower, options.voxel.value_or(room.cell / 2)};
  const field::Scale scale = make_scale(frame, options, room, lattice.voxel);
  field::Cloud cloud;
  field::Blocks blocks;
  field::Field distance, limit;
  std::array<field::Field, 3> velocity;
  const auto bytes_of = [&](std::int64_t fields) { return fields * std::int64_t(distance.size() * sizeof(float)); };
  {
    auto timer = ledger.pass("rasterize", std::int64_t(frame.position.size() * 2 * sizeof(base::Vec3f)));
    cloud = field::make_cloud(frame, room, lattice, scale);
    blocks = field::make_blocks(cloud, scale);
    field::Spheres spheres = field::rasterize(cloud, field::company(cloud, blocks, scale), blocks, scale);
    distance = std::move(spheres.surface), limit = std::move(spheres.limit);
    timer.count(bytes_of(2));
  }
  {
    const auto timer = ledger.pass("rebuild", bytes_of(2));
    distance = field::distance_from_crossings(blocks, distance);
  }
  if (options.smooth > 0) {
    const auto timer = ledger.pass("smooth", bytes_of(2 * 2 * options.smooth + 5));   // read and written by each pass, twice; clamped
    distance = field::smooth(blocks, distance, static_cast<int>(options.smooth), scale.search, limit);
  }
  {
    const auto timer = ledger.pass("rebuild", bytes_of(2));
    distance = field::distance_from_slope(blocks, distance);
    const base::Vec3f upper = (room.domain.size() / lattice.voxel).cast<float>();
    field::cut(blocks, base::Vec3f(0, 0, -kBelow), upper, distance);
  }
  {
    const auto timer = ledger.pass("velocity", bytes_of(4) + std::int64_t(frame.position.size() * 2 * sizeof(base::Vec3f)));
    velocity = field::velocity(cloud, blocks, distance, kBand, scale.search);
  }
  auto timer = ledger.pass("write_surface", bytes_of(4));
  openvdb::GridCPtrVec grids;
  for (const openvdb::GridBase::Ptr& grid : {openvdb::GridBase::Ptr(level_set_grid(blocks, distance, lattice)),
                                             openvdb::GridBase::Ptr(velocity_grid(blocks, distance, velocity, options.vel_name))}) {
    grid->setTransform(make_transform(lattice));
    grid->setSaveFloatAsHalf(true);
    grid->setCreator("polypic");
    grid->insertMeta("frame", openvdb::Int64Metadata(frame.number));
    grid->insertMeta("time", openvdb::DoubleMetadata(frame.time));
    grid->insertMeta("cut_lower", openvdb::Vec3DMetadata(to_vdb(room.domain.lower - base::Vec3(0, 0, kBelow * lattice.voxel))));
    grid->insertMeta("cut_upper", openvdb::Vec3DMetadata(to_vdb(room.domain.upper)));
    grids.push_back(grid);
  }
  files::write(path, grids, {});
  timer.count(std::int64_t(std::filesystem::file_size(path)));
}

}  // namespace surface
