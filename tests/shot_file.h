#pragma once
// A shot in a folder of its own, for tests of the reader.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "app/shot/shot.h"

/// Writes shots to a temporary folder and reads them back.
class ShotFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "polypic_shot_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  app::Shot read(const std::string& text, const std::vector<std::string>& sets = {}, std::optional<std::string> quality = {}) const {
    std::ofstream(folder / "x.toml") << text;
    return app::read_shot(folder / "x.toml", {.quality = std::move(quality), .sets = sets});
  }

  /// The one line a bad shot gives, with the file called "x.toml"; "no error" when it is read.
  std::string line(const std::string& text, const std::vector<std::string>& sets = {}, std::optional<std::string> quality = {}) const {
    try {
      read(text, sets, std::move(quality));
      return "no error";
    } catch (const base::Error& e) {
      EXPECT_EQ(e.complaint().code, base::Exit::user);
      std::string what = e.what();
      const std::string path = (folder / "").string();
      if (what.starts_with(path)) what = what.substr(path.size());
      return what;
    }
  }
  std::filesystem::path folder;
};

/// The least that is a shot: a column of water in a box of 1 m.
inline const std::string kLeast = R"([[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.5, 1, 1]] }
)";
