#include "app/study/plot_script.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "app/study/plot_axis.h"
#include "app/study/plot_labels.h"
#include "app/study/text.h"
#include "base/error.h"

namespace app {
namespace {

/// Told apart by people with any colour vision [Okabe and Ito 2008]; the yellow, too faint on white, comes last of theirs. Two dark ones follow.
constexpr std::array<const char*, 10> kPalette = {
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#4d4d4d", "#e6d53c", "#7a3b10", "#5b2a86"};
constexpr std::array<int, 6> kMarkers = {7, 5, 9, 13, 11, 15};   // gnuplot's filled symbols
constexpr const char* kInk = "#222222";
constexpr const char* kSoft = "#666666";
constexpr const char* kFaint = "#e2e2e2";
constexpr const char* kFrontColor = "#b4b4b4";
constexpr const char* kOther = "#9a9a9a";

constexpr const char* kNoise = "noise: below the distance of two runs that differ in their jitter only";

constexpr double kTitleLine = 34, kLegendRow = 24, kSmall = 14, kEdge = 24;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

/// Without control characters.
std::string quoted(const std::string& text) {
  std::string line = clean_text(text);
  std::replace_if(line.begin(), line.end(), [](char c) { return static_cast<unsigned char>(c) < 32; }, ' ');
  return in_quotes(line);
}

void check(const Plot& plot) {
  const auto refuse = [&](const std::string& what) {
    throw base::Error({.code = base::Exit::fault, .message = "plot '" + plot.title + "': " + what});
  };
  const auto refuse_bars = [&](const Series& s) { refuse("the error bars of '" + s.label + "' have another length"); };
  const auto check_finite = [&](const std::vector<double>& values, const std::string& of) {
    for (const double v : values)
      if (!std::isfinite(v)) refuse("a value of " + of + " is not finite");
  };
  for (const Series& s : plot.series) {
    if (plot.categories.empty() ? s.x.size() != s.y.size() : s.y.size() != plot.categories.size())
      refuse("x and y of '" + s.label + "' have different lengths");
    if (s.x_low.size() != s.x_high.size() || (!s.x_low.empty() && s.x_low.size() != s.x.size())) refuse_bars(s);
    if (s.low.size() != s.high.size() || (!s.low.empty() && s.low.size() != s.y.size())) refuse_bars(s);
    for (const auto* values : {&s.x, &s.y, &s.low, &s.high, &s.x_low, &s.x_high}) check_finite(*values, "'" + s.label + "'");
  }
  for (const PointLabel& label : plot.labels) check_finite({label.x, label.y}, "the label '" + label.text + "'");
}

struct Span {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double v) { low = std::min(low, v), high = std::max(high, v); }
  bool is_empty() const { return low > high; }
};

class Drawing {
 public:
  explicit Drawing(const Plot& plot) : plot_(plot), width_(plot.width), height_(plot.height) {
    check(plot);
    lay_out_bars_and_stacks();
    choose_axes();
    lay_out();
  }

  std::string script() {
    out_ += "reset session\nset encoding utf8\nunset key\n";
    set_axes();
    draw_texts();
    draw_legend();
    draw_floor();
    draw_labels();
    draw_series();
    return out_;
  }

 private:
  bool has_bars() const { return !plot_.categories.empty(); }
  bool is_shown(double x, double y) const { return (!plot_.log_x || x > 0) && (!plot_.log_y || y > 0); }

  /// Its number among those that have colours of their own.
  std::size_t rank(std::size_t series) const {
    return static_cast<std::size_t>(std::count_if(plot_.series.begin(), plot_.series.begin() + static_cast<std::ptrdiff_t>(series),
        [](const Series& s) { return s.style != Style::front && s.label != "other"; }));
  }
  std::string color(std::size_t series) const {
    const Series& s = plot_.series[series];
    return s.style == Style::front ? kFrontColor : s.label == "other" ? kOther : kPalette[rank(series) % kPalette.size()];
  }
  int marker(std::size_t series) const { return kMarkers[rank(series) % kMarkers.size()]; }

