// A run one can trust: what is damaged, killed, full, changed or shared ends as the run that nothing happened to.
#include <regex>

#include "film_test.h"

namespace {

namespace fs = std::filesystem;

class Resume : public FilmTest {
 protected:
  /// The program under a limit on the size of files, which fails as a full disk does. `blocks` of 512 bytes.
  Outcome run_limited(int blocks, const std::string& words) const {
    const std::string command =
        "cd '" + folder.string() + "' && ulimit -f " + std::to_string(blocks) + " && exec " POLYPIC_PROGRAM " " + words + " >../out 2>../err";
    const int status = std::system(("sh -c \"" + command + "\"").c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 255, text_of(log / "out"), text_of(log / "err")};
  }
  void expect_full(const Outcome& outcome, const std::string& file) const {
    EXPECT_EQ(outcome.exit, 5) << outcome.err;
    EXPECT_EQ(outcome.complaints(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find("polypic: out/x/" + file), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find(".tmp"), std::string::npos) << outcome.err;
    expect_no_dot_files();
  }
};

using Damage = std::string (*)(std::string);
const std::pair<const char*, Damage> kDamages[] = {
    {"a flipped bit", [](std::string bytes) { return bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 4), bytes; }},
    {"cut short", [](std::string bytes) { return bytes.substr(0, bytes.size() - 7); }},
    {"empty", [](std::string) { return std::string(); }},
    {"foreign", [](std::string bytes) { return std::string(bytes.size(), 'x'); }},
};

}  // namespace

TEST_F(Resume, MakesDamagedFilesAgainWithTheSameBytes) {
  run_well({"run", "x.toml"});
  const auto good = content();
  for (const auto& [kind, damage] : kDamages) {
    for (const std::string name :
         {"points/points.0002.vdb", "surface/surface.0001.vdb", "images/beauty.0001.exr", "images/beauty.0002.png", "movie.mp4"})
      write("out/x/" + name, damage(good.at(name)));
    const Outcome outcome = run_well({"run", "x.toml"});
    EXPECT_NE(outcome.out.find("again  points/points.0002.vdb and 3 more files are damaged"), std::string::npos) << outcome.out;
    EXPECT_TRUE(content() == good) << kind;
  }
}

TEST_F(Resume, MakesFramesWithDamagedRecordsAgain) {
  run_well({"run", "x.toml"});
  const auto good = content();
  const auto hashes = state_hashes("out/x");
  for (const std::string name : {"simulate.0002.json", "surface.0001.json", "render.0002.json", "movie.json"})
    write("out/x/ledger/" + name, "{\"schema\": 1");
  run_well({"run", "x.toml"});
  EXPECT_TRUE(content() == good);
  EXPECT_EQ(state_hashes("out/x"), hashes);
  for (const std::string key : {"\"state_hash\": \"", "\"kinetic_energy\": ", "\"hash\": \""}) {   // a digit of them: JSON still
    std::string record = text_of(folder / "out/x/ledger/simulate.0002.json");
    char& digit = record.at(record.find(key) + key.size());
    digit = digit == '7' ? '3' : '7';
    write("out/x/ledger/simulate.0002.json", record);
    run_well({"run", "x.toml"});
    EXPECT_TRUE(content() == good) << key;
    EXPECT_EQ(state_hashes("out/x"), hashes) << key;
  }
}

TEST_F(Resume, AStageByItselfRefusesADamagedFileUpstream) {
  run_well({"run", "x.toml"});
  const std::string points = text_of(folder / "out/x/points/points.0002.vdb"), surface = text_of(folder / "out/x/surface/surface.0002.vdb");
  fs::remove(folder / "out/x/surface/surface.0002.vdb");
  for (const auto& [kind, damage] : kDamages) {
    write("out/x/points/points.0002.vdb", damage(points));
    const std::vector<std::string> before = files();
    const Outcome refused = run({"surface", "x.toml"});
    EXPECT_EQ(refused.exit, 2) << kind;
    EXPECT_EQ(refused.err, "polypic: out/x/points/points.0002.vdb: is damaged or out of date; run simulate, which makes it again\n");
    EXPECT_EQ(files(), before);
  }
  write("out/x/points/points.0002.vdb", points);
  run_well({"surface", "x.toml"});
  fs::remove(folder / "out/x/images/beauty.0002.png");
  write("out/x/surface/surface.0002.vdb", surface.substr(1) + "?");
  const Outcome refused = run({"render", "x.toml"});
  EXPECT_EQ(refused.exit, 2);
  EXPECT_EQ(refused.err, "polypic: out/x/surface/surface.0002.vdb: is damaged or out of date; run surface, which makes it again\n");
}

