#include "app/stages/checkpoints.h"

#include <algorithm>
#include <utility>

#include "app/stages/record.h"
#include "app/version.h"
#include "base/error.h"
#include "sim/checkpoint.h"

namespace app {

namespace fs = std::filesystem;

Checkpoints::Checkpoints(const Folder& folder, std::string hash, std::int64_t keep, base::Progress& progress)
    : folder_(folder), hash_(std::move(hash)), keep_(keep), progress_(progress) {}

void Checkpoints::write(const sim::State& state, base::Ledger& ledger) const {
  std::int64_t bytes = 0;
  for (const sim::Column& column : state.columns) bytes += static_cast<std::int64_t>(column.bytes.size());
  const auto pass = ledger.pass("checkpoint", bytes);
  const fs::path file = folder_.checkpoint(state.frame);
  Folder::make_room_for(file);
  sim::write_checkpoint(file, hash_, kVersion, state);
}

void Checkpoints::prune(std::int64_t reached) const {
  std::vector<std::int64_t> frames = folder_.checkpoints();
  std::erase_if(frames, [&](std::int64_t frame) { return frame > reached; });
  frames.resize(frames.size() - std::min(frames.size(), static_cast<std::size_t>(keep_)));
  std::error_code none;   // one too many does no harm
  for (const std::int64_t frame : frames) fs::remove(folder_.checkpoint(frame), none);
}

void Checkpoints::restore(sim::Watch& watch, std::int64_t above, std::int64_t below) const {
  std::vector<std::int64_t> frames = folder_.checkpoints();
  std::reverse(frames.begin(), frames.end());
  std::erase_if(frames, [&](std::int64_t frame) { return frame >= below || frame <= above; });
  for (const std::int64_t frame : frames) {
    try {
      restore_one(watch, frame);
      progress_.line("from   " + folder_.checkpoint(frame).lexically_relative(folder_.root()).string());
      return;
    } catch (const base::Error& e) {
      if (e.complaint().code == base::Exit::io) throw;
      const std::string from = std::to_string(std::max<std::int64_t>(1, above));
      put_aside(frame, e.complaint().message,
                frame == frames.back() ? "there is none before it: computed again from frame " + from : "the one before is taken");
    }
  }
}

void Checkpoints::restore_one(sim::Watch& watch, std::int64_t frame) const {
  const fs::path file = folder_.checkpoint(frame);
  sim::Checkpoint checkpoint = sim::read_checkpoint(file);
  const auto refuse = [&](const std::string& why) { base::throw_input(file.string(), why); };
  if (checkpoint.hash != hash_) refuse("is of another shot");
  if (checkpoint.version != kVersion) refuse("is of polypic " + checkpoint.version);
  if (checkpoint.state.frame != frame) refuse("is of frame " + std::to_string(checkpoint.state.frame));
  const auto record = read_record(folder_, Stage::simulate, frame);
  if (!record || record->hash != hash_) refuse("belongs to a frame that is not finished");
  const sim::State before = watch.state();
  watch.restore(checkpoint.state);
  if (watch.totals().state_hash == record->totals->state_hash) return;
  watch.restore(before);
  refuse("is not the state that the frame's record tells of");
}

bool Checkpoints::has(std::int64_t frame) const {
  std::error_code none;
  return fs::exists(folder_.checkpoint(frame), none);
}

// Nothing is overwritten: state.0010.h5.bad, state.0010.h5.bad2 ...
void Checkpoints::put_aside(std::int64_t frame, const std::string& why, const std::string& next) const {
  const fs::path file = folder_.checkpoint(frame);
  fs::path aside = file.string() + ".bad";
  std::error_code failure;
  for (int i = 2; fs::exists(fs::symlink_status(aside, failure)); ++i) aside = file.string() + ".bad" + std::to_string(i);
  fs::rename(file, aside, failure);
  if (failure) base::throw_io(file.string(), failure.message());
  progress_.warn(file.string() + ": " + why + "; kept as " + aside.filename().string() + ", " + next);
}

}  // namespace app
