#include "sim/violation.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace sim {
namespace {

base::Complaint complaint_of(std::int64_t frame, const Violation& v) {
  std::string line = fmt::format("frame {}: {}: {}", frame, v.law, v.what);
  if (!v.where.empty()) line += "; " + v.where;
  if (v.since > 0) line += fmt::format("; well up to frame {}", v.since - 1);
  return {.code = base::Exit::unstable, .hint = v.remedy, .message = std::move(line)};
}

}  // namespace

Unstable::Unstable(std::int64_t frame, Violation v) : base::Error(complaint_of(frame, v)), frame_(frame), violation_(std::move(v)) {}

void check_p2g(std::int64_t frame, Places places, const MassAndMomentum& grid, const MassAndMomentum& particles, double scale,
               bool single_precision, double crowded) {
  const double rounding = (single_precision ? 1e-4 : 1e-9) * std::max(crowded, 1.0);   // of sums of a million numbers and more
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (int a = 0; a < 3; ++a) {
    const std::string where = places == Places::nodes ? "nodes" : fmt::format("faces across {}", kAxes[a]);
    if (!(std::abs(grid.mass[a] - particles.mass[a]) <= rounding * particles.mass[a]))
      throw Unstable(frame, {"mass", fmt::format("p2g: {} hold {:.8g} kg, particles {:.8g}", where, grid.mass[a], particles.mass[a]),
                             "this is a fault of the program"});
    if (!(std::abs(grid.momentum[a] - particles.momentum[a]) <= rounding * scale))
      throw Unstable(frame, {"momentum", fmt::format("p2g: {} have {:.6g} kg m/s along {}, particles {:.6g}", where, grid.momentum[a], kAxes[a],
                                                     particles.momentum[a]),
                             "carry \"hybrid\" or fewer modes; where coefficients and stresses are small, this is a fault of the program"});
  }
}

}  // namespace sim
