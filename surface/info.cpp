#include <openvdb/openvdb.h>
#include <openvdb/points/PointCount.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/tools/Count.h>

#include <algorithm>
#include <cmath>

#include "surface/files/vdb_file.h"
#include "surface/surface.h"

namespace surface {
namespace {

template <class Grid>
void add_range(const openvdb::GridBase& grid, GridInfo& info) {
  if (!grid.isType<Grid>() || info.active == 0) return;
  const auto range = openvdb::tools::minMax(static_cast<const Grid&>(grid).tree());
  const auto least = static_cast<double>(range.min()), most = static_cast<double>(range.max());
  if (std::isfinite(least) && std::isfinite(most)) info.min = least, info.max = most;
}

bool is_finite(double value) { return std::isfinite(value); }
template <class Real>
bool is_finite(const openvdb::math::Vec3<Real>& value) { return value.isFinite(); }

template <class Grid>
void count_not_finite(const openvdb::GridBase& grid, GridInfo& info) {
  if (!grid.isType<Grid>()) return;
  for (auto value = static_cast<const Grid&>(grid).cbeginValueOn(); value; ++value)
    if (!is_finite(*value)) info.not_finite += value.getVoxelCount();
}

void add_points(const openvdb::GridBase& grid, GridInfo& info) {
  if (!grid.isType<openvdb::points::PointDataGrid>()) return;
  const auto& tree = static_cast<const openvdb::points::PointDataGrid&>(grid).tree();
  info.points = openvdb::points::pointCount(tree);
  const auto leaf = tree.cbeginLeaf();
  if (!leaf) return;
  const auto& descriptor = leaf->attributeSet().descriptor();
  std::map<std::size_t, std::string> by_position;
  for (const auto& [name, at] : descriptor.map()) by_position[at] = name + " " + descriptor.valueType(at);
  for (const auto& [at, text] : by_position) info.attributes.push_back(text);
}

GridInfo describe(const openvdb::GridBase& grid) {
  GridInfo info;
  info.name = grid.getName();
  info.type = grid.valueType();
  info.grid_class = openvdb::GridBase::gridClassToString(grid.getGridClass());
  const openvdb::Vec3d size = grid.voxelSize();
  info.voxel_size = base::Vec3(size[0], size[1], size[2]);
  info.active = grid.activeVoxelCount();
  info.half = grid.saveFloatAsHalf();
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) {
    const std::string text = entry->second ? entry->second->str() : "";
    if (entry->first == openvdb::GridBase::META_FILE_COMPRESSION) info.compression = text;
    info.metadata.push_back({entry->first, text});
  }
  if (info.active > 0) {
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    info.bbox = {{{box.min()[0], box.min()[1], box.min()[2]}, {box.max()[0], box.max()[1], box.max()[2]}}};
  }
  add_range<openvdb::FloatGrid>(grid, info);
  add_range<openvdb::DoubleGrid>(grid, info);
  add_range<openvdb::Int32Grid>(grid, info);
  add_range<openvdb::Int64Grid>(grid, info);
  count_not_finite<openvdb::FloatGrid>(grid, info);
  count_not_finite<openvdb::DoubleGrid>(grid, info);
  count_not_finite<openvdb::Vec3SGrid>(grid, info);
  count_not_finite<openvdb::Vec3DGrid>(grid, info);
  add_points(grid, info);
  return info;
}

}  // namespace

bool holds_points(const std::filesystem::path& path) {
  const files::Contents contents = files::read(path);
  return std::any_of(contents.grids.begin(), contents.grids.end(),
                     [](const auto& grid) { return grid->template isType<openvdb::points::PointDataGrid>(); });
}

std::vector<GridInfo> info(const std::filesystem::path& path) {
  std::vector<GridInfo> result;
  for (const auto& grid : files::read(path).grids) result.push_back(describe(*grid));
  return result;
}

}  // namespace surface
