#include "app/study/coarser.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "base/error.h"
#include "base/text.h"
#include "sim/empty_body.h"
#include "sim/size.h"

namespace app {
namespace {

/// For a cell that is about 1 / `share` of the shot's and parts its domain; empty where there is none.
std::vector<std::string> coarser(const Shot& shot, double share) {
  const sim::Options& o = shot.scene.options;
  const std::int64_t common = sim::common_parts(o);
  std::int64_t fewest = std::numeric_limits<std::int64_t>::max();
  for (int a = 0; a < o.dimension; ++a) fewest = std::min<std::int64_t>(fewest, std::llround(o.domain.size()[a] / o.cell));
  std::int64_t best = 0;
  for (std::int64_t parts = 1; parts < common; ++parts) {
    if (fewest * parts / common < 4) continue;
    const auto away = [&](std::int64_t n) { return std::abs(std::log(double(n) / double(common) / share)); };
    if (best == 0 || away(parts) < away(best)) best = parts;
  }
  if (best == 0) return {};
  const double ratio = double(common) / double(best);
  std::vector<std::string> sets = {"sim.cell=" + base::to_text(o.cell * ratio)};
  if (o.dimension == 3 && shot.surface.voxel) sets.push_back("surface.voxel=" + base::to_text(*shot.surface.voxel * ratio));
  if (o.dimension == 3 && shot.surface.radius) sets.push_back("surface.radius=" + base::to_text(*shot.surface.radius * ratio));
  return sets;
}

/// What cells of this size [m] would lose, "body A has no particle"; empty where nothing is lost.
std::string lost(const Shot& shot, double cell) {
  sim::Scene scene = shot.scene;
  scene.options.cell = cell;
  sim::measure_meshes(scene);
  if (const auto empty = sim::find_empty_body(scene)) return empty->name + " has no particle";
  const std::vector<double> before = sim::flows(shot.scene), after = sim::flows(scene);
  for (std::size_t s = 0; s < before.size(); ++s)   // a source is made of whole cells
    if (std::abs(after[s] - before[s]) > 0.01 * before[s])
      return fmt::format("source {} pours {:.3g} m^3/s in place of {:.3g}", scene.sources[s].name, after[s], before[s]);
  if (const auto refused = sim::find_refused_mesh(scene)) return fmt::format("collider {} is too thin", scene.colliders[*refused].name);
  if (const auto unmet = sim::find_unmet_collider(scene)) return fmt::format("collider {} is too thin", scene.colliders[unmet->number].name);
  return {};
}

}  // namespace

Coarser coarser_cells(const Shot& shot) {
  Coarser found;
  std::string cells, losing;
  for (const double share : {0.25, 0.5}) {
    std::vector<std::string> sets = coarser(shot, share);
    if (sets.empty() || std::find(found.sets.begin(), found.sets.end(), sets) != found.sets.end()) continue;
    const double cell = std::stod(sets.front().substr(sets.front().find('=') + 1));
    if (const std::string what = lost(shot, cell); !what.empty()) {
      losing += fmt::format("; not in cells of {:.3g} m, in which {}", cell, what);
      continue;
    }
    cells += (cells.empty() ? "" : " and ") + fmt::format("{:.3g}", cell);
    found.sets.push_back(std::move(sets));
  }
  if (found.sets.empty())
    throw error_about(shot, {.key = "sim.cell",
                             .hint = "--vary sim.cell=... says which to try",
                             .message = losing.empty() ? "no coarser cell parts the domain" : "no coarser cell does for every body and collider" + losing});
  found.told = "cells of " + cells + " m: of those that fill the domain in whole numbers the nearest to four times and twice the shot's" + losing;
  return found;
}

}  // namespace app
