// Bad shots, and the exact line each of them gives.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "base/error.h"
#include "tests/shot_file.h"

namespace {

struct Bad {
  std::string text, line;
};

using BadShot = ShotFile;

}  // namespace

// What follows kLeast, whose [[body]] ends at line 3, and the line it gives.
TEST_F(BadShot, IsToldWithPlaceKeyValueAndWhatIsAllowed) {
  const std::vector<Bad> table = {
      {"[sim]\ncell = -1\n", "x.toml:5:8: sim.cell = -1 m: must be above 0"},
      {"[sim]\ncell = 1e-7\n", "x.toml:5:8: sim.cell = 1e-07 m: makes 1e+21 cells; at most 1e+17 are possible"},
      {"[sim]\ndomain = [[0, 0, 0], [4, 1e-8, 1e-8]]\ncell = 1e-9\n",
       "x.toml:6:8: sim.cell = 1e-09 m: makes 4e+09 cells along an edge; at most 1e+09 are possible"},
      {"[sim]\ndomain = [[1e6, 0, 0], [1000001, 1, 1]]\n",
       "x.toml:5:10: sim.domain = [[1000000, 0, 0], [1000001, 1, 1]] m: is so far from 0 that numbers in files, which are single precision, lie 0.12 m "
       "apart there, and a cell is 0.02 m"},
      {"[sim]\ncell = 0.0001\n", "x.toml:5:8: sim.cell = 1e-04 m: makes up to 4e+12 particles; at most 4e+09 are possible"},
      {"[sim]\ncell = 0\n", "x.toml:5:8: sim.cell = 0 m: must be above 0"},
      {"[sim]\ncell = \"big\"\n", "x.toml:5:8: sim.cell = \"big\": must be a number above 0"},
      {"[sim]\ncell = nan\n", "x.toml:5:8: sim.cell = nan m: must be finite"},
      {"[sim]\ncell = inf\n", "x.toml:5:8: sim.cell = inf m: must be finite"},
      {"[sim]\ncell = 2024-01-01\n", "x.toml:5:8: sim.cell = 2024-01-01: must be a number above 0"},
      {"[sim]\ncel = 0.1\n", "x.toml:5:1: sim.cel: unknown key (did you mean sim.cell?)"},
      {"[sim]\nfps = 24\n", "x.toml:5:1: sim.fps: unknown key (did you mean shot.fps?)"},
      {"[sim]\nviscosity = 24\n", "x.toml:5:1: sim.viscosity: unknown key"},
      {"[simm]\ncell = 0.1\n", "x.toml:4:2: simm: unknown key (did you mean sim?)"},
      {"[simulation]\ncell = 0.1\n", "x.toml:4:2: simulation: unknown key (did you mean sim?)"},
      {"[sim]\nCFL = 0.5\n", "x.toml:5:1: sim.CFL: unknown key (did you mean sim.cfl?)"},
      {"[sim]\nseed = 1.0\n", "x.toml:5:8: sim.seed = 1: must be a whole number at least 0"},
      {"[sim]\nseed = -3\n", "x.toml:5:8: sim.seed = -3: must be at least 0"},
      {"[sim]\ntransfer = \"polipic\"\n",
       "x.toml:5:12: sim.transfer = \"polipic\": must be \"pic\", \"flip\", \"apic\" or \"polypic\" (did you mean \"polypic\"?)"},
      {"[sim]\ntransfer = 3\n", "x.toml:5:12: sim.transfer = 3: must be \"pic\", \"flip\", \"apic\" or \"polypic\""},
      {"[sim]\ndimension = 4\n", "x.toml:5:13: sim.dimension = 4: must be between 2 and 3"},
      {"[sim]\ndomain = [[0, 0, 0], [1, 1]]\n",
       "x.toml:5:10: sim.domain = [[0, 0, 0], [1, 1]] m: must be two opposite corners, [[x, y, z], [x, y, z]]"},
      {"[sim]\ncell = 0.03\n", "x.toml:5:8: sim.cell = 0.03 m: the domain is no multiple of it; the nearest is 0.030303030303030304 m"},
      {"[sim]\ntransfer = \"apic\"\nmodes = 4\n", "x.toml:6:9: sim.modes = 4: needs sim.transfer = \"polypic\""},
      {"[sim]\nmodes = 0\n", "x.toml:5:9: sim.modes = 0: must be a count from 1, \"multilinear\", \"quadratic\" or \"full\""},
      {"[shot]\nframes = 0\n", "x.toml:5:10: shot.frames = 0: must be between 1 and 1000000"},
      {"[shot]\nup = \"y\"\n", "x.toml:5:6: shot.up = \"y\": must be \"z\""},
      {"[shot]\nquality = \"perfect\"\n", "x.toml:5:11: shot.quality = \"perfect\": must be \"draft\", \"normal\", \"high\" or \"extreme\""},
      {"velocity = [1, 0]\n", "x.toml:4:12: body.column.velocity = [1, 0] m/s: must be three numbers, [x, y, z]"},
      {"velocity = [1, 0, \"a\"]\n", "x.toml:4:12: body.column.velocity = [1, 0, \"a\"] m/s: must be three numbers, [x, y, z]"},
      {"velocity = [1e39, 0, 0]\n", "x.toml:4:12: body.column.velocity = [1e+39, 0, 0] m/s: must be at most 1e18 in size, each component"},
      {"velocity = [1, 0, inf]\n", "x.toml:4:12: body.column.velocity = [1, 0, inf] m/s: must be finite in each component"},
      {"material = \"watr\"\n",
       "x.toml:4:12: body.column.material = \"watr\": must be \"water\", \"jelly\", \"rubber\", \"steel\", "
       "\"clay\", \"dry_sand\", \"wet_sand\", \"snow\" or \"water_mpm\", or a table with preset and keys (did you mean \"water\"?)"},
      {"material = \"jelly\"\n", "x.toml:4:12: body.column.material: \"jelly\" needs sim.solver = \"solid\""},
      {"material = { preset = \"jelly\", young = 2e4 }\n", "x.toml:4:32: body.column.material.young: needs sim.solver = \"solid\""},
      {"[look.a]\nroughness = 0.1\nmodel = \"difuse\"\n",   // what makes it useless is what is wrong
       "x.toml:6:9: look.a.model = \"difuse\": must be \"diffuse\", \"dielectric\", \"conductor\", \"coated\", \"translucent\" or \"emissive\" "
       "(did you mean \"diffuse\"?)"},
      {"material = { preset = \"water\", young = 1 }\n", "x.toml:4:32: body.column.material.young: needs sim.solver = \"solid\""},
      {"[[body]]\nname = \"column\"\n", "x.toml:5:8: body.2.name = \"column\": must be unique"},
      {"[[body]]\nname = \"2\"\n", "x.toml:5:8: body.2.name = \"2\": must be letters, digits, _ or -, and begin with a letter"},
      {"[[body]]\nname = \"b\"\n", "x.toml:4:1: body.b.shape: a body needs a shape"},
      {"[[body]]\nname = \"b\"\nshape = { box = [[0, 0, 0], [0.1, 0.1, 0.1]], axis = [1, 0, 0] }\n",
       "x.toml:6:54: body.b.shape.axis = [1, 0, 0]: turns nothing without an angle"},
      {"[[body]]\nname = \"b\"\nshape = { box = [[0, 0, 0], [0.1, 0.1, 0.1]], angle = 9, axis = [0, 0, 0] }\n",
       "x.toml:6:65: body.b.shape.axis = [0, 0, 0]: must not be zero"},
      {"look = \"jam\"\n",
       "x.toml:4:8: body.column.look = \"jam\": there is no such look; there are clay, dry_sand, glass, ground, jelly, lamp, plaster, rubber, "
       "sand, slate, snow, steel, water, water_mpm, wax, wet_sand"},
      {"[collider]\nname = \"post\"\n", "x.toml:4:1: collider = { name = \"post\" }: must be tables, each under [[collider]]"},
      {"[look]\nwater = \"blue\"\n", "x.toml:5:9: look.water = \"blue\": must be a table"},
      {"[look.water]\nabsorption = [-1, 0, 0]\n", "x.toml:5:14: look.water.absorption = [-1, 0, 0] 1/m: must be at least 0 in each component"},
      {"[look.water]\ncolor = [1, 0, 0]\n", "x.toml:5:1: look.water.color: needs a model other than \"dielectric\", which has absorption"},
      {"[render]\nview = [1, 2]\n", "x.toml:5:8: render.view = [1, 2]: must be \"filmic\" or \"srgb\""},
      {"[surface]\nvel_name = 3\n", "x.toml:5:12: surface.vel_name = 3: must be text in quotes"},
      {"[quality.draft.sim]\ncel = 0.1\n", "x.toml:5:1: quality.draft.sim.cel: unknown key (did you mean quality.draft.sim.cell?)"},
      {"[quality.draft.sim]\ncell = -1\n", "x.toml:5:8: quality.draft.sim.cell = -1 m: must be above 0"},
      {"[quality.drat.sim]\ncell = 0.1\n",
       "x.toml:4:10: quality.drat: unknown key: the rungs are \"draft\", \"normal\", \"high\" or \"extreme\" (did you mean quality.draft?)"},
      {"[quality.best.sim]\ncell = 0.1\n", "x.toml:4:10: quality.best: unknown key: the rungs are \"draft\", \"normal\", \"high\" or \"extreme\""},
      {"[quality.draft.shot]\nquality = \"normal\"\n", "x.toml:5:11: quality.draft.shot.quality: a rung cannot choose another one"},
      {"[quality.draft.body.colum]\nvelocity = [0, 0, 0]\n",
       "x.toml:4:1: quality.draft.body.colum: no such entry (did you mean quality.draft.body.column?)"},
  };
  for (const Bad& bad : table) EXPECT_EQ(line(kLeast + bad.text), bad.line) << bad.text;
}

