// What a shot will cost: scaling of measured runs with known growth, what does not fit, and what the cache keeps.
#include "app/plan/predict.h"

#include <cmath>
#include <cstdlib>

#include "app/plan/graph.h"
#include "app/plan/limits.h"
#include "app/plan/plan.h"
#include "plan_shots.h"
#include "shot_file.h"
#include "sim/simulation.h"
#include "sim/size.h"

namespace {

/// Costs that grow with known powers: a step with particles, a surface with their power 2/3, a picture with its pixels.
app::MicroRun run_of(double particles, double cell, double pixels, double spp, std::int64_t last) {
  app::MicroRun run{.particles = particles, .cell = cell, .pixels = pixels, .samples = pixels * spp,
                    .peak_bytes = 1e8 + 500 * particles + 80 * pixels, .frames = {}};
  for (std::int64_t frame = 1; frame <= last; ++frame) {
    app::FrameCost cost{.steps = frame == 1 ? 0.0 : 2.0, .speed = 1, .cpu = {}, .calls = {}, .bytes = {}};
    cost.cpu["simulate/p2g"] = cost.steps * 1e-5 * particles;
    cost.cpu["surface/rasterize"] = 1e-3 * std::pow(particles, 2.0 / 3);
    cost.cpu["render/trace"] = 1e-5 * pixels * spp;
    cost.cpu["render/write_image"] = 1e-6 * pixels;
    for (const auto& [key, unused] : cost.cpu) cost.calls[key] = 1;
    cost.bytes = {{"points", 24 * particles}, {"surface", 1000 * std::pow(particles, 2.0 / 3)}, {"images", 8 * pixels}, {"ledger", 2000}};
    run.frames[frame] = cost;
  }
  return run;
}

class Predict : public ShotFile {
 protected:
  void SetUp() override { ::setenv("XDG_CACHE_HOME", folder.c_str(), 1); }
};

}  // namespace

TEST_F(Predict, FollowsThePowersThatTheRunsShow) {
  const app::Shot shot =
      read(kTank + kGravity, {"sim.cell=0.01", "render.width=320", "render.height=160", "render.spp=4", "body.water.velocity=[1,0,0]"});
  const double particles = sim::size_of(shot.scene).particles, pixels = 320 * 160;
  app::Pilot pilot{.small = run_of(particles / 64, 0.04, pixels / 16, 4, 3), .wide = run_of(particles / 64, 0.04, pixels / 4, 4, 3),
                   .fine = run_of(particles / 8, 0.02, pixels / 4, 4, 3), .last = 3, .seconds = 1};
  const app::Prediction p = app::predict(shot, pilot, {1, 3});
  const double steps = 2 * sim::steps_in_frame(shot.scene, shot.fps, 1, 1);
  EXPECT_GT(steps, 4);
  const app::MicroRun truth = run_of(particles, 0.01, pixels, 4, 3);
  EXPECT_NEAR(p.cpu.at("simulate"), steps * 1e-5 * particles, 0.01 * p.cpu.at("simulate"));
  EXPECT_NEAR(p.cpu.at("surface"), 3 * truth.frames.at(1).cpu.at("surface/rasterize"), 0.01 * p.cpu.at("surface"));
  EXPECT_NEAR(p.cpu.at("render"), 3 * (truth.frames.at(1).cpu.at("render/trace") + truth.frames.at(1).cpu.at("render/write_image")),
              0.01 * p.cpu.at("render"));
  EXPECT_NEAR(p.peak_bytes, truth.peak_bytes, 0.01 * truth.peak_bytes);
  EXPECT_NEAR(p.disk.at("images"), 3 * 8 * pixels, 10);
  EXPECT_NEAR(p.disk.at("points"), 3 * 24 * particles, 100);
}

// Drops of a splash are faster and more in smaller cells: where the fine run was followed, the coarse one says nothing of later frames.
TEST_F(Predict, TakesLaterFramesFromTheFinestRunThatWasFollowed) {
  const app::Shot shot = read(kTank + kGravity, {"sim.cell=0.01"});
  const double particles = sim::size_of(shot.scene).particles;
  const auto pilot_with = [&](app::MicroRun fine) {
    return app::Pilot{.small = run_of(particles / 64, 0.04, 100, 4, 3), .wide = run_of(particles / 64, 0.04, 400, 4, 9), .fine = std::move(fine),
                      .last = 9, .seconds = 1};
  };
  app::MicroRun fine = run_of(particles / 8, 0.02, 400, 4, 9);
  for (std::int64_t frame = 4; frame <= 9; ++frame) {
    fine.frames.at(frame).speed = 2;
    fine.frames.at(frame).cpu.at("simulate/p2g") *= 3;
  }
  const double before = app::predict(shot, pilot_with(run_of(particles / 8, 0.02, 400, 4, 3)), {1, 9}).cpu.at("simulate");
  const double after = app::predict(shot, pilot_with(fine), {1, 9}).cpu.at("simulate");
  const auto steps = [&](double a, double b) { return sim::steps_in_frame(shot.scene, shot.fps, a, b); };
  const double a_step = 1e-5 * particles;
  EXPECT_NEAR(before, 8 * steps(1, 1) * a_step, 0.01 * before);
  EXPECT_NEAR(after, (2 * steps(1, 1) + 3 * (steps(1, 2) + 5 * steps(2, 2))) * a_step, 0.01 * after);
  EXPECT_GT(after, 2 * before);
}

