#pragma once
// Which frames of which stages are finished, to the byte. Every file is read once in a run, several at a time.
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "app/stages/folder.h"
#include "app/stages/hash.h"

namespace app {

class Finished {
 public:
  Finished(const Folder& folder, const StageHashes& hashes, std::int64_t dimension) : folder_(folder), hashes_(hashes), dimension_(dimension) {}
  /// Reads the files of these frames that have not been read yet.
  void look(Stage, const std::vector<std::int64_t>& frames);
  /// Reads them when nobody has.
  bool has(Stage, std::int64_t frame);
  /// Reads them again: another process may have made the frame since.
  bool look_again(Stage, std::int64_t frame);
  /// The record is there and the sizes are right: enough for a frame that will not be used.
  bool stands(Stage, std::int64_t frame) const;
  void add(Stage stage, std::int64_t frame) { known_[{stage, frame}] = true; }
  /// Files that were found with other bytes than their records say, by name.
  const std::vector<std::string>& damaged() const { return damaged_; }

 private:
  const Folder& folder_;
  const StageHashes& hashes_;
  std::int64_t dimension_;
  std::map<std::pair<Stage, std::int64_t>, bool> known_;
  std::vector<std::string> damaged_;
};

}  // namespace app
