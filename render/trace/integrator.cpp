#include "render/trace/integrator.h"

#include "render/trace/work.h"

namespace render::trace {
namespace {

constexpr float kWeightThatMatters = 0.2f;  // Russian roulette starts below
constexpr int kFlights = 8192;              // hidden boundaries and points in a medium included

}  // namespace

Vec3f Integrator::radiance(const Ray& camera, Media around, const sampling::PixelSampler& points, std::uint32_t sample, FirstHit& first) const {
  Work work{.points = points, .sample = sample, .first = first};
  work.waiting[0].ray = camera;
  Path& start = work.waiting[0];
  start.from = camera.origin;
  start.media = around;
  start.compression = 1 / (scene_.ior(around) * scene_.ior(around));  // a camera under water looks through a window: its film is in air
  start.weight *= start.compression;
  work.count = 1;
  while (work.count > 0) {
    Path path = work.waiting[static_cast<std::size_t>(--work.count)];
    while (step(path, work)) {}
  }
  return work.sum;
}

// Straight up: the first boundary of a dielectric that is met from inside holds the point.
Media Integrator::media_at(const Vec3f& point, float time) const {
  Media inside, met;
  Ray up{.origin = point, .direction = Vec3f::UnitZ(), .time = time};
  Hit hit;
  for (int k = 0; k < 256 && geometry_.intersect(up, kFar, false, hit); ++k) {
    if (const int rank = scene_.rank[static_cast<std::size_t>(hit.surface)]; rank >= 0 && met.with(rank).inside != met.inside) {
      met = met.with(rank);
      if (hit.geometric.z() > 0) inside = inside.with(rank);
    }
    up.origin.z() += hit.t + 10 * scene_.offset(up.origin);
  }
  return inside;
}

void Integrator::absorb(Path& path, float length) const {
  if (const Material* m = scene_.medium(path.media)) path.weight.array() *= (-length * (m->absorption + m->scattering).array()).exp();
}

bool Integrator::survives(Path& path, float choice) const {
  const float go_on = path.weight.maxCoeff() / path.compression / kWeightThatMatters;
  if (go_on >= 1) return true;
  if (choice >= go_on) return false;
  path.weight /= go_on;
  return true;
}

void Integrator::guide(Path& path, const Vec3f& albedo, const Vec3f& normal, Work& work) const {
  if (path.guided) return;
  path.guided = true;
  const Vec3f share = (path.weight / path.compression).cwiseMin(1.0f);
  work.first.guide_albedo += share.cwiseProduct(albedo);
  work.first.guide_normal += share.maxCoeff() * normal;
}

/// One flight and what it meets. False when the path has ended.
bool Integrator::step(Path& path, Work& work) const {
  const Ray& ray = path.ray;
  if (!(ray.direction.squaredNorm() < 2) || !ray.origin.allFinite()) {  // not a number: Embree must not see it, the pixel's owner must
    work.sum += ray.direction + 0 * ray.origin;
    return false;
  }
  if (++path.flights > kFlights || (path.weight.array() <= 0).all()) return false;
  const Ground::Met ground = scene_.ground.meet(ray);
  Hit hit;
  const bool found = geometry_.intersect(ray, ground.t, path.surfaces == 0, hit);
  const float t = found ? hit.t : ground.t;
  add_lights(path, t, work);
  if (t == kFar && path.media.inside != 0) {   // what is closed lets nobody out unseen: the path has slipped by an edge
    path.weight /= path.compression;
    path.compression = 1;
    path.media = {};
  }
  const Material* medium = scene_.medium(path.media);
  const bool murky = medium && !medium->clear();
  if (murky && flies_through(path, *medium, t, work)) return path.weight.maxCoeff() > 0;
  if (t == kFar) {
    add_background(path, 1, work);
    return false;
  }
  if (!murky) absorb(path, t);
  return found ? meets_surface(path, hit, work) : meets_ground(path, ground, work);
}

/// Lights nearer than t that the path's direction hits.
void Integrator::add_lights(const Path& path, float t, Work& work) const {
  if (path.scattered > 0 && (path.counted || (path.density == 0 && scene_.caustics != Caustics::path))) return;
  const auto add = [&](const auto& light) {
    const auto hit = light.find(path.from, path.ray.direction);
    if (!hit || hit->distance < path.flown || hit->distance - path.flown >= t) return;
    Path there = path;
    absorb(there, hit->distance - path.flown);
    const float share = path.density > 0 ? share_of_scattering(scene_.strategy, path.density, hit->density) : 1;
    work.sum += share * there.weight.cwiseProduct(hit->radiance);
  };
  for (const AreaLight& light : scene_.lights.areas) add(light);
  for (const SphereLight& light : scene_.lights.spheres) add(light);
}

/// What is without distance, behind all that a ray meets.
void Integrator::add_background(const Path& path, float portion, Work& work) const {
  Vec3f sum = scene_.lights.sky.radiance(path.ray.direction);
  const bool counted = path.scattered > 0 && (path.counted || (path.density == 0 && scene_.caustics != Caustics::path));
  const auto add = [&](const auto& light) {
    const auto hit = light.find(path.ray.origin, path.ray.direction);
    if (hit) sum += (path.density > 0 ? share_of_scattering(scene_.strategy, path.density, hit->density) : 1) * hit->radiance;
  };
  if (!counted) {
    for (const Sun& light : scene_.lights.suns) add(light);
    for (const Environment& light : scene_.lights.environments) add(light);
  }
  work.sum += portion * path.weight.cwiseProduct(sum);
}

/// What of a light gets through to a spot. Boundaries that do not bend light, as between equal indices or hidden in what comes first, are in nobody's
/// way; one that does lets it pass if `straight`, and is `crossed` then.
Vec3f Integrator::shadow(Media media, const Ray& ray, float distance, bool straight, bool& crossed) const {
  const Ground::Met ground = scene_.ground.meet(ray);
  float clear = 1;
  if (ground.t < distance) clear = scene_.ground.fade(ray.origin + ground.t * ray.direction);
  if (!(clear > 0)) return Vec3f::Zero();
  Crossings crossings;
  if (!geometry_.straight(ray, distance, crossings)) return Vec3f::Zero();
  if (crossings.count == 0 && media.inside == 0) return Vec3f::Constant(clear);
  auto* end = crossings.list.data() + crossings.count;
  std::sort(crossings.list.data(), end, [](const Crossings::One& a, const Crossings::One& b) { return a.t < b.t; });
  Vec3f depth = Vec3f::Zero();
  float so_far = 0;
  const auto fly = [&](Media through, float to) {
    if (const Material* m = scene_.medium(through)) depth += std::min(1e9f, to - so_far) * (m->absorption + m->scattering);
    so_far = to;
  };
  for (const auto* c = crossings.list.data(); c != end; ++c) {
    const Boundary b = boundary(media, scene_.rank[static_cast<std::size_t>(c->surface)], c->cosine < 0);
    fly(b.before, c->t);
    media = b.after;
    const float from = scene_.ior(b.before), to = scene_.ior(b.after);
    if (!b.real() || from == to) continue;
    if (!straight) return Vec3f::Zero();
    crossed = true;
    float cos_t;
    clear *= 1 - fresnel(std::min(1.0f, std::abs(c->cosine)), std::max(from, to) / std::min(from, to), cos_t);
  }
  if (media.inside != 0) fly(media, distance);
  return clear * (-depth.array()).exp();
}

}  // namespace render::trace
