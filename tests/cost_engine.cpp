// The engine of `polypic cost`: which variants are tried, what is worth its time, how results are written.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "app/study/distance.h"
#include "app/study/front.h"
#include "app/study/measured.h"
#include "app/study/study_files.h"
#include "app/study/time_to_error.h"
#include "app/study/variants.h"
#include "base/error.h"
#include "sim/fluid/seeding.h"
#include "sim/problems/carried_flow.h"
#include "sim/watch.h"

namespace {

using namespace app;

TEST(CostVariants, AreTheCrossProductWithoutWhatSaysNothing) {
  const std::vector<Sets> all =
      combinations({parse_vary("sim.transfer=pic,apic,polypic"), parse_vary("sim.modes=4,full"), parse_vary("sim.splitting=lie,reflection")});
  EXPECT_EQ(all.size(), 2u + 2u + 4u);   // modes are polypic's alone
  for (const Sets& sets : all) EXPECT_EQ(sets.size(), sets[0].second == "polypic" ? 3u : 2u);
  EXPECT_EQ(combinations({parse_vary("sim.transfer='apic',\"polypic\""), parse_vary("sim.modes=4,full")}).size(), 1u + 2u);
  EXPECT_EQ(parse_vary("effect.1.acceleration=[0, -9.81],[0, -1.62]").values, (std::vector<std::string>{"[0, -9.81]", "[0, -1.62]"}));
  EXPECT_EQ(parse_vary("body.a.look=\"x,y\"").values.size(), 1u);
  for (const char* wrong : {"sim.cell", "=1", "sim.cell=", "sim.cell=1,,2"}) EXPECT_THROW(parse_vary(wrong), base::Error) << wrong;
}

TEST(CostVariants, AreCalledByWhatWasVaried) {
  sim::Options o;
  o.modes.count = 4, o.splitting = sim::Splitting::reflection, o.cell = 0.04;
  EXPECT_EQ(label_of(o, {{"sim.modes", "4"}}), "polypic 4 linear reflection");
  EXPECT_EQ(label_of(o, {{"sim.cfl", "2"}, {"sim.cell", "0.04"}}), "cfl 2 cell 0.04");
  o.transfer = sim::Transfer::apic, o.splitting = sim::Splitting::lie;
  EXPECT_EQ(label_of(o, {{"sim.transfer", "apic"}, {"sim.cell", "0.04"}}), "apic linear cell 0.04");
  EXPECT_EQ(label_of(o, {{"body.a.velocity", "1"}, {"body.b.velocity", "2"}, {"sim.cfl", "2"}}), "a.velocity 1 b.velocity 2 cfl 2");
}

Variant rung(const std::string& label, double error, std::vector<double> seconds) {
  Variant v;
  v.label = label, v.part = "all", v.transfer = "apic", v.kernel = "linear", v.cell = 0.1, v.cfl = 1;
  v.errors[Measure::energy] = error;
  v.seconds = std::move(seconds);
  sum_up_seconds(v);
  return v;
}

Study ladder() {
  Study study;
  study.subject = "test";
  study.cases = {{"all", Measure::energy, {}, {}}};
  study.variants = {rung("fast", .5, {1.0, 1.1, 1.02}), rung("tied", .4, {1.05, 1.0, 1.08}), rung("wasteful", .45, {3, 3.1, 3.05}),
                    rung("good", .01, {4, 4.2, 4.1}), rung("best", .008, {9, 9.5, 9.2})};
  study.variants.push_back(rung("broken", 0, {}));
  study.variants.back().failure = "g2p: particle 3 is not finite, \"they say\"";
  return study;
}

// "quick" and "middle" are ties, and so are "middle" and "slow"; "quick" and "slow" are none.
TEST(CostFront, DropsNobodyForATieThatIsDroppedItself) {
  Study study = ladder();
  study.variants = {rung("quick", .5, {1.0, 1.02, 1.04}), rung("middle", .4, {1.05, 1.2, 1.3}), rung("slow", .3, {1.25, 1.26, 1.3})};
  judge(study);
  EXPECT_EQ(study.variants[1].ties.size(), 2u);
  EXPECT_TRUE(study.variants[0].pareto);
  EXPECT_FALSE(study.variants[1].pareto);
  EXPECT_TRUE(study.variants[2].pareto);
}

TEST(CostFront, HoldsWhatNothingElseBeatsAndCallsTiesTies) {
  Study study = ladder();
  judge(study);
  std::vector<std::string> front;
  for (const Variant& v : study.variants)
    if (v.pareto) front.push_back(v.label);
  EXPECT_EQ(front, (std::vector<std::string>{"tied", "good", "best"}));   // as fast as "fast" within the spread, and nearer to the truth
  EXPECT_EQ(study.variants[0].ties, (std::vector<std::string>{"tied"}));
  EXPECT_TRUE(study.variants[3].ties.empty());
  EXPECT_DOUBLE_EQ(study.variants[0].seconds_median, 1.02);
  EXPECT_DOUBLE_EQ(study.variants[0].seconds_min, 1.0);
  const auto& said = study.cases[0].sentences;
  EXPECT_EQ(said[0], "Best value: good, with an error of energy of 0.01 in 4.1 s.");
  EXPECT_EQ(said[1], "The next rung, best, costs 2.2 times the time and leaves 0.8 of the error.");
  EXPECT_EQ(said[2], "The rung below, tied, takes 0.26 of the time and has 40 times the error.");
}

Variant refined(const std::string& scheme, const std::string& cell, double error, double seconds) {
  Variant v = rung(scheme + " cell " + cell, error, {seconds});
  v.scheme = scheme;
  return v;
}

// Both take 8 times as long on cells of half the size; "first" has half the error then, "second" a quarter.
Study two_orders() {
  Study study = ladder();
  study.is_refined = true;
  study.variants.clear();
  for (int i = 0; i < 3; ++i) {
    study.variants.push_back(refined("first", std::to_string(i), .4 / std::pow(2, i), std::pow(8, i)));
    study.variants.push_back(refined("second", std::to_string(i), .4 / std::pow(4, i), 2 * std::pow(8, i)));
  }
  study.variants.push_back(refined("first", "wasteful", .3, 100));
  study.variants.push_back(refined("poor", "0", .45, 3));
  return study;
}

TEST(CostTimes, ToAnErrorFollowASchemesOwnFront) {
  Study study = two_orders();
  judge(study);
  const TimeToError& times = study.cases[0].times;
  EXPECT_EQ(times.levels, (std::vector{.2, .1}));   // one alone comes to less
  ASSERT_EQ(times.rows.size(), 3u);
  EXPECT_EQ(times.rows[0].scheme, "first");
  EXPECT_NEAR(times.rows[0].reaches[0]->seconds, 8, 1e-9);
  EXPECT_NEAR(times.rows[0].reaches[1]->seconds, 64, 1e-9);
  EXPECT_NEAR(times.rows[1].reaches[0]->seconds, 2 * std::sqrt(8), 1e-9);
  EXPECT_NEAR(times.rows[1].reaches[1]->seconds, 16, 1e-9);
  EXPECT_FALSE(times.rows[1].reaches[1]->at_most);
  EXPECT_FALSE(times.rows[2].reaches[0]);
  EXPECT_EQ(own_front(study, study.cases[0], "first").size(), 3u);
  const auto& said = study.cases[0].sentences;
  EXPECT_EQ(said[0], "An error of energy of 0.1 takes second 16 s.");
  EXPECT_EQ(said[1], "Times as long take first 4.");
  EXPECT_EQ(said[2], "Nothing that was tried brings poor there.");
  EXPECT_EQ(study_json(study).at("cases")[0].at("seconds_to_error").at("schemes").at("poor")[0], nullptr);
  EXPECT_NE(study_table(study).find("seconds to an error of energy of"), std::string::npos);
}

// Where even the fastest variant has less error than that, its seconds are a bound and no more.
TEST(CostTimes, AreAtMostThoseOfTheFastestWhereThatDoes) {
  Study study = two_orders();
  study.variants.push_back(refined("third", "0", .01, 5));
  study.variants.push_back(refined("third", "1", 0, 50));
  judge(study);
  const TimeToError& times = study.cases[0].times;
  EXPECT_EQ(times.levels, (std::vector{.2, .1, .05}));
  for (const auto& reach : times.rows[3].reaches) {
    EXPECT_DOUBLE_EQ(reach->seconds, 5);
    EXPECT_TRUE(reach->at_most);
  }
  EXPECT_EQ(own_front(study, study.cases[0], "third").size(), 2u);   // what is exact has no less than no error
  EXPECT_EQ(study.cases[0].sentences[0], "An error of energy of 0.05 takes third at most 5 s.");
}

// Levels where none is round, what could not run, and one scheme alone.
TEST(CostTimes, AreOfSchemesThatRan) {
  Study study = two_orders();
  study.variants = {refined("a", "0", .045, 1), refined("a", "1", .022, 8), refined("b", "0", .048, 1), refined("b", "1", .021, 9)};
  for (const char* scheme : {"c", "d", "e"}) {
    study.variants.push_back(refined(scheme, "0", 0, 1));
    study.variants.back().failure = "step: no";
  }
  judge(study);
  EXPECT_EQ(study.cases[0].times.levels, (std::vector{.022}));
  EXPECT_EQ(study.cases[0].times.rows.size(), 2u);
  EXPECT_EQ(study.cases[0].sentences[0], "An error of energy of 0.022 takes b 7.95 s.");
  EXPECT_EQ(study.cases[0].sentences[2], "");
  study.variants = {refined("alone", "0", .1, 1), refined("alone", "1", .01, 10)};
  judge(study);
  EXPECT_TRUE(study.cases[0].times.levels.empty());
  EXPECT_TRUE(study.cases[0].sentences[0].starts_with("Best value: alone cell 0")) << study.cases[0].sentences[0];
}

TEST(CostFront, TakesOneRunForLessAndSaysWhereTheClockIsInDoubt) {
  EXPECT_FALSE(is_tie(rung("a", .1, {1, 1.01}), rung("b", .1, {1.2, 1.21})));
  EXPECT_TRUE(is_tie(rung("a", .1, {1}), rung("b", .1, {1.2})));
  Study study;
  study.cases = {{"all", Measure::energy, {}, {}}};
  study.variants = {rung("waits", .5, {2, 2.1}), rung("works", .4, {1, 1.1})};
  study.variants[0].cpu_seconds = 1.5, study.variants[1].cpu_seconds = 1.6;
  EXPECT_EQ(doubt_of_the_clock(study), "");
  study.variants[1].cpu_seconds = 2;
  EXPECT_EQ(doubt_of_the_clock(study),
            "the clock and CPU seconds put 1 of 1 pairs the other way round (works and waits): threads waited, or something else ran");
}

// Something else that ran makes a run slower and never faster.
TEST(CostRuns, CountAreTheFastestOfThoseThatWereMade) {
  std::vector<MeasuredRun> runs;
  for (const double seconds : {1.0, 3.0, 1.1}) runs.push_back({{"seconds", seconds}});
  EXPECT_TRUE(is_unsteady(runs, 3));
  runs.push_back({{"seconds", 1.05}});
  EXPECT_FALSE(is_unsteady(runs, 3));
  std::vector<double> counted;
  for (const MeasuredRun& run : fastest(runs, 3)) counted.push_back(run.at("seconds"));
  EXPECT_EQ(counted, (std::vector{1.0, 1.1, 1.05}));
  EXPECT_EQ(fastest(runs, 9).size(), 4u);
}

TEST(CostFiles, HaveTheColumnsOfTheContractAndARowAVariant) {
  Study study = ladder();
  judge(study);
  const std::string csv = csv_text(study);
  EXPECT_TRUE(csv.starts_with(
      "variant,transfer,modes,kernel,splitting,cell,cfl,error_energy,error_position,error_vorticity,error_volume,error_surface,error_image,"
      "seconds_median,seconds_min,cpu_seconds,peak_bytes,disk_bytes,pareto,case,error_velocity,seconds_max,failure\r\n"));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 7);
  EXPECT_NE(csv.find("\r\ntied,apic,,linear,,0.1,1,0.4,,,,,,1.05,1,"), std::string::npos) << csv;
  EXPECT_NE(csv.find(",\"g2p: particle 3 is not finite, \"\"they say\"\"\"\r\n"), std::string::npos) << csv;
  const auto json = study_json(study);
  ASSERT_EQ(json.at("variants").size(), 6u);
  EXPECT_EQ(json.at("variants")[1].at("error_energy"), 0.4);
  EXPECT_EQ(json.at("variants")[1].at("pareto"), true);
  EXPECT_FALSE(json.at("variants")[1].contains("error_image"));
  EXPECT_FALSE(json.at("variants")[5].contains("pareto"));
  EXPECT_EQ(json.at("cases")[0].at("decides"), "energy");
  EXPECT_EQ(json.at("schema"), 1);
}

