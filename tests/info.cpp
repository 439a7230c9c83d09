// What `info` says of files of other programs, and of damaged ones.
#include <openvdb/openvdb.h>
#include <sys/resource.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "base/error.h"
#include "render/render.h"
#include "run_program.h"
#include "sim/checkpoint.h"
#include "surface/surface.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

class Info : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    surface::initialize();
  }
  Json info(const std::string& name) const {
    const Outcome outcome = run({"info", name, "--json"});
    EXPECT_EQ(outcome.exit, 0) << name << ": " << outcome.err;
    EXPECT_EQ(outcome.out.find("null"), std::string::npos) << outcome.out;   // no number that is none
    EXPECT_EQ(run({"info", name}).exit, 0);
    return outcome.exit == 0 ? Json::parse(outcome.out) : Json();
  }
  void write_grids(const std::string& name, const openvdb::GridCPtrVec& grids) const { openvdb::io::File((folder / name).string()).write(grids); }
  void write_bytes(const std::string& name, const std::string& bytes) const { std::ofstream(folder / name, std::ios::binary) << bytes; }
};

template <class Grid>
typename Grid::Ptr grid_of(const std::string& name, const typename Grid::ValueType& value) {
  const auto grid = Grid::create();
  grid->setName(name);
  grid->tree().fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(9)), value);
  return grid;
}

render::Image picture() {
  render::Image image{.width = 64, .height = 36, .channels = {"R", "G", "B"}, .pixels = {}};
  std::mt19937 random(3);
  for (int i = 0; i < 64 * 36 * 3; ++i) image.pixels.push_back(static_cast<float>(random() % 1000) / 1000);
  return image;
}

/// What a file is told to be: "" or the complaint. Anything but a complaint about the file is a failure.
template <class Read>
std::string complaint(const fs::path& file, const Read& read) {
  try {
    read(file);
    return "";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user) << e.what();
    EXPECT_TRUE(std::string(e.what()).starts_with(file.string() + ": ")) << e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.what();
  }
}

std::int64_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return std::int64_t{1024} * usage.ru_maxrss;
}

}  // namespace

TEST_F(Info, KnowsGridsOfOtherPrograms) {
  const auto empty = openvdb::FloatGrid::create();
  empty->setName("empty");
  const auto huge = grid_of<openvdb::FloatGrid>("huge", 1);
  huge->setTransform(openvdb::math::Transform::createLinearTransform(1e150));
  huge->setGridClass(openvdb::GRID_FOG_VOLUME);
  write_grids("foreign.vdb", {grid_of<openvdb::Int32Grid>("count", 7), grid_of<openvdb::Vec3DGrid>("force", openvdb::Vec3d(1, 2, 3)), empty, huge,
                              grid_of<openvdb::DoubleGrid>("broken", std::nan("")), grid_of<openvdb::BoolGrid>("mask", true)});
  const Json grids = info("foreign.vdb").at("grids");
  ASSERT_EQ(grids.size(), 6u);
  std::map<std::string, Json> named;
  for (const Json& grid : grids) named[grid.at("name")] = grid;
  EXPECT_EQ(named["count"].at("type"), "int32");
  EXPECT_EQ(named["count"].at("max"), 7.0);
  EXPECT_EQ(named["count"].at("active"), 1000);
  EXPECT_EQ(named["force"].at("type"), "vec3d");
  EXPECT_FALSE(named["force"].contains("min"));
  EXPECT_EQ(named["empty"].at("active"), 0);
  EXPECT_FALSE(named["empty"].contains("bbox"));
  EXPECT_EQ(named["huge"].at("voxel_size").at(0), 1e150);
  EXPECT_EQ(named["huge"].at("class"), "fog volume");
  EXPECT_FALSE(named["broken"].contains("max"));
  EXPECT_EQ(info("foreign.vdb").at("kind"), "volume");
}

TEST_F(Info, KnowsShotsMoviesAndCheckpoints) {
  write("x.toml", kSmallShot);
  ASSERT_EQ(run({"run", "x.toml", "--quiet"}).exit, 0);
  const Json movie = info("out/x/movie.mp4").at("movie");
  EXPECT_EQ(movie.at("codec"), "h264");
  EXPECT_EQ(movie.at("width"), 160);
  EXPECT_EQ(movie.at("frames"), 2);
  EXPECT_EQ(movie.at("fps"), 24.0);
  const Json shot = info("out/x/shot.toml").at("shot");
  EXPECT_EQ(shot.at("frames"), 2);
  EXPECT_EQ(shot.at("cell"), 0.03);
  const Json ranges = info("out/x/images/beauty.0002.exr").at("image").at("ranges");
  EXPECT_GT(ranges.at("Z").at(1), 0.1);
  sim::State state;
  state.frame = 12;
  state.columns.push_back(sim::make_column<float>("offset", std::vector<float>(30, 0.5f), 3));
  sim::write_checkpoint(folder / "state.0012.h5", "0123456789abcdef", "0.1", state);
  const Json checkpoint = info("state.0012.h5").at("checkpoint");
  EXPECT_EQ(checkpoint.at("frame"), 12);
  EXPECT_EQ(checkpoint.at("columns").at(0), Json::parse(R"({"name": "offset", "type": "float32", "rows": 10, "width": 3})"));
}

