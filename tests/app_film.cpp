// A small shot from end to end: every file, the same bits for any number of threads, and what is kept.
#include "base/text.h"
#include "film_test.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Film : public FilmTest {
 protected:
  /// "WIDTH,HEIGHT,FRAMES" of a movie, as decoded.
  std::string movie(const std::string& name) const {
    const std::string list = (folder / "movie.txt").string();
    const std::string command = "ffprobe -v error -count_frames -show_entries stream=width,height,nb_read_frames -of csv=p=0 '" +
                                (folder / name).string() + "' >'" + list + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);
    return text_of(list);
  }
};

}  // namespace

TEST_F(Film, HasEveryFileAndNothingElse) {
  run_well({"run", "x.toml", "--preview"});
  std::vector<std::string> expected = {"out",
                                       "out/x",
                                       "out/x/checkpoint",
                                       "out/x/checkpoint/state.0002.h5",
                                       "out/x/images",
                                       "out/x/images/beauty.0001.exr",
                                       "out/x/images/beauty.0001.png",
                                       "out/x/images/beauty.0002.exr",
                                       "out/x/images/beauty.0002.png",
                                       "out/x/ledger",
                                       "out/x/ledger/movie.json",
                                       "out/x/ledger/preview.json",
                                       "out/x/movie.mp4",
                                       "out/x/points",
                                       "out/x/points/points.0001.vdb",
                                       "out/x/points/points.0002.vdb",
                                       "out/x/preview",
                                       "out/x/preview.mp4",
                                       "out/x/preview/preview.0001.png",
                                       "out/x/preview/preview.0002.png",
                                       "out/x/report.html",
                                       "out/x/run.json",
                                       "out/x/shot.toml",
                                       "out/x/surface",
                                       "out/x/surface/surface.0001.vdb",
                                       "out/x/surface/surface.0002.vdb",
                                       "x.toml"};
  for (const std::string stage : {"simulate", "surface", "render", "preview"})
    for (const std::string frame : {"0001", "0002"}) expected.push_back("out/x/ledger/" + stage + "." + frame + ".json");
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(files(), expected);
  for (const std::string& name : expected) EXPECT_TRUE(fs::is_directory(folder / name) || fs::file_size(folder / name) > 0) << name;
}

TEST_F(Film, RunJsonHoldsWhatIsKnownOfEveryFrame) {
  const Json printed = Json::parse(run_well({"run", "x.toml", "--json", "--quiet"}).out);
  EXPECT_EQ(printed, run_json());
  EXPECT_EQ(printed.at("schema"), 1);
  EXPECT_EQ(printed.at("shot"), "x");
  for (const std::string stage : {"simulate", "surface", "render"}) EXPECT_EQ(printed.at("hashes").at(stage).get<std::string>().size(), 16u);
  ASSERT_EQ(printed.at("frames").size(), 2u);
  const Json& frame = printed.at("frames").at(1);
  EXPECT_EQ(frame.at("frame"), 2);
  EXPECT_NEAR(frame.at("time").get<double>(), 1 / 24.0, 1e-9);
  EXPECT_GT(frame.at("substeps"), 0);
  EXPECT_EQ(frame.at("particles"), 9 * 10 * 6 * 8);
  EXPECT_GT(frame.at("kinetic_energy"), 0.0);
  EXPECT_LT(frame.at("linear_momentum").at(2), 0.0);   // it falls
  EXPECT_EQ(frame.at("state_hash").get<std::string>().size(), 16u);
  for (const std::string stage : {"simulate", "surface", "render"}) EXPECT_GT(frame.at("seconds").at(stage), 0.0);
  for (const std::string pass : {"p2g", "pressure", "write_points", "rasterize", "write_surface", "trace", "write_image"}) {
    EXPECT_GT(frame.at("passes").at(pass).at("calls"), 0) << pass;
    EXPECT_GT(frame.at("passes").at(pass).at("seconds"), 0.0) << pass;
  }
  EXPECT_FALSE(frame.contains("elastic_energy"));   // a liquid has none
}

