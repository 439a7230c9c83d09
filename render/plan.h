#pragma once
// The effects of pictures, as rows; see sim/plan.h.
#include <span>

#include "base/plan.h"
#include "render/render.h"

namespace render {

std::span<const base::EffectRow<Setting>> effect_rows();
std::span<const base::PassRow> pass_rows();
/// Of the stage "render": path traced, or drawn flat in two dimensions.
base::Plan plan_of(const Setting&);
/// Of the stage "preview".
base::Plan preview_plan_of(const Setting&);

}  // namespace render