// Pictures are not thrown away before all that they are drawn from is found whole: grains are drawn from points, a preview may be from surfaces.
TEST_F(Resume, ARestartLooksAtAllItReadsFirst) {
  const std::vector<std::string> grains = {"--set", "body.column.look=sand"}, surfaces = {"--preview", "--set", "preview.draw=surface"};
  const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  run_well(with({"run", "x.toml", "--out", "grains"}, grains));
  run_well({"run", "x.toml", "--out", "surfaces"});
  run_well(with({"render", "x.toml", "--out", "surfaces"}, surfaces));
  write("grains/points/points.0002.vdb", "x");
  write("surfaces/surface/surface.0002.vdb", "x");
  const std::vector<std::string> before = files();
  const Outcome drawn = run(with({"render", "x.toml", "--out", "grains", "--restart"}, grains));
  EXPECT_EQ(drawn.exit, 2);
  EXPECT_EQ(drawn.err, "polypic: grains/points/points.0002.vdb: is damaged or out of date; run simulate, which makes it again\n");
  const Outcome shown = run(with({"render", "x.toml", "--out", "surfaces", "--restart"}, surfaces));
  EXPECT_EQ(shown.exit, 2);
  EXPECT_EQ(shown.err, "polypic: surfaces/surface/surface.0002.vdb: is damaged or out of date; run surface, which makes it again\n");
  EXPECT_EQ(files(), before);
}

TEST_F(Resume, DoesAgainWhatAChangedKeyReachesAndNoMore) {
  run_well({"run", "x.toml"});
  const auto first = content();
  const auto differs = [&](const std::string& name) { return text_of(folder / "out/x" / name) != first.at(name); };

  Outcome outcome = run_well({"run", "x.toml", "--set", "camera.fov=30"});
  EXPECT_NE(outcome.out.find("again  render (camera.fov changed)\n"), std::string::npos) << outcome.out;
  EXPECT_TRUE(differs("images/beauty.0002.exr") && differs("movie.mp4") && differs("shot.toml"));
  EXPECT_FALSE(differs("surface/surface.0002.vdb") || differs("points/points.0002.vdb"));
  EXPECT_FALSE(run_json().at("frames").at(1).at("seconds").empty());

  const auto points = time_of("out/x/points/points.0002.vdb");
  outcome = run_well({"run", "x.toml", "--set", "surface.voxel=0.012"});
  EXPECT_NE(outcome.out.find("again  surface, render (surface.voxel, camera.fov changed)\n"), std::string::npos) << outcome.out;
  EXPECT_TRUE(differs("surface/surface.0002.vdb") && differs("images/beauty.0001.png"));
  EXPECT_EQ(time_of("out/x/points/points.0002.vdb"), points);

  run_well({"run", "x.toml"});
  EXPECT_TRUE(content() == first);
  EXPECT_EQ(time_of("out/x/points/points.0002.vdb"), points);
}

TEST_F(Resume, NamesTheChangedKeyOfASimulation) {
  run_well({"simulate", "x.toml"});
  const auto before = content();
  const Outcome refused = run({"run", "x.toml", "--set", "sim.cell=0.06", "--json"});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_EQ(refused.err, "polypic: out/x/shot.toml: sim.cell = 0.06: the frames here were made with 0.03 (--restart or another --out goes on)\n");
  const Json error = Json::parse(refused.out).at("error");
  EXPECT_EQ(error.at("code"), 4);
  EXPECT_EQ(error.at("key"), "sim.cell");
  EXPECT_EQ(error.at("value"), "0.06");
  EXPECT_EQ(error.at("file"), "out/x/shot.toml");
  // The five other sides come with the one that is written: they are not told.
  EXPECT_EQ(run({"run", "x.toml", "--set", "sim.boundary.y_upper=open"}).err,
            "polypic: out/x/shot.toml: sim.boundary.y_upper = \"open\": the frames here were made without it (--restart or another --out goes on)\n");
  // A quality sets many keys at once, none of which anybody typed: it is told first.
  EXPECT_EQ(run({"run", "x.toml", "--quality", "draft", "--set", "sim.cell=0.06"}).err,
            "polypic: out/x/shot.toml: shot.quality = \"draft\": the frames here were made with \"normal\"; sim.cell changed too (--restart or another --out goes on)\n");
  EXPECT_TRUE(content() == before);
  run_well({"run", "x.toml", "--set", "sim.cell=0.06", "--out", "other"});
  run_well({"simulate", "x.toml", "--set", "shot.checkpoint_every=1", "--set", "shot.checkpoint_keep=5", "--set", "sim.audit=true"});   // in no hash
}