// A run's copy of its shot: the mesh lies beside the shot that it came from.
TEST_F(Info, KnowsAShotWhoseFilesLieElsewhere) {
  std::string text = kSmallShot;
  const std::string shape = "{ box = [[0, 0, 0], [0.27, 0.3, 0.18]] }";
  text.replace(text.find(shape), shape.size(), "{ mesh = { file = \"elsewhere.obj\" } }");
  write("ring.toml", text);
  const Json shot = info("ring.toml").at("shot");
  EXPECT_EQ(shot.at("bodies"), 1);
  EXPECT_EQ(shot.at("cell"), 0.03);
  EXPECT_EQ(run({"plan", "ring.toml"}).exit, 2);   // which needs what is inside
}

TEST_F(Info, KnowsMeshesAndWhetherTheyAreClosed) {
  const std::string corners = "v 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 4\n", sides = "f 1 2 4\nf 2 3 4\nf 3 1 4\n";
  write_bytes("closed.obj", corners + "f 3 2 1\n" + sides);
  write_bytes("open.obj", corners + sides);
  const Json closed = info("closed.obj");
  EXPECT_EQ(closed.at("kind"), "mesh");
  EXPECT_EQ(closed.at("mesh"), (Json{{"triangles", 4}, {"bounds", {{0.0, 0.0, 0.0}, {2.0, 3.0, 4.0}}}, {"closed", true}}));
  const Json open = info("open.obj").at("mesh");
  EXPECT_EQ(open.at("closed"), false);
  EXPECT_NE(open.at("why_not_closed").get<std::string>().find("edge"), std::string::npos);
}

TEST_F(Info, RefusesAnythingElseInOneLine) {
  fs::create_directory(folder / "folder.vdb");
  for (const std::string end : {".vdb", ".exr", ".png", ".mp4", ".h5", ".json", ".toml", ".doc"}) {
    write("empty" + end, "");
    write("words" + end, "these are = words\n");
    for (const std::string& name : {"empty" + end, "words" + end, "none" + end}) {
      const Outcome outcome = run({"info", name});
      if (name == "empty.toml") continue;   // whatever the shot reader makes of a shot without a key
      EXPECT_EQ(outcome.exit, 2) << name;
      EXPECT_EQ(outcome.complaints(), 1) << outcome.err;
      EXPECT_TRUE(outcome.err.starts_with("polypic: " + name + ":")) << outcome.err;
      EXPECT_EQ(outcome.out, "") << name;
    }
  }
  EXPECT_EQ(run({"info", "folder.vdb"}).err, "polypic: folder.vdb: Is a directory\n");
}

// Cut or flipped anywhere, a file is refused or read, and no length in it is believed before the file holds that much.
TEST_F(Info, SurvivesDamage) {
  sim::Frame frame;
  frame.pscale = 0.01;
  for (int i = 0; i < 300; ++i) {
    frame.position.emplace_back(0.01f * float(i), std::sin(float(i)), 0.0f);
    frame.velocity.emplace_back(1.0f, 2.0f, 3.0f);
    frame.id.push_back(i);
  }
  base::Ledger untold;
  surface::write_points(folder / "own.vdb", frame, untold);
  write_grids("foreign.vdb", {grid_of<openvdb::FloatGrid>("density", 0.5f), grid_of<openvdb::Vec3SGrid>("v", openvdb::Vec3f(1, 2, 3))});
  render::write_png(folder / "a.png", picture(), {}, true, untold);
  render::write_exr(folder / "a.exr", picture(), {}, untold);
  const auto read = [](const fs::path& file) {
    if (file.extension() == ".vdb") surface::info(file);
    else render::info(file);
  };
  const std::int64_t before = peak_memory();
  std::mt19937 random(1);
  for (const std::string name : {"own.vdb", "a.png", "a.exr", "foreign.vdb"}) {
    const std::string bytes = text_of(folder / name), damaged = "damaged" + fs::path(name).extension().string();
    EXPECT_EQ(complaint(folder / name, read), "");
    int refused = 0;
    for (int part = 0; part < 16; ++part) {
      write_bytes(damaged, bytes.substr(0, bytes.size() * static_cast<std::size_t>(part) / 16));
      EXPECT_NE(complaint(folder / damaged, read), "") << name << " cut to " << part << "/16";
    }
    for (int flip = 0; flip < 200; ++flip) {
      std::string other = bytes;
      other[flip < 100 ? static_cast<std::size_t>(flip) * std::min<std::size_t>(bytes.size(), 1000) / 100 : random() % bytes.size()] ^=
          static_cast<char>(1u << (random() % 8));
      write_bytes(damaged, other);
      refused += complaint(folder / damaged, read).empty() ? 0 : 1;
    }
    EXPECT_GT(refused, 20) << name;
    EXPECT_TRUE(name != "own.vdb" || refused >= 195)
        << "its checksum sees every bit but those that say it has one, and " << refused << " of 200 were refused";
    EXPECT_TRUE(name == "foreign.vdb" || peak_memory() - before < std::int64_t{1} << 30)
        << name;   // OpenVDB believes a length in a file without a checksum
  }
}
