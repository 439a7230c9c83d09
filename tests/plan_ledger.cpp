// Small shots, run from end to end inside the test: what ran is what was planned, and what is not asked for changes no bit.
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "app/plan/plan.h"
#include "app/stages/film.h"
#include "app/stages/record.h"
#include "base/atomic_file.h"
#include "base/progress.h"
#include "plan_shots.h"
#include "render/render.h"
#include "shot_file.h"
#include "sim/plan.h"
#include "surface/surface.h"

namespace {

class PlanLedger : public ShotFile {
 protected:
  static void SetUpTestSuite() { surface::initialize(); }

  void SetUp() override {
    base::write_text_atomically(folder / "piece.obj", kPiece);
    base::Ledger untold;
    render::Image grey{.width = 4, .height = 2, .channels = {"R", "G", "B"}, .pixels = std::vector<float>(24, 0.5f)};
    render::write_png(folder / "sky.png", grey, {}, /*display_referred=*/true, untold);
  }
  app::Folder make(const app::Shot& shot, const std::string& out, std::int64_t frames = 2, std::vector<app::Stage> stages = {}) {
    base::Progress quiet(stderr, /*quiet=*/true);
    app::make_film(shot,
                   {.stages = stages.empty() ? app::stages_of(shot) : stages, .frames = app::FrameRange{1, frames}, .out = folder / out,
                    .restart = true, .threads = 2},
                   quiet);
    return app::Folder(folder / out);
  }
  std::vector<std::uint64_t> state_hashes(const app::Shot& shot, const std::string& out) {
    const app::Folder made = make(shot, out, 2, {app::Stage::simulate});
    std::vector<std::uint64_t> hashes;
    for (const std::int64_t frame : {1, 2}) hashes.push_back(app::read_record(made, app::Stage::simulate, frame).value().totals.value().state_hash);
    EXPECT_NE(hashes[0], hashes[1]);   // something moved
    return hashes;
  }
  // What two frames ran and held, against what was planned.
  void expect_agreement(const app::Shot& shot, const std::string& name) {
    const app::Folder made = make(shot, name);
    for (const app::Stage stage : app::stages_of(shot)) {
      std::set<std::string> ran, planned;
      for (const std::int64_t frame : {1, 2}) {
        const auto record = app::read_record(made, stage, frame);
        ASSERT_TRUE(record) << name;
        for (const auto& [pass, cost] : record->passes) {
          ran.insert(pass);
          EXPECT_GT(cost.calls, 0) << name << ": " << pass;
          EXPECT_GT(cost.bytes, 0) << name << ": " << pass;
        }
        if (stage == app::Stage::simulate) expect_held(shot, *record, name);
      }
      for (const base::PassRow& pass : app::plan_of(shot, stage).passes) planned.insert(std::string(pass.name));
      EXPECT_EQ(ran, planned) << name << ", " << app::stage_name(stage);
    }
  }
  static void expect_held(const app::Shot& shot, const app::Record& record, const std::string& name) {
    std::map<std::string, std::int64_t> held, planned;
    for (const auto& [attribute, bytes] : record.attributes) held[attribute] = bytes;
    for (const base::Attribute& a : sim::plan_of(shot.scene).attributes)
      if (a.is_state || record.totals->substeps > 0) planned[a.name] = a.bytes * record.totals->particles;   // passes have arrays when they have run
    EXPECT_FALSE(held.empty());
    for (const base::Attribute& a : sim::plan_of(shot.scene).attributes) {
      // An array of a pass still holds who left the domain in the last step, and not yet who was poured.
      if (a.is_state || (record.totals->left == 0 && record.totals->poured == 0)) continue;
      EXPECT_GE(held[a.name], planned[a.name] - a.bytes * record.totals->poured) << name;
      EXPECT_LE(held[a.name], planned[a.name] + a.bytes * record.totals->left) << name;
      EXPECT_EQ(held[a.name] % a.bytes, 0) << name;
      planned[a.name] = held[a.name];
    }
    EXPECT_EQ(held, planned) << name;
  }
};

}  // namespace

