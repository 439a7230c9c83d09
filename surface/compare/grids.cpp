// Volumes of two .vdb files, grid by grid.
#include <openvdb/openvdb.h>

#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "base/text.h"
#include "surface/compare/walk.h"
#include "surface/files/vdb_file.h"
#include "surface/surface.h"

namespace surface {
namespace {

/// How far apart two values are: of vectors the length of the difference.
template <class Value>
double distance(const Value& a, const Value& b) {
  if constexpr (openvdb::VecTraits<Value>::IsVec) {
    double squares = 0;
    for (int i = 0; i < openvdb::VecTraits<Value>::Size; ++i) {
      const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
      squares += d * d;
    }
    return std::sqrt(squares);
  } else {
    return static_cast<double>(std::abs(static_cast<long double>(a) - static_cast<long double>(b)));   // exact for 64-bit integers
  }
}

template <class Tree>
std::set<openvdb::Coord> root_entries(const Tree& a, const Tree& b) {
  std::set<openvdb::Coord> origins;
  for (const Tree* tree : {&a, &b})
    for (auto entry = tree->root().cbeginChildAll(); entry; ++entry) origins.insert(entry.getCoord());
  return origins;
}

/// Values are compared where either grid is active, and elsewhere where they differ (the inside of a level set).
template <class Grid>
void compare_values(const Grid& a, const Grid& b, GridDifference& result) {
  using Value = typename Grid::ValueType;
  for (const openvdb::Coord& origin : root_entries(a.tree(), b.tree()))
    compare::walk(compare::below_root(a.tree(), origin), compare::below_root(b.tree(), origin),
                  [&](const Value& in_a, bool on_a, const Value& in_b, bool on_b, std::uint64_t voxels) {
                    if (on_a && !on_b) result.active_only_a += voxels;
                    if (on_b && !on_a) result.active_only_b += voxels;
                    const double d = distance(in_a, in_b);
                    if (on_a || on_b || d != 0) result.values.add(d, voxels);
                  });
  if (distance(a.background(), b.background()) != 0) result.unlike.push_back("background");
}

template <class... Grids>
struct Kinds {};
using Compared = Kinds<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::Int64Grid, openvdb::BoolGrid, openvdb::Vec3SGrid,
                       openvdb::Vec3DGrid, openvdb::Vec3IGrid>;

/// False when the grids are of none of these kinds.
template <class... Grids>
bool compare_as(Kinds<Grids...>, const openvdb::GridBase& a, const openvdb::GridBase& b, GridDifference& result) {
  return (... || (a.isType<Grids>() && (compare_values(static_cast<const Grids&>(a), static_cast<const Grids&>(b), result), true)));
}

std::string voxel_text(const openvdb::GridBase& grid) {
  const openvdb::Vec3d size = grid.voxelSize();
  return base::to_text(size[0]) + " x " + base::to_text(size[1]) + " x " + base::to_text(size[2]) + " m";
}

/// "m" of a level set, "m/s" of a velocity as this program writes them; empty when the file does not say.
std::string unit_of(const openvdb::GridBase& grid) {
  if (grid.getGridClass() == openvdb::GRID_LEVEL_SET) return "m";
  return grid.isType<openvdb::Vec3SGrid>() && grid.getVectorType() == openvdb::VEC_CONTRAVARIANT_RELATIVE ? "m/s" : "";
}

GridDifference compare_grids(const std::filesystem::path& path, const openvdb::GridBase& a, const openvdb::GridBase& b, double limit) {
  GridDifference result;
  result.name = a.getName();
  result.unit = unit_of(a);
  result.values.limit = limit;
  result.active_a = a.activeVoxelCount();
  result.active_b = b.activeVoxelCount();
  if (a.getGridClass() != b.getGridClass()) result.unlike.push_back("class");
  if (a.type() != b.type()) {
    result.unlike.push_back("type: " + a.valueType() + " and " + b.valueType());
  } else if (a.transform() != b.transform()) {
    const std::string in_a = voxel_text(a), in_b = voxel_text(b);
    result.unlike.push_back(in_a == in_b ? "place of the voxels" : "voxels: " + in_a + " and " + in_b);
  } else if (!compare_as(Compared(), a, b, result)) {
    base::throw_input(path.string(), "grid " + a.getName() + " is of the type " + a.type() + ", which is not compared");
  }
  return result;
}

/// Grids by name; of several with one name the first is 0, the next 1.
std::map<std::pair<std::string, int>, openvdb::GridBase::Ptr> by_name(const openvdb::GridPtrVec& grids) {
  std::map<std::pair<std::string, int>, openvdb::GridBase::Ptr> named;
  for (const auto& grid : grids) {
    int copy = 0;
    while (named.contains({grid->getName(), copy})) ++copy;
    named[{grid->getName(), copy}] = grid;
  }
  return named;
}

}  // namespace

VolumeDifference compare_volumes(const std::filesystem::path& a, const std::filesystem::path& b, double limit) {
  const auto in_a = by_name(files::read(a).grids), in_b = by_name(files::read(b).grids);
  VolumeDifference result;
  for (const auto& [name, grid] : in_a)
    if (const auto other = in_b.find(name); other != in_b.end()) result.grids.push_back(compare_grids(a, *grid, *other->second, limit));
    else result.only_a.push_back(name.first);
  for (const auto& [name, grid] : in_b)
    if (!in_a.contains(name)) result.only_b.push_back(name.first);
  return result;
}

}  // namespace surface
