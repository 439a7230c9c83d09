// What users and file systems come up with: names, links, pipes and streams that nobody thinks of. One line, the right exit code,
// and nothing of theirs is lost.
#include <sys/stat.h>

#include "film_test.h"

namespace {

namespace fs = std::filesystem;

class Strange : public FilmTest {
 protected:
  /// What a shell makes of a line, in the test's folder; $P is the program. Nothing may take longer than a minute.
  Outcome shell(const std::string& line) const {
    const std::string command =
        "cd '" + folder.string() + "' && export P='timeout -k 1 60 " POLYPIC_PROGRAM "' && { " + line + "; } >../out 2>../err </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 255, text_of(log / "out"), text_of(log / "err")};
  }
  void expect_line(const Outcome& outcome, int code, const std::string& line) const {
    EXPECT_EQ(outcome.exit, code) << outcome.err;
    EXPECT_EQ(outcome.err, "polypic: " + line + "\n");
  }
};

}  // namespace

TEST_F(Strange, DirectoriesThatCannotBeAreADiskError) {
  fs::create_symlink("loop", folder / "loop");
  fs::create_symlink("nowhere", folder / "dangling");
  const std::string name(300, 'a');
  expect_line(run({"run", "x.toml", "--out", name}), 5, name + ": File name too long");
  expect_line(run({"run", "x.toml", "--out", "loop"}), 5, "loop: Too many levels of symbolic links");
  expect_line(run({"run", "x.toml", "--out", "dangling"}), 5, "dangling: is a link to nothing");
  fs::create_directory(folder / "gone");
  expect_line(shell("cd gone && rmdir ../gone && $P run '" + (folder / "x.toml").string() + "'"), 5,
              "out/x: the working directory: No such file or directory");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 3);   // nothing was made
}

TEST_F(Strange, OneParticleIsAShot) {
  write("one.toml", "[shot]\nframes = 2\nquality = \"high\"\n[sim]\ndimension = 2\ndomain = [[0, 0], [2, 1]]\ncell = 0.04\n[[body]]\n"
                    "name = \"water\"\nshape = { box = [[1.5, 0.4], [1.52, 0.42]] }\n[[effect]]\nkind = \"gravity\"\nacceleration = [0, -9.81]\n");
  const Outcome outcome = run({"simulate", "one.toml", "--quiet"});
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
}

TEST_F(Strange, PipesAreNoFiles) {
  write("a.png", "x");
  for (const std::string end : {".vdb", ".exr", ".png", ".mp4", ".h5", ".json", ".toml"}) {
    ASSERT_EQ(::mkfifo((folder / ("pipe" + end)).c_str(), 0600), 0);
    expect_line(shell("$P info pipe" + end), 2, "pipe" + end + ": is a pipe or a device, not a file");
  }
  expect_line(shell("$P diff pipe.png a.png"), 2, "pipe.png: is a pipe or a device, not a file");
  expect_line(shell("$P run pipe.toml"), 2, "pipe.toml: is not a file");
}

TEST_F(Strange, APipeInPlaceOfAFileIsMadeAgain) {
  run_well({"run", "x.toml"});
  const auto good = content();
  for (const std::string name :
       {"points/points.0002.vdb", "surface/surface.0001.vdb", "images/beauty.0002.exr", "images/beauty.0001.png", "movie.mp4",
        "ledger/render.0001.json", "ledger/simulate.0002.json", "ledger/movie.json", "run.json", "report.html", ".lock", ".simulate.lock"}) {
    fs::remove(folder / "out/x" / name);
    ASSERT_EQ(::mkfifo((folder / "out/x" / name).c_str(), 0600), 0);
  }
  const Outcome outcome = shell("$P run x.toml");
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_TRUE(content() == good);
  expect_no_dot_files();

  fs::remove(folder / "out/x/checkpoint/state.0002.h5");
  ASSERT_EQ(::mkfifo((folder / "out/x/checkpoint/state.0002.h5").c_str(), 0600), 0);
  expect_line(shell("$P simulate x.toml --frames 3"), 0,
              "out/x/checkpoint/state.0002.h5: is not a file; kept as state.0002.h5.bad, there is none before it: computed again from frame 1");
}