// A step of what pours has a cost that is always there: what a small run's end takes is not as many times more as the shot has particles more.
TEST_F(Predict, OfWhatPoursGoesByTheParticlesThatAreThere) {
  const app::Shot shot = read("[shot]\nframes = 24\n[sim]\n" + kRoom + kGravity + source("tap", "[[0.1, 0.1, 0.2], [0.2, 0.2, 0.3]]", "[0, 0, -1]") + "[render]\n" + kSmallPicture,
                              {"sim.cell=0.0125"});
  constexpr std::int64_t kLast = 24;
  const double particles = app::particles_at(shot, kLast), fixed = 0.01, each = 1e-6;
  const auto pouring = [&](double all, double cell, std::int64_t last) {
    app::MicroRun run = run_of(all, cell, 400, 4, last);
    for (auto& [frame, cost] : run.frames) {
      const double there = all / particles * app::particles_at(shot, frame);
      cost.cpu.at("simulate/p2g") = cost.steps * (fixed + each * there);
      cost.cpu.at("surface/rasterize") = 0.1 + 1e-5 * there;
    }
    return run;
  };
  const app::Pilot pilot{.small = pouring(particles / 64, 0.05, 3), .wide = pouring(particles / 64, 0.05, kLast), .fine = pouring(particles / 8, 0.025, 3), .last = kLast, .seconds = 1};
  const app::Prediction p = app::predict(shot, pilot, {1, kLast});
  const double steps = sim::steps_in_frame(shot.scene, shot.fps, 1, 1);
  double simulate = 0, surface = 0;
  for (std::int64_t frame = 1; frame <= kLast; ++frame) {
    const double there = app::particles_at(shot, frame);
    if (frame > 1) simulate += steps * (fixed + each * there);
    if (frame > 3) surface += 0.1 + 1e-5 * there;
  }
  EXPECT_GT(each * particles, fixed);
  EXPECT_NEAR(p.cpu.at("simulate"), simulate, 0.02 * simulate);
  EXPECT_NEAR(p.cpu.at("surface"), surface, 0.2 * surface);
}

TEST_F(Predict, StepsAreThoseOfTheSimulation) {
  const app::Shot shot = read(kTank + kGravity, {"sim.cell=0.05"});
  const auto simulation = sim::make_simulation(shot.scene, shot.fps);
  base::Ledger ledger;
  double before = 0, said = 0, done = 0;
  for (int frame = 0; frame < 6; ++frame) {
    simulation->advance(ledger, {});
    const sim::Totals totals = simulation->totals();
    said += sim::steps_in_frame(shot.scene, shot.fps, before, totals.max_speed);
    done += double(totals.substeps);
    before = totals.max_speed;
  }
  EXPECT_GT(done, 6);
  EXPECT_NEAR(said, done, 0.25 * done);
}

TEST_F(Predict, WhatDoesNotFitIsRefusedWithTheNumberAndTheKey) {
  const app::Shot shot = read(kTank, {"sim.cell=0.0005"});
  const auto complaint = [&](const app::Prediction& p, double memory, double disk) {
    try {
      app::require_room(shot, p, memory, disk);
    } catch (const base::Error& e) {
      return e.complaint();
    }
    return base::Complaint{.code = base::Exit::done};
  };
  const app::Prediction least = app::least(shot, {1, 2});
  EXPECT_GT(least.peak_bytes, 1e11);
  const double particles = sim::size_of(shot.scene).particles;   // of 32 bytes in a points file
  EXPECT_NEAR(least.disk.at("points"), particles * 32 * (0.5 + 0.75), 1e-6 * least.disk.at("points"));
  EXPECT_GT(least.disk.at("checkpoint"), particles * 32);
  const base::Complaint memory = complaint(least, 1e9, 1e18);
  EXPECT_EQ(memory.code, base::Exit::user);
  EXPECT_EQ(memory.key, "sim.cell");
  EXPECT_NE(memory.message.find("of memory, and there are 1.0 GB"), std::string::npos) << memory.message;
  EXPECT_EQ(complaint(least, 1e18, 1e18).code, base::Exit::done);
  const base::Complaint disk = complaint(least, 1e18, 1e9);
  EXPECT_EQ(disk.key, "sim.cell");
  EXPECT_NE(disk.message.find("of disk, and there are 1.0 GB"), std::string::npos) << disk.message;
  app::Prediction pictures = least;
  pictures.disk = {{"images", 5e12}, {"points", 1}};
  EXPECT_EQ(complaint(pictures, 1e18, 1e9).key, "render.width");
  EXPECT_GT(app::free_memory(), 1e6);
  EXPECT_GT(app::free_disk(folder / "not" / "there"), 0);
}

