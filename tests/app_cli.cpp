// What the program says to a mistake: the exit code, one line, and nothing written.
#include <nlohmann/json.hpp>

#include "app/commands/request.h"
#include "base/error.h"
#include "run_program.h"

namespace {

class CommandLine : public ProgramTest {
 protected:
  /// `words` must fail with `code` and one line that holds all of `parts`, and leave the folder as it is.
  void expect_refusal(const std::vector<std::string>& words, int code, const std::vector<std::string>& parts) const {
    const std::vector<std::string> before = files();
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit, code) << outcome.err;
    EXPECT_EQ(outcome.complaints(), 1) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("polypic: ")) << outcome.err;
    for (const std::string& part : parts) EXPECT_NE(outcome.err.find(part), std::string::npos) << "no " << part << " in " << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(files(), before);
  }
  /// The small shot with one line in place of another.
  void write_changed(const std::string& from, const std::string& to) const {
    std::string text = kSmallShot;
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    write("x.toml", text.replace(at, from.size(), to));
  }
};

app::Request parse(std::vector<std::string> words) {
  std::vector<const char*> arguments = {"polypic"};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  return app::parse_command_line(static_cast<int>(arguments.size()), arguments.data());
}

/// The line a command line is refused with.
std::string refusal(const std::vector<std::string>& words) {
  try {
    parse(words);
    return "no error";
  } catch (const base::Error& e) {
    EXPECT_EQ(e.complaint().code, base::Exit::user);
    return e.what();
  }
}

}  // namespace

TEST_F(CommandLine, TakesNoDirectoryForAShot) { expect_refusal({"run", "."}, 2, {".: is a directory"}); }
TEST_F(CommandLine, NamesAShotThatIsMissing) { expect_refusal({"run", "shots/none.toml"}, 2, {"shots/none.toml: no such file"}); }

TEST_F(CommandLine, GuessesTheFileOfAShotByItsName) {
  write("mine.toml", kSmallShot);
  for (const std::string name : {"mine", "mine.tml"}) expect_refusal({"run", name}, 2, {name + ": no such file", "(did you mean mine.toml?)\n"});
}

TEST_F(CommandLine, NamesTheEntriesThereAreForOneThatIsNot) {
  write("x.toml", kSmallShot);
  expect_refusal({"run", "x.toml", "--set", "body.nobody.density=1"}, 2, {"body.nobody: no such entry (there is column)\n"});
  expect_refusal({"run", "x.toml", "--set", "light.1.kind=sun"}, 2,
                 {"light = { 1 = { kind = \"sun\" } }: must be tables, each under [[light]] (none is written; light = [{ kind = \"sun\" }] writes the first)\n"});
  expect_refusal({"run", "x.toml", "--set", "body.colum.density=1"}, 2, {"body.colum: no such entry (did you mean body.column?)\n"});
}

TEST_F(CommandLine, GivesThePlaceOfASyntaxError) {
  write_changed("fps = 24", "fps = = 24");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:4:"});
}

TEST_F(CommandLine, RefusesAnUnknownKeyWithItsPlace) {
  write_changed("fps = 24", "colour = 1");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:4:1: shot.colour: unknown key"});
}

TEST_F(CommandLine, GuessesAMisspeltKey) {
  write_changed("cell = 0.03", "cel = 0.03");
  expect_refusal({"simulate", "x.toml"}, 2, {"x.toml:8:1: sim.cel: unknown key (did you mean sim.cell?)"});
}

TEST_F(CommandLine, RefusesAWrongType) {
  write_changed("cell = 0.03", "cell = \"small\"");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:8:", "sim.cell", "small"});
}

TEST_F(CommandLine, RefusesAValueOutOfRange) {
  write_changed("cell = 0.03", "cell = -1");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:8:", "sim.cell = -1 m: must be", "above 0"});
}

TEST_F(CommandLine, NamesTheNearestCellOfADomainThatIsNoMultiple) {
  write_changed("cell = 0.03", "cell = 0.031");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:8:", "sim.cell", "0.03 m"});
}

TEST_F(CommandLine, RefusesAWordThatIsNoChoice) {
  write_changed("kernel = \"linear\"", "kernel = \"cubic\"");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:10:", "sim.kernel", "cubic", "quadratic"});
}

TEST_F(CommandLine, RefusesAShapeThatIsNeitherBoxNorSphere) {
  write_changed("shape = { box = [[0, 0, 0], [0.27, 0.3, 0.18]] }", "shape = {}");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:", "shape"});
}

