#include "app/stages/finished.h"

#include "app/stages/record.h"
#include "base/parallel.h"

namespace app {
namespace {

struct Look {
  bool finished = false;
  std::vector<std::string> damaged;
};

// A frame without a record of these keys is not finished; one with it whose bytes are others is damaged. A file that is gone is neither.
Look look_at(const Folder& folder, std::int64_t dimension, Stage stage, std::int64_t frame, const std::string& hash) {
  const auto record = read_record(folder, stage, frame);
  if (!record || record->hash != hash) return {};
  Look look;
  for (const std::string& name : damaged_files(folder, *record))
    if (std::error_code none; std::filesystem::exists(folder.root() / name, none)) look.damaged.push_back(name);
  look.finished = look.damaged.empty() && finished_record(folder, dimension, stage, frame, hash);
  return look;
}

}  // namespace

void Finished::look(Stage stage, const std::vector<std::int64_t>& frames) {
  std::vector<std::int64_t> unknown;
  for (const std::int64_t frame : frames)
    if (!known_.contains({stage, frame})) unknown.push_back(frame);
  std::vector<Look> looks(unknown.size());
  base::parallel_chunks(unknown.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) looks[i] = look_at(folder_, dimension_, stage, unknown[i], hashes_.of(stage));
  });
  for (std::size_t i = 0; i < unknown.size(); ++i) {
    known_[{stage, unknown[i]}] = looks[i].finished;
    damaged_.insert(damaged_.end(), looks[i].damaged.begin(), looks[i].damaged.end());
  }
}

bool Finished::has(Stage stage, std::int64_t frame) {
  look(stage, {frame});
  return known_.at({stage, frame});
}

bool Finished::look_again(Stage stage, std::int64_t frame) {
  known_.erase({stage, frame});
  return has(stage, frame);
}

bool Finished::stands(Stage stage, std::int64_t frame) const {
  return finished_record(folder_, dimension_, stage, frame, hashes_.of(stage)).has_value();
}

}  // namespace app