TEST_F(Film, IsTheSameForAnyNumberOfThreads) {
  run_well({"run", "x.toml", "--threads", "1", "--out", "one"});
  run_well({"run", "x.toml", "--threads", "2", "--out", "two"});
  ASSERT_EQ(state_hashes("one").size(), 2u);
  EXPECT_NE(state_hashes("one")[0], state_hashes("one")[1]);
  EXPECT_EQ(state_hashes("one"), state_hashes("two"));
  for (const std::string name : {"images/beauty.0002.exr", "images/beauty.0002.png"})
    EXPECT_TRUE(text_of(folder / "one" / name) == text_of(folder / "two" / name)) << name << " differs";
}

TEST_F(Film, StageByStageGivesThePixelsOfRun) {
  run_well({"run", "x.toml", "--out", "whole"});
  for (const std::string stage : {"simulate", "surface", "render"}) run_well({stage, "x.toml", "--out", "parts"});
  for (const std::string name : {"images/beauty.0002.exr", "images/beauty.0002.png"})
    EXPECT_TRUE(text_of(folder / "whole" / name) == text_of(folder / "parts" / name)) << name << " differs";
}

TEST_F(Film, KeepsFinishedFramesAndMakesMissingOnesAgain) {
  run_well({"run", "x.toml"});
  const auto exr = time_of("out/x/images/beauty.0001.exr"), movie = time_of("out/x/movie.mp4");
  EXPECT_NE(run_well({"run", "x.toml"}).out.find("kept   frames 1-2"), std::string::npos);
  EXPECT_EQ(time_of("out/x/images/beauty.0001.exr"), exr);
  EXPECT_EQ(time_of("out/x/movie.mp4"), movie);

  const std::string png = text_of(folder / "out/x/images/beauty.0002.png"), vdb = text_of(folder / "out/x/points/points.0002.vdb");
  fs::resize_file(folder / "out/x/images/beauty.0002.png", 10);
  fs::remove(folder / "out/x/points/points.0002.vdb");
  run_well({"run", "x.toml"});
  EXPECT_TRUE(text_of(folder / "out/x/images/beauty.0002.png") == png);
  EXPECT_TRUE(text_of(folder / "out/x/points/points.0002.vdb") == vdb);
  EXPECT_EQ(time_of("out/x/images/beauty.0001.exr"), exr);
  EXPECT_EQ(time_of("out/x/movie.mp4"), movie);   // of the same pictures
}

TEST_F(Film, GoesPastTheShotsLastFrameAndRendersOnlyWhatIsAsked) {
  run_well({"run", "x.toml", "--frames", "3-4"});
  EXPECT_TRUE(fs::exists(folder / "out/x/points/points.0001.vdb"));
  EXPECT_TRUE(fs::exists(folder / "out/x/images/beauty.0004.png"));
  EXPECT_FALSE(fs::exists(folder / "out/x/surface/surface.0002.vdb"));
  EXPECT_FALSE(fs::exists(folder / "out/x/images/beauty.0002.png"));
  EXPECT_EQ(run_json().at("frames").size(), 4u);
  EXPECT_EQ(movie("out/x/movie.mp4"), "160,90,2\n");
  run_well({"run", "x.toml", "--frames", "1", "--preview"});   // a gap at frame 2: the movie takes what is there
  EXPECT_TRUE(fs::exists(folder / "out/x/images/beauty.0001.png"));
  EXPECT_EQ(movie("out/x/movie.mp4"), "160,90,3\n");
  EXPECT_EQ(movie("out/x/preview.mp4"), "160,90,1\n");
}

