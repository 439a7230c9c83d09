// A solid's step eight particles at a time in single precision, against the plain one in double: P2G with stress, G2P, motion, deformation, return
// map and stress of every law, from the same random state.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sim/solid/rows.h"
#include "sim/solid/seeding.h"
#include "sim/solid/step.h"
#include "sim/solid/make_model.h"
#include "tests/solid_matrices.h"
#include "tests/solid_scenes.h"

namespace {

using namespace sim;
using namespace solid_test;

constexpr double kCell = 0.1, kDt = 2e-3, kYoung = 1e5;

Material material(Elasticity model, Plasticity plasticity) {
  return {.model = model, .density = 1000, .young = kYoung, .poisson = 0.3, .bulk_modulus = kYoung, .plasticity = plasticity,
          .yield_stress = 4e3, .hardening_modulus = 1e4, .friction_angle = 35, .cohesion = 500};
}

struct Case {
  const char* name;
  Material material;
};

std::vector<Case> cases() {
  std::vector<Case> all{{"fixed corotated", material(Elasticity::fixed_corotated, Plasticity::none)},
                        {"neo-Hookean", material(Elasticity::neo_hookean, Plasticity::none)},
                        {"Hencky", material(Elasticity::hencky, Plasticity::none)},
                        {"Tait", material(Elasticity::tait, Plasticity::none)},
                        {"von Mises", material(Elasticity::hencky, Plasticity::von_mises)},
                        {"Drucker-Prager", material(Elasticity::hencky, Plasticity::drucker_prager)},
                        {"snow", material(Elasticity::fixed_corotated, Plasticity::snow)}};
  all.push_back({"averaged", all[1].material});
  all.back().material.volume_averaging = true;
  return all;
}

/// Two bodies of one material in a box with walls, close enough to share nodes; a few hundred particles, over several blocks.
Scene scene_of(const Material& m, std::int64_t modes) {
  Scene scene = walled_scene(3, 1.2, kCell);
  scene.options.precision = Precision::single_precision;
  set_transfer(scene.options, modes == 1 ? "pic" : modes == 4 ? "apic" : "polypic");
  if (modes == 8) scene.options.modes.name = "multilinear";
  if (modes == 10) scene.options.modes.name = "quadratic";
  if (modes != 27) scene.options.carry = Carry::fixed;
  scene.options.wall_friction = 0.3;
  scene.bodies = {ball({0.5, 0.5, 0.3}, 0.28, m), block({0.78, 0.3, 0}, {1.1, 0.7, 0.5}, m)};
  scene.bodies[1].name = "other";
  scene.bodies[1].solid.density = 2500;
  return scene;
}

/// Random velocities, deformations (one in ten is strong: the whole decomposition) and stresses; with gaps, so that batches are partial.
void randomise(Group<3, float>& group, std::mt19937& rng) {
  std::uniform_real_distribution<float> u(-1, 1);
  for (float& c : group.particles.coefficients) c = 0.5f * u(rng);
  for (std::size_t p = 0; p < group.particles.size(); ++p) {
    const float size = rng() % 10 == 0 ? 0.4f : 0.04f;
    Deformation<float, 3>& d = group.deformation[p];
    for (auto& row : d.gradient.m)
      for (float& x : row) x = size * u(rng);
    d.state = group.is_liquid() ? 0.2f * u(rng) : std::holds_alternative<Plastic<Snow>>(group.model) ? 0.05f * u(rng) : 0.02f * (1 + u(rng));
    for (float& x : group.stress[p]) x = float(0.1 * kYoung) * u(rng);
    for (int a = 0; a < 3; ++a) group.particles.offset[p][a] = 0.5f + 0.499f * u(rng);
  }
}

/// The same particles in double precision.
void copy(const Group<3, float>& from, Group<3, double>& to) {
  const std::size_t n = from.particles.size();
  to.particles.cell = from.particles.cell, to.particles.id = from.particles.id;
  to.particles.offset.resize(n), to.deformation.resize(n), to.stress.resize(n);
  to.particles.coefficients.assign(from.particles.coefficients.begin(), from.particles.coefficients.end());
  for (std::size_t p = 0; p < n; ++p) {
    to.particles.offset[p] = from.particles.offset[p].cast<double>();
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) to.deformation[p].gradient(i, k) = double(from.deformation[p].gradient(i, k));
    to.deformation[p].state = double(from.deformation[p].state);
    std::copy(from.stress[p].begin(), from.stress[p].end(), to.stress[p].begin());
  }
}

