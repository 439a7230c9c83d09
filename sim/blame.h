#pragma once
// Who is to blame for what a run is stopped with: particles that stand out in a state that is no good any more.
#include <string>

#include "sim/simulation.h"

namespace sim {

enum class Suspect { fastest, largest_coefficient, most_deformed };

struct Culprit {
  std::string text;   // "the fastest is particle 7 of body left, cell (3, 4), (0.31, 0.42, 0) m, 3.1 m/s"; empty where there is no particle
  int body = -1;      // number in the scene from 0; -1: not known
};

/// `simulation` must stand between two steps. Of a liquid nothing is deformed: the fastest then.
Culprit find_culprit(Suspect, const Scene&, const Simulation& simulation);

/// "particle 7 of body left, cell (3, 4), (0.31, 0.42, 0) m": the particle at `row` of a frame, which must have ids and positions.
std::string particle_text(const Scene&, const Frame&, std::size_t row);

}  // namespace sim