// Water at rest asks for no pressure at all, however small the tolerance; once a fist has crossed the air to it, no iteration gets as far as 1e-30.
TEST_F(Resume, ARunThatStopsSaysWhereSinceWhenAndWhichStateIsGood) {
  write("stops.toml",
        "[sim]\ndimension = 2\ndomain = [[0, 0], [2, 1]]\ncell = 0.02\npressure_tolerance = 1e-30\n"
        "[[body]]\nname = \"column\"\nshape = { box = [[0, 0], [1, 0.8]] }\n"
        "[[collider]]\nname = \"fist\"\nshape = { box = [[1.2, 0.2], [1.4, 0.4]] }\nvelocity = [-1, 0]\n");
  const Outcome stopped = run({"simulate", "stops.toml", "--frames", "1-20"});
  EXPECT_EQ(stopped.exit, 3);
  std::smatch found;
  const std::regex sentence(
      "polypic: frame (\\d+): pressure: \\d+ unknowns, residual [0-9.e-]+ after \\d+ iterations, asked 1e-30, "
      "with all of the frame's steps 8 times as short too; "
      "at the frame's start the fastest is particle \\d+ of body column, cell \\(\\d+, \\d+\\), \\([0-9.e-]+, [0-9.e-]+, 0\\) m, [0-9.]+ m/s; "
      "well up to frame (\\d+) \\(a larger sim.pressure_tolerance, or a smaller sim.cfl, may help; "
      "the last whole frame's state is in out/stops/checkpoint/state.(\\d+).h5, and good\\)\n");
  ASSERT_TRUE(std::regex_match(stopped.err, found, sentence)) << stopped.err;
  const int frame = std::stoi(found[1]);
  EXPECT_EQ(frame, 6);   // 1.2 - 4.8 / 24 = 1
  EXPECT_EQ(std::stoi(found[2]), frame - 1);
  EXPECT_EQ(std::stoi(found[3]), frame - 1);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/stops/checkpoint" / ("state." + found[3].str() + ".h5")));
  const Outcome at_once = run({"simulate", "stops.toml", "--set", "body.column.velocity=[1,0]", "--out", "other"});
  EXPECT_EQ(at_once.exit, 3);
  EXPECT_NE(at_once.err.find("; frame 1 is the start: there is no other state to go on from)"), std::string::npos) << at_once.err;
}

TEST_F(Resume, ASurfaceOfOtherKeysIsNotRendered) {
  run_well({"run", "x.toml", "--frames", "1"});
  const Outcome refused = run({"render", "x.toml", "--set", "surface.smooth=1"});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_EQ(refused.err,
            "polypic: out/x/shot.toml: surface.smooth = 1: the frames here were made with 8 (surface makes them again; another --out leaves them)\n");
}

TEST_F(Resume, AStageThatIsMadeAnewNamesTheChangedKeyOfWhatItReads) {
  write("t.obj", "v 0 0 0\nv 0.2 0 0\nv 0 0.2 0\nv 0 0 0.2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  write("m.toml", std::string(kSmallShot) + "\n[[body]]\nname = \"stone\"\nshape.mesh = { file = \"t.obj\", translate = [0.3, 0, 0] }\n");
  run_well({"run", "m.toml", "--frames", "1", "--preview", "--set", "preview.draw=\"surface\""});
  const auto refused = [&](std::vector<std::string> words) {
    words.insert(words.begin() + 1, "m.toml");
    words.insert(words.end(), {"--frames", "1", "--json"});
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit, 4) << outcome.err;
    return std::string(Json::parse(outcome.out).at("error").value("key", "none")) + ": " + outcome.err.substr(outcome.err.find('('));
  };
  EXPECT_EQ(refused({"surface", "--restart", "--set", "sim.cfl=0.5"}), "sim.cfl: (simulate --restart or another --out goes on)\n");
  EXPECT_EQ(refused({"render", "--restart", "--set", "surface.smooth=2"}), "surface.smooth: (surface makes them again; another --out leaves them)\n");
  EXPECT_EQ(refused({"render", "--preview", "--set", "preview.draw=\"surface\"", "--set", "surface.smooth=2"}),
            "surface.smooth: (surface makes them again; another --out leaves them)\n");
  write("t.obj", text_of(folder / "t.obj") + "\n");
  EXPECT_EQ(refused({"run"}), "body.stone.shape.mesh.file: (--restart or another --out goes on)\n");
}

