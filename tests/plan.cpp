// The tables of effects: complete, and true of the source. What runs is compared with what is planned in plan_ledger.cpp.
#include "app/plan/plan.h"

#include <filesystem>
#include <map>
#include <regex>
#include <set>

#include "base/atomic_file.h"
#include "plan_shots.h"
#include "render/plan.h"
#include "shot_file.h"
#include "sim/plan.h"
#include "sim/simulation.h"
#include "sim/size.h"
#include "surface/plan.h"

namespace {

namespace fs = std::filesystem;

bool lies_under(const std::string& table, const std::string& key) {
  const auto a = app::parts_of(table), b = app::parts_of(key);
  return a.size() <= b.size() && std::equal(a.begin(), a.end(), b.begin());
}

bool any_row_has(const std::string& key, const std::string& choice) {
  for (const app::Row& row : app::all_rows())
    for (const std::string_view k : row.keys) {
      const std::string text(k), own = text.substr(0, text.find('='));
      if (lies_under(own, key) && (choice.empty() || text == own + "=" + choice)) return true;
    }
  return false;
}

/// "a", "b" or "c" -> a, b, c.
std::vector<std::string> choices_of(const app::KeyRow& row) {
  std::vector<std::string> choices;
  static const std::regex quoted("\"([^\"]*)\"");
  for (std::sregex_iterator i(row.allowed.begin(), row.allowed.end(), quoted), end; i != end; ++i) choices.push_back((*i)[1]);
  return choices;
}

/// Names in `ledger.pass("NAME"` below a folder.
std::set<std::string> passes_in_source() {
  std::set<std::string> names;
  static const std::regex call("\\.pass\\(\"([a-z0-9_]+)\"");
  for (const std::string folder : {"sim", "surface", "render", "app"})
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(POLYPIC_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".cpp" && entry.path().extension() != ".h") continue;
      const std::string text = base::read_file(entry.path());
      for (std::sregex_iterator i(text.begin(), text.end(), call), end; i != end; ++i) names.insert((*i)[1]);
    }
  return names;
}

class Plan : public ShotFile {
 protected:
  std::set<std::string> on(const app::Shot& shot) const {
    std::set<std::string> names;
    for (const app::ExplainedEffect& e : app::explained_effects(shot))
      if (e.on) names.insert(e.name);
    return names;
  }
  std::map<std::string, std::int64_t> attributes(const app::Shot& shot) const {
    std::map<std::string, std::int64_t> bytes;
    for (const base::Attribute& a : sim::plan_of(shot.scene).attributes) bytes[a.name] = a.bytes;
    return bytes;
  }
  std::vector<app::Shot> all_shots() const {
    std::vector<app::Shot> shots;
    for (const fs::path& file : app::shipped_shots()) shots.push_back(app::read_shot(file, {}));
    for (const SmallShot& small : small_shots()) shots.push_back(read(small.text, small.sets));
    return shots;
  }
};

}  // namespace

TEST_F(Plan, EveryKeyOfAShotBelongsToARow) {
  ASSERT_GT(app::all_keys().size(), 80u);
  for (const app::KeyRow& row : app::all_keys())
    EXPECT_TRUE(any_row_has(row.key, "")) << row.key << ": no effect has it (docs/architecture.md, Effects)";
}

TEST_F(Plan, EveryChoiceOfAKeyMeansARow) {
  const std::set<std::string> kNoEffect = {"shot.up", "shot.quality", "body.NAME.material.preset"};   // rungs and axes are other keys' values
  int choices = 0;
  for (const app::KeyRow& row : app::all_keys())
    if (!kNoEffect.contains(row.key))
      for (const std::string& choice : choices_of(row)) {
        ++choices;
        EXPECT_TRUE(any_row_has(row.key, choice)) << row.key << " = " << choice << ": no effect means it (docs/architecture.md, Effects)";
      }
  EXPECT_GT(choices, 40);
}