TEST_F(BadShot, SaysWhatASourceNeeds) {
  const std::string named = "[[source]]\nname = \"tap\"\n", shape = "shape = { box = [[0.6, 0.6, 0.6], [0.8, 0.8, 0.8]] }\n", tap = named + shape + "velocity = [0, 0, -1]\n";
  const std::vector<Bad> table = {
      {named + shape, "x.toml:4:1: source.tap.velocity = [0, 0, 0] m/s: must not be zero: nothing would come"},
      {named + "velocity = [1, 0, 0]\n", "x.toml:4:1: source.tap.shape: a source needs a shape"},
      {named + "shape = { sphere = { center = [0.7, 0.7, 0.7], radius = 0.1 } }\nvelocity = [1, 0, -1]\n",
       "x.toml:7:12: source.tap.velocity = [1, 0, -1] m/s: must point along an axis where the shape is a sphere or a turned box: the steps of its cells would "
       "pour sideways"},
      {tap + "[[collider]]\nshape = { box = [[0.5, 0.5, 0.5], [0.7, 0.9, 0.6]] }\n",
       "x.toml:7:12: source.tap.velocity: 500 of its 1000 cells pour into a wall, a collider or another source, where there is no room"},
      {tap + "start = 1\nend = 0.5\n", "x.toml:9:7: source.tap.end = 0.5 s: must be later than start"},
      {tap + "density = 1200\n", "x.toml:8:11: source.tap.density = 1200 kg/m^3: one liquid has one density: bodies and sources must have the same"},
      {tap + "look = \"glass\"\n", "x.toml:8:8: source.tap.look = \"glass\": one liquid has one look: bodies and sources must have the same"},
      {tap + "look = \"jam\"\n", "x.toml:8:8: source.tap.look = \"jam\": there is no such look; there are clay, dry_sand, glass, ground, jelly, lamp, plaster, "
                                   "rubber, sand, slate, snow, steel, water, water_mpm, wax, wet_sand"},
      {tap + tap, "x.toml:9:8: source.2.name = \"tap\": must be unique"},
      {named + "shape = { box = [[0.602, 0.6, 0.6], [0.607, 0.8, 0.8]] }\nvelocity = [0, 0, -1]\n",
       "x.toml:6:9: source.tap.shape: no cell of 0.02 m has its middle in it"},
      {named + "shape = { box = [[0.6, 0.6, 1.6], [0.8, 0.8, 1.8]] }\nvelocity = [0, 0, -1]\n", "x.toml:6:9: source.tap.shape: no cell: it lies outside the domain"},
      {tap + "[[collider]]\nshape = { box = [[0.5, 0.5, 0.5], [0.9, 0.9, 0.9]] }\n",
       "x.toml:6:9: source.tap.shape: no cell: those with their middles in it are a collider's or an earlier source's"},
      {tap + "[sim]\nsolver = \"solid\"\n", "x.toml:4:3: source: needs sim.solver = \"fluid\": only liquids pour"},
  };
  for (const Bad& bad : table) EXPECT_EQ(line(kLeast + bad.text), bad.line) << bad.text;
  EXPECT_EQ(line(kLeast + tap), "no error");
  EXPECT_EQ(line(tap), "no error");   // nothing but a source
  EXPECT_EQ(line(tap + "start = 0.1\n"), "x.toml:5:9: source.tap.start = 0.1 s: needs a [[body]], or a source that begins at the first frame: there is nothing before");
}

