#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "surface/field/level_set.h"
#include "surface/files/names.h"
#include "surface/files/vdb_file.h"
#include "surface/surface.h"

namespace surface {
namespace {

constexpr float kBand = 3;             // [voxels] half-width of the narrow band that is written
constexpr float kBelow = 0.5f;         // [voxels] the cut lies this far below the floor: no light between water and ground
constexpr float kLargestHalf = 65504;  // as which what is faster [m/s] is written, where a half would be infinite

openvdb::Vec3d to_vdb(const base::Vec3& v) { return {v[0], v[1], v[2]}; }

field::Scale make_scale(const sim::Frame& frame, const Options& options, const Room& room, double voxel) {
  const double edge = frame.pscale > 0 ? frame.pscale * std::cbrt(4 * M_PI / 3) : room.cell / 2;   // [m] of a cube with a particle's volume
  field::Scale s;
  s.spacing = float(edge / voxel);
  s.search = std::max(4 * s.spacing, 2.0f);
  // Far from the ends of a half-space of particles |x - mean| = 0.246 search at its boundary, for weights (1 - s^2)^3.
  s.radius = options.radius ? float(*options.radius / voxel) : 0.246f * s.search;
  s.search = std::max(s.search, s.radius + 2 * s.spacing);   // particles are seen from the surface that lies a radius away
  s.lone = std::max({0.75f * s.spacing, 1.25f, s.radius});
  s.gap = std::max(1.5f * s.spacing, s.lone);
  s.limit = 0.35f;
  s.reach = field::kFar + s.lone;
  s.furthest = s.lone + s.limit;
  s.touch = 0.75f * s.spacing;   // the first layer of particles
  return s;
}

openvdb::math::Transform::Ptr make_transform(const field::Lattice& lattice) {
  auto transform = openvdb::math::Transform::createLinearTransform(lattice.voxel);
  transform->postTranslate(to_vdb(lattice.origin));
  return transform;
}

openvdb::Coord first_voxel(const field::Index3& block) { return {block[0] * field::kBlock, block[1] * field::kBlock, block[2] * field::kBlock}; }

/// What surfacing makes of particles.
struct Fields {
  field::Blocks blocks;
  field::Field distance;                   // [voxels]
  std::array<field::Field, 3> velocity;    // [m/s]
};

/// The same, as it is written.
struct Grids {
  openvdb::FloatGrid::Ptr level;
  openvdb::Vec3SGrid::Ptr velocity;
};

/// Distances in all; `fields` arrays of them.
std::int64_t bytes_of(const field::Field& distance, std::int64_t fields) { return fields * std::int64_t(distance.size() * sizeof(float)); }

/// A surface before it is cut to the domain, and what its velocity is made of.
struct Made {
  Fields fields;
  field::Scale scale;
  field::Cloud cloud;
};

Made surface_of(const sim::Frame& frame, const Options& options, const Room& room, const field::Lattice& lattice, base::Ledger& ledger) {
  Made made = {{}, make_scale(frame, options, room, lattice.voxel), {}};
  field::Blocks& blocks = made.fields.blocks;
  field::Field& distance = made.fields.distance;
  field::Field limit;
  {
    auto timer = ledger.pass("rasterize", std::int64_t(frame.position.size() * 2 * sizeof(base::Vec3f)));
    made.cloud = field::make_cloud(frame, room, lattice, made.scale);
    blocks = field::make_blocks(made.cloud, made.scale);
    field::Spheres spheres = field::rasterize(made.cloud, field::company(made.cloud, blocks, made.scale), blocks, made.scale);
    distance = std::move(spheres.surface), limit = std::move(spheres.limit);
    timer.count(bytes_of(distance, 2));
  }
  {
    const auto timer = ledger.pass("rebuild", bytes_of(distance, 2));
    distance = field::distance_from_crossings(blocks, distance);
  }
  if (options.smooth > 0) {
    const auto timer = ledger.pass("smooth", bytes_of(distance, 2 * 2 * options.smooth + 5));   // read and written by each pass, twice; clamped
    distance = field::smooth(blocks, distance, static_cast<int>(options.smooth), made.scale.search, limit);
  }
  const auto timer = ledger.pass("rebuild", bytes_of(distance, 2));
  distance = field::distance_from_slope(blocks, distance);
  return made;
}

bool is_liquid(const Room& room, std::size_t body) { return body >= room.dry.size() || !room.dry[body]; }

/// Liquids among bodies with surfaces of their own go on to the others. Returns how far each is from those that cover it where they overlap.
std::vector<field::Field> wet_bodies(const Room& room, const field::Lattice& lattice, std::vector<Made>& bodies, base::Ledger& ledger) {
  std::vector<field::Field> wetted(bodies.size()), covers(bodies.size());
  const auto those = [&](const auto& which) {
    std::vector<field::Neighbour> found;
    for (std::size_t other = 0; other < bodies.size(); ++other)
      if (which(other)) found.push_back({&bodies[other].fields.blocks, &bodies[other].fields.distance, is_liquid(room, other)});
    return found;
  };
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    if (!is_liquid(room, body)) continue;
    const Fields& own = bodies[body].fields;
    const auto timer = ledger.pass("wet", bytes_of(own.distance, std::int64_t(bodies.size()) + 2));
    wetted[body] = field::wet(own.blocks, own.distance, those([&](std::size_t other) { return other != body; }), room, lattice);
    bodies[body].scale.furthest = std::max(bodies[body].scale.furthest, field::kWetReach);
  }
  for (std::size_t body = 0; body < bodies.size(); ++body)
    if (is_liquid(room, body)) bodies[body].fields.distance = std::move(wetted[body]);
  for (std::size_t body = 0; body < bodies.size(); ++body)
    if (is_liquid(room, body))
      covers[body] = field::nearest_of(bodies[body].fields.blocks, those([&](std::size_t other) { return !is_liquid(room, other) || other > body; }), 0);
  return covers;
}

/// Cuts the surface, half a voxel deeper in `others`, and gives it its velocity.
Fields finished(Made made, const field::Field* others, const Room& room, const field::Lattice& lattice, base::Ledger& ledger) {
  Fields& fields = made.fields;
  {
    const auto timer = ledger.pass("rebuild", bytes_of(fields.distance, 2));
    field::cut(fields.blocks, room, lattice, kBelow, others, fields.distance);
  }
  const auto timer = ledger.pass("velocity", bytes_of(fields.distance, 4) + std::int64_t(made.cloud.count() * 2 * sizeof(base::Vec3f)));
  fields.velocity = field::velocity(made.cloud, fields.blocks, fields.distance, kBand, made.scale);
  return std::move(fields);
}

Grids new_grids(const field::Lattice& lattice) {
  Grids grids{openvdb::FloatGrid::create(kBand * float(lattice.voxel)), openvdb::Vec3SGrid::create()};
  grids.level->setGridClass(openvdb::GRID_LEVEL_SET);
  grids.velocity->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  return grids;
}

Grids grids_of(const Fields& fields, const field::Lattice& lattice) {
  Grids grids = new_grids(lattice);
  const float background = grids.level->background();
  for (std::size_t b = 0; b < fields.blocks.count(); ++b) {
    const float* d = fields.distance.data() + b * field::kVoxels;
    if (std::none_of(d, d + field::kVoxels, [](float x) { return std::fabs(x) < kBand; })) continue;
    auto* level = grids.level->tree().touchLeaf(first_voxel(fields.blocks.coordinate[b]));
    auto* velocity = grids.velocity->tree().touchLeaf(first_voxel(fields.blocks.coordinate[b]));
    for (openvdb::Index v = 0; v < field::kVoxels; ++v) {
      const std::size_t at = b * field::kVoxels + v;
      if (std::fabs(d[v]) < kBand) {
        level->setValueOn(v, d[v] * float(lattice.voxel));
        openvdb::Vec3f u;
        for (int a = 0; a < 3; ++a) u[a] = std::clamp(fields.velocity[std::size_t(a)][at], -kLargestHalf, kLargestHalf);
        velocity->setValueOn(v, u);
      } else {
        level->setValueOff(v, std::copysign(background, d[v]));
      }
    }
  }
  openvdb::tools::signedFloodFill(grids.level->tree());
  return grids;
}

/// Around all bodies: the least of their distances, and the velocity of the body it is of.
Grids united(const std::vector<Grids>& bodies, const field::Lattice& lattice) {
  Grids all = new_grids(lattice);
  const float background = all.level->background();
  std::set<openvdb::Coord> places;
  for (const Grids& body : bodies)
    for (auto leaf = body.level->tree().cbeginLeaf(); leaf; ++leaf) places.insert(leaf->origin());
  for (const openvdb::Coord& place : places) {
    std::array<float, field::kVoxels> least;
    std::array<const Grids*, field::kVoxels> nearest = {};
    least.fill(background);
    for (const Grids& body : bodies) {
      const auto* leaf = body.level->tree().probeConstLeaf(place);
      const float elsewhere = leaf ? 0 : body.level->tree().getValue(place);   // one value, where no surface of this body is near
      for (openvdb::Index v = 0; v < field::kVoxels; ++v)
        if (const float d = leaf ? leaf->getValue(v) : elsewhere; d < least[v]) least[v] = d, nearest[v] = &body;
    }
    if (std::none_of(least.begin(), least.end(), [&](float d) { return std::fabs(d) < background; })) continue;
    auto* level = all.level->tree().touchLeaf(place);
    auto* velocity = all.velocity->tree().touchLeaf(place);
    for (openvdb::Index v = 0; v < field::kVoxels; ++v)
      if (std::fabs(least[v]) < background) {
        level->setValueOn(v, least[v]);
        velocity->setValueOn(v, nearest[v]->velocity->tree().probeConstLeaf(place)->getValue(v));
      } else {
        level->setValueOff(v, least[v]);
      }
  }
  openvdb::tools::signedFloodFill(all.level->tree());
  return all;
}

/// The particles of one body.
sim::Frame part_of(const sim::Frame& frame, std::size_t body) {
  sim::Frame part;
  part.number = frame.number, part.time = frame.time, part.pscale = frame.pscale;
  for (std::size_t i = 0; i < frame.position.size(); ++i) {
    if ((frame.body.empty() ? 0 : frame.body[i]) != body) continue;
    part.position.push_back(frame.position[i]);
    part.velocity.push_back(frame.velocity[i]);
    part.id.push_back(frame.id[i]);
    if (!frame.body.empty()) part.body.push_back(frame.body[i]);
  }
  return part;
}

}  // namespace

