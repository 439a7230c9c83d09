// `polypic cost` from outside: files, exit codes, what is not measured again.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "tests/run_program.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class CostProgram : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    ::setenv("XDG_CACHE_HOME", (log / "cache").c_str(), 1);   // what it keeps of shots is forgotten
  }
  /// Words as a shell takes them, without quotes.
  Outcome cost(const std::string& line) const {
    std::vector<std::string> words;
    std::istringstream in(line);
    for (std::string word; in >> word;) words.push_back(word);
    return run(words);
  }
  Json study() const { return Json::parse(text_of(folder / "study/cost.json")); }
};

const std::string kProblem = "cost taylor_green_2d --set problem.time=0.2 --set sim.cell=0.0625 ", kQuick = kProblem + "--repeats 2 ";

TEST_F(CostProgram, MeasuresEveryVariantOnceAndKeepsIt) {
  const Outcome first = cost(kQuick + "--vary sim.transfer=apic,polypic --out study");
  ASSERT_EQ(first.exit, 0) << first.err;
  const Json json = study();
  ASSERT_EQ(json.at("variants").size(), 2u);
  for (const Json& v : json.at("variants")) {
    EXPECT_EQ(v.at("seconds").size(), 2u);
    EXPECT_GT(v.at("error_energy"), 0);
    EXPECT_GT(v.at("peak_bytes"), 1 << 20);
    EXPECT_GT(v.at("passes").at("pressure").at("calls"), 0);
    EXPECT_TRUE(v.at("energy_changes").contains("p2g"));
    EXPECT_EQ(v.at("course").at("time").size(), v.at("course").at("enstrophy").size());
    double passes = 0;
    for (const Json& pass : v.at("passes")) passes += pass.at("cpu_seconds").get<double>();
    EXPECT_NEAR(passes, v.at("cpu_seconds").get<double>(), 0.05 * v.at("cpu_seconds").get<double>());
  }
  EXPECT_EQ(text_of(folder / "study/cost.csv").substr(0, 16), "variant,transfer");
  const Outcome again = cost(kQuick + "--vary sim.transfer=apic,polypic --out study");
  EXPECT_EQ(again.exit, 0);
  EXPECT_NE(again.out.find("kept   2 of 2 variants"), std::string::npos) << again.out;
  Json second = study();
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(second.at("variants")[i].at("seconds"), json.at("variants")[i].at("seconds"));  // the clock would differ
  const Outcome more = cost(kQuick + "--vary sim.transfer=apic,polypic,pic --out study");
  EXPECT_NE(more.out.find("kept   2 of 3 variants"), std::string::npos) << more.out;
}

TEST_F(CostProgram, SaysHowLongEachSchemeTakesToAnError) {
  const Outcome made = cost("cost taylor_green_2d --set problem.time=0.5 --repeats 1 --vary sim.splitting=lie,reflection "
                            "--refine sim.cell=0.125,0.0625,0.03125 --error velocity --out study");
  ASSERT_EQ(made.exit, 0) << made.err;
  const Json json = study();
  ASSERT_EQ(json.at("variants").size(), 6u);
  EXPECT_EQ(json.at("variants")[2].at("scheme"), "polypic full linear");
  EXPECT_EQ(json.at("variants")[2].at("variant"), "polypic full linear cell 0.0312");
  const Json& part = json.at("cases")[0];
  EXPECT_EQ(part.at("decides"), "velocity");
  const Json& times = part.at("seconds_to_error");
  ASSERT_GE(times.at("errors").size(), 2u);
  for (const Json& seconds : times.at("schemes")) {
    ASSERT_EQ(seconds.size(), times.at("errors").size());
    EXPECT_GT(seconds[0].get<double>(), 0);
  }
  EXPECT_NE(made.out.find("An error of velocity of "), std::string::npos);
  EXPECT_NE(text_of(folder / "study/report.html").find("Seconds to an error of velocity"), std::string::npos);
}