TEST_F(Resume, PreviewsOfTheSurfaceGoWithIt) {
  const std::vector<std::string> drawn = {"--frames", "1", "--set", "preview.draw=\"surface\""};
  const auto with = [&](std::vector<std::string> words) { return words.insert(words.end(), drawn.begin(), drawn.end()), words; };
  run_well(with({"run", "x.toml", "--preview"}));
  run_well(with({"surface", "x.toml", "--restart"}));
  for (const std::string name : {"preview/preview.0001.png", "preview.mp4", "images/beauty.0001.png", "movie.mp4"})
    EXPECT_FALSE(fs::exists(folder / "out/x" / name)) << name;
  EXPECT_TRUE(fs::exists(folder / "out/x/points/points.0001.vdb"));
}

TEST_F(Resume, ARefusedCommandOfOtherKeysLeavesTheRunAsItWas) {
  run_well({"run", "x.toml"});
  const std::string before = text_of(folder / "out/x/run.json");
  EXPECT_EQ(run({"render", "x.toml", "--frames", "7", "--set", "render.exposure=3"}).exit, 2);
  EXPECT_EQ(text_of(folder / "out/x/run.json"), before);
}

TEST_F(Resume, AFilledGapLeavesNoCheckpoint) {
  const std::vector<std::string> simulate = {"simulate", "x.toml", "--frames", "1-14", "--set", "shot.checkpoint_every=5"};
  run_well(simulate);
  const auto good = content();
  fs::remove(folder / "out/x/points/points.0007.vdb");
  run_well(simulate);
  EXPECT_TRUE(content() == good);
}

TEST_F(Resume, AMovieSaysWhichPicturesItLeavesOut) {
  run_well({"run", "x.toml", "--frames", "1-3"});
  const Outcome outcome = run_well({"render", "x.toml", "--frames", "2-3", "--set", "render.exposure=1"});
  EXPECT_NE(outcome.out.find("movie  2 frames; 1 more are of other keys, or not whole\n"), std::string::npos) << outcome.out;
}

TEST_F(Resume, OnePictureInOtherLightLeavesTheMovieAsItWas) {
  run_well({"run", "x.toml"});
  const std::string movie = text_of(folder / "out/x/movie.mp4");
  const Outcome tried = run_well({"render", "x.toml", "--frames", "2", "--set", "render.exposure=1"});
  EXPECT_NE(tried.out.find("movie  as it was: 1 of its frames are of other keys, or not whole\n"), std::string::npos) << tried.out;
  EXPECT_NE(tried.out.find("done   out/x/images/beauty.0002.png"), std::string::npos) << tried.out;
  EXPECT_EQ(text_of(folder / "out/x/movie.mp4"), movie);
}

TEST_F(Resume, AnotherVersionOfTheProgramGoesOnWithNoSimulation) {
  run_well({"run", "x.toml"});
  const auto make_old = [&](const std::string& name) {
    Json record = Json::parse(text_of(folder / "out/x/ledger" / name));
    record.at("version") = "0.0.1";
    record.erase("checksum");   // old ones had none
    write("out/x/ledger/" + name, record.dump());
  };
  make_old("simulate.0001.json");
  make_old("render.0002.json");
  const Outcome outcome = run_well({"run", "x.toml"});   // nothing is left to simulate
  EXPECT_NE(outcome.out.find("again  render (program.version changed)\n"), std::string::npos) << outcome.out;
  const Outcome refused = run({"simulate", "x.toml", "--frames", "3", "--json"});
  EXPECT_EQ(refused.exit, 4);
  EXPECT_EQ(Json::parse(refused.out).at("error").at("key"), "program.version");
  EXPECT_NE(refused.err.find("made by polypic 0.0.1"), std::string::npos) << refused.err;
}