TEST_F(Plan, KeysOfRowsAreDeclared) {
  for (const app::Row& row : app::all_rows())
    for (const std::string_view key : row.keys) {
      const std::string own(key.substr(0, key.find('=')));
      const auto keys = app::all_keys();
      EXPECT_TRUE(std::any_of(keys.begin(), keys.end(), [&](const app::KeyRow& k) { return lies_under(own, k.key); })) << row.name << ": " << key;
    }
}

TEST_F(Plan, NamesOfEffectsAreUnique) {
  std::set<std::string> names;
  for (const app::Row& row : app::all_rows()) EXPECT_TRUE(names.insert(row.name).second) << row.name;
}

TEST_F(Plan, EveryPassOfTheSourceHasARowAndEveryRowAPass) {
  const std::set<std::string> source = passes_in_source(), planned = app::all_passes();
  EXPECT_GT(source.size(), 15u);
  EXPECT_EQ(source, planned);
  const std::string page = base::read_file(fs::path(POLYPIC_SOURCE_DIR) / "docs/files.md");
  for (const std::string& name : planned)
    EXPECT_TRUE(std::regex_search(page, std::regex("\\b" + name + "\\b"))) << name << " is not described in docs/files.md";
}

TEST_F(Plan, RowsNamePassesThatThereAreAndWhatTheyReadIsSomewhereWritten) {
  const std::set<std::string> passes = app::all_passes();
  std::set<std::string_view> data = {"particles", "solids", "set"};
  for (const auto& table : {sim::pass_rows(), sim::solid_pass_rows(), surface::points_pass_rows(), surface::pass_rows(), render::pass_rows()})
    for (const base::PassRow& pass : table) data.insert(pass.writes.begin(), pass.writes.end());
  for (const app::Row& row : app::all_rows())
    for (const std::string_view name : row.passes) {
      const std::size_t end = std::min(name.find('<'), name.size());
      EXPECT_TRUE(passes.contains(std::string(name.substr(0, end)))) << row.name << ": " << name;
      EXPECT_TRUE(end == name.size() || data.contains(name.substr(end + 1))) << row.name << ": " << name;
    }
}

TEST_F(Plan, EveryEffectIsOnInAShotAndOffInAnother) {
  const std::set<std::string> kAlways = {"liquid", "points file", "film", "checkpoints"};   // there is nothing else yet
  std::map<std::string, int> times;
  const std::vector<app::Shot> shots = all_shots();
  for (const app::Shot& shot : shots)
    for (const app::ExplainedEffect& e : app::explained_effects(shot)) times[e.name] += e.on;
  EXPECT_EQ(times.size(), app::all_rows().size());
  for (const auto& [name, count] : times) {
    EXPECT_TRUE(count > 0) << name << " is on in no shot: add one to tests/plan_shots.h";
    EXPECT_TRUE(count < int(shots.size()) || kAlways.contains(name)) << name << " is off in no shot";
  }
}

TEST_F(Plan, PassesReadWhatAPassBeforeHasWritten) {
  for (const app::Shot& shot : all_shots()) {
    std::set<std::string_view> there = {"particles", "solids", "set", "departures"};   // seeded, of the shot, or kept beside the passes
    for (const app::Stage stage : app::stages_of(shot))
      for (const base::PassRow& pass : app::plan_of(shot, stage).passes) {
        for (const std::string_view name : pass.reads) EXPECT_TRUE(there.contains(name)) << pass.name << " reads " << name;
        there.insert(pass.writes.begin(), pass.writes.end());
      }
  }
}

// What a pass reads because of an effect it does not read without it.
TEST_F(Plan, WhatIsNotThereIsNotRead) {
  std::map<std::string_view, int> readers;
  for (const app::Shot& shot : all_shots())
    for (const app::Stage stage : app::stages_of(shot))
      for (const base::PassRow& pass : app::plan_of(shot, stage).passes)
        for (const std::string_view name : pass.reads) {
          const bool is_there = name == "solids" ? !shot.scene.colliders.empty()
                                : name == "set" ? !shot.render.sets.empty()
                                : name == "mesh" ? shot.render.draws_surface()
                                : pass.name != "bvh" || name != "points file" || shot.render.draws_grains();
          EXPECT_TRUE(is_there) << shot.resolved << ": " << pass.name << " reads " << name;
          ++readers[name];
        }
  for (const std::string_view name : {"solids", "set", "mesh", "points file"}) EXPECT_GT(readers[name], 0) << name;
}