TEST_F(Predict, TakesTheLeastOfWhatControlGroupsLeave) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder / name).parent_path());
    std::ofstream(folder / name) << text;
  };
  const auto left = [&](const std::string& groups) {
    write("groups", groups);
    return app::memory_of_groups(folder / "groups", folder);
  };
  write("slurm/job/memory.max", "max\n");
  write("slurm/memory.max", "1000000\n"), write("slurm/memory.current", "700000\n"), write("slurm/memory.stat", "anon 1\ninactive_file 200000\n");
  write("memory/job/memory.limit_in_bytes", "9223372036854771712\n"), write("memory/memory.limit_in_bytes", "300000\n");
  write("memory/memory.usage_in_bytes", "100000\n");
  EXPECT_EQ(left("0::/slurm/job\n"), 500000);
  EXPECT_EQ(left("3:cpu:/slurm\n4:memory,hugetlb:/job\n0::/\n"), 200000);
  EXPECT_EQ(left("4:memory:/../elsewhere\n"), 200000);
  EXPECT_EQ(left("0::/elsewhere\n"), std::numeric_limits<double>::infinity());
  write("memory.max", "400000\n");
  EXPECT_EQ(left("0::/elsewhere\n"), 400000);
}

TEST_F(Predict, KeepsPilotsForOtherSizesOfTheSameShotOnly) {
  const app::Shot shot = read(kTank);
  EXPECT_FALSE(app::cached_pilot(shot, 3, 2));
  app::keep_pilot(
      shot, 2,
      {.small = run_of(10, 0.1, 100, 1, 3), .wide = run_of(10, 0.1, 400, 1, 3), .fine = run_of(80, 0.05, 400, 1, 3), .last = 3, .seconds = 2});
  const auto kept = app::cached_pilot(shot, 3, 2);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->fine.particles, 80);
  EXPECT_EQ(kept->fine.frames.at(2).cpu.at("simulate/p2g"), 2 * 1e-5 * 80);
  EXPECT_TRUE(app::cached_pilot(read(kTank, {"sim.cell=0.05", "render.width=64"}), 3, 2));
  EXPECT_FALSE(app::cached_pilot(read(kTank, {"surface.voxel=0.02"}), 3, 2));   // a finer surface
  EXPECT_FALSE(app::cached_pilot(shot, 4, 2));                                   // not followed so far
  EXPECT_FALSE(app::cached_pilot(shot, 3, 1));                                   // other threads
  EXPECT_FALSE(app::cached_pilot(read(kTank, {"sim.transfer=pic"}), 3, 2));      // another scheme
  for (const auto& entry : std::filesystem::directory_iterator(folder / "polypic")) std::ofstream(entry.path()) << "{";
  EXPECT_FALSE(app::cached_pilot(shot, 3, 2));                                   // damaged
}

TEST_F(Predict, TellsHowFarOffItWas) {
  EXPECT_EQ(app::error_text(app::past_outcomes()), "");
  for (const double cpu : {100.0, 104.0, 130.0})
    app::keep_outcome({.shot = "x", .cpu_predicted = 100, .cpu = cpu, .memory_predicted = 90, .memory = 100, .disk_predicted = 10, .disk = 10});
  EXPECT_EQ(app::past_outcomes().size(), 3u);
  EXPECT_EQ(app::error_text(app::past_outcomes()), "CPU 4 %, memory 10 %, disk 0 % (median of 3 runs)");
}

TEST_F(Predict, PictureOfThePassesShowsThemAll) {
  const app::Shot shot = read(kTank + kGravity);
  const std::string picture = app::pass_graph(shot);
  EXPECT_TRUE(picture.starts_with("<svg ") && picture.ends_with("</svg>\n"));
  for (const app::Stage stage : app::stages_of(shot))
    for (const base::PassRow& pass : app::plan_of(shot, stage).passes)
      EXPECT_NE(picture.find(">" + std::string(pass.name) + "</text>"), std::string::npos) << pass.name;
  EXPECT_EQ(picture.find(">carry</text>"), std::string::npos);
  app::Shot strange = shot;
  strange.name = "a&b<c>";
  EXPECT_NE(app::pass_graph(strange).find(">Passes of a&amp;b&lt;c&gt;</text>"), std::string::npos);
}
