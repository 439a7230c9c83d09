#include "surface/field/cloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "base/error.h"
#include "surface/field/footprint.h"

namespace surface::field {
namespace {

using base::Vec3;
using base::Vec3f;

constexpr std::size_t kLargestDirectory = std::size_t(1) << 28;   // entries
constexpr double kFurthest = 1 << 30;   // [voxels] from the lattice's origin; OpenVDB's coordinates end at twice that

Index3 block_of(const Vec3& x) { return (x / kBlock).array().floor().cast<int>(); }
Index3 block_of(const Vec3f& x) { return block_of(Vec3(x.cast<double>())); }

int octant_of(const Vec3f& x, const Index3& block) {
  const auto half = [&](int a) { return x[a] >= float(block[a] * kBlock + kBlock / 2) ? 1 : 0; };
  return 4 * half(0) + 2 * half(1) + half(2);
}

/// Particles and their mirror images, in the frame's order.
struct Copies {
  std::vector<Vec3f> position;
  std::vector<Vec3f> velocity;
};

/// All blocks that a copy or its reach may touch.
Directory make_directory(const Copies& copies, float reach) {
  Directory d;
  if (copies.position.empty()) return d;
  Vec3f low = copies.position.front(), high = low;
  for (const Vec3f& x : copies.position) low = low.cwiseMin(x), high = high.cwiseMax(x);
  const Vec3 from = low.cast<double>().array() - reach, to = high.cast<double>().array() + reach;
  if (((to - from) / kBlock).array().ceil().prod() > double(kLargestDirectory) || from.cwiseAbs().cwiseMax(to.cwiseAbs()).maxCoeff() > kFurthest) {
    base::Complaint c;
    c.key = "surface.voxel";
    c.allowed = "is too small for a surface that reaches so far: more than 137 billion voxels";
    throw base::Error(c);
  }
  d.lower = block_of(from);
  d.size = block_of(to) + Index3::Ones() - d.lower;
  d.entry.assign(d.size.cast<std::size_t>().prod(), kAir);
  return d;
}

/// A particle or one of its images.
struct Place {
  Vec3 position, velocity;
};

/// `at` [voxels, m/s], unless it is further than `reach` outside the domain, and its images: beyond walls that are nearer than `near`, and other sides
/// that are nearer than `reach`. Behind a wall what leads into it is turned round, so that at the wall the mean is along it. Beyond a periodic side lie
/// copies of what is at the other one.
void add_images(const Place& at, const Room& room, const Vec3& size, float reach, float near, Copies& copies) {
  const Vec3& x = at.position;
  if ((x.array() < -double(reach)).any() || (x.array() > size.array() + double(reach)).any()) return;
  double image[3][3], velocity[3][3];   // per axis: itself, beyond the lower side, beyond the upper side
  bool has[3][3];
  for (int a = 0; a < 3; ++a) {
    image[a][0] = x[a], image[a][1] = -x[a], image[a][2] = 2 * size[a] - x[a];
    has[a][0] = true;
    velocity[a][0] = at.velocity[a];
    if (room.periodic[std::size_t(a)]) {
      image[a][1] = x[a] - size[a], image[a][2] = x[a] + size[a];
      has[a][1] = image[a][1] > -double(reach), has[a][2] = image[a][2] < size[a] + double(reach);
      velocity[a][1] = velocity[a][2] = at.velocity[a];
      continue;
    }
    for (int side = 0; side < 2; ++side) {
      const bool wall = room.walls[std::size_t(a)][std::size_t(side)];
      has[a][1 + side] = (side == 0 ? x[a] : size[a] - x[a]) < (wall ? near : reach);
      velocity[a][1 + side] = wall ? -at.velocity[a] : at.velocity[a];
    }
  }
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      for (int c = 0; c < 3; ++c)
        if (has[0][a] && has[1][b] && has[2][c]) {
          copies.position.push_back(Vec3(image[0][a], image[1][b], image[2][c]).cast<float>());
          copies.velocity.push_back(Vec3(velocity[0][a], velocity[1][b], velocity[2][c]).cast<float>());
        }
}

/// A box with a face in a side of the domain goes on behind it: that face is none of those that liquid could come out at.
Solid continued(Solid solid, const base::Box& domain, double voxel) {
  if (!solid.shape.box || solid.shape.turn) return solid;
  base::Box& box = *solid.shape.box;
  for (int a = 0; a < 3; ++a) {
    if (std::fabs(box.lower[a] - domain.lower[a]) < kTouches * voxel) box.lower[a] -= domain.size()[a];
    if (std::fabs(box.upper[a] - domain.upper[a]) < kTouches * voxel) box.upper[a] += domain.size()[a];
  }
  return solid;
}

/// A particle [m, m/s] and its images in the solids that it is near: behind the nearest point of their surface, as deep as it is far, moving against it
/// as the solid sees it. What is nearer to another face of the solid is left out: of a thin one the half behind its middle, or a surface would
/// stand out on the dry side.
void place_and_images(const Place& at, const std::vector<Solid>& solids, double reach, std::vector<Place>& places) {
  places.assign(1, at);
  for (const Solid& solid : solids) {
    Vec3 normal;
    const double distance = solid.shape.distance(at.position, &normal);
    if (distance <= 0 || distance >= reach) continue;
    const Vec3 image = at.position - 2 * distance * normal;
    const double as_deep = solid.shape.mesh ? 0.95 : 0.999;   // a mesh's distances are not exact
    if (-solid.shape.distance(image) > as_deep * distance) places.push_back({image, at.velocity - 2 * normal.dot(at.velocity - solid.motion.at(at.position)) * normal});
  }
}

Copies with_mirror_images(const sim::Frame& frame, const Room& room, const Vec3& size, const Lattice& lattice, const Scale& scale) {
  Copies copies;
  std::vector<Place> places;
  std::vector<Solid> solids;
  for (const Solid& solid : room.solids) solids.push_back(continued(solid, room.domain, lattice.voxel));
  copies.position.reserve(frame.position.size() * 5 / 4);
  copies.velocity.reserve(frame.position.size() * 5 / 4);
  const auto is_dry = [&](std::size_t i) {
    const std::size_t body = frame.body.empty() ? 0 : frame.body[i];
    return body < room.dry.size() && room.dry[body];
  };
  for (std::size_t i = 0; i < frame.position.size(); ++i) {
    if (!frame.position[i].allFinite() || !frame.velocity[i].allFinite())
      throw std::logic_error("particle " + std::to_string(frame.id[i]) + " of frame " + std::to_string(frame.number) + " is not finite");
    const float near = is_dry(i) ? scale.touch : scale.reach;
    place_and_images({frame.position[i].cast<double>(), frame.velocity[i].cast<double>()}, solids, near * lattice.voxel, places);
    for (const Place& place : places)
      add_images({(place.position - lattice.origin) / lattice.voxel, place.velocity}, room, size, scale.reach, near, copies);
  }
  return copies;
}

/// Fills bins, block, first; returns the order of the copies: by block and octant, else as they were.
std::vector<std::uint32_t> sort(const Copies& copies, Cloud& cloud) {
  const std::size_t n = copies.position.size();
  std::vector<std::uint32_t> key(n), order(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Index3 b = block_of(copies.position[i]);
    std::int32_t& entry = cloud.bins.entry[cloud.bins.slot(b)];
    if (entry < 0) {
      entry = static_cast<std::int32_t>(cloud.block.size());
      cloud.block.push_back(b);
    }
    key[i] = 8 * static_cast<std::uint32_t>(entry) + static_cast<std::uint32_t>(octant_of(copies.position[i], b));
  }
  cloud.first.assign(8 * cloud.block.size() + 1, 0);
  for (const std::uint32_t k : key) ++cloud.first[k + 1];
  for (std::size_t k = 1; k < cloud.first.size(); ++k) cloud.first[k] += cloud.first[k - 1];
  std::vector<std::uint32_t> next(cloud.first.begin(), cloud.first.end() - 1);
  for (std::uint32_t i = 0; i < n; ++i) order[next[key[i]]++] = i;
  return order;
}

/// Calls body(bin) for the blocks up to n from `block`, itself included.
template <class Body>
void each_beside(const Cloud& cloud, const Index3& block, int n, const Body& body) {
  for (int i = -n; i <= n; ++i)
    for (int j = -n; j <= n; ++j)
      for (int k = -n; k <= n; ++k) body(cloud.bins.at(block + Index3(i, j, k)));
}

/// Blocks that lie farther than kFar from the walls and have particles in all blocks around them.
std::vector<bool> surrounded_blocks(const Cloud& cloud) {
  std::vector<bool> surrounded(cloud.block.size());
  for (std::size_t b = 0; b < surrounded.size(); ++b) {
    const Vec3f low = (cloud.block[b] * kBlock).cast<float>(), high = low.array() + kBlock - 1;
    bool all = (low.array() >= kFar).all() && (high.array() <= cloud.size.array() - kFar).all();
    if (all) each_beside(cloud, cloud.block[b], 1, [&](std::int32_t bin) { all &= bin >= 0; });
    surrounded[b] = all;
  }
  return surrounded;
}

/// Octants up to this far from a block must have no air for the block to be deep.
int octants_without_air(float gap) { return static_cast<int>(std::ceil((kFar + gap) * 2 / kBlock)); }

/// A bit for each octant of the blocks with particles: whether all of its voxels have a particle within `gap`. Asked only beside blocks that are `surrounded`.
std::vector<std::uint8_t> covered_octants(const Cloud& cloud, const std::vector<bool>& surrounded, float gap) {
  std::vector<std::uint8_t> covered(cloud.block.size(), 0);
  base::parallel_chunks(covered.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      bool asked = false;
      each_beside(cloud, cloud.block[b], (octants_without_air(gap) + 1) / 2, [&](std::int32_t bin) { asked |= bin >= 0 && surrounded[std::size_t(bin)]; });
      if (!asked) continue;
      std::array<Row, kRows> nearest;   // squared distance
      nearest.fill(Row::Constant(1e6f));
      const Vec3f origin = (cloud.block[b] * kBlock).cast<float>();
      each_near(cloud, cloud.block[b], gap, [&](std::uint32_t p) {
        each_row_within(cloud.position[p] - origin, gap, [&](std::size_t row, float xy2, const Row& z2) { nearest[row] = nearest[row].min(z2 + xy2); });
      });
      unsigned open = 0;
      for (std::size_t r = 0; r < kRows; ++r) {
        const unsigned octant = 4 * (r / kBlock >= kBlock / 2) + 2 * (r % kBlock >= kBlock / 2);
        for (unsigned half = 0; half < 2; ++half)
          if ((nearest[r].segment<kBlock / 2>(half * kBlock / 2) > gap * gap).any()) open |= 1u << (octant + half);
      }
      covered[b] = static_cast<std::uint8_t>(~open);
    }
  });
  return covered;
}

