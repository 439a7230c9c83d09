#include "sim/blame.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <fmt/format.h>

namespace sim {
namespace {

/// Whatever is no number stands out most.
double standing(double value) { return std::isfinite(value) ? value : std::numeric_limits<double>::infinity(); }

int body_at(const Scene& scene, const Frame& f, std::size_t row) {
  if (!f.body.empty()) return int(f.body[row]);
  return scene.bodies.size() == 1 && scene.sources.empty() ? 0 : -1;
}

struct Found {
  std::size_t row = 0;   // of the frame
  double value = -1;
  void see(std::size_t at, double v) {
    if (v > value) row = at, value = v;
  }
};

Found fastest(const Frame& f) {
  Found found;
  for (std::size_t p = 0; p < f.velocity.size(); ++p) found.see(p, standing(f.velocity[p].cast<double>().norm()));
  return found;
}

/// Rows of coefficients are in the order of the ids beside them.
Found largest_coefficient(const State& state, const Frame& f) {
  const std::vector<double> all = reals(state, "coefficients");
  std::vector<std::int64_t> id;
  const Column* const column = state.find("coefficients");
  Found found;
  if (!column || column->rows == 0 || !read_column<std::int64_t>(state, "id", column->rows, 1, id)) return found;
  for (std::size_t k = 0; k < all.size(); ++k) found.see(k / std::size_t(column->width), standing(std::abs(all[k])));
  found.row = std::size_t(std::lower_bound(f.id.begin(), f.id.end(), id[found.row]) - f.id.begin());
  return found;
}

/// J of a particle whose row holds F - I and its law's own number.
double volume_ratio(const double* row, int dimension, bool is_liquid) {
  if (is_liquid) return 1 + row[dimension * dimension];
  Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
  for (int i = 0; i < dimension; ++i)
    for (int k = 0; k < dimension; ++k) f(i, k) += row[i * dimension + k];
  return f.determinant();
}

/// By the logarithm of J and the size of F - I. Rows of deformations are in the order of ids.
Found most_deformed(const Scene& scene, const State& state, const Frame& f, double* volume) {
  const std::vector<double> all = reals(state, "deformation");
  const int d = int(scene.options.dimension);
  const std::size_t width = std::size_t(d * d + 1);
  Found found;
  for (std::size_t p = 0; p * width < all.size() && p < f.id.size(); ++p) {
    const int body = body_at(scene, f, p);
    const bool is_liquid = body >= 0 && scene.bodies[std::size_t(body)].solid.model == Elasticity::tait;
    const double j = volume_ratio(&all[p * width], d, is_liquid), logarithm = std::log(std::max(std::abs(j), 1e-30));
    double square = logarithm * logarithm;
    for (std::size_t k = 0; k + 1 < width && !is_liquid; ++k) square += all[p * width + k] * all[p * width + k];
    if (standing(square) > found.value) *volume = j;
    found.see(p, standing(square));
  }
  return found;
}

}  // namespace

std::string particle_text(const Scene& scene, const Frame& f, std::size_t row) {
  const base::Vec3 x = f.position[row].cast<double>(), place = (x - scene.options.domain.lower) / scene.options.cell;
  const int body = body_at(scene, f, row);
  std::string text = fmt::format("particle {}", f.id[row]);
  if (body >= 0) text += " of body " + scene.bodies[std::size_t(body)].name;
  text += ", cell (";
  for (int a = 0; a < int(scene.options.dimension); ++a) text += fmt::format("{}{:.0f}", a > 0 ? ", " : "", std::floor(place[a]));
  return text + fmt::format("), ({:.4g}, {:.4g}, {:.4g}) m", x.x(), x.y(), x.z());
}

Culprit find_culprit(Suspect suspect, const Scene& scene, const Simulation& simulation) {
  const Frame f = simulation.frame();
  if (f.id.empty()) return {};
  Found found;
  std::string how, much;
  if (suspect == Suspect::largest_coefficient && (found = largest_coefficient(simulation.state(), f)).value >= 0)
    how = "the largest is of ", much = fmt::format("{:.4g} m/s", found.value);
  double volume = 1;
  if (suspect == Suspect::most_deformed && (found = most_deformed(scene, simulation.state(), f, &volume)).value >= 0)
    how = "the most deformed is ", much = fmt::format("J = {:.4g}", volume);
  if (how.empty()) found = fastest(f), how = "the fastest is ", much = fmt::format("{:.4g} m/s", found.value);
  return {how + particle_text(scene, f, found.row) + ", " + much, body_at(scene, f, found.row)};
}

}  // namespace sim