// A drop between the places of coarse cells: they would be refused, and say nothing of the shot.
TEST_F(CostProgram, TriesNoCellsInWhichABodyHasNoParticle) {
  const std::string shot = "[shot]\nframes = 2\n[sim]\ndimension = 2\ncell = 0.0125\n"
                           "[[body]]\nname = \"sea\"\nshape = { box = [[0, 0], [1, 0.4]] }\n"
                           "[[body]]\nname = \"drop\"\nshape = { sphere = { center = [0.5, 0.7], radius = ";
  write("drop.toml", shot + "0.009 } }\n");
  const Outcome plan = cost("cost drop.toml --dry-run --vary sim.transfer=pic,apic");
  EXPECT_EQ(plan.exit, 0) << plan.err;
  EXPECT_EQ(plan.out.find("cannot run"), std::string::npos) << plan.out;
  EXPECT_NE(plan.out.find("cells of 0.025 m: "), std::string::npos) << plan.out;
  EXPECT_NE(plan.out.find("; not in cells of 0.05 m, in which body drop has no particle"), std::string::npos) << plan.out;
  const Outcome own = cost("cost drop.toml --dry-run --vary sim.cell=0.025,0.05 --vary sim.particles_per_cell=4,16");
  const std::regex line("drop: cell 0\\.05 [a-z_]+ 4   cannot run: drop\\.toml:11:[0-9]+: body\\.drop\\.shape: no particle");
  EXPECT_TRUE(std::regex_search(own.out, line)) << own.out;
  write("drop.toml", shot + "0.003 } }\n");
  const Outcome none = cost("cost drop.toml --dry-run");
  EXPECT_EQ(none.exit, 2);
  const std::string why = "no coarser cell does for every body and collider; not in cells of 0.05 m, in which body drop has no particle";
  EXPECT_NE(none.err.find(why), std::string::npos) << none.err;
}

TEST_F(CostProgram, TriesNoCellsInWhichAColliderHasNoContact) {
  write("plate.toml", "[shot]\nframes = 2\n[sim]\nsolver = \"solid\"\ndimension = 2\ncell = 0.0125\n[[body]]\nname = \"a\"\nmaterial = \"jelly\"\n"
                      "shape = { box = [[0.3, 0.3], [0.6, 0.6]] }\n[[collider]]\nname = \"plate\"\nfriction = 0.4\nshape = { box = [[0.1, 0.1], [0.9, 0.13]] }\n");
  const Outcome plan = cost("cost plate.toml --dry-run --vary sim.transfer=pic,apic");
  EXPECT_EQ(plan.exit, 0) << plan.err;
  EXPECT_EQ(plan.out.find("cannot run"), std::string::npos) << plan.out;
  EXPECT_NE(plan.out.find("; not in cells of 0.05 m, in which collider plate is too thin"), std::string::npos) << plan.out;
}

TEST_F(CostProgram, MarksWhatCannotRunGoesOnAndSaysNo) {
  const Outcome made = cost(kProblem + "--repeats 1 --vary sim.kernel=linear,quadratic --vary sim.modes=4,9 --out study");
  EXPECT_EQ(made.exit, 6) << made.err;
  const Json json = study();
  ASSERT_EQ(json.at("variants").size(), 4u);
  int failed = 0;
  for (const Json& v : json.at("variants")) {
    if (!v.contains("failure")) {
      EXPECT_EQ(v.at("seconds").size(), 1u);
      continue;
    }
    ++failed;
    EXPECT_NE(v.at("failure").get<std::string>().find("sim.modes"), std::string::npos);
    EXPECT_FALSE(v.contains("seconds_median"));
  }
  EXPECT_EQ(failed, 1);   // nine modes of the linear kernel
}

