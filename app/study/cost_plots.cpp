#include "app/study/cost_plots.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <set>

#include <fmt/format.h>

#include "app/study/time_to_error.h"

namespace app {
namespace {

constexpr std::size_t kMostStages = 10;       // with colours of their own
constexpr std::size_t kMostNamed = 12;        // points of a plot that are called by name; of more only those on the front of the deciding error
constexpr int kHalfWidth = 640, kHalfHeight = 420;   // [pixels] of plots that stand in pairs

std::string title(const Study& study, const StudyCase& part, const std::string& what) {
  return study.cases.size() > 1 ? what + ": " + part.name : what;
}

/// Those that no other beats in both error and seconds; of the deciding error the study says which.
std::vector<const Variant*> front_of(std::vector<const Variant*> variants, const StudyCase& part, Measure measure) {
  std::erase_if(variants, [&](const Variant* v) { return !v->errors[measure]; });
  std::stable_sort(variants.begin(), variants.end(), [](const Variant* a, const Variant* b) { return a->seconds_median < b->seconds_median; });
  std::vector<const Variant*> front;
  for (const Variant* v : variants)
    if (measure == part.decides ? v->pareto : front.empty() || *v->errors[measure] < *front.back()->errors[measure]) front.push_back(v);
  return front;
}

/// Curves that stay near their start are shown without the emptiness below them.
bool falls(const std::vector<Series>& curves) {
  double least = 1, most = 0;
  for (const Series& s : curves)
    for (const double v : s.y) least = std::min(least, v), most = std::max(most, v);
  return least < 0.7 * most;
}

/// Where one variant goes far beyond the others, all would lie in a line along the axis: it is cut off, and the plot says how far it goes.
void cut_off(Plot& plot, const std::vector<std::pair<std::string, double>>& largest) {
  constexpr double kFar = 8;
  std::vector<double> sorted;
  for (const auto& [name, value] : largest) sorted.push_back(value);
  std::sort(sorted.begin(), sorted.end());
  if (sorted.size() < 3) return;
  const double usual = kFar * sorted[sorted.size() / 2];
  if (!(usual > 0) || sorted.back() <= usual) return;
  plot.reach = 1.2 * *std::prev(std::upper_bound(sorted.begin(), sorted.end(), usual));
  for (const auto& [name, value] : largest)
    if (value > usual) plot.note += (plot.note.empty() ? "" : "; ") + name + " is cut off, and goes to " + fmt::format("{:.3g}", value);
}

Series lines(const Variant& variant, const std::vector<double>& y) {
  return {.label = variant.label, .x = variant.course.time, .y = y, .style = Style::lines};
}

void cut_off_curves(Plot& plot) {
  std::vector<std::pair<std::string, double>> largest;
  for (const Series& s : plot.series) {
    double most = 0;
    for (const double v : s.y) most = std::max(most, std::abs(v));
    largest.emplace_back(s.label, most);
  }
  cut_off(plot, largest);
}

/// Those of the front, and of the others as many as have a colour of their own.
void add_curves(Plot& plot, const std::vector<const Variant*>& variants, std::vector<double> Course::*values) {
  std::vector<const Variant*> all;
  for (const Variant* v : variants)
    if (!(v->course.*values).empty()) all.push_back(v);
  std::vector<const Variant*> others;
  std::copy_if(all.begin(), all.end(), std::back_inserter(others), [](const Variant* v) { return !v->pareto; });
  const std::size_t most_others = kMostStages - std::min(kMostStages, all.size() - others.size());
  if (others.size() > most_others) {
    plot.note = std::to_string(others.size() - most_others) + " variants that are not on the front are left out";
    others.resize(most_others);
  }
  for (const Variant* v : all)
    if (v->pareto || std::find(others.begin(), others.end(), v) != others.end()) plot.series.push_back(lines(*v, v->course.*values));
  plot.from_zero = falls(plot.series);
  cut_off_curves(plot);
}

/// Of the variant in its case, from 1: that of the report's table.
std::size_t row_of(const Study& study, const Variant& variant) {
  std::size_t row = 0;
  for (const Variant& v : study.variants) {
    row += v.part == variant.part;
    if (&v == &variant) break;
  }
  return row;
}

/// Passes and stages of a step in the order of the flow; others come after them, by name.
constexpr std::array kFlow = {"sort", "p2g", "sums", "stress", "forces", "pressure", "reflect", "extrapolate", "volume", "grid_update",
                              "contact", "g2p", "advect", "collide", "plasticity", "carry", "watch", "write_points", "checkpoint"};

std::size_t place_in_flow(const std::string& name) {
  return static_cast<std::size_t>(std::find(kFlow.begin(), kFlow.end(), name) - kFlow.begin());
}

/// Bars of `values` by name for each variant, the small ones as "other".
std::vector<Series> bars(const std::vector<const Variant*>& variants, const std::vector<std::map<std::string, double>>& values) {
  std::set<std::string> names;
  for (const auto& all : values)
    for (const auto& [name, value] : all) names.insert(name);
  std::vector<Series> series;
  std::vector<std::string> ordered(names.begin(), names.end());
  std::stable_sort(ordered.begin(), ordered.end(), [](const std::string& a, const std::string& b) { return place_in_flow(a) < place_in_flow(b); });
  for (const std::string& name : ordered) {
    Series one{.label = name, .style = Style::stack};
    for (std::size_t i = 0; i < variants.size(); ++i) {
      const auto found = values[i].find(name);
      one.y.push_back(found == values[i].end() ? 0 : found->second);
    }
    if (std::any_of(one.y.begin(), one.y.end(), [](double v) { return v != 0; })) series.push_back(std::move(one));
  }
  return largest_series(std::move(series), kMostStages);
}

std::optional<Plot> bar_plot(const std::vector<const Variant*>& variants, const std::vector<std::map<std::string, double>>& values,
    const std::string& name, const std::string& axis, bool cuts) {
  Plot plot{.title = name, .x_label = axis, .series = bars(variants, values), .width = kHalfWidth,
            .height = std::max(kHalfHeight, 150 + 34 * static_cast<int>(variants.size()))};
  std::vector<std::pair<std::string, double>> largest;
  for (std::size_t i = 0; i < variants.size(); ++i) {
    double up = 0, down = 0;
    for (const auto& [stage, value] : values[i]) (value > 0 ? up : down) += std::abs(value);
    plot.categories.push_back(variants[i]->label);
    largest.emplace_back(variants[i]->label, std::max(up, down));
  }
  if (cuts) cut_off(plot, largest);
  if (plot.series.empty()) return {};
  return plot;
}

/// Of what was refined: a line a scheme, through the variants that none of its others beats.
void add_schemes(Plot& plot, const Study& study, const StudyCase& part) {
  for (const std::string& scheme : schemes_of(study, part)) {
    Series line{.label = scheme, .style = Style::linespoints};
    for (const Variant* v : own_front(study, part, scheme)) line.x.push_back(v->seconds_median), line.y.push_back(*v->errors[part.decides]);
    if (!line.x.empty()) plot.series.push_back(std::move(line));
  }
}

/// Of what was refined those on the front alone: there are many.
std::vector<const Variant*> with_bars(const Study& study, const StudyCase& part) {
  std::vector<const Variant*> variants = variants_of(study, part);
  if (study.is_refined) std::erase_if(variants, [](const Variant* v) { return !v->pareto; });
  return variants;
}

}  // namespace

std::vector<const Variant*> variants_of(const Study& study, const StudyCase& part) {
  std::vector<const Variant*> variants;
  for (const Variant& v : study.variants)
    if (v.part == part.name && v.ran()) variants.push_back(&v);
  return variants;
}

std::optional<Plot> error_plot(const Study& study, const StudyCase& part, Measure measure) {
  const std::string name(kMeasureNames[static_cast<std::size_t>(measure)]);
  Plot plot{.title = title(study, part, "Error of " + name + " against seconds"), .x_label = "seconds of the clock [s]",
            .y_label = "error of " + name + " [1]", .log_x = true, .log_y = true};
  plot.floor = part.noise[measure];
  const std::vector<const Variant*> variants = variants_of(study, part);
  Series front{.label = "Pareto front", .style = Style::front};
  const std::vector<const Variant*> on_front = front_of(variants, part, measure);
  for (const Variant* v : on_front) front.x.push_back(v->seconds_median), front.y.push_back(*v->errors[measure]);
  if (front.x.size() > 1) plot.series.push_back(front);
  if (study.is_refined && measure == part.decides) {
    add_schemes(plot, study, part);
    if (std::none_of(plot.series.begin(), plot.series.end(), [](const Series& s) { return s.x.size() > 1; })) return {};
    plot.height = 640;
    plot.note = "of each scheme what none of its other variants beats";
    return plot;
  }
  std::vector<std::string> transfers;   // a colour each
  for (const Variant* v : variants)
    if (v->errors[measure] && std::find(transfers.begin(), transfers.end(), v->transfer) == transfers.end()) transfers.push_back(v->transfer);
  for (const std::string& transfer : transfers) {
    Series points{.label = transfer, .style = Style::points};
    for (const Variant* v : variants) {
      if (!v->errors[measure] || v->transfer != transfer) continue;
      points.x.push_back(v->seconds_median), points.y.push_back(*v->errors[measure]);
      points.x_low.push_back(v->seconds_min), points.x_high.push_back(v->seconds_max);
      const bool is_front = measure == part.decides && std::find(on_front.begin(), on_front.end(), v) != on_front.end();
      const bool by_name = variants.size() <= kMostNamed || is_front;
      if (!by_name) plot.note = "numbers: rows of the table of variants";
      plot.labels.push_back({v->seconds_median, *v->errors[measure], by_name ? v->label : std::to_string(row_of(study, *v))});
    }
    plot.series.push_back(std::move(points));
  }
  if (plot.labels.size() < 2) return {};
  return plot;
}

std::optional<Plot> energy_plot(const Study& study, const StudyCase& part) {
  Plot plot{.title = title(study, part, "Energy"), .x_label = "time [s]", .y_label = "energy over that at the start [1]"};
  if (study.reference && !study.reference->course.energy.empty()) {
    plot.series.push_back(lines(*study.reference, study.reference->course.energy));
    plot.series.back().style = Style::front;
  }
  add_curves(plot, variants_of(study, part), &Course::energy);
  if (plot.series.empty()) return {};
  return plot;
}

std::optional<Plot> enstrophy_plot(const Study& study, const StudyCase& part) {
  Plot plot{.title = title(study, part, "Enstrophy"), .x_label = "time [s]", .y_label = "enstrophy over that at the start [1]"};
  add_curves(plot, variants_of(study, part), &Course::enstrophy);
  if (plot.series.empty()) return {};
  return plot;
}

std::optional<Plot> seconds_plot(const Study& study, const StudyCase& part) {
  const std::vector<const Variant*> variants = with_bars(study, part);
  std::vector<std::map<std::string, double>> values;
  for (const Variant* v : variants) {
    values.emplace_back();
    for (const auto& [name, pass] : v->passes) values.back()[name] = pass.seconds;
  }
  std::optional<Plot> plot = bar_plot(variants, values, title(study, part, "Seconds by pass"), "seconds of the clock [s]", /*cuts=*/false);
  if (plot && plot->series.size() > kMostStages) plot->note = "other: the smaller passes, and what no pass counts";
  return plot;
}

std::optional<Plot> losses_plot(const Study& study, const StudyCase& part) {
  const std::vector<const Variant*> variants = with_bars(study, part);
  std::vector<std::map<std::string, double>> values;
  for (const Variant* v : variants) {
    values.emplace_back();
    for (const auto& [name, change] : v->energy_changes) values.back()[name] = 100 * change;
  }
  return bar_plot(variants, values, title(study, part, "Where the energy goes"), "change of the energy, of that at the start [%]", /*cuts=*/true);
}

}  // namespace app