/// Whether a block that is surrounded lies so far inside that no pass would change it: what is air within kFar has a voxel within kFar + gap that is further
/// than `gap` from every particle.
bool deep(const Cloud& cloud, const std::vector<std::uint8_t>& covered, float gap, const Index3& block) {
  const int n = octants_without_air(gap);
  for (int i = -n; i <= 1 + n; ++i)
    for (int j = -n; j <= 1 + n; ++j)
      for (int k = -n; k <= 1 + n; ++k) {
        const Index3 octant = 2 * block + Index3(i, j, k);
        const std::int32_t bin = cloud.bins.at(Index3(octant[0] >> 1, octant[1] >> 1, octant[2] >> 1));
        if (bin < 0 || !(covered[std::size_t(bin)] >> (4 * (octant[0] & 1) + 2 * (octant[1] & 1) + (octant[2] & 1)) & 1)) return false;
      }
  return true;
}

}  // namespace

Cloud make_cloud(const sim::Frame& frame, const Room& room, const Lattice& lattice, const Scale& scale) {
  const Vec3 size = room.domain.size() / lattice.voxel;
  const Copies copies = with_mirror_images(frame, room, size, lattice, scale);
  Cloud cloud;
  cloud.size = size.cast<float>();
  cloud.bins = make_directory(copies, scale.reach);
  const std::vector<std::uint32_t> order = sort(copies, cloud);
  cloud.position.reserve(order.size());
  cloud.velocity.reserve(order.size());
  for (const std::uint32_t i : order) {
    cloud.position.push_back(copies.position[i]);
    cloud.velocity.push_back(copies.velocity[i]);
  }
  return cloud;
}

