// Known differences: what `diff` says of images, volumes, points and runs of which the answer is known, and how it refuses.
#include <OpenImageIO/imageio.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "render/render.h"
#include "run_program.h"
#include "surface/surface.h"

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kVoxel = 0.02;   // [m]

class Diff : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    surface::initialize();
  }
  /// The document of `diff ... --json`, which must end with this code.
  Json diff(std::vector<std::string> words, int code) const {
    words.insert(words.begin(), "diff");
    words.push_back("--json");
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit, code) << outcome.out << outcome.err;
    EXPECT_EQ(outcome.err, "");
    const Json out = Json::parse(outcome.out);
    EXPECT_EQ(out.at("same"), code == 0);
    return out;
  }
  void expect_refusal(std::vector<std::string> words, const std::string& line) const {
    const Outcome outcome = run(std::move(words));
    EXPECT_EQ(outcome.exit, 2) << outcome.out;
    EXPECT_EQ(outcome.complaints(), 1) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("polypic: " + line)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
  }
  void write_image(const std::string& name, const render::Image& image) const {   // floats as they are, NaN too
    OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), static_cast<int>(image.channels.size()), OIIO::TypeFloat);
    spec.channelnames = image.channels;
    const auto out = OIIO::ImageOutput::create((folder / name).string());
    ASSERT_TRUE(out && out->open((folder / name).string(), spec) && out->write_image(OIIO::TypeFloat, image.pixels.data()) && out->close())
        << OIIO::geterror();
  }
  void write_grids(const std::string& name, const openvdb::GridCPtrVec& grids) const { openvdb::io::File((folder / name).string()).write(grids); }
  void write_frame(const std::string& name, const sim::Frame& frame) const {
    base::Ledger untold;
    surface::write_points(folder / name, frame, untold);
  }
};

/// Grey, with the last channel a depth.
render::Image grey(int width = 40, int height = 30) {
  render::Image image{.width = width, .height = height, .channels = {"R", "G", "B", "Z"}, .pixels = {}};
  image.pixels.assign(static_cast<std::size_t>(width * height) * 4, 0.25f);
  return image;
}

openvdb::FloatGrid::Ptr level_set(const openvdb::Vec3d& center, double radius, double voxel = kVoxel) {
  auto grid = openvdb::FloatGrid::create(static_cast<float>(3 * voxel));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  grid->setName("surface");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  const int reach = static_cast<int>(radius / voxel) + 6;
  auto values = grid->getAccessor();
  for (const auto& ijk : openvdb::CoordBBox(openvdb::Coord(-reach), openvdb::Coord(reach))) {
    const double distance = (grid->indexToWorld(ijk) - center).length() - radius;
    if (std::abs(distance) < 3 * voxel) values.setValue(ijk, static_cast<float>(distance));
  }
  openvdb::tools::signedFloodFill(grid->tree());
  return grid;
}

sim::Frame points(std::int64_t first, std::int64_t last, const base::Vec3f& shift = {0, 0, 0}, const base::Vec3f& push = {0, 0, 0}) {
  sim::Frame frame;
  frame.pscale = 0.01;
  for (std::int64_t id = first; id <= last; ++id) {
    const auto t = static_cast<float>(id);
    frame.position.push_back(base::Vec3f(std::sin(t), std::cos(3 * t), 0.01f * t) + shift);
    frame.velocity.push_back(base::Vec3f(1, t, 0) + push);
    frame.id.push_back(id);
  }
  return frame;
}

}  // namespace

TEST_F(Diff, MeasuresAKnownDifferenceOfImages) {
  render::Image image = grey();
  write_image("a.exr", image);
  for (std::size_t p = 0; p < 12; ++p) image.pixels[4 * (97 * p) + 1] += 0.5f;   // green of 12 pixels of 1200
  write_image("b.exr", image);
  const Json out = diff({"a.exr", "b.exr"}, 6);
  EXPECT_EQ(out.at("kind"), "image");
  EXPECT_NEAR(out.at("mean").get<double>(), 12 * 0.5 / 4800, 1e-12);
  EXPECT_NEAR(out.at("rms").get<double>(), std::sqrt(12 * 0.25 / 4800), 1e-12);
  EXPECT_EQ(out.at("max"), 0.5);
  EXPECT_NEAR(out.at("percent_over").get<double>(), 1, 1e-12);   // of pixels
  EXPECT_NEAR(out.at("psnr").get<double>(), -20 * std::log10(std::sqrt(12 * 0.25 / 3600)), 1e-9);   // of R, G and B; white is 1
  EXPECT_EQ(out.at("channels").at(1).at("max"), 0.5);
  EXPECT_EQ(out.at("channels").at(0).at("max"), 0.0);
}

