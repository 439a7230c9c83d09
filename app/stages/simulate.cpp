#include "app/stages/simulate.h"

#include <cassert>
#include <utility>

#include "app/stages/hash.h"
#include "app/stages/interrupt.h"
#include "app/stages/record.h"
#include "app/stages/stopwatch.h"
#include "base/error.h"
#include "surface/surface.h"

namespace app {

PointsMaker::PointsMaker(const Shot& shot, const Folder& folder, std::string hash, std::int64_t last, bool anew) : folder_(folder), hash_(std::move(hash)) {
  for (std::int64_t frame = 1; frame <= last && !simulation_; ++frame)
    if (anew || !finished_record(folder, Stage::simulate, frame, hash_)) simulation_ = sim::make_simulation(shot.scene, shot.fps);
}

double PointsMaker::make(std::int64_t frame) {
  assert(simulation_ && "no frame is missing");
  const Stopwatch watch;
  base::Ledger ledger;
  if (frame > 1 && !simulation_->advance(ledger, signal_came)) stop_if_signalled();
  const sim::Totals totals = simulation_->totals();
  if (const auto kept = finished_record(folder_, Stage::simulate, frame, hash_)) {
    check_repeats(frame, kept->totals->state_hash);
    return watch.seconds();
  }
  const std::filesystem::path points = folder_.points(frame);
  Folder::make_room_for(points);
  surface::write_points(points, simulation_->frame(), ledger);
  write_record(folder_, {.stage = Stage::simulate, .frame = frame, .hash = hash_, .files = {}, .seconds = watch.seconds(), .peak_bytes = 0,
                         .passes = ledger.passes(), .totals = totals});
  return watch.seconds();
}

// Points of another machine or program version must not be mixed with new ones.
void PointsMaker::check_repeats(std::int64_t frame, std::uint64_t state_hash) const {
  if (state_hash == simulation_->totals().state_hash) return;
  throw base::Error({.code = base::Exit::resume_refused,
                     .file = folder_.points(frame).string(),
                     .hint = "--restart or another --out goes on",
                     .message = "simulated again, the state differs from the one this file was made from"});
}

}  // namespace app