TEST_F(Film, RefusesToGoOnWithAnotherShot) {
  run_well({"simulate", "x.toml", "--frames", "1"});
  const std::vector<std::string> before = files();
  const Outcome refused = run({"run", "x.toml", "--set", "sim.cfl=0.5"});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_EQ(refused.complaints(), 1);
  EXPECT_NE(refused.err.find("sim.cfl"), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--restart or another --out goes on"), std::string::npos) << refused.err;
  EXPECT_EQ(files(), before);
  const Outcome empty = run({"run", "x.toml", "--set", "sim.domain=[[3,3,3],[4,4,4]]", "--set", "sim.cell=0.1", "--restart"});
  EXPECT_EQ(empty.exit, 2);
  EXPECT_EQ(files(), before);   // a shot that cannot be simulated costs no frame
  run_well({"run", "x.toml", "--set", "sim.cfl=0.5", "--restart"});
  run_well({"run", "x.toml", "--out", "other"});
  EXPECT_NE(state_hashes("out/x")[1], state_hashes("other")[1]);
}

// What the frames were made with is known from their records; a shot.toml that cannot be read is never taken for agreement.
TEST_F(Film, RefusesToGoOnWithoutItsShot) {
  run_well({"simulate", "x.toml", "--frames", "1"});
  const std::vector<std::string> before = files();
  for (const std::string text : {"", "a = ["}) {
    write("out/x/shot.toml", text);
    const Outcome refused = run({"run", "x.toml"});
    EXPECT_EQ(refused.exit, 4) << refused.err;
    EXPECT_NE(refused.err.find("out/x/shot.toml: "), std::string::npos) << refused.err;
    EXPECT_EQ(files(), before);
  }
  run_well({"simulate", "x.toml", "--frames", "1", "--restart"});   // as the line says
  fs::remove(folder / "out/x/shot.toml");
  const Outcome refused = run({"run", "x.toml", "--set", "sim.cfl=0.5"});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_EQ(refused.complaints(), 1);
  EXPECT_NE(refused.err.find("--restart or another --out goes on"), std::string::npos) << refused.err;
  run_well({"simulate", "x.toml", "--frames", "1"});   // the same keys go on
}

TEST_F(Film, GoesToADirectoryWithAColon) {
  run_well({"run", "x.toml", "--frames", "1", "--out", "09:30"});
  EXPECT_TRUE(fs::exists(folder / "09:30/movie.mp4"));
}

TEST_F(Film, RestartRemovesItsOwnFilesOnly) {
  run_well({"run", "x.toml"});
  write("out/x/images/notes.txt", "mine");
  write("out/x/images/beauty.final.png", "mine too");
  const auto vdb = time_of("out/x/surface/surface.0001.vdb"), exr = time_of("out/x/images/beauty.0001.exr");
  const Outcome restarted = run_well({"render", "x.toml", "--restart", "--frames", "1", "--set", "render.spp=2"});
  EXPECT_NE(restarted.out.find("again  --restart forgets all frames, not these alone\n"), std::string::npos) << restarted.out;
  EXPECT_EQ(text_of(folder / "out/x/images/notes.txt"), "mine");
  EXPECT_EQ(text_of(folder / "out/x/images/beauty.final.png"), "mine too");
  EXPECT_EQ(time_of("out/x/surface/surface.0001.vdb"), vdb);
  EXPECT_GT(time_of("out/x/images/beauty.0001.exr"), exr);
  EXPECT_FALSE(fs::exists(folder / "out/x/images/beauty.0002.exr"));

  const Outcome upstream = run({"render", "x.toml", "--restart", "--set", "surface.smooth=1"});
  EXPECT_EQ(upstream.exit, 4) << upstream.err;
  EXPECT_NE(upstream.err.find("surface.smooth = 1: the frames here were made with 8"), std::string::npos) << upstream.err;
}

TEST_F(Film, StopsAfterTheFileInHandAndGoesOnFromThere) {
  const std::vector<std::string> words = {"run", "x.toml", "--frames", "1-40"};
  for (const auto& [signal, code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}}) {
    const auto picture = folder / (signal == SIGINT ? "out/x/images/beauty.0001.png" : "out/x/images/beauty.0004.png");
    const Outcome stopped = run_until(words, [&] { return fs::exists(picture); }, signal);
    EXPECT_EQ(stopped.exit, code) << stopped.err;
    EXPECT_EQ(stopped.complaints(), 1) << stopped.err;
    EXPECT_NE(stopped.err.find("interrupted"), std::string::npos) << stopped.err;
    for (const std::string& name : files()) EXPECT_NE(fs::path(name).filename().string()[0], '.') << name;
  }
  const std::size_t made = run_json().at("frames").size();
  EXPECT_GE(made, 4u);
  EXPECT_LT(made, 40u);
  run_well({"run", "x.toml", "--frames", "1-5"});
  run_well({"run", "x.toml", "--frames", "1-5", "--out", "straight"});
  for (std::size_t frame = 0; frame < 5; ++frame) EXPECT_EQ(state_hashes("out/x")[frame], state_hashes("straight")[frame]);
}

