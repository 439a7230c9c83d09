#include "sim/problems/taylor_green.h"

#include <cmath>

#include "sim/problems/problems.h"

namespace sim {

template <int D>
VelocityAt<D> taylor_green_velocity(int waves, double edge, const base::Vec3& mean) {
  const double k = 2 * M_PI * waves / edge, speed = taylor_green_speed(edge);
  return [k, speed, mean](const Vec<D, double>& at, double time) {
    const double x = k * (at[0] - mean.x() * time), y = k * (at[1] - mean.y() * time);
    Vec<D, double> v = mean.head<D>();
    v[0] += speed * std::sin(x) * std::cos(y);
    v[1] -= speed * std::cos(x) * std::sin(y);
    return v;
  };
}
template VelocityAt<2> taylor_green_velocity<2>(int, double, const base::Vec3&);
template VelocityAt<3> taylor_green_velocity<3>(int, double, const base::Vec3&);

namespace {

class TaylorGreen final : public Problem {
 public:
  explicit TaylorGreen(int dimension) : flat_(dimension == 2) {}

  void params(base::Params& p) override {
    p("waves", waves_, "1", "vortex pairs along an edge of the domain", base::within(1, 1e6));
    p("mean", mean_, "m/s", "a flow that carries the vortices along; their greatest speed is 0.159 in a domain of edge 1");
    p("time", time_, "s", "until when; after 5 a particle between the vortices of one wave has gone once through all of them", base::above(0));
  }

  std::string shot() const override {
    return flat_ ? R"(
[sim]
dimension = 2
domain = [[0, 0], [1, 1]]
cell = 0.015625
particles_per_cell = 4
precision = "double"
cfl = 0.5
pressure_tolerance = 1e-8
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic" }
[[body]]
name = "all"
shape = { box = [[0, 0], [1, 1]] }
)"
                 : R"(
[sim]
domain = [[0, 0, 0], [1, 1, 0.125]]
cell = 0.015625
cfl = 0.5
boundary = { x_lower = "periodic", x_upper = "periodic", y_lower = "periodic", y_upper = "periodic", z_lower = "periodic", z_upper = "periodic" }
[[body]]
name = "all"
shape = { box = [[0, 0, 0], [1, 1, 0.125]] }
)";
  }

  std::string objection(const Scene& scene) const override {
    const Options& o = scene.options;
    const base::Vec3 size = o.domain.size();
    if (o.is_solid()) return "needs sim.solver = \"fluid\"";
    if (o.dimension != (flat_ ? 2 : 3)) return flat_ ? "has two dimensions" : "has three dimensions";
    for (int a = 0; a < o.dimension; ++a)
      if (!o.periodic(a)) return "needs periodic sides";
    if (size.x() != size.y()) return "needs a domain as high as wide";
    if (o.cell * double(waves_) * 4 > size.x() * (1 + 1e-9)) return "needs four cells a wavelength: fewer hold no wave";
    if (!scene.effects.empty() || !scene.colliders.empty()) return "has no effects and no colliders";
    return "";
  }

  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    const double edge = scene.options.domain.size().x(), speed = taylor_green_speed(edge);
    return with_numbers(scene.options, [&](auto dimension, auto number) {
      constexpr int D = decltype(dimension)::value;
      KnownFlow<D, decltype(number)> flow(scene, taylor_green_velocity<D>(int(waves_), edge, mean_), speed);
      return answer(flow, {.time = time_, .dt = scene.options.cfl * scene.options.cell / speed, .mean = mean_}, ledger);
    });
  }

 private:
  bool flat_;
  std::int64_t waves_ = 1;
  base::Vec3 mean_ = base::Vec3::Zero();
  double time_ = 5;
};

}  // namespace

std::unique_ptr<Problem> make_taylor_green_2d() { return std::make_unique<TaylorGreen>(2); }
std::unique_ptr<Problem> make_taylor_green_3d() { return std::make_unique<TaylorGreen>(3); }

}  // namespace sim
