#include "render/trace/integrator.h"

#include <array>
#include <limits>

#include "render/trace/optics.h"

namespace render::trace {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kBranches = 2;                       // most paths that wait at a time
constexpr std::uint32_t kDimensionsAtSurface = 3;  // light, direction, choice
constexpr std::uint32_t kReflectionDimensions = 16;
constexpr float kWeightThatMatters = 0.2f;         // Russian roulette starts below
constexpr std::uint32_t kDimensionsOfLight = 4096;  // from one area light to the next

/// Power heuristic for a sample of density p where another technique would have had density q.
float heuristic(float p, float q) { return p * p / (p * p + q * q); }

/// Distance to the rectangle's shining side, or infinity.
float distance_to(const AreaLight& light, const Ray& ray, float& cosine) {
  cosine = -ray.direction.dot(light.normal);
  if (cosine <= 0) return kFar;
  const float t = (ray.origin - light.middle).dot(light.normal) / cosine;
  if (!(t > 0)) return kFar;
  const Vec3f across = ray.origin + t * ray.direction - light.middle;
  return std::abs(across.dot(light.u)) <= light.u.squaredNorm() && std::abs(across.dot(light.v)) <= light.v.squaredNorm() ? t : kFar;
}

/// A direction bent just enough to be on the side that `normal` points to.
Vec3f keep_on_side(const Vec3f& direction, const Vec3f& normal) {
  constexpr float kLeast = 1e-3f;
  const float height = direction.dot(normal);
  if (height >= kLeast) return direction.normalized();
  return (direction + (kLeast - height) * normal).normalized();
}

}  // namespace

struct Integrator::Work {
  const sampling::PixelSampler& points;
  std::uint32_t sample;
  FirstHit& first;
  Vec3f sum = Vec3f::Zero();
  std::array<Path, kBranches> waiting = {};
  int count = 0;
};

Vec3f Integrator::radiance(const Ray& camera, const sampling::PixelSampler& points, std::uint32_t sample, FirstHit& first) const {
  Work work{.points = points, .sample = sample, .first = first};
  work.waiting[0].ray = camera;
  work.count = 1;
  while (work.count > 0) {
    Path path = work.waiting[static_cast<std::size_t>(--work.count)];
    while (step(path, work)) {}
  }
  return work.sum;
}

const Material* Integrator::material_in(const Medium& m) const {
  if (m.solid >= 0) return &scene_.surfaces[static_cast<std::size_t>(m.solid)].material;
  return m.liquid ? &scene_.surfaces[0].material : nullptr;
}

void Integrator::absorb(Path& path, float length) const {
  if (const Material* m = material_in(path.medium)) path.weight.array() *= (-length * m->absorption.array()).exp();
}

/// One flight and what it meets. False when the path has ended.
bool Integrator::step(Path& path, Work& work) const {
  const Ray& ray = path.ray;
  if (!(ray.direction.squaredNorm() < 2)) {  // not a number: Embree must not see it, the pixel's owner must
    work.sum += ray.direction;
    return false;
  }
  const float to_ground = ray.direction.z() < 0 ? std::max(0.0f, (scene_.ground.z - ray.origin.z()) / ray.direction.z()) : kFar;
  Hit hit;
  const bool found = geometry_.intersect(ray, to_ground, path.surfaces == 0, hit);
  const float t = found ? hit.t : to_ground;
  pass_lights(path, t, work);
  if (t == kFar) {
    work.sum += path.weight.cwiseProduct(scene_.sky.radiance(ray.direction));
    return false;
  }
  absorb(path, t);
  return found ? meets_surface(path, hit, work) : meets_ground(path, t, work);
}

void Integrator::pass_lights(const Path& path, float t, Work& work) const {
  if (scene_.straight && path.scattered > 0 && path.density == 0) return;  // counted by a straight shadow ray
  for (const AreaLight& light : scene_.lights) {
    float cosine;
    const float distance = distance_to(light, path.ray, cosine);
    if (distance >= t) continue;
    Path there = path;
    absorb(there, distance);
    const float weight = path.density > 0 ? heuristic(path.density, distance * distance / (cosine * light.area)) : 1;
    work.sum += weight * there.weight.cwiseProduct(light.radiance);
  }
}

bool Integrator::meets_ground(Path& path, float t, Work& work) const {
  const Ground& ground = scene_.ground;
  Vec3f point = path.ray.origin + t * path.ray.direction;
  point.z() = ground.z;
  const float fade = ground.fade(point);
  if (fade > 0) {
    work.sum += fade * path.weight.cwiseProduct(scene_.sky.radiance(path.ray.direction));
    if (fade == 1) return false;
    path.weight *= 1 - fade;
  }
  if (path.surfaces == 0) work.first = {.found = true, .t = t, .albedo = ground.material.color, .normal = Vec3f::UnitZ(), .id = 1};
  return meets_diffuse(path, point, Vec3f::UnitZ(), Vec3f::UnitZ(), ground.material.color, work);
}

bool Integrator::meets_surface(Path& path, const Hit& hit, Work& work) const {
  const Material& material = scene_.surfaces[static_cast<std::size_t>(hit.surface)].material;
  const Vec3f color = material.color.cwiseProduct(hit.tint);
  if (path.surfaces == 0)
    work.first = {.found = true, .t = hit.t, .albedo = material.dielectric ? Vec3f::Ones() : color, .normal = hit.shading, .velocity = geometry_.velocity(hit),
                  .id = 2 + hit.surface};
  const Vec3f point = path.ray.origin + hit.t * path.ray.direction;
  if (material.dielectric) return meets_dielectric(path, point, hit, work);
  const float side = path.ray.direction.dot(hit.geometric) < 0 ? 1.0f : -1.0f;
  return meets_diffuse(path, point, side * hit.geometric, side * hit.shading, color, work);
}

