// Problems with known answers: what they say agrees with what was measured independently, and where the energy went adds up.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "app/study/problem_shot.h"
#include "base/error.h"
#include "sim/simulation.h"

namespace {

using namespace app;

sim::ProblemResult solve(const std::string& name, const std::vector<std::string>& sets, base::Ledger& ledger) {
  const sim::ProblemRow* const row = sim::find_problem(name);
  if (!row) throw std::runtime_error("no problem " + name);
  const ProblemShot read = read_problem(*row, {.quality = {}, .sets = sets});
  return read.problem->run(read.shot.scene, ledger);
}

sim::ProblemResult solve(const std::string& name, const std::vector<std::string>& sets) {
  base::Ledger ledger;
  return solve(name, sets, ledger);
}

std::vector<std::string> quadratic(const std::string& transfer, const std::string& modes, std::vector<std::string> more) {
  more.insert(more.end(), {"sim.kernel=quadratic", "sim.transfer=" + transfer});
  if (!modes.empty()) more.push_back("sim.modes=" + modes);
  return more;
}

double energy_kept(const std::vector<std::string>& sets) { return solve("taylor_green_2d", sets).energy.back(); }

const std::vector<std::string> kEight = {"problem.waves=8", "problem.time=1"};

double sum_of(const std::map<std::string, double>& changes) {
  return std::accumulate(changes.begin(), changes.end(), 0.0, [](double sum, const auto& c) { return sum + c.second; });
}

// Rows of an independent reference in double precision; seeds change them by .003.
TEST(CostProblems, TaylorGreenAgreesWithAnIndependentReference) {
  struct Row {
    const char *transfer, *modes;
    double energy, error;
  };
  for (const Row& row : {Row{"pic", "", .349, .410}, {"flip", "", .873, .068}, {"apic", "", .892, .058}, {"polypic", "4", .895, .057}, {"polypic", "9", .892, .058}}) {
    const sim::ProblemResult r = solve("taylor_green_2d", quadratic(row.transfer, row.modes, {}));
    EXPECT_NEAR(r.energy.back(), row.energy, .01) << row.transfer << row.modes;
    EXPECT_NEAR(*r.errors.energy, 1 - row.energy, .01) << row.transfer << row.modes;
    EXPECT_NEAR(*r.errors.velocity, row.error, .01) << row.transfer << row.modes;
    EXPECT_EQ(r.time.size(), std::size_t(r.steps) + 1);
  }
  for (const Row& row : {Row{"flip", "", .171, 0}, {"apic", "", .140, 0}, {"polypic", "4", .273, 0}, {"polypic", "6", .421, 0}, {"polypic", "9", .455, 0}})
    EXPECT_NEAR(energy_kept(quadratic(row.transfer, row.modes, kEight)), row.energy, .01) << row.transfer << row.modes;
  std::vector<std::string> reflected = kEight;
  reflected.push_back("sim.splitting=reflection");
  EXPECT_NEAR(energy_kept(quadratic("polypic", "9", reflected)), .838, .01);
}

TEST(CostProblems, EveryModeTakesFromTheErrorAtEightCellsAWavelength) {
  double before = 1;
  for (const auto& [transfer, modes] : {std::pair{"apic", ""}, {"polypic", "4"}, {"polypic", "6"}, {"polypic", "9"}}) {
    const double error = *solve("taylor_green_2d", quadratic(transfer, modes, kEight)).errors.energy;
    EXPECT_LT(error, before - .02) << transfer << modes;
    before = error;
  }
  EXPECT_GT(before, .4);
}

// Vortices that are carried along are the same vortices: the exact field moves with them.
TEST(CostProblems, AMovingFrameIsComparedWithAMovingAnswer) {
  const sim::ProblemResult moved = solve("taylor_green_2d", {"problem.mean=[0.3, 0.1]", "problem.time=1", "sim.splitting=reflection"});
  EXPECT_LT(*moved.errors.velocity, .02);
  EXPECT_LT(*moved.errors.energy, .02);
  EXPECT_GT(moved.steps, 20);
}

TEST(CostProblems, EveryProblemSaysWhatItMeans) {
  ASSERT_GE(sim::problem_rows().size(), 2u);
  for (const sim::ProblemRow& row : sim::problem_rows()) {
    EXPECT_FALSE(row.meaning.empty() || row.cases.empty()) << row.name;
    for (const sim::ProblemCase& c : row.cases) EXPECT_NO_THROW(read_problem(row, {.quality = {}, .sets = c.sets})) << row.name << ": " << c.name;
  }
}

// The changes of all passes are the change of the whole, of particles from the start to the end.
TEST(CostAudit, AddsUpToTheChangeOfTheWholeInAFlow) {
  for (const char* splitting : {"lie", "reflection"})
    for (const char* kernel : {"linear", "quadratic"}) {
      std::vector<std::string> sets = kEight;
      sets.insert(sets.end(), {"sim.audit=true", std::string("sim.splitting=") + splitting, std::string("sim.kernel=") + kernel});
      const sim::ProblemResult r = solve("taylor_green_2d", sets);
      EXPECT_LT(sum_of(r.energy_changes), -.1) << splitting << kernel;
      EXPECT_NEAR(sum_of(r.energy_changes), r.particle_energy - 1, 1e-9) << splitting << kernel;
      EXPECT_LT(r.energy_changes.at("pressure"), 0) << splitting << kernel;
      EXPECT_EQ(r.energy_changes.contains("reflect"), std::string(splitting) == "reflection");
    }
}

sim::Scene tank() {
  sim::Scene scene;
  scene.options.dimension = 2;
  scene.options.domain = {base::Vec3(0, 0, 0), base::Vec3(1, 0.5, 0)};
  scene.options.cell = 0.02;
  scene.options.particles_per_cell = 4;
  scene.options.kernel = sim::Kernel::quadratic;
  scene.options.carry = sim::Carry::hybrid;
  sim::Body column;
  column.name = "column";
  column.shape.box = base::Box{base::Vec3(0, 0, 0), base::Vec3(0.3, 0.4, 0)};
  scene.bodies = {column};
  scene.effects = {sim::Effect{.acceleration = base::Vec3(0, -9.81, 0)}};
  return scene;
}

TEST(CostAudit, AddsUpInADamBreakAndChangesNoBit) {
  for (const sim::Splitting splitting : {sim::Splitting::lie, sim::Splitting::reflection}) {
    sim::Scene scene = tank();
    scene.options.splitting = splitting;
    const auto plain = sim::make_simulation(scene, 24);
    scene.options.audit = true;
    const auto audited = sim::make_simulation(scene, 24);
    base::Ledger ledger, unused;
    double largest = 0;
    for (int f = 0; f < 12; ++f) {
      const sim::Totals before = audited->totals();
      audited->advance(ledger, {}), plain->advance(unused, {});
      const sim::Totals now = audited->totals();
      const double change = now.kinetic_energy + now.potential_energy - before.kinetic_energy - before.potential_energy;
      double sum = 0;
      for (const auto& [stage, part] : now.energy_changes) sum += part;
      EXPECT_NEAR(sum, change, 1e-6 * before.potential_energy) << f;
      largest = std::max(largest, std::abs(change) / before.potential_energy);
    }
    EXPECT_GT(largest, 1e-3);
    EXPECT_EQ(audited->totals().state_hash, plain->totals().state_hash);
    EXPECT_TRUE(plain->totals().energy_changes.empty());
    EXPECT_TRUE(ledger.passes().contains("audit"));
    EXPECT_FALSE(unused.passes().contains("audit"));
    for (const char* stage : {"p2g", "forces", "pressure", "extrapolate", "g2p", "volume", "advect", "collide", "carry"})
      EXPECT_TRUE(audited->totals().energy_changes.contains(stage)) << stage;
  }
}

}  // namespace