TEST_F(CommandLine, RefusesAShotWithABodyThatGetsNoParticle) {
  write_changed("[[0, 0, 0], [0.27, 0.3, 0.18]]", "[[5, 5, 5], [6, 6, 6]]");
  for (const std::string command : {"run", "simulate", "plan"})
    expect_refusal({command, "x.toml"}, 2, {"x.toml:15:9: body.column.shape: no particle: it lies outside the domain\n"});
}

TEST_F(CommandLine, PutsAnOverrideInPlaceOfTheFile) {
  write("x.toml", kSmallShot);
  expect_refusal({"run", "x.toml", "--set", "sim.cell=-1"}, 2, {"--set sim.cell=-1", "above 0"});
  expect_refusal({"run", "x.toml", "--set", "nonsense"}, 2, {"--set nonsense"});
}

TEST_F(CommandLine, BlamesWhatIsFoundOutLaterOnTheOverrideToo) {
  const LimitedMemory of_no_machine;
  write("x.toml", kSmallShot);
  const auto expect_blame = [&](const std::string& set, const std::string& key) {
    expect_refusal({"run", "x.toml", "--set", set}, 2, {"polypic: --set " + set + ": " + key});
  };
  expect_blame("body.column.shape={mesh={file=\"none.obj\"}}", "body.column.shape.mesh.file: none.obj: No such file or directory\n");
  expect_blame("body.1.shape.box=[[0,0,0],[0.001,0.001,0.001]]", "body.column.shape: no particle: it is too small");
  expect_blame("sim.cell=0.0005", "sim.cell = 0.0005 m: needs ");
  expect_blame("render.width=60000", "render.width");
}

TEST_F(CommandLine, FindsWhatNoPictureCanShowBeforeItSimulates) {
  std::string glass = kSmallShot;
  for (int i = 0; i < 64; ++i)
    glass += "[[collider]]\nname = \"c" + std::to_string(i) + "\"\nshape.sphere = { center = [0.5, 0.2, 0.2], radius = 0.05 }\nlook = \"glass\"\n";
  write("x.toml", glass);
  expect_refusal({"run", "x.toml"}, 2, {"polypic: x.toml: look: 65 dielectric surfaces; at most 64 are told apart\n"});
  write("m.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1 0\nf 1 2 3\n");
  write("x.toml", std::string(kSmallShot) + "[[set]]\nname = \"far\"\nmesh = { file = \"m.obj\", scale = 1e15 }\n");
  expect_refusal({"run", "x.toml"}, 2, {"set.far.mesh.file: ", "m.obj: vertex 2 is not finite when scaled and translated\n"});
}

TEST_F(CommandLine, NamesTheKeyOfAnEnvironmentThatIsMissing) {
  write("x.toml", std::string(kSmallShot) + "\n[[light]]\nkind = \"environment\"\nfile = \"none.exr\"\n");
  expect_refusal({"run", "x.toml"}, 2, {"x.toml:28:8: light.1.file: none.exr: No such file or directory\n"});
}

TEST_F(CommandLine, RefusesAFrameRateThatNoMovieHas) {
  write("x.toml", kSmallShot);
  expect_refusal({"run", "x.toml", "--set", "shot.fps=1e300"}, 2,
                 {"--set shot.fps=1e300: shot.fps = 1e+300 1/s: must be above 0 and at most 1000000"});
}

TEST_F(CommandLine, RefusesAnUnknownRung) {
  write("x.toml", kSmallShot);
  expect_refusal({"run", "x.toml", "--quality", "best"}, 2, {"best", "draft"});
}

TEST_F(CommandLine, SaysWhyAnOutputCannotBeWritten) {
  write("x.toml", kSmallShot);
  write("taken", "a file, not a folder");
  expect_refusal({"run", "x.toml", "--out", "taken"}, 5, {"taken: Not a directory"});
  expect_refusal({"run", "x.toml", "--out", "/proc/none"}, 5, {"/proc/none: "});
}

TEST_F(CommandLine, AsksForTheStageBefore) {
  write("x.toml", kSmallShot);
  expect_refusal({"surface", "x.toml"}, 2, {"out/x/points/points.0001.vdb: no such file; run simulate first"});
  expect_refusal({"render", "x.toml"}, 2, {"out/x/surface/surface.0001.vdb: no such file; run surface first"});
  expect_refusal({"render", "x.toml", "--preview", "--frames", "7"}, 2, {"out/x/points/points.0007.vdb: no such file; run simulate first"});
}