// A body that got no particle would be missing from the film without a word.
TEST_F(BadShot, IsToldWhichBodyGetsNoParticleAndWhy) {
  const auto body = [](const std::string& name, const std::string& shape) {
    return "[[body]]\nname = \"" + name + "\"\nshape = " + shape + "\n";
  };
  const std::string solid = "[sim]\nsolver = \"solid\"\n" + body("jelly", "{ box = [[0.1, 0.1, 0.1], [0.5, 0.5, 0.5]] }");
  const std::string hidden = "x.toml:8:9: body.steel.shape: no particle: it lies inside ", owner = " (a place belongs to the first body that holds it)";
  const std::vector<Bad> table = {
      {body("steel", "{ box = [[0.8, 0.8, 1], [0.9, 0.9, 1.2]] }"), "x.toml:8:9: body.steel.shape: no particle: it lies outside the domain"},
      {body("steel", "{ box = [[0.8, 0.8, 0.8], [0.801, 0.801, 0.801]] }"),
       "x.toml:8:9: body.steel.shape: no particle: it is too small for their spacing of 0.01 m"},
      {body("steel", "{ box = [[0.8, 0.8, 0.9999], [0.9, 0.9, 2]] }"),
       "x.toml:8:9: body.steel.shape: no particle: what of it lies in the domain is too small for their spacing of 0.01 m"},
      {body("steel", "{ sphere = { center = [0.3, 0.3, 0.3], radius = 0.2 } }"), hidden + "body jelly" + owner},
      {body("steel", "{ sphere = { center = [0.8, 0.8, 0.8], radius = 0.1 } }") +
           "[[collider]]\nname = \"post\"\nshape = { box = [[0.7, 0.7, 0], [0.9, 0.9, 0.9]] }\n",
       hidden + "collider post"},
      {body("steel", "{ box = [[0.4, 0.2, 0.2], [0.6, 0.3, 0.3]] }") +
           "[[collider]]\nname = \"post\"\nshape = { box = [[0.45, 0.1, 0], [0.7, 0.5, 0.5]] }\n",
       hidden + "collider post and body jelly" + owner},
  };
  for (const Bad& bad : table) EXPECT_EQ(line(solid + bad.text), bad.line) << bad.text;
  const std::string set = "body.column.shape={sphere={center=[0.5,0.5,0.5],radius=1e-3}}";   // of a liquid, in mid-domain
  EXPECT_EQ(line(kLeast, {set}), "--set " + set + ": body.column.shape: no particle: it is too small for their spacing of 0.01 m");
  const std::string flat = "[sim]\ndimension = 2\ncell = 0.1\n[[body]]\nshape = { box = [[0, 0], [0.5, 1]] }\n"
                           "[[body]]\nshape = { box = [[0, 0], [0.2, 0.2]] }\n";
  EXPECT_EQ(line(flat), "x.toml:7:9: body.2.shape: no particle: it lies inside body 1" + owner);
}

