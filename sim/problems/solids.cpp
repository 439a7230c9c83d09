// Solids with known answers: spin, release, waves, a slope.
#include <algorithm>
#include <cmath>

#include "sim/problems/followed.h"
#include "sim/problems/problems.h"

namespace sim {

namespace {

constexpr double kFps = 20;

/// Lame's parameters of the only body [Pa].
struct Stiffness {
  double lambda, mu, bulk;
  explicit Stiffness(const Material& m)
      : lambda(m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson))), mu(m.young / (2 * (1 + m.poisson))), bulk(lambda + 2 * mu / 3) {}
};

/// change(particle, its entries) for every row of a column of the state.
template <class Change>
void change_column(Simulation& simulation, const char* name, const Change& change) {
  State state = simulation.state();
  std::vector<double> values = column_of(state, name);
  const std::size_t width = width_of(state, name);
  for (std::size_t p = 0; p * width < values.size(); ++p) change(p, values.data() + p * width);
  set_column(state, name, values);
  simulation.restore(state);
}

int frames_in(double time, double fps) { return std::max(1, int(std::ceil(time * fps - 1e-9))); }

/// Where energy stays: as plain_objection, and no plasticity.
std::string elastic_objection(const Scene& scene, int dimension) {
  if (std::string plain = plain_objection(scene, true, dimension); !plain.empty()) return plain;
  return scene.bodies[0].solid.plasticity == Plasticity::none ? "" : "body.NAME.material.plasticity: must be \"none\" here: energy stays";
}

/// A disk, or a sphere, let go while it spins. Energy and angular momentum stay; the mean of J - 1 over a long time is what the spin asks for:
/// rho w^2 R^2 / (4 (lambda + mu)) of a disk in plane strain, 2 rho w^2 R^2 / (15 K) of a sphere.
class Spinning final : public Problem {
 public:
  explicit Spinning(int dimension) : dimension_(dimension) {}
  void params(base::Params& p) override { p("time", time_, "s", "until when; a turn takes 1.57", base::above(0)); }
  std::string shot() const override {
    return dimension_ == 2 ? R"(
[sim]
solver = "solid"
dimension = 2
domain = [[0, 0], [1, 1]]
cell = 0.03125
precision = "double"
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic" }
[[body]]
name = "disk"
shape = { sphere = { center = [0.5, 0.5], radius = 0.2 } }
material = { model = "neo_hookean", density = 1, young = 200, poisson = 0.3 }
spin = 4
)"
                           : R"(
[sim]
solver = "solid"
domain = [[0, 0, 0], [0.625, 0.625, 0.625]]
cell = 0.0625
precision = "double"
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic", z_lower = "periodic", z_upper = "periodic" }
[[body]]
name = "sphere"
shape = { sphere = { center = [0.3125, 0.3125, 0.3125], radius = 0.2 } }
material = { model = "neo_hookean", density = 1, young = 200, poisson = 0.3 }
spin = [0, 0, 4]
)";
  }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = elastic_objection(scene, dimension_); !plain.empty()) return plain;
    if (!scene.bodies[0].shape.sphere || scene.bodies[0].spin.isZero(0)) return "body.NAME.spin: must not be 0, and the body a sphere";
    return scene.effects.empty() ? "" : "effect: there is none here";
  }
  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    const auto simulation = make_simulation(scene, kFps);
    double swelling = 0;
    int seen = 0;
    ProblemResult result =
        follow(*simulation, frames_in(time_, kFps), ledger, [&](const Totals&) { swelling += mean_swelling(simulation->state()), ++seen; });
    const Body& body = scene.bodies[0];
    const Stiffness stiff(body.solid);
    const double push = body.solid.density * body.spin.squaredNorm() * std::pow(body.shape.sphere->radius, 2);
    const double known = dimension_ == 2 ? push / (4 * (stiff.lambda + stiff.mu)) : 2 * push / (15 * stiff.bulk);
    result.errors.volume = std::abs(swelling / seen - known);
    return result;
  }

 private:
  /// J - 1, mean over the particles: 1 + the gradients' first-order and higher parts, without the 1.
  double mean_swelling(const State& state) const {
    const std::vector<double> d = column_of(state, "deformation");
    const std::size_t width = width_of(state, "deformation");
    double sum = 0;
    for (std::size_t k = 0; k < d.size(); k += width) {
      Eigen::Matrix3d f = Eigen::Matrix3d::Identity();
      for (int i = 0; i < dimension_; ++i)
        for (int j = 0; j < dimension_; ++j) f(i, j) += d[k + std::size_t(i * dimension_ + j)];
      sum += f.determinant() - 1;
    }
    return sum / double(d.size() / width);
  }
  int dimension_;
  double time_ = 4;
};

