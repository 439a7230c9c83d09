// report.html of a run: what it tells, that it is there however the run ended, and that a run does without gnuplot.
#include <csignal>
#include <cstdlib>

#include "film_test.h"

namespace {

namespace fs = std::filesystem;

class RunReport : public FilmTest {
 protected:
  std::string report(const std::string& out = "out/x") const { return text_of(folder / out / "report.html"); }
  static std::size_t count_of(const std::string& text, const std::string& word) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += word.size()) ++count;
    return count;
  }
};

}  // namespace

TEST_F(RunReport, TellsHowTheRunWasMadeAndWhatItConserved) {
  run_well({"run", "x.toml", "--set", "sim.kernel = \"linear\"", "--set", "render.exposure=0.5"});
  const std::string html = report();
  EXPECT_EQ(count_of(html, "polypic run x.toml --set &#39;sim.kernel = &quot;linear&quot;&#39; --set render.exposure=0.5<"), 1u)
      << "as a shell takes it";
  const Json run = run_json();
  for (const Json& hash : run.at("hashes")) EXPECT_EQ(count_of(html, ">" + hash.get<std::string>() + "<"), 1u);
  EXPECT_EQ(count_of(html, "; off: "), 1u) << "the plan's line";
  EXPECT_EQ(count_of(html, "polypic " + run.at("program").at("version").get<std::string>()), 1u);
  EXPECT_EQ(count_of(html, "<svg"), 5u);
  for (const std::string title : {"Energy", "Volume", "Momentum", "Angular momentum", "Seconds a frame, by pass"})
      EXPECT_EQ(count_of(html, ">" + title + "<"), 1u) << title;
  EXPECT_EQ(count_of(html, "<img"), 2u);
  const Json& passes = run.at("frames").at(1).at("passes");
  EXPECT_GT(passes.size(), 10u);
  for (const auto& [name, cost] : passes.items()) EXPECT_GE(count_of(html, "<td>" + name + "</td>"), 1u) << name;
  const Json told = Json::parse(run_well({"info", "out/x/report.html", "--json"}).out);
  EXPECT_EQ(told.at("kind"), "report");
  EXPECT_EQ(told.at("report").at("title"), "x");
  EXPECT_EQ(told.at("report").at("plots"), 5);
}

TEST_F(RunReport, IsLeftOutWhereNobodyWantsIt) {
  run_well({"simulate", "x.toml", "--no-report"});
  EXPECT_TRUE(fs::exists(folder / "out/x/run.json"));
  EXPECT_FALSE(fs::exists(folder / "out/x/report.html"));
}

TEST_F(RunReport, ShowsAtMostTwentyFourFramesTheFirstAndTheLastAmongThem) {
  run_well({"run", "x.toml", "--frames", "1-30", "--set", "sim.cell=0.06", "--quality", "draft", "--quiet"});
  const std::string html = report();
  EXPECT_EQ(count_of(html, "<img"), 24u);
  EXPECT_EQ(count_of(html, ">frame 1, t = 0.000 s<"), 1u);
  EXPECT_EQ(count_of(html, ">frame 30, t = 1.208 s<"), 1u);
  EXPECT_EQ(count_of(html, ">24 of 30 frames<"), 1u);
}

TEST_F(RunReport, IsThereAfterAnInterruption) {
  const Outcome outcome = run_until({"run", "x.toml", "--frames", "1-200"}, [&] { return fs::exists(folder / "out/x/ledger/render.0003.json"); },
      SIGINT);
  EXPECT_EQ(outcome.exit, 130) << outcome.err;
  const std::string html = report();
  EXPECT_GE(count_of(html, "<img"), 3u);
  EXPECT_EQ(count_of(html, "<p>" + std::to_string(run_json().at("frames").size()) + " frames in "), 1u);
  for (const std::string& name : files()) EXPECT_NE(fs::path(name).filename().string()[0], '.') << name;
}

TEST_F(RunReport, HasNoPlotsWithoutGnuplotAndTheRunGoesOn) {
  const std::string path = std::getenv("PATH");
  fs::create_directory(folder / "bin");
  fs::create_symlink("/usr/bin/ffmpeg", folder / "bin/ffmpeg");
  ::setenv("PATH", (folder / "bin").c_str(), 1);
  const Outcome outcome = run_well({"run", "x.toml"});
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_NE(outcome.out.find("report without plots: plots: gnuplot cannot be started: No such file or directory (apt-get install gnuplot-nox)\n"),
      std::string::npos) << outcome.out;
  const std::string html = report();
  EXPECT_EQ(count_of(html, "<svg"), 0u);
  EXPECT_EQ(count_of(html, "No plots: "), 1u);
  EXPECT_EQ(count_of(html, "<img"), 2u);
}
