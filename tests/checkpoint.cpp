// A state in a file: what comes back has the same bits, and nothing else is taken for it.
#include "sim/checkpoint.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <numeric>
#include <random>

#include "base/checksum.h"
#include "base/error.h"
#include "base/scratch_folder.h"
#include "sim/simulation.h"
#include "sim/verify/scenes.h"

namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

sim::State some_state() {
  std::vector<std::int32_t> cell(3 * 50);
  std::vector<float> offset(3 * 50);
  std::vector<double> sums = {1 / 3.0, -0.0, 1e-310};
  std::vector<std::int64_t> id(50);
  std::iota(cell.begin(), cell.end(), -7);
  std::iota(offset.begin(), offset.end(), 0.125f);
  std::iota(id.begin(), id.end(), std::int64_t{1} << 40);
  sim::State state{.frame = 12, .columns = {}};   // names in ascending order, as they are read back
  state.columns.push_back(sim::make_column<std::int32_t>("cell", cell, 3));
  state.columns.push_back(sim::make_column<double>("empty", std::vector<double>(), 2));
  state.columns.push_back(sim::make_column<std::int64_t>("id", id, 1));
  state.columns.push_back(sim::make_column<float>("offset", offset, 3));
  state.columns.push_back(sim::make_column<double>("sums", sums, 1));
  return state;
}

class CheckpointFile : public testing::Test {
 protected:
  /// What the file is refused with; "no error" when it is read.
  std::string refusal() const {
    try {
      sim::read_checkpoint(file);
      return "no error";
    } catch (const base::Error& e) {
      EXPECT_EQ(e.complaint().code, base::Exit::user);
      EXPECT_EQ(e.complaint().file, file.string());
      return e.complaint().message;
    }
  }
  const base::ScratchFolder folder;
  const fs::path file = folder.path() / "state.0012.h5";
};

sim::Scene falling_column(sim::Transfer transfer, sim::Kernel kernel) {
  sim::Scene scene;
  scene.options.domain = {base::Vec3(0, 0, 0), base::Vec3(0.5, 0.3, 0.3)};
  scene.options.cell = 0.05;
  scene.options.transfer = transfer;
  scene.options.kernel = kernel;
  sim::Body body;
  body.shape.box = base::Box{base::Vec3(0, 0, 0), base::Vec3(0.2, 0.3, 0.2)};
  scene.bodies.push_back(body);
  scene.effects.emplace_back();
  return scene;
}

void advance(sim::Simulation& simulation, int frames) {
  base::Ledger ledger;
  for (int i = 0; i < frames; ++i) simulation.advance(ledger, {});
}

}  // namespace

TEST_F(CheckpointFile, GivesBackEveryBit) {
  const sim::State state = some_state();
  sim::write_checkpoint(file, "0123456789abcdef", "1.2.3", state);
  const sim::Checkpoint back = sim::read_checkpoint(file);
  EXPECT_EQ(back.hash, "0123456789abcdef");
  EXPECT_EQ(back.version, "1.2.3");
  EXPECT_EQ(back.state.frame, 12);
  ASSERT_EQ(back.state.columns.size(), state.columns.size());
  for (std::size_t i = 0; i < state.columns.size(); ++i) {
    const sim::Column &was = state.columns[i], &is = back.state.columns[i];
    EXPECT_EQ(is.name, was.name);
    EXPECT_EQ(is.type, was.type) << was.name;
    EXPECT_EQ(is.rows, was.rows) << was.name;
    EXPECT_EQ(is.width, was.width) << was.name;
    EXPECT_TRUE(is.bytes == was.bytes) << was.name;
  }
}

