#pragma once
// The effects of surfacing and of the points file, as rows; see sim/plan.h.
#include <span>

#include "base/plan.h"
#include "surface/surface.h"

namespace surface {

/// What surfacing depends on.
struct Task {
  Options options;
  std::int64_t dimension = 3;   // in two dimensions there is no surface
  bool has_solids = false;      // colliders that the level set goes on into
  bool parts_bodies = false;    // each has a surface of its own
  bool wets_bodies = false;     // and one of them is a liquid
};
std::span<const base::EffectRow<Task>> effect_rows();
std::span<const base::PassRow> pass_rows();
/// Of the stage "surface".
base::Plan plan_of(const Task&);

/// The points file that ends the stage "simulate", of any scene.
std::span<const base::EffectRow<sim::Scene>> points_rows();
std::span<const base::PassRow> points_pass_rows();
base::Plan points_plan_of(const sim::Scene&);

}  // namespace surface
