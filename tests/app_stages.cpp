// A run's directory: which frames count as finished, and which files are the program's own.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "app/stages/checkpoints.h"
#include "app/stages/finished.h"
#include "app/stages/folder.h"
#include "app/stages/hash.h"
#include "app/stages/lock.h"
#include "app/stages/record.h"
#include "base/error.h"
#include "base/progress.h"
#include "base/scratch_folder.h"

namespace {

namespace fs = std::filesystem;
using app::Stage;

class RunFolder : public testing::Test {
 protected:
  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  app::Record record(Stage stage, const std::string& hash) const {
    app::Record r;
    r.stage = stage;
    r.frame = 3;
    r.hash = hash;
    r.seconds = 1.5;
    r.passes["smooth"] = {2, 0.25, 100};
    return r;
  }
  const base::ScratchFolder own_folder;
  const fs::path& root = own_folder.path();
};

}  // namespace

// Frames in the middle are made again: their checkpoints are not older than those of frames that come after them.
TEST_F(RunFolder, KeepsTheLatestCheckpointsUpToTheFrameReachedAndThoseBehindIt) {
  const app::Folder folder(root);
  for (const std::int64_t frame : {4, 6, 8, 18, 24}) write(folder.checkpoint(frame), "state");
  base::Progress progress(stderr, /*quiet=*/true);
  const app::Checkpoints checkpoints(folder, "a", /*keep=*/2, progress);
  checkpoints.prune(8);
  EXPECT_EQ(folder.checkpoints(), (std::vector<std::int64_t>{6, 8, 18, 24}));
  checkpoints.prune(24);
  EXPECT_EQ(folder.checkpoints(), (std::vector<std::int64_t>{18, 24}));
}

TEST_F(RunFolder, FrameIsFinishedOnlyWithItsRecordItsKeysAndItsBytes) {
  const app::Folder folder(root);
  fs::create_directory(root);
  write(folder.points(3), "points");
  EXPECT_FALSE(app::finished_record(folder, 3, Stage::surface, 3, "a"));
  write(folder.surface(3), "level set");
  EXPECT_FALSE(app::finished_record(folder, 3, Stage::surface, 3, "a"));   // a file without its record
  app::write_record(folder, 3, record(Stage::surface, "a"));
  const auto finished = app::finished_record(folder, 3, Stage::surface, 3, "a");
  ASSERT_TRUE(finished);
  EXPECT_EQ(finished->passes.at("smooth").calls, 2);
  EXPECT_EQ(finished->passes.at("smooth").seconds, 0.25);
  EXPECT_EQ(finished->seconds, 1.5);
  EXPECT_TRUE(app::damaged_files(folder, *finished).empty());
  EXPECT_FALSE(app::finished_record(folder, 3, Stage::surface, 3, "b"));   // other keys
  write(folder.surface(3), "level");
  EXPECT_FALSE(app::finished_record(folder, 3, Stage::surface, 3, "a"));   // other bytes
  write(folder.surface(3), "level_set");                                     // as many, but others
  EXPECT_EQ(app::damaged_files(folder, *finished), std::vector<std::string>{"surface/surface.0003.vdb"});
  write(folder.surface(3), "level set");
  EXPECT_TRUE(app::finished_record(folder, 3, Stage::surface, 3, "a"));
  write(folder.record(Stage::surface, 3), "{\"schema\": 1, \"stage\"");
  EXPECT_FALSE(app::finished_record(folder, 3, Stage::surface, 3, "a"));   // a damaged record
  fs::remove(folder.record(Stage::surface, 3));
  EXPECT_FALSE(app::finished_record(folder, 3, Stage::surface, 3, "a"));
}

TEST_F(RunFolder, FrameIsNotFinishedWhenItWasMadeFromOtherBytesUpstream) {
  const app::Folder folder(root);
  const auto surface_is_finished = [&] { return app::finished_record(folder, 3, Stage::surface, 3, "a").has_value(); };
  app::Record points = record(Stage::simulate, "p");
  points.totals = sim::Totals{};
  write(folder.points(3), "points");
  app::write_record(folder, 3, points);
  write(folder.surface(3), "level set");
  app::write_record(folder, 3, record(Stage::surface, "a"));
  EXPECT_TRUE(surface_is_finished());
  write(folder.points(3), "others");
  app::write_record(folder, 3, points);
  EXPECT_FALSE(surface_is_finished());
  fs::remove(folder.points(3));   // removed to save room: the surface stands
  fs::remove(folder.record(Stage::simulate, 3));
  EXPECT_TRUE(surface_is_finished());
}

