// Runs and pictures on one sheet: what is shown, what labels say, and how it refuses.
#include <nlohmann/json.hpp>

#include "render/render.h"
#include "run_program.h"

namespace {

constexpr auto kShot = R"(
[shot]
frames = 3
[sim]
dimension = 2
domain = [[0, 0], [1, 0.5]]
cell = 0.05
[[body]]
name = "column"
shape = { box = [[0, 0], [0.3, 0.4]] }
[[effect]]
kind = "gravity"
[preview]
color = "vorticity"
[render]
width = 256
height = 192
)";

class Sheet : public ProgramTest {
 protected:
  void write_pictures(std::initializer_list<const char*> names) const {
    const render::Image grey{.width = 32, .height = 32, .channels = {"R", "G", "B"}, .pixels = std::vector<float>(32 * 32 * 3, 0.5f)};
    base::Ledger ledger;
    for (const char* name : names) render::write_png(folder / name, grey, {}, true, ledger);
  }
  void expect_refusal(std::vector<std::string> words, const std::string& line) const {
    const Outcome outcome = run(std::move(words));
    EXPECT_EQ(outcome.exit, 2) << outcome.out;
    EXPECT_TRUE(outcome.err.starts_with("polypic: " + line)) << outcome.err;
  }
};

}  // namespace

TEST_F(Sheet, ShowsRunsWithTheirTransferAndTime) {
  write("shot.toml", kShot);
  for (const std::string transfer : {"pic", "polypic"})
    ASSERT_EQ(
        run({"run", "shot.toml", "--quiet", "--out", transfer, "--set", "sim.transfer=" + transfer, "--set",
             transfer == "pic" ? "sim.splitting=lie" : "sim.splitting=reflection", "--frames", transfer == "pic" ? "1-3" : "1-2"})
            .exit,
        0);
  const Outcome outcome = run({"sheet", "pic", "polypic/", "--out", "both.png", "--json"});
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  const auto told = nlohmann::json::parse(outcome.out);
  EXPECT_TRUE(told.at("labels")[0].get<std::string>().starts_with("pic  PIC linear  frame 2  t = 0.042 s  ")) << told;
  EXPECT_TRUE(told.at("labels")[1].get<std::string>().starts_with("polypic  PolyPIC full linear reflection  frame 2  t = 0.042 s  "))
      << "the last frame that both have: " << told;
  const render::Image sheet = render::read_image(folder / "both.png"), picture = render::read_image(folder / "pic/images/beauty.0002.png");
  EXPECT_EQ(sheet.width, told.at("width"));
  std::size_t shown = 0;   // the first picture stands somewhere as it is
  for (std::int64_t y = 0; y < 8 && !shown; ++y)
    for (std::int64_t x = 0; x < 8 && !shown; ++x) {
      bool same = true;
      for (std::int64_t j = 0; j < picture.height && same; ++j)
        same = std::equal(&picture.pixels[static_cast<std::size_t>(j * picture.width * 3)],
                          &picture.pixels[static_cast<std::size_t>(j * picture.width * 3)] + picture.width * 3,
                          &sheet.pixels[static_cast<std::size_t>(((y + j) * sheet.width + x) * 3)]);
      shown = same;
    }
  EXPECT_EQ(shown, 1u);
  for (const std::string kept : {"images/beauty.0001.png", "images/beauty.0002.png"}) {   // another frame's, and the one that is shown
    const std::string before = text_of(folder / "pic" / kept);
    expect_refusal({"sheet", "pic", "polypic", "--out", "pic/" + kept}, "--out pic/" + kept + ": is a picture of a run that is shown\n");
    EXPECT_EQ(text_of(folder / "pic" / kept), before);
  }
  expect_refusal({"sheet", "pic", "polypic", "--frames", "3"}, "pic: not all of the runs have a picture of frame 3");
  expect_refusal({"sheet", "pic", "both.png"}, "a sheet is of runs or of pictures, not of both");
}