  // Lower and upper ends of what each stacked series covers: above zero and below it apart.
  void lay_out_bars_and_stacks() {
    std::vector<double> up, down;
    for (const Series& s : plot_.series) {
      bases_.emplace_back();
      if (s.style != Style::stack && !has_bars()) continue;
      up.resize(std::max(up.size(), s.y.size()), 0), down.resize(up.size(), 0);
      for (std::size_t i = 0; i < s.y.size(); ++i) {
        double& base = s.y[i] < 0 ? down[i] : up[i];
        bases_.back().push_back(base);
        base += s.y[i];
      }
    }
  }

  void choose_axes() {
    Span x, y;
    bool any_stack = false;
    for (std::size_t k = 0; k < plot_.series.size(); ++k) {
      const Series& s = plot_.series[k];
      const bool stacked = !bases_[k].empty();
      any_stack = any_stack || stacked;
      for (std::size_t i = 0; i < s.y.size(); ++i) {
        const double at = has_bars() ? 1 : s.x[i], value = stacked ? bases_[k][i] + s.y[i] : s.y[i];
        if (!is_shown(at, value)) {
          ++hidden_;
          continue;
        }
        if (!has_bars()) x.add(at);
        (has_bars() ? x : y).add(plot_.reach ? std::clamp(value, -*plot_.reach, *plot_.reach) : value);
        if (!s.x_low.empty() && is_shown(s.x_low[i], value)) x.add(s.x_low[i]), x.add(s.x_high[i]);
        if (!s.low.empty() && is_shown(at, s.low[i])) y.add(s.low[i]), y.add(s.high[i]);
      }
    }
    if (has_bars()) x.add(0), y.add(0), y.add(static_cast<double>(plot_.categories.size()));
    if ((any_stack && !has_bars()) || (plot_.from_zero && !plot_.log_y)) y.add(0);
    if (plot_.floor && (!plot_.log_y || *plot_.floor > 0)) y.add(*plot_.floor);
    if (x.is_empty()) x.add(plot_.log_x ? 1 : 0);
    if (y.is_empty()) y.add(plot_.log_y ? 1 : 0);
    const bool is_cloud = !plot_.labels.empty(), has_markers = std::any_of(plot_.series.begin(), plot_.series.end(),
        [](const Series& s) { return s.style == Style::points || s.style == Style::linespoints; });
    x_ = axis_for(x.low, x.high, plot_.log_x, is_cloud ? 0.09 : has_bars() || has_markers ? 0.03 : 0, has_bars());
    if (plot_.whole_x) x_ = with_whole_ticks(std::move(x_));
    y_ = has_bars() ? Axis{.log = false, .low = y.low, .high = y.high, .ticks = {}} : axis_for(y.low, y.high, plot_.log_y, is_cloud ? 0.09 : 0.04,
        any_stack || plot_.from_zero);
  }

  struct Entry {
    std::size_t series;
    double left, row;
  };
  void lay_out() {
    double at = kEdge, row = 0;
    for (std::size_t k = 0; k < plot_.series.size(); ++k) {
      if (plot_.series[k].label.empty()) continue;
      const double width = 34 + text_width(plot_.series[k].label, kSmall) + 20;
      if (at > kEdge && at + width > width_ - kEdge) at = kEdge, ++row;
      legend_.push_back({k, at, row});
      at += width;
    }
    if (legend_.size() == 1 && plot_.series[legend_[0].series].label == plot_.y_label) legend_.clear();
    const double rows = legend_.empty() ? 0 : row + 1;
    double widest = 0;
    for (const Tick& tick : y_.ticks) widest = std::max(widest, text_width(tick.text, kFontSize));
    for (const std::string& name : plot_.categories) widest = std::max(widest, text_width(name, kFontSize));
    const double most = 0.45 * width_ - kEdge - 10;
    if (has_bars() && widest > most) name_size_ = kFontSize * most / widest;   // long names are set smaller
    legend_top_ = plot_.title.empty() ? 14 : kTitleLine + 24;
    const double y_label_line = has_bars() ? 6 : 28;
    y_label_at_ = legend_top_ + rows * kLegendRow + 14;
    area_ = {std::min(kEdge + widest + 10, 0.45 * width_), legend_top_ + rows * kLegendRow + y_label_line + 6, width_ - kEdge - 14,
             height_ - 62 - (hidden_ > 0 || !plot_.note.empty() ? 18 : 0)};
  }