bool Integrator::meets_diffuse(Path& path, const Vec3f& point, const Vec3f& geometric, const Vec3f& shading, const Vec3f& color, Work& work) const {
  if (++path.surfaces > scene_.bounces) return false;
  ++path.scattered;
  path.weight = path.weight.cwiseProduct(color);
  const Vec3f from = point + scene_.offset * geometric;
  std::uint32_t dimension = path.dimension;
  for (const AreaLight& light : scene_.lights) {
    work.sum += path.weight.cwiseProduct(direct(light, from, shading, path.ray.time, work.points.point(work.sample, dimension)));
    dimension += kDimensionsOfLight;
  }
  const float go_on = path.weight.maxCoeff() / path.compression / kWeightThatMatters;
  if (go_on < 1) {
    if (work.points.point(work.sample, path.dimension + 2).x >= go_on) return false;
    path.weight /= go_on;
  }
  float cosine;
  const Vec3f direction = cosine_direction(shading, work.points.point(work.sample, path.dimension + 1), cosine);
  path.dimension += kDimensionsAtSurface;
  path.density = cosine / kPi;
  path.ray = {from, direction.normalized(), path.ray.time};
  return path.density > 0 && direction.dot(geometric) > 0;
}

/// Reflected radiance of a white surface lit by one light.
Vec3f Integrator::direct(const AreaLight& light, const Vec3f& from, const Vec3f& normal, float time, sampling::Point u) const {
  const Vec3f way = light.middle + (2 * u.x - 1) * light.u + (2 * u.y - 1) * light.v - from;
  const float square = way.squaredNorm(), distance = std::sqrt(square);
  const Vec3f direction = way / distance;
  const float cosine = direction.dot(normal), cosine_at_light = -direction.dot(light.normal);
  if (cosine <= 0 || cosine_at_light <= 0) return Vec3f::Zero();
  const float density = square / (cosine_at_light * light.area);
  const float value = cosine / kPi / density;
  const Ray shadow{from, direction, time};
  if (!scene_.straight) return geometry_.occluded(shadow, distance) ? Vec3f(Vec3f::Zero()) : Vec3f(value * heuristic(density, cosine / kPi) * light.radiance);
  const Passage passage = geometry_.straight(shadow, distance);
  const float weight = passage.crossings > 0 ? 1 : heuristic(density, cosine / kPi);  // through a dielectric no other technique counts it
  return value * weight * light.radiance.cwiseProduct(passage.transmittance);
}

bool Integrator::meets_dielectric(Path& path, const Vec3f& point, const Hit& hit, Work& work) const {
  if (++path.surfaces > scene_.bounces) {
    work.sum += path.weight.cwiseProduct(scene_.sky.radiance(path.ray.direction)) / path.compression;
    return false;
  }
  const bool entering = path.ray.direction.dot(hit.geometric) < 0;
  const bool first = path.surfaces == 1;
  // the side that was hit says what the ray is in, whatever it met before
  Medium before = path.medium, after = path.medium;
  if (hit.surface == 0) {
    before.liquid = !entering;
    after.liquid = entering;
  } else {
    before.solid = entering ? -1 : hit.surface;
    after.solid = entering ? hit.surface : -1;
  }
  const Material *from = material_in(before), *to = material_in(after);
  const float eta = (to ? to->ior : 1) / (from ? from->ior : 1);
  const Vec3f geometric = entering ? hit.geometric : Vec3f(-hit.geometric);
  Vec3f normal = entering ? hit.shading : Vec3f(-hit.shading);
  float cos_i = -path.ray.direction.dot(normal);
  if (cos_i < 1e-4f) {  // a smooth normal that looks away
    normal = geometric;
    cos_i = -path.ray.direction.dot(normal);
  }
  cos_i = std::min(cos_i, 1.0f);
  float cos_t;
  const float reflected = eta == 1 ? 0 : fresnel(cos_i, eta, cos_t);
  if (eta == 1) cos_t = cos_i;

  const auto reflection = [&](const Path& p) {
    Path r = p;
    r.medium = before;
    r.ray = {point + scene_.offset * geometric, keep_on_side(reflect(p.ray.direction, normal, cos_i), geometric), p.ray.time};
    return r;
  };
  const auto refraction = [&](const Path& p) {
    Path r = p;
    r.medium = after;
    r.weight /= eta * eta;
    r.compression /= eta * eta;
    r.ray = {point - scene_.offset * geometric, keep_on_side(refract(p.ray.direction, normal, cos_i, cos_t, eta), -geometric), p.ray.time};
    return r;
  };
  path.density = 0;
  path.dimension += kDimensionsAtSurface;
  if (first && reflected > 0 && reflected < 1) {
    Path other = reflection(path);
    other.weight *= reflected;
    other.dimension = kReflectionDimensions;
    work.waiting[static_cast<std::size_t>(work.count++)] = other;
    path = refraction(path);
    path.weight *= 1 - reflected;
    return true;
  }
  const float choice = work.points.point(work.sample, path.dimension - 1).x;
  path = choice < reflected ? reflection(path) : refraction(path);
  return true;
}

}  // namespace render::trace