TEST_F(Strange, ADirectoryInPlaceOfAFileIsADiskErrorThatNamesIt) {
  run_well({"run", "x.toml"});
  const auto good = content();
  for (const std::string name :
       {"points/points.0002.vdb", "images/beauty.0001.png", "movie.mp4", "ledger/surface.0001.json", "run.json", "report.html"}) {
    fs::rename(folder / "out/x" / name, folder / "kept");
    fs::create_directory(folder / "out/x" / name);
    expect_line(run({"run", "x.toml"}), 5, "out/x/" + name + ": Is a directory");
    fs::remove(folder / "out/x" / name);
    fs::rename(folder / "kept", folder / "out/x" / name);
    run_well({"run", "x.toml"});
    EXPECT_TRUE(content() == good) << name;
  }
  expect_no_dot_files();
}

// Neither needs a user that the permissions of files bind: a file stands where a folder was, or the folder is immutable.
TEST_F(Strange, AFolderThatCannotBeWrittenAnyMoreStopsTheRunAndItGoesOn) {
  const std::vector<std::string> words = {"run", "x.toml", "--frames", "1-400"};
  for (const std::string name : {"points", "surface", "images", "ledger"}) {
    const fs::path place = folder / "out/x" / name;
    const Outcome stopped = run_until(words, [&] {
      if (!fs::exists(folder / "out/x/ledger/render.0002.json")) return false;
      fs::rename(place, folder / "kept");
      write("out/x/" + name, "");
      return true;
    }, 0);
    EXPECT_EQ(stopped.exit, 5) << stopped.err;
    EXPECT_EQ(stopped.complaints(), 1) << stopped.err;
    EXPECT_NE(stopped.err.find("out/x/" + name), std::string::npos) << stopped.err;
    fs::remove(place);
    fs::rename(folder / "kept", place);
    run_well({"run", "x.toml", "--frames", "1-4"});
    expect_no_dot_files();
    fs::remove_all(folder / "out");
  }
  const auto set_immutable = [](const fs::path& place, char sign) {
    return std::system(("chattr " + std::string(1, sign) + "i '" + place.string() + "' 2>/dev/null").c_str()) == 0;
  };
  if (!set_immutable(folder, '+') || !set_immutable(folder, '-')) GTEST_SKIP() << "no folder can be made immutable here";
  for (const std::string name : {"points", "images"}) {
    const fs::path place = folder / "out/x" / name;
    const Outcome stopped = run_until(words, [&] {
      if (!fs::exists(folder / "out/x/ledger/render.0002.json")) return false;
      return set_immutable(place, '+');
    }, 0);
    EXPECT_TRUE(set_immutable(place, '-'));
    EXPECT_EQ(stopped.exit, 5) << stopped.err;
    EXPECT_EQ(stopped.complaints(), 1) << stopped.err;
    EXPECT_NE(stopped.err.find("out/x/" + name), std::string::npos) << stopped.err;
    run_well({"run", "x.toml", "--frames", "1-4"});
    expect_no_dot_files();
    fs::remove_all(folder / "out");
  }
}

TEST_F(Strange, AShotOfTheUsersIsNotWrittenOver) {
  fs::create_directory(folder / "mine");
  write("mine/shot.toml", kSmallShot);
  expect_line(shell("cd mine && $P run shot.toml --out ."), 2,
              "./shot.toml: is the shot itself, and the run would write its own copy over it (another --out leaves it)");
  expect_line(shell("cd mine && $P run ../x.toml --out . --restart"), 2,
              "./shot.toml: is not of a run, and this one would write its own over it (another --out leaves it)");
  EXPECT_EQ(text_of(folder / "mine/shot.toml"), kSmallShot);
  EXPECT_EQ(files(), (std::vector<std::string>{"mine", "mine/shot.toml", "x.toml"}));

  run_well({"simulate", "x.toml"});   // the copy of a run is a shot like any other
  const std::string copy = text_of(folder / "out/x/shot.toml");
  run_well({"simulate", "out/x/shot.toml", "--out", "out/x"});
  EXPECT_EQ(run({"simulate", "out/x/shot.toml", "--out", "out/x", "--set", "camera.fov=20"}).exit, 2);
  EXPECT_EQ(text_of(folder / "out/x/shot.toml"), copy);
  for (const std::string name : {"points", "checkpoint", "ledger", "run.json"}) fs::remove_all(folder / "out/x" / name);
  run_well({"simulate", "x.toml", "--set", "sim.cfl=0.5"});   // as a run leaves it that was killed before its first frame
}

