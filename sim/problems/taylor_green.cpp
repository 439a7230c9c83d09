#include "sim/problems/taylor_green.h"

#include <cmath>

#include <fmt/format.h>

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

  std::string shot() const override { return periodic_box(flat_ ? 2 : 3, "0.015625"); }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = periodic_objection(scene, flat_ ? 2 : 3); !plain.empty()) return plain;
    const double cells = scene.options.domain.size().x() / scene.options.cell / double(waves_);   // a wavelength
    if (cells < 4 * (1 - 1e-9))
      return fmt::format("problem.waves = {}: a wavelength has {:.3g} cells of sim.cell = {:.4g} m, and needs 4", waves_, cells, scene.options.cell);
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
