// Shots of solids: what the reader takes, what presets stand for, and what is refused with which line.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "base/error.h"
#include "tests/shot_file.h"

namespace {

using SolidShot = ShotFile;

const std::string kSolid = R"([sim]
solver = "solid"
[[body]]
name = "cube"
shape = { box = [[0.2, 0.2, 0.2], [0.6, 0.6, 0.6]] }
)";

}  // namespace

TEST_F(SolidShot, TakesAPresetAndChangesItsConstants) {
  const app::Shot shot =
      read(kSolid + "material = { preset = \"clay\", young = 5e6 }\nspin = [0, 0, 3]\ntransfer = \"polypic\"\nmodes = 9\ncarry = \"limited\"\n" +
           "[[collider]]\nname = \"post\"\nshape = { sphere = { center = [0, 0, 0], radius = 0.1 } }\ncontact = \"sticky\"\n");
  ASSERT_EQ(shot.scene.bodies.size(), 1u);
  const sim::Body& body = shot.scene.bodies[0];
  EXPECT_EQ(body.material, "clay");
  EXPECT_EQ(body.solid.young, 5e6);
  EXPECT_EQ(body.solid.yield_stress, sim::preset_material("clay").yield_stress);
  EXPECT_EQ(body.solid.plasticity, sim::Plasticity::von_mises);
  EXPECT_EQ(body.spin, base::Vec3(0, 0, 3));
  const sim::Options own = sim::with_scheme_of(body, shot.scene.options);
  EXPECT_EQ(own.modes.count, 9);
  EXPECT_EQ(own.carry, sim::Carry::limited);
  EXPECT_EQ(shot.scene.options.kernel, sim::Kernel::quadratic);   // whatever the rung
  EXPECT_EQ(shot.scene.options.carry, sim::Carry::hybrid);
  EXPECT_EQ(shot.scene.options.boundary[2][0], sim::Side::separating);
  EXPECT_EQ(shot.scene.colliders.at(0).contact, sim::Contact::sticky);
  EXPECT_EQ(shot.render.liquid_look, "clay");
}

TEST_F(SolidShot, EveryPresetIsAMaterialWithALookAndASource) {
  std::set<std::string> names;
  for (const std::string_view name : sim::material_presets()) {
    const app::Shot shot = read(kSolid + "material = \"" + std::string(name) + "\"\n");
    EXPECT_EQ(shot.scene.bodies[0].material, name);
    names.insert(std::string(name));
  }
  EXPECT_EQ(names, (std::set<std::string>{"jelly", "rubber", "steel", "clay", "dry_sand", "wet_sand", "snow", "water_mpm"}));
  ASSERT_EQ(sim::preset_table().size(), names.size());
  for (const sim::Preset& preset : sim::preset_table()) EXPECT_NE(preset.source.find('['), std::string_view::npos) << preset.name;
}

TEST_F(SolidShot, IsToldWhatAMaterialCannotBe) {
  const std::vector<std::pair<std::string, std::string>> table = {
      {"material = { poisson = 0.5 }\n", "x.toml:6:24: body.cube.material.poisson = 0.5: must be between -1 and 0.5 (both excluded)"},
      {"material = { young = 0 }\n", "x.toml:6:22: body.cube.material.young = 0 Pa: must be above 0"},
      {"material = { density = 0 }\n", "x.toml:6:24: body.cube.material.density = 0 kg/m^3: must be above 0"},
      {"material = { plasticity = \"snow\" }\n",
       "x.toml:6:27: body.cube.material.plasticity = \"snow\": needs model \"hencky\", or \"fixed_corotated\" for snow"},
      {"material = { yield_stress = 1 }\n", "x.toml:6:14: body.cube.material.yield_stress: needs plasticity = \"von_mises\""},
      {"material = \"water\"\n",
       "x.toml:6:12: body.cube.material = \"water\": must be \"jelly\", \"rubber\", \"steel\", \"clay\", \"dry_sand\", \"wet_sand\", \"snow\" "
       "or \"water_mpm\", or a table with preset and keys (did you mean \"water_mpm\"?)"},
      {"modes = 4\ntransfer = \"apic\"\n", "x.toml:6:9: body.cube.modes = 4: needs transfer = \"polypic\""},
      {"look = \"steel\"\n[[body]]\nname = \"the other\"\nshape = { sphere = { center = [0.8, 0.8, 0.8], radius = 0.1 } }\nlook = \"clay\"\n",
       "x.toml:8:8: body.2.name = \"the other\": must be letters, digits, _ or -, and begin with a letter"},   // of grids, too
      {"[surface]\nvel_name = \"surface_cube\"\n",
       "x.toml:7:12: surface.vel_name = \"surface_cube\": must be a name other than surface, and not begin with surface_"},
  };
  for (const auto& [text, expected] : table) EXPECT_EQ(line(kSolid + text), expected) << text;
  EXPECT_EQ(line(kSolid, {"sim.kernel=linear"}),
            "--set sim.kernel=linear: sim.kernel = \"linear\": solids need the quadratic kernel: forces of the linear one jump from cell to cell");
  EXPECT_EQ(line(kLeast + "spin = [0, 0, 1]\n"), "x.toml:4:1: body.column.spin: needs sim.solver = \"solid\"");
}

