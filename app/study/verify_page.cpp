#include <algorithm>
#include <cmath>

#include "app/study/page.h"
#include "app/study/plot.h"
#include "app/study/verify.h"
#include "base/ledger.h"
#include "render/render.h"

namespace app {
namespace {

namespace fs = std::filesystem;

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
    setting.colliders.back().shape = sim::shape_at(v.found.picture->time, c, scene.options);
  }
  double fastest = 0;
  for (const base::Vec3f& x : v.found.picture->velocity) fastest = std::max(fastest, double(x.norm()));
  const fs::path file = folder / (file_name(v.what.name) + ".png");
  base::Ledger ledger;
  render::write_png(file, render::preview(setting, *v.found.picture, "", std::max(fastest, 1e-6)), setting.options, /*display_referred=*/true, ledger);
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

}  // namespace

void write_verify_page(const std::vector<Verdict>& all, const fs::path& folder) {
  fs::create_directories(folder / "pictures");
  Page page("Hard cases");
  std::int64_t passed = 0;
  double seconds = 0;
  for (const Verdict& v : all) passed += v.passed, seconds += v.seconds;
  page.subtitle(std::to_string(all.size()) + " cases, " + std::to_string(passed) + " pass");
  std::vector<std::vector<Cell>> rows;
  for (const Verdict& v : all) {
    std::string outcome = v.found.outcome;
    for (const std::string& b : v.found.broken) outcome += "; " + b;
    Cell verdict(v.passed ? "pass" : "FAIL");
    verdict.strong = !v.passed;
    rows.push_back({v.what.name, verdict, Cell(v.found.value), Cell(v.what.tolerance), outcome, v.what.expect, v.what.source, Cell(v.seconds)});
  }
  page.table({"case", "", "value", "at most", "outcome", "expected", "source", "s"}, rows);
  page.heading("Not built");
  std::vector<std::vector<Cell>> missing;
  for (const sim::CaseNotBuilt& c : sim::cases_not_built()) missing.push_back({c.name, c.needs, c.source});
  page.table({"case", "needs", "source"}, missing);

  page.heading("Energy");
  std::vector<std::string> families;
  std::vector<std::vector<const Verdict*>> members;
  for (const Verdict& v : all) {
    if (v.found.energy.size() < 2) continue;
    std::string family = v.what.name.substr(0, v.what.name.find('/'));
    if (families.empty() || families.back() != family || members.back().size() >= 6) families.push_back(family), members.emplace_back();
    members.back().push_back(&v);
  }
  std::vector<Plot> plots;
  for (std::size_t f = 0; f < families.size(); ++f) plots.push_back(energy_plot(families[f], members[f]));
  if (!plots.empty())
    for (const std::string& svg : svg_of(plots)) page.figure_of(svg);

  page.heading("Where they ended");
  std::vector<fs::path> pictures;
  std::vector<std::string> labels;
  for (const Verdict& v : all)
    if (const fs::path file = draw(v, folder / "pictures"); !file.empty()) pictures.push_back(file), labels.push_back(v.what.name);
  if (!pictures.empty()) page.contact_sheet(pictures, labels);
  page.write(folder / "report.html");
}

}  // namespace app
