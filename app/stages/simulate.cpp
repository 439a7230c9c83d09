#include "app/stages/simulate.h"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <string_view>
#include <utility>

#include "app/plan/plan.h"
#include "app/stages/hash.h"
#include "app/stages/interrupt.h"
#include "app/stages/record.h"
#include "app/stages/stopwatch.h"
#include "base/error.h"
#include "base/text.h"
#include "surface/surface.h"

namespace app {
namespace {

/// Not of particles, though there may be as few of these as such a column has rows.
bool is_of_the_run(const sim::Column& column) {
  constexpr std::string_view kOfTheRun[] = {"watch", "volume_correction", "energy_watch", "limits"};
  return std::find(std::begin(kOfTheRun), std::end(kOfTheRun), column.name) != std::end(kOfTheRun);
}

}  // namespace

PointsMaker::PointsMaker(const Shot& shot, const Folder& folder, std::string hash, std::vector<std::int64_t> missing, base::Progress& progress)
    : shot_(shot), folder_(folder), hash_(std::move(hash)), missing_(std::move(missing)),
      checkpoints_(folder, hash_, shot.checkpoint_keep, progress), progress_(progress) {
  if (!missing_.empty()) watch_ = std::make_unique<sim::Watch>(shot.scene, shot.fps);
}

bool PointsMaker::is_missing(std::int64_t frame) const { return std::binary_search(missing_.begin(), missing_.end(), frame); }

// A gap that is filled ends nothing: the frames behind it are there.
bool PointsMaker::is_end(std::int64_t frame) const {
  if (frame != missing_.back()) return false;
  const std::vector<std::int64_t> recorded = folder_.recorded_frames(Stage::simulate);
  return recorded.empty() || recorded.back() <= frame;
}

double PointsMaker::make(std::int64_t frame) {
  assert(is_missing(frame) && watch_->state().frame <= frame);
  Stopwatch watch;
  base::Ledger ledger(plan_of(shot_, Stage::simulate));
  checkpoints_.restore(*watch_, watch_->state().frame, frame);
  while (watch_->state().frame < frame) {
    ledger.clear(), watch = {};   // what is made again on the way belongs to no frame that is recorded
    advance(ledger);
    check_repeats();
  }
  const sim::Totals totals = watch_->totals();
  const std::filesystem::path points = folder_.points(frame);
  Folder::make_room_for(points);
  const sim::Column* const id = watch_->state().find("id");
  for (const sim::Column& column : watch_->state().columns)
    if (id && column.rows == id->rows && !is_of_the_run(column)) ledger.hold(column.name, static_cast<std::int64_t>(column.bytes.size()));
  surface::write_points(points, watch_->simulation().frame(), ledger);
  if (frame > 1 && (frame % shot_.checkpoint_every == 0 || is_end(frame))) checkpoints_.write(watch_->state(), ledger);
  write_record(folder_, shot_.scene.options.dimension,
               {.stage = Stage::simulate, .frame = frame, .hash = hash_, .seconds = watch.seconds(),
                .cpu_seconds = watch.cpu_seconds(), .passes = ledger.passes(), .attributes = ledger.attributes(), .totals = totals});
  constexpr double kPressed = 1e-3;   // [1/s]
  if (totals.imbalance.value_or(0) > kPressed && !std::exchange(told_of_pressing_, true))
    progress_.line("watch  from frame " + std::to_string(frame) + " on liquid that is shut in without air is pressed together: `imbalance` in run.json");
  if (totals.retries > 0) progress_.line("watch  frame " + std::to_string(frame) + " went back " + base::count_of(totals.retries, "time") + " to shorter steps");
  checkpoints_.prune(frame);   // not before the record is there: a checkpoint without it is none
  return watch.seconds();
}

void PointsMaker::advance(base::Ledger& ledger) {
  try {
    if (!watch_->advance(ledger, signal_came)) stop_if_signalled();
  } catch (const sim::Unstable& e) {
    base::Complaint complaint = e.complaint();
    const std::int64_t last = watch_->state().frame, well = std::min(last, e.violation().since - 1);
    save();
    complaint.hint += complaint.hint.empty() ? "" : "; ";
    if (last == 1) complaint.hint += "frame 1 is the start: there is no other state to go on from";
    else complaint.hint += "the last whole frame's state is in " + folder_.checkpoint(last).string();
    const std::vector<std::int64_t> kept = folder_.checkpoints();   // ascending
    const auto good = std::find_if(kept.rbegin(), kept.rend(), [&](std::int64_t frame) { return frame <= well; });
    if (last > 1 && good != kept.rend()) complaint.hint += *good == last ? ", and good" : ", a good one in " + folder_.checkpoint(*good).string();
    throw base::Error(std::move(complaint));
  }
}

std::filesystem::path PointsMaker::save() const {
  if (!watch_) return {};
  const sim::State& reached = watch_->state();
  if (reached.frame == 1) return {};
  base::Ledger unused;
  if (!checkpoints_.has(reached.frame)) checkpoints_.write(reached, unused);
  checkpoints_.prune(reached.frame);
  return folder_.checkpoint(reached.frame);
}

// Points of another machine or program must not be mixed with new ones.
void PointsMaker::check_repeats() const {
  const auto kept = read_record(folder_, Stage::simulate, watch_->state().frame);
  if (!kept || kept->hash != hash_ || kept->totals->state_hash == watch_->totals().state_hash) return;
  throw base::Error({.code = base::Exit::resume_refused,
                     .file = folder_.points(watch_->state().frame).string(),
                     .hint = "--restart or another --out goes on",
                     .message = "simulated again, the state differs from the one this file was made from"});
}

}  // namespace app