template <class Real>
StepLimits step_once(const Scene& scene, const Solids<3>& solids, std::vector<Group<3, Real>>& groups) {
  SolidStep<3, Real> step(scene, solids);
  base::Ledger ledger;
  step.scatter(kDt, groups, ledger);
  step.update(kDt, base::Vec3(0, 0, -9.81), groups, ledger);
  return step.gather(kDt, 0, groups, ledger);
}

/// Particles by id.
template <class Real>
std::vector<std::size_t> by_id(const Group<3, Real>& group) {
  std::vector<std::size_t> at(group.particles.size());
  for (std::size_t p = 0; p < at.size(); ++p) at[std::size_t(group.particles.id[p] - group.first_id)] = p;
  return at;
}

/// Largest differences, in units of velocity [m/s], cells, F and Young's modulus.
struct Difference {
  double velocity = 0, place = 0, strain = 0, state = 0, stress = 0;
};

template <class Real>
Difference difference(const Group<3, Real>& a, const Group<3, double>& b) {
  const auto in_a = by_id(a), in_b = by_id(b);
  Difference d;
  const auto take = [](double& most, double x) { most = std::max(most, std::abs(x)); };
  for (std::size_t k = 0; k < in_a.size(); ++k) {
    const std::size_t p = in_a[k], q = in_b[k];
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < a.particles.modes; ++r)
        take(d.velocity, double(a.particles.component(p, c)[std::size_t(r)]) - b.particles.component(q, c)[std::size_t(r)]);
    for (int c = 0; c < 3; ++c) take(d.place, a.particles.place(p)[c] - b.particles.place(q)[c]);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) take(d.strain, double(a.deformation[p].gradient(i, j)) - b.deformation[q].gradient(i, j));
    take(d.state, double(a.deformation[p].state) - b.deformation[q].state);
    for (std::size_t i = 0; i < 6; ++i) take(d.stress, (double(a.stress[p][i]) - b.stress[q][i]) / kYoung);
  }
  return d;
}

/// The response written out with Eigen's decomposition: F = (I + change) F0 = U diag(s) V^T, s' = return(s), F' = U diag(s') V^T,
/// tau = U diag(t(s')) U^T.
struct Expected {
  Dense<3> f, stress;
  double state = 0;
};
template <class Law>
Expected expected(const Elastic<Law>& model, const Dense<3>& trial, double state) {
  return {trial, dense<3>(kirchhoff_of(model.law, displacement_gradient<3>(trial))), state};
}
Expected expected(const Liquid& model, const Dense<3>& trial, double state) {   // of a change from rest
  const double j = trial.determinant() * (1 + state) - 1;
  return {Dense<3>::Identity(), -model.law.pressure(j) * (1 + j) * Dense<3>::Identity(), j};
}
template <class Yield>
Expected expected(const Plastic<Yield>& model, const Dense<3>& trial, double state) {
  const Eigen::JacobiSVD<Dense<3>> svd(trial, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Principal<double, 3> s;
  for (std::size_t i = 0; i < 3; ++i) s[i] = svd.singularValues()[Eigen::Index(i)] - 1;
  model.yield.template project<double, 3>(model.law.lame, s, state);
  Principal<double, 3> tau = model.law.template kirchhoff<double, 3>(s);
  if constexpr (std::is_same_v<Yield, Snow>)
    for (double& t : tau) t *= model.yield.hardened(state);
  const Eigen::Vector3d stretch(1 + s[0], 1 + s[1], 1 + s[2]), t(tau[0], tau[1], tau[2]);
  return {svd.matrixU() * stretch.asDiagonal() * svd.matrixV().transpose(), svd.matrixU() * t.asDiagonal() * svd.matrixU().transpose(), state};
}

}  // namespace