TEST_F(CostProgram, RefusesMistakesInOneLine) {
  for (const auto& [words, line] :
       {std::pair{"--vary sim.transfr=pic,apic", "polypic: --vary sim.transfr=pic: sim.transfr: unknown key (did you mean sim.transfer?)\n"},
        {"--vary sim.cell=0.0625,-1", "polypic: --vary sim.cell=-1: sim.cell = -1 m: must be above 0\n"},
        {"--vary sim.cell", "polypic: --vary sim.cell: must be KEY=VALUE,VALUE ... (as in --vary sim.transfer=apic,polypic)\n"},
        {"--repeats 0", "polypic: --repeats 0: must be a whole number from 1 to 1000\n"},
        {"--vary sim.seed=1,2 --vary shot.frames=10,20",
         "polypic: --vary shot.frames: changes nothing that the problem reads: all its values make the same variant\n"},
        {"--quality high", "polypic: --quality high: changes nothing here: every variant sets itself what a quality sets\n"},
        {"--set problem.foo=8", "polypic: --set problem.foo=8: problem.foo: unknown key (there is problem.waves, problem.mean, problem.time)\n"},
        {"--single --set problem.waves=32",
         "polypic: taylor_green_2d: problem.waves = 32: a wavelength has 2 cells of sim.cell = 0.01562 m, and needs 4\n"},
        {"--vary sim.cell=0.0625 --set sim.cell=0.125", "polypic: --vary sim.cell: is also given by --set sim.cell=0.125\n"},
        {"--vary sim.cell=0.0625 --vary sim.cell=0.125", "polypic: --vary sim.cell: is given twice: all values go after one =\n"},
        {"--refine sim.cell", "polypic: --refine sim.cell: must be KEY=VALUE,VALUE ... (as in --refine sim.cell=0.02,0.01)\n"},
        {"--refine sim.cell=0.0625,-1", "polypic: --refine sim.cell=-1: sim.cell = -1 m: must be above 0\n"},
        {"--refine sim.cfl=1,2 --vary sim.cfl=0.5,1", "polypic: --refine sim.cfl: is given twice: all values go after one =\n"},
        {"--refine problem.waves=1,2", "polypic: --refine problem.waves: would ask another question (--vary problem.waves makes a case of each value)\n"},
        {"--refine sim.kernel=linear,quadratic", "polypic: --refine sim.kernel: would make another scheme (--vary sim.kernel tries several)\n"},
        {"--error speed", "polypic: --error speed: must be one of energy, position, vorticity, volume, surface, image, velocity\n"},
        {"--error position", "polypic: --error position: the problem has no such error (taylor_green_2d has energy, vorticity, velocity)\n"},
        {"--single --error energy", "polypic: --error: has no effect with --single: the problem runs once, as --set makes it\n"},
        {"--frames 1-3", "polypic: --frames: is for shots: a problem ends at problem.time\n"}}) {
    const Outcome made = cost("cost taylor_green_2d " + std::string(words));
    EXPECT_EQ(made.exit, 2) << words;
    EXPECT_EQ(made.err, line);
  }
  for (const auto& [words, line] :
       {std::pair{"cost taylor_gren_2d",
                  "polypic: taylor_gren_2d: no such file, and no shipped shot or problem of that name (did you mean taylor_green_2d?)\n"},
        {"cost whirl", "polypic: whirl: no such file, and no shipped shot or problem of that name (polypic list names them)\n"},
        {"params taylor_gren_2d", "polypic: taylor_gren_2d: no such key, table or problem (did you mean taylor_green_2d?)\n"},
        {"cost dam_break --refine sim.cell=0.04,0.05",
         "polypic: --refine sim.cell: is for problems: a shot is tried on two sizes of cells as it is (--vary sim.cell=V1,V2 asks for others)\n"},
        {"cost dam_break_2d --error surface", "polypic: --error surface: the shot has no such error\n"},
        {"cost", "polypic: cost: needs a shot or a problem (see polypic cost --help)\n"}}) {
    const Outcome made = cost(words);
    EXPECT_EQ(made.exit, 2) << words;
    EXPECT_EQ(made.err, line);
  }
}

// Before anything runs: a study takes minutes.
TEST_F(CostProgram, RefusesAtOnceToWriteWhereAFileIs) {
  write("taken", "a file\n");
  const Outcome made = cost(kQuick + "--vary sim.transfer=apic,polypic --out taken");
  EXPECT_EQ(made.exit, 5);
  EXPECT_EQ(made.err, "polypic: taken: Not a directory\n");
  EXPECT_EQ(made.out, "");
}

TEST_F(CostProgram, LeavesTheReportOfARunAlone) {
  fs::create_directories(folder / "film/ledger");   // as a run leaves it that was killed; one that has ended has run.json
  write("film/report.html", "the run's");
  const auto before = files();
  const Outcome made = cost(kQuick + "--vary sim.transfer=apic,polypic --out film/");
  EXPECT_EQ(made.exit, 2);
  EXPECT_EQ(made.err, "polypic: --out film/: is the directory of a run, whose report.html would be written over\n");
  EXPECT_EQ(made.out, "");
  EXPECT_EQ(files(), before);
  EXPECT_EQ(text_of(folder / "film/report.html"), "the run's");
}