Blocks make_blocks(const Cloud& cloud, const Scale& scale) {
  Blocks blocks;
  blocks.directory = cloud.bins;
  std::vector<std::int32_t>& entry = blocks.directory.entry;
  std::fill(entry.begin(), entry.end(), kAir);
  constexpr std::int32_t kWanted = 0;
  for (std::size_t b = 0; b < cloud.block.size(); ++b) {
    Vec3f low = cloud.position[cloud.first[8 * b]], high = low;
    for (std::uint32_t p = cloud.first[8 * b]; p < cloud.first[8 * b + 8]; ++p)
      low = low.cwiseMin(cloud.position[p]), high = high.cwiseMax(cloud.position[p]);
    const Index3 from = block_of(Vec3(low.cast<double>().array() - scale.reach)), to = block_of(Vec3(high.cast<double>().array() + scale.reach));
    for (int i = from[0]; i <= to[0]; ++i)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int k = from[2]; k <= to[2]; ++k) entry[blocks.directory.slot({i, j, k})] = kWanted;
  }
  const std::vector<bool> surrounded = surrounded_blocks(cloud);
  const std::vector<std::uint8_t> covered = covered_octants(cloud, surrounded, scale.gap);
  base::parallel_chunks(cloud.block.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      if (surrounded[b] && deep(cloud, covered, scale.gap, cloud.block[b])) entry[blocks.directory.slot(cloud.block[b])] = kWater;
  });
  for (int i = 0; i < blocks.directory.size[0]; ++i)
    for (int j = 0; j < blocks.directory.size[1]; ++j)
      for (int k = 0; k < blocks.directory.size[2]; ++k) {
        const Index3 b = blocks.directory.lower + Index3(i, j, k);
        std::int32_t& e = entry[blocks.directory.slot(b)];
        if (e != kWanted) continue;
        e = static_cast<std::int32_t>(blocks.count());
        blocks.coordinate.push_back(b);
      }
  return blocks;
}

}  // namespace surface::field