void write_surface(const std::filesystem::path& path, const sim::Frame& frame, const Options& options, const Room& room, base::Ledger& ledger) {
  const field::Lattice lattice = {room.domain.lower, options.voxel.value_or(room.cell / 2)};
  std::vector<Fields> fields;
  if (room.bodies.empty()) fields.push_back(finished(surface_of(frame, options, room, lattice, ledger), nullptr, room, lattice, ledger));
  std::vector<Made> made;   // of bodies: those that wet no others are finished at once
  bool wets = false;
  for (std::size_t body = 0; body < room.bodies.size() && !wets; ++body) wets = is_liquid(room, body);
  for (std::size_t body = 0; body < room.bodies.size(); ++body) {
    Made one = surface_of(part_of(frame, body), options, room, lattice, ledger);
    if (wets) made.push_back(std::move(one));
    else fields.push_back(finished(std::move(one), nullptr, room, lattice, ledger));
  }
  const std::vector<field::Field> covers = wets ? wet_bodies(room, lattice, made, ledger) : std::vector<field::Field>();
  for (std::size_t body = 0; body < made.size(); ++body)
    fields.push_back(finished(std::move(made[body]), covers[body].empty() ? nullptr : &covers[body], room, lattice, ledger));

  auto timer = ledger.pass("write_surface");
  openvdb::GridCPtrVec grids;
  const auto add = [&](const openvdb::GridBase::Ptr& grid, const std::string& name) {
    grid->setName(name);
    grid->setTransform(make_transform(lattice));
    grid->setSaveFloatAsHalf(true);
    grid->setCreator("polypic");
    grid->insertMeta("frame", openvdb::Int64Metadata(frame.number));
    grid->insertMeta("time", openvdb::DoubleMetadata(frame.time));
    grid->insertMeta("cut_lower", openvdb::Vec3DMetadata(to_vdb(room.domain.lower - base::Vec3(0, 0, kBelow * lattice.voxel))));
    grid->insertMeta("cut_upper", openvdb::Vec3DMetadata(to_vdb(room.domain.upper)));
    grids.push_back(grid);
  };
  std::vector<Grids> parts;
  for (const Fields& body : fields) {
    parts.push_back(grids_of(body, lattice));
    timer.count(bytes_of(body.distance, 4));
  }
  const Grids all = room.bodies.empty() ? parts.front() : united(parts, lattice);
  add(all.level, files::kSurface);
  add(all.velocity, options.vel_name);
  for (std::size_t body = 0; body < room.bodies.size(); ++body) {
    add(parts[body].level, files::name_of_body(files::kSurface, room.bodies[body]));
    add(parts[body].velocity, files::name_of_body(options.vel_name, room.bodies[body]));
  }
  files::write(path, grids, {});
  timer.count(std::int64_t(std::filesystem::file_size(path)));
}

}  // namespace surface