// What lies between the passes of old has names too: sums over particles and faces in every step, the watch in every frame.
TEST(CostPasses, HaveTheSumsOfAStepAndTheWatchOfAFrameAmongThem) {
  for (const bool reflects : {false, true}) {
    sim::Scene scene;
    scene.options.dimension = 2;
    scene.options.domain = {base::Vec3::Zero(), base::Vec3(1, 0.5, 0)};
    scene.options.cell = 1.0 / 32;
    scene.options.particles_per_cell = 4;
    if (reflects) scene.options.splitting = sim::Splitting::reflection;
    sim::Body column;
    column.name = "column";
    column.shape.box = base::Box{base::Vec3::Zero(), base::Vec3(0.3, 0.4, 0)};
    scene.bodies = {column};
    scene.effects = {sim::Effect{.acceleration = base::Vec3(0, -9.81, 0)}};
    sim::Watch watch(scene, 24);
    base::Ledger ledger;
    std::int64_t steps = 0;
    for (int f = 0; f < 3; ++f) {
      ASSERT_TRUE(watch.advance(ledger, {}));
      steps += watch.totals().substeps;
    }
    ASSERT_GT(steps, 3);
    EXPECT_EQ(ledger.passes().at("watch").calls, 3);
    EXPECT_GT(ledger.passes().at("watch").bytes, 0);
    // The fastest particle, the volume and the fastest face of every projection; with reflection the energy too.
    const std::int64_t projections = (reflects ? 2 : 1) * steps;
    EXPECT_EQ(ledger.passes().at("sums").calls, steps + steps + projections + (reflects ? steps : 0)) << reflects;
    EXPECT_GT(ledger.passes().at("sums").bytes, 0);
  }
}

