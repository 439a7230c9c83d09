#include "sim/problem.h"

#include "sim/problems/taylor_green.h"

namespace sim {

std::span<const ProblemRow> problem_rows() {
  static const std::string kFlowEnergy = "of the field's kinetic energy, against that at the start", kField = "root mean square over the faces, over that of the exact field",
                           kCurl = "the same of the vorticity";
  static const std::vector<ProblemRow> rows = {
      {"taylor_green_2d", "inviscid vortices in a periodic square: steady, so any loss of energy is an error", "energy", make_taylor_green_2d,
       {{"64 cells a wavelength", {}},
        {"16 cells a wavelength", {"problem.waves=4", "problem.time=2"}},
        {"8 cells a wavelength", {"problem.waves=8", "problem.time=1"}},
        {"8 cells, moving frame", {"problem.waves=8", "problem.time=1", "problem.mean=[0.159, 0.0955]"}}},
       {.energy = kFlowEnergy, .position = {}, .vorticity = kCurl, .volume = {}, .velocity = kField}},
      {"taylor_green_3d", "the vortices of taylor_green_2d in every layer of a periodic box, computed in three dimensions", "energy", make_taylor_green_3d,
       {{"16 cells a wavelength", {"problem.waves=4", "problem.time=1"}}, {"8 cells a wavelength", {"problem.waves=8", "problem.time=0.5"}}},
       {.energy = kFlowEnergy, .position = {}, .vorticity = kCurl, .volume = {}, .velocity = kField}},
  };
  return rows;
}

const ProblemRow* find_problem(std::string_view name) {
  for (const ProblemRow& row : problem_rows())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace sim
