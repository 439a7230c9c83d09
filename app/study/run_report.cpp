#include "app/study/run_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "app/plan/limits.h"
#include "app/plan/plan.h"
#include "app/study/page.h"
#include "app/study/plot.h"
#include "base/error.h"
#include "base/text.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostPictures = 24;   // of the contact sheet
constexpr int kHalfWidth = 640, kHalfHeight = 400;   // [pixels] of plots that stand in pairs
constexpr std::size_t kMostPasses = 8;      // with colours of their own

std::string number(const char* form, double value) {
  char text[64];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

/// Frames that were simulated, as columns.
class Columns {
 public:
  explicit Columns(const Json& run) {
    for (const Json& frame : run.at("frames"))
      if (frame.contains("kinetic_energy")) frames_.push_back(&frame);
  }
  bool empty() const { return frames_.empty(); }
  std::size_t size() const { return frames_.size(); }
  bool has(const char* key) const {
    return std::any_of(frames_.begin(), frames_.end(), [&](const Json* f) { return f->contains(key); });
  }
  /// Of the frames that have it: the first knows of no step.
  std::vector<double> of(const char* key) const {
    std::vector<double> values;
    for (const Json* frame : frames_)
      if (frame->contains(key)) values.push_back(frame->at(key).get<double>());
    return values;
  }
  Series series(const std::string& label, const char* key) const {
    Series s{.label = label, .y = of(key)};
    for (const Json* frame : frames_)
      if (frame->contains(key)) s.x.push_back(frame->at("time").get<double>());
    return s;
  }
  std::vector<double> of(const char* key, std::size_t axis) const {
    std::vector<double> values;
    for (const Json* frame : frames_) values.push_back(frame->at(key).at(axis).get<double>());
    return values;
  }

 private:
  std::vector<const Json*> frames_;
};

std::vector<double> sum(const std::vector<Series>& series) {
  std::vector<double> total = series[0].y;
  for (std::size_t k = 1; k < series.size(); ++k)
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += series[k].y[i];
  return total;
}

std::vector<Series> energies(const Columns& columns) {
  std::vector<Series> series;
  for (const auto& [key, label] : {std::pair{"kinetic_energy", "kinetic"}, {"potential_energy", "potential"}, {"elastic_energy", "elastic"}})
    if (columns.has(key)) series.push_back(columns.series(label, key));
  std::erase_if(series, [](const Series& s) { return std::all_of(s.y.begin(), s.y.end(), [](double v) { return v == 0; }); });
  if (series.size() > 1) series.push_back({.label = "sum", .x = series[0].x, .y = sum(series)});
  return series;
}

Plot vector_plot(const Columns& columns, const char* key, const std::string& title, const std::string& y_label, std::int64_t dimension) {
  Plot plot{.title = title, .x_label = "time [s]", .y_label = y_label, .width = kHalfWidth, .height = kHalfHeight};
  const bool is_turn_in_plane = dimension == 2 && std::string(key) == "angular_momentum";   // one axis, out of the plane
  for (std::size_t axis = is_turn_in_plane ? 2 : 0; axis < (is_turn_in_plane ? 3u : static_cast<std::size_t>(dimension)); ++axis)
    plot.series.push_back({.label = std::string(1, "xyz"[axis]), .x = columns.of("time"), .y = columns.of(key, axis)});
  return plot;
}

/// Of a liquid by its surface, of solids by their particles; empty where neither is known.
std::optional<Plot> volume_plot(const Columns& columns) {
  Plot plot{.title = "Volume", .x_label = "time [s]", .y_label = {}, .width = kHalfWidth, .height = kHalfHeight};
  const auto add = [&](const char* label, const char* key, double less) {
    if (!columns.has(key)) return;
    plot.series.push_back(columns.series(label, key));
    for (double& v : plot.series.back().y) v = 100 * (v - less);
  };
  plot.y_label = "by the surface, over that of the particles, less 1 [%]";
  add("", "volume_drift", 0);
  if (!plot.series.empty()) return plot;
  plot.y_label = "of a particle, over that at rest, less 1 [%]";
  add("least", "least_volume", 1), add("most", "most_volume", 1);
  if (plot.series.empty()) return {};
  return plot;
}

/// Every frame of the run, and every pass that ran in the order in which passes first appear in the flow.
struct PassTable {
  std::vector<double> frames;
  std::vector<std::string> names;
  std::map<std::string, std::vector<double>> seconds;   // a value a frame
  std::map<std::string, double> calls, cpu_seconds, bytes;
};

PassTable passes_of(const Json& run) {
  PassTable table;
  std::vector<std::string> order;
  for (const Json& pass : run.at("plan").at("passes")) order.push_back(pass.get<std::string>());
  for (const Json& frame : run.at("frames")) {
    table.frames.push_back(frame.at("frame").get<double>());
    for (const auto& [name, cost] : frame.at("passes").items()) {
      auto& seconds = table.seconds[name];
      seconds.resize(table.frames.size(), 0);
      seconds.back() = cost.at("seconds").get<double>();
      table.calls[name] += cost.at("calls").get<double>();
      table.cpu_seconds[name] += cost.at("cpu_seconds").get<double>();
      table.bytes[name] += cost.at("bytes").get<double>();
    }
  }
  for (auto& [name, seconds] : table.seconds) {
    seconds.resize(table.frames.size(), 0);
    table.names.push_back(name);
  }
  const auto place = [&](const std::string& name) { return std::find(order.begin(), order.end(), name) - order.begin(); };
  std::stable_sort(table.names.begin(), table.names.end(), [&](const std::string& a, const std::string& b) { return place(a) < place(b); });
  return table;
}

Plot seconds_plot(const PassTable& passes) {
  Plot plot{.title = "Seconds a frame, by pass", .x_label = "frame", .y_label = "seconds of the clock [s]", .whole_x = true};
  for (const std::string& name : passes.names)
    plot.series.push_back({.label = name, .x = passes.frames, .y = passes.seconds.at(name), .style = Style::stack});
  plot.series = largest_series(std::move(plot.series), kMostPasses);
  return plot;
}

void add_pass_table(Page& page, const PassTable& passes) {
  double all = 0;
  for (const auto& [name, seconds] : passes.cpu_seconds) all += seconds;
  std::vector<std::vector<Cell>> rows;
  for (const std::string& name : passes.names) {
    double seconds = 0;
    for (const double s : passes.seconds.at(name)) seconds += s;
    const double cpu = passes.cpu_seconds.at(name), share = all > 0 ? 100 * cpu / all : 0, bytes = passes.bytes.at(name) / 1e9;
    rows.push_back({name, Cell(number("%.0f", passes.calls.at(name)), passes.calls.at(name)), Cell(number("%.3f", seconds), seconds),
        Cell(number("%.3f", cpu), cpu),
                    Cell(number("%.1f", share), share), Cell(number("%.2f", bytes), bytes)});
  }
  page.table({"pass", "calls", "seconds [s]", "CPU seconds [s]", "share of CPU [%]", "read and written [GB]"}, rows);
}

/// What a reader wants to know first.
std::vector<std::string> sentences(const Json& run, const Columns& columns) {
  std::map<std::string, double> stages;
  double seconds = 0;
  for (const Json& frame : run.at("frames"))
    for (const auto& [stage, spent] : frame.at("seconds").items()) stages[stage] += spent.get<double>(), seconds += spent.get<double>();
  std::string text = base::count_of(run.at("frames").size(), "frame") + " in " + base::duration_text(seconds);
  const std::pair<const char*, const char*> kNames[] = {{"simulate", "simulation"}, {"surface", "surface"}, {"render", "pictures"}};
  std::string parts;
  for (const auto& [stage, name] : kNames)
    if (stages.contains(stage) && seconds > 0)
      parts += (parts.empty() ? ": " : ", ") + std::string(name)
        + number(" %.0f %%", 100 * stages[stage] / seconds);
  std::vector<std::string> all = {text + parts + "."};
  if (columns.size() < 2) return all;
  const std::vector<Series> kinds = energies(columns);
  if (!kinds.empty()) {
    const std::vector<double>& total = kinds.back().y;
    if (total.front() > 0)
      all.push_back("Energy: " + number("%.3g J", total.front()) + " at the first frame, " + number("%.3g J", total.back()) + " at the last ("
          + number("%+.1f %%", 100 * (total.back() / total.front() - 1)) + ").");
  }
  if (columns.has("volume_drift")) {
    double worst = 0;
    for (const double v : columns.of("volume_drift")) worst = std::abs(v) > std::abs(worst) ? v : worst;
    all.push_back("Volume by the surface: at most " + number("%+.2f %%", 100 * worst) + " from that of the particles.");
  }
  return all;
}

void add_plots(Page& page, const Columns& columns, const PassTable& passes, std::int64_t dimension, base::Progress& progress) {
  std::vector<Plot> plots;
  if (!columns.empty()) {
    plots.push_back({.title = "Energy", .x_label = "time [s]", .y_label = "energy [J]", .series = energies(columns), .from_zero = true,
                     .width = kHalfWidth, .height = kHalfHeight});
    if (std::optional<Plot> volume = volume_plot(columns)) plots.push_back(std::move(*volume));
    plots.push_back(vector_plot(columns, "linear_momentum", "Momentum", "momentum [kg m/s]", dimension));
    plots.push_back(vector_plot(columns, "angular_momentum", "Angular momentum", "about the lower corner of the domain [kg m²/s]", dimension));
  }
  if (!passes.names.empty()) plots.push_back(seconds_plot(passes));
  try {
    std::vector<std::string> svgs = svg_of(plots);
    if (svgs.empty()) return;
    const std::string seconds = passes.names.empty() ? "" : svgs.back();
    if (!seconds.empty()) svgs.pop_back();
    if (!svgs.empty()) {
      page.heading("What was conserved");
      page.figures_of(svgs);
    }
    if (seconds.empty()) return;
    page.heading("Where the time went");
    page.figure_of(seconds);
  } catch (const base::Error& e) {   // a page without plots is better than a run that fails at its end
    progress.line(std::string("report without plots: ") + e.what());
    page.paragraph(std::string("No plots: ") + e.what());
  }
}

void add_pictures(Page& page, const Folder& folder, const Json& run, double fps) {
  std::vector<std::int64_t> rendered;
  for (const Json& frame : run.at("frames"))
    if (frame.at("seconds").contains("render")) rendered.push_back(frame.at("frame"));
  for (const Stage stage : {Stage::render, Stage::preview}) {
    const std::vector<std::int64_t> frames = stage == Stage::render ? rendered : folder.recorded_frames(stage);
    if (frames.empty()) continue;
    const std::size_t count = std::min(kMostPictures, frames.size());
    std::vector<fs::path> files;
    std::vector<std::string> labels;
    for (std::size_t i = 0; i < count; ++i) {   // the first, the last, and those evenly between
      const std::int64_t frame = frames[count == 1 ? 0 : i * (frames.size() - 1) / (count - 1)];
      files.push_back(stage == Stage::render ? folder.image(frame, ".png") : folder.preview(frame));
      labels.push_back("frame " + std::to_string(frame) + ", t = " + number("%.3f s", static_cast<double>(frame - 1) / fps));
    }
    page.heading(count == frames.size() ? "Frames" : std::to_string(count) + " of " + std::to_string(frames.size()) + " frames");
    page.contact_sheet(files, labels);
    return;
  }
}

void add_facts(Page& page, const Shot& shot, const Json& run, const Columns& columns, const std::string& command) {
  page.heading("How it was made");
  std::vector<std::pair<std::string, std::string>> facts;
  if (!command.empty()) facts.push_back({"command", command});
  facts.push_back({"plan", plan_line(shot)});
  const Json& program = run.at("program");
  facts.push_back({"program", "polypic " + program.at("version").get<std::string>() + (program.contains("commit") ? " ("
      + program.at("commit").get<std::string>() + ")" : "")});
  for (const auto& [stage, hash] : run.at("hashes").items()) facts.push_back({"hash, " + stage, hash.get<std::string>()});
  if (!columns.empty()) {
    const std::vector<double> particles = columns.of("particles"), steps = columns.of("substeps");
    double all = 0;
    for (const double s : steps) all += s;
    facts.push_back({"particles", number("%.0f", particles.back())});
    facts.push_back({"steps", number("%.0f", all)});
  }
  facts.push_back({"machine", std::to_string(run.at("threads").get<int>()) + " threads, " + run.at("isa").get<std::string>() + ", "
      + bytes_text(run.at("peak_bytes").get<double>()) + " at most"});
  page.facts(facts);
  page.details("The shot as run", shot.resolved);
}

}  // namespace

void write_run_report(const Folder& folder, const Shot& shot, const Json& run, const std::string& command, base::Progress& progress) {
  const std::int64_t dimension = shot.scene.options.dimension;
  const Columns columns(run);
  const PassTable passes = passes_of(run);
  Page page(shot.name);
  page.subtitle(transfer_text(shot.scene.options) + ", quality " + shot.quality);
  page.lead(sentences(run, columns));
  add_pictures(page, folder, run, shot.fps);
  add_plots(page, columns, passes, dimension, progress);
  if (!passes.names.empty()) add_pass_table(page, passes);
  add_facts(page, shot, run, columns, command);
  page.write(folder.report());
}

}  // namespace app