// What is only partly in the domain, or partly taken, is a body; so is one that reaches in across a periodic side.
TEST_F(BadShot, IsNoneWhereEveryBodyHasAPlaceOfItsOwn) {
  const std::string second = "[[body]]\nname = \"second\"\nshape = ";
  EXPECT_EQ(line(kLeast + second + "{ box = [[0.2, 0.2, 0.2], [0.51, 0.8, 0.8]] }\n"), "no error");   // a skin of it
  EXPECT_EQ(line(kLeast + second + "{ box = [[0.99, 0.5, 0.5], [7, 0.6, 0.6]] }\n"), "no error");
  const std::string beyond = second + "{ box = [[1.6, 0.2, 0.2], [1.8, 0.8, 0.8]] }\n";
  const std::string ends = "[sim]\nboundary = { x_lower = \"periodic\", x_upper = \"periodic\" }\n";
  EXPECT_EQ(line(kLeast + beyond + ends), "no error");
  EXPECT_NE(line(kLeast + beyond), "no error");
}

// The same for the least shot of two dimensions, whose [[body]] ends at line 6.
TEST_F(BadShot, OfTwoDimensionsIsToldWhatHasNoPlaceInAPlane) {
  const std::string flat = "[sim]\ndimension = 2\ncell = 0.1\n[[body]]\nname = \"column\"\nshape = { box = [[0, 0], [0.5, 1]] }\n";
  EXPECT_EQ(line(flat), "no error");
  const std::vector<Bad> table = {
      {"velocity = [1, 0, 0]\n", "x.toml:7:12: body.column.velocity = [1, 0, 0] m/s: must be two numbers, [x, y]"},
      {"look = \"glass\"\n", "x.toml:7:1: body.column.look: has no effect in two dimensions: points are drawn, coloured as [preview] says"},
      {"[[body]]\nshape = { mesh = \"x.obj\" }\n", "x.toml:8:11: body.2.shape.mesh: is a solid of three dimensions"},
      {"[preview]\ndraw = \"points\"\n", "x.toml:8:1: preview.draw: has no effect in two dimensions: points are drawn"},
      {"[[body]]\nshape = { box = [[0, 0, 0], [1, 1, 1]] }\n",
       "x.toml:8:17: body.2.shape.box = [[0, 0, 0], [1, 1, 1]] m: must be two opposite corners, [[x, y], [x, y]]"},
      {"[[body]]\nshape = { box = [[0, 0], [1, 0]] }\n",
       "x.toml:8:17: body.2.shape.box = [[0, 0], [1, 0]] m: the second corner must be above the first in every axis"},
      {"[surface]\nvoxel = 0.1\n", "x.toml:7:2: surface: has no effect in two dimensions: points are drawn as they are"},
      {"[camera]\nfov = 30\n",
       "x.toml:7:2: camera: has no effect in two dimensions: points are drawn, coloured as [preview] says, and all of the domain is in view"},
      {"[[light]]\nkind = \"sky\"\n",
       "x.toml:7:3: light: has no effect in two dimensions: points are drawn, coloured as [preview] says, and all of the domain is in view"},
      {"[look.water]\nior = 1.3\n",
       "x.toml:7:2: look: has no effect in two dimensions: points are drawn, coloured as [preview] says, and all of the domain is in view"},
      {"[render]\nspp = 4\n", "x.toml:8:1: render.spp: has no effect in two dimensions: points are drawn as they are displayed"},
      {"[shot]\nup = \"z\"\n", "x.toml:8:6: shot.up = \"z\": must be \"y\" in two dimensions"},
  };
  for (const Bad& bad : table) EXPECT_EQ(line(flat + bad.text), bad.line) << bad.text;
  const std::vector<Bad> sets = {
    {"sim.particles_per_cell=8", "sim.particles_per_cell = 8: must be 1, 4, 9 or 16"},
    {"sim.particles_per_cell=25", "sim.particles_per_cell = 25: must be 1, 4, 9 or 16"},
    {"sim.modes=5", "sim.modes = 5: must be a count from 1 to 4 with the linear kernel in two dimensions, or a named set"},
    {"sim.cell=0.03", "sim.cell = 0.03 m: the domain is no multiple of it; the nearest is 0.030303030303030304 m"},
    {"sim.boundary={z_lower=\"periodic\"}", "sim.boundary.z_lower: needs sim.dimension = 3"},
  };
  for (const Bad& bad : sets) EXPECT_EQ(line(flat, {bad.text}), "--set " + bad.text + ": " + bad.line);
}

