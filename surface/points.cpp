// PointDataGrid "points". A position is a voxel and an offset from its centre. With a voxel size that is a power of two and the
// grid's origin at the world's, both steps are exact in float, so a position comes back with the bits it had.
#include <openvdb/openvdb.h>
#include <openvdb/points/AttributeArray.h>
#include <openvdb/points/PointDataGrid.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "base/error.h"
#include "surface/files/vdb_file.h"
#include "surface/scalars.h"
#include "surface/surface.h"

namespace surface {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;
using openvdb::Vec3f;
using openvdb::points::PointDataGrid;
using Leaf = openvdb::points::PointDataTree::LeafNodeType;
using VectorArray = openvdb::points::TypedAttributeArray<Vec3f>;        // NullCodec: as it is
using IdArray = openvdb::points::TypedAttributeArray<std::int64_t>;
using ScaleArray = openvdb::points::TypedAttributeArray<float>;
using BodyArray = openvdb::points::TypedAttributeArray<std::int32_t>;

/// [m] power of two next to the edge of a cell with eight particles.
double point_voxel(const sim::Frame& frame) { return frame.pscale > 0 ? std::exp2(std::round(std::log2(3.2 * frame.pscale))) : 1.0 / 32; }

void check(const std::filesystem::path& path, const sim::Frame& frame, double voxel) {
  const std::size_t n = frame.position.size();
  if (frame.velocity.size() != n || frame.id.size() != n || (!frame.body.empty() && frame.body.size() != n))
    throw std::logic_error("frame arrays differ in length");
  const float reach = static_cast<float>(voxel * (1 << 30));
  for (std::size_t i = 0; i < n; ++i)
    if (!frame.velocity[i].allFinite() || !frame.position[i].allFinite() || frame.position[i].cwiseAbs().maxCoeff() > reach)
      throw std::logic_error(path.string() + ": particle " + std::to_string(frame.id[i]) + " of frame " + std::to_string(frame.number) +
                             " has no finite position and velocity");
  for (const Scalar& scalar : kScalars) {
    const std::vector<float>& values = frame.*scalar.values;
    if (!values.empty() && values.size() != n) throw std::logic_error("frame arrays differ in length");
    if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); }))
      throw std::logic_error(path.string() + ": a particle of frame " + std::to_string(frame.number) + " has no finite " + scalar.name);
  }
}

/// A particle, the voxel it is in and its offset from the voxel's centre [voxels].
struct Placed {
  Coord voxel;
  std::uint32_t particle;
  Vec3f offset;
};

std::vector<Placed> place(const sim::Frame& frame, double voxel) {
  std::vector<Placed> placed(frame.position.size());
  tbb::parallel_for(std::size_t(0), placed.size(), [&](std::size_t i) {
    const base::Vec3 x = frame.position[i].cast<double>() / voxel;
    const Coord ijk = Coord::round(Vec3d(x[0], x[1], x[2]));
    placed[i] = {ijk, static_cast<std::uint32_t>(i), Vec3f(float(x[0] - ijk[0]), float(x[1] - ijk[1]), float(x[2] - ijk[2]))};
  });
  return placed;
}

/// Points by leaf, by voxel within it, then in the order of the frame.
std::map<Coord, std::vector<std::uint32_t>> by_leaf(const std::vector<Placed>& placed) {
  std::map<Coord, std::vector<std::uint32_t>> leaves;
  std::vector<std::uint32_t>* last = nullptr;
  Coord last_origin;
  for (std::uint32_t i = 0; i < placed.size(); ++i) {
    const Coord origin = placed[i].voxel & ~(Leaf::DIM - 1);
    if (!last || origin != last_origin) last = &leaves[origin], last_origin = origin;
    last->push_back(i);
  }
  return leaves;
}

openvdb::points::AttributeSet::Descriptor::Ptr descriptor(const sim::Frame& frame) {
  using Descriptor = openvdb::points::AttributeSet::Descriptor;
  Descriptor::Ptr d = Descriptor::create(VectorArray::attributeType());
  d = d->duplicateAppend("v", VectorArray::attributeType());
  d = d->duplicateAppend("id", IdArray::attributeType());
  d = d->duplicateAppend("pscale", ScaleArray::attributeType());
  if (!frame.body.empty()) d = d->duplicateAppend("body", BodyArray::attributeType());
  for (const Scalar& scalar : kScalars)
    if (!(frame.*scalar.values).empty()) d = d->duplicateAppend(scalar.name, ScaleArray::attributeType());
  const openvdb::TypedMetadata<float> scale(static_cast<float>(frame.pscale));
  d->setDefaultValue("pscale", scale);
  return d;
}

