// How surfaces scatter, by themselves and in a white furnace.
#include <gtest/gtest.h>

#include "render/trace/optics.h"
#include "tests/render_trace.h"

namespace {

using namespace tests;
using trace::Material;
using trace::Model;
using trace::Reflector;
using trace::RoughDielectric;
using trace::Scattered;

constexpr float kRoughness[] = {0.1f, 0.3f, 0.6f, 1.0f};
constexpr float kCosines[] = {0.08f, 0.3f, 0.7f, 0.99f};

Vec3f at(float cosine, float azimuth = 0) {
  const float sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

Material conductor(const Vec3f& color, float roughness, const Vec3f& edge = Vec3f::Ones()) {
  const float alpha = roughness * roughness;
  return {.model = Model::conductor, .color = color, .edge = edge, .alpha = alpha, .albedo = trace::mirror_albedo(alpha)};
}

Material coated(const Vec3f& color, float roughness, float ior = 1.5f) {
  Material m{
      .model = Model::coated, .color = color, .ior = ior, .alpha = roughness * roughness, .albedo = trace::coat_albedo(roughness * roughness, ior)};
  m.inside = 1 - (1 - m.albedo.mean) / (ior * ior);
  return m;
}

/// Mean weight over samples; `flux` scales what is transmitted.
template <class Bsdf>
double albedo(const Bsdf& bsdf, float flux = 1) {
  constexpr int kSamples = 16384;
  const render::sampling::Sequence sequence(kSamples, 1);
  const render::sampling::PixelSampler points(sequence, 0, 0);
  double sum = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Scattered s = bsdf.sample(points.point(i, 1), points.point(i, 2).x);
    sum += static_cast<double>(s.weight.x() * (s.direction.z() < 0 ? flux : 1));
  }
  return sum / kSamples;
}

/// Integrals of value and density over all directions, by even directions: what sample() must agree with.
template <class Bsdf>
std::pair<double, double> integrals(const Bsdf& bsdf, float flux = 1) {
  constexpr int kSamples = 1 << 18;
  const render::sampling::Sequence sequence(kSamples, 2);
  const render::sampling::PixelSampler points(sequence, 0, 0);
  double value = 0, density = 0;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    const Vec3f in = trace::cap_direction(2, points.point(i, 1));
    value += static_cast<double>(bsdf.value(in).x() * (in.z() < 0 ? flux : 1));
    density += static_cast<double>(bsdf.density(in));
  }
  return {value * 4 * std::numbers::pi / kSamples, density * 4 * std::numbers::pi / kSamples};
}

}  // namespace

TEST(Conductor, OfWhiteReturnsAllLight) {
  for (const float roughness : kRoughness)
    for (const float cosine : kCosines) {
      const Material m = conductor(Vec3f::Ones(), roughness);
      EXPECT_NEAR(albedo(Reflector(m, m.color, at(cosine))), 1, 0.01) << roughness << " " << cosine;
    }
}

TEST(Conductor, HasItsColourStraightOnAndItsEdgeTintAtEightyTwoDegrees) {
  const Vec3f color(0.9f, 0.6f, 0.3f), edge(0.8f, 0.9f, 1.0f);
  const Material m{.model = Model::conductor, .color = color, .edge = edge};
  EXPECT_LT((Reflector(m, color, at(1)).sample({0.5f, 0.5f}, 0).weight - color).norm(), 1e-6);
  const Vec3f schlick = color + std::pow(6.0f / 7, 5.0f) * (Vec3f::Ones() - color);
  EXPECT_LT((Reflector(m, color, at(1.0f / 7)).sample({0.5f, 0.5f}, 0).weight - edge.cwiseProduct(schlick)).norm(), 1e-5);
}

TEST(Coat, OverAWhiteBodyReturnsAllLight) {
  for (const float roughness : {0.0f, 0.1f, 0.3f, 0.6f, 1.0f})
    for (const float cosine : kCosines) {
      const Material m = coated(Vec3f::Ones(), roughness);
      EXPECT_NEAR(albedo(Reflector(m, m.color, at(cosine))), 1, 0.01) << roughness << " " << cosine;
    }
}

