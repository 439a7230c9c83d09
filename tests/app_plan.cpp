// What a shot asks for, through the built program: `plan` as people and programs read it, what is refused, and what a run does not do.
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "run_program.h"

namespace {

using Json = nlohmann::json;

const std::string kTankOnly = std::string(kSmallShot).substr(0, std::string(kSmallShot).find("[render]"));
const std::string kBall = "[[collider]]\nname = \"ball\"\nshape = { sphere = { center = [0.45, 0.15, 0.05], radius = 0.04 } }\n";
const std::string kPost = "[[collider]]\nname = \"post\"\nshape = { box = [[0.4, 0.05, 0], [0.44, 0.1, 0.2]] }\n";

/// The user's cache is the test's own.
class PlanCommand : public ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    ::setenv("XDG_CACHE_HOME", (log / "cache").c_str(), 1);
    write("x.toml", kSmallShot);
  }
  void TearDown() override {
    ::unsetenv("LD_PRELOAD");
    ::unsetenv("EMBREE_CALLS");
  }
  Json json_of(std::vector<std::string> words) const {
    words.push_back("--json");
    const Outcome outcome = run(std::move(words));
    EXPECT_EQ(outcome.exit, 0) << outcome.err;
    return Json::parse(outcome.out);
  }
  static bool has(const std::string& text, const std::string& line) { return std::regex_search(text, std::regex(line)); }
  static std::set<std::string> keys_of(const Json& json) {
    std::set<std::string> keys;
    for (const auto& [key, value] : json.items()) keys.insert(key);
    return keys;
  }

  struct EmbreeCalls {
    int devices = -1, geometries = -1;
  };
  /// Counts what the program asks of Embree.
  EmbreeCalls embree_calls(std::vector<std::string> words) const {
    ::setenv("LD_PRELOAD", EMBREE_COUNTER, 1);
    ::setenv("EMBREE_CALLS", (log / "calls").c_str(), 1);
    const Outcome outcome = run(std::move(words));
    ::unsetenv("LD_PRELOAD");
    EXPECT_EQ(outcome.exit, 0) << outcome.err;
    EmbreeCalls calls;
    std::ifstream(log / "calls") >> calls.devices >> calls.geometries;
    return calls;
  }
};

}  // namespace

TEST_F(PlanCommand, TellsAPersonWhatIsOnWhyAndWhatItCosts) {
  const Outcome outcome = run({"plan", "x.toml"});
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  for (const char* line :
       {"\nsimulate +liquid +sim\\.solver +\"fluid\"\n|^simulate +liquid +sim\\.solver +\"fluid\"\n", "\n +polypic +sim\\.transfer +\"polypic\"\n",
        "\n +gravity +effect\\.1\\.acceleration +\\[0, 0, -9\\.81\\]\n", "\nsurface +level set +sim\\.dimension +3\n", "\nrender +path tracing +sim\\.dimension +3\n",
        "\noff: solid, .*\\bflip\\b.*\\bcolliders\\b.*\\bgrains in pictures\\b",
        "\nparticles +[0-9]+, each 172 B: cell 12, offset 12, id 8, coefficients 96, order 44\n",
        "\nsimulate +sort p2g sums forces pressure extrapolate volume g2p advect collide watch write_points checkpoint\n",
        "\nsurface +rasterize rebuild smooth velocity write_surface\n", "\nrender +mesh bvh trace write_image\n",
        "\nCPU +[0-9.]+ .* for 2 frames; a frame: render ", "\nmemory +[0-9.]+ MB\n",
        "\ndisk +[0-9.]+ [kM]B: ", "measured on this machine in .*; no finished run tells yet how good that is"})
    EXPECT_TRUE(has(outcome.out, line)) << line << "\n" << outcome.out;
  EXPECT_FALSE(has(outcome.out, "\noff:.*\\bgravity\\b"));
  EXPECT_EQ(files(), std::vector<std::string>{"x.toml"}) << "a plan leaves nothing where it is made";
}