TEST_F(Plan, ALiquidCarriesNothingElastic) {
  const std::set<std::string> kOfLiquids = {"cell", "offset", "id", "coefficients", "order", "departures", "pressure"};
  const std::set<std::string_view> kPassesOfLiquids = {"sort", "p2g", "sums", "forces", "pressure", "reflect", "extrapolate", "volume", "g2p",
                                                       "advect", "source", "collide", "carry", "audit", "watch"};
  int liquids = 0, solids = 0;
  for (const app::Shot& shot : all_shots()) {
    const bool liquid = shot.scene.options.solver == "fluid";
    bool foreign = false;   // anything that no liquid has: F, SVD, Newton, stress, whatever comes
    for (const auto& [name, bytes] : attributes(shot)) foreign = foreign || !kOfLiquids.contains(name);
    for (const base::PassRow& pass : sim::plan_of(shot.scene).passes) foreign = foreign || !kPassesOfLiquids.contains(pass.name);
    EXPECT_EQ(foreign, !liquid) << shot.resolved;
    ++(liquid ? liquids : solids);
  }
  EXPECT_GT(liquids, 30);
  EXPECT_GT(solids, 5);
}

TEST_F(Plan, WithoutRenderThereAreNoPictures) {
  const std::string tank = kTank.substr(0, kTank.find("[render]"));
  const app::Shot shot = read(tank);
  EXPECT_EQ(app::stages_of(shot), (std::vector{app::Stage::simulate, app::Stage::surface}));
  EXPECT_TRUE(app::plan_of(shot, app::Stage::render).passes.empty());
  for (const app::ExplainedEffect& e : app::explained_effects(shot)) {
    if (e.stage != "render") continue;
    EXPECT_FALSE(e.on) << e.name;
    EXPECT_EQ(e.key, "render") << e.name;
    EXPECT_EQ(e.value, "") << e.name;
  }
  EXPECT_NE(app::plan_line(shot).find("off: pictures, "), std::string::npos) << app::plan_line(shot);
  EXPECT_EQ(shot.resolved.find("[render]"), std::string::npos) << "a rung's samples ask for no picture";
  EXPECT_TRUE(read(tank, {"render.width=32"}).has_pictures);
  EXPECT_FALSE(read(tank + "[quality.draft.render]\nwidth = 32\n").has_pictures);
  EXPECT_TRUE(read(tank + "[quality.draft.render]\nwidth = 32\n", {}, "draft").has_pictures);
  for (const std::string& empty : {tank + "[render]\n", kFlatTank.substr(0, kFlatTank.find("[render]")) + "[render]\n"}) {
    const app::Shot asks = read(empty);
    EXPECT_TRUE(asks.has_pictures);
    EXPECT_TRUE(read(asks.resolved).has_pictures) << asks.resolved;
    EXPECT_TRUE(app::is_resolved(asks.resolved));
  }
}

TEST_F(Plan, LineSaysWhatIsSolved) {
  EXPECT_TRUE(app::plan_line(read(kTank)).starts_with("liquid, linear kernel, 8 modes; off: "));
  EXPECT_TRUE(app::plan_line(read(kBlock)).starts_with("solid, quadratic kernel, 8 modes; off: "));
  EXPECT_TRUE(app::plan_line(read(kBlock, {"shot.quality=high"})).starts_with("solid, quadratic kernel, 27 modes; off: "));
  EXPECT_TRUE(app::plan_line(read(kBlock, {"body.block.transfer=apic"})).starts_with("solid, quadratic kernel, 4 modes; off: "));
}

