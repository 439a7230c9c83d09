// A vortex ring carries itself along at a speed that its radius, core and circulation give [Saffman70].
#include <cmath>
#include <vector>

#include "sim/problems/known_flow.h"
#include "sim/problems/problems.h"

namespace sim {
namespace {

// Cells of 1 m; the ring's axis is the edge y = z = 0 of the domain, whose walls are planes of symmetry: a quarter of it is there.
constexpr int kLength = 56, kSide = 28;
constexpr double kRadius = 10, kCore = 2.5, kCirculation = 10, kStart = 23, kWay = 10;   // [m], [m^2/s]

/// Stokes' stream function of a circular filament of circulation 1 [Lamb32 art 161].
double filament(double x, double r, double radius) {
  const double near = std::hypot(x, r - radius), far = std::hypot(x, r + radius), k = (far - near) / (far + near);
  return (near + far) / (2 * M_PI) * (std::comp_ellint_1(k) - std::comp_ellint_2(k));
}

/// Of a core with vorticity exp(-s^2 / kCore^2), as filaments on circles that hold the same circulation each.
double stream_function(double x, double r) {
  constexpr int kRings = 6, kAround = 12;
  double sum = 0;
  for (int i = 0; i < kRings; ++i) {
    const double s = kCore * std::sqrt(-std::log(1 - (i + 0.5) / kRings));
    for (int j = 0; j < kAround; ++j) {
      const double angle = 2 * M_PI * (j + 0.5 * (i % 2)) / kAround;
      sum += filament(x - s * std::cos(angle), r, kRadius + s * std::sin(angle));
    }
  }
  return kCirculation * sum / (kRings * kAround);
}

/// Velocity of the ring, along and away from its axis, between numbers every half metre.
class Ring {
 public:
  Ring() : along_(kColumns * kRows), out_(kColumns * kRows) {
    for (int i = 0; i < kColumns; ++i)
      for (int j = 0; j < kRows; ++j) {
        const double x = i * kEvery - kStart, r = std::max(j * kEvery, 1e-6), below = std::max(r - kEvery, 0.0);
        const auto at = std::size_t(i * kRows + j);
        along_[at] = (stream_function(x, r + kEvery) - stream_function(x, below)) / (0.5 * (std::pow(r + kEvery, 2) - std::pow(below, 2)));
        out_[at] = j == 0 ? 0 : -(stream_function(x + kEvery, r) - stream_function(x - kEvery, r)) / (2 * kEvery * r);
      }
  }
  base::Vec3 velocity(const base::Vec3& at) const {
    const double r = std::max(std::hypot(at.y(), at.z()), 1e-9), i = at.x() / kEvery, j = r / kEvery;
    const double out = between(out_, i, j);
    return {between(along_, i, j), out * at.y() / r, out * at.z() / r};
  }

