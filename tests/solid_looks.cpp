// A film of solids with several looks, from end to end: what the surface file holds, and who is seen in the picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "app/stages/film.h"
#include "app/stages/folder.h"
#include "base/progress.h"
#include "render/render.h"
#include "shot_file.h"
#include "surface/surface.h"

namespace {

const std::string kThree = R"([sim]
solver = "solid"
domain = [[0, 0, 0], [0.9, 0.4, 0.4]]
cell = 0.05
[[body]]
name = "jelly"
shape = { box = [[0.1, 0.1, 0], [0.3, 0.3, 0.2]] }
material = "jelly"
[[body]]
name = "ball"
shape = { sphere = { center = [0.45, 0.2, 0.1], radius = 0.1 } }
material = "clay"
velocity = [1, 0, 0]
[[body]]
name = "heap"
shape = { box = [[0.6, 0.1, 0], [0.8, 0.3, 0.2]] }
material = "dry_sand"
[camera]
position = [0.45, -3, 0.2]
target = [0.45, 0.2, 0.15]
fov = 8
[render]
width = 96
height = 40
spp = 4
)";

class SolidLooks : public ShotFile {
 protected:
  static void SetUpTestSuite() { surface::initialize(); }
  app::Folder make(const app::Shot& shot, const std::string& out, std::vector<app::Stage> stages) const {
    base::Progress quiet(stderr, /*quiet=*/true);
    app::make_film(shot, {.stages = std::move(stages), .frames = app::FrameRange{1, 2}, .out = folder / out, .restart = false, .threads = 2}, quiet);
    return app::Folder(folder / out);
  }
  static std::vector<std::string> grids_of(const app::Folder& made) {
    std::vector<std::string> names;
    for (const surface::GridInfo& grid : surface::info(made.surface(2))) names.push_back(grid.name);
    return names;
  }
};

/// Pixels of each id, and the mean albedo there.
struct Seen {
  int pixels = 0;
  base::Vec3 albedo = base::Vec3::Zero();
};
std::map<int, Seen> seen_in(const render::Image& image) {
  const auto at = [&](const char* name) {
    return static_cast<std::size_t>(std::find(image.channels.begin(), image.channels.end(), name) - image.channels.begin());
  };
  const std::size_t id = at("id"), red = at("albedo.R"), green = at("albedo.G"), blue = at("albedo.B");
  std::map<int, Seen> seen;
  for (std::size_t i = 0; i < image.pixels.size(); i += image.channels.size()) {
    Seen& s = seen[static_cast<int>(image.pixels[i + id])];
    ++s.pixels;
    s.albedo += base::Vec3(image.pixels[i + red], image.pixels[i + green], image.pixels[i + blue]);
  }
  for (auto& [number, s] : seen) s.albedo /= s.pixels;
  return seen;
}

}  // namespace

// Two are surfaces, one is grains; ids are 2 and on in the order of the shot, behind that of what is around all.
TEST_F(SolidLooks, AreSeenInOnePicture) {
  const app::Shot shot = read(kThree);
  const app::Folder made = make(shot, "out", {app::Stage::simulate, app::Stage::surface, app::Stage::render});
  EXPECT_EQ(grids_of(made),
            (std::vector<std::string>{"surface", "vel", "surface_jelly", "vel_jelly", "surface_ball", "vel_ball", "surface_heap", "vel_heap"}));
  std::map<int, Seen> seen = seen_in(render::read_image(made.image(2, ".exr")));
  EXPECT_EQ(seen[2].pixels, 0) << "nothing is around all";
  for (const int id : {3, 4, 5}) EXPECT_GT(seen[id].pixels, 150) << id;
  EXPECT_LT((seen[3].albedo - base::Vec3::Ones()).norm(), 0.15) << "jelly is clear; " << seen[3].albedo.transpose();
  EXPECT_LT((seen[4].albedo - shot.render.looks.at("clay").color).norm(), 0.15) << seen[4].albedo.transpose();
  EXPECT_LT((seen[5].albedo - shot.render.looks.at("dry_sand").color).norm(), 0.15) << seen[5].albedo.transpose();
}

// Looks that make bodies differ ask for surfaces of their own; others do not, and nothing above is made again.
TEST_F(SolidLooks, ChangeTheSurfaceOnlyWhereTheyPartBodies) {
  const std::string one = "body.heap.look=clay";
  const app::Folder made = make(read(kThree, {"body.jelly.look=clay", one}), "out", {app::Stage::simulate, app::Stage::surface});
  EXPECT_EQ(grids_of(made), (std::vector<std::string>{"surface", "vel"}));
  make(read(kThree, {one}), "out", {app::Stage::surface});
  EXPECT_EQ(grids_of(made).size(), 8u);
  const auto written = std::filesystem::last_write_time(made.surface(2));
  make(read(kThree, {"body.jelly.look=steel", one}), "out", {app::Stage::surface});
  EXPECT_EQ(std::filesystem::last_write_time(made.surface(2)), written);
  try {
    make(read(kThree, {"body.jelly.look=clay", one}), "out", {app::Stage::render});
    FAIL() << "a picture of the wrong surfaces";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::resume_refused);
    EXPECT_NE(std::string(e.what()).find("body.look"), std::string::npos) << e.what();
  }
}