TEST_F(CommandLine, RefusesOptionsThatAreNone) {
  write("x.toml", kSmallShot);
  expect_refusal({"fly", "x.toml"}, 2, {"fly: no such command"});
  expect_refusal({"run", "x.toml", "--fast"}, 2, {"--fast: not an option of polypic run"});
  expect_refusal({"run", "run"}, 2, {"run: no such file"});   // a shot may be called as a command is
}

TEST(Options, AreRefusedWithTheWordAndWhatIsAllowed) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"rum", "x.toml"}, "rum: no such command (did you mean run?)"},
      {{"--fast"}, "--fast: not an option of polypic"},
      {{"run"}, "SHOT is required (see polypic run --help)"},
      {{"run", "x.toml", "y.toml"}, "y.toml: is one word too many for polypic run (see polypic run --help)"},
      {{"simulate", "x.toml", "--preview"}, "--preview: not an option of polypic simulate"},
      {{"list", "--out", "x"}, "--out: not an option of polypic list"},
      {{"run", "x.toml", "--frame", "3"}, "--frame: not an option of polypic run (did you mean --frames?)"},
      {{"run", "x.toml", "--qualty=draft"}, "--qualty=draft: not an option of polypic run (did you mean --quality?)"},
      {{"plan", "x.toml", "--preview"}, "--preview: not an option of polypic plan (see polypic plan --help)"},
      {{"run", "x.toml", "--out"}, "--out: needs one value"},
      {{"run", "x.toml", "--threads", "1", "--threads", "2"}, "--threads: given twice (see polypic run --help)"},
      {{"plan", "x.toml", "--frames", "1-24", "--frames", "3"}, "--frames: given twice"},
      {{"run", "x.toml", "--threads", "1", "--threads"}, "--threads: needs one value"},
      {{"run", "x.toml", "--out", ""}, "--out: needs the name of a directory"},
      {{"diff", "a.png", "b.png", "--out", "d.jpg"}, "--out d.jpg: must end in .png"},
      {{"plan", "x.toml", "--graph", "x.toml"}, "--graph x.toml: must end in .svg"},
      {{"plan", "x.toml", "--graph", "passes"}, "--graph passes: must end in .svg"},
      {{"run", "x.toml", "--frames", "5-2"}, "--frames 5-2: ends before it begins (did you mean 2-5?)"},
      {{"cost", "p", "--single", "--vary", "sim.cell=1"}, "--vary: has no effect with --single: the problem runs once, as --set makes it"},
      {{"cost", "p", "--single", "--repeats", "3"}, "--repeats: has no effect with --single"},
      {{"cost", "p", "--single", "--frames", "1-3"}, "--frames: has no effect with --single"},
      {{"cost", "p", "--single", "--out", "x"}, "--out: has no effect with --single"},
      {{"cost", "p", "--single", "--dry-run"}, "--dry-run: has no effect with --single"},
      {{"params", "sim", "--example"}, "sim: has no effect with --example: it is a complete shot"},
      {{"params", "--example", "--json"}, "--json: has no effect with --example: a shot is TOML"},
      {{"cost", "p", "--dry-run", "--json"}, "--json: has no effect with --dry-run: nothing is measured"},
  };
  for (const auto& [words, expected] : cases) EXPECT_TRUE(refusal(words).starts_with(expected)) << refusal(words);
  for (const std::string range : {"0", "0-2", "two", "1-", "-2", "1-9999999", "1-2-3", " 1"})
    EXPECT_EQ(refusal({"run", "x.toml", "--frames=" + range}), "--frames " + range + ": must be A or A-B, from 1 to 1000000");
  for (const std::string threads : {"0", "-1", "many", "2.5", "5000"})
    EXPECT_EQ(refusal({"run", "x.toml", "--threads=" + threads}), "--threads " + threads + ": must be a whole number from 1 to 4096");
}

TEST(Options, AreReadInAnyOrder) {
  const app::Request request =
      parse({"run", "--set", "sim.cell=[1,2]", "x.toml", "--frames", "3-12", "--set=a=b c", "--threads", "2", "--quality", "draft", "--restart"});
  EXPECT_EQ(request.command, "run");
  EXPECT_EQ(request.subject, "x.toml");
  EXPECT_EQ(request.overrides.sets, (std::vector<std::string>{"sim.cell=[1,2]", "a=b c"}));
  EXPECT_EQ(request.overrides.quality, "draft");
  ASSERT_TRUE(request.frames);
  EXPECT_EQ(request.frames->first, 3);
  EXPECT_EQ(request.frames->last, 12);
  EXPECT_EQ(request.threads, 2);
  EXPECT_TRUE(request.restart);
  EXPECT_FALSE(request.out);
  EXPECT_EQ(parse({"simulate", "x.toml", "--frames", "7"}).frames->first, 7);
}