// The half decomposition of moderate strains, the whole one of others, and what the laws share of either.
TEST(SolidLanes, EveryModelRespondsAsItsDefinitionSays) {
  std::mt19937 rng(32);
  for (const Case& c : cases())
    std::visit([&](const auto& model) {
      int moderate = 0, flows = 0;
      for (int n = 0; n < 3000; ++n) {
        const bool is_liquid = std::is_same_v<std::decay_t<decltype(model)>, Liquid>;
        const double size = std::pow(10, -double(n % 4)) * (n % 4 ? 1 : 0.45);
        const Dense<3> before =
            is_liquid ? Dense<3>(Dense<3>::Identity()) : Dense<3>(random_rotation<3>(rng) * (Dense<3>::Identity() + size * random_matrix<3>(rng)));
        const Dense<3> change = Dense<3>::Identity() + 0.1 * size * random_matrix<3>(rng);
        if (before.determinant() < 0.05) continue;
        Deformation<double, 3> p{displacement_gradient<3>(before), 0.01};
        const Expected e = expected(model, change * before, p.state);
        const Response<double, 3> r = model.template respond<double, 3>(displacement_gradient<3>(change), p);
        if (!is_liquid) {
          EXPECT_LT((dense<3>(p.gradient) + Dense<3>::Identity() - e.f).norm(), 1e-12) << c.name << " " << size;
        }
        EXPECT_NEAR(p.state, e.state, 1e-12) << c.name << " " << size;
        EXPECT_LT((dense<3>(r.stress) - e.stress).norm(), 1e-9 * kYoung) << c.name << " " << size;
        moderate += is_moderate(displacement_gradient<3>(change * before));
        flows += (e.f - change * before).norm() > 1e-6;
      }
      EXPECT_GT(moderate, 300) << c.name;
      if (c.material.model != Elasticity::tait) {
        EXPECT_LT(moderate, 2950) << c.name;
      }
      if (c.material.plasticity != Plasticity::none) {
        EXPECT_GT(flows, 300) << c.name;
      }
    }, make_model(c.material));
}

// Velocities are of order 1, some of them after division by light nodes' masses; stresses are differences of numbers of order 1.
TEST(SolidLanes, RowsAreWrittenAlikePastTheCachesAndNot) {
  constexpr std::size_t n = 10, count = 237;
  const auto written = [](bool past_caches, std::size_t first) {
    std::vector<float> all(first + n * count + 20, -1);
    RowWriter<Lanes, n> rows(&all[first], past_caches);
    for (std::size_t p = 0; p < count; p += 8) {
      std::array<Lanes, n> values;
      for (std::size_t k = 0; k < n; ++k)
        for (int l = 0; l < 8; ++l) values[k].set(l, float(n * (p + std::size_t(l)) + k));
      rows.write(values, int(std::min<std::size_t>(8, count - p)));
    }
    rows.finish();
    return all;
  };
  for (std::size_t first = 0; first < 16; ++first) {
    const std::vector<float> all = written(false, first);
    EXPECT_EQ(all[first + n * count - 1], float(n * count - 1));
    EXPECT_EQ(std::count(all.begin(), all.end(), -1.0f), std::ptrdiff_t(first + 20));
    EXPECT_EQ(written(true, first), all);
  }
}

TEST(SolidLanes, AStepEightAtATimeIsThePlainStepInDoublePrecisionToRounding) {
  for (const std::int64_t modes : {1, 4, 8, 10, 27})
    for (const Case& c : cases()) {
      const Scene scene = scene_of(c.material, modes);
      const Solids<3> solids(scene, Lattice<3>({12, 12, 12}));
      auto fast = seed_groups<3, float>(scene, solids);
      auto plain = seed_groups<3, double>(scene, solids);
      std::mt19937 rng(31);
      for (std::size_t g = 0; g < fast.size(); ++g) {
        ASSERT_NE(fast[g].kernels.scatter, nullptr);
        randomise(fast[g], rng);
        copy(fast[g], plain[g]);
      }
      const auto before = plain;
      const StepLimits a = step_once(scene, solids, fast), b = step_once(scene, solids, plain);
      EXPECT_NEAR(a.wave_speed, b.wave_speed, 1e-4 * b.wave_speed) << c.name;
      EXPECT_NEAR(a.loose_speed, b.loose_speed, 1e-4 * b.loose_speed) << c.name;
      EXPECT_NEAR(a.speed, b.speed, 1e-4 * b.speed) << c.name;
      for (std::size_t g = 0; g < fast.size(); ++g) {
        const Difference d = difference(fast[g], plain[g]), moved = difference(before[g], plain[g]);
        EXPECT_LT(d.velocity, modes == 27 ? 1e-4 : 2e-6) << c.name << " " << modes;   // 27 modes see nodes a thousandth of a particle heavy
        EXPECT_LT(d.place, 2e-7) << c.name << " " << modes;
        EXPECT_LT(d.strain, 2e-6) << c.name << " " << modes;
        EXPECT_LT(d.state, 4e-6) << c.name << " " << modes;
        EXPECT_LT(d.stress, 1e-5) << c.name << " " << modes;
        EXPECT_GT(moved.velocity, 0.1);   // a step that does nothing would agree with itself
        EXPECT_GT(moved.strain + moved.state, 1e-3);
        EXPECT_GT(moved.stress, 1e-3);
      }
    }
}