// Light that the coat throws back meets the body's colour again: the body looks darker than by one meeting.
TEST(Coat, DeepensTheColourOfItsBody) {
  const Material m = coated(Vec3f::Constant(0.5f), 0);
  float cos_t;
  const double f = static_cast<double>(trace::fresnel(0.99f, 1.5f, cos_t)), inside = static_cast<double>(m.inside);
  EXPECT_NEAR(inside, 0.596, 0.005);  // internal diffuse reflectance at 1.5 [Egan73]
  EXPECT_NEAR(albedo(Reflector(m, m.color, at(0.99f))), f + (1 - f) * 0.5 * (1 - inside) / (1 - 0.5 * inside), 3e-3);
}

TEST(RoughDielectric, ReflectsAndTransmitsAllLight) {
  for (const float eta : {1.33f, 1.5f, 2.4f})
    for (const float roughness : kRoughness)
      for (const float cosine : kCosines) {
        const trace::RoughBoundary boundary = trace::make_rough_boundary(roughness * roughness, eta);
        EXPECT_NEAR(albedo(RoughDielectric(boundary, false, at(cosine)), eta * eta), 1, 0.01) << eta << " " << roughness << " " << cosine;
        EXPECT_NEAR(albedo(RoughDielectric(boundary, true, at(cosine)), 1 / (eta * eta)), 1, 0.01) << 1 / eta << " " << roughness << " " << cosine;
      }
}

// With Fresnel and Snell alone, as roughness goes to nothing.
TEST(RoughDielectric, BecomesTheSmoothOne) {
  const trace::RoughBoundary boundary = trace::make_rough_boundary(0.0004f, 1.5f);
  const RoughDielectric rough(boundary, false, at(0.6f));
  double reflected = 0;
  const render::sampling::Sequence sequence(4096, 1);
  const render::sampling::PixelSampler points(sequence, 0, 0);
  float cos_t;
  const float share = trace::fresnel(0.6f, 1.5f, cos_t);
  for (std::uint32_t i = 0; i < 4096; ++i) {
    const Scattered s = rough.sample(points.point(i, 1), points.point(i, 2).x);
    if (s.direction.z() > 0) reflected += static_cast<double>(s.weight.x()) / 4096;
    else EXPECT_NEAR(s.direction.z(), -cos_t, 0.02) << i;
  }
  EXPECT_NEAR(reflected, share, 2e-3);
}

TEST(Bsdf, SamplesWhatItsDensityAndValueSay) {
  for (const float roughness : {0.3f, 0.6f, 1.0f}) {
    const Material metal = conductor(Vec3f(0.8f, 0.5f, 0.2f), roughness, Vec3f::Constant(0.7f)), plastic = coated(Vec3f::Constant(0.4f), roughness);
    const trace::RoughBoundary glass = trace::make_rough_boundary(roughness * roughness, 1.5f);
    const auto check = [&](const auto& bsdf, float flux, const char* what) {
      const auto [value, density] = integrals(bsdf, flux);
      EXPECT_LT(density, 1.005) << what << roughness;
      EXPECT_GT(density, 0.7) << what << roughness;  // the rest is drawn into the surface, and absorbed
      EXPECT_NEAR(albedo(bsdf, flux), value, 0.01) << what << roughness;
    };
    check(Reflector(metal, metal.color, at(0.5f)), 1, "metal ");
    check(Reflector(plastic, plastic.color, at(0.5f)), 1, "plastic ");
    check(RoughDielectric(glass, false, at(0.5f)), 2.25f, "glass ");
    check(RoughDielectric(glass, true, at(0.5f)), 1 / 2.25f, "from glass ");
  }
}