TEST_F(Diff, HoldsImagesAgainstThresholds) {
  render::Image image = grey();
  write_image("a.exr", image);
  for (std::size_t p = 0; p < 12; ++p) image.pixels[4 * (97 * p) + 1] += 0.5f;
  write_image("b.exr", image);
  diff({"a.exr", "b.exr", "--fail", "0.5"}, 0);
  diff({"a.exr", "b.exr", "--fail", "0.499"}, 6);
  diff({"a.exr", "b.exr", "--fail-percent", "1"}, 0);
  diff({"a.exr", "b.exr", "--fail-percent", "0.99"}, 6);
}

TEST_F(Diff, FindsImagesTheSameAndLeavesOutWhatDoesNotApply) {
  write_image("a.exr", grey());
  write_image("b.exr", grey());
  const Json out = diff({"a.exr", "b.exr"}, 0);
  EXPECT_EQ(out.at("max"), 0.0);
  EXPECT_FALSE(out.contains("psnr"));   // it is infinite
  EXPECT_FALSE(out.contains("not_finite"));
  EXPECT_NE(run({"diff", "a.exr", "b.exr"}).out.find("\nsame\n"), std::string::npos);
}

// Two images that are damaged at the same place are not the same.
TEST_F(Diff, NeverTakesANaNForEqual) {
  render::Image image = grey();
  image.pixels[4 * 50] = std::numeric_limits<float>::quiet_NaN();
  write_image("a.exr", image);
  write_image("b.exr", image);
  const Json out = diff({"a.exr", "b.exr", "--fail", "1e30"}, 6);
  EXPECT_EQ(out.at("not_finite"), 1);
  EXPECT_EQ(out.at("max"), 0.0);
  EXPECT_EQ(Json::parse(run({"info", "a.exr", "--json"}).out).at("image").at("not_finite"), 1);
}

TEST_F(Diff, DrawsTheDifferenceAndSaysHowMuchItIsScaled) {
  render::Image image = grey();
  write_image("a.exr", image);
  image.pixels[4 * 41] += 0.04f;   // red of pixel (1, 1)
  write_image("b.exr", image);
  const Json out = diff({"a.exr", "b.exr", "--out", "d.png"}, 6);
  EXPECT_NEAR(out.at("picture").at("gain").get<double>(), 20, 1e-9);
  const render::Image picture = render::read_image(folder / "d.png");
  ASSERT_EQ(picture.width, 40);
  EXPECT_NEAR(picture.pixels[3 * 41], 0.8f, 0.5 / 255);
  EXPECT_EQ(picture.pixels[3 * 41 + 1], 0);
  EXPECT_EQ(picture.pixels[3 * 40], 0);
}

TEST_F(Diff, RefusesWhatDoesNotMatch) {
  write_image("a.exr", grey());
  write_image("small.exr", grey(20, 30));
  render::Image other = grey();
  other.channels[3] = "A";
  write_image("other.exr", other);
  write_frame("p.vdb", points(0, 9));
  write_grids("s.vdb", {level_set({0, 0, 0}, 0.2)});
  write("note.txt", "words");
  fs::create_directory(folder / "empty");
  expect_refusal({"diff", "a.exr", "small.exr"}, "small.exr: 20x30 pixels, and the other has 40x30");
  expect_refusal({"diff", "a.exr", "other.exr"}, "other.exr: has channels R G B A, and the other has R G B Z");
  expect_refusal({"diff", "a.exr", "p.vdb"}, "p.vdb: points, and the other is an image");
  expect_refusal({"diff", "s.vdb", "p.vdb"}, "p.vdb: points, and the other is a volume");
  expect_refusal({"diff", "a.exr", "none.exr"}, "none.exr: No such file or directory");
  expect_refusal({"diff", "a.exr", "note.txt"}, "note.txt: nothing that is compared");
  expect_refusal({"diff", "a.exr", "empty"}, "empty: not the directory of a run");
  expect_refusal({"diff", "s.vdb", "s.vdb", "--out", "d.png"}, "--out d.png: a difference picture");
  expect_refusal({"diff", "a.exr"}, "B is required");
  for (const std::string number : {"-1", "nan", "inf", "x", "1e999", ""}) expect_refusal({"diff", "a.exr", "a.exr", "--fail=" + number}, "--fail");
  expect_refusal({"diff", "a.exr", "a.exr", "--fail-percent", "101"}, "--fail-percent 101: must be a number from 0 to 100");
}