TEST_F(Strange, TheReportOfAStudyIsNotReplacedByThatOfARun) {
  for (const std::string made : {"cost.json", "verify.json"}) {
    fs::create_directory(folder / "study");
    write("study/" + made, "{}");
    write("study/report.html", "mine");
    const std::string line = "study: holds " + made + ", whose report.html the run's would replace (another --out or --no-report leaves it)";
    expect_line(run({"run", "x.toml", "--out", "study"}), 2, line);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder / "study"), {}), 2);
    run_well({"simulate", "x.toml", "--out", "study", "--frames", "1", "--no-report"});
    expect_line(run({"simulate", "x.toml", "--out", "study", "--frames", "1"}), 2, line);   // now that a run is there, too
    EXPECT_EQ(text_of(folder / "study/report.html"), "mine");
    fs::remove_all(folder / "study");
  }
}

TEST_F(Strange, AnyNameIsTheNameOfAShot) {
  for (const std::string name : {"x%d", "it's \"q\"", "line\nbreak", "-x", ".", "b\xff", "a b", "run"}) {
    write(name + ".toml", kSmallShot);
    const Outcome outcome = run({"run", "--json", "--quiet", "--frames", "1", "--", name + ".toml"});
    EXPECT_EQ(outcome.exit, 0) << name << outcome.err;
    EXPECT_EQ(Json::parse(outcome.out), run_json("out/" + fs::path(name + ".toml").stem().string())) << name;
    EXPECT_TRUE(fs::exists(folder / "out" / fs::path(name + ".toml").stem() / "movie.mp4")) << name;
  }
  write("...toml", kSmallShot);   // whose folder would be the one that out is in
  expect_line(run({"run", "...toml"}), 2, "...toml: has no name that a folder in out could have (--out says where)");
}

TEST_F(Strange, ClosedStreamsAndReadersThatLeaveSpoilNoFile) {
  run_well({"run", "x.toml"});
  const auto good = content();
  EXPECT_EQ(shell("exec <&- >&- 2>&-; $P run x.toml").exit, 0);
  EXPECT_EQ(shell("fds() { exec <&- >&- 2>&-; exec " POLYPIC_PROGRAM " run x.toml --out closed; }; (fds)").exit, 0);
  EXPECT_TRUE(content("closed") == good);
  // The reader is gone before the program starts.
  const std::string to_nobody = "trap '' PIPE; while echo; do :; done 2>/dev/null; ";
  for (const std::string words : {"run x.toml --out left", "list"}) {
    const Outcome outcome = shell("{ " + to_nobody + "$P " + words + "; echo $? >code; } | true");
    EXPECT_EQ(text_of(folder / "code"), "0\n") << words;
    EXPECT_EQ(outcome.err, "") << words;
  }
  EXPECT_TRUE(content("left") == good);
  const Outcome full = shell("$P run x.toml --quiet --json >/dev/full");
  expect_line(full, 5, "standard output: cannot be written");
  expect_no_dot_files();
}

// Started with the signal as a login shell leaves it: what a runner of tests ignores, its children would, too.
TEST_F(Strange, AReaderThatLeavesIsNoErrorOfAnyCommand) {
  for (const std::string words : {"list", "params", "verify --list", "info x.toml", "help run"}) {
    const Outcome outcome = shell("{ (while echo; do :; done) 2>/dev/null; env --default-signal=PIPE $P " + words + "; echo $? >code; } | true");
    EXPECT_EQ(text_of(folder / "code"), "0\n") << words;
    EXPECT_EQ(outcome.err, "") << words;
    fs::remove(folder / "code");
  }
}

TEST_F(Strange, ATerminalThatGoesAwaySavesTheRun) {
  const Outcome stopped = run_until(
      {"simulate", "x.toml", "--frames", "1-2000"}, [&] { return fs::exists(folder / "out/x/ledger/simulate.0003.json"); }, SIGHUP);
  EXPECT_EQ(stopped.exit, 129);
  EXPECT_NE(stopped.err.find("the simulation is saved in out/x/checkpoint/state."), std::string::npos) << stopped.err;
  EXPECT_EQ(shell("trap '' HUP; " POLYPIC_PROGRAM " simulate x.toml --frames 1-40 --out nohup & sleep 0.3; kill -HUP $!; wait $!").exit, 0);
  EXPECT_EQ(run_json("nohup").at("frames").size(), 40u);
  expect_no_dot_files();
}

