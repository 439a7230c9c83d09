#pragma once
// The groups of a solid scene at t = 0, their particles where sim/seeding.h says. Ids count body by body, in cell order within each.
#include "sim/colliders/solids.h"
#include "sim/scene.h"
#include "sim/solid/group.h"

namespace sim {

/// A group a body, also of bodies without a particle. Coefficients are those of the body's velocity and spin, a linear field: exact from
/// total degree 1 on, its value at the particle where fewer modes are carried.
template <int D, class Real>
std::vector<Group<D, Real>> seed_groups(const Scene&, const Solids<D>&);

}  // namespace sim