  double pixel_x(double x) const { return area_.left + x_.place(x) * (area_.right - area_.left); }
  double pixel_y(double y) const { return area_.bottom - y_.place(y) * (area_.bottom - area_.top); }
  std::string at(double x, double y) const { return "screen " + number(x / width_) + ",screen " + number(1 - y / height_); }

  void text(const std::string& what, double x, double y, const char* align, const char* ink, double size, bool bold = false) {
    out_ += "set label " + quoted(what) + " at " + at(x, y) + " " + align + " noenhanced front font '" +
        (bold ? "DejaVu Sans Bold" : "DejaVu Sans") + "," + number(size) + "' tc rgb '" + ink + "'\n";
  }
  void line(double x0, double y0, double x1, double y1, const std::string& ink, double width, bool dashed = false) {
    out_ += "set arrow from " + at(x0, y0) + " to " + at(x1, y1) + " nohead front lw " + number(width) + " lc rgb '" + ink
        + (dashed ? "' dt 2\n" : "'\n");
  }

  void set_axes() {
    const auto margin = [&](const char* side, double fraction) {
      out_ += std::string("set ") + side + "margin at screen " + number(fraction) + "\n";
    };
    margin("l", area_.left / width_), margin("r", area_.right / width_), margin("t", 1 - area_.top / height_),
        margin("b", 1 - area_.bottom / height_);
    for (const auto& [name, axis] : {std::pair<std::string, const Axis*>{"x", &x_}, {"y", &y_}}) {
      out_ += "set " + name + "range [" + number(axis->low) + ":" + number(axis->high) + "]\n";
      if (axis->log) out_ += "set logscale " + name + "\n";
      std::string ticks;
      for (const Tick& tick : axis->ticks) ticks += (ticks.empty() ? "" : ", ") + quoted(tick.text) + " " + number(tick.value);
      out_ += ticks.empty() ? "unset " + name + "tics\n" : "set " + name + "tics nomirror noenhanced scale 0.4 textcolor rgb '" + kInk + "' ("
          + ticks + ")\n";
    }
    out_ += std::string("set grid ") + (has_bars() ? "xtics" : "xtics ytics") + " back lt 1 lw 1 lc rgb '" + kFaint + "'\nset border "
        + (has_bars() ? "2" : "3") + " lw 1 lc rgb '" + kSoft + "'\n";
  }

  void draw_texts() {
    const double size = std::min(20.0, 20 * (width_ - 2 * kEdge) / (1.1 * text_width(plot_.title, 20)));   // a long title is set smaller
    if (!plot_.title.empty()) text(plot_.title, kEdge, kTitleLine - 6, "left", kInk, size, /*bold=*/true);
    if (!has_bars()) text(plot_.y_label, kEdge, y_label_at_, "left", kSoft, kFontSize);
    text(plot_.x_label, area_.right, area_.bottom + 46, "right", kSoft, kFontSize);
    for (std::size_t i = 0; i < plot_.categories.size(); ++i)
      text(plot_.categories[i], area_.left - 10, pixel_y(bar_middle(i)), "right", kInk, name_size_);
    std::string below = plot_.note;
    if (hidden_ > 0)
      below += (below.empty() ? "" : "; ") + std::to_string(hidden_) + (hidden_ == 1 ? " point is" : " points are")
          + " 0 or below, where a logarithmic axis does not reach";
    if (!below.empty()) text(below, kEdge, height_ - 14, "left", kSoft, std::min(12.0, 12 * (width_ - 2 * kEdge) / text_width(below, 12)));
  }

