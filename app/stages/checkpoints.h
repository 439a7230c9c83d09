#pragma once
// The checkpoints of a run's simulation: checkpoint/state.0010.h5, the last few kept. One that is not good is put aside under
// another name, never deleted, and the one before is taken.
#include <cstdint>
#include <string>

#include "app/stages/folder.h"
#include "base/ledger.h"
#include "base/progress.h"
#include "sim/watch.h"

namespace app {

class Checkpoints {
 public:
  /// `hash`: of the keys the simulation reads. `keep`: how many stay.
  Checkpoints(const Folder&, std::string hash, std::int64_t keep, base::Progress&);
  void write(const sim::State&, base::Ledger&) const;
  /// Removes all but the latest up to a frame. Later ones, of frames that are made again, stay until it is their turn.
  void prune(std::int64_t reached) const;
  /// Takes a simulation to the latest frame in `above` < frame < `below` that has a good checkpoint: whole, of these keys and this
  /// program, fitting the scene, with the state that the frame's record tells of. Leaves it where it is when there is none.
  void restore(sim::Watch&, std::int64_t above, std::int64_t below) const;
  bool has(std::int64_t frame) const;

 private:
  void restore_one(sim::Watch&, std::int64_t frame) const;
  void put_aside(std::int64_t frame, const std::string& why, const std::string& next) const;

  const Folder& folder_;
  std::string hash_;
  std::int64_t keep_;
  base::Progress& progress_;
};

}  // namespace app