TEST_F(Strange, BodiesWithoutNamesAreDrawnByTheirNumbers) {
  std::string shot = "[shot]\nframes = 1\n[sim]\nsolver = \"solid\"\ndomain = [[0, 0, 0], [0.6, 0.3, 0.3]]\ncell = 0.03\n[render]\nspp = 1\n";
  for (const std::string text : {"shape.box = [[0.1, 0, 0], [0.2, 0.1, 0.1]]\nmaterial = \"jelly\"\n", "shape.box = [[0.4, 0, 0], [0.5, 0.1, 0.1]]\nmaterial = \"steel\"\n"})
    shot += "[[body]]\n" + text;
  write("two.toml", shot);
  ASSERT_EQ(run({"surface", "two.toml"}).exit, 2);
  ASSERT_EQ(run({"simulate", "two.toml"}).exit, 0);
  ASSERT_EQ(run({"surface", "two.toml"}).exit, 0);
  std::vector<std::string> names;
  const Json info = Json::parse(run({"info", "out/two/surface/surface.0001.vdb", "--json"}).out);
  for (const Json& grid : info.at("grids")) names.push_back(grid.at("name"));
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"surface", "surface_1", "surface_2", "vel", "vel_1", "vel_2"}));
}

TEST_F(Strange, InfoKnowsEveryFileOfARun) {
  run_well({"run", "x.toml", "--preview"});
  fs::copy_file(folder / "out/x/checkpoint/state.0002.h5", folder / "out/x/checkpoint/state.0002.h5.bad2");
  int known = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "out/x")) {
    if (!entry.is_regular_file()) continue;
    const Outcome outcome = run_well({"info", entry.path().string(), "--json"});
    EXPECT_EQ(Json::parse(outcome.out).at("file"), entry.path().string());
    ++known;
  }
  // Files and records of frames, movies and their records, states, shot.toml, run.json and report.html.
  EXPECT_EQ(known, 2 * (5 + 4) + 2 * 2 + 2 + 3);
}

TEST_F(Strange, InfoTakesNothingForARunThatIsNone) {
  for (const std::string text : {"[]", "1", R"({"frames": 3})", R"({"frames": [1, 2]})", R"({"frames": [{"seconds": 3}]})",
                                 R"({"frames": [{"seconds": {"simulate": "x"}}]})"}) {
    write("j.json", text);
    expect_line(run({"info", "j.json"}), 2, "j.json: neither a run.json nor a record of a ledger");
  }
  write("j.json", R"({"frames": 1e999})");
  expect_line(run({"info", "j.json"}), 2, "j.json: not a JSON document");
}

TEST_F(Strange, ARecordOfAnotherFrameIsNone) {
  run_well({"run", "x.toml"});
  const auto good = content();
  const auto hashes = state_hashes("out/x");
  for (const std::string stage : {"simulate", "render"})
    write("out/x/ledger/" + stage + ".0001.json", text_of(folder / ("out/x/ledger/" + stage + ".0002.json")));
  write("out/x/ledger/simulate.0000.json", "{}");
  run_well({"run", "x.toml"});
  EXPECT_TRUE(content() == good);
  EXPECT_EQ(state_hashes("out/x"), hashes);
  run_well({"diff", "out/x", "out/x"});
}

