// A shot is read with the precedence, the addressing and the round trips that design promises.
#include "app/shot/shot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "app/shot/find.h"
#include "base/error.h"
#include "tests/shot_file.h"

using Shot = ShotFile;

TEST_F(Shot, ReadsEveryKindOfValue) {
  const app::Shot shot = read(R"(
[shot]
frames = 96
fps = 30
[sim]
domain = [[0, 0, 0], [2, 1.0, 1]]
cell = 0.1
precision = "double"
seeding = "regular"
[[body]]
name = "a"
shape = { box = [[0, 0, 0], [0.5, 1, 0.8]] }
velocity = [1, 0, -2]
[[body]]
name = "b"
shape.sphere = { center = [1, 0.5, 0.5], radius = 0.2 }
material = { preset = "water", density = 1000.0 }
[[collider]]
name = "post"
shape = { box = [[1.5, 0, 0], [1.6, 0.1, 0.5]] }
look = "slate"
[[effect]]
kind = "gravity"
acceleration = [0, 0, -3.7]
[surface]
voxel = 0.04
[camera]
position = [1, -4, 2]
[look.slate]
color = [0.1, 0.2, 0.3]
)");
  EXPECT_EQ(shot.name, "x");
  EXPECT_EQ(shot.frames, 96);
  EXPECT_EQ(shot.fps, 30);
  EXPECT_EQ(shot.scene.options.domain.upper, base::Vec3(2, 1, 1));
  EXPECT_EQ(shot.scene.options.precision, sim::Precision::double_precision);
  EXPECT_EQ(shot.scene.options.seeding, sim::Seeding::regular);
  ASSERT_EQ(shot.scene.bodies.size(), 2u);
  EXPECT_EQ(shot.scene.bodies[0].velocity, base::Vec3(1, 0, -2));
  ASSERT_TRUE(shot.scene.bodies[1].shape.sphere);
  EXPECT_EQ(shot.scene.bodies[1].shape.sphere->radius, 0.2);
  EXPECT_EQ(shot.scene.bodies[1].material, "water");
  ASSERT_EQ(shot.scene.colliders.size(), 1u);
  EXPECT_EQ(shot.scene.effects.at(0).acceleration, base::Vec3(0, 0, -3.7));
  EXPECT_EQ(shot.surface.voxel, 0.04);
  EXPECT_EQ(shot.render.camera.position, base::Vec3(1, -4, 2));
  EXPECT_FALSE(shot.render.camera.target);
  EXPECT_EQ(shot.render.looks.at("slate").color, base::Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(shot.render.colliders.size(), 1u);
  EXPECT_EQ(shot.render.liquid_look, "water");
  EXPECT_EQ(shot.render.domain.upper, base::Vec3(2, 1, 1));
}

TEST_F(Shot, HasTheDefaultsOfWhatItDoesNotSay) {
  const app::Shot shot = read(kLeast);
  EXPECT_EQ(shot.quality, "normal");
  EXPECT_EQ(shot.fps, 24);
  EXPECT_EQ(shot.scene.options.cell, sim::Options().cell);
  EXPECT_EQ(shot.scene.bodies[0].density, 1000);
  EXPECT_FALSE(shot.surface.radius);
  EXPECT_TRUE(shot.scene.effects.empty());
}

TEST_F(Shot, TakesTheRungsKeysWhereItIsSilent) {
  const std::string pictured = kLeast + "[render]\n";
  const app::Shot normal = read(pictured), draft = read(pictured, {}, "draft");
  EXPECT_EQ(normal.scene.options.transfer, sim::Transfer::polypic);
  EXPECT_EQ(normal.scene.options.modes.name, "full");
  EXPECT_EQ(normal.render.options.spp, 16);
  EXPECT_EQ(draft.quality, "draft");
  EXPECT_EQ(draft.scene.options.transfer, sim::Transfer::apic);
  EXPECT_EQ(draft.render.options.spp, 4);
}

TEST_F(Shot, RungsClimbFromModesToReflectionToTheQuadraticKernel) {
  const sim::Options high = read(kLeast, {}, "high").scene.options, extreme = read(kLeast, {}, "extreme").scene.options;
  EXPECT_EQ(high.kernel, sim::Kernel::linear);
  EXPECT_EQ(high.splitting, sim::Splitting::reflection);
  EXPECT_EQ(extreme.kernel, sim::Kernel::quadratic);
  EXPECT_EQ(extreme.splitting, sim::Splitting::reflection);
  EXPECT_EQ(extreme.carry, sim::Carry::hybrid);
  // The rung's carry is for the rung's modes: a shot with its own is not refused for it.
  const sim::Options own = read(kLeast, {"sim.kernel=linear"}, "extreme").scene.options;
  EXPECT_EQ(own.carry, sim::Carry::fixed);
  EXPECT_EQ(own.splitting, sim::Splitting::reflection);
  EXPECT_EQ(read(kLeast, {"sim.transfer=flip"}, "extreme").scene.options.carry, sim::Carry::fixed);
}

// default < built-in rung < the shot's key < the shot's [quality.RUNG] < --set, on one key: render.spp.
TEST_F(Shot, LetsEachLayerOverrideTheOneBelow) {
  const std::string keyed = kLeast + "[render]\nspp = 7\n", tabled = keyed + "[quality.draft.render]\nspp = 9\n";
  EXPECT_EQ(read(kLeast + "[render]\n").render.options.spp, 16);
  EXPECT_EQ(read(kLeast + "[render]\n", {}, "draft").render.options.spp, 4);
  EXPECT_EQ(read(keyed, {}, "draft").render.options.spp, 7);
  EXPECT_EQ(read(tabled, {}, "draft").render.options.spp, 9);
  EXPECT_EQ(read(tabled, {}, "normal").render.options.spp, 7);
  EXPECT_EQ(read(tabled, {"render.spp=11"}, "draft").render.options.spp, 11);
}

TEST_F(Shot, IsReadAtTheRungThatTheCommandLineSaysBeforeItsOwn) {
  const std::string draft = "[shot]\nquality = \"draft\"\n" + kLeast;
  EXPECT_EQ(read(draft).quality, "draft");
  EXPECT_EQ(read(draft, {}, "normal").render.options.spp, 16);
  EXPECT_EQ(read(kLeast + "[render]\n", {"shot.quality=draft"}).render.options.spp, 4);
}

TEST_F(Shot, DropsTheRungsModesWhenTheTransferIsAnother) {
  for (const std::string transfer : {"apic", "pic", "flip"}) {
    const app::Shot by_key = read(kLeast + "[sim]\ntransfer = \"" + transfer + "\"\n");
    EXPECT_TRUE(by_key.scene.options.modes.name.empty() && by_key.scene.options.modes.count == 0) << transfer;
    EXPECT_EQ(read(kLeast, {"sim.transfer=" + transfer}).scene.options.transfer, by_key.scene.options.transfer);
  }
  EXPECT_EQ(read(kLeast + "[quality.normal.sim]\ntransfer = \"apic\"\n").scene.options.transfer, sim::Transfer::apic);
  EXPECT_NE(line(kLeast + "[sim]\ntransfer = \"apic\"\nmodes = 4\n"), "no error");
}

TEST_F(Shot, MergesAQualityTableIntoEntriesByName) {
  const app::Shot shot = read(kLeast + "[quality.draft.body.column]\nvelocity = [0, 0, 1]\n[quality.draft.sim]\ncell = 0.1\n", {}, "draft");
  EXPECT_EQ(shot.scene.bodies.at(0).velocity, base::Vec3(0, 0, 1));
  EXPECT_EQ(shot.scene.bodies.at(0).shape.box->upper.x(), 0.5);
  EXPECT_EQ(shot.scene.options.cell, 0.1);
}

TEST_F(Shot, IsSetByNameOrNumber) {
  EXPECT_EQ(read(kLeast, {"body.column.velocity=[1,0,0]"}).scene.bodies[0].velocity, base::Vec3(1, 0, 0));
  EXPECT_EQ(read(kLeast, {"body.1.velocity=[0,2,0]"}).scene.bodies[0].velocity, base::Vec3(0, 2, 0));
  EXPECT_EQ(read(kLeast + "[[effect]]\n[[effect]]\n", {"effect.2.acceleration=[0,0,1]"}).scene.effects[1].acceleration, base::Vec3(0, 0, 1));
  EXPECT_EQ(read(kLeast, {"look.water.ior=1.5"}).render.looks.at("water").ior, 1.5);
}

TEST_F(Shot, IsSetToTomlOrElseToPlainText) {
  EXPECT_EQ(read(kLeast, {"sim.transfer=apic"}).scene.options.transfer, sim::Transfer::apic);
  EXPECT_EQ(read(kLeast, {"sim.transfer=\"apic\""}).scene.options.transfer, sim::Transfer::apic);
  EXPECT_EQ(read(kLeast, {"surface.vel_name=a=b"}).surface.vel_name, "a=b");
  EXPECT_EQ(read(kLeast, {" sim . cell = 0.1 "}).scene.options.cell, 0.1);
}

TEST_F(Shot, TakesTheLastOfTwoSets) {
  EXPECT_EQ(read(kLeast, {"sim.cell=0.1", "sim.cell=0.05"}).scene.options.cell, 0.05);
}

// A shape in braces is one value: a sphere must not be left beside the box it replaces.
TEST_F(Shot, ReplacesATableInBracesAsAWhole) {
  const app::Shot shot = read(kLeast, {"body.column.shape={sphere={center=[0.5,0.5,0.5],radius=0.2}}"});
  EXPECT_FALSE(shot.scene.bodies[0].shape.box);
  EXPECT_TRUE(shot.scene.bodies[0].shape.sphere);
}

TEST_F(Shot, SetsAKeyOfAMaterialThatIsATable) {
  const std::string table = kLeast + "material = { preset = \"water\" }\n";
  EXPECT_EQ(read(table, {"body.column.material.density=900"}).scene.bodies[0].density, 900);
  EXPECT_EQ(read(kLeast, {"body.column.material={preset=\"water\",density=900}"}).scene.bodies[0].density, 900);
}

TEST_F(Shot, TakesAWholeNumberForARealOne) {
  EXPECT_EQ(read(kLeast + "[shot]\nfps = 25\n").fps, 25);
  EXPECT_EQ(read(kLeast + "[shot]\nfps = 29.97\n").fps, 29.97);
}

TEST_F(Shot, ResolvesToTextThatReadsAsTheSameShot) {
  const std::string text = kLeast + "velocity = [0.1, 1e-9, 123456789012345680.0]\nmaterial = { density = 900 }\n[quality.draft.sim]\ncell = 0.1\n"
                           "[look.\"odd name\"]\nior = 1.4\nmodel = \"dielectric\"\n[surface]\nvel_name = \"a\\\"b\\u0001ü\"\n[render]\n";
  const app::Shot shot = read(text, {"sim.seed=5"}, "draft");
  const app::Shot again = read(shot.resolved);
  EXPECT_EQ(again.resolved, shot.resolved);
  EXPECT_EQ(again.quality, "draft");
  EXPECT_EQ(again.scene.options.cell, 0.1);
  EXPECT_EQ(again.scene.options.seed, 5);
  EXPECT_EQ(again.scene.options.transfer, sim::Transfer::apic);
  EXPECT_EQ(again.scene.bodies[0].velocity, base::Vec3(0.1, 1e-9, 123456789012345680.0));
  EXPECT_EQ(again.scene.bodies[0].density, 900);
  EXPECT_EQ(again.surface.vel_name, "a\"b\x01ü");
  EXPECT_EQ(again.render.looks.at("odd name").ior, 1.4);
  EXPECT_EQ(again.render.options.spp, 4);
  for (const std::string stage : {"simulate", "surface", "render"}) EXPECT_EQ(app::stage_text(again, stage), app::stage_text(shot, stage));
}

TEST_F(Shot, ResolvesToTheKeysThatSomebodySet) {
  EXPECT_EQ(read(kLeast + "[render]\n", {"sim.cell=0.1"}, "draft").resolved, R"([shot]
quality = "draft"

[sim]
cell = 0.1
transfer = "apic"
kernel = "linear"

[[body]]
name = "column"
shape = { box = [[0, 0, 0], [0.5, 1, 1]] }

[render]
spp = 4
)");
}

TEST_F(Shot, ResolvesToOneSpellingInOneOrder) {
  const app::Shot a = read(kLeast + "[sim]\nseed = 3\ncell = 0.10\n[render]\nwidth = 64\n");
  const app::Shot b = read("render = { width = 64 }\n[sim]\ncell = 1e-1\nseed = 0x3\n" + kLeast);
  EXPECT_EQ(a.resolved, b.resolved);
}

TEST_F(Shot, NamesTheKeysThatAStageReadsOtherwise) {
  const auto changed = [&](const std::vector<std::string>& before, const std::vector<std::string>& now, const std::string& stage) {
    const std::string resolved = read(kLeast, before).resolved;
    std::string text;
    for (const app::ChangedKey& key : app::changed_keys(resolved, read(kLeast, now), stage))
      text += key.key + ": " + key.before + " -> " + key.now + "; ";
    return text;
  };
  EXPECT_EQ(changed({}, {}, "simulate"), "");
  EXPECT_EQ(changed({}, {"shot.frames=3", "shot.checkpoint_every=3", "shot.checkpoint_keep=5"}, "simulate"), "");
  EXPECT_EQ(changed({}, {"sim.cell=0.02"}, "simulate"), "");   // the default, written out
  EXPECT_EQ(changed({}, {"sim.cell=0.1", "body.1.velocity=[1,0,0]"}, "simulate"),
            "body.column.velocity: [0, 0, 0] -> [1, 0, 0]; sim.cell: 0.02 -> 0.1; ");
  EXPECT_EQ(changed({"sim.cell=0.1"}, {}, "simulate"), "sim.cell: 0.1 -> 0.02; ");
  EXPECT_EQ(changed({}, {"sim.cell=0.1"}, "render"), "");
  EXPECT_EQ(changed({"surface.voxel=0.01"}, {}, "surface"), "surface.voxel: 0.01 -> ; ");
  EXPECT_EQ(changed({}, {"look.water.ior=1.4"}, "render"), "look.water.ior: 1.333 -> 1.4; ");
}

// What the program brings along is in the text: another version may look otherwise.
TEST_F(Shot, RenderReadsTheLooksAndLightsThatComeWithTheProgram) {
  app::Shot shot = read(kLeast);
  const std::string text = app::stage_text(shot, "render");
  for (const std::string part : {"[look.water]", "[look.ground]", "[[light]]"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  shot.render.looks["ground"].color.x() += 0.125;
  EXPECT_NE(app::stage_text(shot, "render"), text);
  shot = read(kLeast);
  shot.render.looks["glass"].ior = 3;   // not in the picture
  EXPECT_EQ(app::stage_text(shot, "render"), text);
}

TEST_F(Shot, ChangesOnlyTheTextOfTheStagesThatReadAKey) {
  const auto stages_changed_by = [&](const std::string& set) {
    const app::Shot before = read(kLeast), now = read(kLeast, {set});
    std::string changed;
    for (const std::string stage : {"simulate", "surface", "render"})
      if (app::stage_text(before, stage) != app::stage_text(now, stage)) changed += stage + " ";
    return changed;
  };
  EXPECT_EQ(stages_changed_by("sim.cell=0.1"), "simulate ");
  EXPECT_EQ(stages_changed_by("shot.fps=25"), "simulate ");
  EXPECT_EQ(stages_changed_by("body.column.velocity=[1,0,0]"), "simulate ");
  EXPECT_EQ(stages_changed_by("body.column.look=glass"), "render ");
  EXPECT_EQ(stages_changed_by("surface.smooth=1"), "surface ");
  EXPECT_EQ(stages_changed_by("render.width=64"), "render ");
  EXPECT_EQ(stages_changed_by("look.water.ior=1.5"), "render ");
  EXPECT_EQ(stages_changed_by("shot.frames=5"), "");
  EXPECT_EQ(stages_changed_by("sim.seed=1"), "") << "a key set to its default changes nothing";
}

const std::string kFlat = R"([sim]
dimension = 2
domain = [[0, 0], [2, 1]]
cell = 0.1
[[body]]
name = "column"
shape = { box = [[0, 0], [0.5, 1]] }
)";

TEST_F(Shot, OfTwoDimensionsHasVectorsOfTwo) {
  const app::Shot shot = read(kFlat + R"(velocity = [1, -2]
[[body]]
name = "ball"
shape.sphere = { center = [1, 0.5], radius = 0.2 }
[[collider]]
name = "post"
shape = { box = [[1.5, 0], [1.6, 0.5]] }
[[effect]]
kind = "gravity"
[shot]
up = "y"
[render]
width = 320
)");
  EXPECT_EQ(shot.scene.options.dimension, 2);
  EXPECT_EQ(shot.render.dimension, 2);
  EXPECT_EQ(shot.scene.options.domain.upper, base::Vec3(2, 1, 0));
  EXPECT_EQ(shot.render.domain.upper, base::Vec3(2, 1, 0));
  EXPECT_EQ(shot.scene.options.particles_per_cell, 4);
  EXPECT_EQ(shot.scene.bodies[0].velocity, base::Vec3(1, -2, 0));
  EXPECT_EQ(shot.scene.bodies[0].shape.box->upper, base::Vec3(0.5, 1, 0));
  EXPECT_EQ(shot.scene.bodies[1].shape.sphere->center, base::Vec3(1, 0.5, 0));
  EXPECT_EQ(shot.scene.effects.at(0).acceleration, base::Vec3(0, -9.81, 0));
  EXPECT_EQ(shot.render.options.width, 320);
  EXPECT_EQ(shot.render.colliders.size(), 1u);
  EXPECT_EQ(read("[sim]\ndimension = 2\n[[body]]\nshape.box = [[0, 0], [1, 1]]\n").scene.options.domain.upper, base::Vec3(1, 1, 0));
}

TEST_F(Shot, OfTwoDimensionsResolvesToTextThatReadsAsTheSameShot) {
  for (const std::string quality : {"draft", "normal"}) {
    const app::Shot shot = read(kFlat + "velocity = [1, 0]\n[[effect]]\nacceleration = [0, -1]\n",
                                {"sim.boundary={x_lower=\"periodic\",x_upper=\"periodic\"}"}, quality);
    const app::Shot again = read(shot.resolved);
    EXPECT_EQ(again.resolved, shot.resolved);
    EXPECT_EQ(again.scene.options.domain.upper, base::Vec3(2, 1, 0));
    EXPECT_EQ(again.scene.options.boundary, shot.scene.options.boundary);
    EXPECT_TRUE(again.scene.options.periodic(0) && !again.scene.options.periodic(1));
    EXPECT_EQ(again.scene.effects.at(0).acceleration, base::Vec3(0, -1, 0));
    for (const std::string stage : {"simulate", "surface", "render"}) EXPECT_EQ(app::stage_text(again, stage), app::stage_text(shot, stage));
    EXPECT_NE(app::stage_text(shot, "simulate").find("domain = [[0, 0], [2, 1]]"), std::string::npos) << app::stage_text(shot, "simulate");
    EXPECT_EQ(app::stage_text(shot, "surface"), "");
  }
}

TEST_F(Shot, GivesAnExampleThatReads) {
  const std::string example = app::example_shot();
  for (const std::string quality : {"draft", "normal"}) {
    const app::Shot shot = read(example, {}, quality);
    EXPECT_FALSE(shot.scene.bodies.empty());
    EXPECT_FALSE(shot.scene.effects.empty());
  }
  EXPECT_LT(read(example, {}, "draft").render.options.width, read(example).render.options.width);
  std::istringstream lines(example);
  for (std::string one; std::getline(lines, one);)
    EXPECT_TRUE(one.find(" = ") == std::string::npos || one.find("# ") != std::string::npos) << one;
}

TEST(Keys, AreDescribedOnceEachWithAMeaning) {
  const std::vector<app::KeyRow> rows = app::all_keys();
  ASSERT_GT(rows.size(), 40u);
  std::vector<std::string> names;
  for (const app::KeyRow& row : rows) {
    names.push_back(row.key);
    EXPECT_FALSE(row.meaning.empty()) << row.key;
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
}

TEST(Keys, SayDefaultUnitAndRange) {
  const std::vector<app::KeyRow> rows = app::all_keys();
  const auto row = [&](const std::string& key) {
    const auto found = std::find_if(rows.begin(), rows.end(), [&](const app::KeyRow& r) { return r.key == key; });
    return found == rows.end() ? app::KeyRow{"no " + key, "", "", "", ""} : *found;
  };
  EXPECT_EQ(row("sim.cell").default_value, "0.02");
  EXPECT_EQ(row("sim.cell").unit, "m");
  EXPECT_EQ(row("sim.cell").allowed, "above 0");
  EXPECT_EQ(row("shot.quality").allowed, "\"draft\", \"normal\", \"high\" or \"extreme\"");
  EXPECT_EQ(row("surface.voxel").default_value, "half of sim.cell");
  EXPECT_EQ(row("body.NAME.velocity").unit, "m/s");
  EXPECT_EQ(row("effect.N.acceleration").default_value, "[0, 0, -9.81]");
  EXPECT_EQ(row("look.NAME.ior").default_value, "1.333");
  EXPECT_EQ(row("look.NAME.ior").needs, std::vector<std::string>{"model = \"dielectric\""});
  EXPECT_EQ(row("collider.NAME.friction").needs, (std::vector<std::string>{"sim.solver = \"solid\"", "contact = \"separating\""}));
  EXPECT_EQ(row("sim.boundary.x_lower").needs, std::vector<std::string>());
}

// What the listing says a silent shot gets is what a silent shot of each solver gets.
TEST_F(Shot, GetsTheDefaultsThatTheListingSaysAlsoOfSolids) {
  int compared = 0, of_solids = 0;
  for (const bool is_solid : {false, true}) {
    const app::Shot shot = read(kLeast, {is_solid ? "sim.solver=solid" : "sim.solver=fluid", "sim.boundary={}"});   // a table that is there
    for (const app::KeyRow& row : app::all_keys()) {
      std::string key = row.key;
      if (const std::size_t name = key.find("NAME"); name != std::string::npos) key.replace(name, 4, "column");
      const auto got = std::find_if(shot.values.begin(), shot.values.end(), [&](const auto& value) { return value.first == key; });
      const bool is_said = key == "sim.solver" || key == "body.column.name" || key == "body.column.shape.box" || key == "sim.modes";   // by the rung
      if (got == shot.values.end() || is_said || !(key.starts_with("sim.") || key.starts_with("body."))) continue;
      const std::string listed = is_solid && !row.default_of_solids.empty() ? row.default_of_solids : row.default_value;
      EXPECT_EQ(got->second == "\"\"" ? "" : got->second, listed) << key;
      ++compared, of_solids += is_solid && !row.default_of_solids.empty();
    }
  }
  EXPECT_GE(compared, 60);
  EXPECT_GE(of_solids, 10);   // kernel, carry, cfl, six sides and the material
}

TEST_F(Shot, IsFoundBesideAnInstallOrInTheSourceTree) {
  namespace fs = std::filesystem;
  fs::create_directories(folder / "prefix/bin");
  fs::create_directories(folder / "prefix/share/polypic/shots");
  fs::create_directories(folder / "source/build/release/app");
  fs::create_directories(folder / "source/shots");
  fs::create_directories(folder / "source/sim");
  EXPECT_EQ(app::shots_of(folder / "prefix/bin/polypic"), folder / "prefix/share/polypic/shots");
  EXPECT_EQ(app::shots_of(folder / "source/build/release/app/polypic"), folder / "source/shots");
  EXPECT_EQ(app::shots_of(folder / "elsewhere/polypic"), fs::path());
}

TEST_F(Shot, ThatIsNeitherAFileNorShippedIsTheUsersMistake) {
  std::ofstream(folder / "mine.toml") << kLeast;
  EXPECT_EQ(app::find_shot((folder / "mine.toml").string()), folder / "mine.toml");
  try {
    app::find_shot("no_such_shot_anywhere");
    FAIL() << "nothing was thrown";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user);
    EXPECT_STREQ(e.what(), "no_such_shot_anywhere: no such file, and no shipped shot of that name");
  }
}

// A body of a look that is drawn as grains has no surface in pictures; the look says how large and how unlike the grains are.
TEST_F(ShotFile, DrawsABodyAsGrainsWhereItsLookSaysSo) {
  const auto sand = read(kLeast + "look = \"sand\"\n[look.sand]\ngrain_size = 0.8\ngrain_variation = 0.5\n");
  EXPECT_TRUE(sand.render.draws_grains());
  EXPECT_FALSE(sand.render.draws_surface());
  EXPECT_EQ(sand.render.looks.at("sand").grain_size, 0.8);
  EXPECT_EQ(sand.render.looks.at("sand").grain_variation, 0.5);
  EXPECT_TRUE(read(kLeast).render.draws_surface());
  EXPECT_NE(line(kLeast + "[look.water]\ngrain_size = 2\n").find("look.water.grain_size"), std::string::npos);
  EXPECT_NE(line(kLeast + "[look.water]\ndraw = \"fur\"\n").find("look.water.draw = \"fur\""), std::string::npos)
      << line(kLeast + "[look.water]\ndraw = \"fur\"\n");
}