// Seconds by pass are those of one run, or of the two in the middle, so that they add up to what is shown beside them.
TEST(CostPasses, AddUpToTheMedianRun) {
  KeptRuns kept;
  for (const auto& [p2g, pressure] : {std::pair{1.0, 5.0}, {4.0, 1.0}, {2.0, 2.0}, {3.0, 7.0}}) {   // wholes 6, 5, 4, 10
    MeasuredRun run = {{"errors", MeasuredRun::object()}, {"course", {{"time", {0}}, {"energy", {1}}, {"enstrophy", MeasuredRun::array()}}}};
    run["particles"] = 1, run["steps"] = 1, run["peak_bytes"] = 1;
    run["seconds"] = run["cpu_seconds"] = p2g + pressure;
    for (const auto& [name, seconds] : {std::pair{"p2g", p2g}, {"pressure", pressure}})
      run["passes"][name] = {{"calls", 1}, {"seconds", seconds}, {"cpu_seconds", seconds}};
    kept.runs.push_back(run);
  }
  Variant v;
  take_runs(kept, 4, v);
  EXPECT_EQ(v.seconds_median, 5.5);
  EXPECT_EQ(v.cpu_seconds, 5.5);
  EXPECT_EQ(v.passes.at("p2g").seconds, 2.5);   // each one's median would be 2.5 and 3.5
  EXPECT_EQ(v.passes.at("pressure").seconds, 3);
  EXPECT_EQ(v.passes.at("p2g").cpu_seconds + v.passes.at("pressure").cpu_seconds, v.cpu_seconds);
}