TEST_F(PlanLedger, AgreeOverSmallShots) {
  const std::vector<SmallShot> shots = small_shots();
  EXPECT_GE(shots.size(), 30u);
  for (const SmallShot& small : shots) expect_agreement(read(small.text, small.sets), small.name);
}

TEST_F(PlanLedger, AgreeOverShippedShots) {
  const auto shots = app::shipped_shots();
  ASSERT_FALSE(shots.empty());
  for (const auto& file : shots) {
    app::Overrides small{.quality = "draft", .sets = {"render.width=64", "render.height=36", "shot.checkpoint_every=2"}};
    const app::Shot shot = app::read_shot(file, small);
    if (shot.scene.options.dimension == 3) small.sets.push_back("render.spp=2");
    expect_agreement(app::read_shot(file, small), shot.name);
  }
}

namespace {

/// An effect that has a strength: `never` is a shot without it, `text` and `zero` one that has it with none, `on` one where it acts.
struct Strength {
  std::string name, never, text;
  std::string zero, on;
  std::vector<std::string> sets = {};
};

std::vector<Strength> strengths() {
  const std::string pull = "effect.1.acceleration=", floor = "[[collider]]\nname = \"ramp\"\nshape = { box = [[0, 0, 0], [0.8, 0.4, 0.11]] }\n";
  const std::vector<std::string> moving = {"body.water.velocity=[1,0.3,0.5]"}, sliding = {"body.block.velocity=[1,0.2,0]"};
  return {
      {"gravity", kTank, kTank + kGravity, pull + "[0,0,0]", pull + "[0,0,-9.81]", moving},
      {"gravity_of_reflection", kTank, kTank + kGravity, pull + "[0,0,0]", pull + "[0,0,-9.81]",
       {"body.water.velocity=[1,0.3,0.5]", "sim.splitting=reflection"}},
      {"gravity_of_flip", kTank, kTank + kGravity, pull + "[0,0,0]", pull + "[0,0,-9.81]", {"body.water.velocity=[1,0.3,0.5]", "sim.transfer=flip"}},
      {"gravity_in_the_plane", kFlatTank, kFlatTank + kGravity, pull + "[0,0]", pull + "[0,-9.81]", {"body.water.velocity=[1,0.3]"}},
      {"gravity_of_solids", kBlock, kBlock + kGravity, pull + "[0,0,0]", pull + "[0,0,-9.81]", sliding},
      {"spin", kBlock + kGravity, kBlock + kGravity, "body.block.spin=[0,0,0]", "body.block.spin=[0,0,9]", sliding},
      {"friction_of_walls", kBlock + kGravity, kBlock + kGravity, "sim.boundary.friction=0", "sim.boundary.friction=0.5", sliding},
      {"friction_of_colliders", kBlock + kGravity + floor, kBlock + kGravity + floor, "collider.ramp.friction=0", "collider.ramp.friction=0.5",
       sliding},
      {"volume_averaging", kBlock + kGravity, kBlock + kGravity, "body.block.material={volume_averaging=false}",
       "body.block.material={volume_averaging=true}", sliding},
      {"cohesion", kBlock + kGravity, kBlock + kGravity, "body.block.material={preset=\"dry_sand\",cohesion=0}",
       "body.block.material={preset=\"dry_sand\",cohesion=1000}",
       {"body.block.velocity=[1,0.2,0]", "body.block.material=dry_sand"}},
      {"hardening", kBlock + kGravity, kBlock + kGravity,
       "body.block.material={model=\"hencky\",plasticity=\"von_mises\",yield_stress=1,hardening_modulus=0}",
       "body.block.material={model=\"hencky\",plasticity=\"von_mises\",yield_stress=1,hardening_modulus=1e5}",
       {"body.block.velocity=[1,0.2,0]", "body.block.material={model=\"hencky\",plasticity=\"von_mises\",yield_stress=1}"}},
  };
}

std::vector<std::string> with(std::vector<std::string> sets, const std::string& one) {
  sets.push_back(one);
  return sets;
}

}  // namespace