TEST_F(Resume, GoesOnFromTheLastGoodCheckpointAndKeepsTheBadOnes) {
  const std::vector<std::string> simulate = {"simulate", "x.toml", "--set", "shot.checkpoint_every=2", "--set", "shot.checkpoint_keep=3", "--frames"};
  const auto frames = [&](const std::string& range, const std::string& out) {
    std::vector<std::string> words = simulate;
    words.insert(words.end(), {range, "--out", out});
    return run(words);
  };
  EXPECT_EQ(frames("1-9", "straight").exit, 0);
  EXPECT_EQ(frames("1-7", "begun").exit, 0);
  EXPECT_TRUE(fs::exists(folder / "begun/checkpoint/state.0007.h5") && fs::exists(folder / "begun/checkpoint/state.0004.h5"));
  EXPECT_FALSE(fs::exists(folder / "begun/checkpoint/state.0002.h5"));   // the last three
  EXPECT_EQ(run({"simulate", "x.toml", "--set", "sim.cfl=0.5", "--frames", "1-7", "--out", "other"}).exit, 0);

  const std::string newest = text_of(folder / "begun/checkpoint/state.0007.h5"), other = text_of(folder / "other/checkpoint/state.0007.h5");
  std::vector<std::pair<std::string, std::string>> bad = {{"of another shot", other},
                                                          {"of another frame", text_of(folder / "begun/checkpoint/state.0006.h5")}};
  for (const auto& [kind, damage] : kDamages) bad.emplace_back(kind, damage(newest));
  for (const auto& [kind, bytes] : bad) {
    fs::remove_all(folder / "again");
    fs::copy(folder / "begun", folder / "again", fs::copy_options::recursive);
    write("again/checkpoint/state.0007.h5", bytes);
    write("again/checkpoint/state.0007.h5.bad", "taken");
    const Outcome outcome = frames("1-9", "again");
    EXPECT_EQ(outcome.exit, 0) << kind << outcome.err;
    EXPECT_EQ(outcome.complaints(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find("; kept as state.0007.h5.bad2, the one before is taken"), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.out.find("from   checkpoint/state.0006.h5\n"), std::string::npos) << outcome.out;
    EXPECT_EQ(text_of(folder / "again/checkpoint/state.0007.h5.bad"), "taken");
    EXPECT_TRUE(text_of(folder / "again/checkpoint/state.0007.h5.bad2") == bytes);
    EXPECT_EQ(state_hashes("again"), state_hashes("straight")) << kind;
    EXPECT_TRUE(text_of(folder / "again/points/points.0009.vdb") == text_of(folder / "straight/points/points.0009.vdb")) << kind;
  }

  for (const std::string frame : {"0004", "0006", "0007"}) write("begun/checkpoint/state." + frame + ".h5", "");   // none is good: from frame 1
  const Outcome outcome = frames("1-9", "begun");
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_EQ(outcome.complaints(), 3) << outcome.err;
  EXPECT_EQ(state_hashes("begun"), state_hashes("straight"));
}

TEST_F(Resume, DamagedPointsAreSimulatedFromTheCheckpointBefore) {
  run_well({"simulate", "x.toml", "--set", "shot.checkpoint_every=2", "--set", "shot.checkpoint_keep=9", "--frames", "1-6"});
  const auto good = content();
  for (const std::string frame : {"0003", "0006"}) write("out/x/points/points." + frame + ".vdb", "?");
  const Outcome outcome = run_well({"simulate", "x.toml", "--set", "shot.checkpoint_every=2", "--set", "shot.checkpoint_keep=9", "--frames", "1-6"});
  EXPECT_NE(outcome.out.find("from   checkpoint/state.0002.h5\n"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("from   checkpoint/state.0004.h5\n"), std::string::npos) << outcome.out;
  EXPECT_TRUE(content() == good);
}

TEST_F(Resume, TenAndAKillAndTenAreTwenty) {
  for (const std::string scheme : {"flip", "polypic"}) {
    const std::vector<std::string> words = {"simulate", "x.toml", "--frames", "1-20", "--set", "sim.cell=0.06", "--set", "sim.kernel=\"quadratic\"",
                                            "--out", scheme, "--set", "sim.transfer=" + scheme};
    std::string text = kSmallShot;
    text.erase(text.find("modes = 8"), 9);
    write("x.toml", text);
    Outcome straight = run({"simulate", "x.toml", "--frames", "1-20", "--set", "sim.cell=0.06", "--set", "sim.kernel=\"quadratic\"", "--out",
                            "straight", "--restart", "--set", "sim.transfer=" + scheme});
    ASSERT_EQ(straight.exit, 0) << straight.err;
    run_until(words, [&] { return fs::exists(folder / scheme / "ledger/simulate.0010.json"); }, SIGKILL);
    const Outcome outcome = run_well(words);
    EXPECT_EQ(state_hashes(scheme), state_hashes("straight")) << scheme;
    EXPECT_EQ(state_hashes(scheme).size(), 20u);
    for (const std::string name : {"points/points.0010.vdb", "points/points.0011.vdb", "points/points.0020.vdb", "checkpoint/state.0020.h5"})
      EXPECT_TRUE(text_of(folder / scheme / name) == text_of(folder / "straight" / name)) << scheme << " " << name;
    expect_no_dot_files();
  }
}

TEST_F(Resume, AnInterruptionSavesTheFrameThatWasReachedAndSaysSo) {
  const std::vector<std::string> words = {"simulate", "x.toml", "--frames", "1-2000"};
  const Outcome stopped = run_until(words, [&] { return fs::exists(folder / "out/x/ledger/simulate.0013.json"); }, SIGTERM);
  EXPECT_EQ(stopped.exit, 143);
  EXPECT_EQ(stopped.complaints(), 1);
  const std::size_t at = stopped.err.find("out/x/checkpoint/state.");
  ASSERT_NE(at, std::string::npos) << stopped.err;
  const std::string name = stopped.err.substr(at, std::string("out/x/checkpoint/state.0000.h5").size());
  EXPECT_EQ(stopped.err, "polypic: interrupted; the simulation is saved in " + name + ", and the same command goes on from there\n");
  EXPECT_TRUE(fs::exists(folder / name));
  const std::size_t made = state_hashes("out/x").size();
  EXPECT_GE(made, 13u);
  EXPECT_EQ(std::stoul(name.substr(name.size() - 7, 4)), made);
  const Outcome outcome = run_well({"simulate", "x.toml", "--frames", std::to_string(made + 1)});
  EXPECT_NE(outcome.out.find("from   " + name.substr(6) + "\n"), std::string::npos) << outcome.out;
}

TEST_F(Resume, AFullDiskStopsAStageAndWhatIsThereIsWhole) {
  run_well({"run", "x.toml", "--out", "straight"});
  expect_full(run_limited(8, "simulate x.toml"), "points/points.0001.vdb: ");
  const auto points = fs::file_size(folder / "straight/points/points.0002.vdb"), state = fs::file_size(folder / "straight/checkpoint/state.0002.h5");
  ASSERT_LT(points + 4096, state);
  expect_full(run_limited(static_cast<int>(state / 512 - 1), "simulate x.toml"), "checkpoint/state.0002.h5: File too large");
  EXPECT_TRUE(text_of(folder / "out/x/points/points.0001.vdb") == text_of(folder / "straight/points/points.0001.vdb"));
  run_well({"simulate", "x.toml"});
  expect_full(run_limited(8, "surface x.toml"), "surface/surface.0001.vdb: ");
  run_well({"surface", "x.toml"});
  expect_full(run_limited(8, "render x.toml"), "images/beauty.0001.exr: ");
  run_well({"render", "x.toml"});
  fs::remove(folder / "out/x/movie.mp4");
  const auto movie = fs::file_size(folder / "straight/movie.mp4");
  ASSERT_GT(movie, 8u * 512);
  expect_full(run_limited(8, "run x.toml"), "movie.mp4: ");
  run_well({"run", "x.toml"});
  EXPECT_TRUE(content() == content("straight"));
}

TEST_F(Resume, ADirectoryThatGoesAwayStopsTheRunWithOneLine) {
  const Outcome stopped = run_until({"run", "x.toml", "--frames", "1-200"}, [&] {
    if (!fs::exists(folder / "out/x/images/beauty.0001.png")) return false;
    fs::rename(folder / "out/x", folder / "out/moved");
    return true;
  }, 0);
  EXPECT_EQ(stopped.exit, 5) << stopped.err;
  EXPECT_EQ(stopped.complaints(), 1) << stopped.err;
  EXPECT_NE(stopped.err.find("No such file or directory"), std::string::npos) << stopped.err;
  EXPECT_EQ(stopped.err.find(".tmp"), std::string::npos) << stopped.err;
  EXPECT_FALSE(fs::exists(folder / "out/x"));
}

TEST_F(Resume, ProcessesShareTheFramesOfAStage) {
  run_well({"run", "x.toml", "--frames", "1-6", "--out", "straight"});
  run_well({"simulate", "x.toml", "--frames", "1-6"});
  for (const std::string stage : {"surface", "render"}) {
    const std::string one = POLYPIC_PROGRAM " " + stage + " x.toml --frames 1-6", log_of = " >" + stage;
    const std::string both = "cd '" + folder.string() + "' && { " + one + log_of + "1 2>&1 & first=$!; " + one + log_of +
                             "2 2>&1; second=$?; wait $first && exit $second; }";
    EXPECT_EQ(std::system(both.c_str()), 0) << text_of(folder / (stage + "1")) << text_of(folder / (stage + "2"));
  }
  EXPECT_TRUE(content() == content("straight"));
  EXPECT_EQ(run_json().at("frames").size(), 6u);
  for (const Json& frame : run_json().at("frames")) EXPECT_EQ(frame.at("seconds").size(), 3u);
  expect_no_dot_files();
}

TEST_F(Resume, NobodyChangesTheShotOfADirectoryInUse) {
  Outcome changed, elsewhere, shared;
  const auto second = [&](const std::string& words) {
    const int status = std::system(("cd '" + folder.string() + "' && " POLYPIC_PROGRAM " " + words + " >second.out 2>second.err").c_str());
    return Outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 255, "", text_of(folder / "second.err")};
  };
  run_until({"run", "x.toml", "--frames", "1-200"}, [&] {
    if (!fs::exists(folder / "out/x/ledger/render.0001.json")) return false;
    changed = second("render x.toml --frames 1 --set render.spp=2");
    elsewhere = second("render x.toml --preview --frames 1 --set render.spp=2");   // no frame of it is there
    shared = second("render x.toml --frames 1");
    return true;
  }, SIGINT);
  EXPECT_EQ(changed.exit, 2);
  EXPECT_NE(changed.err.find("out/x: in use by process "), std::string::npos) << changed.err;
  EXPECT_EQ(elsewhere.exit, 2) << elsewhere.err;
  EXPECT_EQ(shared.exit, 0) << shared.err;
  expect_no_dot_files();
}

TEST_F(Resume, APlaneHasNoSurfaceAndIsDrawn) {
  write("flat.toml", R"([shot]
frames = 2
[sim]
dimension = 2
domain = [[0, 0], [0.6, 0.3]]
cell = 0.03
particles_per_cell = 4
[[body]]
name = "column"
shape = { box = [[0, 0], [0.27, 0.18]] }
[[effect]]
kind = "gravity"
acceleration = [0, -9.81]
[render]
width = 160
height = 90
)");
  run_well({"run", "flat.toml"});
  EXPECT_FALSE(fs::exists(folder / "out/flat/surface"));
  for (const std::string name : {"images/beauty.0002.exr", "images/beauty.0002.png", "movie.mp4", "checkpoint/state.0002.h5"})
    EXPECT_GT(fs::file_size(folder / "out/flat" / name), 0u) << name;
  EXPECT_FALSE(run_json("out/flat").at("hashes").contains("surface"));
  EXPECT_EQ(run_json("out/flat").at("frames").at(0).at("seconds").size(), 2u);
  const Outcome refused = run({"surface", "flat.toml"});
  EXPECT_EQ(refused.exit, 2);
  EXPECT_EQ(refused.complaints(), 1);
  EXPECT_NE(refused.err.find("sim.dimension = 2: has no surface"), std::string::npos) << refused.err;

  const auto good = content("out/flat");
  write("out/flat/points/points.0002.vdb", "?");
  fs::remove(folder / "out/flat/images/beauty.0002.png");
  EXPECT_EQ(run({"render", "flat.toml"}).exit, 2);
  run_well({"run", "flat.toml"});
  EXPECT_TRUE(content("out/flat") == good);
}