TEST_F(Diff, OfALevelSetAndTheSameMovedIsTheWayItMoved) {
  const double way = 0.013;   // [m] less than a voxel
  write_grids("a.vdb", {level_set({0, 0, 0}, 0.3)});
  write_grids("b.vdb", {level_set({way, 0, 0}, 0.3)});
  const Json out = diff({"a.vdb", "b.vdb"}, 6);
  EXPECT_EQ(out.at("kind"), "volume");
  EXPECT_NEAR(out.at("max").get<double>(), way, 1e-6);   // on the axis
  EXPECT_LT(out.at("mean").get<double>(), way);
  EXPECT_GT(out.at("mean").get<double>(), way / 3);      // |cos| has the mean 1/2 over a sphere
  const Json& grid = out.at("grids").at(0);
  EXPECT_EQ(grid.at("unit"), "m");
  EXPECT_GT(grid.at("active_only").at(0), 0);
  EXPECT_EQ(grid.at("active").at(0).get<int>() - grid.at("active_only").at(0).get<int>(),
            grid.at("active").at(1).get<int>() - grid.at("active_only").at(1).get<int>());
  diff({"a.vdb", "b.vdb", "--fail", "0.01301"}, 0);
  diff({"a.vdb", "b.vdb", "--fail", "0.01299"}, 6);
  const Json itself = diff({"a.vdb", "a.vdb"}, 0);
  EXPECT_EQ(itself.at("max"), 0.0);
  EXPECT_GT(itself.at("grids").at(0).at("active").at(0), 1000);
}

TEST_F(Diff, SeesTheInsideOfALevelSet) {
  const auto whole = level_set({0, 0, 0}, 0.3), hollow = level_set({0, 0, 0}, 0.3);
  hollow->tree().fill(openvdb::CoordBBox(openvdb::Coord(-2), openvdb::Coord(2)), 3 * kVoxel, /*active=*/false);
  write_grids("a.vdb", {whole});
  write_grids("b.vdb", {hollow});
  const Json out = diff({"a.vdb", "b.vdb"}, 6);
  EXPECT_NEAR(out.at("max").get<double>(), 6 * kVoxel, 1e-6);
  EXPECT_EQ(out.at("grids").at(0).at("active_only"), Json::parse("[0, 0]"));
}

TEST_F(Diff, ReportsVoxelsTypesAndGridsThatAreOther) {
  const auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("vel");
  velocity->tree().setValue(openvdb::Coord(1, 2, 3), openvdb::Vec3f(3, 4, 0));
  const auto slower = velocity->deepCopy();
  slower->tree().setValue(openvdb::Coord(1, 2, 3), openvdb::Vec3f(0, 0, 0));
  const auto number = openvdb::DoubleGrid::create();
  number->setName("vel");
  write_grids("a.vdb", {level_set({0, 0, 0}, 0.3), velocity});
  write_grids("slower.vdb", {level_set({0, 0, 0}, 0.3), slower});
  write_grids("coarse.vdb", {level_set({0, 0, 0}, 0.3, 0.04), velocity});
  write_grids("typed.vdb", {level_set({0, 0, 0}, 0.3), number});
  write_grids("alone.vdb", {velocity});
  EXPECT_EQ(diff({"a.vdb", "slower.vdb"}, 6).at("grids").at(1).at("max"), 5.0);
  const Json coarse = diff({"a.vdb", "coarse.vdb", "--fail", "1000"}, 6).at("grids").at(0);
  EXPECT_EQ(coarse.at("unlike").at(0), "voxels: 0.02 x 0.02 x 0.02 m and 0.04 x 0.04 x 0.04 m");
  EXPECT_FALSE(coarse.contains("max"));
  EXPECT_EQ(diff({"a.vdb", "typed.vdb"}, 6).at("grids").at(1).at("unlike").at(0), "type: vec3s and double");
  EXPECT_EQ(diff({"a.vdb", "alone.vdb"}, 6).at("only_a").at(0), "surface");
}

// What the least and the greatest value step over, and vectors have none of: info counts it.
TEST_F(Diff, OfNumbersThatAreNoneInfoTellsHowMany) {
  const auto surface = level_set({0, 0, 0}, 0.1);
  const auto velocity = openvdb::Vec3SGrid::create();
  velocity->setName("vel");
  velocity->tree().setValue(openvdb::Coord(1, 2, 3), openvdb::Vec3f(3, 4, 0));
  write_grids("good.vdb", {surface, velocity});
  surface->tree().setValue(openvdb::Coord(4, 3, 0), std::numeric_limits<float>::quiet_NaN());
  surface->tree().setValue(openvdb::Coord(3, 4, 0), std::numeric_limits<float>::infinity());
  velocity->tree().setValue(openvdb::Coord(3, 2, 1), openvdb::Vec3f(0, std::numeric_limits<float>::quiet_NaN(), 0));
  write_grids("bad.vdb", {surface, velocity});
  const auto grids = [&](const std::string& name) { return Json::parse(run({"info", name, "--json"}).out).at("grids"); };
  for (const Json& grid : grids("good.vdb")) EXPECT_FALSE(grid.contains("not_finite")) << grid;
  EXPECT_EQ(grids("bad.vdb").at(0).at("not_finite"), 2);
  EXPECT_EQ(grids("bad.vdb").at(1).at("not_finite"), 1);
}

