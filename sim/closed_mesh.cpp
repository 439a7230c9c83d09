#include "sim/closed_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include <fmt/format.h>

namespace sim {
namespace {

/// How often, and which way, the outline of a triangle seen along z goes round a point: crossings of its edges with the ray along +x. An edge is
/// computed from its lower end to its upper one, whichever triangle asks: what one counts, its neighbour does not.
int turns_around(const std::array<base::Vec3, 3>& t, const base::Vec3& at) {
  int turns = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const base::Vec3 &a = t[k], &b = t[(k + 1) % 3];
    const bool up = a.y() <= at.y() && b.y() > at.y(), down = b.y() <= at.y() && a.y() > at.y();
    if (!up && !down) continue;
    const base::Vec3 &low = up ? a : b, &high = up ? b : a;
    const double x = low.x() + (at.y() - low.y()) / (high.y() - low.y()) * (high.x() - low.x());
    if (x > at.x()) turns += up ? 1 : -1;
  }
  return turns;
}

/// Height of a triangle's plane over a point, within the triangle's own heights: where it stands upright it has no other.
double height_at(const std::array<base::Vec3, 3>& t, const base::Vec3& at) {
  const base::Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const auto [low, high] = std::minmax({t[0].z(), t[1].z(), t[2].z()});
  if (normal.z() == 0) return low;
  return std::clamp(t[0].z() - ((at.x() - t[0].x()) * normal.x() + (at.y() - t[0].y()) * normal.y()) / normal.z(), low, high);
}

std::string place(const base::Vec3& at) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", at.x(), at.y(), at.z()); }

}  // namespace

ClosedMesh::ClosedMesh(const std::vector<base::Vec3f>& corners, const std::vector<Triangle>& triangles, double scale, const base::Vec3& translate) {
  std::map<std::tuple<float, float, float>, std::uint32_t> known;
  std::vector<std::uint32_t> number;
  for (const base::Vec3f& c : corners) {
    const auto [at, is_new] = known.try_emplace({c.x(), c.y(), c.z()}, std::uint32_t(corners_.size()));
    if (is_new) corners_.push_back(scale * c.cast<double>() + translate);
    number.push_back(at->second);
  }
  for (const Triangle& t : triangles) {
    const Triangle own{number[t[0]], number[t[1]], number[t[2]]};
    if (own[0] != own[1] && own[1] != own[2] && own[2] != own[0]) triangles_.push_back(own);   // slivers that have shrunk to a line close nothing
  }
  if (triangles_.empty()) {
    objection_ = "encloses nothing: it has no triangle with three corners";
    return;
  }
  bounds_ = {corners_.front(), corners_.front()};
  for (const base::Vec3& c : corners_) bounds_.lower = bounds_.lower.cwiseMin(c), bounds_.upper = bounds_.upper.cwiseMax(c);
  check_edges();
  if (!objection_.empty()) return;
  double volume = 0;
  for (const Triangle& t : triangles_)
    volume += (corners_[t[0]] - bounds_.lower).dot((corners_[t[1]] - bounds_.lower).cross(corners_[t[2]] - bounds_.lower));
  if (volume < 0) outward_ = -1;
  sort_into_columns();
}

void ClosedMesh::check_edges() {
  struct Edge {
    std::uint32_t low, high;
    int direction;   // +1 from low to high
  };
  std::vector<Edge> edges;
  for (const Triangle& t : triangles_)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return std::tie(a.low, a.high) < std::tie(b.low, b.high); });
  std::size_t open = 0, turned = 0, first_open = 0, first_turned = 0;
  for (std::size_t k = 0; k < edges.size();) {
    const std::size_t first = k;
    int balance = 0;
    for (; k < edges.size() && edges[k].low == edges[first].low && edges[k].high == edges[first].high; ++k) balance += edges[k].direction;
    if (balance == 0) continue;
    const bool is_open = (k - first) % 2 == 1;
    if (is_open && open++ == 0) first_open = first;
    if (!is_open && turned++ == 0) first_turned = first;
  }
  const auto between = [&](std::size_t k) { return place(corners_[edges[k].low]) + " to " + place(corners_[edges[k].high]); };
  if (open > 0)
    objection_ = fmt::format("is not closed: {} of its edges have a triangle on one side only, the first from {} m", open, between(first_open));
  else if (turned > 0)
    objection_ = fmt::format("has no inside: at {} of its edges one triangle is turned over, the first from {} m", turned, between(first_turned));
}

std::array<int, 2> ClosedMesh::column_of(const base::Vec3& at) const {
  std::array<int, 2> column;
  for (int a = 0; a < 2; ++a) {
    const double size = bounds_.upper[a] - bounds_.lower[a], share = size > 0 ? (at[a] - bounds_.lower[a]) / size : 0;
    column[std::size_t(a)] = int(std::clamp(std::floor(share * columns_[std::size_t(a)]), 0.0, columns_[std::size_t(a)] - 1.0));
  }
  return column;
}

void ClosedMesh::sort_into_columns() {
  const int edge = int(std::clamp(std::sqrt(double(triangles_.size()) / 2), 1.0, 2048.0));
  columns_ = {edge, edge};
  const auto for_columns = [&](const Triangle& t, const auto& body) {
    base::Vec3 low = corners_[t[0]], high = low;
    for (const std::uint32_t c : t) low = low.cwiseMin(corners_[c]), high = high.cwiseMax(corners_[c]);
    const std::array<int, 2> from = column_of(low), to = column_of(high);
    for (int i = from[0]; i <= to[0]; ++i)
      for (int j = from[1]; j <= to[1]; ++j) body(std::size_t(i) * std::size_t(columns_[1]) + std::size_t(j));
  };
  begin_.assign(std::size_t(edge) * std::size_t(edge) + 1, 0);
  for (const Triangle& t : triangles_) for_columns(t, [&](std::size_t c) { ++begin_[c + 1]; });
  for (std::size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  over_.resize(begin_.back());
  std::vector<std::uint32_t> next = begin_;
  for (std::size_t t = 0; t < triangles_.size(); ++t) for_columns(triangles_[t], [&](std::size_t c) { over_[next[c]++] = std::uint32_t(t); });
}

bool ClosedMesh::inside(const base::Vec3& at) const {
  if (!objection_.empty() || (at.array() < bounds_.lower.array()).any() || (at.array() > bounds_.upper.array()).any()) return false;
  const std::array<int, 2> column = column_of(at);
  const std::size_t c = std::size_t(column[0]) * std::size_t(columns_[1]) + std::size_t(column[1]);
  int winding = 0;
  for (std::uint32_t k = begin_[c]; k < begin_[c + 1]; ++k) {
    const Triangle& t = triangles_[over_[k]];
    const std::array<base::Vec3, 3> corners{corners_[t[0]], corners_[t[1]], corners_[t[2]]};
    const int turns = turns_around(corners, at);
    if (turns != 0 && height_at(corners, at) > at.z()) winding += turns;
  }
  return winding * outward_ > 0;
}

}  // namespace sim
