#include "app/study/distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "base/parallel.h"

namespace app {
namespace {

/// Unit vectors spread evenly over half a circle, or half a sphere (on a Fibonacci spiral).
std::vector<base::Vec3f> directions(std::int64_t dimension) {
  constexpr int kFlat = 16, kRound = 48;
  std::vector<base::Vec3f> all;
  if (dimension == 2)
    for (int i = 0; i < kFlat; ++i) all.emplace_back(float(std::cos(M_PI * (i + 0.5) / kFlat)), float(std::sin(M_PI * (i + 0.5) / kFlat)), 0.f);
  else
    for (int i = 0; i < kRound; ++i) {
      const double z = (i + 0.5) / kRound, r = std::sqrt(1 - z * z), angle = M_PI * (3 - std::sqrt(5.0)) * i;
      all.emplace_back(float(r * std::cos(angle)), float(r * std::sin(angle)), float(z));
    }
  return all;
}

/// Transport distance of two sorted samples: the area between their distribution functions.
double transport(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0, level = 0;
  const double n = double(a.size()), m = double(b.size());
  for (std::size_t i = 0, k = 0; i < a.size() && k < b.size();) {
    const double end_a = double(i + 1) / n, end_b = double(k + 1) / m, end = std::min(end_a, end_b);
    sum += (end - level) * std::abs(double(a[i]) - double(b[k]));
    level = end;
    if (end_a <= end) ++i;
    if (end_b <= end) ++k;
  }
  return sum;
}

using Key = std::int64_t;

/// Vertices by the cube of edge `edge` that they lie in.
class VertexTable {
 public:
  VertexTable(const surface::Mesh& mesh, double edge) : mesh_(mesh), edge_(edge) {
    for (std::size_t i = 0; i < mesh.position.size(); ++i) cubes_[key(cube(mesh.position[i]))].push_back(std::uint32_t(i));
  }
  double distance(const base::Vec3f& at) const {
    const std::array<std::int64_t, 3> middle = cube(at);
    double nearest = std::numeric_limits<double>::infinity();
    std::uint32_t vertex = 0;
    for (std::int64_t shell = 0; shell <= kMostShells; ++shell) {
      if (nearest <= edge_ * double(shell - 1)) break;   // what lies in this shell is farther
      for (std::int64_t i = -shell; i <= shell; ++i)
        for (std::int64_t j = -shell; j <= shell; ++j)
          for (std::int64_t k = -shell; k <= shell; ++k) {
            if (std::max({std::abs(i), std::abs(j), std::abs(k)}) != shell) continue;
            const auto found = cubes_.find(key({middle[0] + i, middle[1] + j, middle[2] + k}));
            if (found == cubes_.end()) continue;
            for (const std::uint32_t v : found->second)
              if (const double d = (mesh_.position[v] - at).norm(); d < nearest) nearest = d, vertex = v;
          }
    }
    if (!std::isfinite(nearest)) return edge_ * kMostShells;
    return nearest < edge_ ? std::abs(double(mesh_.normal[vertex].dot(at - mesh_.position[vertex]))) : nearest;
  }

