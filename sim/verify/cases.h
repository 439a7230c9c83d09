#pragma once
// The parts that verify_cases() puts together, each a list of its own.
#include "sim/verify.h"

namespace sim::verify {

void add_transfer_cases(std::vector<VerifyCase>&);   // offsets, round trips, orders
void add_law_cases(std::vector<VerifyCase>&);        // materials by themselves
void add_spin_cases(std::vector<VerifyCase>&);       // disks, spheres and lone particles that turn
void add_solid_cases(std::vector<VerifyCase>&);      // crushed, thrown, moved far
void add_contact_cases(std::vector<VerifyCase>&);    // walls and colliders, of solids and liquids
void add_liquid_cases(std::vector<VerifyCase>&);     // dam breaks, still water, pockets
void add_pouring_cases(std::vector<VerifyCase>&);    // taps, a funnel, falling blocks, a scene that runs empty
void add_long_cases(std::vector<VerifyCase>&);       // a hundred thousand steps, sixty random scenes

}  // namespace sim::verify
