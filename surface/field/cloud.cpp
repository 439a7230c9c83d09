#include "surface/field/cloud.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/error.h"

namespace surface::field {
namespace {

using base::Vec3;
using base::Vec3f;

constexpr std::size_t kLargestDirectory = std::size_t(1) << 28;   // entries

Index3 block_of(const Vec3f& x) { return Index3(int(std::floor(x[0] / kBlock)), int(std::floor(x[1] / kBlock)), int(std::floor(x[2] / kBlock))); }

int octant_of(const Vec3f& x, const Index3& block) {
  const auto half = [&](int a) { return x[a] >= float(block[a] * kBlock + kBlock / 2) ? 1 : 0; };
  return 4 * half(0) + 2 * half(1) + half(2);
}

/// All blocks that a particle or its reach may touch.
Directory make_directory(const Vec3& size, float reach) {
  Directory d;
  const Vec3f margin = Vec3f::Constant(reach);
  d.lower = block_of(-2 * margin) - Index3::Ones();
  d.size = block_of(size.cast<float>() + 2 * margin) + 2 * Index3::Ones() - d.lower;
  const double entries = d.size.cast<double>().prod();
  if (entries > double(kLargestDirectory)) {
    base::Complaint c;
    c.key = "surface.voxel";
    c.allowed = "is too small for the domain: more than 137 billion voxels";
    throw base::Error(c);
  }
  d.entry.assign(static_cast<std::size_t>(entries), kAir);
  return d;
}

/// Particles and their mirror images, in the frame's order.
struct Copies {
  std::vector<Vec3f> position;
  std::vector<std::uint32_t> source;
};

/// x [voxels] and its images beyond the walls it is near.
void add_wall_images(const Vec3& x, std::uint32_t source, const Vec3& size, float reach, Copies& copies) {
  if ((x.array() < -double(reach)).any() || (x.array() > size.array() + double(reach)).any()) return;
  double image[3][3];   // per axis: itself, beyond the lower wall, beyond the upper wall
  bool has[3][3];
  for (int a = 0; a < 3; ++a) {
    image[a][0] = x[a], image[a][1] = -x[a], image[a][2] = 2 * size[a] - x[a];
    has[a][0] = true, has[a][1] = x[a] < reach, has[a][2] = size[a] - x[a] < reach;
  }
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      for (int c = 0; c < 3; ++c)
        if (has[0][a] && has[1][b] && has[2][c]) {
          copies.position.push_back(Vec3(image[0][a], image[1][b], image[2][c]).cast<float>());
          copies.source.push_back(source);
        }
}

/// A particle's place [m] and its images in the solids that it is near: behind the nearest point of their surface, as deep as it is far.
/// An image that would come out on the other side of a thin solid is left out, and so is one beside an edge that is less than `gap` behind another
/// face, 0 for none: a surface around it would stand out there.
void place_and_images(const Vec3& x, const std::vector<sim::Shape>& solids, double reach, double gap, std::vector<Vec3>& places) {
  places.assign(1, x);
  for (const sim::Shape& solid : solids) {
    Vec3 normal;
    const double distance = solid.distance(x, &normal);
    if (distance <= 0 || distance >= reach) continue;
    const Vec3 image = x - 2 * distance * normal;
    const double depth = -solid.distance(image);
    if (depth > 0 && depth > 0.999 * std::min(distance, gap)) places.push_back(image);
  }
}

Copies with_mirror_images(const sim::Frame& frame, const Room& room, const Vec3& size, const Lattice& lattice, const Scale& scale) {
  Copies copies;
  std::vector<Vec3> places;
  copies.position.reserve(frame.position.size() * 5 / 4);
  copies.source.reserve(frame.position.size() * 5 / 4);
  for (std::size_t i = 0; i < frame.position.size(); ++i) {
    if (!frame.position[i].allFinite() || !frame.velocity[i].allFinite())
      throw std::logic_error("particle " + std::to_string(frame.id[i]) + " of frame " + std::to_string(frame.number) + " is not finite");
    place_and_images(frame.position[i].cast<double>(), room.solids, scale.reach * lattice.voxel, room.is_liquid ? 0 : scale.gap * lattice.voxel,
                     places);
    for (const Vec3& place : places) add_wall_images((place - lattice.origin) / lattice.voxel, std::uint32_t(i), size, scale.reach, copies);
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

/// One bit for each of 4^3, 2^3 or 1 parts of a block: whether a particle is in it. Full blocks have all bits.
std::vector<bool> full_blocks(const Cloud& cloud, float spacing) {
  const int shift = spacing <= 1.01f ? 1 : spacing <= 2.01f ? 2 : 3;   // a part is two spacings wide or more
  const int parts = kBlock >> shift;
  const std::uint64_t all = parts == 4 ? ~std::uint64_t(0) : (std::uint64_t(1) << (parts * parts * parts)) - 1;
  std::vector<bool> full(cloud.block.size(), false);
  if (spacing > 4) return full;
  for (std::size_t b = 0; b < full.size(); ++b) {
    std::uint64_t seen = 0;
    for (std::uint32_t p = cloud.first[8 * b]; p < cloud.first[8 * b + 8]; ++p) {
      const Index3 local =
          ((cloud.position[p] - (cloud.block[b] * kBlock).cast<float>()).array().floor().cast<int>().max(0).min(kBlock - 1)).matrix();
      seen |= std::uint64_t(1) << (((local[0] >> shift) * parts + (local[1] >> shift)) * parts + (local[2] >> shift));
    }
    full[b] = seen == all;
  }
  return full;
}

/// Inside, and far enough from the surface and the walls that no pass would change it.
bool deep(const Cloud& cloud, const std::vector<bool>& full, const Index3& block) {
  const Vec3f low = (block * kBlock).cast<float>(), high = low.array() + kBlock - 1;
  if ((low.array() < kFar).any() || (high.array() > cloud.size.array() - kFar).any()) return false;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k) {
        const std::int32_t bin = cloud.bins.at(block + Index3(i, j, k));
        if (bin < 0 || !full[std::size_t(bin)]) return false;
      }
  return true;
}

}  // namespace

Cloud make_cloud(const sim::Frame& frame, const Room& room, const Lattice& lattice, const Scale& scale) {
  const Vec3 size = room.domain.size() / lattice.voxel;
  const Copies copies = with_mirror_images(frame, room, size, lattice, scale);
  Cloud cloud;
  cloud.size = size.cast<float>();
  cloud.bins = make_directory(size, scale.reach);
  const std::vector<std::uint32_t> order = sort(copies, cloud);
  cloud.position.reserve(order.size());
  cloud.velocity.reserve(order.size());
  for (const std::uint32_t i : order) {
    cloud.position.push_back(copies.position[i]);
    cloud.velocity.push_back(frame.velocity[copies.source[i]]);
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
    const Index3 from = block_of(low.array() - scale.reach), to = block_of(high.array() + scale.reach);
    for (int i = from[0]; i <= to[0]; ++i)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int k = from[2]; k <= to[2]; ++k) entry[blocks.directory.slot({i, j, k})] = kWanted;
  }
  const std::vector<bool> full = full_blocks(cloud, scale.spacing);
  for (const Index3& b : cloud.block)
    if (deep(cloud, full, b)) entry[blocks.directory.slot(b)] = kWater;
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