 private:
  static constexpr std::int64_t kMostShells = 12;   // farther than that is as far as that
  std::array<std::int64_t, 3> cube(const base::Vec3f& at) const {
    return {std::int64_t(std::floor(at.x() / edge_)), std::int64_t(std::floor(at.y() / edge_)), std::int64_t(std::floor(at.z() / edge_))};
  }
  static Key key(const std::array<std::int64_t, 3>& c) { return (c[0] * 2097152 + c[1]) * 2097152 + c[2]; }
  const surface::Mesh& mesh_;
  double edge_;
  std::unordered_map<Key, std::vector<std::uint32_t>> cubes_;
};

double mean_distance(const surface::Mesh& from, const VertexTable& to) {
  const double sum = base::ordered_reduce(from.position.size(), 1024, 0.0, [&](std::size_t begin, std::size_t end) {
    double part = 0;
    for (std::size_t i = begin; i < end; ++i) part += to.distance(from.position[i]);
    return part;
  }, [](double a, double b) { return a + b; });
  return sum / double(from.position.size());
}

}  // namespace

Projections::Projections(const sim::Frame& frame, std::int64_t dimension) : dimension_(dimension) {
  const std::vector<base::Vec3f> along = directions(dimension);
  sorted_.resize(along.size());
  base::parallel_chunks(along.size(), 1, [&](std::size_t d, std::size_t) {
    std::vector<float>& line = sorted_[d];
    line.reserve(frame.position.size());
    for (const base::Vec3f& x : frame.position) line.push_back(along[d].dot(x));
    std::sort(line.begin(), line.end());
  });
}

double Projections::distance(const Projections& other) const {
  const double sum = base::ordered_reduce(sorted_.size(), 1, 0.0, [&](std::size_t d, std::size_t) { return transport(sorted_[d], other.sorted_[d]); },
                                          [](double a, double b) { return a + b; });
  const double seen = dimension_ == 2 ? 2 / M_PI : 0.5;   // the mean part of a displacement that a direction sees
  return sum / double(sorted_.size()) / seen;
}

VorticityGrid::VorticityGrid(const sim::Frame& frame, const sim::Options& o, double cell) {
  const int dimension = int(o.dimension);
  std::array<std::int64_t, 3> size{1, 1, 1};
  for (int a = 0; a < dimension; ++a) size[std::size_t(a)] = std::max<std::int64_t>(1, std::llround(o.domain.size()[a] / cell));
  const auto index = [&](std::int64_t i, std::int64_t j, std::int64_t k) { return std::size_t((i * size[1] + j) * size[2] + k); };
  std::vector<double> mass(std::size_t(size[0] * size[1] * size[2]), 0);
  std::vector<base::Vec3> velocity(mass.size(), base::Vec3::Zero());
  const double particle = std::pow(o.cell / cell, dimension) / double(o.particles_per_cell);   // of a full cell
  for (std::size_t p = 0; p < frame.position.size(); ++p) {
    std::array<std::int64_t, 3> low{};
    base::Vec3 part = base::Vec3::Zero();
    for (int a = 0; a < dimension; ++a) {
      const double x = (double(frame.position[p][a]) - o.domain.lower[a]) / cell - 0.5;
      low[std::size_t(a)] = std::int64_t(std::floor(x)), part[a] = x - std::floor(x);
    }
    for (int corner = 0; corner < 1 << dimension; ++corner) {
      std::array<std::int64_t, 3> at = low;
      double weight = particle;
      for (int a = 0; a < dimension; ++a) {
        const bool upper = corner >> a & 1;
        weight *= upper ? part[a] : 1 - part[a];
        at[std::size_t(a)] = std::clamp<std::int64_t>(at[std::size_t(a)] + upper, 0, size[std::size_t(a)] - 1);   // walls have nothing behind them
      }
      const std::size_t i = index(at[0], at[1], at[2]);
      mass[i] += weight;
      velocity[i] += weight * frame.velocity[p].cast<double>();
    }
  }
  constexpr double kLeast = 0.25;
  for (std::size_t i = 0; i < mass.size(); ++i)
    if (mass[i] > 0) velocity[i] /= mass[i];
  curl_.assign(mass.size(), base::Vec3::Zero());
  known_.assign(mass.size(), 0);
  std::array<std::int64_t, 3> at{};
  for (at[0] = 0; at[0] < size[0]; ++at[0])
    for (at[1] = 0; at[1] < size[1]; ++at[1])
      for (at[2] = 0; at[2] < size[2]; ++at[2]) {
        const std::size_t i = index(at[0], at[1], at[2]);
        std::array<base::Vec3, 3> slope{base::Vec3::Zero(), base::Vec3::Zero(), base::Vec3::Zero()};   // dv/dx_a
        bool known = mass[i] >= kLeast;
        for (std::size_t a = 0; a < std::size_t(dimension) && known; ++a) {
          std::array<std::int64_t, 3> before = at, after = at;
          --before[a], ++after[a];
          known = before[a] >= 0 && after[a] < size[a];
          if (!known) break;
          const std::size_t b = index(before[0], before[1], before[2]), c = index(after[0], after[1], after[2]);
          known = mass[b] >= kLeast && mass[c] >= kLeast;
          slope[a] = (velocity[c] - velocity[b]) / (2 * cell);
        }
        if (!known) continue;
        known_[i] = 1;
        curl_[i] = {slope[1].z() - slope[2].y(), slope[2].x() - slope[0].z(), slope[0].y() - slope[1].x()};
      }
}

std::optional<double> VorticityGrid::distance(const VorticityGrid& other) const {
  double difference = 0, own = 0;
  for (std::size_t i = 0; i < curl_.size(); ++i) {
    if (known_[i]) own += curl_[i].squaredNorm();
    if (known_[i] || other.known_[i]) difference += (curl_[i] - other.curl_[i]).squaredNorm();
  }
  if (own == 0) return {};
  return std::sqrt(difference / own);
}

std::optional<double> surface_distance(const surface::Mesh& a, const surface::Mesh& b, double reach) {
  if (a.position.empty() || b.position.empty()) return {};
  return 0.5 * (mean_distance(a, VertexTable(b, reach)) + mean_distance(b, VertexTable(a, reach)));
}

}  // namespace app
