#pragma once
// The law that a material's keys ask for.
#include "sim/material.h"
#include "sim/solid/model.h"

namespace sim {

/// The material was checked: its plasticity suits its elasticity.
Model make_model(const Material&);

}  // namespace sim
