#pragma once
// How far a row of frames has come: a bar with the time left on a terminal, one plain line a frame elsewhere.
#include <cstdint>
#include <cstdio>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace base {

/// "0.42 s", "12 s", "4.1 min", "1.6 h".
std::string duration_text(double seconds);

/// Seconds by stage of one frame, in the order of work: {"sim", 1.1}, {"surface", 0.4}.
using StageSeconds = std::vector<std::pair<std::string, double>>;

class Progress {
 public:
  /// `out` stays the caller's. Quiet: nothing is written at all.
  Progress(std::FILE* out, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// A line that stays. `text` without its newline.
  void line(std::string_view text);
  /// A line on standard error about what went wrong and was dealt with; quiet does not hide it.
  void warn(std::string_view text);
  /// Work on `frame` goes on with `stage`; shown by the bar only.
  void working(std::int64_t frame, std::int64_t last, std::string_view stage);
  /// `frame` of `last` is done after work in these stages; the time left follows from the latest frames.
  void finished(std::int64_t frame, std::int64_t last, const StageSeconds& spent);

 private:
  void draw_bar(std::int64_t frame, std::int64_t done, std::int64_t last, const std::string& tail);
  void clear_bar();
  std::string time_left(std::int64_t frames) const;

  std::FILE* out_;
  bool quiet_, terminal_, bar_open_ = false;
  std::deque<double> recent_;   // [s] of the latest frames
  std::string last_tail_;
};

}  // namespace base