TEST_F(BadShot, IsToldWhichSidesAndTransfersDoNotGoTogether) {
  const std::vector<Bad> table = {
      {"[sim]\nboundary = { x_lower = \"periodic\" }\n",
       "x.toml:5:24: sim.boundary.x_lower = \"periodic\": needs sim.boundary.x_upper = \"periodic\" too"},
      {"[sim]\nboundary = { y_upper = \"periodic\" }\n",
       "x.toml:5:24: sim.boundary.y_upper = \"periodic\": needs sim.boundary.y_lower = \"periodic\" too"},
      {"[sim]\nboundary = { x_lower = \"gone\" }\n", "x.toml:5:24: sim.boundary.x_lower = \"gone\": must be \"open\", \"slip\" or \"periodic\""},
      {"[sim]\nboundary = \"periodic\"\n", "x.toml:5:12: sim.boundary = \"periodic\": must be a table"},
      {"[sim]\ncell = 0.5\nboundary = { x_lower = \"periodic\", x_upper = \"periodic\" }\n",
       "x.toml:6:24: sim.boundary.x_lower = \"periodic\": needs at least 4 cells between the two sides; there are 2"},
      {"[sim]\ncarry = \"hybrid\"\n",
       "x.toml:5:9: sim.carry = \"hybrid\": needs sim.kernel = \"quadratic\": limiting the linear kernel's modes would throw its accuracy away"},
      {"[sim]\ntransfer = \"flip\"\nkernel = \"quadratic\"\ncarry = \"limited\"\n",
       "x.toml:7:9: sim.carry = \"limited\": needs sim.transfer = \"polypic\": only modes that bend within a cell are limited, and no other transfer "
       "has any"},
      {"[sim]\nkernel = \"quadratic\"\nmodes = 8\ncarry = \"limited\"\n",
       "x.toml:7:9: sim.carry = \"limited\": needs more sim.modes: only modes that bend within a cell are limited, and this set has none"},
      {"[sim]\nkernel = \"quadratic\"\nmodes = \"multilinear\"\ncarry = \"hybrid\"\n",
       "x.toml:7:9: sim.carry = \"hybrid\": needs more sim.modes: only modes that bend within a cell are limited, and this set has none"},
      {"[sim]\nkernel = \"quadratic\"\ncarry = \"hybrid\"\n", "no error"},
      {"[sim]\nkernel = \"quadratic\"\nmodes = 9\ncarry = \"limited\"\n", "no error"},
      {"[sim]\nmodes = \"quadratic\"\n", "x.toml:5:9: sim.modes = \"quadratic\": the set \"quadratic\" needs sim.kernel = \"quadratic\""},
      {"[sim]\nmodes = 9\n", "x.toml:5:9: sim.modes = 9: must be a count from 1 to 8 with the linear kernel, or a named set"},
      {"[sim]\nflip_time = 1\n", "x.toml:5:13: sim.flip_time = 1 s: needs sim.transfer = \"flip\""},
      {"[sim]\nparticles_per_cell = 4\n", "x.toml:5:22: sim.particles_per_cell = 4: must be 1, 8, 27 or 64"},
  };
  for (const Bad& bad : table) EXPECT_EQ(line(kLeast + bad.text), bad.line) << bad.text;
}

