#pragma once
// A simulation followed frame by frame: what problems about solids and still liquids have in common.
#include <functional>
#include <string>
#include <vector>

#include "sim/problem.h"
#include "sim/simulation.h"

namespace sim {

/// Advances `frames` frames. Times and energies from the start on, over the energy then; the error of energy is what the last one has too much or
/// too little.
/// `see` is called with the totals of every frame, the first included, outside of what is timed.
ProblemResult follow(Simulation&, int frames, base::Ledger&, const std::function<void(const Totals&)>& see = {});

/// The numbers of one column, in the state's own precision, as doubles.
std::vector<double> column_of(const State&, const std::string& name);
/// Puts numbers back, in the state's own precision.
void set_column(State&, const std::string& name, const std::vector<double>&);
/// Positions [cells] along an axis, in the order of the columns.
std::vector<double> places_of(const State&, int axis);
/// Numbers of a row of a column.
std::size_t width_of(const State&, const std::string& name);

}  // namespace sim
