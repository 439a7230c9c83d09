// Pages that hold all they show, and the plots on them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <set>
#include <stdexcept>

#include "app/study/page.h"
#include "app/study/plot.h"
#include "app/study/plot_axis.h"
#include "app/study/plot_labels.h"
#include "app/study/text.h"
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

app::Plot error_plot() {
  app::Plot plot{.title = "Error", .x_label = "seconds [s]", .y_label = "error [1]", .log_x = true, .log_y = true, .series = {}, .labels = {},
      .categories = {}, .floor = {}};
  app::Series variants{.label = "variants", .x = {1, 2, 4}, .y = {0.1, 0.01, 0.001}, .low = {0.09, 0.009, 0}, .high = {0.11, 0.011, 0.002},
      .style = app::Style::points};
  plot.series = {variants};
  for (std::size_t i = 0; i < 3; ++i) plot.labels.push_back({variants.x[i], variants.y[i], "variant " + std::to_string(i)});
  return plot;
}

render::Image noise(std::int64_t width, std::int64_t height) {
  render::Image image{.width = width, .height = height, .channels = {"R", "G", "B"}, .pixels =
      std::vector<float>(static_cast<std::size_t>(width * height * 3))};
  std::uint32_t state = 1;
  for (float& value : image.pixels) value = static_cast<float>((state = state * 1664525u + 1013904223u) >> 24) / 255;
  return image;
}

class StudyPage : public testing::Test {
 protected:
  fs::path picture(const std::string& name, const render::Image& image) const {
    base::Ledger ledger;
    render::write_png(folder.path() / name, image, {}, /*display_referred=*/true, ledger);
    return folder.path() / name;
  }
  const base::ScratchFolder folder;
};

}  // namespace

TEST_F(StudyPage, WritesTextAsTextWhereverItStands) {
  const std::string sly = "<script>alert('\"&')</script>";
  app::Page page(sly);
  page.subtitle(sly);
  page.lead({sly});
  page.heading(sly);
  page.paragraph(sly);
  page.facts({{sly, sly}});
  page.table({sly}, {{sly}}, sly);
  page.details(sly, sly);
  page.figure_of("<svg id=\"a\"></svg>", sly);
  page.contact_sheet({picture("p.png", noise(8, 8))}, {sly});
  page.scrubber({{sly, {picture("p.png", noise(8, 8))}}}, {sly});
  const std::string html = page.text();
  EXPECT_EQ(count_of(html, "<script>"), 1u) << "the page's own";
  EXPECT_EQ(count_of(html, "alert("), 21u);
  EXPECT_EQ(count_of(html, "&lt;script&gt;alert(&#39;&quot;&amp;&#39;)&lt;/script&gt;"), 21u);
  EXPECT_EQ(app::html_text("a\x01\xff\xc3\xa9\xe2\x82"), "a\xef\xbf\xbd\xef\xbf\xbd\xc3\xa9\xef\xbf\xbd\xef\xbf\xbd") << "controls and broken UTF-8";
}