TEST_F(Plan, ApicStoresNoPolynomialCoefficient) {
  for (const std::string kernel : {"linear", "quadratic"}) {
    const auto three = attributes(read(kTank, {"sim.transfer=apic", "sim.kernel=" + kernel})),
               two = attributes(read(kFlatTank, {"sim.transfer=apic", "sim.kernel=" + kernel}));
    EXPECT_EQ(three.at("coefficients"), 3 * (1 + 3) * 4);   // a constant and a gradient for each component
    EXPECT_EQ(two.at("coefficients"), 2 * (1 + 2) * 4);
  }
  EXPECT_EQ(attributes(read(kTank, {"sim.transfer=pic"})).at("coefficients"), 3 * 4);
  EXPECT_EQ(attributes(read(kTank, {"sim.transfer=flip"})).at("coefficients"), 3 * 4);
  EXPECT_EQ(attributes(read(kTank, {"sim.kernel=quadratic"})).at("coefficients"), 3 * 27 * 4);
  EXPECT_EQ(attributes(read(kTank, {"sim.kernel=quadratic", "sim.precision=double"})).at("coefficients"), 3 * 27 * 8);
}

TEST_F(Plan, NamesTheKeyThatDecidesAndItsValue) {
  const auto effect = [](const app::Shot& shot, const std::string& name) {
    for (const app::ExplainedEffect& e : app::explained_effects(shot))
      if (e.name == name) return e;
    return app::ExplainedEffect{};
  };
  const app::Shot shot = read(kTank + kGravity + kBall, {"sim.transfer=flip"});
  EXPECT_EQ(effect(shot, "flip").key, "sim.transfer");
  EXPECT_EQ(effect(shot, "flip").value, "\"flip\"");
  EXPECT_FALSE(effect(shot, "polypic").on);
  EXPECT_EQ(effect(shot, "polypic").value, "\"flip\"");
  EXPECT_EQ(effect(shot, "gravity").key, "effect.1.acceleration");
  EXPECT_EQ(effect(shot, "colliders").key, "collider.ball.name");
  EXPECT_EQ(effect(shot, "double precision").value, "\"single\"");
  EXPECT_EQ(effect(shot, "surface in pictures").key, "body.water.material.preset");   // no look is named: that of the material
  EXPECT_EQ(effect(read(kTank, {"body.water.look=sand"}), "grains in pictures").key, "body.water.look");
  const app::Shot block = read(kBlock, {"body.block.transfer=pic"});
  EXPECT_EQ(effect(block, "pic").key, "body.block.transfer");
  EXPECT_EQ(effect(block, "hybrid carry of solids").key, "sim.carry");
  const app::ExplainedEffect none = effect(read(kTank), "colliders");
  EXPECT_FALSE(none.on);
  EXPECT_EQ(none.key, "collider");
  EXPECT_EQ(none.value, "");
}

TEST_F(Plan, GravityWithoutStrengthIsOff) {
  EXPECT_TRUE(on(read(kTank + kGravity)).contains("gravity"));
  EXPECT_FALSE(on(read(kTank + kGravity, {"effect.1.acceleration=[0,0,0]"})).contains("gravity"));
  EXPECT_FALSE(on(read(kTank + kGravity + kGravity, {"effect.1.acceleration=[0,0,1]", "effect.2.acceleration=[0,0,-1]"})).contains("gravity"));
}

TEST_F(Plan, SizeIsThatOfTheSeeding) {
  for (const app::Shot& shot : all_shots()) {
    if (shot.scene.options.cell < 0.02) continue;   // as large a scene says no more
    const double seeded = double(sim::make_simulation(shot.scene, shot.fps)->frame().id.size());
    ASSERT_GT(seeded, 0);
    const bool regular = shot.scene.options.seeding == sim::Seeding::regular;
    const double noise = 3 + 4 * std::cbrt(seeded);   // of jitter: boxes at the surface of a body are in it by chance
    EXPECT_NEAR(sim::size_of(shot.scene).particles, seeded, regular ? 0.5 : noise) << shot.name << shot.resolved;
  }
}
