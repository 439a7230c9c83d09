#pragma once
// A small shot, run from end to end by the built program, and what its directory holds then.
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
  std::filesystem::file_time_type time_of(const std::string& name) const { return std::filesystem::last_write_time(folder / name); }
};
