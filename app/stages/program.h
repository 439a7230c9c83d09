#pragma once
// Programs that work for us: ffmpeg, gnuplot.
#include <functional>
#include <string>
#include <vector>

namespace app {

struct ProgramEnd {
  bool started = false;   // false: it is not installed, or cannot be run
  bool well = false;      // it ended with 0
  std::string said;       // the last line it printed, or why it did not start
};

/// Runs a program to its end; `feed` writes to its standard input. In a process group of its own: a Ctrl-C meant for us lets it finish.
/// Throws base::Error (exit 5) naming `made` when the system has no room for a pipe.
ProgramEnd run_program(std::vector<std::string> words, const std::string& made, const std::function<void(int pipe)>& feed);

/// All of it; false when nobody reads the pipe any more.
bool write_all(int pipe, const std::string& bytes);

}  // namespace app