// A step that gathers twice, as a fault would.
TEST(CostPasses, ShowTwiceTheCallsOfAPassThatWorksTwice) {
  sim::Scene scene;
  scene.options.dimension = 2;
  scene.options.domain = {base::Vec3::Zero(), base::Vec3(1, 1, 0)};
  scene.options.cell = 1.0 / 32;
  scene.options.particles_per_cell = 4;
  scene.options.boundary = {std::array{sim::Side::periodic, sim::Side::periodic}, std::array{sim::Side::periodic, sim::Side::periodic}};
  sim::Body all;
  all.shape.box = scene.options.domain;
  scene.bodies = {all};
  const sim::Lattice<2> lattice({32, 32}, {true, true});
  const sim::Solids<2> solids(scene, lattice);
  const auto calls = [&](int gathers) {
    sim::FluidStep<2, double> step(scene.options, solids, false);
    auto particles = sim::seed_particles<2, double>(scene, lattice, solids, int(step.transfer().modes().size()));
    base::Ledger ledger;
    for (int s = 0; s < 5; ++s) {
      step.scatter(particles, 0, ledger);
      step.project(base::Vec3::Zero(), ledger);
      for (int g = 0; g < gathers; ++g) step.gather({}, particles, ledger);
      step.move(0.01, false, particles, ledger);
    }
    MeasuredRun run = measured({}, ledger);
    run["peak_bytes"] = 1;
    Variant v;
    take_runs({{run, run}, {}}, 2, v);
    return v.passes;
  };
  const auto once = calls(1), twice = calls(2);
  EXPECT_EQ(once.at("g2p").calls, 5);
  EXPECT_EQ(twice.at("g2p").calls, 10);
  EXPECT_EQ(once.at("p2g").calls, twice.at("p2g").calls);
}