TEST_F(BadShot, IsToldWhatWouldHaveNoEffect) {
  const auto says = [&](const std::string& text, const std::vector<std::string>& sets, const std::string& what) {
    const std::string told = line(text, sets);
    EXPECT_NE(told.find(what), std::string::npos) << told << "\nin place of " << what;
  };
  says(kLeast + "[camera]\nfov = 60\n[[camera.key]]\nframe = 1\nfov = 20\n", {}, "camera.fov = 60 degrees: is said by [[camera.key]] as well");
  says(kLeast + "[render]\nspp = 1\ndenoise = \"picture\"\n", {}, "render.denoise = \"picture\": needs render.spp of 2 or more");
  const std::string solid =
      "[sim]\nsolver = \"solid\"\ndimension = 2\ndomain = [[0, 0], [1, 1]]\ncell = 0.05\n[[body]]\nname = \"a\"\nmaterial = \"jelly\"\n"
      "shape = { box = [[0.3, 0.3], [0.6, 0.6]] }\n";
  EXPECT_EQ(line(solid), "no error");
  says(solid, {"sim.dimension=4"}, "--set sim.dimension=4: ");   // not the file's domain, which has two
  says(solid, {"sim.cfl=2"}, "sim.cfl = 2: must be");
  says(solid, {"sim.transfer=apic", "sim.carry=limited"}, "sim.carry = \"limited\": needs transfer = \"polypic\"");
  says(solid, {"body.a.transfer=apic", "body.a.carry=limited"}, "body.a.carry = \"limited\": needs transfer = \"polypic\"");
  says(solid, {"sim.flip_time=1"}, "sim.flip_time = 1 s: needs transfer = \"flip\"");
  EXPECT_EQ(line(solid, {"body.a.transfer=flip", "sim.flip_time=1"}), "no error");
  says(solid, {"sim.boundary={x_lower=\"slip\",x_upper=\"slip\",y_lower=\"slip\",y_upper=\"slip\",friction=0.3}"},
       "sim.boundary.friction = 0.3: needs a side that is \"separating\"");
  const std::string plate = solid + "[[collider]]\nname = \"p\"\nshape = { box = [[0, 0.1], [0.9, 0.12]] }\n";
  EXPECT_EQ(line(plate), "no error");
  says(plate + "contact = \"sticky\"\n", {}, "collider.p.contact = \"sticky\": needs a collider as thick as sim.cell");
  says(plate + "friction = 0.3\n", {}, "collider.p.friction = 0.3: needs a collider as thick as sim.cell");
  const std::string small = "[[collider]]\nname = \"p\"\ncontact = \"sticky\"\nshape = ";   // as wide as a cell, and between its nodes
  says(solid + small + "{ sphere = { center = [0.125, 0.125], radius = 0.03 } }\n", {}, "collider.p.contact = \"sticky\": needs a collider as thick as sim.cell");
  says(solid + small + "{ box = [[0.1, 0.1], [0.15, 0.15]], angle = 45 }\n", {}, "collider.p.contact = \"sticky\": needs a collider as thick as sim.cell");
  EXPECT_EQ(line(solid + small + "{ sphere = { center = [0.125, 0.125], radius = 0.036 } }\n"), "no error");
  EXPECT_EQ(line(solid + small + "{ box = [[0.1, 0.1], [0.15, 0.15]] }\n"), "no error");
  says(solid, {"body.a.material={preset=\"jelly\",model=\"fixed_corotated\",poisson=-0.2}"}, "body.a.material.poisson = -0.2: must be at least 0 with model \"fixed_corotated\"");
}

TEST_F(BadShot, HasVoxelsThatNoFileHolds) {
  const std::string told = line("[sim]\ndomain = [[0, 0, 0], [2e-4, 2e-4, 2e-4]]\ncell = 2e-5\n[[body]]\nname = \"a\"\nshape = { box = [[0, 0, 0], [1e-4, 1e-4, 1e-4]] }\n");
  EXPECT_NE(told.find("sim.cell = 2e-05 m: puts particles 1e-05 m apart"), std::string::npos) << told;
}

TEST_F(BadShot, IsToldWhereItsSyntaxBreaks) {
  EXPECT_TRUE(line("[sim]\ncell = \n").starts_with("x.toml:2:8: ")) << line("[sim]\ncell = \n");
  EXPECT_TRUE(line("[sim]\ncell = 1\ncell = 2\n").starts_with("x.toml:3:")) << line("[sim]\ncell = 1\ncell = 2\n");
  EXPECT_TRUE(line("\xff").starts_with("x.toml:1:1: ")) << line("\xff");
  for (const std::string text : {"[sim]\ncell = \n", "\xff", "a = \"\n\"", "[[[", "a = 1 b = 2", "[", "[]", "[.a]", "[a.]", "[[]]", "[[a]", "[ ]",
                                 "[a b]", "a. = 1", "= 1", "a..b = 1", "{}", "[a}", "[[a]]\n[a]", "a = 1\na.b = 2", "a = [1, 2", "a = {b = 1",
                                 "a = 'x", "a = 0x", "a = 1e", "\"", "a = \"\\q\""}) {
    EXPECT_TRUE(line(text).starts_with("x.toml:")) << text << " gives " << line(text);
    EXPECT_EQ(line(text).find('\n'), std::string::npos) << text;
  }
  EXPECT_EQ(line("[sim]\ncell = 1\n[[[\nx = 1\n"), "x.toml:3: no valid TOML");
}