TEST_F(Sheet, RepeatsNothingThatItsPicturesSay) {
  write("shot.toml", kShot);
  for (const std::string width : {"320", "640"})
    ASSERT_EQ(run({"run", "shot.toml", "--quiet", "--out", width, "--frames", "1", "--set", "render.width=" + width}).exit, 0);
  const auto label = [&](const std::string& name) {
    return nlohmann::json::parse(run({"sheet", name, "--json"}).out).at("labels")[0].get<std::string>();
  };
  EXPECT_TRUE(label("640").starts_with("640  simulated in ")) << label("640");
  EXPECT_TRUE(label("320").starts_with("320  PolyPIC full linear  0.")) << label("320");   // its picture has no room for the transfer
}

TEST_F(Sheet, NamesRunsWhosePicturesHaveOtherSizes) {
  write("shot.toml", kShot);
  ASSERT_EQ(run({"run", "shot.toml", "--quiet", "--out", "a", "--frames", "1"}).exit, 0);
  ASSERT_EQ(run({"run", "shot.toml", "--quiet", "--out", "b", "--frames", "1", "--set", "render.height=128"}).exit, 0);
  expect_refusal({"sheet", "a", "b"}, "b: has 256x128 pixels, but a has 256x192\n");
}

TEST_F(Sheet, OfPicturesHasTheirNames) {
  write_pictures({"a.png", "b.png", "c.png"});
  const Outcome outcome = run({"sheet", "a.png", "b.png", "c.png", "--json"});
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("labels"), (nlohmann::json{"a.png", "b.png", "c.png"}));
  EXPECT_EQ(render::read_image(folder / "sheet.png").width, nlohmann::json::parse(outcome.out).at("width"));
  std::filesystem::create_directory(folder / "empty");
  expect_refusal({"sheet", "empty"}, "empty: not the directory of a run");
  expect_refusal({"sheet", "none.png"}, "none.png: no such run or picture\n");
  expect_refusal({"sheet", "empty", "none"}, "none: no such run or picture\n");   // before what it says of runs and of pictures
  expect_refusal({"sheet", "a.png", "none.png"}, "none.png: no such run or picture\n");
  expect_refusal({"sheet"}, "RUN is required");
  expect_refusal({"sheet", "a.png", "--out", "sheet.jpg"}, "--out sheet.jpg: a sheet is a .png file");
  expect_refusal({"sheet", "a.png", "--frames", "1-2"}, "--frames 1-2: must be one frame");
  expect_refusal({"sheet", "a.png", "--frames", "2"}, "--frames: has no effect with pictures");
}

TEST_F(Sheet, IsNotWrittenOverWhatItShows) {
  write_pictures({"a.png", "b.png"});
  std::filesystem::create_hard_link(folder / "a.png", folder / "same.png");
  const std::string a = text_of(folder / "a.png"), b = text_of(folder / "b.png");
  for (const std::string out : {"b.png", "./a.png", "same.png"})
    expect_refusal({"sheet", "a.png", "b.png", "--out", out}, "--out " + out + ": is one of the pictures that are shown\n");
  EXPECT_EQ(text_of(folder / "a.png"), a);
  EXPECT_EQ(text_of(folder / "b.png"), b);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(run({"sheet", "a.png", "b.png"}).exit, 0);   // a sheet of before is written over
}

// The picture and the labels are in the run's directory; the mesh lies beside the shot that it came from.
TEST_F(Sheet, OfARunWhoseShotNamesAMeshNeedsNoMesh) {
  for (const char* place : {"ring/ledger", "ring/preview"}) std::filesystem::create_directories(folder / place);
  write("ring/shot.toml", "[sim]\ndomain = [[0, 0, 0], [1, 1, 1]]\ncell = 0.1\n[[body]]\nname = \"ring\"\n"
                          "shape = { mesh = { file = \"elsewhere.obj\" } }\n");
  write("ring/ledger/preview.0001.json", "{}");
  write_pictures({"ring/preview/preview.0001.png"});
  const Outcome outcome = run({"sheet", "ring", "--json"});
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  const auto label = nlohmann::json::parse(outcome.out).at("labels")[0].get<std::string>();
  EXPECT_EQ(label, "ring  simulated in 0.0 s");
}