TEST(Bsdf, IsReciprocal) {
  for (const float roughness : kRoughness) {
    const Material metal = conductor(Vec3f(0.8f, 0.5f, 0.2f), roughness, Vec3f::Constant(0.7f)), plastic = coated(Vec3f(0.4f, 0.3f, 0.2f), roughness);
    const Material matt{.model = Model::diffuse, .color = Vec3f::Constant(0.5f)};
    const trace::RoughBoundary glass = trace::make_rough_boundary(roughness * roughness, 1.5f);
    for (const float a : kCosines)
      for (const float b : kCosines) {
        const Vec3f v = at(a), w = at(b, 2.1f), below(w.x(), w.y(), -w.z());
        for (const Material* m : {&metal, &plastic, &matt}) {
          const Vec3f there = Reflector(*m, m->color, v).value(w) / w.z(), back = Reflector(*m, m->color, w).value(v) / v.z();
          ASSERT_GT(there.minCoeff(), 0);
          EXPECT_LT((there - back).norm(), 2e-4 * there.norm()) << roughness;
        }
        const float there = RoughDielectric(glass, false, v).value(w).x() / w.z(), back = RoughDielectric(glass, false, w).value(v).x() / v.z();
        EXPECT_NEAR(there, back, 2e-4 * std::abs(there)) << roughness;
        // across: what is looked at from w sees v above as n^2 times brighter as v sees w
        const float through = RoughDielectric(glass, false, v).value(below).x() / w.z(),
                    up = RoughDielectric(glass, true, w).value(Vec3f(v.x(), v.y(), -v.z())).x() / v.z();
        ASSERT_GT(through, 0);
        EXPECT_NEAR(through * 2.25f, up, 1e-3 * up) << roughness << " " << a << " " << b;
      }
  }
}

TEST(Bsdf, NeverMakesEnergy) {
  for (float roughness = 0.05f; roughness <= 1; roughness += 0.19f)
    for (float cosine = 0.02f; cosine < 1; cosine += 0.14f) {
      const Material metal = conductor(Vec3f::Constant(0.95f), roughness, Vec3f::Constant(0.9f)), plastic = coated(Vec3f::Constant(0.9f), roughness);
      EXPECT_LT(albedo(Reflector(metal, metal.color, at(cosine))), 1) << roughness << " " << cosine;
      EXPECT_LT(albedo(Reflector(plastic, plastic.color, at(cosine))), 1) << roughness << " " << cosine;
    }
}

// Against the formula of [vandeHulst80], which is good to 0.002.
TEST(HalfSpace, ReflectsAsChandrasekharSays) {
  for (const double scattering : {0.2, 0.5, 0.8, 0.9, 0.99, 0.999}) {
    const double s = std::sqrt(1 - scattering);
    EXPECT_NEAR(trace::half_space_albedo(scattering), (1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s), 2.5e-3) << scattering;
    EXPECT_NEAR(trace::scattering_albedo(trace::half_space_albedo(scattering)), scattering, 1e-4);
  }
  EXPECT_EQ(trace::scattering_albedo(1), 1);
  EXPECT_EQ(trace::scattering_albedo(0), 0);
}

// A slab two hundred mean free paths deep and wide: its colour is the albedo that the look names, and half of it is lost where a
// coat of no index stands for none.
TEST(Translucent, SlabHasTheAlbedoItsLookNames) {
  render::Setting setting = bare_setting();
  setting.lights = {uniform_sky(1)};
  setting.looks["body"] = {.model = "translucent", .color = Vec3(0.2, 0.5, 0.8), .coat = 1, .depth = 0.01};
  setting.colliders = {block("body", {Vec3(-1, -1, -2), Vec3(1, 1, 0)})};
  const Mean seen = Rays(setting).mean(Vec3(0, 0, 1), Vec3(0, 0, 0), 16, 512);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen.value[c], setting.looks["body"].color[c], 4 * std::sqrt(seen.variance[c]) + 1e-3) << c;
}

namespace {

/// Lights that shine with radiance 1 from everywhere.
enum class Furnace { sky, environment, six_areas };

render::Setting furnace(Furnace kind) {
  render::Setting setting = bare_setting();
  setting.lights = {uniform_sky(kind == Furnace::sky ? 1 : 0)};
  if (kind == Furnace::six_areas)
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-2.0, 2.0})
        setting.lights.push_back({.kind = "area", .position = Vec3(0, 0, 0.5) + side * Vec3::Unit(axis), .target = Vec3(0, 0, 0.5), .width = 4,
                                  .height = 4, .intensity = 1});
  return setting;
}

