#pragma once
// The particles of a frame as the level set sees them: in voxels, continued across the domain's walls and into colliders as their mirror images,
// sorted by block so that a voxel finds its neighbours.
#include <vector>

#include "sim/frame.h"
#include "surface/field/blocks.h"
#include "surface/surface.h"

namespace surface::field {

constexpr double kTouches = 1e-3;   // [voxels] a solid's face this near to a side of the domain is in it

/// Lengths that follow from the options, in voxels.
struct Scale {
  float spacing;     // edge of a cube with a particle's volume
  float search;      // a particle is seen from this far
  float radius;      // of a particle among many: the surface lies this far from their mean position
  float lone;        // of a particle on its own
  float gap;         // nothing is inside further than this from the nearest particle
  float limit;       // smoothing moves a body's surface no further
  float reach;       // blocks are stored this far around particles
  float furthest;    // the surface lies no further from particles
  float touch;       // what is dry and this near to a wall or solid lies against it
};

struct Cloud {
  base::Vec3f size;                        // of the domain, from 0
  Directory bins;                          // blocks with particles: their number, else kAir
  std::vector<Index3> block;               // coordinates of each block with particles
  std::vector<std::uint32_t> first;        // octant o of block b holds particles [first[8 b + o], first[8 b + o + 1])
  std::vector<base::Vec3f> position;       // [voxels] from the lattice's origin
  std::vector<base::Vec3f> velocity;       // [m/s]
  std::size_t count() const { return position.size(); }
};

/// Particles outside the domain by more than `scale.reach` are left out: what they carry is cut away. Throws std::logic_error
/// when a position or velocity is not finite.
Cloud make_cloud(const sim::Frame&, const Room&, const Lattice&, const Scale&);

/// Blocks within reach of a particle, without those deep inside, whose entry is kWater.
Blocks make_blocks(const Cloud&, const Scale&);

/// Calls body(p) for each particle that may lie within `distance` of block `coordinate`, in an order that depends on the cloud only.
template <class Body>
void each_near(const Cloud& cloud, const Index3& coordinate, float distance, const Body& body) {
  constexpr int kHalf = kBlock / 2;   // edge of an octant
  const int n = 1 + static_cast<int>(distance) / kBlock;
  const base::Vec3f low = (coordinate * kBlock).cast<float>().array() - distance,
                    high = (coordinate * kBlock).cast<float>().array() + kBlock - 1 + distance;
  for (int i = -n; i <= n; ++i)
    for (int j = -n; j <= n; ++j)
      for (int k = -n; k <= n; ++k) {
        const Index3 at = coordinate + Index3(i, j, k);
        const std::int32_t bin = cloud.bins.at(at);
        if (bin < 0) continue;
        for (int o = 0; o < 8; ++o) {
          const base::Vec3f corner = (at * kBlock + kHalf * Index3(o >> 2, (o >> 1) & 1, o & 1)).cast<float>();
          if ((corner.array() > high.array()).any() || ((corner.array() + kHalf) < low.array()).any()) continue;
          for (std::uint32_t p = cloud.first[8 * bin + o]; p < cloud.first[8 * bin + o + 1]; ++p)
            if ((cloud.position[p].array() >= low.array()).all() && (cloud.position[p].array() <= high.array()).all()) body(p);
        }
      }
}

}  // namespace surface::field