  void draw_legend() {
    for (const Entry& e : legend_) {
      const Series& s = plot_.series[e.series];
      const double y = legend_top_ + e.row * kLegendRow + 4;
      const std::string ink = color(e.series);
      if (s.style == Style::stack || has_bars())
        out_ += "set object rectangle from " + at(e.left, y + 6) + " to " + at(e.left + 22, y - 6) + " front fc rgb '" + ink
            + "' fs solid 1 noborder\n";
      if (s.style == Style::lines || s.style == Style::linespoints || s.style == Style::front)
        line(e.left, y, e.left + 24, y, ink, s.style == Style::front ? 5 : 2.5, rank(e.series) >= kPalette.size());
      if (s.style == Style::points || s.style == Style::linespoints)
        out_ += "set label '' at " + at(e.left + 12, y) + " front point pt " + std::to_string(marker(e.series)) + " ps 1.1 lc rgb '" + ink + "'\n";
      text(s.label, e.left + 31, y, "left", kInk, kSmall);
    }
  }

  void draw_floor() {
    if (!plot_.floor || (plot_.log_y && *plot_.floor <= 0)) return;
    const double y = pixel_y(*plot_.floor);
    out_ += "set object rectangle from " + at(area_.left, area_.bottom) + " to " + at(area_.right, y)
        + " behind fc rgb '#f0f0f0' fs solid 1 noborder\n";
    const Spot middle{area_.left + 8, std::min(y + 12, area_.bottom - 10)};
    text(kNoise, middle.x, middle.y, "left", kSoft, 13);
    own_texts_.push_back({middle.x, middle.y - 9, middle.x + text_width(kNoise, 13), middle.y + 9});
  }

  void add_bar(Obstacles& obstacles, double x0, double y0, double x1, double y1) const {
    if (is_shown(x0, y0) && is_shown(x1, y1)) obstacles.lines.push_back({{pixel_x(x0), pixel_y(y0)}, {pixel_x(x1), pixel_y(y1)}});
  }

  void draw_labels() {
    std::vector<Spot> anchors;
    std::vector<double> widths;
    std::vector<std::string> texts;
    for (const PointLabel& label : plot_.labels) {
      if (!is_shown(label.x, label.y)) continue;
      anchors.push_back({pixel_x(label.x), pixel_y(label.y)});
      texts.push_back(label.text);
      widths.push_back(text_width(label.text, kSmall));
    }
    Obstacles obstacles{.points = {}, .lines = {}, .texts = own_texts_, .room = {area_.left + 4, area_.top, width_ - 6, area_.bottom - 4}};
    for (const Series& s : plot_.series) {
      std::vector<Spot> path;
      for (std::size_t i = 0; i < s.x.size(); ++i)
        if (is_shown(s.x[i], s.y[i])) path.push_back({pixel_x(s.x[i]), pixel_y(s.y[i])});
      if (s.style == Style::points || s.style == Style::linespoints) obstacles.points.insert(obstacles.points.end(), path.begin(), path.end());
      if (s.style != Style::points) obstacles.lines.push_back(path);
      for (std::size_t i = 0; i < s.low.size(); ++i) add_bar(obstacles, s.x[i], s.low[i], s.x[i], s.high[i]);
      for (std::size_t i = 0; i < s.x_low.size(); ++i) add_bar(obstacles, s.x_low[i], s.y[i], s.x_high[i], s.y[i]);
    }
    const std::vector<PlacedLabel> placed = place_labels(anchors, widths, kSmall + 4, obstacles);
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const PlacedLabel& p = placed[i];
      if (p.has_leader) line(p.from.x, p.from.y, p.to.x, p.to.y, kOther, 1);
      text(texts[i], (p.box.left + p.box.right) / 2, (p.box.top + p.box.bottom) / 2, "center", kInk, kSmall);
    }
  }

  double bar_middle(std::size_t i) const { return static_cast<double>(plot_.categories.size() - i) - 0.5; }