std::map<std::string, render::Look> white_looks() {
  std::map<std::string, render::Look> looks;
  const Vec3 white = Vec3::Ones();
  looks["diffuse"] = {.color = white};
  looks["smooth glass"] = {.model = "dielectric", .ior = 1.5};
  looks["rough glass"] = {.model = "dielectric", .roughness = 0.5, .ior = 1.5};
  looks["milky"] = {.model = "dielectric", .roughness = 0.5, .ior = 1.4, .scattering = Vec3(2, 3, 4)};
  looks["mirror"] = {.model = "conductor", .color = white};
  looks["metal"] = {.model = "conductor", .color = white, .roughness = 0.5};
  looks["smooth plastic"] = {.model = "coated", .color = white};
  looks["rough plastic"] = {.model = "coated", .color = white, .roughness = 0.5};
  looks["snow"] = {.model = "translucent", .color = white, .coat = 1, .depth = 0.1};
  looks["wax"] = {.model = "translucent", .color = white, .roughness = 0.4, .coat = 1.5, .depth = 0.1};
  looks["lamp"] = {.model = "emissive", .color = white};
  return looks;
}

}  // namespace

// The panes of a tank touch its walls: a ray that leaves the glass must meet the wall behind, whichever was named first, as it does where they overlap.
TEST(Glass, EndsWhereTheWallBehindItBegins) {
  const auto seen = [](bool glass_first, double turn, double overlap) {
    render::Setting setting = furnace(Furnace::sky);
    setting.looks["glass"] = white_looks()["smooth glass"];
    setting.looks["wall"] = {.color = Vec3(0.8, 0.5, 0.3)};
    setting.colliders = {block("glass", {Vec3(-0.51, -0.3, 0.2), Vec3(0.57, 0.1 + overlap, 0.83)}), block("wall", {Vec3(-0.6, 0.1, 0.13), Vec3(0.53, 0.3, 0.8)})};
    for (sim::Collider& c : setting.colliders) {   // about the middle of both
      c.shape.turn_by(turn, Vec3::UnitZ());
      const Vec3 middle = 0.5 * (c.shape.box->lower + c.shape.box->upper), from = middle - Vec3(0, 0, 0.5);
      if (c.shape.turn) c.shape = sim::moved(c.shape, *c.shape.turn * from - from);
    }
    if (!glass_first) std::swap(setting.colliders[0], setting.colliders[1]);
    return Rays(setting).mean(Vec3(0.1, -1.9, 0.65), Vec3(0.05, 0.1, 0.5), 16, 512);
  };
  for (const bool glass_first : {true, false})
    for (const double turn : {0.0, 30.0}) {
      const Mean touching = seen(glass_first, turn, 0), overlapping = seen(glass_first, turn, 0.01);
      EXPECT_LT((touching.value - overlapping.value).cwiseAbs().maxCoeff(), 0.005 + 4 * std::sqrt((touching.variance + overlapping.variance).maxCoeff()))
          << touching.value.transpose() << " and " << overlapping.value.transpose() << ", turned by " << turn;
    }
}

// Every material, every way of finding light. Nothing is missing and nothing is added, whatever the path does.
TEST(WhiteFurnace, KeepsEveryMaterialWhite) {
  for (const auto& [name, look] : white_looks()) {
    for (const Furnace kind : {Furnace::sky, Furnace::environment, Furnace::six_areas}) {
      render::Setting setting = furnace(kind);
      setting.looks[name] = look;
      setting.colliders = {ball(name)};
      Rays rays(setting);
      if (kind == Furnace::environment) rays.scene.lights.environments.emplace_back(16, 8, std::vector<Vec3f>(128, Vec3f::Ones()), 0.0);
      for (const trace::Strategy strategy : {trace::Strategy::both, trace::Strategy::lights, trace::Strategy::scattering}) {
        if (kind == Furnace::sky && strategy != trace::Strategy::both) continue;
        rays.scene.strategy = strategy;
        const Mean seen = rays.mean(Vec3(0.1, -1.9, 0.65), Vec3(0, 0, 0.6), 8, 512);
        const double noise = 4 * std::sqrt(seen.variance.maxCoeff());
        ASSERT_LT(noise, strategy == trace::Strategy::lights ? 0.6 : 0.05) << name;  // a narrow lobe is seldom found from the lights alone
        EXPECT_LT((seen.value - Vec3::Ones()).cwiseAbs().maxCoeff(), 0.01 + noise)
            << name << " light " << static_cast<int>(kind) << " strategy " << static_cast<int>(strategy) << ": " << seen.value.transpose();
      }
    }
  }
}
