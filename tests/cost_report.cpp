// The page and the plots of a study of what accuracy costs.
#include <gtest/gtest.h>

#include <cstdlib>

#include "app/study/cost_plots.h"
#include "app/study/cost_report.h"
#include "app/study/front.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/scratch_folder.h"
#include "render/render.h"

namespace {

namespace fs = std::filesystem;

std::size_t count_of(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += word.size()) ++count;
  return count;
}

app::Variant variant(const std::string& part, const std::string& label, const std::string& transfer, double seconds, double error) {
  app::Variant v{.label = label, .scheme = label, .part = part, .keys = {{"sim.transfer", transfer}}, .transfer = transfer, .modes = "", .kernel = "linear",
      .splitting = "lie", .failure = "", .errors = {}, .seconds = {},
                 .passes = {}, .energy_changes = {}, .course = {}, .ties = {}, .pictures = {}};
  v.steps = 100;
  v.seconds_median = seconds, v.seconds_min = 0.9 * seconds, v.seconds_max = 1.1 * seconds, v.cpu_seconds = seconds;
  v.errors[app::Measure::energy] = error;
  v.errors[app::Measure::vorticity] = 2 * error;
  v.passes = {{"p2g", {.calls = 100, .seconds = 0.3 * seconds, .cpu_seconds = 0}}, {"pressure", {.calls = 100, .seconds = 0.5 * seconds,
      .cpu_seconds = 0}}};
  v.energy_changes = {{"p2g", -0.7 * error}, {"pressure", -0.2 * error}, {"advect", -0.1 * error}};
  v.course = {.time = {0, 1, 2}, .energy = {1, 1 - error / 2, 1 - error}, .enstrophy = {1, 1, 1 - error}};
  return v;
}

app::Study study() {
  app::Study s{.subject = "vortices <2d>", .title = "steady, so any loss is an error", .command = "polypic cost vortices", .version = "0.1.0",
      .commit = "abc", .repeats = 5, .processor = "Zen", .cores = 4, .meaning = {}, .cases = {}, .variants = {},
               .reference = {}, .notes = {"a note"}};
  for (const std::string part : {"16 cells", "8 cells"}) {
    s.cases.push_back({.name = part, .decides = app::Measure::energy, .sentences = {"Best of " + part + ".", "The next costs more.",
        "The one below loses more."}, .noise = {}});
    s.variants.push_back(variant(part, "pic", "pic", 1, 0.5));
    s.variants.push_back(variant(part, "apic", "apic", 1.5, 0.6));
    s.variants.push_back(variant(part, "polypic full", "polypic", 2, 0.1));
    for (const std::size_t k : {1u, 3u}) s.variants[s.variants.size() - k].pareto = true;
    s.variants.push_back({.label = "broken", .scheme = "broken", .part = part, .keys = {}, .transfer = "", .modes = "", .kernel = "", .splitting = "", 
                          .failure = "needs more <modes>", .errors = {}, .seconds = {}, .passes = {},
                          .energy_changes = {}, .course = {}, .ties = {}, .pictures = {}});
  }
  s.variants[0].ties = {"apic"};
  return s;
}

class CostReport : public testing::Test {
 protected:
  std::string written(const app::Study& s) const {
    base::Progress progress(stderr, /*quiet=*/true);
    app::write_cost_report(s, folder.path(), progress);
    return base::read_file(folder.path() / "report.html");
  }
  const base::ScratchFolder folder;
};

}  // namespace

TEST_F(CostReport, BeginsWithThreeSentencesACaseAndShowsEveryVariant) {
  const std::string html = written(study());
  EXPECT_EQ(count_of(html, "<strong>16 cells</strong> Best of 16 cells. The next costs more. The one below loses more.<"), 1u);
  EXPECT_EQ(count_of(html, "<strong>8 cells</strong> Best of 8 cells."), 1u);
  EXPECT_LT(html.find("Best of 8 cells."), html.find("<svg")) << "on top";
  EXPECT_EQ(count_of(html, "<tr><td>"), 8u) << "a row a variant";
  EXPECT_EQ(count_of(html, ">could not run<"), 2u);
  EXPECT_EQ(count_of(html, "needs more &lt;modes&gt;"), 2u);
  EXPECT_EQ(count_of(html, "<td class=\"strong name\">polypic full</td>"), 2u) << "on the front";
  EXPECT_EQ(count_of(html, "<td>2</td></tr>"), 1u) << "the tie of the first with the second";
  EXPECT_EQ(count_of(html, "error of image"), 0u) << "what no variant has is no column";
  for (const std::string text : {"polypic cost vortices", "polypic 0.1.0 (abc)", "a note", "Zen, 4 cores", "steady, so any loss is an error",
                                 "What accuracy costs: vortices &lt;2d&gt;"})
    EXPECT_NE(html.find(text), std::string::npos) << text;
}

