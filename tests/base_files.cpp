// Files are whole or not there.
#include "base/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/checksum.h"
#include "base/error.h"
#include "base/scratch_folder.h"

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& entry : fs::directory_iterator(folder)) out.push_back(entry.path().filename());
    return out;
  }
  const base::ScratchFolder own_folder;
  const fs::path& folder = own_folder.path();
};

TEST_F(Files, AreReadAsTheyWereWritten) {
  const std::string text("a\0b\nc", 5);
  base::write_text_atomically(folder / "x.json", text);
  EXPECT_EQ(base::read_file(folder / "x.json"), text);
  EXPECT_EQ(names(), std::vector<std::string>{"x.json"});
}

TEST(ScratchFolder, ThatCannotBeMadeIsADiskErrorThatNamesThePlaceAndTheVariable) {
  const base::ScratchFolder outer;
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before ? before : "";
  const std::string missing = (outer.path() / "missing").string();
  ::setenv("TMPDIR", missing.c_str(), 1);
  try {
    const base::ScratchFolder folder;
    ADD_FAILURE() << folder.path();
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::io);
    EXPECT_EQ(e.what(), missing + ": no temporary folder can be made here: No such file or directory (TMPDIR names another place)");
  }
  if (before) ::setenv("TMPDIR", kept.c_str(), 1);
  else ::unsetenv("TMPDIR");
  EXPECT_TRUE(fs::is_directory(base::ScratchFolder().path()));
}

TEST_F(Files, AreReplacedAsAWhole) {
  base::write_text_atomically(folder / "x", "a longer text");
  base::write_text_atomically(folder / "x", "short");
  EXPECT_EQ(base::read_file(folder / "x"), "short");
}

TEST_F(Files, HaveAHiddenTemporaryNameWithTheSameExtensionInTheSameFolder) {
  fs::path seen;
  base::write_atomically(folder / "image.0001.exr", [&](const fs::path& temporary) {
    seen = temporary;
    EXPECT_FALSE(fs::exists(folder / "image.0001.exr"));
    std::ofstream(temporary) << "x";
  });
  EXPECT_EQ(seen.parent_path(), folder);
  EXPECT_EQ(seen.filename().string().front(), '.');
  EXPECT_EQ(seen.extension(), ".exr");
}

TEST_F(Files, StayAsTheyWereWhenTheWriterFails) {
  base::write_text_atomically(folder / "x", "before");
  const auto fail = [](const fs::path& temporary) {
    std::ofstream(temporary) << "half of";
    throw std::runtime_error("the disk is full");
  };
  try {
    base::write_atomically(folder / "x", fail);
    FAIL() << "nothing was thrown";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::io);
    EXPECT_EQ(std::string(e.what()), (folder / "x").string() + ": the disk is full");
  }
  EXPECT_EQ(base::read_file(folder / "x"), "before");
  EXPECT_EQ(names(), std::vector<std::string>{"x"});
}

TEST_F(Files, LeaveNothingBehindWhenTheyCannotBeRenamed) {
  fs::create_directories(folder / "x" / "inside");
  EXPECT_THROW(base::write_text_atomically(folder / "x", "text"), base::Error);
  EXPECT_EQ(names(), std::vector<std::string>{"x"});
}

TEST_F(Files, ThatTheWriterTookAwayAreAnError) {
  EXPECT_THROW(base::write_atomically(folder / "x", [](const fs::path& temporary) { fs::remove(temporary); }), base::Error);
  EXPECT_TRUE(names().empty());
}

TEST_F(Files, InAFolderThatIsNotThereAreAnIoError) {
  try {
    base::write_text_atomically(folder / "none" / "x", "text");
    FAIL() << "nothing was thrown";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::io);
    EXPECT_EQ(e.complaint().file, (folder / "none" / "x").string());
  }
}

TEST_F(Files, SurviveWritersAtTheSameTime) {
  const std::string a(100000, 'a'), b(100000, 'b');
  std::vector<std::thread> writers;
  for (int i = 0; i < 8; ++i) writers.emplace_back([&, i] { base::write_text_atomically(folder / "x", i % 2 ? a : b); });
  for (auto& writer : writers) writer.join();
  const std::string read = base::read_file(folder / "x");
  EXPECT_TRUE(read == a || read == b);
  EXPECT_EQ(names(), std::vector<std::string>{"x"});
}

TEST_F(Files, ThatAreMissingFoldersOrTooLargeAreTheUsersMistake) {
  base::write_text_atomically(folder / "x", "12345");
  EXPECT_EQ(base::read_file(folder / "x", 5), "12345");
  const auto message = [&](const fs::path& path, std::uintmax_t limit) {
    try {
      base::read_file(path, limit);
    } catch (const base::Error& e) {
      EXPECT_EQ(e.complaint().code, base::Exit::user);
      return e.complaint().message;
    }
    return std::string("nothing was thrown");
  };
  EXPECT_EQ(message(folder / "x", 4), "larger than 4 bytes");
  EXPECT_EQ(message(folder / "y", 4), "No such file or directory");
  EXPECT_EQ(message(folder, 4), "Is a directory");
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);   // nobody writes into it: to wait for that would be for ever
  EXPECT_EQ(message(folder / "pipe", 4), "is a pipe or a device, not a file");
  EXPECT_EQ(message("/dev/zero", 4), "is a pipe or a device, not a file");
  EXPECT_FALSE(base::sum_of(folder / "pipe"));
  EXPECT_FALSE(base::sum_of("/dev/zero"));
}
