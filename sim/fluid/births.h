#pragma once
// Who is born in sources: what has come in since the last time becomes particles.
#include <cstdint>
#include <vector>

#include "sim/fluid/sources.h"
#include "sim/transfer/particles.h"

namespace sim {

template <int D, class Real>
class Births {
 public:
  using Born = typename Sources<D>::Born;

  /// What sources have given.
  struct Given {
    std::vector<double> until;   // [s] of each source; below its start before it begins
    std::int64_t next_id;
    std::int64_t count = 0;      // since it was last cleared
    double energy = 0;           // [J] likewise, kinetic and of place

    void clear() { count = 0, energy = 0; }
  };

  /// `seeded` ids are taken. `down` is gravity's direction and size [m/s^2] where it has a floor (downhill).
  Births(const Sources<D>& sources, const Solids<D>& solids, const Options& options, const base::Vec3& down, std::size_t seeded)
      : sources_(sources), solids_(solids), options_(options), down_(down), given_{std::vector<double>(std::size_t(sources.count()), -1), std::int64_t(seeded)} {}

  Given& given() { return given_; }
  const Given& given() const { return given_; }
  /// What has come in by `time` [s] since the last time, in the order of its births. A source that has begun since then was full at once, but for
  /// cells that hold a particle now.
  std::vector<Born> until(double time, const Particles<D, Real>&);
  /// Gives them the next ids. Who would be in a collider, or is out of an open side at once, is not born.
  void bear(const std::vector<Born>&, Particles<D, Real>&);

 private:
  const Sources<D>& sources_;
  const Solids<D>& solids_;
  const Options& options_;
  base::Vec3 down_;
  Given given_;
};

}  // namespace sim