TEST_F(CostReport, WritesEveryPlotAsSvgAndPng) {
  const std::string html = written(study());
  std::size_t files = 0;
  for (const std::string part : {"16_cells", "8_cells"})
    for (const std::string name : {"error_energy", "error_vorticity", "energy", "enstrophy", "seconds", "losses"}) {
      const fs::path svg = folder.path() / "plots" / (name + "." + part + ".svg"), png = folder.path() / "plots" / (name + "." + part + ".png");
      EXPECT_TRUE(fs::exists(svg) && fs::exists(png)) << svg;
      files += 2;
    }
  EXPECT_EQ(static_cast<std::size_t>(std::distance(fs::directory_iterator(folder.path() / "plots"), fs::directory_iterator())), files);
  EXPECT_EQ(count_of(html, "<svg"), files / 2);
}

TEST_F(CostReport, DrawsTheFrontOfWhatNothingBeats) {
  const app::Study s = study();
  for (const app::Measure m : {app::Measure::energy, app::Measure::vorticity}) {   // what the study says; what the report works out
    const app::Plot plot = *app::error_plot(s, s.cases[0], m);
    ASSERT_EQ(plot.series.size(), 4u);
    EXPECT_EQ(plot.series[0].style, app::Style::front);
    EXPECT_EQ(plot.series[0].x, (std::vector<double>{1, 2})) << "apic is slower than pic and no better";
    EXPECT_TRUE(plot.log_x && plot.log_y);
    EXPECT_EQ(plot.labels.size(), 3u);
  }
  EXPECT_FALSE(app::error_plot(s, s.cases[0], app::Measure::image)) << "no variant has that error";
  const app::Plot losses = *app::losses_plot(s, s.cases[1]);
  EXPECT_EQ(losses.categories, (std::vector<std::string>{"pic", "apic", "polypic full"}));
  EXPECT_EQ(losses.series[0].label, "p2g") << "in the order of the flow, which is not that of the letters";
  EXPECT_EQ(losses.series[1].label, "pressure");
  EXPECT_DOUBLE_EQ(losses.series[0].y[0], -35) << "[%] that P2G loses of pic's energy";
  EXPECT_DOUBLE_EQ(app::seconds_plot(s, s.cases[1])->series[1].y[2], 1);
}

// A line a scheme, through what none of its own variants beats, and seconds by error in a table.
TEST_F(CostReport, DrawsALineForEachSchemeThatWasRefined) {
  app::Study s = study();
  s.is_refined = true;
  s.variants.clear(), s.cases.resize(1);
  for (const auto& [scheme, seconds, error] : {std::tuple{"apic", 1., .4}, {"apic", 8., .1}, {"apic", 9., .2}, {"polypic", 2., .2}, {"polypic", 16., .02}}) {
    s.variants.push_back(variant("16 cells", scheme + std::to_string(seconds), "apic", seconds, error));
    s.variants.back().scheme = scheme;
  }
  app::judge(s);
  const auto plot = app::error_plot(s, s.cases[0], app::Measure::energy);
  ASSERT_TRUE(plot);
  ASSERT_EQ(plot->series.size(), 3u);   // the front, and two schemes
  EXPECT_EQ(plot->series[1].label, "apic");
  EXPECT_EQ(plot->series[1].y, (std::vector{.4, .1}));
  EXPECT_TRUE(plot->labels.empty());
  const std::string page = written(s);
  EXPECT_NE(page.find("Seconds to an error of energy."), std::string::npos);
  EXPECT_EQ(count_of(page, "An error of energy of "), 1u);
}

