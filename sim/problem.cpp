#include "sim/problem.h"

#include "sim/problems/problems.h"

namespace sim {

std::span<const ProblemRow> problem_rows() {
  static const std::string kFlowEnergy = "of the field's kinetic energy, against that at the start",
                           kField = "root mean square over the faces, over that of the exact field", kCurl = "the same of the vorticity",
                           kTurned = "root mean square of the core's particles from where the turn takes them, over its radius",
                           kBodyEnergy = "of kinetic and elastic energy, against that at the start";
  static const ProblemMeanings kStill{.energy = "of kinetic and potential energy, against that at the start",
                                      .position = "of the mean height, over the depth",
                                      .vorticity = {},
                                      .volume = "part by which the surface holds more or less than the particles are worth",
                                      .velocity = "root mean square over the second half, over sqrt(g H)"},
      kSpun{.energy = kBodyEnergy,
            .position = {},
            .vorticity = {},
            .volume = "of the mean change of volume over the time, against the known one; a part of the volume",
            .velocity = {}};
  static const std::vector<ProblemRow> rows = {
      {"taylor_green_2d",
       "inviscid vortices in a periodic square: steady, so any loss of energy is an error",
       "energy",
       make_taylor_green_2d,
       {{"64 cells a wavelength", {}},
        {"16 cells a wavelength", {"problem.waves=4", "problem.time=2"}},
        {"8 cells a wavelength", {"problem.waves=8", "problem.time=1"}},
        {"8 cells, moving frame", {"problem.waves=8", "problem.time=1", "problem.mean=[0.159, 0.0955]"}}},
       {.energy = kFlowEnergy, .position = {}, .vorticity = kCurl, .volume = {}, .velocity = kField}},
      {"taylor_green_3d",
       "the vortices of taylor_green_2d in every layer of a periodic box, computed in three dimensions",
       "energy",
       make_taylor_green_3d,
       {{"16 cells a wavelength", {"problem.waves=4", "problem.time=1"}}, {"8 cells a wavelength", {"problem.waves=8", "problem.time=0.5"}}},
       {.energy = kFlowEnergy, .position = {}, .vorticity = kCurl, .volume = {}, .velocity = kField}},
      {"rigid_rotation_2d",
       "a core that turns rigidly within a circular vortex: after a turn every particle of it is where it was",
       "position",
       make_rigid_rotation_2d,
       {{"one turn", {}}},
       {.energy = kFlowEnergy, .position = kTurned, .vorticity = kCurl, .volume = {}, .velocity = kField}},
      {"rigid_rotation_3d",
       "the core of rigid_rotation_2d in every layer of a periodic box, on cells of twice the size",
       "position",
       make_rigid_rotation_3d,
       {{"one turn", {}}},
       {.energy = kFlowEnergy, .position = kTurned, .vorticity = kCurl, .volume = {}, .velocity = kField}},
      {"vortex_ring",
       "a vortex ring that carries itself along at a known speed [Saffman70]",
       "position",
       make_vortex_ring,
       {{"one radius of way", {}}},
       {.energy = kFlowEnergy, .position = "of the way that the ring has gone, over the known one", .vorticity = {}, .volume = {}, .velocity = {}}},
      {"hydrostatic_2d", "water at rest in a tank, seeded with jitter: it stays at rest", "velocity", make_hydrostatic_2d, {{"at rest", {}}}, kStill},
      {"hydrostatic_3d", "water at rest in a tank, seeded with jitter: it stays at rest", "velocity", make_hydrostatic_3d, {{"at rest", {}}}, kStill},
      {"spinning_disk_2d",
       "an elastic disk, let go while it spins: it keeps its energy and swells by what its spin asks for",
       "energy",
       make_spinning_disk_2d,
       {{"2.5 turns", {}}},
       kSpun},
      {"spinning_sphere_3d",
       "an elastic sphere, let go while it spins: it keeps its energy and swells by what its spin asks for",
       "energy",
       make_spinning_sphere_3d,
       {{"1.3 turns", {"problem.time=2"}}},
       kSpun},
      {"released_square",
       "an elastic square, pressed together and let go: it swings, and its energy stays [PolyPIC]",
       "energy",
       make_released_square,
       {{"six swings", {}}},
       {.energy = kBodyEnergy, .position = {}, .vorticity = {}, .volume = {}, .velocity = {}}},
      {"bar_wave",
       "a standing wave in an elastic bar that is held at its sides: it swings at the speed of sound",
       "position",
       make_bar_wave,
       {{"32 cells a wavelength", {}}},
       {.energy = kBodyEnergy,
        .position = "of the wave's phase speed over that of sound, from one and a half periods",
        .vorticity = {},
        .volume = {},
        .velocity = {}}},
      {"slope_block",
       "an elastic block on a slope of 30 degrees with friction 0.3: it slides by g (sin - mu cos) t^2 / 2",
       "position",
       make_slope_block,
       {{"half a second", {}}},
       {.energy = "of the energy that is left against what friction leaves, over the work of gravity",
        .position = "of the way that the block has slid, over the known one",
        .vorticity = {},
        .volume = {},
        .velocity = {}}},
  };
  return rows;
}

const ProblemRow* find_problem(std::string_view name) {
  for (const ProblemRow& row : problem_rows())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace sim