TEST_F(CheckpointFile, HasTheSameBytesForTheSameState) {
  sim::write_checkpoint(file, "a", "1", some_state());
  const std::string first = bytes_of(file);
  sim::write_checkpoint(file, "a", "1", some_state());
  EXPECT_TRUE(bytes_of(file) == first);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST_F(CheckpointFile, IsNotReadWithAnyBitFlipped) {
  sim::write_checkpoint(file, "a", "1", some_state());
  const std::string good = bytes_of(file);
  std::mt19937 random(1);
  for (int i = 0; i < 400; ++i) {
    std::string bad = good;
    const std::size_t at = i < 64 ? std::size_t(i) : random() % bad.size();   // the file's word on itself, and everything else
    bad[at] = char(bad[at] ^ (1 << random() % 8));
    write(file, bad);
    EXPECT_NE(refusal(), "no error") << "byte " << at;
  }
  write(file, good);
  EXPECT_EQ(refusal(), "no error");
}

TEST_F(CheckpointFile, IsNotReadWhenItIsCutLongerEmptyForeignOrMissing) {
  sim::write_checkpoint(file, "a", "1", some_state());
  const std::string good = bytes_of(file);
  for (const std::size_t size : {std::size_t{1}, std::size_t{100}, std::size_t{512}, good.size() / 2, good.size() - 1}) {
    write(file, good.substr(0, size));
    EXPECT_NE(refusal(), "no error") << size;
  }
  write(file, good.substr(0, good.size() - 1));
  EXPECT_EQ(refusal(), "is cut short");
  write(file, good + "x");
  EXPECT_EQ(refusal(), "is damaged (its checksum does not match)");
  write(file, "");
  EXPECT_EQ(refusal(), "is empty");
  write(file, "a text of somebody else, long enough to be taken for something" + std::string(4096, '.'));
  EXPECT_EQ(refusal(), "is no checkpoint");
  fs::remove(file);
  EXPECT_EQ(refusal(), "No such file or directory");
}

// A whole file of another program: its own checksum holds, its columns are none of ours.
TEST_F(CheckpointFile, IsNotReadWhenAColumnClaimsMoreThanTheFileHolds) {
  sim::State state = some_state();
  sim::write_checkpoint(file, "a", "1", state);
  std::string bytes = bytes_of(file);
  const std::string extent("\x32\0\0\0\0\0\0\0\x03\0\0\0\0\0\0\0", 16);   // 50 x 3, as HDF5 writes it
  const std::size_t at = bytes.find(extent);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 8, std::string("\0\0\0\0\0\0\0\x10", 8));               // 2^60 rows
  const std::string_view rest = std::string_view(bytes).substr(512);
  char start[512] = {};
  std::snprintf(start, sizeof start, "polypic checkpoint\nbytes %zu\nchecksum %016llx\n", rest.size(),
                static_cast<unsigned long long>(base::checksum(std::as_bytes(std::span(rest)))));
  bytes.replace(0, 512, start, 512);
  write(file, bytes);
  EXPECT_NE(refusal(), "no error");
}

TEST_F(CheckpointFile, LeavesTheOldOneWhenTheNewOneCannotBeWritten) {
  sim::write_checkpoint(file, "a", "1", some_state());
  const std::string good = bytes_of(file);
  sim::State large = some_state();
  large.columns.push_back(sim::make_column<double>("zero", std::vector<double>(20000), 1));
  rlimit was{}, small{};
  getrlimit(RLIMIT_FSIZE, &was);
  small = was;
  small.rlim_cur = 100000;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  std::string said = "no error";
  try {
    sim::write_checkpoint(file, "a", "1", large);
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::io);
    said = e.what();
  }
  setrlimit(RLIMIT_FSIZE, &was);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(said, file.string() + ": File too large");
  EXPECT_TRUE(bytes_of(file) == good);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

// Going on from a file is going on: every scheme, to the bit.
TEST_F(CheckpointFile, ASimulationGoesOnFromItAsIfNothingHadHappened) {
  for (const auto transfer : {sim::Transfer::pic, sim::Transfer::flip, sim::Transfer::apic, sim::Transfer::polypic})
    for (const auto kernel : {sim::Kernel::linear, sim::Kernel::quadratic}) {
      const sim::Scene scene = falling_column(transfer, kernel);
      const auto straight = sim::make_simulation(scene, 24);
      const auto before = straight->totals().state_hash;
      advance(*straight, 4);
      sim::write_checkpoint(file, "a", "1", straight->state());
      const auto half = straight->totals().state_hash;
      advance(*straight, 4);

      const auto resumed = sim::make_simulation(scene, 24);
      resumed->restore(sim::read_checkpoint(file).state);
      EXPECT_EQ(resumed->totals().state_hash, half);
      advance(*resumed, 4);
      EXPECT_EQ(resumed->frame().number, 9);
      EXPECT_EQ(resumed->totals().state_hash, straight->totals().state_hash) << int(transfer) << int(kernel);
      EXPECT_EQ(resumed->totals().kinetic_energy, straight->totals().kinetic_energy);
      EXPECT_NE(before, half);
      EXPECT_NE(half, straight->totals().state_hash);
    }
}

