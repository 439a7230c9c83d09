// A core that turns like a rigid body inside a periodic box: a circular vortex whose speed falls smoothly to zero before the sides. Every circular
// flow is a steady one (the pressure holds it), so the core turns for ever, and every particle of it is where the turn has taken it.
#include <cmath>

#include "sim/problems/known_flow.h"
#include "sim/problems/problems.h"

namespace sim {
namespace {

/// Speed over omega r: 1 in the core, 0 from the rim on, with smooth slopes between.
double share_of_spin(double r, double core, double rim) {
  if (r <= core) return 1;
  if (r >= rim) return 0;
  const double s = (r - core) / (rim - core);
  return (1 - s) * (1 - s) * (1 + 2 * s);
}

class RigidRotation final : public Problem {
 public:
  explicit RigidRotation(int dimension) : dimension_(dimension) {}
  void params(base::Params& p) override {
    p("turns", turns_, "1", "of the core", base::above(0));
    p("core", core_, "1", "radius of what turns rigidly, over the domain's edge; the flow ends at 0.45", base::between(0, kRim));
  }
  std::string shot() const override { return periodic_box(dimension_, dimension_ == 2 ? "0.015625" : "0.03125"); }
  std::string objection(const Scene& scene) const override { return periodic_objection(scene, dimension_); }
  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    return with_numbers(scene.options, [&](auto dimension, auto number) {
      return solve<decltype(dimension)::value, decltype(number)>(scene, ledger);
    });
  }

 private:
  static constexpr double kRim = 0.45, kSpin = 1;   // of the edge; [rad/s]

  template <int D, class Real>
  ProblemResult solve(const Scene& scene, base::Ledger& ledger) const {
    const double edge = scene.options.domain.size().x(), core = core_ * edge, rim = kRim * edge;
    const base::Vec3 middle = 0.5 * (scene.options.domain.lower + scene.options.domain.upper);
    const VelocityAt<D> exact = [=](const Vec<D, double>& at, double) {
      const double x = at[0] - middle.x(), y = at[1] - middle.y(), spin = kSpin * share_of_spin(std::hypot(x, y), core, rim);
      Vec<D, double> v = Vec<D, double>::Zero();
      v[0] = -spin * y, v[1] = spin * x;
      return v;
    };
    double fastest = 0;
    for (int i = 0; i <= 1000; ++i) fastest = std::max(fastest, kSpin * rim * i / 1000 * share_of_spin(rim * i / 1000, core, rim));
    KnownFlow<D, Real> flow(scene, exact, fastest);
    const std::vector<Vec<D, double>> start = flow.places();
    ProblemResult result = answer(flow, {.time = 2 * M_PI * turns_ / kSpin, .dt = scene.options.cfl * scene.options.cell / fastest}, ledger);
    const std::vector<Vec<D, double>> end = flow.places();
    const double angle = kSpin * flow.time();
    double squares = 0;
    std::int64_t inside = 0;
    for (std::size_t p = 0; p < start.size(); ++p) {
      const double x = start[p][0] - middle.x(), y = start[p][1] - middle.y();
      if (std::hypot(x, y) > core) continue;
      const double there = std::cos(angle) * x - std::sin(angle) * y, up = std::sin(angle) * x + std::cos(angle) * y;
      squares += std::pow(end[p][0] - middle.x() - there, 2) + std::pow(end[p][1] - middle.y() - up, 2);
      ++inside;
    }
    result.errors.position = std::sqrt(squares / double(std::max<std::int64_t>(1, inside))) / core;
    return result;
  }

  int dimension_;
  double turns_ = 1, core_ = 0.2;
};

}  // namespace

std::unique_ptr<Problem> make_rigid_rotation_2d() { return std::make_unique<RigidRotation>(2); }
std::unique_ptr<Problem> make_rigid_rotation_3d() { return std::make_unique<RigidRotation>(3); }

}  // namespace sim