TEST_F(Strange, AShotWithAFileBesideItGoesOn) {
  fs::create_directory(folder / "sub");
  write("sub/s.toml", std::string(kSmallShot) + "\n[[set]]\nname = \"m\"\nmesh = { file = \"m.obj\" }\n");
  write("sub/m.obj", "v 0 0 0\nv 0.3 0 0\nv 0 0.3 0.2\nf 1 2 3\n");
  const std::vector<std::string> words = {"run", "sub/s.toml"};
  run_well(words);
  EXPECT_NE(run_well(words).out.find("kept   frames 1-2\n"), std::string::npos);
  EXPECT_NE(run_well({"run", "sub/s.toml", "--set", "camera.fov=30"}).out.find("again  render (camera.fov changed)\n"), std::string::npos);
  run_well({"simulate", "out/s/shot.toml", "--out", "again", "--frames", "1"});   // the run's copy finds the file from where it is
  run_well({"simulate", "again/shot.toml", "--out", "again", "--frames", "1"});
  EXPECT_EQ(text_of(folder / "again/shot.toml").substr(0, 37), "# The files it names lie in ../sub\n[s");
  const std::string strange = "caf\xe9 %\t\x01";   // neither UTF-8 nor what a comment may hold
  fs::rename(folder / "sub", folder / strange);
  run_well({"simulate", strange + "/s.toml", "--out", "strange", "--frames", "1"});
  EXPECT_NE(run_well({"simulate", strange + "/s.toml", "--out", "strange", "--frames", "1"}).out.find("kept   frame 1\n"), std::string::npos);
  run_well({"simulate", "strange/shot.toml", "--out", "strange", "--frames", "1"});
  fs::rename(folder / strange, folder / "sub");
  write("bare.toml", std::string(kSmallShot) + "\n[[set]]\nname = \"m\"\nmesh = { file = \"sub/m.obj\" }\n");
  run_well({"simulate", "bare.toml", "--frames", "1"});
  run_well({"simulate", "out/bare/shot.toml", "--out", "again_bare", "--frames", "1"});
  const auto points = time_of("out/s/points/points.0002.vdb"), surface = time_of("out/s/surface/surface.0002.vdb");
  write("sub/m.obj", "v 0 0 0\nv 0.4 0 0\nv 0 0.3 0.2\nf 1 2 3\n");
  EXPECT_NE(run_well({"run", "sub/s.toml", "--set", "camera.fov=30"}).out.find("again  render (the content of a file changed)\n"), std::string::npos);
  EXPECT_EQ(time_of("out/s/points/points.0002.vdb"), points);
  EXPECT_EQ(time_of("out/s/surface/surface.0002.vdb"), surface);
}