TEST_F(CheckpointFile, OfAnotherSceneIsRefusedByTheSimulation) {
  const auto linear = sim::make_simulation(falling_column(sim::Transfer::apic, sim::Kernel::linear), 24);
  sim::State state = linear->state();
  const auto other = sim::make_simulation(falling_column(sim::Transfer::pic, sim::Kernel::linear), 24);
  EXPECT_THROW(other->restore(state), base::Error);
  for (sim::Column& column : state.columns)
    if (column.name == "cell") column.bytes[3] = std::byte{0x7f};   // a cell far outside
  EXPECT_THROW(linear->restore(state), base::Error);
}

// The canonical order, by cell and id, has one place for both. A solid's ids also say where its deformations stand.
TEST_F(CheckpointFile, OfWhichTwoParticlesHaveOneIdIsRefusedByTheSimulation) {
  sim::Scene jelly = sim::verify::open_scene(2, 1, 0.1);
  jelly.bodies = {sim::verify::block({0.3, 0.3, 0}, {0.6, 0.6, 0}, sim::Material{})};
  for (const sim::Scene& scene : {falling_column(sim::Transfer::apic, sim::Kernel::linear), jelly}) {
    const auto simulation = sim::make_simulation(scene, 24);
    sim::State state = simulation->state();
    EXPECT_NO_THROW(simulation->restore(state));
    const auto before = simulation->totals().state_hash;
    for (sim::Column& column : state.columns)
      if (column.name == "id") std::copy_n(column.bytes.begin() + 8 * 5, 8, column.bytes.begin() + 8 * 9);
    try {
      simulation->restore(state);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const base::Error& e) {
      EXPECT_EQ(e.complaint().code, base::Exit::user);
      EXPECT_TRUE(e.complaint().message.starts_with("two particles have id ")) << e.what();
    }
    EXPECT_EQ(simulation->totals().state_hash, before);
  }
}

// The definition in docs/files.md, word by word, and the same sum however the bytes come.
TEST(Checksum, IsWhatTheDocumentationSays) {
  std::vector<std::byte> bytes(1000);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = std::byte(i * 37);
  for (const std::size_t size : {0u, 1u, 8u, 31u, 32u, 33u, 1000u}) {
    const std::span<const std::byte> part(bytes.data(), size);
    std::uint64_t lane[4] = {0x9ae16a3b2f90404fu, 0xc949c7defed1a5b5u, 0x8f14c3a5d1e9b027u, 0xe220a8397b1dcdafu};
    std::vector<std::byte> filled(part.begin(), part.end());
    filled.resize((size + 31) / 32 * 32);
    for (std::size_t i = 0; i < filled.size(); i += 8) {
      std::uint64_t word = 0;
      for (std::size_t k = 8; k-- > 0;) word = word << 8 | std::to_integer<std::uint64_t>(filled[i + k]);
      word ^= lane[i / 8 % 4];
      lane[i / 8 % 4] = (word << 29 | word >> 35) * 0x9fb21c651e98df25u;
    }
    std::uint64_t sum = size * 0x9fb21c651e98df25u;
    for (const std::uint64_t l : lane) sum = (sum ^ l) * 0x9fb21c651e98df25u, sum ^= sum >> 32;
    EXPECT_EQ(base::checksum(part), sum) << size;

    base::Checksum steps;
    for (std::size_t at = 0; at < size; at += 7) steps.add(part.subspan(at, std::min<std::size_t>(7, size - at)));
    EXPECT_EQ(steps.value(), sum) << size;
  }
}

TEST(Checksum, ShowsEveryFlippedBit) {
  std::vector<std::byte> bytes(100, std::byte{0});
  const std::uint64_t was = base::checksum(bytes);
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    bytes[bit / 8] ^= std::byte(1 << bit % 8);
    EXPECT_NE(base::checksum(bytes), was) << bit;
    bytes[bit / 8] ^= std::byte(1 << bit % 8);
  }
}
