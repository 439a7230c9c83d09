#pragma once
// A shot -> files, frame by frame: simulate, surface, render, so that the first picture exists early. Each stage reads what
// its predecessor's file holds, whichever command runs it, and what is finished is kept.
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "app/shot/shot.h"
#include "app/stages/folder.h"
#include "base/progress.h"

namespace app {

/// Frames asked for, from 1, both included.
struct FrameRange {
  std::int64_t first = 1, last = 1;
};

struct Order {
  std::vector<Stage> stages;          // in the order of the flow
  std::optional<FrameRange> frames;   // all of the shot's when empty
  std::filesystem::path out;          // the run's directory
  bool restart = false;               // the stages' files and those below are made anew
  int threads = 1;
  bool report = true;                 // report.html is written
  std::string command = {};           // as typed; for the report
  std::string cost = {};              // what the frames are expected to take, for the first lines; empty when nobody knows
};

/// Makes what is missing, writes run.json and report.html, and returns the content of run.json. Throws base::Error: exit 2 where a file upstream
/// is missing, another process works there or memory runs out, 3 for an unstable simulation, 4 where frames are of another shot, 5 for the disk, 69
/// without ffmpeg; and Interrupted. All that stops frames that are being made is told in run.json, too ("stopped").
nlohmann::ordered_json make_film(const Shot&, const Order&, base::Progress&);

}  // namespace app