// The small runs are of coarser cells, and a body without a particle is refused.
TEST_F(PlanCommand, PredictsAShotWithABodyThatCoarseCellsWouldLose) {
  write("drop.toml", "[sim]\ndimension = 2\ncell = 0.01\n[[body]]\nname = \"sea\"\nshape = { box = [[0, 0], [1, 0.5]] }\n"
                     "[[body]]\nname = \"drop\"\nshape = { sphere = { center = [0.52, 0.8], radius = 0.003 } }\n");
  EXPECT_TRUE(json_of({"plan", "drop.toml", "--frames", "1"}).contains("predicted"));
}

TEST_F(PlanCommand, TellsAProgramTheSame) {
  const Json plan = json_of({"plan", "x.toml", "--frames", "1-2"});
  EXPECT_EQ(keys_of(plan), (std::set<std::string>{"schema", "shot", "effects", "attributes", "bytes_per_particle", "passes", "particles", "cells",
                                                  "frames", "predicted"}));
  EXPECT_EQ(plan["schema"], 1);
  EXPECT_EQ(plan["frames"], (Json{1, 2}));
  EXPECT_EQ(plan["cells"], 20 * 10 * 10);
  EXPECT_NEAR(plan["particles"].get<double>(), 9 * 10 * 6 * 8, 20);
  std::int64_t bytes = 0;
  for (const Json& attribute : plan["attributes"]) {
    EXPECT_EQ(keys_of(attribute), (std::set<std::string>{"name", "bytes"}));
    bytes += attribute["bytes"].get<std::int64_t>();
  }
  EXPECT_EQ(plan["bytes_per_particle"], bytes);
  int on = 0, off = 0;
  for (const Json& effect : plan["effects"]) {
    std::set<std::string> keys = keys_of(effect);
    keys.erase("value");   // of a key that the shot does not have there is none
    EXPECT_EQ(keys, (std::set<std::string>{"name", "stage", "on", "key"})) << effect;
    ++(effect["on"].get<bool>() ? on : off);
  }
  EXPECT_GT(on, 20);
  EXPECT_GT(off, 30);
  const Json& predicted = plan["predicted"];
  EXPECT_EQ(keys_of(predicted), (std::set<std::string>{"seconds", "peak_bytes", "disk_bytes"}));
  EXPECT_EQ(keys_of(predicted["seconds"]), (std::set<std::string>{"simulate", "surface", "render"}));
  for (const auto& [stage, seconds] : predicted["seconds"].items()) EXPECT_GT(seconds.get<double>(), 0) << stage;

  const Json run = json_of({"run", "x.toml", "--quiet"});
  EXPECT_EQ(run["plan"]["effects"], plan["effects"]);
  EXPECT_EQ(run["plan"]["passes"], plan["passes"]);
  EXPECT_NEAR(plan["particles"].get<double>(), run["frames"][0]["particles"].get<double>(), 20);
  EXPECT_NEAR(predicted["peak_bytes"].get<double>(), run["peak_bytes"].get<double>(), 0.1 * run["peak_bytes"].get<double>());
}

TEST_F(PlanCommand, NamesTheKeyThatDecides) {
  write("y.toml", std::string(kSmallShot) +
                      "[[collider]]\nname = \"still\"\nshape.box = [[0.5, 0, 0], [0.6, 0.1, 0.1]]\n"
                      "[[collider]]\nname = \"mover\"\nshape.box = [[0.5, 0.2, 0], [0.6, 0.3, 0.1]]\nvelocity = [0, 0, 1]\n"
                      "[look.clear]\nmodel = \"dielectric\"\n[look.milk]\nmodel = \"dielectric\"\nscattering = [1, 1, 1]\n");
  const Json plan = Json::parse(run({"plan", "y.toml", "--json", "--quiet", "--frames", "1", "--set", "effect.1.acceleration=[0,0,0]", "--set",
                                     "body.1.look=\"milk\""}).out);
  const auto decides = [&](const std::string& name) {
    for (const Json& effect : plan.at("effects"))
      if (effect.at("name") == name) return effect.value("on", false) ? std::string(effect.at("key")) : "not " + std::string(effect.at("key"));
    return std::string("no such effect");
  };
  EXPECT_EQ(decides("gravity"), "not effect.1.acceleration");
  EXPECT_EQ(decides("moving colliders"), "collider.mover.velocity");
  EXPECT_EQ(decides("milkiness"), "look.milk.scattering");
  EXPECT_EQ(decides("depth of field"), "not camera.aperture");
  EXPECT_EQ(decides("diffuse"), "look");   // the ground's, which comes with the program
}