/// The energy test of [PolyPIC]: a square, pressed together by a tenth each way and let go.
class Released final : public Problem {
 public:
  void params(base::Params& p) override { p("time", time_, "s", "until when; it swings with a period of about 0.04", base::above(0)); }
  std::string shot() const override {
    return R"(
[sim]
solver = "solid"
dimension = 2
domain = [[0, 0], [1, 1]]
cell = 0.03125
precision = "double"
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic" }
[[body]]
name = "square"
shape = { box = [[0.375, 0.375], [0.625, 0.625]] }
material = { model = "neo_hookean", density = 1, young = 200, poisson = 0.3 }
)";
  }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = elastic_objection(scene, 2); !plain.empty()) return plain;
    return scene.effects.empty() ? "" : "effect: there is none here";
  }
  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    const auto simulation = make_simulation(scene, kOften);
    change_column(*simulation, "deformation", [](std::size_t, double* d) { d[0] = d[3] = -0.1; });
    return follow(*simulation, frames_in(time_, kOften), ledger);
  }

 private:
  static constexpr double kOften = 200;   // [1/s]
  double time_ = 0.25;
};

/// A standing wave in a bar that is held at its sides: v = sin(k x) at t = 0, without strain; sound goes as fast as sqrt((lambda + 2 mu) / rho).
class BarWave final : public Problem {
 public:
  void params(base::Params& p) override { p("amplitude", amplitude_, "1", "greatest speed over that of sound", base::between(0, 0.1)); }
  std::string shot() const override {
    return R"(
[sim]
solver = "solid"
dimension = 2
domain = [[0, 0], [1.6, 0.4]]
cell = 0.05
seeding = "regular"
precision = "double"
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic" }
[[body]]
name = "bar"
shape = { box = [[0, 0], [1.6, 0.4]] }
material = { model = "fixed_corotated", density = 1000, young = 1e5, poisson = 0.3 }
)";
  }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = elastic_objection(scene, 2); !plain.empty()) return plain;
    if (!scene.effects.empty()) return "effect: there is none here";
    return scene.options.periodic(0) && scene.options.periodic(1) ? "" : "sim.boundary: every side must be \"periodic\" here";
  }
  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    const double length = scene.options.domain.size().x(),
                 sound =
                     std::sqrt((Stiffness(scene.bodies[0].solid).lambda + 2 * Stiffness(scene.bodies[0].solid).mu) / scene.bodies[0].solid.density);
    const double period = length / sound, wave = 2 * M_PI * scene.options.cell / length;
    const auto simulation = make_simulation(scene, kFrames / period);
    const std::vector<double> start = places_of(simulation->state(), 0);
    change_column(*simulation, "coefficients", [&](std::size_t p, double* v) { v[0] = amplitude_ * sound * std::sin(wave * start[p]); });
    std::vector<double> share;   // of the velocity in sin(k x), frame by frame
    ProblemResult result = follow(*simulation, kFrames * 9 / 4, ledger, [&](const Totals&) {
      const State now = simulation->state();
      const std::vector<double> velocity = column_of(now, "coefficients"), x = places_of(now, 0);
      const std::size_t row = width_of(now, "coefficients");
      double sum = 0;
      for (std::size_t p = 0; p < x.size(); ++p) sum += velocity[p * row] * std::sin(wave * x[p]);
      share.push_back(sum);
    });
    std::vector<double> zeros;   // [frames]; the first is off by half a step: velocity and strain are half a step apart
    for (std::size_t f = 1; f < share.size(); ++f)
      if (share[f] * share[f - 1] < 0) zeros.push_back(double(f) - 1 + share[f - 1] / (share[f - 1] - share[f]));
    result.errors.position = zeros.size() < 4 ? 1 : std::abs(1.5 * kFrames / (zeros[3] - zeros[0]) - 1);
    return result;
  }

 private:
  static constexpr int kFrames = 200;   // in a period
  double amplitude_ = 1e-4;
};

