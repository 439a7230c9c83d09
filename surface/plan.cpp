#include "surface/plan.h"

namespace surface {

using Often = base::PassRow::Often;

std::span<const base::PassRow> pass_rows() {
  static const std::vector<base::PassRow> rows = {
      {"rasterize", Often::frame, {"points file"}, {"spheres"}},
      {"rebuild", Often::frame, {"spheres"}, {"level set"}},
      {"smooth", Often::frame, {"level set"}, {"level set"}},
      {"wet", Often::frame, {"level set"}, {"level set"}},
      {"velocity", Often::frame, {"points file", "level set"}, {"velocity grid"}},
      {"write_surface", Often::frame, {"level set", "velocity grid"}, {"surface file"}},
  };
  return rows;
}

std::span<const base::EffectRow<Task>> effect_rows() {
  static const std::vector<base::EffectRow<Task>> rows = {
      {"level set",
       {"sim.dimension", "surface.voxel", "surface.radius"},
       [](const Task& t) { return t.dimension == 3; },
       {"rasterize", "rebuild", "write_surface"}},
      {"velocity grid", {"surface.vel_name"}, [](const Task& t) { return t.dimension == 3; }, {"velocity"}},
      {"smoothing", {"surface.smooth"}, [](const Task& t) { return t.dimension == 3 && t.options.smooth > 0; }, {"smooth"}},
      {"surface against solids", {"collider.NAME"}, [](const Task& t) { return t.dimension == 3 && t.has_solids; }, {"rasterize<solids", "rebuild<solids"}},
      {"surfaces by body", {"body.NAME.look", "body.NAME.material"}, [](const Task& t) { return t.dimension == 3 && t.parts_bodies; }, {"rasterize"}},
      {"liquid against bodies", {"body.NAME.look", "body.NAME.material"}, [](const Task& t) { return t.dimension == 3 && t.wets_bodies; }, {"wet"}},
  };
  return rows;
}

base::Plan plan_of(const Task& task) { return base::make_plan("surface", effect_rows(), pass_rows(), task); }

std::span<const base::PassRow> points_pass_rows() {
  static const std::vector<base::PassRow> rows = {{"write_points", Often::frame, {"particles"}, {"points file"}}};
  return rows;
}

std::span<const base::EffectRow<sim::Scene>> points_rows() {
  static const std::vector<base::EffectRow<sim::Scene>> rows = {{"points file", {"sim"}, [](const sim::Scene&) { return true; }, {"write_points"}}};
  return rows;
}

base::Plan points_plan_of(const sim::Scene& scene) { return base::make_plan("simulate", points_rows(), points_pass_rows(), scene); }

}  // namespace surface
