#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>

#include <cstring>
#include <fstream>

#include "base/atomic_file.h"
#include "base/error.h"
#include "tests/surface_bodies.h"

using namespace surface_test;

namespace {

sim::Frame scattered(int n) {
  sim::Frame frame;
  frame.number = 12;
  frame.time = 11.0 / 24;
  frame.pscale = 0.00620350491;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> place(-3, 3), tiny(-1e-6f, 1e-6f);
  for (int i = 0; i < n; ++i) {
    auto& number = i % 7 == 0 ? tiny : place;
    frame.position.emplace_back(number(random), number(random), number(random));
    frame.velocity.emplace_back(100 * place(random), place(random), tiny(random));
    frame.id.push_back(3 * i + 1);
  }
  return frame;
}

sim::Frame written_and_read(const std::filesystem::path& path, const sim::Frame& frame) {
  surface::initialize();
  base::Ledger ledger;
  surface::write_points(path, frame, ledger);
  EXPECT_EQ(ledger.passes().count("write_points"), 1u);
  return surface::read_points(path);
}

std::string complaint_of(const std::filesystem::path& path) {
  try {
    surface::read_points(path);
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user);
    return e.what();
  }
  return "nothing was thrown";
}

void expect_one_line(const std::string& line, const std::filesystem::path& path) {
  EXPECT_EQ(line.find(path.string() + ": "), 0u) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
}

}  // namespace

TEST(Points, ComeBackWithTheSameBits) {
  const TemporaryFile file;
  const sim::Frame frame = scattered(20000), back = written_and_read(file.path(), frame);
  ASSERT_EQ(back.position.size(), frame.position.size());
  for (std::size_t i = 0; i < frame.position.size(); ++i) {
    ASSERT_EQ(back.position[i], frame.position[i]) << i;
    ASSERT_EQ(back.velocity[i], frame.velocity[i]) << i;
  }
}

TEST(Points, ComeBackInTheOrderOfTheirIds) {
  const TemporaryFile file;
  const sim::Frame frame = scattered(5000);
  EXPECT_EQ(written_and_read(file.path(), frame).id, frame.id);
}

TEST(Points, KeepWhatElseTheyCarry) {
  const TemporaryFile file;
  sim::Frame frame = scattered(3000);
  for (std::size_t i = 0; i < frame.id.size(); ++i)
    frame.pressure.push_back(float(i) - 7.25f), frame.strain.push_back(1e-3f * float(i)), frame.body.push_back(i % 3);
  const sim::Frame back = written_and_read(file.path(), frame);
  EXPECT_EQ(back.pressure, frame.pressure);
  EXPECT_EQ(back.strain, frame.strain);
  EXPECT_EQ(back.body, frame.body);
  EXPECT_TRUE(back.mode_energy.empty());
  EXPECT_EQ(surface::info(file.path())[0].attributes,
            (std::vector<std::string>{"P vec3s", "v vec3s", "id int64", "pscale float", "body int32", "pressure float", "strain float"}));
}

TEST(Points, FileKeepsNumberTimeAndScale) {
  const TemporaryFile file;
  const sim::Frame frame = scattered(10), back = written_and_read(file.path(), frame);
  EXPECT_EQ(back.number, 12);
  EXPECT_EQ(back.time, frame.time);
  EXPECT_EQ(back.pscale, frame.pscale);
}

TEST(Points, FrameWithoutParticlesIsAFileToo) {
  const TemporaryFile file;
  const sim::Frame back = written_and_read(file.path(), scattered(0));
  EXPECT_TRUE(back.position.empty());
  EXPECT_EQ(back.number, 12);
}

TEST(Points, FileHasTheSameBytesEveryTime) {
  const TemporaryFile first(".1.vdb"), second(".2.vdb");
  written_and_read(first.path(), scattered(5000));
  written_and_read(second.path(), scattered(5000));
  EXPECT_EQ(base::read_file(first.path()), base::read_file(second.path()));
}

TEST(Points, InfoNamesWhatIsInTheFile) {
  const TemporaryFile file;
  written_and_read(file.path(), scattered(5000));
  const auto grids = surface::info(file.path());
  ASSERT_EQ(grids.size(), 1u);
  EXPECT_EQ(grids[0].name, "points");
  EXPECT_EQ(grids[0].points, 5000u);
  EXPECT_EQ(grids[0].attributes, (std::vector<std::string>{"P vec3s", "v vec3s", "id int64", "pscale float"}));
  EXPECT_NE(grids[0].compression.find("blosc"), std::string::npos) << grids[0].compression;
}