  // Columns of numbers a series is drawn from.
  std::string data(std::size_t k) const {
    const Series& s = plot_.series[k];
    std::string rows;
    for (std::size_t i = 0; i < s.y.size(); ++i) {
      if (has_bars()) {
        if (s.y[i] == 0) continue;
        const double middle = bar_middle(i), base = bases_[k][i];
        rows += number(base + s.y[i] / 2) + " " + number(middle) + " " + number(base) + " " + number(base + s.y[i]) + " " + number(middle - 0.36)
            + " " + number(middle + 0.36) + "\n";
      } else if (!bases_[k].empty()) {
        rows += number(s.x[i]) + " " + number(bases_[k][i]) + " " + number(bases_[k][i] + s.y[i]) + "\n";
      } else if (is_shown(s.x[i], s.y[i])) {
        rows += number(s.x[i]) + " " + number(s.y[i]);
        if (!s.low.empty()) rows += " " + number(plot_.log_y && s.low[i] <= 0 ? y_.low : s.low[i]) + " " + number(s.high[i]);
        if (!s.x_low.empty()) rows += " " + number(plot_.log_x && s.x_low[i] <= 0 ? x_.low : s.x_low[i]) + " " + number(s.x_high[i]);
        rows += "\n";
      }
    }
    return rows;
  }

  std::string how(std::size_t k) const {
    const Series& s = plot_.series[k];
    const std::string ink = " lc rgb '" + color(k) + "'", symbol = " pt " + std::to_string(marker(k)) + " ps 1.1";
    if (has_bars()) return "using 1:2:3:4:5:6 with boxxyerror fs solid 1 noborder" + ink;
    if (s.style == Style::stack) return "using 1:2:3 with filledcurves fs solid 1 noborder" + ink;
    if (s.style == Style::front) return "using 1:2 with lines lw 6" + ink;
    const std::string dashes = rank(k) < kPalette.size() ? "" : " dt 2";   // the same colours again
    if (s.style == Style::lines) return "using 1:2 with lines lw 2.5" + dashes + ink;
    if (s.style == Style::points && !s.x_low.empty()) return "using 1:2:3:4 with xerrorbars lw 1.5" + symbol + ink;
    const bool bars = !s.low.empty();
    if (s.style == Style::points) return bars ? "using 1:2:3:4 with yerrorbars lw 1.5" + symbol + ink : "using 1:2 with points" + symbol + ink;
    return bars ? "using 1:2:3:4 with yerrorlines lw 2" + symbol + ink : "using 1:2 with linespoints lw 2.5" + symbol + ink;
  }

  void draw_series() {
    std::string plots;
    for (const bool fronts : {true, false})
      for (std::size_t k = 0; k < plot_.series.size(); ++k) {
        if ((plot_.series[k].style == Style::front) != fronts) continue;
        const std::string rows = data(k), name = "$series" + std::to_string(k);
        if (rows.empty()) continue;
        out_ += name + " << END_OF_SERIES\n" + rows + "END_OF_SERIES\n";
        plots += (plots.empty() ? "" : ", ") + name + " " + how(k);
      }
    if (plots.empty()) {   // gnuplot draws no axes without a point
      out_ += "$nothing << END_OF_SERIES\n" + number(x_.low) + " " + number(y_.low) + "\nEND_OF_SERIES\n";
      plots = "$nothing using 1:2 with points ps 0";
    }
    out_ += "plot " + plots + "\n";
  }

  const Plot& plot_;
  double width_, height_;                    // [pixels]
  std::vector<std::vector<double>> bases_;   // of stacked series
  std::size_t hidden_ = 0;
  Axis x_, y_;
  std::vector<Entry> legend_;
  double legend_top_ = 0, y_label_at_ = 0, name_size_ = kFontSize;   // the last of the names of bars
  Rectangle area_;                           // [pixels]
  std::vector<Rectangle> own_texts_;         // that labels keep off
  std::string out_;
};

}  // namespace

std::string in_quotes(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'') out += c;
    out += c;
  }
  return out + "'";
}

std::string plot_script(const Plot& plot) { return Drawing(plot).script(); }

}  // namespace app