// Tiles are compared whole: a mist over 64 thousand million voxels costs what its few nodes cost.
TEST_F(Diff, ComparesLargeTilesWithoutTheirVoxels) {
  const int edge = 4096;
  for (const auto& [name, value] : {std::pair{"a.vdb", 0.5f}, {"b.vdb", 0.75f}}) {
    const auto mist = openvdb::FloatGrid::create(0);
    mist->setName("density");
    mist->tree().root().addTile(openvdb::Coord(0), value, true);
    mist->tree().setValue(openvdb::Coord(-1), 1);
    if (value == 0.75f) mist->tree().setValue(openvdb::Coord(7), 0.5f);   // makes nodes of one side's tile
    write_grids(name, {mist});
  }
  const Json out = diff({"a.vdb", "b.vdb"}, 6);
  const double voxels = std::pow(edge, 3) + 1;
  EXPECT_NEAR(out.at("mean").get<double>() * voxels / 0.25, voxels - 2, 1e-3);   // all but (-1, -1, -1) and (7, 7, 7)
  EXPECT_EQ(out.at("grids").at(0).at("active").at(0).get<double>(), voxels);
}

TEST_F(Diff, OfMovedPointsIsTheVectorTheyMovedBy) {
  write_frame("a.vdb", points(0, 499));
  write_frame("b.vdb", points(0, 499, {0.003f, 0.004f, 0}, {0, 0, -2}));
  const Json out = diff({"a.vdb", "b.vdb"}, 6);
  EXPECT_EQ(out.at("kind"), "points");
  for (const char* column : {"mean", "rms", "max"}) {
    EXPECT_NEAR(out.at("position").at(column).get<double>(), 0.005, 1e-6) << column;
    EXPECT_NEAR(out.at("velocity").at(column).get<double>(), 2, 1e-6) << column;
  }
  EXPECT_EQ(out.at("max"), out.at("position").at("max"));
  EXPECT_FALSE(out.contains("psnr"));
  diff({"a.vdb", "b.vdb", "--fail", "2"}, 0);
  diff({"a.vdb", "b.vdb", "--fail", "1"}, 6);
  diff({"a.vdb", "a.vdb"}, 0);
}

TEST_F(Diff, CountsPointsOfOneSideOnly) {
  write_frame("a.vdb", points(0, 99));
  write_frame("b.vdb", points(2, 100));
  const Json out = diff({"a.vdb", "b.vdb"}, 6);
  EXPECT_EQ(out.at("only"), Json::parse("[2, 1]"));
  EXPECT_EQ(out.at("position").at("max"), 0.0);
  EXPECT_NEAR(out.at("percent_over").get<double>(), 100 * 3 / 101.0, 1e-9);
  diff({"a.vdb", "b.vdb", "--fail-percent", "3"}, 0);
}

TEST_F(Diff, LooksAtAllThatParticlesHold) {
  sim::Frame frame = points(0, 99);
  write_frame("plain.vdb", frame);
  frame.body.assign(100, 0), frame.pressure.assign(100, 5), frame.strain.assign(100, 0), frame.mode_energy.assign(100, 1);
  write_frame("all.vdb", frame);
  EXPECT_EQ(diff({"all.vdb", "plain.vdb"}, 6).at("unlike"),
            Json::parse(R"(["body: in the first only", "pressure: in the first only", "strain: in the first only", "mode_energy: in the first only"])"));
  diff({"all.vdb", "all.vdb"}, 0);
  for (const auto values : {&sim::Frame::pressure, &sim::Frame::strain, &sim::Frame::mode_energy}) {
    sim::Frame other = frame;
    (other.*values)[7] = (other.*values)[7] * 1.25f + 0.01f;
    write_frame("other.vdb", other);
    EXPECT_EQ(diff({"all.vdb", "other.vdb"}, 6).at("percent_over"), 1.0);
  }
  EXPECT_NEAR(diff({"all.vdb", "other.vdb"}, 6).at("mode_energy").at("max").get<double>(), 0.26 / 1.26, 1e-6);   // of the largest
  frame.body[7] = 1;
  write_frame("other.vdb", frame);
  EXPECT_EQ(diff({"all.vdb", "other.vdb"}, 6).at("percent_over"), 1.0);
}