TEST_F(PlanCommand, MeasuresOnceAndRemembersHowFarOffItWas) {
  EXPECT_NE(run({"plan", "x.toml"}).err.find("measuring small runs"), std::string::npos);
  const Outcome again = run({"plan", "x.toml", "--set", "render.width=80"});
  EXPECT_EQ(again.err, "") << "other sizes need no new measurement";
  std::filesystem::create_directories(folder / "out/x");
  write("out/x/notes.txt", std::string(20'000'000, 'x'));   // somebody's, and foretold by nobody
  const Outcome told = run({"run", "x.toml"});
  EXPECT_TRUE(has(told.out, "\nplan +liquid, linear kernel, 8 modes; off: .*; 172 B a particle, .* of CPU, [0-9.]+ MB\n")) << told.out;
  EXPECT_TRUE(
      has(run({"plan", "x.toml"}).out, "earlier predictions were off by CPU [0-9]+ %, memory [0-9]+ %, disk [0-9]+ % \\(median of 1 run\\)\n"));
  EXPECT_LT(Json::parse(text_of(log / "cache/polypic/outcomes.json")).at("runs").at(0).at("disk"), 1e7);
}

// Steps shorter than a millionth of a frame end a run.
TEST_F(PlanCommand, SaysWhetherSmallRunsFailOrTakeTooLong) {
  write("hard.toml", "[sim]\nsolver = \"solid\"\ndimension = 2\ncell = 0.04\n[[body]]\nname = \"disk\"\n"
                     "shape = { sphere = { center = [0.5, 0.5], radius = 0.2 } }\nmaterial = { preset = \"jelly\", young = 1e17 }\n");
  EXPECT_TRUE(has(run({"plan", "hard.toml"}).out, "no prediction: a small run of this shot fails\n"));
}

TEST_F(PlanCommand, MeasuresNothingForAReaderThatIsGone) {
  const std::string line = "cd '" + folder.string() + "' && { trap '' PIPE; (while echo; do :; done) 2>/dev/null; " POLYPIC_PROGRAM
                           " plan x.toml 2>/dev/null; echo $? >code; } | true";
  EXPECT_EQ(std::system(line.c_str()), 0);
  EXPECT_EQ(text_of(folder / "code"), "0\n");
  EXPECT_FALSE(std::filesystem::exists(log / "cache/polypic"));   // where what was measured would be kept
}

TEST_F(PlanCommand, NamesTheMemoryThatARunNames) {
  const LimitedMemory of_no_machine;
  const auto with = [&](const std::string& command) {
    const std::string err = run({command, "x.toml", "--set", "sim.cell=0.0005", "--frames", "1"}).err;
    return err.substr(0, err.find(", and there are"));
  };
  const std::string before = with("plan");
  EXPECT_NE(before.find(" of memory"), std::string::npos) << before;
  EXPECT_EQ(with("run"), before);
  ASSERT_EQ(run({"plan", "x.toml", "--frames", "1"}).exit, 0);   // other sizes of the same shot: now both know what was measured
  const std::string after = with("plan");
  EXPECT_NE(after, before);
  EXPECT_EQ(with("run"), after);
}