TEST_F(StudyPage, AsksForNothingFromOutside) {
  app::Page page("x");
  page.figure_of(app::svg_of(std::vector<app::Plot>{error_plot()}).front());
  page.contact_sheet({picture("p.png", noise(32, 18))}, {"p"});
  std::string html = page.text();
  for (const std::string named : {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"})   // names of languages
    for (std::size_t at; (at = html.find(named)) != std::string::npos;) html.erase(at, named.size());
  for (const std::string outside : {"http:", "https:", "//www", "@import", "url(h", "src=\"/", "src=\"f"}) EXPECT_EQ(html.find(outside),
      std::string::npos) << outside;
  EXPECT_EQ(count_of(html, "src=\""), count_of(html, "src=\"data:image/jpeg;base64,"));
  EXPECT_EQ(count_of(html, "src=\""), 1u);
}

TEST_F(StudyPage, GivesEveryFigureNamesOfItsOwn) {
  app::Page page("x");
  const std::string svg = app::svg_of(std::vector<app::Plot>{error_plot()}).front();
  page.figure_of(svg);
  page.figure_of(svg);
  const std::string html = page.text();
  std::set<std::string> ids;
  std::size_t all = 0;
  for (const std::string open : {"id=\"", "id='"})
    for (std::size_t at = 0; (at = html.find(" " + open, at)) != std::string::npos; ++at, ++all)
        ids.insert(html.substr(at + 5, html.find(open.back(), at + 5) - at - 5));
  EXPECT_GT(all, 10u);
  EXPECT_EQ(ids.size(), all);
  for (std::size_t at = 0; (at = html.find("href='#", at)) != std::string::npos; ++at)
      EXPECT_TRUE(ids.contains(html.substr(at + 7, html.find('\'', at + 7) - at - 7)));
  EXPECT_THROW(page.figure_of("<svg><script>x</script></svg>"), std::invalid_argument);
  EXPECT_THROW(page.figure(folder.path() / "none.svg"), base::Error);
}

TEST_F(StudyPage, TablesKeepNumbersBesideTheirText) {
  app::Page page("x");
  page.table({"name", "seconds"}, {{"a", app::Cell("1.5 ± 0.1", 1.5)}, {"b", app::Cell(1.25e-9)}, {"c", ""}});
  const std::string html = page.text();
  EXPECT_EQ(count_of(html, "data-value=\"1.5\">1.5 ± 0.1<"), 1u);
  EXPECT_EQ(count_of(html, ">1.25e-09<"), 1u);
  EXPECT_EQ(count_of(html, "aria-sort=\"none\""), 2u);
  EXPECT_THROW(page.table({"a", "b"}, {{"x"}}), std::invalid_argument);
  EXPECT_THROW(app::Cell(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

TEST_F(StudyPage, ScrubbersHaveAPlaceForEveryFrameOfEveryStrip) {
  const fs::path there = picture("p.png", noise(64, 36));
  app::Page page("x");
  page.scrubber({{"long", {there, there, there}}, {"short", {there, folder.path() / "none.png"}}}, {"one", "two", "three"});
  const std::string html = page.text();
  EXPECT_EQ(count_of(html, "<img data-frame="), 5u) << "one that cannot be read is a tile";
  EXPECT_EQ(count_of(html, "class=\"none\""), 1u);
  EXPECT_EQ(count_of(html, "hidden alt="), 4u) << "all but the last of each strip, and the last of the short one is no picture";
  EXPECT_EQ(count_of(html, "max=\"2\" value=\"2\""), 1u) << "opens where most has happened";
  EXPECT_EQ(count_of(html, "<output>three</output>"), 1u);
}

TEST_F(StudyPage, PicturesAreMadeSmallerUntilThePageIsNotTooLarge) {
  const fs::path loud = picture("noise.png", noise(640, 360));
  app::Page page("x");
  const std::vector<fs::path> strip(40, loud);
  page.scrubber({{"a", strip}, {"b", strip}}, std::vector<std::string>(40, "frame"));
  const std::string html = page.text();
  EXPECT_LE(html.size(), app::Page::kLargestPage);
  EXPECT_GT(html.size(), app::Page::kLargestPage / 2) << "no smaller than needed";
}

TEST_F(StudyPage, ShrinksLightAndNotCodes) {
  render::Image board{.width = 8, .height = 4, .channels = {"R", "G", "B", "A"}, .pixels = {}};
  for (int i = 0; i < 32; ++i) board.pixels.insert(board.pixels.end(), 4, static_cast<float>((i + i / 8) % 2));
  const render::Image small = render::shrunk(board, 4), same = render::shrunk(board, 100);
  EXPECT_EQ(small.width, 4);
  EXPECT_EQ(small.height, 2);
  EXPECT_EQ(same.width, 8);
  for (const float value : small.pixels) EXPECT_NEAR(value, 0.7354f, 1e-3) << "half the light of white";
  const fs::path file = folder.path() / "small.jpg";
  render::Image flat{.width = 16, .height = 16, .channels = {"R", "G", "B"}, .pixels = {}};
  for (int i = 0; i < 256; ++i) flat.pixels.insert(flat.pixels.end(), {0.2f, 0.5f, 0.8f});
  base::write_text_atomically(file, render::jpeg(flat, 90));
  const render::Image read = render::read_image(file);
  ASSERT_EQ(read.pixels.size(), flat.pixels.size());
  for (std::size_t i = 0; i < read.pixels.size(); ++i) EXPECT_NEAR(read.pixels[i], flat.pixels[i], 0.02);
}

TEST_F(StudyPage, PlotsAreSvgForPagesAndPngForSlides) {
  const fs::path stem = folder.path() / "error.plot";
  app::write_plot(error_plot(), stem);
  const std::string svg = base::read_file(folder.path() / "error.plot.svg");
  for (const std::string text : {"Error", "seconds [s]", "error [1]", "variants", "variant 0", "variant 2", "0.01"})
      EXPECT_NE(svg.find(">" + text + "<"), std::string::npos) << text;
  const render::Image png = render::read_image(folder.path() / "error.plot.png");
  EXPECT_EQ(png.width, 1920);
  EXPECT_EQ(png.height, 1080);
  std::size_t inked = 0;
  for (const float value : png.pixels) inked += value < 0.5f;
  EXPECT_GT(inked, 10000u);
  app::write_plot(error_plot(), folder.path() / "again");
  EXPECT_EQ(base::read_file(folder.path() / "again.svg"), svg);
  EXPECT_EQ(base::read_file(folder.path() / "again.png"), base::read_file(folder.path() / "error.plot.png"));
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) files += entry.is_regular_file();
  EXPECT_EQ(files, 4u) << "nothing temporary is left";
}

TEST_F(StudyPage, PlotsDrawTextOfAnyKindAndRunNone) {
  app::Plot plot = error_plot();
  plot.title = "it's `touch " + (folder.path() / "ran").string() + "` \"q\" a_b^{c} @x \\n <b> \xff";
  const std::string svg = app::svg_of(std::vector<app::Plot>{plot}).front();
  EXPECT_NE(svg.find("it's `touch "), std::string::npos);
  EXPECT_NE(svg.find("a_b^{c} @x \\n &lt;b"), std::string::npos);
  EXPECT_NE(svg.find("\xef\xbf\xbd<"), std::string::npos) << "what is no UTF-8 would make the file unreadable";
  EXPECT_FALSE(fs::exists(folder.path() / "ran"));
  EXPECT_NE(app::svg_of(std::vector<app::Plot>{app::Plot{.title = "empty"}}).front().find(">empty<"), std::string::npos)
      << "a plot without data is one with axes";
}

TEST_F(StudyPage, PlotsRefuseWhatIsNoNumberAndCountWhatALogarithmHasNot) {
  app::Plot plot = error_plot();
  plot.series[0].y[1] = 0;
  EXPECT_NE(app::svg_of(std::vector<app::Plot>{plot}).front().find("1 point is 0 or below"), std::string::npos);
  plot.series[0].y[1] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(app::svg_of(std::vector<app::Plot>{plot}), base::Error);
  plot.series[0].y.pop_back();
  EXPECT_THROW(app::svg_of(std::vector<app::Plot>{plot}), base::Error);
}

TEST_F(StudyPage, BarsAndAreasAreDrawnForEverySeries) {
  app::Plot bars{.title = "", .x_label = "s", .y_label = "", .series = {{.label = "p2g", .x = {}, .y = {1, 2}, .low = {}, .high = {}, .style =
      app::Style::stack}, {.label = "g2p", .x = {}, .y = {-1, 0}, .low = {}, .high = {}, .style = app::Style::stack}},
                 .labels = {}, .categories = {"first", "second"}, .floor = {}};
  app::Plot areas{.title = "", .x_label = "t", .y_label = "s", .series = {{.label = "p2g", .x = {0, 1}, .y = {1, 2}, .low = {}, .high = {},
      .style = app::Style::stack}}, .labels = {}, .categories = {}, .floor = {}};
  const std::vector<std::string> svgs = app::svg_of(std::vector<app::Plot>{bars, areas});
  ASSERT_EQ(svgs.size(), 2u);
  for (const std::string text : {">p2g<", ">g2p<", ">first<", ">second<"}) EXPECT_NE(svgs[0].find(text), std::string::npos) << text;
  EXPECT_NE(svgs[1].find(">p2g<"), std::string::npos);
}

TEST_F(StudyPage, SaysWhatIsMissingWithoutGnuplot) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  try {
    app::write_plot(error_plot(), folder.path() / "x");
    ADD_FAILURE() << "no gnuplot, and no complaint";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::io);
    EXPECT_NE(std::string(e.what()).find("gnuplot cannot be started: No such file or directory (apt-get install gnuplot-nox)"), std::string::npos)
        << e.what();
  }
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_FALSE(fs::exists(folder.path() / "x.svg"));
}

TEST(PlotLabels, CoverNeitherEachOtherNorPointsNorLines) {
  std::vector<app::Spot> anchors;
  std::vector<double> widths;
  for (int i = 0; i < 14; ++i) anchors.push_back({300 + 90 * std::cos(i * 2.4) * (i / 14.0), 250 + 60 * std::sin(i * 2.4) * (i / 14.0)}),
      widths.push_back(60 + 7 * i);
  const app::Obstacles obstacles{.points = anchors, .lines = {{{100, 400}, {500, 200}}}, .texts = {}, .room = {50, 50, 800, 480}};
  const auto placed = app::place_labels(anchors, widths, 18, obstacles);
  ASSERT_EQ(placed.size(), anchors.size());
  std::size_t leaders = 0;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const app::Rectangle& box = placed[i].box;
    leaders += placed[i].has_leader;
    EXPECT_NEAR(box.right - box.left, widths[i], 1e-9);
    EXPECT_NEAR(box.overlap(obstacles.room), 18 * widths[i], 1e-6) << "inside the room";
    for (std::size_t k = 0; k < placed.size(); ++k) {
      if (k != i) {
        EXPECT_EQ(box.overlap(placed[k].box), 0) << i << " and " << k;
      }
      EXPECT_EQ(box.overlap({anchors[k].x - 4, anchors[k].y - 4, anchors[k].x + 4, anchors[k].y + 4}), 0) << i << " and the point " << k;
    }
  }
  EXPECT_GT(leaders, 0u) << "in such a crowd some labels are away from their points";
}

TEST(PlotAxis, TicksAreFewRoundAndInside) {
  const auto texts = [](const app::Axis& axis) {
    std::vector<std::string> all;
    for (const app::Tick& tick : axis.ticks) all.push_back(tick.text);
    return all;
  };
  using Texts = std::vector<std::string>;
  EXPECT_EQ(texts(app::axis_for(1e-8, 1, true, 0)), (Texts{"10⁻⁸", "10⁻⁶", "10⁻⁴", "10⁻²", "1"}));
  EXPECT_EQ(texts(app::axis_for(0.5, 30, true, 0)), (Texts{"0.5", "1", "2", "5", "10", "20"}));
  EXPECT_EQ(texts(app::axis_for(1, 1.3, true, 0)), (Texts{"1", "1.05", "1.1", "1.15", "1.2", "1.25", "1.3"}));
  EXPECT_EQ(texts(app::axis_for(0, 10, false, 0)), (Texts{"0", "2", "4", "6", "8", "10"}));
  EXPECT_EQ(texts(app::axis_for(1, 3, false, 0)), (Texts{"1", "1.5", "2", "2.5", "3"}));
  EXPECT_EQ(texts(app::with_whole_ticks(app::axis_for(1, 3, false, 0))), (Texts{"1", "2", "3"})) << "frames are whole";
  EXPECT_EQ(app::tick_text(-2.5e-7), "-2.5×10⁻⁷");
  for (const auto& [low, high] : {std::pair{1e-12, 1e9}, {3.0, 3.0}, {2.0, 700.0}, {0.9, 1.1}})
    for (const bool log : {true, false}) {
      const app::Axis axis = app::axis_for(low, high, log, 0.05);
      EXPECT_GE(axis.ticks.size(), 2u) << low << " " << high << " " << log;
      EXPECT_LE(axis.ticks.size(), 12u) << low << " " << high << " " << log;
      for (const app::Tick& tick : axis.ticks) EXPECT_TRUE(tick.value >= axis.low - 1e-9 * std::abs(axis.low) && tick.value <= axis.high * (1
          + 1e-9));
      EXPECT_LE(axis.low, low);
      EXPECT_GE(axis.high, high);
      EXPECT_NEAR(axis.place(axis.low), 0, 1e-12);
      EXPECT_NEAR(axis.place(axis.high), 1, 1e-12);
    }
}

TEST(LargestSeries, KeepTheSum) {
  std::vector<app::Series> all;
  for (int k = 0; k < 5; ++k) all.push_back({.label = std::to_string(k), .x = {0, 1}, .y = {1.0 + k % 3, 2.0}, .low = {}, .high = {}, .style =
      app::Style::stack});
  const auto few = app::largest_series(all, 2);
  ASSERT_EQ(few.size(), 3u);
  EXPECT_EQ(few[0].label, "1");
  EXPECT_EQ(few[1].label, "2");
  EXPECT_EQ(few[2].label, "other");
  EXPECT_EQ(few[0].y[0] + few[1].y[0] + few[2].y[0], 9);
  EXPECT_EQ(app::largest_series(all, 5).size(), 5u);
}
