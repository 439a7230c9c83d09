#include "sim/mesh_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <unsupported/Eigen/BVH>

#include "base/parallel.h"

namespace sim {
namespace {

/// The place of a triangle that is nearest to a point: a corner, on an edge or in the face, whichever region the point is over [Ericson05, 5.1.5].
base::Vec3 nearest_on(const std::array<base::Vec3, 3>& t, const base::Vec3& at) {
  const base::Vec3 ab = t[1] - t[0], ac = t[2] - t[0], from_a = at - t[0], from_b = at - t[1], from_c = at - t[2];
  const double ab_a = ab.dot(from_a), ac_a = ac.dot(from_a), ab_b = ab.dot(from_b), ac_b = ac.dot(from_b), ab_c = ab.dot(from_c), ac_c = ac.dot(from_c);
  if (ab_a <= 0 && ac_a <= 0) return t[0];
  if (ab_b >= 0 && ac_b <= ab_b) return t[1];
  if (ac_c >= 0 && ab_c <= ac_c) return t[2];
  const double a = ab_b * ac_c - ab_c * ac_b, b = ab_c * ac_a - ab_a * ac_c, c = ab_a * ac_b - ab_b * ac_a;   // what the corners weigh
  if (c <= 0 && ab_a >= 0 && ab_b <= 0) return t[0] + ab_a / (ab_a - ab_b) * ab;
  if (b <= 0 && ac_a >= 0 && ac_c <= 0) return t[0] + ac_a / (ac_a - ac_c) * ac;
  const double past_b = ac_b - ab_b, past_c = ab_c - ac_c;
  if (a <= 0 && past_b >= 0 && past_c >= 0) return t[1] + past_b / (past_b + past_c) * (t[2] - t[1]);
  return t[0] + (b * ab + c * ac) / (a + b + c);
}

/// The place of a mesh's surface that is nearest to a point. What lies between two pieces that overlap or touch is none of it.
class Nearest {
 public:
  /// `aside` [m] is how far beside the surface it is asked what lies there.
  Nearest(const ClosedMesh& mesh, double aside) : mesh_(mesh), aside_(aside) {
    std::vector<std::uint32_t> numbers(mesh.triangles());
    std::iota(numbers.begin(), numbers.end(), 0u);
    std::vector<Eigen::AlignedBox3d> boxes;
    for (const std::uint32_t t : numbers) {
      Eigen::AlignedBox3d& box = boxes.emplace_back();
      for (const base::Vec3& corner : mesh.triangle(t)) box.extend(corner);
    }
    tree_.init(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
  }
  /// `triangle` is where the search begins, best near a place asked for before, and then the one that is nearest.
  base::Vec3 operator()(const base::Vec3& at, bool is_inside, std::uint32_t& triangle) const {
    Search search{*this, at, is_inside, std::numeric_limits<double>::max(), triangle, at};
    search.minimumOnObject(triangle);
    Eigen::BVMinimize(tree_, search);
    triangle = search.triangle;
    return search.found;
  }

 private:
  struct Search {
    using Scalar = double;
    const Nearest& nearest;
    base::Vec3 at;
    bool is_inside;
    double least;
    std::uint32_t triangle;
    base::Vec3 found;
    double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
      const double d = box.squaredExteriorDistance(at);
      return d < least ? d : std::numeric_limits<double>::max();   // not looked into
    }
    double minimumOnObject(std::uint32_t t) {
      const std::array<base::Vec3, 3> corners = nearest.mesh_.triangle(t);
      const base::Vec3 near = nearest_on(corners, at);
      const double d = (at - near).squaredNorm();
      if (!(d < least) || (is_inside && nearest.is_buried(near, corners))) return std::numeric_limits<double>::max();
      least = d, triangle = t, found = near;
      return d;
    }
  };
  /// Whether both sides of a triangle are inside at one of its places.
  bool is_buried(const base::Vec3& place, const std::array<base::Vec3, 3>& corners) const {
    const base::Vec3 outward = aside_ * (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    return mesh_.inside(place + outward) && mesh_.inside(place - outward);
  }

  const ClosedMesh& mesh_;
  double aside_;
  Eigen::KdBVH<double, 3, std::uint32_t> tree_;
};

constexpr int kDepths = 7;   // a cell over eight, and so on in powers of two to eight cells

/// The parts of the surface [1] within a box that have less than each depth of the solid under them, from `finest` [m] on and each twice the one before,
/// by the middles of its triangles. A wall that comes after a gap does not count for the depth of the one before.
std::array<double, kDepths> parts_thinner(double finest, const ClosedMesh& mesh, const base::Box& within) {
  using Areas = std::array<double, kDepths + 1>;   // by the first depth that is outside; the last: none is
  const Areas areas = base::ordered_reduce(mesh.triangles(), 1024, Areas{}, [&](std::size_t begin, std::size_t end) {
    Areas part{};
    for (std::size_t t = begin; t < end; ++t) {
      const auto [a, b, c] = mesh.triangle(t);
      const base::Vec3 low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c), twice = (b - a).cross(c - a);
      const double area = twice.norm();
      if (area == 0 || (low.array() > within.upper.array()).any() || (high.array() < within.lower.array()).any()) continue;
      int depth = 0;
      while (depth < kDepths && mesh.inside((a + b + c) / 3 - std::ldexp(finest, depth) / area * twice)) ++depth;
      part[std::size_t(depth)] += area;
    }
    return part;
  }, [](Areas all, const Areas& part) {
    for (std::size_t n = 0; n < all.size(); ++n) all[n] += part[n];
    return all;
  });
  const double all = std::accumulate(areas.begin(), areas.end(), 0.0);
  std::array<double, kDepths> thinner{};
  for (std::size_t n = 0; all > 0 && n < thinner.size(); ++n) thinner[n] = (n > 0 ? thinner[n - 1] : 0) + areas[n] / all;
  return thinner;
}

}  // namespace

MeshDistance::MeshDistance(std::shared_ptr<const ClosedMesh> mesh, double cell, const base::Vec3& origin, const base::Box& within)
    : mesh_(std::move(mesh)) {
  constexpr double kFewThin = 0.05, kMostBricks = 3e7, kFinest = 1.0 / 8;   // the last in cells
  const std::array<double, kDepths> thinner = parts_thinner(kFinest * cell, *mesh_, within);
  if (thinner.front() > kFewThin) {
    objection_ = fmt::format("is thinner than an eighth of sim.cell on {:.0f} % of its surface: liquid would pass", 100 * thinner.front());
    return;
  }
  const auto thick = std::find_if(thinner.rbegin(), thinner.rend(), [](double part) { return part <= kFewThin; }).base() - thinner.begin() - 1;
  constexpr std::ptrdiff_t kHalfACell = 2;   // of the depths
  const auto apart = std::min(thick, kHalfACell);
  thickness_ = std::ldexp(kFinest * cell, int(thick));
  spacing_ = std::ldexp(kFinest * cell, int(apart));
  part_too_thin_ = thinner[std::size_t(apart)];
  const double margin = kBand * spacing_, edge = kEdge * spacing_;
  const base::Box& bounds = mesh_->bounds();
  double count = 1;
  for (int a = 0; a < 3; ++a) {
    const double low = std::max(bounds.lower[a], within.lower[a]) - margin, high = std::min(bounds.upper[a], within.upper[a]) + margin;
    lower_[a] = origin[a] + std::floor((low - origin[a]) / spacing_) * spacing_;
    const double along = std::max(std::ceil((high - lower_[a]) / edge), 0.0);   // none: nobody meets it
    bricks_[std::size_t(a)] = std::int64_t(std::min(along, kMostBricks));
    count *= along;
  }
  if (!(count <= kMostBricks)) objection_ = fmt::format("is {:.3g} m long: too large for cells of {:.3g} m", bounds.size().maxCoeff(), cell);
}

void MeshDistance::prepare() const {
  if (objection_.empty()) std::call_once(is_computed_, [this] { compute(); });
}

void MeshDistance::compute() const {
  if (bricks_[0] * bricks_[1] * bricks_[2] == 0) return;   // it is nowhere near
  const ClosedMesh& mesh = *mesh_;
  const double margin = kBand * spacing_, edge = kEdge * spacing_;
  const Nearest nearest(mesh, 1e-3 * spacing_);
  const double half_diagonal = edge * std::sqrt(3.0) / 2;
  std::vector<Far> of_middle(std::size_t(bricks_[0] * bricks_[1] * bricks_[2]));
  const auto row = std::size_t(bricks_[2]);
  base::parallel_chunks(of_middle.size() / row, 4, [&](std::size_t begin, std::size_t end) {
    std::uint32_t triangle = 0;
    for (std::size_t b = begin * row; b < end * row; ++b) {
      const base::Vec3 at = middle_of(std::int64_t(b));
      const bool is_inside = mesh.inside(at);
      const base::Vec3 way = (is_inside ? -1 : 1) * (at - nearest(at, is_inside, triangle));
      of_middle[b] = {float(is_inside ? -way.norm() : way.norm()), way.norm() > 0 ? base::Vec3f(way.normalized().cast<float>()) : base::Vec3f(base::Vec3f::UnitZ())};
    }
  });
  std::vector<std::int64_t> close;
  for (std::size_t b = 0; b < of_middle.size(); ++b) {
    if (double(std::abs(of_middle[b].distance)) > half_diagonal + margin) {
      far_.push_back(of_middle[b]);
      brick_.push_back(-std::int32_t(far_.size()));
    } else {
      brick_.push_back(std::int32_t(close.size()));
      close.push_back(std::int64_t(b));
    }
  }
  points_.resize(close.size() * kPerBrick);
  base::parallel_chunks(close.size(), 4, [&](std::size_t begin, std::size_t end) {
    std::uint32_t triangle = 0;
    for (std::size_t n = begin; n < end; ++n) {
      const base::Vec3 corner = middle_of(close[n]) - base::Vec3::Constant(edge / 2);
      for (int k = 0; k < int(kPerBrick); ++k) {
        const int along_z = k / kPoints % 2 ? kPoints - 1 - k % kPoints : k % kPoints;   // there and back: each point beside the one before
        const int along_y = k / (kPoints * kPoints) % 2 ? kPoints - 1 - k / kPoints % kPoints : k / kPoints % kPoints, along_x = k / (kPoints * kPoints);
        const base::Vec3 at = corner + spacing_ * base::Vec3(along_x, along_y, along_z);
        const bool is_inside = mesh.inside(at);
        const double distance = (at - nearest(at, is_inside, triangle)).norm();
        points_[n * kPerBrick + std::size_t((along_x * kPoints + along_y) * kPoints + along_z)] = float(is_inside ? -distance : distance);
      }
    }
  });
}

base::Vec3 MeshDistance::middle_of(std::int64_t brick) const {
  const std::array<std::int64_t, 3> at{brick / (bricks_[1] * bricks_[2]), brick / bricks_[2] % bricks_[1], brick % bricks_[2]};
  base::Vec3 middle = lower_;
  for (std::size_t a = 0; a < 3; ++a) middle[int(a)] += (double(at[a]) + 0.5) * kEdge * spacing_;
  return middle;
}

double MeshDistance::linear(const float* points, const base::Vec3& in_brick, base::Vec3* normal) const {
  std::array<int, 3> first;
  base::Vec3 t;
  for (int a = 0; a < 3; ++a) {
    first[std::size_t(a)] = std::clamp(int(in_brick[a]), 0, kEdge - 1);
    t[a] = in_brick[a] - first[std::size_t(a)];
  }
  const float* const c = points + (first[0] * kPoints + first[1]) * kPoints + first[2];
  constexpr int x = kPoints * kPoints, y = kPoints;
  const auto along = [](double low, double high, double part) { return low + part * (high - low); };
  const std::array<double, 4> on_z{along(c[0], c[1], t.z()), along(c[y], c[y + 1], t.z()), along(c[x], c[x + 1], t.z()), along(c[x + y], c[x + y + 1], t.z())};
  const double lower = along(on_z[0], on_z[1], t.y()), upper = along(on_z[2], on_z[3], t.y());
  if (normal) {
    const auto slope_z = [&](int at) { return double(c[at + 1]) - double(c[at]); };
    *normal = {upper - lower, along(on_z[1] - on_z[0], on_z[3] - on_z[2], t.x()),
               along(along(slope_z(0), slope_z(y), t.y()), along(slope_z(x), slope_z(x + y), t.y()), t.x())};
    const double length = normal->norm();
    *normal = length > 0 ? base::Vec3(*normal / length) : base::Vec3(base::Vec3::UnitZ());
  }
  return along(lower, upper, t.x());
}

double MeshDistance::distance(const base::Vec3& at, base::Vec3* normal) const {
  const base::Vec3 where = (at - lower_) / (kEdge * spacing_);   // [bricks]
  bool is_held = !brick_.empty();
  for (int a = 0; a < 3; ++a) is_held = is_held && where[a] >= 0 && where[a] < double(bricks_[std::size_t(a)]);
  if (!is_held) {
    const base::Vec3 gap = (at - mesh_->bounds().upper).cwiseMax(0.0) - (mesh_->bounds().lower - at).cwiseMax(0.0);
    const bool is_outside = !gap.isZero(0);
    if (normal) *normal = is_outside ? gap.normalized() : base::Vec3::UnitZ();
    return is_outside ? gap.norm() : mesh_->inside(at) ? -spacing_ : spacing_;
  }
  const base::Vec3 brick = where.array().floor();
  const auto number = (std::int64_t(brick.x()) * bricks_[1] + std::int64_t(brick.y())) * bricks_[2] + std::int64_t(brick.z());
  const std::int32_t held = brick_[std::size_t(number)];
  if (held >= 0) return linear(&points_[std::size_t(held) * kPerBrick], kEdge * (where - brick), normal);
  const Far& far = far_[std::size_t(-1 - held)];
  if (normal) *normal = far.normal.cast<double>();
  const double off = (at - middle_of(number)).norm();
  return far.distance < 0 ? double(far.distance) + off : double(far.distance) - off;
}

}  // namespace sim
