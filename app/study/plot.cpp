#include "app/study/plot.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string_view>

#include "app/stages/program.h"
#include "app/study/plot_script.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/scratch_folder.h"

namespace app {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kCannotStart = "gnuplot cannot be started: ";

std::string terminal_svg(const Plot& plot, const fs::path& file) {
  return "set terminal svg size " + std::to_string(plot.width) + "," + std::to_string(plot.height)
      + " dynamic background '#ffffff' font 'DejaVu Sans,16'\nset output " + in_quotes(file.string()) + "\n";
}

/// Twice the size of the SVG; this terminal's letters are in points of 4/3 pixels.
std::string terminal_png(const Plot& plot, const fs::path& file) {
  return "set terminal pngcairo size " + std::to_string(2 * plot.width) + "," + std::to_string(2 * plot.height) +
         " background '#ffffff' font 'DejaVu Sans,16' fontscale 1.5 linewidth 2 pointscale 3\nset output " + in_quotes(file.string()) + "\n";
}

void run_gnuplot(const fs::path& folder, const std::string& script, const std::string& made) {
  const fs::path file = folder / "script.gp";
  base::write_text_atomically(file, script);
  const ProgramEnd end = run_program({"gnuplot", "--default-settings", file.string()}, made, [](int) {});
  if (!end.started)
    throw base::Error({.code = base::Exit::io, .file = made, .hint = "apt-get install gnuplot-nox",
                       .message = std::string(kCannotStart) + end.said});
  if (!end.well) base::throw_io(made, "gnuplot: " + (end.said.empty() ? "failed" : end.said));
}

/// The font that gnuplot names has the widths of Verdana, which other systems have.
std::string with_fonts(std::string svg) {
  const std::string named = "font-family=\"DejaVu Sans\"", families = "font-family=\"DejaVu Sans,Verdana,sans-serif\"";
  const std::string bold = "font-family=\"DejaVu Sans Bold\"", bold_families = "font-weight=\"bold\" font-family=\"DejaVu Sans,Verdana,sans-serif\"";
  for (const auto& [from, to] : {std::pair{named, families}, std::pair{bold, bold_families}})
    for (std::size_t at = 0; (at = svg.find(from, at)) != std::string::npos; at += to.size()) svg.replace(at, from.size(), to);
  return svg;
}

}  // namespace

bool is_without_gnuplot(const base::Error& e) { return e.complaint().message.starts_with(kCannotStart); }

std::vector<std::string> svg_of(std::span<const Plot> plots) {
  if (plots.empty()) return {};
  const base::ScratchFolder scratch;
  std::string script;
  const auto file = [&](std::size_t i) { return scratch.path() / (std::to_string(i) + ".svg"); };
  for (std::size_t i = 0; i < plots.size(); ++i) script += terminal_svg(plots[i], file(i)) + plot_script(plots[i]) + "unset output\n";
  run_gnuplot(scratch.path(), script, "plots");
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < plots.size(); ++i) texts.push_back(with_fonts(base::read_file(file(i))));
  return texts;
}

std::vector<std::string> write_plots(std::span<const Plot> plots, std::span<const fs::path> stems) {
  if (plots.size() != stems.size()) throw std::invalid_argument("as many names as plots");
  if (plots.empty()) return {};
  const base::ScratchFolder scratch;
  const auto drawn = [&](std::size_t i, const char* extension) { return scratch.path() / (std::to_string(i) + extension); };
  std::string script;
  for (std::size_t i = 0; i < plots.size(); ++i)
    script += terminal_svg(plots[i], drawn(i, ".svg")) + plot_script(plots[i]) + "unset output\n" + terminal_png(plots[i], drawn(i, ".png"))
        + "replot\nunset output\n";
  run_gnuplot(scratch.path(), script, stems[0].string() + ".svg");
  std::vector<std::string> svgs;
  for (std::size_t i = 0; i < plots.size(); ++i) {
    svgs.push_back(with_fonts(base::read_file(drawn(i, ".svg"))));
    fs::path svg = stems[i], png = stems[i];
    base::write_text_atomically(svg += ".svg", svgs.back());
    base::write_text_atomically(png += ".png", base::read_file(drawn(i, ".png")));
  }
  return svgs;
}

void write_plot(const Plot& plot, const fs::path& stem) { write_plots(std::span(&plot, 1), std::span(&stem, 1)); }

std::vector<Series> largest_series(std::vector<Series> series, std::size_t most) {
  if (series.size() <= most) return series;
  std::vector<std::size_t> order(series.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto size = [&](std::size_t k) {
    return std::accumulate(series[k].y.begin(), series[k].y.end(), 0.0, [](double sum, double v) { return sum + std::abs(v); });
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return size(a) > size(b); });
  std::vector<bool> kept(series.size(), false);
  std::size_t left = most;
  for (const std::size_t k : order)
    if (series[k].label != "other" && left > 0) kept[k] = true, --left;   // what is called so goes with the small ones
  std::vector<Series> result;
  Series other{.label = "other", .x = series[0].x, .y = std::vector<double>(series[0].y.size(), 0), .low = {}, .high = {}, .style = series[0].style};
  for (std::size_t k = 0; k < series.size(); ++k) {
    if (kept[k]) result.push_back(series[k]);
    else
      for (std::size_t i = 0; i < other.y.size() && i < series[k].y.size(); ++i) other.y[i] += series[k].y[i];
  }
  result.push_back(std::move(other));
  return result;
}

}  // namespace app