TEST_F(CostProgram, SaysBeforehandWhatItWouldRun) {
  const Outcome made = cost(kQuick + "--vary sim.transfer=apic,polypic --dry-run --out study");
  ASSERT_EQ(made.exit, 0) << made.err;
  EXPECT_NE(made.out.find("study  2 variants of taylor_green_2d, 2 times each and once more for the audit: 6 runs\n"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("taylor_green_2d: polypic full linear\n"), std::string::npos) << made.out;
  EXPECT_TRUE(std::regex_search(made.out, std::regex("runs   6 to make, in about .* s, and up to 4 again where they disagree, .* s\n"))) << made.out;
  EXPECT_FALSE(fs::exists(folder / "study"));
  EXPECT_NE(cost(kQuick + "--vary sim.transfer=apic --dry-run").out.find("study  1 variant of taylor_green_2d, 2 times each"), std::string::npos);
  for (const char* words : {"params problem", "params taylor_green_2d"})
    EXPECT_NE(cost(words).out.find("taylor_green_2d: vortex pairs along an edge of the domain"), std::string::npos) << words;
  EXPECT_NE(cost("list").out.find("problems   taylor_green_2d, "), std::string::npos);
}

TEST_F(CostProgram, ComparesAShotWithItselfOnCoarserCells) {
  write("drop.toml",
        "[shot]\nframes = 4\n[sim]\ndimension = 2\ndomain = [[0, 0], [0.8, 0.4]]\ncell = 0.0125\n[[body]]\nname = \"column\"\n"
        "shape = { box = [[0, 0], [0.3, 0.3]] }\n[[effect]]\nkind = \"gravity\"\nacceleration = [0, -9.81]\n[render]\nwidth = 64\nheight = 32\n");
  const Outcome pictured = cost("cost drop.toml --frames 1-4 --vary render.width=64,96 --out study");
  EXPECT_EQ(pictured.exit, 2);
  EXPECT_EQ(pictured.err, "polypic: --vary render.width: changes nothing that a simulation reads: all its values make the same variant\n");
  const std::string words = "cost drop.toml --frames 1-4 --repeats 1 --vary sim.transfer=pic,polypic --out study";
  // Beforehand: all that it takes, and what the wait is for; the second time nothing is measured.
  const std::regex foretold("runs   8 to make, in about .*; the shot as it is, .*; 24 pictures, .*; comparing, .*: .* in all\n");
  for (const bool first : {true, false}) {
    const Outcome dry = cost(words + " --dry-run");
    EXPECT_TRUE(std::regex_search(dry.out, foretold)) << dry.out << dry.err;
    EXPECT_EQ(dry.out.find("measuring small runs of the shot on this machine, a minute at most; they are kept ...\n") != std::string::npos, first);
  }
  const Outcome made = cost(words);
  ASSERT_EQ(made.exit, 0) << made.err;
  EXPECT_TRUE(std::regex_search(made.out, std::regex("runs   8 to make, in about .*; 16 pictures, .*; comparing, .*: .* in all\n"))) << made.out;
  const Json json = study();
  ASSERT_EQ(json.at("variants").size(), 4u);   // two schemes on two cells
  EXPECT_EQ(json.at("variants")[0].at("cell"), 0.05);
  EXPECT_EQ(json.at("variants")[3].at("cell"), 0.025);
  EXPECT_EQ(json.at("reference").at("cell"), 0.0125);
  EXPECT_GT(json.at("cases")[0].at("noise").at("position"), 0);
  for (const Json& v : json.at("variants")) {
    EXPECT_GT(v.at("error_position"), json.at("cases")[0].at("noise").at("position"));
    EXPECT_GT(v.at("disk_bytes"), 0);
    EXPECT_EQ(v.at("pictures").size(), 4u);
    for (const Json& picture : v.at("pictures")) EXPECT_TRUE(fs::exists(folder / picture.at("file").get<std::string>()));
  }
  EXPECT_GT(json.at("variants")[1].at("error_position"), json.at("variants")[3].at("error_position"));   // the same scheme, twice as fine
  const Outcome again = cost(words);
  EXPECT_NE(again.out.find("kept   4 of 4 variants"), std::string::npos) << again.out;
  const std::string page = text_of(folder / "study/report.html");
  EXPECT_NE(page.find(">reference: polypic full linear, cell 0.0125 m<"), std::string::npos);
  EXPECT_EQ(page.find(" ± 0<"), std::string::npos) << "one run has no spread";
  EXPECT_FALSE(fs::exists(folder / "study/runs" / "report.html"));
  for (const auto& entry : fs::recursive_directory_iterator(folder / "study/runs")) EXPECT_NE(entry.path().filename(), "report.html");
  // Drawn otherwise: all pictures anew, and compared with the new ones.
  const std::string image = made.out.empty() ? "" : json.at("variants")[0].at("pictures")[0].at("file").get<std::string>(), before = text_of(folder / image);
  const Outcome small = cost(words + " --set preview.color=velocity_x");
  ASSERT_EQ(small.exit, 0) << small.err;
  EXPECT_NE(small.out.find("kept   4 of 4 variants"), std::string::npos) << small.out;
  EXPECT_NE(text_of(folder / image), before);
  const Outcome timed = cost("cost drop.toml --frames 1-4 --vary shot.fps=12,24 --out study");
  EXPECT_EQ(timed.exit, 2);
  EXPECT_EQ(timed.err, "polypic: --vary shot.fps: frames of one number would be of different times\n");
  // The shot itself among the variants has no error, and takes none from the others.
  const Outcome with_itself = cost("cost drop.toml --frames 1-4 --repeats 1 --vary sim.cell=0.0125,0.025 --out study");
  ASSERT_EQ(with_itself.exit, 0) << with_itself.err;
  const Json both = study();
  EXPECT_FALSE(both.at("variants")[0].contains("error_position"));
  EXPECT_GT(both.at("variants")[1].at("error_position"), both.at("cases")[0].at("noise").at("position"));
  EXPECT_NE(both.at("notes").dump().find("cell 0.0125 is the shot as it is, and so without error"), std::string::npos) << both.at("notes");
}

}  // namespace
