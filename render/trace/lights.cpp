#include "render/trace/lights.h"

#include <cmath>
#include <numbers>

#include "render/trace/optics.h"

namespace render::trace {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kPi = std::numbers::pi_v<float>;

/// 1 - sqrt(1 - s), without cancellation.
float cap_height(float sine_squared) { return sine_squared / (1 + std::sqrt(std::max(0.0f, 1 - sine_squared))); }

AreaLight area_light(const Light& light) {
  const base::Vec3 normal = (light.target - light.position).normalized();
  base::Vec3 side = normal.cross(base::Vec3::UnitZ());
  if (side.norm() < 1e-6) side = base::Vec3::UnitX();
  side.normalize();
  const base::Vec3 u = 0.5 * light.width * side, v = 0.5 * light.height * side.cross(normal);
  return {.middle = light.position.cast<float>(), .u = u.cast<float>(), .v = v.cast<float>(), .normal = normal.cast<float>(),
          .radiance = (light.intensity * light.color).cast<float>(), .area = static_cast<float>(light.width * light.height)};
}

/// Irradiance of a disc straight above: pi sin^2 times radiance.
Sun sun(const Light& light) {
  const double half = 0.5 * light.angle * std::numbers::pi / 180, sine = std::sin(half);
  return {.towards = -light.direction.normalized().cast<float>(), .cap = static_cast<float>(2 * std::pow(std::sin(0.5 * half), 2)),
          .radiance = (light.intensity / (sine * sine) * light.color).cast<float>()};
}

}  // namespace

LightSample AreaLight::sample(const Vec3f& from, sampling::Point p) const {
  const Vec3f way = middle + (2 * p.x - 1) * u + (2 * p.y - 1) * v - from;
  const float square = way.squaredNorm(), distance = std::sqrt(square);
  const Vec3f direction = way / distance;
  const float cosine = -direction.dot(normal);
  if (!(cosine > 0)) return {};
  return {.direction = direction, .distance = distance, .density = square / (cosine * area), .radiance = radiance};
}

std::optional<LightHit> AreaLight::find(const Vec3f& from, const Vec3f& direction) const {
  const float cosine = -direction.dot(normal);
  if (cosine <= 0) return {};
  const float t = (from - middle).dot(normal) / cosine;
  if (!(t > 0)) return {};
  const Vec3f across = from + t * direction - middle;
  if (std::abs(across.dot(u)) > u.squaredNorm() || std::abs(across.dot(v)) > v.squaredNorm()) return {};
  return LightHit{t, t * t / (cosine * area), radiance};
}

LightSample SphereLight::sample(const Vec3f& from, sampling::Point p) const {
  const Vec3f way = middle - from;
  const float square = way.squaredNorm(), sine2 = radius * radius / square;
  if (!(sine2 < 1)) return {};
  const float cap = cap_height(sine2);
  const Vec3f direction = Frame(way / std::sqrt(square)).world(cap_direction(cap, p)).normalized();
  const float along = way.dot(direction), beside2 = (way - along * direction).squaredNorm();
  return {.direction = direction, .distance = along - std::sqrt(std::max(0.0f, radius * radius - beside2)), .density = 1 / (2 * kPi * cap),
          .radiance = radiance};
}

std::optional<LightHit> SphereLight::find(const Vec3f& from, const Vec3f& direction) const {
  const Vec3f way = middle - from;
  const float along = way.dot(direction), square = way.squaredNorm();
  if (along <= 0 || square <= radius * radius) return {};
  const float beside2 = (way - along * direction).squaredNorm();
  if (beside2 >= radius * radius) return {};
  return LightHit{along - std::sqrt(radius * radius - beside2), 1 / (2 * kPi * cap_height(radius * radius / square)), radiance};
}

LightSample Sun::sample(const Vec3f&, sampling::Point p) const {
  return {
      .direction = Frame(towards).world(cap_direction(cap, p)).normalized(), .distance = kFar, .density = 1 / (2 * kPi * cap), .radiance = radiance};
}

// 1 - cosine as half the squared distance of unit vectors: the sun is too small for a float's cosine.
std::optional<LightHit> Sun::find(const Vec3f&, const Vec3f& direction) const {
  if (0.5f * (direction - towards).squaredNorm() > cap) return {};
  return LightHit{kFar, 1 / (2 * kPi * cap), radiance};
}

Lights make_lights(const std::vector<Light>& list, const std::filesystem::path& folder) {
  Lights lights;
  for (const Light& light : list) {
    const Vec3f radiance = (light.intensity * light.color).cast<float>();
    if (light.kind == "area") lights.areas.push_back(area_light(light));
    if (light.kind == "sphere") lights.spheres.push_back({light.position.cast<float>(), static_cast<float>(light.radius), radiance});
    if (light.kind == "sun") lights.suns.push_back(sun(light));
    if (light.kind == "environment") lights.environments.push_back(read_environment(folder / light.file, radiance, light.rotation));
    if (light.kind == "sky") {
      lights.sky.zenith += radiance;
      lights.sky.horizon += (light.intensity * light.horizon).cast<float>();
    }
  }
  return lights;
}

}  // namespace render::trace
