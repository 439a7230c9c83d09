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
  app::Folder make(const app::Shot& shot, const std::string& out, std::int64_t frames = 2) {
    base::Progress quiet(stderr, /*quiet=*/true);
    app::make_film(shot, {.stages = app::stages_of(shot), .frames = app::FrameRange{1, frames}, .out = folder / out, .restart = true, .threads = 2}, quiet);
    return app::Folder(folder / out);
  }
  std::vector<std::uint64_t> state_hashes(const app::Shot& shot, const std::string& out) {
    const app::Folder made = make(shot, out);
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
    for (const base::Attribute& a : sim::plan_of(shot.scene).attributes) planned[a.name] = a.bytes * record.totals->particles;
    EXPECT_FALSE(held.empty());
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
    if (shot.scene.options.dimension == 3) small.sets.push_back("render.spp=1");
    expect_agreement(app::read_shot(file, small), shot.name);
  }
}

TEST_F(PlanLedger, GravityWithoutStrengthGivesTheBitsOfNone) {
  const std::vector<std::string> moving = {"body.water.velocity=[1,0.3,0.5]"};
  const auto never = state_hashes(read(kTank, moving), "never");
  auto off = moving;
  off.push_back("effect.1.acceleration=[0,0,0]");
  EXPECT_EQ(state_hashes(read(kTank + kGravity, off), "off"), never);
  EXPECT_NE(state_hashes(read(kTank + kGravity, moving), "on"), never);
}

TEST_F(PlanLedger, ColliderThatNothingReachesGivesTheBitsOfNone) {
  const std::vector<std::string> moving = {"body.water.velocity=[1,0.3,0.5]"};
  auto off = moving;
  off.push_back("collider.ball.shape.sphere.center=[50,50,50]");
  EXPECT_EQ(state_hashes(read(kTank + kBall, off), "off"), state_hashes(read(kTank, moving), "never"));
}

TEST_F(PlanLedger, BodyWithoutParticlesGivesTheBitsOfNone) {
  const std::string hidden = "[[body]]\nname = \"hidden\"\nshape = { box = [[0.1, 0.1, 0.1], [0.3, 0.3, 0.15]] }\nvelocity = [9, 9, 9]\n";
  EXPECT_EQ(state_hashes(read(kTank + kGravity + hidden), "off"), state_hashes(read(kTank + kGravity), "never"));
}

TEST_F(PlanLedger, TimeLimitThatIsNotReachedGivesThePixelsOfNone) {
  const app::Folder never = make(read(kTank), "never", 1), off = make(read(kTank, {"render.time_limit=100000"}), "off", 1);
  EXPECT_EQ(render::compare(render::read_image(never.image(1, ".exr")), render::read_image(off.image(1, ".exr")), 0).pixels_over, 0u);
}