TEST_F(Film, TurnsASecondProcessAway) {
  Outcome second;
  const Outcome first = run_until({"run", "x.toml", "--frames", "1-200"}, [&] {
    if (!fs::exists(folder / "out/x/images/beauty.0001.png")) return false;
    second.exit = std::system(("cd " + folder.string() + " && " POLYPIC_PROGRAM " run x.toml >second.out 2>second.err").c_str());
    return true;
  }, SIGINT);
  EXPECT_EQ(first.exit, 130);
  ASSERT_TRUE(WIFEXITED(second.exit));
  EXPECT_EQ(WEXITSTATUS(second.exit), 2);
  EXPECT_NE(text_of(folder / "second.err").find("out/x: in use by process "), std::string::npos);
}

TEST_F(Film, InfoSaysWhatIsInEveryKindOfFile) {
  run_well({"run", "x.toml", "--frames", "2"});
  const auto info = [&](const std::string& name) { return Json::parse(run_well({"info", "out/x/" + name, "--json"}).out); };
  const Json points = info("points/points.0002.vdb");
  EXPECT_EQ(points.at("kind"), "points");
  EXPECT_EQ(points.at("points").at("count"), 4320);
  const Json surface = info("surface/surface.0002.vdb");
  EXPECT_EQ(surface.at("kind"), "volume");
  EXPECT_EQ(surface.at("grids").size(), 2u);
  const Json image = info("images/beauty.0002.exr");
  EXPECT_EQ(image.at("image").at("width"), 160);
  EXPECT_EQ(image.at("image").at("metadata").at("polypic:shot"), "x");
  EXPECT_EQ(info("run.json").at("kind"), "run");
  EXPECT_EQ(info("ledger/surface.0002.json").at("kind"), "record");
  for (const std::string name : {"points/points.0002.vdb", "images/beauty.0002.png", "run.json"})
    EXPECT_NE(run_well({"info", "out/x/" + name}).out, "");
}

// What has nowhere to go is pressed in: the user is told once, and not where an open side lets it out.
TEST_F(Film, SaysFromWhenOnLiquidIsPressedTogether) {
  const std::string tank = R"([shot]
frames = 4
[sim]
dimension = 2
domain = [[0, 0], [1, 1]]
cell = 0.1
[[body]]
shape = { box = [[0, 0], [1, 1]] }
[[source]]
shape = { box = [[0, 0], [0.2, 1]] }
velocity = [0.5, 0]
)";
  std::ofstream(folder / "shut.toml") << tank;
  std::ofstream(folder / "open.toml") << tank + "[sim.boundary]\nx_upper = \"open\"\n";
  const std::string line = "watch  from frame 2 on liquid that is shut in without air is pressed together";
  const std::string told = run_well({"run", "shut.toml"}).out;
  EXPECT_NE(told.find(line), std::string::npos) << told;
  EXPECT_EQ(told.find(line), told.rfind(line));
  EXPECT_EQ(run_well({"run", "open.toml"}).out.find("pressed"), std::string::npos);
}

// All modes carried as they are make a spinning disk blow up; the watch holds it, and the user is told.
TEST_F(Film, SaysWhichFramesTheWatchHadDoneAgain) {
  std::ofstream(folder / "disk.toml") << R"([shot]
frames = 4
[sim]
solver = "solid"
dimension = 2
domain = [[0, 0], [1, 1]]
cell = 0.04
transfer = "polypic"
kernel = "quadratic"
modes = "full"
carry = "fixed"
[[body]]
name = "disk"
shape = { sphere = { center = [0.5, 0.5], radius = 0.2 } }
material = { preset = "jelly", young = 2e4 }
spin = 20
)";
  const std::string told = run_well({"run", "disk.toml"}).out;
  std::int64_t frames = 0;
  for (int frame = 2; frame <= 4; ++frame) {
    const Json record = Json::parse(text_of(folder / ("out/disk/ledger/simulate.000" + std::to_string(frame) + ".json")));
    const std::int64_t retries = record.at("retries");
    const std::string line = "watch  frame " + std::to_string(frame) + " went back " + base::count_of(retries, "time") + " to shorter steps\n";
    EXPECT_EQ(told.find(line) != std::string::npos, retries > 0) << told;
    frames += retries > 0;
  }
  EXPECT_GT(frames, 0);
}
