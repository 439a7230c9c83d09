#pragma once
// A shot in a folder of its own, for tests of the reader.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "app/shot/shot.h"
#include "base/error.h"
#include "base/scratch_folder.h"

/// Writes shots to a temporary folder and reads them back.
class ShotFile : public testing::Test {
 protected:
  app::Shot read(const std::string& text, const std::vector<std::string>& sets = {}, std::optional<std::string> quality = {}) const {
    std::ofstream(folder / "x.toml") << text;
    std::ofstream(folder / "piece.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";   // that a shot may name
    using namespace std::string_literals;
    if (!std::filesystem::exists(folder / "sky.png"))   // a grey pixel
      std::ofstream(folder / "sky.png", std::ios::binary)
          << "\211\120\116\107\015\012\032\012\000\000\000\015\111\110\104\122\000\000\000\001\000\000\000\001\010\002\000\000\000\220\167\123\336\000"
             "\000\000\014\111\104\101\124\170\234\143\150\150\150\000\000\003\004\001\201\113\323\322\020\000\000\000\000\111\105\116\104\256\102\140\202"s;
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
  const base::ScratchFolder own_folder;
  const std::filesystem::path& folder = own_folder.path();
};

/// The least that is a shot: a column of water in a box of 1 m.
inline const std::string kLeast = R"([[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.5, 1, 1]] }
)";
