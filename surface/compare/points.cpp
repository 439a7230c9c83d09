// Points of two files, particle by particle.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "surface/scalars.h"
#include "surface/surface.h"

namespace surface {
namespace {

double largest_of(const std::vector<float>& values) {
  double largest = 0;
  for (const float v : values) largest = std::max(largest, std::abs(double(v)));
  return largest;
}

/// A scalar that both frames hold.
struct Shared {
  const std::vector<float>&a, &b;
  double largest;
};

}  // namespace

PointDifference compare_points(const std::filesystem::path& path_a, const std::filesystem::path& path_b, double limit) {
  const sim::Frame a = read_points(path_a), b = read_points(path_b);
  PointDifference result;
  result.count_a = a.id.size();
  result.count_b = b.id.size();
  result.position.limit = result.velocity.limit = limit;
  if (a.pscale != b.pscale) result.unlike.push_back("pscale: " + base::to_text(a.pscale) + " and " + base::to_text(b.pscale) + " m");
  const auto both_hold = [&](const std::string& name, bool in_a, bool in_b) {
    if (in_a != in_b) result.unlike.push_back(name + ": in the " + (in_a ? "first" : "second") + " only");
    return in_a && in_b;
  };
  const bool have_particles = !a.id.empty() && !b.id.empty();   // nothing holds a number of none
  const bool have_bodies = have_particles && both_hold("body", !a.body.empty(), !b.body.empty());
  std::vector<Shared> shared;
  for (const Scalar& s : kScalars) {
    const std::vector<float>&u = a.*s.values, &v = b.*s.values;
    if (!have_particles || !both_hold(s.name, !u.empty(), !v.empty())) continue;
    shared.push_back({u, v, std::max(largest_of(u), largest_of(v))});
    result.scalars.emplace_back(s.name, base::Differences{.limit = limit});
  }
  std::size_t i = 0, j = 0;   // ids ascend in both
  while (i < a.id.size() && j < b.id.size()) {
    if (a.id[i] < b.id[j]) ++result.only_a, ++i;
    else if (b.id[j] < a.id[i]) ++result.only_b, ++j;
    else {
      const double moved = (a.position[i].cast<double>() - b.position[j].cast<double>()).norm();
      const double faster = (a.velocity[i].cast<double>() - b.velocity[j].cast<double>()).norm();
      result.position.add(moved);
      result.velocity.add(faster);
      bool over = !(moved <= limit && faster <= limit) || (have_bodies && a.body[i] != b.body[j]);
      for (std::size_t s = 0; s < shared.size(); ++s) {
        const double apart = std::abs(double(shared[s].a[i]) - double(shared[s].b[j]));
        const double relative = apart > 0 ? apart / shared[s].largest : 0;
        result.scalars[s].second.add(relative);
        over = over || !(relative <= limit);
      }
      result.over += over;
      ++i, ++j;
    }
  }
  result.only_a += a.id.size() - i;
  result.only_b += b.id.size() - j;
  return result;
}

}  // namespace surface