/// A block on a slope, seen from the slope: gravity leans by the angle. It slides by g (sin - mu cos) t^2 / 2, and friction takes mu m g cos for
/// each metre.
class Slope final : public Problem {
 public:
  void params(base::Params& p) override { p("time", time_, "s", "until when; it must not have reached the end of the slope", base::above(0)); }
  std::string shot() const override {   // 30 degrees
    return R"(
[sim]
solver = "solid"
dimension = 2
domain = [[0, 0], [1.6, 0.4]]
cell = 0.025
precision = "double"
boundary = { friction = 0.3 }
[[body]]
name = "block"
shape = { box = [[0.1, 0], [0.3, 0.1]] }
material = { model = "fixed_corotated", density = 1000, young = 1e6, poisson = 0.3 }
[[effect]]
kind = "gravity"
acceleration = [4.905, -8.4957]
)";
  }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = plain_objection(scene, true, 2); !plain.empty()) return plain;
    if (scene.effects.size() != 1) return "effect: must be gravity here";
    if (scene.options.boundary[1][0] != Side::separating) return "sim.boundary.y_lower: must be \"separating\" here";
    const base::Vec3 g = scene.effects[0].acceleration;
    const double along = g.x() + scene.options.wall_friction * g.y(), way = 0.5 * along * time_ * time_;
    if (scene.bodies[0].shape.bounds().upper.x() + way > scene.options.domain.upper.x() - 2 * scene.options.cell)
      return "problem.time: the block reaches the end of the slope before";
    if (along > 0 && g.y() < 0) return "";
    return "effect.1.acceleration: must pull down a slope that is steeper than sim.boundary.friction holds";
  }
  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    const auto simulation = make_simulation(scene, kFps);
    const base::Vec3 g = scene.effects[0].acceleration;
    const auto middle = [&] {
      double sum = 0;
      const std::vector<double> x = places_of(simulation->state(), 0);
      for (const double at : x) sum += at;
      return scene.options.cell * sum / double(x.size());
    };
    const Totals start = simulation->totals();
    const double from = middle(), before = start.energy();
    ProblemResult result = follow(*simulation, frames_in(time_, kFps), ledger);
    const double friction = -scene.options.wall_friction * g.y(), t = result.time.back(), way = 0.5 * (g.x() - friction) * t * t;
    const Totals end = simulation->totals();
    result.errors.position = std::abs((middle() - from) / way - 1);
    result.errors.energy = std::abs(end.energy() - before + end.mass * friction * way) / (end.mass * g.x() * way);
    return result;
  }

 private:
  double time_ = 0.5;
};

}  // namespace

std::unique_ptr<Problem> make_spinning_disk_2d() { return std::make_unique<Spinning>(2); }
std::unique_ptr<Problem> make_spinning_sphere_3d() { return std::make_unique<Spinning>(3); }
std::unique_ptr<Problem> make_released_square() { return std::make_unique<Released>(); }
std::unique_ptr<Problem> make_bar_wave() { return std::make_unique<BarWave>(); }
std::unique_ptr<Problem> make_slope_block() { return std::make_unique<Slope>(); }

}  // namespace sim