TEST_F(RunFolder, EachFileIsReadOnceAndDamageIsNamed) {
  const app::Folder folder(root);
  app::StageHashes hashes{.simulate = "p", .surface = "a", .render = "r", .preview = "v"};
  for (const Stage stage : {Stage::simulate, Stage::surface}) {
    write(stage == Stage::simulate ? folder.points(3) : folder.surface(3), "bytes");
    app::Record r = record(stage, hashes.of(stage));
    if (stage == Stage::simulate) r.totals = sim::Totals{};
    app::write_record(folder, 3, r);
  }
  app::Finished finished(folder, hashes, 3);
  finished.look(Stage::surface, {1, 2, 3});
  EXPECT_TRUE(finished.has(Stage::surface, 3));
  EXPECT_FALSE(finished.has(Stage::surface, 2));
  EXPECT_TRUE(finished.damaged().empty());
  write(folder.surface(3), "bytez");
  EXPECT_TRUE(finished.has(Stage::surface, 3));
  EXPECT_FALSE(finished.look_again(Stage::surface, 3));
  EXPECT_EQ(finished.damaged(), std::vector<std::string>{"surface/surface.0003.vdb"});
}

TEST_F(RunFolder, RecordKeepsTheTotalsOfASimulation) {
  const app::Folder folder(root);
  write(folder.points(3), "points");
  app::Record r = record(Stage::simulate, "a");
  r.totals = sim::Totals{.time = 0.1, .substeps = 4, .particles = 9, .mass = 1 / 3.0, .elastic_energy = 0.5, .linear_momentum = {1, -2, 1e-300},
                         .state_hash = 0xfedcba9876543210u, .imbalance = 0.125, .volume_drift = -0.25, .retries = 2, .least_volume = 0.5,
                         .most_volume = 1.5};
  app::write_record(folder, 3, r);
  const auto back = app::finished_record(folder, 3, Stage::simulate, 3, "a");
  ASSERT_TRUE(back && back->totals);
  EXPECT_EQ(back->totals->mass, 1 / 3.0);
  EXPECT_EQ(back->totals->linear_momentum, base::Vec3(1, -2, 1e-300));
  EXPECT_EQ(back->totals->state_hash, 0xfedcba9876543210u);
  EXPECT_EQ(back->totals->substeps, 4);
  EXPECT_EQ(back->totals->elastic_energy, 0.5);
  EXPECT_EQ(back->totals->volume_drift, -0.25);
  EXPECT_EQ(back->totals->imbalance, 0.125);
  EXPECT_EQ(back->totals->least_volume, 0.5);
  EXPECT_EQ(back->totals->retries, 2);
}

TEST_F(RunFolder, NumbersThatAreNotFiniteAreNeverWritten) {
  const app::Folder folder(root);
  write(folder.points(3), "points");
  app::Record r = record(Stage::simulate, "a");
  r.totals = sim::Totals{.kinetic_energy = std::numeric_limits<double>::quiet_NaN(), .elastic_energy = {}, .imbalance = {}, .volume_drift = {},
                         .least_volume = {}, .most_volume = {}};
  EXPECT_THROW(app::write_record(folder, 3, r), std::logic_error);
  EXPECT_FALSE(fs::exists(folder.record(Stage::simulate, 3)));
}