// A wall of 5 mm, a twentieth of a cell, that is little of a mesh's surface: it is told.
TEST_F(Strange, AMeshWithAThinPartIsTold) {
  const auto box = [](int first, const std::string& low, const std::string& high, const std::string& bottom, const std::string& top) {
    std::string text;
    for (int k = 0; k < 8; ++k)
      text += "v " + std::string(k & 1 ? high : low) + " " + (k & 2 ? "0.9" : "0.1") + " " + (k & 4 ? top : bottom) + "\n";
    for (const auto& [a, b, c, d] : std::vector<std::array<int, 4>>{{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
      text += "f";
      for (const int corner : {a, b, c, d}) text += " " + std::to_string(first + corner);
      text += "\n";
    }
    return text;
  };
  const std::string shot = std::string(kSmallShot) + "\n[[collider]]\nname = \"dam\"\nshape = { mesh = { file = \"m.obj\" } }\n";
  write("m.toml", shot);
  const std::string floor = box(1, "0.1", "0.9", "-0.5", "0.05");
  write("m.obj", floor + box(9, "0.5", "0.505", "0.02", "0.1"));
  const std::vector<std::string> words = {"simulate", "m.toml", "--frames", "1", "--restart"};
  EXPECT_NE(run_well(words).out.find("\nthin   collider dam: "), std::string::npos);
  write("m.obj", floor);
  EXPECT_EQ(run_well(words).out.find("thin "), std::string::npos);
}

// A byte of JSON can take a hundred when it is parsed: 120 MB of brackets would take all memory.
TEST_F(Strange, DocumentsAreReadWithBoundedMemory) {
  const std::string brackets(std::size_t{1} << 26, '[');
  write("deep.json", brackets);
  expect_line(shell("ulimit -v 4000000; $P info deep.json"), 2, "deep.json: not a document of this program");
  write("large.json", brackets + brackets + brackets);
  expect_line(shell("ulimit -v 4000000; $P info large.json"), 2, "large.json: larger than 134217728 bytes");
  run_well({"simulate", "x.toml"});
  fs::rename(folder / "deep.json", folder / "out/x/ledger/simulate.0002.json");
  EXPECT_EQ(shell("ulimit -v 4000000; $P simulate x.toml").exit, 0);
  EXPECT_LT(fs::file_size(folder / "out/x/ledger/simulate.0002.json"), 1u << 20);
}

// The image alone takes more than there is; what was made before stays, and the run says where it ended.
TEST_F(Strange, WhatRunsOutOfMemoryNamesStageFrameAndKeyAndRunJsonSaysSo) {
  run_well({"run", "x.toml"});
  const std::string line = "--set render.width=12000: render.width = 12000 pixels: out of memory in render of frame 1, with 4.1 GB of "
                           "address space allowed (ulimit -v) (what is finished is kept: with more memory the same command goes on; "
                           "smaller pictures need less)";
  expect_line(shell("ulimit -v 4000000; $P render x.toml --set render.width=12000 --set render.height=8000"), 2, line);
  EXPECT_EQ(run_json().at("stopped"), (Json{{"code", 2}, {"message", line}, {"stage", "render"}, {"frame", 1}}));
  EXPECT_EQ(run_json().at("frames").size(), 2u);
  expect_no_dot_files();
  run_well({"run", "x.toml"});
  EXPECT_FALSE(run_json().contains("stopped"));
}

// Less than the libraries need before main, and less than the compiler of previews does.
TEST_F(Strange, AnyLimitOfAddressSpaceGetsOneLine) {
  for (const int megabytes : {700, 900, 1150}) {
    const std::string limit = std::to_string(1000 * megabytes);
    const Outcome outcome = shell("ulimit -v " + limit + "; $P run x.toml --preview --frames 1 --out o" + limit);
    EXPECT_TRUE(outcome.exit == 0 || outcome.exit == 2) << megabytes << " MB: exit " << outcome.exit << ", " << outcome.err;
    EXPECT_EQ(outcome.complaints(), outcome.exit == 0 ? 0 : 1) << outcome.err;
    EXPECT_NE(outcome.err.find(outcome.exit == 0 ? "" : "out of memory"), std::string::npos) << outcome.err;
  }
  const Outcome json = shell("ulimit -v 750000; $P list --json");
  EXPECT_EQ(json.exit, 2) << json.err;
  EXPECT_EQ("polypic: " + Json::parse(json.out).at("error").at("message").get<std::string>() + "\n", json.err);
}

TEST_F(Strange, ARunThatFailsBeforeItsFirstFrameSaysSoInRunJson) {
  run_well({"simulate", "x.toml"});
  fs::remove(folder / "out/x/points/points.0002.vdb");
  const std::string line = "out/x/points/points.0002.vdb: no such file; run simulate first (--frames 1 is there)";
  expect_line(run({"surface", "x.toml"}), 2, line);
  EXPECT_EQ(run_json().at("stopped"), (Json{{"code", 2}, {"message", line}, {"stage", "surface"}, {"frame", 1}}));
  EXPECT_EQ(run_json().at("frames").size(), 1u);
  const Outcome large = shell("ulimit -v 1000000; $P simulate x.toml --set sim.cell=0.003 --out large");   // 4.3 million particles, 740 MB
  EXPECT_EQ(large.exit, 2) << large.err;
  const Json stopped = run_json("large").at("stopped");
  EXPECT_EQ("polypic: " + stopped.at("message").get<std::string>() + "\n", large.err);
  EXPECT_EQ(stopped.at("stage"), "simulate");
  EXPECT_EQ(stopped.at("frame"), 1);
}

TEST_F(Strange, WithoutFfmpegAllButTheMovieIsThereAndTheLineSaysHowToMakeIt) {
  const std::string line = "out/x/movie.mp4: not made, the images are complete: ffmpeg cannot be started: No such file or directory (apt-get install "
                           "ffmpeg, then: polypic run x.toml --frames 1)";
  expect_line(shell("PATH=/usr/sbin; $(echo " POLYPIC_PROGRAM ") run x.toml --restart --frames 1"), 69, line);
  EXPECT_EQ(run_json().at("stopped"), (Json{{"code", 69}, {"message", line}}));
  EXPECT_TRUE(run_json().at("frames").at(0).at("seconds").contains("render"));
  EXPECT_TRUE(fs::exists(folder / "out/x/report.html"));
  expect_no_dot_files();
  EXPECT_NE(run_well({"run", "x.toml", "--frames", "1"}).out.find("kept   frame 1\n"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder / "out/x/movie.mp4"));
  EXPECT_FALSE(run_json().contains("stopped"));
}

TEST_F(Strange, DiffWritesOverNothingItCompares) {
  run_well({"run", "x.toml"});
  const std::string first = "out/x/images/beauty.0001.png", second = "out/x/images/beauty.0002.png", before = text_of(folder / first);
  expect_line(run({"diff", first, second, "--out", first}), 2, "--out " + first + ": is one of the images that are compared");
  EXPECT_EQ(text_of(folder / first), before);
  write("out/x/ledger/simulate.0001.json", "{}");
  expect_line(run({"diff", "out/x", "out/x"}), 2, "out/x/ledger/simulate.0001.json: not a record of a ledger");
}