// Whether each body gets a surface of its own is the surface stage's business, which looks they have is not.
TEST_F(SolidShot, HasASurfaceForEachBodyWhereLooksDiffer) {
  const auto two = [&](const std::string& first, const std::string& second) {
    return read(kSolid + "look = \"" + first +
                "\"\n[[body]]\nname = \"other\"\nshape = { sphere = { center = [0.8, 0.8, 0.8], radius = 0.1 } }\nlook = \"" + second + "\"\n");
  };
  const app::Shot same = two("clay", "clay"), differ = two("clay", "steel"), grains = two("dry_sand", "wet_sand"), mixed = two("clay", "wet_sand");
  EXPECT_FALSE(same.render.parts_bodies());
  EXPECT_TRUE(differ.render.parts_bodies());
  EXPECT_FALSE(grains.render.parts_bodies());
  EXPECT_TRUE(mixed.render.parts_bodies());
  EXPECT_FALSE(mixed.render.is_grains(0));
  EXPECT_TRUE(mixed.render.is_grains(1));
  const auto surface = [](const app::Shot& shot) { return app::stage_text(shot, "surface"); };
  EXPECT_EQ(surface(same), surface(grains));
  EXPECT_EQ(surface(differ), surface(mixed));
  EXPECT_NE(surface(same), surface(differ));
  EXPECT_EQ(app::changed_keys(same.resolved, differ, "surface").size(), 1u);
  EXPECT_EQ(app::stage_text(same, "simulate"), app::stage_text(differ, "simulate"));
}

// A body from a mesh: read, placed, part of what the simulation is made from; what is open or missing is one line.
TEST_F(SolidShot, SaysWhichOfItsBodiesFlow) {
  const app::Shot shot = read(kSolid + "[[body]]\nname = \"pool\"\nshape = { box = [[0, 0, 0], [1, 1, 0.2]] }\nmaterial = \"water_mpm\"\n");
  EXPECT_EQ(shot.render.body_flows, (std::vector<bool>{false, true}));
}

TEST_F(SolidShot, TakesABodyFromAClosedMeshAndRefusesAnOpenOne) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", closed = corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const auto write = [&](const std::string& text) { std::ofstream(folder / "m.obj") << text; };
  const std::string text =
      "[sim]\nsolver = \"solid\"\n[[body]]\nname = \"piece\"\nshape = { mesh = { file = \"m.obj\", scale = 0.5, translate = [0.1, 0.1, 0.1] } }\n";
  write(closed);
  const app::Shot shot = read(text);
  const sim::Shape& shape = shot.scene.bodies.at(0).shape;
  EXPECT_LT(shape.distance({0.2, 0.2, 0.2}), 0);
  EXPECT_GT(shape.distance({0.5, 0.5, 0.5}), 0);
  EXPECT_NEAR(shape.bounds().upper.x(), 0.6, 1e-6);
  const std::string before = app::stage_text(shot, "simulate");
  write(closed + "# changed\n");
  EXPECT_NE(app::stage_text(read(text), "simulate"), before);
  write(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\n");
  EXPECT_NE(line(text).find("m.obj: is not closed: 3 of its edges have a triangle on one side only, the first from ("), std::string::npos)
      << line(text);
  std::filesystem::remove(folder / "m.obj");
  EXPECT_NE(line(text).find("m.obj: "), std::string::npos);
}

// A collider from a mesh: the same, and it must be thick enough for the cells, and for contact at nodes where it rubs.
TEST_F(SolidShot, TakesAColliderFromAClosedMeshThatIsThickEnough) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", closed = corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const auto write = [&](const std::string& text) { std::ofstream(folder / "m.obj") << text; };
  const auto collider = [](double scale, const std::string& more = "") {
    return "[[collider]]\nname = \"post\"\nshape = { mesh = { file = \"m.obj\", scale = " + std::to_string(scale) + ", translate = [0.6, 0.6, 0] } }\n" + more;
  };
  write(closed);
  const app::Shot shot = read(kSolid + collider(0.4));
  for (const sim::Collider& one : {shot.scene.colliders.at(0), shot.render.colliders.at(0)}) {
    EXPECT_LT(one.shape.distance({0.65, 0.65, 0.05}), 0);
    EXPECT_GT(one.shape.distance({0.9, 0.9, 0.3}), 0);
  }
  const std::string before = app::stage_text(shot, "simulate");
  write(closed + "# changed\n");
  EXPECT_NE(app::stage_text(read(kSolid + collider(0.4)), "simulate"), before);
  EXPECT_EQ(app::named_files(shot).size(), 1u);
  EXPECT_NE(line(kSolid + collider(0.002)).find("m.obj: is thinner than an eighth of sim.cell on "), std::string::npos) << line(kSolid + collider(0.002));
  EXPECT_EQ(line(kSolid + collider(0.05, "friction = 0.3\n")),
            "x.toml:9:12: collider.post.friction: needs a collider as thick as sim.cell, with a node of the grid in it: contact of solids is there");
  write(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\n");
  EXPECT_NE(line(kSolid + collider(0.4)).find("collider.post.shape.mesh.file: "), std::string::npos) << line(kSolid + collider(0.4));
  EXPECT_NE(line(kSolid + collider(0.4)).find("m.obj: is not closed: "), std::string::npos);
}