void fill(Leaf& leaf, std::vector<std::uint32_t>& members, const std::vector<Placed>& placed, const sim::Frame& frame,
          const openvdb::points::AttributeSet::Descriptor::Ptr& attributes) {
  std::stable_sort(members.begin(), members.end(), [&](std::uint32_t a, std::uint32_t b) {
    return Leaf::coordToOffset(placed[a].voxel) < Leaf::coordToOffset(placed[b].voxel);
  });
  const auto n = static_cast<openvdb::Index>(members.size());
  leaf.replaceAttributeSet(new openvdb::points::AttributeSet(attributes, n), /*allowMismatchingDescriptors=*/true);   // takes it over
  openvdb::points::AttributeWriteHandle<Vec3f> position(leaf.attributeArray("P")), velocity(leaf.attributeArray("v"));
  openvdb::points::AttributeWriteHandle<std::int64_t> id(leaf.attributeArray("id"));
  openvdb::points::AttributeWriteHandle<float> pscale(leaf.attributeArray("pscale"));
  if (!frame.body.empty()) {
    openvdb::points::AttributeWriteHandle<std::int32_t> body(leaf.attributeArray("body"));
    for (openvdb::Index k = 0; k < n; ++k) body.set(k, frame.body[placed[members[k]].particle]);
  }
  for (const Scalar& scalar : kScalars) {
    const std::vector<float>& values = frame.*scalar.values;
    if (values.empty()) continue;
    openvdb::points::AttributeWriteHandle<float> handle(leaf.attributeArray(scalar.name));
    for (openvdb::Index k = 0; k < n; ++k) handle.set(k, values[placed[members[k]].particle]);
  }
  std::vector<Leaf::ValueType> end(Leaf::NUM_VALUES, 0);
  for (openvdb::Index k = 0; k < n; ++k) {
    const Placed& p = placed[members[k]];
    const base::Vec3f& v = frame.velocity[p.particle];
    position.set(k, p.offset);
    velocity.set(k, Vec3f(v[0], v[1], v[2]));
    id.set(k, frame.id[p.particle]);
    end[Leaf::coordToOffset(p.voxel)] = k + 1;
  }
  pscale.collapse(static_cast<float>(frame.pscale));
  for (std::size_t v = 1; v < end.size(); ++v) end[v] = std::max<openvdb::Index32>(end[v], end[v - 1]);
  leaf.setOffsets(end);
}

PointDataGrid::Ptr to_grid(const sim::Frame& frame, double voxel) {
  auto grid = PointDataGrid::create();
  grid->setName("points");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  const std::vector<Placed> placed = place(frame, voxel);
  auto leaves = by_leaf(placed);
  const auto attributes = descriptor(frame);
  std::vector<std::pair<Leaf*, std::vector<std::uint32_t>*>> work;
  for (auto& [origin, members] : leaves) {
    auto leaf = std::make_unique<Leaf>(origin);
    work.emplace_back(leaf.get(), &members);
    grid->tree().addLeaf(leaf.release());
  }
  tbb::parallel_for(std::size_t(0), work.size(), [&](std::size_t i) { fill(*work[i].first, *work[i].second, placed, frame, attributes); });
  return grid;
}

struct Attributes {
  std::size_t position, velocity, id;
};

Attributes find_attributes(const std::filesystem::path& path, const Leaf& leaf) {
  const auto find = [&]<class Array>(const char* name, const Array*) {
    const std::size_t at = leaf.attributeSet().find(name);
    if (at == openvdb::points::AttributeSet::INVALID_POS) base::throw_input(path.string(), std::string("points have no attribute ") + name);
    if (!leaf.constAttributeArray(at).template isType<Array>())
      base::throw_input(path.string(), std::string("attribute ") + name + " has another type than expected");
    return at;
  };
  return {find("P", static_cast<VectorArray*>(nullptr)), find("v", static_cast<VectorArray*>(nullptr)), find("id", static_cast<IdArray*>(nullptr))};
}

