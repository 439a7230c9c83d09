#include "sim/problems/carried_flow.h"

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

VelocityAt<3> abc_velocity(int waves, double edge, const base::Vec3& mean) {
  const double k = 2 * M_PI * waves / edge, speed = edge / (2 * M_PI);
  return [k, speed, mean](const base::Vec3& at, double time) -> base::Vec3 {
    const base::Vec3 x = k * (at - time * mean);
    return mean + speed * base::Vec3(std::sin(x.z()) + std::cos(x.y()), std::sin(x.x()) + std::cos(x.z()), std::sin(x.y()) + std::cos(x.x()));
  };
}

namespace {

struct Kind {
  int dimension;
  std::string shot;
  const char* flow;               // in the plural
  double time;                    // [s] until when, unless asked for
  const char* meaning_of_time;
  double (*speed)(double edge);
  VelocityAt<2> (*in_plane)(int waves, double edge, const base::Vec3& mean);
  VelocityAt<3> (*in_space)(int waves, double edge, const base::Vec3& mean);
};

class CarriedFlow final : public Problem {
 public:
  explicit CarriedFlow(Kind kind) : kind_(std::move(kind)), time_(kind_.time) {}

  void params(base::Params& p) override {
    p("waves", waves_, "1", fmt::format("{} along an edge of the domain", kind_.flow), base::within(1, 1e6));
    p("mean", mean_, "m/s", fmt::format("a flow that carries them along; their greatest speed is {:.3f} in a domain of edge 1", kind_.speed(1)));
    p("time", time_, "s", kind_.meaning_of_time, base::above(0));
  }

  std::string shot() const override { return kind_.shot; }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = periodic_objection(scene, kind_.dimension); !plain.empty()) return plain;
    const double edge = scene.options.domain.size().x(), cells = edge / scene.options.cell / double(waves_);   // a wavelength
    if (const double deep = scene.options.domain.size().z() * double(waves_) / edge; !kind_.in_plane && (deep < 0.5 || std::abs(deep - std::round(deep)) > 1e-6))
      return fmt::format("sim.domain: must be a whole number of wavelengths deep, and is {:.4g}", deep);
    if (cells < 4 * (1 - 1e-9))
      return fmt::format("problem.waves = {}: a wavelength has {:.3g} cells of sim.cell = {:.4g} m, and needs 4", waves_, cells, scene.options.cell);
    return "";
  }

  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    const double edge = scene.options.domain.size().x(), speed = kind_.speed(edge);
    return with_numbers(scene.options, [&](auto dimension, auto number) {
      constexpr int D = decltype(dimension)::value;
      KnownFlow<D, decltype(number)> flow(scene, velocity<D>(edge), speed);
      return answer(flow, {.time = time_, .dt = scene.options.cfl * scene.options.cell / speed, .mean = mean_}, ledger);
    });
  }

 private:
  template <int D>
  VelocityAt<D> velocity(double edge) const {
    if constexpr (D == 2) return kind_.in_plane(int(waves_), edge, mean_);
    else return kind_.in_space(int(waves_), edge, mean_);
  }

  Kind kind_;
  std::int64_t waves_ = 1;
  base::Vec3 mean_ = base::Vec3::Zero();
  double time_;
};

constexpr const char* kOnceThrough = "until when; after 5 a particle between the vortices of one wave has gone once through all of them";

std::unique_ptr<Problem> make_taylor_green(int dimension) {
  return std::make_unique<CarriedFlow>(Kind{dimension, periodic_box(dimension, "0.015625"), "vortex pairs", 5, kOnceThrough, taylor_green_speed,
                                            taylor_green_velocity<2>, taylor_green_velocity<3>});
}

}  // namespace

std::unique_ptr<Problem> make_taylor_green_2d() { return make_taylor_green(2); }
std::unique_ptr<Problem> make_taylor_green_3d() { return make_taylor_green(3); }
std::unique_ptr<Problem> make_abc_flow() {
  return std::make_unique<CarriedFlow>(Kind{3, periodic_box(3, "0.03125", "1"), "waves", 2, "until when; the fastest particles go through .4 of an edge of 1 in a second", abc_speed, nullptr, abc_velocity});
}

}  // namespace sim