TEST_F(Diff, OfARunWithItselfIsNothingAndAMutantIsFound) {
  write("x.toml", kSmallShot);
  const auto film = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"run", "x.toml", "--quiet", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    ASSERT_EQ(outcome.exit, 0) << outcome.err;
  };
  film("one", {"--frames", "3", "--preview"});
  film("again", {"--frames", "3", "--threads", "1", "--preview"});
  film("heavy", {"--frames", "3", "--set", "effect.1.acceleration=[0,0,-10]"});
  film("dark", {"--frames", "3", "--set", "render.bounces=1"});
  film("short", {"--frames", "1-2"});
  film("bright", {"--frames", "3", "--set", "render.exposure=1"});   // of the PNG alone

  for (const std::string other : {"one", "again"}) {   // hours and seconds are others, and no difference
    const Json out = diff({"one", other}, 0);
    ASSERT_EQ(out.at("stages").size(), 5u);
    EXPECT_EQ(out.at("stages").at(0).at("frames"), 3);
    for (const Json& stage : out.at("stages")) EXPECT_GT(stage.at("frames"), 0) << stage;
    EXPECT_FALSE(out.contains("first"));
    for (const char* absent : {"mean", "rms", "max", "psnr", "percent_over"}) EXPECT_FALSE(out.contains(absent));
  }
  film("audited", {"--frames", "3", "--preview", "--set", "sim.audit=true"});   // changes no result
  film("nearly", {"--frames", "3", "--preview", "--set", "sim.audit=true", "--set", "effect.1.acceleration=[0,0,-9.8100001]"});
  EXPECT_EQ(diff({"audited", "one"}, 0).at("stages").at(0).at("differ"), 0);
  EXPECT_GT(diff({"audited", "nearly"}, 6).at("stages").at(0).at("differ"), 0);
  const Outcome tolerant = run({"diff", "audited", "nearly", "--fail", "0.01", "--json"});   // whatever the surfaces are
  EXPECT_EQ(Json::parse(tolerant.out).at("stages").at(0).at("differ"), 0) << tolerant.out;

  film("small", {"--frames", "3", "--set", "render.width=80"});
  const Json small = diff({"one", "small"}, 6);
  EXPECT_EQ(small.at("first").at("stage"), "render") << small;
  EXPECT_EQ(small.at("stages").at(3).at("worst").at("unlike"), "80x90 pixels, and the other has 160x90");
  const std::string sizes = run({"diff", "one", "small"}).out;
  EXPECT_NE(sizes.find("frame 3: 80x90 pixels, and the other has 160x90\n"), std::string::npos) << sizes;

  const Json heavy = diff({"again", "heavy"}, 6);
  EXPECT_EQ(heavy.at("first"), Json::parse(R"({"frame": 1, "stage": "simulate"})"));   // more potential energy
  EXPECT_EQ(heavy.at("stages").at(1).at("first"), 2);                                  // the particles start alike
  EXPECT_GT(heavy.at("stages").at(1).at("worst").at("max"), 0.0);
  const Json dark = diff({"one", "dark"}, 6);
  EXPECT_EQ(dark.at("first"), Json::parse(R"({"frame": 3, "stage": "render"})"));
  EXPECT_EQ(dark.at("stages").at(0).at("differ"), 0);
  EXPECT_EQ(diff({"one", "bright"}, 6).at("first"), Json::parse(R"({"frame": 3, "stage": "render"})"));
  const Json cut = diff({"one", "short"}, 6);
  EXPECT_EQ(cut.at("stages").at(0).at("only_a"), Json::parse("[3]"));
  const std::string told = run({"diff", "one", "dark"}).out;
  EXPECT_NE(told.find("differ: first in frame 3, render\n"), std::string::npos) << told;

  fs::resize_file(folder / "again/surface/surface.0003.vdb", 1000);
  expect_refusal({"diff", "one", "again"}, "again/surface/surface.0003.vdb: ");
  fs::remove(folder / "again/points/points.0002.vdb");
  expect_refusal({"diff", "one", "again"}, "again/points/points.0002.vdb: No such file or directory");
  write("heavy/ledger/simulate.0002.json", "{\"schema\"");
  expect_refusal({"diff", "one", "heavy"}, "heavy/ledger/simulate.0002.json: not a JSON document");
}
