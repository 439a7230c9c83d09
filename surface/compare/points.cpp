// Points of two files, particle by particle.
#include "base/text.h"
#include "surface/surface.h"

namespace surface {

PointDifference compare_points(const std::filesystem::path& path_a, const std::filesystem::path& path_b, double limit) {
  const sim::Frame a = read_points(path_a), b = read_points(path_b);
  PointDifference result;
  result.count_a = a.id.size();
  result.count_b = b.id.size();
  result.position.limit = result.velocity.limit = limit;
  if (a.pscale != b.pscale) result.unlike.push_back("pscale: " + base::to_text(a.pscale) + " and " + base::to_text(b.pscale) + " m");
  std::size_t i = 0, j = 0;   // ids ascend in both
  while (i < a.id.size() && j < b.id.size()) {
    if (a.id[i] < b.id[j]) ++result.only_a, ++i;
    else if (b.id[j] < a.id[i]) ++result.only_b, ++j;
    else {
      const double moved = (a.position[i].cast<double>() - b.position[j].cast<double>()).norm();
      const double faster = (a.velocity[i].cast<double>() - b.velocity[j].cast<double>()).norm();
      result.position.add(moved);
      result.velocity.add(faster);
      if (moved > limit || faster > limit) ++result.over;
      ++i, ++j;
    }
  }
  result.only_a += a.id.size() - i;
  result.only_b += b.id.size() - j;
  return result;
}

}  // namespace surface