TEST_F(RunFolder, RemovesItsOwnFilesAndNoOther) {
  const app::Folder folder(root);
  const std::vector<fs::path> own = {folder.points(1), folder.points(12345), folder.record(Stage::simulate, 1), folder.checkpoint(10)};
  const std::vector<fs::path> others = {root / "points/points.1.vdb", root / "points/points.0001.vdb.bak", root / "points/mypoints.0001.vdb",
                                        root / "points/points.000a.vdb", root / "ledger/simulate.0001.txt", root / "notes.txt",
                                        root / "checkpoint/state.0010.h5.bad", folder.surface(1), folder.record(Stage::surface, 1),
                                        folder.movie(Stage::render)};
  for (const auto& list : {own, others})
    for (const fs::path& file : list) write(file, "x");
  folder.remove_files(Stage::simulate);
  for (const fs::path& file : own) EXPECT_FALSE(fs::exists(file)) << file;
  for (const fs::path& file : others) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST_F(RunFolder, SweepsUpTemporaryFilesOfAKilledRun) {
  const app::Folder folder(root);
  const std::vector<fs::path> own = {root / "points/.points.0003.tmp77-0.vdb", root / ".movie.tmp77-4.mp4", root / "ledger/.render.0003.tmp1-12.json",
                                     root / "images/.beauty.0003.tmp9-1.exr", root / ".simulate.lock",
                                     root / "ledger/.surface.0012.lock", root / "checkpoint/.state.0010.tmp3-0.h5"};
  const std::vector<fs::path> others = {root / ".hidden", root / "points/.points.swp", root / "images/.beauty.0003.exr"};
  for (const auto& list : {own, others})
    for (const fs::path& file : list) write(file, "x");
  folder.remove_leftovers();
  for (const fs::path& file : own) EXPECT_FALSE(fs::exists(file)) << file;
  for (const fs::path& file : others) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST_F(RunFolder, LockHasOneOwnerAndIsTakenOverFromTheDead) {
  const fs::path file = root / ".simulate.lock";
  fs::create_directory(root);
  write(file, "process 1 on nowhere since long ago");   // left by one that was killed: nobody holds it
  {
    const auto lock = app::Lock::try_take(file);
    ASSERT_TRUE(lock);
    EXPECT_TRUE(app::owner_of(file).starts_with("process " + std::to_string(getpid()) + " on ")) << app::owner_of(file);
    EXPECT_FALSE(app::Lock::try_take(file));
    int asked = 0;
    EXPECT_THROW(app::Lock::take(file, [&] { if (++asked == 3) throw std::runtime_error("enough"); }), std::runtime_error);
  }
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(app::owner_of(file), "another process");
}

TEST_F(RunFolder, IsHeldAloneOrTogetherAndTheLastToLeaveTidiesUp) {
  const app::Folder folder(root / "out/x");
  {
    auto first = std::make_unique<app::FolderLock>(folder);
    EXPECT_TRUE(first->alone());
    first->let_others_in();
    auto second = std::make_unique<app::FolderLock>(folder);
    EXPECT_FALSE(first->alone());
    EXPECT_FALSE(second->alone());
    first.reset();
    write(folder.root() / "points/.points.0003.tmp77-0.vdb", "of one that was killed meanwhile");
    EXPECT_TRUE(fs::exists(folder.lock()));
    const auto held = app::Lock::try_take(folder.lock_of_simulation());
    EXPECT_TRUE(held);
  }
  EXPECT_FALSE(fs::exists(folder.root() / "points/.points.0003.tmp77-0.vdb"));
  EXPECT_FALSE(fs::exists(folder.lock()));
}

TEST_F(RunFolder, LockLeavesNoTraceOfAnEmptyRun) {
  const app::Folder folder(root / "out/x");
  { const app::FolderLock lock(folder); }
  EXPECT_TRUE(fs::is_empty(root));
  {
    const app::FolderLock again(folder);
    write(folder.shot(), "x");
  }
  EXPECT_TRUE(fs::exists(folder.shot()));
}

TEST_F(RunFolder, ADirectoryThatWentAwayIsNotMadeAgain) {
  const app::Folder folder(root / "gone");
  EXPECT_THROW(app::Folder::make_room_for(folder.points(1)), base::Error);
  EXPECT_FALSE(fs::exists(root / "gone"));
}

TEST(Hash, IsFnv1aInSixteenDigits) {   // test vectors of the hash's authors
  EXPECT_EQ(app::hex16(app::fnv1a("")), "cbf29ce484222325");
  EXPECT_EQ(app::hex16(app::fnv1a("foobar")), "85944171f73967e8");
  EXPECT_EQ(app::hex16(0x1f), "000000000000001f");
}

TEST(Progress, WritesOneLineAFrameWhereThereIsNoTerminal) {
  std::FILE* file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  {
    base::Progress progress(file, /*quiet=*/false);
    progress.line("shot   x");
    progress.working(1, 12, "sim");
    progress.finished(1, 12, {{"sim", 1.04}, {"surface", 0.4}});
    progress.finished(12, 12, {{"sim", 61}});
    base::Progress(file, /*quiet=*/true).line("nothing");
  }
  std::rewind(file);
  char text[256] = {};
  const std::size_t length = std::fread(text, 1, sizeof text - 1, file);
  std::fclose(file);
  EXPECT_EQ(std::string(text, length), "shot   x\nframe   1/12  sim 1.0 s  surface 0.40 s   16 s left\nframe  12/12  sim 61 s\n");
}

TEST(Progress, DurationsReadAsPeopleSayThem) {
  for (const auto& [seconds, text] :
       {std::pair{0.004, "0.00 s"}, {0.42, "0.42 s"}, {9.94, "9.9 s"}, {12.0, "12 s"}, {246.0, "4.1 min"}, {5760.0, "96.0 min"}, {7200.0, "2.0 h"}})
    EXPECT_EQ(base::duration_text(seconds), text);
}
