#include "base/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <numeric>

namespace base {
namespace {

constexpr std::size_t kFramesRemembered = 8;

std::string format(const char* pattern, double value) {
  char text[32];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

std::string place(std::int64_t frame, std::int64_t last) {
  const std::string total = std::to_string(last);
  std::string number = std::to_string(frame);
  number.insert(0, total.size() > number.size() ? total.size() - number.size() : 0, ' ');
  return "frame  " + number + "/" + total;
}

std::string bar(std::int64_t done, std::int64_t total) {
  constexpr std::int64_t width = 16;
  const auto filled = static_cast<std::size_t>(width * done / std::max<std::int64_t>(total, 1));
  return "[" + std::string(filled, '#') + std::string(width - filled, '.') + "]";
}

std::size_t terminal_width(std::FILE* out) {
  winsize size{};
  const bool known = ::ioctl(::fileno(out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

}  // namespace

std::string duration_text(double seconds) {
  if (seconds < 9.95) return format(seconds < 0.995 ? "%.2f s" : "%.1f s", seconds);
  if (seconds < 99.5) return format("%.0f s", seconds);
  if (seconds < 5970) return format("%.1f min", seconds / 60);
  return format("%.1f h", seconds / 3600);
}

Progress::Progress(std::FILE* out, bool quiet) : out_(out), quiet_(quiet), terminal_(::isatty(::fileno(out)) == 1) {}

Progress::~Progress() { clear_bar(); }

void Progress::line(std::string_view text) {
  if (quiet_) return;
  clear_bar();
  std::fprintf(out_, "%.*s\n", static_cast<int>(text.size()), text.data());
  std::fflush(out_);
}

void Progress::warn(std::string_view text) {
  clear_bar();
  std::fprintf(stderr, "polypic: %.*s\n", static_cast<int>(text.size()), text.data());
}

void Progress::working(std::int64_t frame, std::int64_t last, std::string_view stage) {
  if (terminal_ && !quiet_) draw_bar(frame, frame - 1, last, last_tail_.empty() ? std::string(stage) : last_tail_ + "  " + std::string(stage));
}

void Progress::finished(std::int64_t frame, std::int64_t last, const StageSeconds& spent) {
  recent_.push_back(std::accumulate(spent.begin(), spent.end(), 0.0, [](double sum, const auto& stage) { return sum + stage.second; }));
  if (recent_.size() > kFramesRemembered) recent_.pop_front();
  std::string tail;
  for (const auto& [stage, seconds] : spent) tail += (tail.empty() ? "" : "  ") + stage + " " + duration_text(seconds);
  if (frame < last) tail += "   " + time_left(last - frame);
  last_tail_ = tail;
  if (quiet_) return;
  if (terminal_) draw_bar(frame, frame, last, tail);
  else line(place(frame, last) + "  " + tail);
}

void Progress::draw_bar(std::int64_t frame, std::int64_t done, std::int64_t last, const std::string& tail) {
  const std::string text = place(frame, last) + "  " + bar(done, last) + "  " + tail;
  std::fprintf(out_, "\r\033[K%s", text.substr(0, terminal_width(out_) - 1).c_str());
  std::fflush(out_);
  bar_open_ = true;
}

void Progress::clear_bar() {
  if (!bar_open_) return;
  std::fputs("\r\033[K", out_);
  std::fflush(out_);
  bar_open_ = false;
}

std::string Progress::time_left(std::int64_t frames) const {
  const double mean = std::accumulate(recent_.begin(), recent_.end(), 0.0) / static_cast<double>(recent_.size());
  return duration_text(mean * static_cast<double>(frames)) + " left";
}

}  // namespace base
