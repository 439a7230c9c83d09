#pragma once
// Programs that work for us: ffmpeg, gnuplot.
#include <sys/types.h>

#include <array>
#include <functional>
#include <string>
#include <vector>

namespace app {

/// Starts a program that dies with the thread that calls this: left alone it would go on writing behind whoever takes up the work. `streams` become
/// its standard input, output and errors. `environment` as execve() wants it; null: ours. Returns 0, or the system's number for what kept it from starting.
int start_program(std::vector<std::string> words, const std::array<int, 3>& streams, char* const* environment, bool in_own_group, pid_t& child);

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