TEST_F(BadShot, NeedsABody) {
  EXPECT_EQ(line(""), "x.toml: body: a shot needs at least one [[body]], or a [[source]]");
  EXPECT_EQ(line("body = []"), "x.toml:1:8: body: a shot needs at least one [[body]], or a [[source]]");
}

// A law may fail only because of a misspelt key: the key is what the user must hear of.
TEST_F(BadShot, IsToldOfABadKeyBeforeABrokenLaw) {
  EXPECT_EQ(line("[sim]\ncell = 0.03\nsede = 1\n"), "x.toml:3:1: sim.sede: unknown key (did you mean sim.seed?)");
}

TEST_F(BadShot, IsToldOfTheFirstOfTwoMistakes) {
  EXPECT_EQ(line("[render]\nwidth = 1\n[sim]\ncell = -1\n"), "x.toml:2:9: render.width = 1 pixels: must be between 16 and 16384");
}

TEST_F(BadShot, NamesTheSetThatSpoiltIt) {
  const std::vector<Bad> table = {
    {"sim.cell=-1", "--set sim.cell=-1: sim.cell = -1 m: must be above 0"},
    {"sim.cel=1", "--set sim.cel=1: sim.cel: unknown key (did you mean sim.cell?)"},
    {"sim.cell", "--set sim.cell: must be KEY=VALUE"},
    {"=1", "--set =1: must be KEY=VALUE"},
    {"sim..cell=1", "--set sim..cell=1: must be KEY=VALUE"},
    {"sim.cell=", "--set sim.cell=: sim.cell = \"\": must be a number above 0"},
    {"sim.cell=0.03", "--set sim.cell=0.03: sim.cell = 0.03 m: the domain is no multiple of it; the nearest is 0.030303030303030304 m"},
    {"body.colum.velocity=[0,0,1]", "--set body.colum.velocity=[0,0,1]: body.colum: no such entry (did you mean body.column?)"},
    {"body.2.velocity=[0,0,1]", "--set body.2.velocity=[0,0,1]: body.2: no such entry (there is column)"},
    {"body.column.velocity=[1,0", "--set body.column.velocity=[1,0: body.column.velocity = \"[1,0\": must be three numbers, [x, y, z]"},
    {"body.column.mass=1", "--set body.column.mass=1: body.column.mass: unknown key"},
    {"sim=3", "--set sim=3: sim = 3: must be a table"},
    {"sim.cell.x=3", "--set sim.cell.x=3: sim.cell = { x = 3 }: must be a number above 0"},
    {"shot.quality=best", "--set shot.quality=best: shot.quality = \"best\": must be \"draft\", \"normal\", \"high\" or \"extreme\""},
    {"quality.draft.sim.cel=1", "--set quality.draft.sim.cel=1: quality.draft.sim.cel: unknown key (did you mean quality.draft.sim.cell?)"},
    {"surface.vel_name=\xff", "--set surface.vel_name=\xff: must be UTF-8 text"},
  };
  for (const Bad& bad : table) EXPECT_EQ(line(kLeast, {bad.text}), bad.line) << bad.text;
  EXPECT_EQ(line(kLeast + "material = \"water\"\n", {"body.column.material.density=900"}),
            "--set body.column.material.density=900: body.column.material = \"water\": must be a table before its keys can be set");
}

TEST_F(BadShot, IsToldOfACellFarFromItsOwnWhereNoNearOneDividesTheDomain) {
  EXPECT_EQ(line(kLeast, {"sim.domain=[[0,0,0],[1,1,0.617]]", "sim.cell=0.03"}),
            "--set sim.cell=0.03: sim.cell = 0.03 m: the domain is no multiple of it, and no cell near it divides all three edges; 0.001 m does");
  const std::string flat = line("[sim]\ndimension = 2\ndomain = [[0, 0], [10, 0.7]]\ncell = 1\n[[body]]\nshape = { box = [[0, 0], [1, 1]] }\n");
  EXPECT_EQ(flat, "x.toml:4:8: sim.cell = 1 m: the domain is no multiple of it, and no cell near it divides both edges; 0.1 m does");
}

TEST_F(BadShot, NamesTheQualityOptionThatIsNoRung) {
  EXPECT_EQ(line(kLeast, {}, "drft"),
            "--quality drft: shot.quality = \"drft\": must be \"draft\", \"normal\", \"high\" or \"extreme\" (did you mean \"draft\"?)");
}