TEST(Points, FrameThatIsNotFiniteIsNeverWritten) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  sim::Frame frame = scattered(10);
  frame.position[4][1] = std::nanf("");
  EXPECT_THROW(surface::write_points(file.path(), frame, ledger), std::logic_error);
  EXPECT_FALSE(std::filesystem::exists(file.path()));
  frame = scattered(10);
  frame.strain.assign(10, 0);
  frame.strain[3] = std::nanf("");
  EXPECT_THROW(surface::write_points(file.path(), frame, ledger), std::logic_error);
  EXPECT_FALSE(std::filesystem::exists(file.path()));
}

TEST(Points, MissingFileIsOneLine) {
  surface::initialize();
  const TemporaryFile file;
  expect_one_line(complaint_of(file.path()), file.path());
}

TEST(Points, FileOfAnotherKindIsOneLine) {
  surface::initialize();
  for (const std::string text : {"", "x", "[shot]\nframes = 96\n"}) {
    const TemporaryFile file;
    base::write_text_atomically(file.path(), text);
    expect_one_line(complaint_of(file.path()), file.path());
  }
}

TEST(Points, LevelSetIsNotTakenForPoints) {
  surface::initialize();
  const TemporaryFile file;
  base::Ledger ledger;
  surface::write_surface(file.path(), ball(0.05), {}, room(), ledger);
  const std::string line = complaint_of(file.path());
  expect_one_line(line, file.path());
  EXPECT_NE(line.find("no point grid"), std::string::npos) << line;
}

// Another program may write such a file; whoever compares two frames particle by particle must know which is which.
TEST(Points, OfWhichTwoHaveOneIdAreOneLine) {
  const TemporaryFile file;
  sim::Frame frame = scattered(100);
  std::swap(frame.id[3], frame.id[90]);
  surface::initialize();
  base::Ledger ledger;
  surface::write_points(file.path(), frame, ledger);
  EXPECT_EQ(complaint_of(file.path()), "nothing was thrown");
  frame.id[70] = frame.id[20];
  surface::write_points(file.path(), frame, ledger);
  EXPECT_EQ(complaint_of(file.path()), file.path().string() + ": two particles have id 61");
}

// As a program may write them that joins the points of two.
TEST(Points, OfWhichSomeLackAnAttributeAreOneLine) {
  for (const std::string name : {"body", "pressure"}) {
    const TemporaryFile whole, part(".part.vdb");
    sim::Frame frame = scattered(3000);
    frame.body.assign(frame.id.size(), 1);
    frame.pressure.assign(frame.id.size(), 2);
    written_and_read(whole.path(), frame);
    openvdb::io::File in(whole.path().string());
    in.open(/*delayLoad=*/false);
    const auto grid = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(in.readGrid("points"));
    auto leaf = grid->tree().beginLeaf();
    const std::vector<std::size_t> at = {leaf->attributeSet().find(name)};
    auto fewer = leaf->attributeSet().descriptor().duplicateDrop(at);
    leaf->dropAttributes(at, leaf->attributeSet().descriptor(), fewer);
    openvdb::io::File(part.path().string()).write({grid});
    EXPECT_EQ(complaint_of(part.path()), part.path().string() + ": some particles have no " + name);
  }
}

TEST(Points, FileCutShortAnywhereIsOneLine) {
  const TemporaryFile file;
  written_and_read(file.path(), scattered(500));
  const std::string whole = base::read_file(file.path());
  for (std::size_t i = 1; i <= 40; ++i) {
    base::write_text_atomically(file.path(), whole.substr(0, whole.size() * i / 41));
    expect_one_line(complaint_of(file.path()), file.path());
  }
}

TEST(Points, FileWithAFlippedBitIsOneLine) {
  const TemporaryFile file;
  written_and_read(file.path(), scattered(500));
  const std::string whole = base::read_file(file.path());
  for (std::size_t i = 0; i < 100; ++i) {
    std::string damaged = whole;
    const std::size_t at = 64 + (whole.size() - 65) * i / 100;   // past magic number, version and tag
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << (i % 8)));
    base::write_text_atomically(file.path(), damaged);
    expect_one_line(complaint_of(file.path()), file.path());
  }
}

TEST(Points, ForeignFileCutShortIsOneLine) {
  const TemporaryFile file;
  written_and_read(file.path(), scattered(500));
  std::string whole = base::read_file(file.path());
  whole[22] = whole[22] == 'a' ? 'b' : 'a';   // the tag is no longer ours, so the checksum is not looked at
  for (std::size_t i = 1; i <= 40; ++i) {
    base::write_text_atomically(file.path(), whole.substr(0, whole.size() * i / 41));
    expect_one_line(complaint_of(file.path()), file.path());
  }
}
