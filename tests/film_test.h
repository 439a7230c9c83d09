#pragma once
// A small shot, run from end to end by the built program, and what its directory holds then.
#include <map>
#include <nlohmann/json.hpp>

#include "run_program.h"

class FilmTest : public ProgramTest {
 protected:
  using Json = nlohmann::json;

  void SetUp() override {
    ProgramTest::SetUp();
    write("x.toml", kSmallShot);
  }
  Outcome run_well(const std::vector<std::string>& words) const {
    Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return outcome;
  }
  Json run_json(const std::string& out = "out/x") const { return Json::parse(text_of(folder / out / "run.json")); }
  std::vector<std::string> state_hashes(const std::string& out) const {
    std::vector<std::string> hashes;
    const Json run = run_json(out);
    for (const Json& frame : run.at("frames")) hashes.push_back(frame.at("state_hash"));
    return hashes;
  }
  /// Content of every file of a run, by name; what tells of times is left out.
  std::map<std::string, std::string> content(const std::string& out = "out/x") const {
    std::map<std::string, std::string> all;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / out)) {
      const std::string name = std::filesystem::relative(entry.path(), folder / out).string();
      if (entry.is_regular_file() && name != "run.json" && name != "report.html" && !name.starts_with("ledger/")) all[name] = text_of(entry.path());
    }
    return all;
  }
  void expect_no_dot_files() const {
    for (const std::string& name : files()) EXPECT_NE(std::filesystem::path(name).filename().string()[0], '.') << name;
  }
  std::filesystem::file_time_type time_of(const std::string& name) const { return std::filesystem::last_write_time(folder / name); }
};