TEST_F(BadShot, ThatIsMissingOrTooLargeIsNotRead) {
  try {
    app::read_shot(folder / "none.toml", {});
    FAIL() << "nothing was thrown";
  } catch (const base::Error& e) {
    EXPECT_EQ(std::string(e.what()), (folder / "none.toml").string() + ": No such file or directory");
    EXPECT_EQ(e.complaint().code, base::Exit::user);
  }
  EXPECT_EQ(line("# " + std::string(1 << 20, 'x')), "x.toml: larger than 1048576 bytes");
}

TEST_F(BadShot, WithoutItsMeshIsToldAtTheKeyThatNamesIt) {
  const std::string none = (folder / "none.obj").string() + ": No such file or directory";
  EXPECT_EQ(line("[[body]]\nname = \"hero\"\nshape = { mesh = { file = \"none.obj\" } }\n"), "x.toml:3:27: body.hero.shape.mesh.file: " + none);
  EXPECT_EQ(line(kLeast + "[[set]]\nname = \"room\"\nmesh = { file = \"none.obj\" }\n"), "x.toml:6:17: set.room.mesh.file: " + none);
}

TEST_F(BadShot, NamesAFileThatIsNoMeshOrPictureBeforeAnythingIsMade) {
  std::ofstream(folder / "bad.obj") << "v 0 0 nan\nf 1 2 3\n";
  std::ofstream(folder / "bad.exr") << "no picture";
  EXPECT_TRUE(line(kLeast + "[[set]]\nname = \"room\"\nmesh = { file = \"bad.obj\" }\n").starts_with("x.toml:6:17: set.room.mesh.file: "));
  EXPECT_TRUE(line(kLeast + "[[light]]\nkind = \"environment\"\nfile = \"bad.exr\"\n").starts_with("x.toml:6:8: light.1.file: "));
}

TEST_F(BadShot, HasASurfaceFarOffItsParticles) {
  EXPECT_NE(line(kLeast + "[surface]\nradius = 1e9\n").find("surface.radius"), std::string::npos);
}

TEST_F(BadShot, CannotExhaustTheStackOrTheLine) {
  std::string deep = "a";
  for (int i = 0; i < 100000; ++i) deep += ".a";
  EXPECT_EQ(line("[sim]\n" + deep + " = 1\n"), "x.toml:2: a key of more than 200 parts");
  EXPECT_TRUE(line(kLeast, {deep + "=1"}).ends_with(": a key of more than 200 parts"));
  EXPECT_EQ(line("[sim]\n\"#\"." + deep + " = 1\n"), "x.toml:2: a key of more than 200 parts");
  EXPECT_NE(line(kLeast, {"x={\"#\"." + deep + "=1}"}), "no error");
  std::string tables = "1";
  for (int i = 0; i < 120; ++i) tables = "{" + deep.substr(0, 301) + " = " + tables + "}";
  EXPECT_EQ(line("x = " + tables + "\n"), "x.toml:1: tables in tables, more than 200 deep");
  const std::string dots(250, '.');
  EXPECT_TRUE(line(kLeast + "material = \"" + dots + "\"\n").starts_with("x.toml:4:12: body.column.material = \"..."));
  EXPECT_EQ(line(kLeast + "[sim]\nkernel = \"linear\"#" + dots + "\n"), "no error");
  EXPECT_TRUE(line("# " + dots + "\n" + kLeast + "material = '''" + dots + "\n'''\nwhat = 1\n").find("parts") == std::string::npos);
  EXPECT_LT(line(kLeast, {deep + "=1"}).size(), 1200u);
  EXPECT_NE(line("a = " + std::string(100000, '[')), "no error");
  std::string many;
  for (int i = 0; i < 2000; ++i) many += "k" + std::to_string(i) + " = 1\n";
  EXPECT_EQ(line("[sim]\n" + many), "x.toml:1: a table of more than 1000 keys");
  EXPECT_LT(line(kLeast + "[sim]\nkernel = \"" + std::string(100000, 'x') + "\"\n").size(), 200u);
}

TEST_F(BadShot, GivesItsPartsToJson) {
  try {
    read(kLeast + "[sim]\nkernel = \"linar\"\n");
    FAIL() << "nothing was thrown";
  } catch (const base::Error& e) {
    const base::Complaint& c = e.complaint();
    EXPECT_EQ(c.file, (folder / "x.toml").string());
    EXPECT_EQ(c.line, 5);
    EXPECT_EQ(c.column, 10);
    EXPECT_EQ(c.key, "sim.kernel");
    EXPECT_EQ(c.value, "\"linar\"");
    EXPECT_EQ(c.allowed, "must be \"linear\" or \"quadratic\"");
    EXPECT_EQ(c.hint, "did you mean \"linear\"?");
  }
}