/// Appends the points of a leaf.
void gather(const std::filesystem::path& path, const Leaf& leaf, const openvdb::math::Transform& transform, sim::Frame& frame) {
  const Attributes at = find_attributes(path, leaf);
  const openvdb::points::AttributeHandle<Vec3f> position(leaf.constAttributeArray(at.position)), velocity(leaf.constAttributeArray(at.velocity));
  const openvdb::points::AttributeHandle<std::int64_t> id(leaf.constAttributeArray(at.id));
  std::optional<openvdb::points::AttributeHandle<std::int32_t>> body;   // absent where all particles are of one body
  if (const std::size_t has = leaf.attributeSet().find("body"); has != openvdb::points::AttributeSet::INVALID_POS) {
    if (!leaf.constAttributeArray(has).isType<BodyArray>()) base::throw_input(path.string(), "attribute body has another type than expected");
    body.emplace(leaf.constAttributeArray(has));
  }
  for (const Scalar& scalar : kScalars) {
    const std::size_t has = leaf.attributeSet().find(scalar.name);
    if (has == openvdb::points::AttributeSet::INVALID_POS) continue;
    if (!leaf.constAttributeArray(has).isType<ScaleArray>())
      base::throw_input(path.string(), std::string("attribute ") + scalar.name + " has another type than expected");
    const openvdb::points::AttributeHandle<float> value(leaf.constAttributeArray(has));
    for (auto point = leaf.beginIndexOn(); point; ++point) (frame.*scalar.values).push_back(value.get(*point));
  }
  for (auto point = leaf.beginIndexOn(); point; ++point) {
    const Vec3d x = transform.indexToWorld(point.getCoord().asVec3d() + Vec3d(position.get(*point)));
    const Vec3f v = velocity.get(*point);
    frame.position.emplace_back(float(x[0]), float(x[1]), float(x[2]));
    frame.velocity.emplace_back(v[0], v[1], v[2]);
    frame.id.push_back(id.get(*point));
    if (body) frame.body.push_back(static_cast<std::uint16_t>(body->get(*point)));
  }
}

template <class T>
std::vector<T> permuted(const std::vector<T>& values, const std::vector<std::uint32_t>& order) {
  std::vector<T> result;
  result.reserve(values.size());
  for (const std::uint32_t i : order) result.push_back(values[i]);
  return result;
}

void sort_by_id(sim::Frame& frame) {
  std::vector<std::uint32_t> order(frame.id.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return frame.id[a] < frame.id[b]; });
  frame.position = permuted(frame.position, order);
  frame.velocity = permuted(frame.velocity, order);
  frame.id = permuted(frame.id, order);
  if (!frame.body.empty()) frame.body = permuted(frame.body, order);
  for (const Scalar& scalar : kScalars)
    if (std::vector<float>& values = frame.*scalar.values; !values.empty()) values = permuted(values, order);
}

template <class T>
T metadata(const std::filesystem::path& path, const openvdb::GridBase& grid, const char* name) {
  const auto value = grid.getMetadata<openvdb::TypedMetadata<T>>(name);
  if (!value) base::throw_input(path.string(), std::string("grid points has no metadata ") + name);
  return value->value();
}

}  // namespace

void write_points(const std::filesystem::path& path, const sim::Frame& frame, base::Ledger& ledger) {
  const auto timer = ledger.pass("write_points", static_cast<std::int64_t>(frame.position.size() * (2 * sizeof(base::Vec3f) + sizeof(std::int64_t))));
  const double voxel = point_voxel(frame);
  check(path, frame, voxel);
  PointDataGrid::Ptr grid = to_grid(frame, voxel);
  grid->setCreator("polypic");
  grid->insertMeta("frame", openvdb::Int64Metadata(frame.number));
  grid->insertMeta("time", openvdb::DoubleMetadata(frame.time));
  grid->insertMeta("pscale", openvdb::DoubleMetadata(frame.pscale));
  files::write(path, {grid}, {});
}

sim::Frame read_points(const std::filesystem::path& path) {
  const files::Contents contents = files::read(path);
  const PointDataGrid::Ptr grid = files::find<PointDataGrid>(contents, "points");
  if (!grid) base::throw_input(path.string(), "has no point grid named points");
  sim::Frame frame;
  frame.number = metadata<std::int64_t>(path, *grid, "frame");
  frame.time = metadata<double>(path, *grid, "time");
  frame.pscale = metadata<double>(path, *grid, "pscale");
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) gather(path, *leaf, grid->transform(), frame);
  const auto check_all_or_none = [&](std::size_t has, const char* name) {
    if (has != 0 && has != frame.id.size()) base::throw_input(path.string(), std::string("some particles have no ") + name);
  };
  check_all_or_none(frame.body.size(), "body");
  for (const Scalar& scalar : kScalars) check_all_or_none((frame.*scalar.values).size(), scalar.name);
  sort_by_id(frame);
  if (const auto twice = std::adjacent_find(frame.id.begin(), frame.id.end()); twice != frame.id.end())
    base::throw_input(path.string(), "two particles have id " + std::to_string(*twice));
  for (std::size_t i = 0; i < frame.id.size(); ++i)
    if (!frame.position[i].allFinite() || !frame.velocity[i].allFinite())
      base::throw_input(path.string(), "particle " + std::to_string(frame.id[i]) + " has no finite position and velocity");
  return frame;
}

}  // namespace surface
