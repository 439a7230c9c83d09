// The suite of hard cases as the program runs it: names, tables, exit codes; and every quick case.
#include <nlohmann/json.hpp>

#include <set>

#include "run_program.h"

namespace {

using Json = nlohmann::json;

class Verify : public ProgramTest {};

}  // namespace

TEST_F(Verify, EveryQuickCasePasses) {
  const Outcome outcome = run({"verify", "--quick", "--json"});
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  const Json found = Json::parse(outcome.out);
  const Json& cases = found.at("cases");
  EXPECT_GE(cases.size(), 60u);
  EXPECT_EQ(found.at("passed"), cases.size());
  EXPECT_EQ(found.at("failed"), 0);
  std::set<std::string> names;
  for (const Json& c : cases) {
    EXPECT_TRUE(c.at("passed").get<bool>()) << c.dump(2);
    EXPECT_TRUE(names.insert(c.at("name")).second) << c.at("name");
    for (const char* key : {"transfer", "kernel", "integrator", "expect", "outcome", "source"})
      EXPECT_FALSE(c.at(key).get<std::string>().empty()) << c.at("name") << " " << key;
    EXPECT_LE(c.at("value").get<double>(), c.at("tolerance").get<double>()) << c.at("name");
  }
  const std::string page = text_of(folder / "out/verify/report.html");
  for (const char* part : {"At a glance", "The slowest", "polypic 0.", "threads", "energy curves and"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("data:image"), std::string::npos);
  EXPECT_EQ(page.find("http://") == std::string::npos || page.find("src=\"http") == std::string::npos, true);
  EXPECT_EQ(Json::parse(text_of(folder / "out/verify/verify.json")).at("passed"), cases.size());
  std::printf("%zu cases, and %zu that are not built\n", cases.size(), found.at("not_built").size());
}

TEST_F(Verify, RunsTheCasesThatItsArgumentsName) {
  const auto count = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all = {"verify", "--json", "--quiet"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = run(all);
    EXPECT_EQ(outcome.exit, 0) << outcome.err;
    return Json::parse(outcome.out).at("cases").size();
  };
  EXPECT_EQ(count({"return_mapping/snow/3d"}), 1u);
  EXPECT_EQ(count({"return_mapping"}), 5u);
  EXPECT_EQ(count({"return_mapping", "sand_at_the_tip/2d"}), 6u);
  EXPECT_EQ(count({"round_trip/?d/*/single"}), 4u);
}

TEST_F(Verify, SuggestsTheNearestNameForOneThatIsNotThere) {
  const Outcome outcome = run({"verify", "spining_disk"});
  EXPECT_EQ(outcome.exit, 2);
  EXPECT_EQ(outcome.err, "polypic: spining_disk: no such case (did you mean spinning_disk?)\n");
  EXPECT_EQ(run({"verify", "*/nothing/*"}).exit, 2);
}

TEST_F(Verify, NeedsNoProgramThatPlots) {
  const std::string path = ::getenv("PATH");
  ::setenv("PATH", folder.c_str(), 1);
  const Outcome outcome = run({"verify", "spinning_disk/2d/apic/single", "--quick"});
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_NE(text_of(folder / "out/verify/report.html").find("No plots: "), std::string::npos);
}

TEST_F(Verify, RefusesACaseThatQuickLeavesOut) {
  const Outcome outcome = run({"verify", "swelling_by_spin/3d/apic/double", "--quick"});
  EXPECT_EQ(outcome.exit, 2);
  EXPECT_EQ(outcome.err, "polypic: swelling_by_spin/3d/apic/double: --quick leaves out every case of this name (without --quick they run)\n");
}

// Every shipped shot is a case; a program that lies alone has none, and says so.
TEST_F(Verify, SaysThatCasesOfShotsNeedTheShots) {
  std::filesystem::copy_file(POLYPIC_PROGRAM, log / "polypic");
  const auto alone = [&](const std::string& words) {
    const int status = std::system(("cd '" + folder.string() + "' && ../polypic verify " + words + " >../out 2>../err").c_str());
    return Outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 255, text_of(log / "out"), text_of(log / "err")};
  };
  const std::string needs = "threads_and_restarts needs the shipped shots, and none lie beside the program\n";
  const Outcome some = alone("return_mapping/snow/3d");
  EXPECT_EQ(some.exit, 0) << some.err;
  EXPECT_NE(some.out.find("1 case: 1 passed, 0 failed; not built, and counted apart: "), std::string::npos) << some.out;
  EXPECT_NE(some.out.find("left out: " + needs), std::string::npos) << some.out;
  EXPECT_EQ(run({"verify", "return_mapping/snow/3d"}).out.find("left out"), std::string::npos);
  const Outcome refused = alone("threads_and_restarts/sand");
  EXPECT_EQ(refused.exit, 2);
  EXPECT_EQ(refused.err, "polypic: threads_and_restarts/sand: needs the shipped shots, and none lie beside the program\n");
}

TEST_F(Verify, ListsItsCases) {
  const Outcome outcome = run({"verify", "--list"});
  EXPECT_EQ(outcome.exit, 0);
  EXPECT_NE(outcome.out.find("spinning_disk/2d/polypic9/hybrid/double"), std::string::npos);
  EXPECT_TRUE(files().empty());
}

TEST_F(Verify, ListsItsCasesAsJson) {
  const Outcome outcome = run({"verify", "--list", "--json", "lone_particle"});
  EXPECT_EQ(outcome.exit, 0);
  const Json found = Json::parse(outcome.out);
  ASSERT_EQ(found.at("cases").size(), 4u);
  EXPECT_EQ(found["cases"][0].at("name"), "lone_particle/pressed/2d/apic/double");
  EXPECT_EQ(found["cases"][0].at("dimension"), 2);
  EXPECT_TRUE(found["cases"][0].at("quick").get<bool>());
  EXPECT_FALSE(found["cases"][0].contains("passed"));
  EXPECT_GT(found.at("not_built").size(), 0u);
}

// Before anything runs: cases take minutes.
TEST_F(Verify, RefusesAtOnceToWriteWhereAFileIs) {
  write("taken", "a file\n");
  const Outcome outcome = run({"verify", "return_mapping", "--out", "taken"});
  EXPECT_EQ(outcome.exit, 5);
  EXPECT_EQ(outcome.err, "polypic: taken: Not a directory\n");
  EXPECT_EQ(outcome.out, "");
}

TEST_F(Verify, LeavesTheReportOfARunAlone) {
  std::filesystem::create_directory(folder / "film");
  for (const std::string name : {"shot.toml", "run.json", "report.html"}) write("film/" + name, "the run's");
  const auto before = files();
  const Outcome outcome = run({"verify", "return_mapping", "--out", "film"});
  EXPECT_EQ(outcome.exit, 2);
  EXPECT_EQ(outcome.err, "polypic: --out film: is the directory of a run, whose report.html would be written over\n");
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(files(), before);
  EXPECT_EQ(text_of(folder / "film/report.html"), "the run's");
}
