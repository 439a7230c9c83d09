#pragma once
// Scalars on the voxels near a surface: blocks of 8^3 voxels (the layout of an OpenVDB leaf, z fastest), found through a dense
// directory of the box around the particles. All lengths in this folder are in voxels unless a name says otherwise; distances are negative inside.
#include <array>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "base/vec.h"

namespace surface::field {

using Index3 = Eigen::Vector3i;

constexpr int kBlock = 8, kVoxels = kBlock * kBlock * kBlock;
constexpr float kFar = 6;   // distances are kept up to this

/// What the directory says where no block is stored.
constexpr std::int32_t kAir = -1, kWater = -2;

/// World position = origin + voxel * index [m].
struct Lattice {
  base::Vec3 origin;
  double voxel;
};

/// Integer box of block coordinates, `size` entries from `lower`.
struct Directory {
  Index3 lower = Index3::Zero(), size = Index3::Zero();
  std::vector<std::int32_t> entry;   // kAir, kWater or the number of a block

  std::size_t slot(const Index3& b) const { return (std::size_t(b[0] - lower[0]) * size[1] + (b[1] - lower[1])) * size[2] + (b[2] - lower[2]); }
  bool contains(const Index3& b) const { return ((b - lower).array() >= 0).all() && ((b - lower).array() < size.array()).all(); }
  std::int32_t at(const Index3& b) const { return contains(b) ? entry[slot(b)] : kAir; }
};

struct Blocks {
  Directory directory;
  std::vector<Index3> coordinate;   // of each block, in blocks
  std::size_t count() const { return coordinate.size(); }
};

/// Index of voxel v of block b.
inline Index3 voxel_of(const Blocks& blocks, std::size_t b, std::size_t v) {
  const int n = static_cast<int>(v);
  return blocks.coordinate[b] * kBlock + Index3(n / (kBlock * kBlock), n / kBlock % kBlock, n % kBlock);
}

/// One float a voxel of each block.
using Field = std::vector<float>;

/// Eight voxels in z: what the loops work on, one vector register.
using Row = Eigen::Array<float, kBlock, 1>;
constexpr int kRows = kBlock * kBlock;
inline Eigen::Map<Row> row_at(float* first) { return Eigen::Map<Row>(first); }
inline Eigen::Map<const Row> row_at(const float* first) { return Eigen::Map<const Row>(first); }

/// A block with one layer of its neighbours' voxels: [x + 1][y + 1][z + 1].
constexpr int kPadded = kBlock + 2;
using Padded = std::array<std::array<std::array<float, kPadded>, kPadded>, kPadded>;

/// What a field holds where no block is stored.
struct Absent {
  float air, water;
};
constexpr Absent kDistance = {kFar, -kFar};

/// Copies block `b` and its surrounding layer.
void load(const Blocks&, const Field&, const Absent&, std::size_t b, Padded&);

/// (1 2 1) / 4 along each axis.
Field binomial(const Blocks&, const Field&, const Absent&);

/// Runs body(b) for every block, in parallel.
template <class Body>
void each_block(const Blocks& blocks, const Body& body) {
  base::parallel_chunks(blocks.count(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) body(b);
  });
}

}  // namespace surface::field
