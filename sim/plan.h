#pragma once
// The effects that a simulation can have: which of them a scene asks for, what particles carry for them and which passes they add to a
// step. Whoever adds an effect adds a row to the table in sim/plan.cpp; docs/architecture.md says how.
#include <span>

#include "base/plan.h"
#include "sim/scene.h"

namespace sim {

std::span<const base::EffectRow<Scene>> effect_rows();
/// All passes a step of a liquid can have, in the order of work; of a solid.
std::span<const base::PassRow> pass_rows();
std::span<const base::PassRow> solid_pass_rows();
/// Modes that a particle carries for each component of its velocity.
std::int64_t mode_count(const Options&);
/// The same of the particles that carry the most: bodies of a solid scene may differ.
std::int64_t most_modes(const Scene&);
/// Of the stage "simulate". Attributes that are state are those of the columns of State.
base::Plan plan_of(const Scene&);

}  // namespace sim
