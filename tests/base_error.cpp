// One error, one line: what scripts and people read.
#include "base/error.h"

#include <gtest/gtest.h>

using base::Complaint;
using base::to_line;

TEST(Error, NamesPlaceKeyValueAndWhatIsAllowed) {
  const Complaint c{.file = "shots/x.toml", .line = 12, .column = 8, .key = "sim.cell", .value = "-1 m", .allowed = "must be above 0"};
  EXPECT_EQ(to_line(c), "shots/x.toml:12:8: sim.cell = -1 m: must be above 0");
}

TEST(Error, PutsTheHintInBrackets) {
  const Complaint c{.file = "shots/x.toml", .line = 12, .column = 8, .key = "sim.cel", .hint = "did you mean sim.cell?", .message = "unknown key"};
  EXPECT_EQ(to_line(c), "shots/x.toml:12:8: sim.cel: unknown key (did you mean sim.cell?)");
}

TEST(Error, LeavesOutTheLineOfWhatHasNone) {
  const Complaint c{.file = "--set sim.cell=-1", .key = "sim.cell", .value = "-1 m", .allowed = "must be above 0"};
  EXPECT_EQ(to_line(c), "--set sim.cell=-1: sim.cell = -1 m: must be above 0");
}

TEST(Error, StaysOneLineWhateverAValueHolds) {
  EXPECT_EQ(to_line({.file = "a\nb", .message = "c\td\x1b[0m"}), "a b: c d [0m");
}

TEST(Error, KeepsItsComplaintForMain) {
  try {
    base::throw_io("out/x", "No space left on device");
    FAIL() << "nothing was thrown";
  } catch (const base::Error& e) {
    EXPECT_STREQ(e.what(), "out/x: No space left on device");
    EXPECT_EQ(e.complaint().code, base::Exit::io);
  }
  try {
    base::throw_input("x.vdb", "no grid in it");
    FAIL() << "nothing was thrown";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user);
  }
}
