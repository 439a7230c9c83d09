#include <algorithm>

#include <fmt/format.h>

#include "app/stages/machine.h"
#include "app/study/page.h"
#include "app/study/plot.h"
#include "app/study/verify.h"
#include "app/version.h"
#include "base/error.h"
#include "base/ledger.h"
#include "base/text.h"
#include "render/render.h"
#include "sim/drawn_shape.h"

namespace app {
namespace {

namespace fs = std::filesystem;

std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

std::string file_name(std::string name) {
  std::replace(name.begin(), name.end(), '/', '-');
  return name;
}

/// Where the case ended, as the preview draws it; empty where it has no picture.
fs::path draw(const Verdict& v, const fs::path& folder) {
  if (!v.found.picture || !v.found.scene || v.found.picture->position.empty()) return {};
  const sim::Scene& scene = *v.found.scene;
  render::Setting setting;
  setting.options.width = 320, setting.options.height = 180;
  setting.domain = scene.options.domain;
  setting.dimension = scene.options.dimension;
  for (const sim::Collider& c : scene.colliders) {
    setting.colliders.push_back(c);
    setting.colliders.back().shape = sim::drawn_shape_at(v.found.picture->time, c, scene.options);
  }
  double fastest = 0;
  for (const base::Vec3f& x : v.found.picture->velocity) fastest = std::max(fastest, double(x.norm()));
  const fs::path file = folder / (file_name(v.what.name) + ".png");
  base::Ledger ledger;
  render::write_png(file, render::preview(setting, *v.found.picture, "", std::max(fastest, 1e-6)), setting.options, /*display_referred=*/true,
                    ledger);
  return file;
}

Plot energy_plot(const std::string& family, const std::vector<const Verdict*>& members) {
  Plot plot;
  plot.title = family;
  plot.x_label = "time [s]", plot.y_label = "energy over the start's [1]";
  for (const Verdict* v : members) {
    std::string label = v->what.name.substr(std::min(v->what.name.size(), family.size() + 1));
    plot.series.push_back({.label = label, .x = v->found.time, .y = v->found.energy});
  }
  return plot;
}

using Members = std::vector<const Verdict*>;

/// Cases by the first part of their names, in their order.
std::vector<std::pair<std::string, Members>> families_of(const std::vector<Verdict>& all) {
  std::vector<std::pair<std::string, Members>> families;
  for (const Verdict& v : all) {
    const std::string name = v.what.name.substr(0, v.what.name.find('/'));
    auto found = std::find_if(families.begin(), families.end(), [&](const auto& f) { return f.first == name; });
    if (found == families.end()) found = families.insert(found, {name, {}});
    found->second.push_back(&v);
  }
  return families;
}

/// A table for each expectation that cases of a family share.
void add_tables(const std::string& family, const Members& members, Page& page) {
  std::vector<std::string> expectations;
  for (const Verdict* v : members)
    if (std::find(expectations.begin(), expectations.end(), v->what.expect) == expectations.end()) expectations.push_back(v->what.expect);
  for (const std::string& expect : expectations) {
    std::vector<std::vector<Cell>> rows;
    std::string source;
    for (const Verdict* v : members) {
      if (v->what.expect != expect) continue;
      source = v->what.source;
      std::string outcome = v->found.outcome;
      for (const std::string& b : v->found.broken) outcome += "; " + b;
      Cell verdict(v->passed ? "pass" : "FAIL");
      verdict.strong = !v->passed;
      const std::string& name = v->what.name;
      rows.push_back({name.size() > family.size() ? name.substr(family.size() + 1) : name, verdict, Cell(v->found.value), Cell(v->what.tolerance),
                      outcome});
    }
    page.paragraph("Expected: " + expect + ". Source: " + source + ".");
    page.table({"case", "", "value", "at most", "outcome"}, rows);
  }
}

/// Program, machine, counts by family and the slowest.
void add_overview(const std::vector<Verdict>& all, const std::vector<std::pair<std::string, Members>>& families, double seconds, int threads,
                  Page& page) {
  std::size_t passed = 0, curves = 0, pictures = 0;
  double sum = 0;
  std::vector<const Verdict*> slowest;
  for (const Verdict& v : all) {
    passed += v.passed, curves += v.found.energy.size() > 1, pictures += v.found.picture.has_value(), sum += v.seconds;
    slowest.push_back(&v);
  }
  page.subtitle(fmt::format("{}: {} pass, {} fail; {} more need what is not there", base::count_of(all.size(), "case"), passed, all.size() - passed,
                            cases_left_out().size()));
  page.facts({{"program", std::string("polypic ") + kVersion + (*kCommit ? std::string(" (") + kCommit + ")" : "")},
              {"machine", fmt::format("{}, {} threads", processor_name().empty() ? "unknown processor" : processor_name(), threads)},
              {"time", fmt::format("{:.0f} s; {:.0f} s of all cases, several at a time", seconds, sum)},
              {"shown", fmt::format("{} energy curves and {} pictures; the other cases simulate nothing, or nothing that has energy", curves,
                                    pictures)}});
  std::vector<std::vector<Cell>> rows;
  for (const auto& [name, members] : families) {
    std::int64_t good = 0, flat = 0;
    double time = 0;
    for (const Verdict* v : members) good += v->passed, flat += v->what.dimension == 2, time += v->seconds;
    const auto count = std::int64_t(members.size());
    Cell failed(fmt::format("{}", count - good), double(count - good));
    failed.strong = good < count;
    rows.push_back({spaced(name), Cell(std::to_string(count), double(count)), Cell(std::to_string(flat), double(flat)),
                    Cell(std::to_string(count - flat), double(count - flat)), Cell(std::to_string(good), double(good)),
                    failed, Cell(fmt::format("{:.1f}", time), time), members.front()->what.source});
  }
  page.heading("At a glance");
  page.table({"cases of", "count", "2d", "3d", "pass", "fail", "seconds", "source"}, rows);
  std::stable_sort(slowest.begin(), slowest.end(), [](const Verdict* a, const Verdict* b) { return a->seconds > b->seconds; });
  slowest.resize(std::min<std::size_t>(slowest.size(), 10));
  rows.clear();
  for (const Verdict* v : slowest) rows.push_back({v->what.name, Cell(fmt::format("{:.1f}", v->seconds), v->seconds)});
  page.heading("The slowest");
  page.table({"case", "seconds"}, rows);
}

}  // namespace

void write_verify_page(const std::vector<Verdict>& all, double seconds, int threads, const fs::path& folder) {
  fs::create_directories(folder / "pictures");
  Page page("Hard cases");
  const auto families = families_of(all);
  add_overview(all, families, seconds, threads, page);
  std::vector<Plot> plots;   // at most six curves each
  std::vector<std::size_t> plots_of;
  for (const auto& [name, members] : families) {
    Members curves;
    plots_of.push_back(plots.size());
    for (const Verdict* v : members) {
      if (v->found.energy.size() > 1) curves.push_back(v);
      if (curves.size() == 6) plots.push_back(energy_plot(name, curves)), curves.clear();
    }
    if (!curves.empty()) plots.push_back(energy_plot(name, curves));
  }
  plots_of.push_back(plots.size());
  std::vector<std::string> drawn;
  try {
    if (!plots.empty()) drawn = svg_of(plots);
  } catch (const base::Error& e) {
    if (!is_without_gnuplot(e)) throw;
    page.paragraph(std::string("No plots: ") + e.what());
    plots_of.assign(plots_of.size(), 0);
  }
  for (std::size_t f = 0; f < families.size(); ++f) {
    const auto& [name, members] = families[f];
    page.heading(spaced(name));
    add_tables(name, members, page);
    for (std::size_t k = plots_of[f]; k < plots_of[f + 1]; ++k) page.figure_of(drawn[k]);
    std::vector<fs::path> pictures;
    std::vector<std::string> labels;
    for (const Verdict* v : members)
      if (const fs::path file = draw(*v, folder / "pictures"); !file.empty())
        pictures.push_back(file), labels.push_back(v->what.name.substr(name.size() + 1));
    if (!pictures.empty()) page.contact_sheet(pictures, labels);
  }
  page.heading("Left out");
  std::vector<std::vector<Cell>> missing;
  for (const sim::CaseNotBuilt& c : cases_left_out()) missing.push_back({c.name, c.needs, c.source});
  page.table({"case", "needs", "source"}, missing);
  page.write(folder / "report.html");
}

}  // namespace app