sim::Frame cloud(std::size_t count, double shift) {
  sim::Frame f;
  for (std::size_t i = 0; i < count; ++i) {
    const double u = std::fmod(0.5 + 0.7548776662466927 * double(i), 1), v = std::fmod(0.5 + 0.5698402909980532 * double(i), 1),
                 w = (double(i) + 0.5) / double(count);
    f.position.emplace_back(float(0.2 + 0.3 * u + shift), float(0.2 + 0.3 * v), float(0.2 + 0.3 * w));
    f.velocity.emplace_back(float(-(0.2 + 0.3 * v)), float(0.2 + 0.3 * u), 0.f);
  }
  return f;
}

TEST(CostDistance, OfACloudThatIsMovedIsTheWayItWent) {
  const Projections here(cloud(4000, 0), 3);
  EXPECT_EQ(here.distance(here), 0);
  EXPECT_NEAR(here.distance(Projections(cloud(4000, 0.1), 3)), 0.1, 0.003);
  EXPECT_LT(here.distance(Projections(cloud(500, 0), 3)), 0.01);   // fewer particles of the same cloud are the same cloud
  EXPECT_NEAR(Projections(cloud(4000, 0), 2).distance(Projections(cloud(4000, 0.1), 2)), 0.1, 0.003);
}

TEST(CostDistance, OfAFlowFromItsSlowerTwinIsWhatItLost) {
  sim::Options o;
  o.domain = {base::Vec3::Zero(), base::Vec3(0.8, 0.8, 0.8)};
  o.cell = 0.025;
  sim::Frame turning = cloud(14000, 0), slower = turning;
  for (base::Vec3f& v : slower.velocity) v *= 0.75f;
  const VorticityGrid whole(turning, o, 0.05);
  EXPECT_NEAR(whole.distance(VorticityGrid(slower, o, 0.05)).value(), 0.25, 1e-4);
  EXPECT_EQ(whole.distance(whole).value(), 0);
  EXPECT_FALSE(VorticityGrid({}, o, 0.05).distance(whole).has_value());
}

TEST(CostDistance, OfTwoPlanesIsTheGapBetweenThem) {
  const auto plane = [](float height, float step) {
    surface::Mesh mesh;
    for (float x = 0; x < 1; x += step)
      for (float y = 0; y < 1; y += step) mesh.position.emplace_back(x, y, height), mesh.normal.emplace_back(0.f, 0.f, 1.f);
    return mesh;
  };
  EXPECT_NEAR(surface_distance(plane(0, 0.02f), plane(0.015f, 0.031f), 0.1).value(), 0.015, 1e-6);   // not to the nearest vertex, which is farther
  EXPECT_FALSE(surface_distance(plane(0, 0.1f), {}, 0.1).has_value());
}

}  // namespace
