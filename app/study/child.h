#pragma once
// This program, run by itself: what it takes of memory is its own, and a crash is the child's alone.
#include <string>
#include <vector>

namespace app {

struct ChildEnd {
  std::string failure;   // empty when it ended with 0; else the line it gave, or the signal that ended it
  std::string out;       // standard output
};

/// Runs the program with these words and waits. Throws Interrupted when a signal came meanwhile, and base::Error where no process can be started.
ChildEnd run_child(const std::vector<std::string>& words);

}  // namespace app