TEST_F(CommandLine, ExplainsAKeyUnderTheNameOfAnyEntryOrOfNone) {
  const std::string keys = run({"params", "body.NAME.velocity"}).out;
  EXPECT_TRUE(keys.starts_with("body.NAME.velocity ")) << keys;
  for (const std::string topic : {"body.velocity", "body.column.velocity", "body.1.velocity"}) EXPECT_EQ(run({"params", topic}).out, keys) << topic;
  EXPECT_NE(run({"params", "light.1"}).out.find("light.N.kind"), std::string::npos);
  EXPECT_TRUE(run({"params", "gravity"}).out.starts_with("effect.N.kind ")) << "the key that it is a choice of";
  expect_refusal({"params", "gravit"}, 2, {"gravit: no such key, table or problem (did you mean gravity?)\n"});
  expect_refusal({"params", "body.velocty"}, 2, {"body.velocty: no such key, table or problem (did you mean body.velocity?)\n"});
}

TEST_F(CommandLine, RefusesFilesItCannotRead) {
  write("note.txt", "words");
  write("torn.vdb", "not a grid");
  write("torn.exr", "not an image");
  write("torn.json", "{\"schema\":");
  write("other.json", "{\"schema\": 1}");
  expect_refusal({"info", "none.vdb"}, 2, {"none.vdb: No such file"});
  expect_refusal({"info", "."}, 2, {".: Is a directory\n"});
  expect_refusal({"sheet", "none"}, 2, {"none: no such run or picture\n"});
  for (const std::string name : {"note.txt", "torn.vdb", "torn.exr", "torn.json", "other.json"}) expect_refusal({"info", name}, 2, {name + ": "});
}

TEST_F(CommandLine, TellsProgramsOfAnErrorInJson) {
  write_changed("cell = 0.03", "cell = -1");
  const Outcome outcome = run({"run", "x.toml", "--json"});
  EXPECT_EQ(outcome.exit, 2);
  EXPECT_EQ(outcome.complaints(), 1);
  const auto error = nlohmann::json::parse(outcome.out).at("error");
  EXPECT_EQ(error.at("code"), 2);
  EXPECT_EQ(error.at("file"), "x.toml");
  EXPECT_EQ(error.at("line"), 8);
  EXPECT_EQ(error.at("key"), "sim.cell");
}

TEST_F(CommandLine, HelpNamesEveryCommandAndExitsWell) {
  const Outcome outcome = run({"--help"});
  EXPECT_EQ(outcome.exit, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_EQ(parse({}).text, outcome.out);
  for (const std::string command : {"run", "simulate", "surface", "render", "list", "info", "diff", "sheet", "params"}) {
    EXPECT_NE(outcome.out.find("polypic " + command), std::string::npos) << command;
    EXPECT_TRUE(parse({command, "--help"}).text.starts_with("polypic " + command)) << command;
  }
  EXPECT_TRUE(parse({"--version"}).text.starts_with("polypic "));
}

TEST_F(CommandLine, PrintsKeysByTopicAndAnExampleThatIsRead) {
  const Outcome one = run({"params", "sim.cell"});
  EXPECT_TRUE(one.out.starts_with("sim.cell")) << one.out;
  EXPECT_EQ(std::count(one.out.begin(), one.out.end(), '\n'), 1);
  const auto keys = nlohmann::json::parse(run({"params", "render", "--json"}).out).at("keys");
  ASSERT_GT(keys.size(), 3u);
  for (const auto& key : keys) EXPECT_TRUE(key.at("key").get<std::string>().starts_with("render.")) << key;
  expect_refusal({"params", "sim.cel"}, 2, {"sim.cel: ", "did you mean sim.cell?"});

  write("example.toml", run({"params", "--example"}).out);
  expect_refusal({"surface", "example.toml"}, 2, {"out/example/points/points.0001.vdb: no such file"});   // read, then asked for its points
}

TEST_F(CommandLine, ListsShotsMaterialsAndLooks) {
  const Outcome outcome = run({"list", "--json"});
  ASSERT_EQ(outcome.exit, 0) << outcome.err;
  const auto all = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(all.at("materials").at(0).at("name"), "water");
  EXPECT_FALSE(all.at("looks").empty());
  for (const auto& shot : all.at("shots")) EXPECT_NE(shot.at("description"), "") << shot;
}
