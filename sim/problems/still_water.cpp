// Water at rest in a tank: it should stay there. Particles are jittered and the surface lies within cells, so that what a scheme sees of it is not
// flat.
#include <cmath>

#include "sim/problems/followed.h"
#include "sim/problems/problems.h"

namespace sim {
namespace {

constexpr double kFps = 10;

class StillWater final : public Problem {
 public:
  explicit StillWater(int dimension) : dimension_(dimension) {}
  void params(base::Params& p) override { p("time", time_, "s", "until when; a wave goes once to and fro in about 0.9", base::above(0)); }
  std::string shot() const override {
    return dimension_ == 2 ? R"(
[sim]
dimension = 2
domain = [[0, 0], [1, 1]]
cell = 0.03125
[[body]]
name = "water"
shape = { box = [[0, 0], [1, 0.49]] }
[[effect]]
kind = "gravity"
acceleration = [0, -9.81]
)"
                           : R"(
[sim]
domain = [[0, 0, 0], [1, 0.5, 1]]
cell = 0.0625
[[body]]
name = "water"
shape = { box = [[0, 0, 0], [1, 0.5, 0.48]] }
[[effect]]
kind = "gravity"
acceleration = [0, 0, -9.81]
)";
  }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = plain_objection(scene, false, dimension_); !plain.empty()) return plain;
    return scene.effects.size() == 1 && scene.bodies[0].shape.box ? "" : "effect, body: must be gravity and a box of water here";
  }
  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    const auto simulation = make_simulation(scene, kFps);
    const int up = dimension_ - 1, frames = std::max(2, int(std::ceil(time_ * kFps - 1e-9)));
    const double gravity = scene.effects[0].acceleration.norm(), depth = scene.bodies[0].shape.box->size()[up];
    double swirl = 0, first_height = 0, last_height = 0, drift = 0;
    int seen = 0;
    ProblemResult result = follow(*simulation, frames, ledger, [&](const Totals& t) {
      const double height = t.potential_energy / (t.mass * gravity);
      if (seen == 0) first_height = height;
      last_height = height;
      if (seen > frames / 2) swirl += 2 * t.kinetic_energy / t.mass / (gravity * depth) / (frames - frames / 2);
      drift = std::abs(t.volume_drift.value_or(0));
      ++seen;
    });
    result.errors.velocity = std::sqrt(swirl);
    result.errors.position = std::abs(last_height - first_height) / depth;
    result.errors.volume = drift;
    return result;
  }

 private:
  int dimension_;
  double time_ = 5;
};

}  // namespace

std::unique_ptr<Problem> make_hydrostatic_2d() { return std::make_unique<StillWater>(2); }
std::unique_ptr<Problem> make_hydrostatic_3d() { return std::make_unique<StillWater>(3); }

}  // namespace sim
