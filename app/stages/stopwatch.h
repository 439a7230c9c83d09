#pragma once
// Seconds since it was made: of the clock, and of all threads of the process.
#include <chrono>

#include "base/ledger.h"

namespace app {

class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  double cpu_seconds() const { return base::process_seconds() - cpu_start_; }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double cpu_start_ = base::process_seconds();
};

}  // namespace app