TEST_F(CostReport, CutsOffWhatGoesFarBeyondAllElseAndNamesItsPointsByNumberWhereThereAreMany) {
  app::Study s = study();
  s.cases.pop_back();
  std::erase_if(s.variants, [](const app::Variant& v) { return v.part == "8 cells"; });
  EXPECT_FALSE(app::energy_plot(s, s.cases[0])->reach);
  app::Variant wild = variant("16 cells", "wild", "flip", 3, 0.7);
  wild.course.energy.back() = 4e5;
  wild.energy_changes["g2p"] = 4e5;
  s.variants.push_back(wild);
  const app::Plot energy = *app::energy_plot(s, s.cases[0]), losses = *app::losses_plot(s, s.cases[0]);
  ASSERT_TRUE(energy.reach && losses.reach);
  EXPECT_DOUBLE_EQ(*energy.reach, 1.2);
  EXPECT_EQ(energy.note, "wild is cut off, and goes to 4e+05");
  EXPECT_EQ(losses.note, "wild is cut off, and goes to 4e+07");
  EXPECT_FALSE(app::seconds_plot(s, s.cases[0])->reach);
  EXPECT_EQ(app::error_plot(s, s.cases[0], app::Measure::energy)->labels.size(), 4u);
  EXPECT_EQ(app::error_plot(s, s.cases[0], app::Measure::energy)->note, "");
  for (int k = 0; k < 10; ++k) s.variants.push_back(variant("16 cells", "more " + std::to_string(k), "apic", 4 + k, 0.9));
  EXPECT_EQ(app::energy_plot(s, s.cases[0])->series.size(), 10u) << "a colour each";
  EXPECT_EQ(app::enstrophy_plot(s, s.cases[0])->note, "4 variants that are not on the front are left out");
  const app::Plot many = *app::error_plot(s, s.cases[0], app::Measure::energy);
  const auto count = [&](const std::string& text) {
    return std::count_if(many.labels.begin(), many.labels.end(), [&](const app::PointLabel& l) { return l.text == text; });
  };
  EXPECT_EQ(count("pic") + count("polypic full"), 2) << "on the front";
  EXPECT_EQ(count("wild") + count("apic"), 0);
  EXPECT_EQ(count("2") + count("5") + count("6"), 3);   // the fourth could not run
  EXPECT_EQ(many.note, "numbers: rows of the table of variants");
}

TEST_F(CostReport, PutsTheFramesOfAllVariantsOnOneScrubber) {
  app::Study s = study();
  s.is_shot = true;
  s.cases.pop_back();
  std::erase_if(s.variants, [](const app::Variant& v) { return v.part == "8 cells"; });
  s.cases[0].noise[app::Measure::energy] = 0.2;
  s.reference = variant("16 cells", "reference", "polypic", 9, 0.01);
  s.reference->cell = 0.02;
  base::Ledger ledger;
  render::Image image{.width = 48, .height = 27, .channels = {"R", "G", "B"}, .pixels = std::vector<float>(48 * 27 * 3, 0.5f)};
  render::write_png(folder.path() / "p.png", image, {}, true, ledger);
  for (app::Variant* v : {&s.variants[0], &s.variants[2], &*s.reference})
    for (const std::int64_t frame : {1, 12, 24}) v->pictures.push_back({frame, folder.path() / "p.png"});
  const std::string html = written(s);
  EXPECT_EQ(count_of(html, "type=\"range\""), 1u);
  EXPECT_EQ(count_of(html, "<img data-frame="), 9u);
  EXPECT_EQ(count_of(html, ">reference: polypic linear, cell 0.02 m<"), 1u);
  EXPECT_EQ(count_of(html, "<li>frame 12</li>"), 1u);
  EXPECT_EQ(count_of(html, "<div class=\"lead\">\n<p>Best of 16 cells.</p>\n<p>The next costs more.</p>\n<p>The one below loses more.</p>"), 1u);
  EXPECT_NE(html.find("noise: below"), std::string::npos);
}

TEST_F(CostReport, HasNoPlotsWithoutGnuplot) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  const std::string html = written(study());
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(count_of(html, "<svg"), 0u);
  EXPECT_EQ(count_of(html, "No plots: "), 1u);
  EXPECT_EQ(count_of(html, "<tr><td>"), 8u);
}