TEST_F(PlanCommand, DrawsThePasses) {
  ASSERT_EQ(run({"plan", "x.toml", "--graph", "passes.svg"}).exit, 0);
  const std::string picture = text_of(folder / "passes.svg");
  EXPECT_TRUE(picture.starts_with("<svg ") && picture.ends_with("</svg>\n"));
  for (const std::string name : {"sort", "p2g", "pressure", "g2p", "rasterize", "trace", "surface file", "particles"})
    EXPECT_NE(picture.find(">" + name + "</text>"), std::string::npos) << name;
  for (const std::string name : {"solids", "set", "denoise", "carry"}) EXPECT_EQ(picture.find(">" + name + "</text>"), std::string::npos) << name;
  EXPECT_EQ(run({"plan", "x.toml", "--graph", "none/passes.svg"}).exit, 5);
}

TEST_F(PlanCommand, DrawsOverNothingThatTheShotIsMadeFrom) {
  const std::string shot = std::string(kSmallShot) + "\n[[set]]\nname = \"m\"\nmesh = { file = \"m.obj\" }\n";
  write("x.toml", shot);
  write("m.obj", "v 0 0 0\nv 0.3 0 0\nv 0 0.3 0.2\nf 1 2 3\n");
  const std::string mesh = text_of(folder / "m.obj");
  std::filesystem::create_symlink("x.toml", folder / "shot.svg");
  std::filesystem::create_hard_link(folder / "m.obj", folder / "mesh.svg");
  for (const auto& [graph, line] : {std::pair("x.toml", "must end in .svg"), std::pair("shot.svg", "is the shot itself"),
                                    std::pair("mesh.svg", "is a file that the shot names")}) {
    const Outcome outcome = run({"plan", "x.toml", "--graph", graph});
    EXPECT_EQ(outcome.exit, 2);
    EXPECT_EQ(outcome.err, "polypic: --graph " + std::string(graph) + ": " + line + "\n");
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_EQ(text_of(folder / "x.toml"), shot);
  EXPECT_EQ(text_of(folder / "shot.svg"), shot);
  EXPECT_EQ(text_of(folder / "mesh.svg"), mesh);
}

TEST_F(PlanCommand, RefusesWhatCannotFitBeforeItStarts) {
  const LimitedMemory of_no_machine;
  for (const std::string command : {"plan", "run", "simulate"}) {
    const Outcome outcome = run({command, "x.toml", "--set", "sim.cell=0.0005"});
    EXPECT_EQ(outcome.exit, 2) << command;
    EXPECT_EQ(outcome.complaints(), 1) << outcome.err;
    EXPECT_TRUE(has(outcome.err,
                    "^polypic: --set sim.cell=0.0005: sim\\.cell = 0\\.0005 m: needs [0-9]+ GB of memory, and there are [0-9.]+ GB "
                    "\\([0-9.]+ m would fit\\)\n$"))
        << outcome.err;
  }
  const Outcome wide = run({"run", "x.toml", "--set", "render.width=16384", "--set", "render.height=16384", "--frames", "1-900000"});
  EXPECT_EQ(wide.exit, 2);
  EXPECT_TRUE(has(wide.err, "^polypic: --set render.width=16384: render.width = 16384 pixels: needs [0-9]+ [GT]B of (memory|disk), and there are "))
      << wide.err;
  EXPECT_EQ(files(), std::vector<std::string>{"x.toml"});
  // What it says would fit is not refused by what is known for certain.
  const Json error = Json::parse(run({"plan", "x.toml", "--set", "sim.cell=0.0005", "--json"}).out)["error"];
  EXPECT_EQ(error["key"], "sim.cell");
  EXPECT_EQ(error["code"], 2);
  // ... nor by the shot: its domain is a multiple of it.
  const std::string hint = error["hint"];
  const Outcome taken = run({"plan", "x.toml", "--json", "--frames", "1", "--set", "sim.cell=" + hint.substr(0, hint.find(' '))});
  EXPECT_EQ(taken.out.find("multiple"), std::string::npos) << taken.out;
}

TEST_F(PlanCommand, ARunWithoutRenderMakesNoPictureAndNoDevice) {
  write("dry.toml", kTankOnly);
  const EmbreeCalls dry = embree_calls({"run", "dry.toml"}), drawn = embree_calls({"run", "x.toml"});
  EXPECT_EQ(dry.devices, 0);
  EXPECT_EQ(drawn.devices, 1);
  for (const char* made : {"points/points.0002.vdb", "surface/surface.0002.vdb", "run.json"})
    EXPECT_TRUE(std::filesystem::exists(folder / "out/dry" / made)) << made;
  for (const char* none : {"images", "movie.mp4", "preview"}) EXPECT_FALSE(std::filesystem::exists(folder / "out/dry" / none)) << none;
  const Json run_json = Json::parse(text_of(folder / "out/dry/run.json"));
  EXPECT_EQ(keys_of(run_json["hashes"]), (std::set<std::string>{"simulate", "surface"}));
  for (const Json& pass : run_json["plan"]["passes"]) EXPECT_NE(pass, "trace");

  const Outcome told = run({"run", "dry.toml"});
  EXPECT_TRUE(told.out.starts_with("no pictures: the shot has no [render]\n")) << told.out;
  const Outcome refused = run({"render", "dry.toml"});
  EXPECT_EQ(refused.exit, 2);
  EXPECT_EQ(refused.err,
            "polypic: dry.toml: render: the shot asks for no pictures (add [render], or --set render.width=960; --preview draws the points)\n");
  EXPECT_EQ(embree_calls({"render", "dry.toml", "--preview"}).devices, 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/dry/preview/preview.0002.png"));
  EXPECT_EQ(embree_calls({"render", "dry.toml", "--set", "render.width=64", "--set", "render.spp=1"}).devices, 1);   // asked for after all

  write("flat.toml",
        "[shot]\nframes = 2\n[sim]\ndimension = 2\ndomain = [[0, 0], [1, 1]]\ncell = 0.1\n[[body]]\nname = \"b\"\nshape = { box = [[0, 0], [0.5, "
        "0.5]] }\n");
  EXPECT_EQ(embree_calls({"run", "flat.toml"}).devices, 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/flat/points/points.0002.vdb"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out/flat/images"));
}

TEST_F(PlanCommand, AStaticColliderIsBuiltOnce) {
  write("solids.toml", kTankOnly + kBall + kPost + "[render]\nwidth = 32\nheight = 16\nspp = 1\n");
  const int one = embree_calls({"run", "solids.toml", "--frames", "1", "--out", "one"}).geometries,
            four = embree_calls({"run", "solids.toml", "--frames", "1-4", "--out", "four"}).geometries;
  EXPECT_EQ(one, 1 + 2);           // the liquid, the ball and the post
  EXPECT_EQ(four, 4 * 1 + 2);
}

TEST_F(PlanCommand, PicturesLoadOnlyWhatTheLooksUse) {
  ASSERT_EQ(run({"run", "x.toml", "--frames", "1", "--out", "water"}).exit, 0);
  std::filesystem::remove_all(folder / "water/points");
  std::filesystem::remove_all(folder / "water/images");
  const Outcome water = run({"render", "x.toml", "--frames", "1", "--out", "water"});
  EXPECT_EQ(water.exit, 0) << "a surface is drawn from its level set alone: " << water.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "water/images/beauty.0001.png"));

  const std::vector<std::string> grains = {"--frames", "1", "--out", "grains", "--set", "body.column.look=sand"};
  const auto with = [&](const std::string& command) {
    std::vector<std::string> words = {command, "x.toml"};
    words.insert(words.end(), grains.begin(), grains.end());
    return words;
  };
  ASSERT_EQ(run(with("run")).exit, 0);
  const Json passes = Json::parse(text_of(folder / "grains/run.json"))["frames"][0]["passes"];
  EXPECT_TRUE(passes.contains("trace"));
  EXPECT_FALSE(passes.contains("mesh")) << "grains are drawn, and the level set is read";
  std::filesystem::remove_all(folder / "grains/points");
  std::filesystem::remove_all(folder / "grains/images");
  EXPECT_EQ(run(with("render")).exit, 2) << "grains are drawn from the points, which are gone";
}