 private:
  static constexpr double kEvery = 0.5;
  static constexpr int kColumns = 2 * kLength + 2, kRows = 3 * kSide + 2;   // r reaches the far edge
  static double between(const std::vector<double>& values, double i, double j) {
    const auto column = std::size_t(i), row = std::size_t(j);
    const double u = i - double(column), v = j - double(row);
    const auto at = [&](std::size_t c, std::size_t w) { return values[c * kRows + w]; };
    return (1 - u) * ((1 - v) * at(column, row) + v * at(column, row + 1)) + u * ((1 - v) * at(column + 1, row) + v * at(column + 1, row + 1));
  }
  std::vector<double> along_, out_;
};

/// What the ring's images behind the walls do to it half-way: dipoles of moment pi R^2 Gamma; one behind an end goes the other way.
double speed_from_images(double way) {
  constexpr int kMost = 12;
  double sum = 0;
  const double middle = kStart + 0.5 * way;
  for (int i = -kMost; i <= kMost; ++i)
    for (int j = -kMost; j <= kMost; ++j)
      for (int k = -kMost; k <= kMost; ++k)
        for (const int mirrored : {0, 1}) {
          if (i == 0 && j == 0 && k == 0 && !mirrored) continue;
          const double x = 2.0 * i * kLength + (mirrored ? -2 * middle : 0), d2 = x * x + 4.0 * kSide * kSide * (j * j + k * k);
          sum += (mirrored ? -1 : 1) * (3 * x * x / d2 - 1) / std::pow(d2, 1.5);
        }
  return kCirculation * kRadius * kRadius / 4 * sum;
}

/// Where the ring's impulse is, by the vorticity w in the plane beside z = 0: the mean of w r^2. A core that settles does not move it.
template <class Real>
double place_of(const FluidStep<3, Real>& step) {
  const auto& v = step.velocity();
  const auto at = [&](int a, int i, int j) { return double(v[std::size_t(a)][std::size_t(step.blocks().index({i, j, 0}))]); };
  double sum = 0, moment = 0;
  for (int i = 1; i < kLength; ++i)
    for (int j = 1; j < kSide; ++j) {
      const double w = at(1, i, j) - at(1, i - 1, j) - at(0, i, j) + at(0, i, j - 1);
      sum += w * j * j, moment += w * j * j * i;
    }
  return moment / sum;
}

/// By radius, core, circulation and images [m/s]; of thin Gaussian cores [Saffman70]. At a quarter of the radius that is within some 4 %.
double known_speed(double way) { return kCirculation / (4 * M_PI * kRadius) * (std::log(8 * kRadius / kCore) - 0.558) + speed_from_images(way); }

class VortexRing final : public Problem {
 public:
  void params(base::Params& p) override { p("way", way_, "m", "that the ring goes; its radius is 10", base::within(1, 20)); }
  std::string shot() const override {
    return R"(
[sim]
domain = [[0, 0, 0], [56, 28, 28]]
cell = 1
cfl = 0.7
pressure_tolerance = 1e-4
[[body]]
name = "all"
shape = { box = [[0, 0, 0], [56, 28, 28]] }
)";
  }

  std::string objection(const Scene& scene) const override {
    if (std::string plain = plain_objection(scene, false, 3); !plain.empty()) return plain;
    const Options& o = scene.options;
    if (o.cell != 1 || !o.domain.lower.isZero(0) || o.domain.upper != base::Vec3(kLength, kSide, kSide))
      return "sim.cell, sim.domain: must be 1 m and [[0, 0, 0], [56, 28, 28]] here";
    for (const auto& sides : o.boundary)
      if (sides[0] != Side::slip || sides[1] != Side::slip) return "sim.boundary: every side must be \"slip\" here: walls mirror the ring";
    return scene.effects.empty() ? "" : "effect: there is none here";
  }
  ProblemResult run(const Scene& scene, base::Ledger& ledger) const override {
    if (scene.options.precision == Precision::double_precision) return solve<double>(scene, ledger);
    return solve<float>(scene, ledger);
  }

 private:
  template <class Real>
  ProblemResult solve(const Scene& scene, base::Ledger& ledger) const {
    const Ring ring;
    const double speed = kCirculation / (2 * M_PI * kCore), known = known_speed(way_);
    KnownFlow<3, Real> flow(scene, [&](const Vec<3, double>& at, double) { return ring.velocity(at); }, speed);
    flow.fit_to_walls();   // which the formula does not know
    const double start = place_of(flow.grid());
    ProblemResult result = answer(flow, {.time = way_ / known, .dt = scene.options.cfl / speed}, ledger);
    result.errors.velocity.reset(), result.errors.vorticity.reset();   // those of the ring at the start
    result.errors.position = std::abs((place_of(flow.grid()) - start) / (known * flow.time()) - 1);
    return result;
  }
  double way_ = kWay;
};

}  // namespace

std::unique_ptr<Problem> make_vortex_ring() { return std::make_unique<VortexRing>(); }

}  // namespace sim
