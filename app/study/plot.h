#pragma once
// Data -> a plot, as SVG for pages and PNG for slides, drawn by gnuplot. Ticks, legend and the places of labels are computed here: gnuplot
// puts labels on top of each other.
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"

namespace app {

enum class Style {
  points,
  lines,
  linespoints,
  stack,    // areas on top of each other over x; with Plot::categories bars, one a category
  front,    // a wide grey line below all else: a Pareto front, a slope to compare with
};

struct Series {
  std::string label = {};          // in the legend; empty: none
  std::vector<double> x = {}, y = {};   // of one length; in stacks of categories x is ignored and y has one value a category
  std::vector<double> low = {}, high = {};   // ends of the error bars of y, or empty
  std::vector<double> x_low = {}, x_high = {};   // of those of x, of points only; not beside those of y
  Style style = Style::lines;
};

/// A text beside a point of the plot; it is moved to where it covers nothing, with a line to its point if that is not next to it.
struct PointLabel {
  double x = 0, y = 0;
  std::string text = {};
};

struct Plot {
  std::string title = {}, x_label = {}, y_label = {};   // units in brackets
  bool whole_x = false;                   // x counts: ticks at whole numbers alone
  bool log_x = false, log_y = false;      // what is 0 or below cannot be shown then, and a line below the plot says how much that is
  std::vector<Series> series = {};
  std::vector<PointLabel> labels = {};
  std::vector<std::string> categories = {};   // names of horizontal bars, from the top; the values' axis is x
  std::optional<double> floor = {};       // of y: what lies below is noise, and is shaded
  bool from_zero = false;                 // the linear axis of y shows 0
  std::optional<double> reach = {};       // of the values' axis, where it is linear: what goes further, up or down, is cut off there
  std::string note = {};                  // a line below all, in small letters
  int width = 960, height = 540;          // [pixels] of the SVG, letters being 16 high; a plot shown at half a page's width wants 640 x 400
};

/// Whether there are no plots because there is no gnuplot: a page does without them then, and says so.
bool is_without_gnuplot(const base::Error&);

/// Texts of SVG files, one a plot, through one start of gnuplot. Throws base::Error: exit 5 where gnuplot is missing or fails, 1 for a value
/// that is not finite or series of unequal length.
std::vector<std::string> svg_of(std::span<const Plot>);

/// Both files of several plots through one start of gnuplot, and the texts of the SVGs.
std::vector<std::string> write_plots(std::span<const Plot>, std::span<const std::filesystem::path> stems);

/// `stem`.svg and `stem`.png (of twice the size), each atomically. Throws as svg_of does, and exit 5 where they cannot be written.
void write_plot(const Plot&, const std::filesystem::path& stem);

/// The `most` series with the largest sums of |y| in their order, and the rest as one named "other".
std::vector<Series> largest_series(std::vector<Series>, std::size_t most);

}  // namespace app
