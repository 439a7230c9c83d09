// `polypic cost` from outside: files, exit codes, what is not measured again.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/run_program.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class CostProgram : public ProgramTest {
 protected:
  /// Words as a shell takes them, without quotes.
  Outcome cost(const std::string& line) const {
    std::vector<std::string> words;
    std::istringstream in(line);
    for (std::string word; in >> word;) words.push_back(word);
    return run(words);
  }
  Json study() const { return Json::parse(text_of(folder / "study/cost.json")); }
};

const std::string kQuick = "cost taylor_green_2d --repeats 2 --set problem.time=0.2 --set sim.cell=0.0625 ";

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
    EXPECT_LT(passes, 1.05 * v.at("cpu_seconds").get<double>());
    EXPECT_GT(passes, 0.9 * v.at("cpu_seconds").get<double>());   // medians of each, which need not be of one run
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

TEST_F(CostProgram, MarksWhatCannotRunGoesOnAndSaysNo) {
  const Outcome made = cost(kQuick + "--vary sim.kernel=linear,quadratic --vary sim.modes=4,9 --out study");
  EXPECT_EQ(made.exit, 6) << made.err;
  const Json json = study();
  ASSERT_EQ(json.at("variants").size(), 4u);
  int failed = 0;
  for (const Json& v : json.at("variants")) {
    if (!v.contains("failure")) {
      EXPECT_EQ(v.at("seconds").size(), 2u);
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
        {"--frames 1-3", "polypic: --frames: is for shots: a problem ends at problem.time\n"}}) {
    const Outcome made = cost("cost taylor_green_2d " + std::string(words));
    EXPECT_EQ(made.exit, 2) << words;
    EXPECT_EQ(made.err, line);
  }
  const Outcome unknown = cost("cost taylor_gren_2d");
  EXPECT_EQ(unknown.exit, 2);
  EXPECT_EQ(unknown.err, "polypic: taylor_gren_2d: no such file, and no shipped shot of that name (did you mean taylor_green_2d?)\n");
}

TEST_F(CostProgram, ComparesAShotWithItselfOnCoarserCells) {
  write("drop.toml",
        "[shot]\nframes = 4\n[sim]\ndimension = 2\ndomain = [[0, 0], [0.8, 0.4]]\ncell = 0.0125\n[[body]]\nname = \"column\"\n"
        "shape = { box = [[0, 0], [0.3, 0.3]] }\n[[effect]]\nkind = \"gravity\"\nacceleration = [0, -9.81]\n[render]\nwidth = 64\nheight = 32\n");
  const std::string words = "cost drop.toml --frames 1-4 --repeats 1 --vary sim.transfer=pic,polypic --out study";
  const Outcome made = cost(words);
  ASSERT_EQ(made.exit, 0) << made.err;
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
}

}  // namespace