TEST_F(PlanLedger, WhatHasNoStrengthGivesTheBitsOfNever) {
  for (const Strength& s : strengths()) {
    const app::Shot never = read(s.never, s.sets), zero = read(s.text, with(s.sets, s.zero)), on = read(s.text, with(s.sets, s.on));
    const auto bits = state_hashes(never, s.name + "_never");
    EXPECT_EQ(state_hashes(zero, s.name + "_zero"), bits) << s.name;
    EXPECT_NE(state_hashes(on, s.name + "_on"), bits) << s.name << ": with a strength it changes nothing";
    const auto names = [](const app::Shot& shot) {
      std::vector<std::string> all;
      for (const app::ExplainedEffect& e : app::explained_effects(shot))
        if (e.on) all.push_back(e.name);
      for (const base::PassRow& pass : app::plan_of(shot, app::Stage::simulate).passes) all.emplace_back(pass.name);
      return all;
    };
    EXPECT_EQ(names(zero), names(never)) << s.name;
  }
}

TEST_F(PlanLedger, WhatHasNoStrengthGivesThePixelsOfNever) {
  const std::vector<std::string> special = {"body.water.look=special"};
  const std::string glass = kTank + look("model = \"dielectric\"\n");
  const std::vector<Strength> table = {
      {"milkiness", glass, glass, "look.special.scattering=[0,0,0]", "look.special.scattering=[20,20,20]", special},
      {"absorption", glass, glass, "look.special.absorption=[0,0,0]", "look.special.absorption=[20,20,20]", special},
      {"exposure", kTank, kTank, "render.exposure=0", "render.exposure=1"},
      {"roughness", glass, glass, "look.special.roughness=0", "look.special.roughness=0.5", special},
  };
  for (const Strength& s : table) {
    const auto picture = [&](const std::vector<std::string>& sets, const std::string& name) {
      return render::read_image(make(read(s.text, sets), name, 1).image(1, ".png"));
    };
    const render::Image never = picture(s.sets, s.name + "_never"), zero = picture(with(s.sets, s.zero), s.name + "_zero"),
                        on = picture(with(s.sets, s.on), s.name + "_on");
    EXPECT_EQ(render::compare(never, zero, 0).pixels_over, 0u) << s.name;
    EXPECT_GT(render::compare(never, on, 0).pixels_over, 0u) << s.name << ": with a strength it changes nothing";
  }
}

TEST_F(PlanLedger, ColliderThatNothingReachesGivesTheBitsOfNone) {
  const std::vector<std::string> moving = {"body.water.velocity=[1,0.3,0.5]"};
  auto off = moving;
  off.push_back("collider.ball.shape.sphere.center=[50,50,50]");
  EXPECT_EQ(state_hashes(read(kTank + kBall, off), "off"), state_hashes(read(kTank, moving), "never"));
}

// What passes count of bytes goes with the blocks around the particles.
TEST_F(PlanLedger, ALargerDomainCostsNothing) {
  const auto costs = [&](const std::string& domain, const std::string& name) {
    const app::Folder made =
        make(read(kTank + kGravity, {"sim.domain=" + domain, "sim.cell=0.05", "body.water.shape.box=[[1.6,1.6,1.6],[1.8,1.8,1.7]]"}), name, 2,
             {app::Stage::simulate});
    std::map<std::string, std::pair<std::int64_t, std::int64_t>> bytes;
    const auto record = app::read_record(made, app::Stage::simulate, 2);
    for (const auto& [pass, cost] : record->passes) bytes[pass] = {cost.calls, cost.bytes};
    EXPECT_GT(bytes.at("p2g").second, 0);
    return bytes;
  };
  EXPECT_EQ(costs("[[0,0,0],[4,4,4]]", "small"), costs("[[0,0,0],[4000,4000,4000]]", "large"));   // 10^9 times the cells
}

TEST_F(PlanLedger, TimeLimitThatIsNotReachedGivesThePixelsOfNone) {
  const app::Folder never = make(read(kTank), "never", 1), off = make(read(kTank, {"render.time_limit=100000"}), "off", 1);
  EXPECT_EQ(render::compare(render::read_image(never.image(1, ".exr")), render::read_image(off.image(1, ".exr")), 0).pixels_over, 0u);
}
