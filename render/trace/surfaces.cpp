// What happens where a path meets something.
#include "render/trace/work.h"

namespace render::trace {
namespace {

/// A direction bent just enough to be on the side that `normal` points to.
Vec3f keep_on_side(const Vec3f& direction, const Vec3f& normal) {
  constexpr float kLeast = 1e-3f;
  const float height = direction.dot(normal);
  if (height >= kLeast) return direction.normalized();
  return (direction + (kLeast - height) * normal).normalized();
}

/// The normal for shading, bent just enough to be seen where it looks away from the path, as along a silhouette. (The facet's own would show facets.)
Vec3f seen_normal(const Vec3f& shading, const Vec3f& direction) { return keep_on_side(shading, -direction); }

/// A diffuse surface.
struct Lambert {
  const Vec3f& color;
  Vec3f value(const Vec3f& in) const { return std::max(0.0f, in.z()) / kPi * color; }
  float density(const Vec3f& in) const { return std::max(0.0f, in.z()) / kPi; }
  Scattered sample(sampling::Point u, float) const {
    const Vec3f direction = cosine_direction(u);
    return {.direction = direction, .weight = color, .density = direction.z() / kPi};
  }
};

}  // namespace

bool Integrator::meets_ground(Path& path, const Ground::Met& met, Work& work) const {
  const Ground& ground = scene_.ground;
  Vec3f point = path.ray.origin + met.t * path.ray.direction;
  if (met.normal.z() == 1) point.z() = ground.z;
  const float fade = ground.fade(point);
  if (fade > 0) {
    add_background(path, fade, work);
    if (fade == 1) return false;
    path.weight *= 1 - fade;
  }
  if (path.is_straight()) work.first = {.found = true, .t = path.flown + met.t, .albedo = ground.material.color, .normal = met.normal, .id = 1};
  guide(path, ground.material.color, met.normal, work);
  const Frame frame(met.normal);
  return meets_opaque(path, {point, met.normal, frame, frame.local(-path.ray.direction)}, ground.material, ground.material.color, work);
}

bool Integrator::meets_surface(Path& path, const Hit& hit, Work& work) const {
  const Material& material = scene_.surfaces[static_cast<std::size_t>(hit.surface)].material;
  const Vec3f color = material.color.cwiseProduct(hit.tint);
  const Vec3f point = path.ray.origin + hit.t * path.ray.direction;
  if (path.is_straight())
    work.first = {
        .found = true, .t = path.flown + hit.t, .albedo = color, .normal = hit.shading, .velocity = geometry_.velocity(hit, point),
        .is_held = !scene_.surfaces[static_cast<std::size_t>(hit.surface)].shapes.empty(), .id = 2 + hit.surface};
  if (material.dielectric) return meets_dielectric(path, point, hit, work);
  const bool outside = path.ray.direction.dot(hit.geometric) < 0;
  const Vec3f geometric = outside ? hit.geometric : Vec3f(-hit.geometric);
  const Frame frame(seen_normal(outside ? hit.shading : Vec3f(-hit.shading), path.ray.direction));
  const Spot spot{point, geometric, frame, frame.local(-path.ray.direction)};
  if (material.model != Model::conductor || material.alpha > 0) guide(path, color, frame.n, work);
  if (material.model == Model::emissive) {
    work.sum += path.weight.cwiseProduct(material.radiance).cwiseProduct(hit.tint);
    return false;
  }
  if (material.model == Model::translucent) return outside && meets_translucent(path, spot, material, hit.tint, hit.surface, work);
  return meets_opaque(path, spot, material, color, work);
}

bool Integrator::meets_opaque(Path& path, const Spot& spot, const Material& material, const Vec3f& color, Work& work) const {
  if (++path.surfaces > scene_.bounces) return false;
  path.counted = false;
  if (material.model == Model::diffuse) {
    ++path.scattered;
    const Lambert lambert{color};
    light(path, spot, lambert, false, work);
    return scatters(path, spot, lambert, work);
  }
  const Reflector reflector(material, color, spot.out);
  const bool mirror = material.model == Model::conductor && material.alpha == 0;
  if (!mirror) {
    ++path.scattered;
    light(path, spot, reflector, false, work);
  }
  const int before = path.scattered;
  if (!scatters(path, spot, reflector, work)) return false;
  if (path.density == 0 && !mirror) path.scattered = before - 1;  // a smooth coat's reflection, seen as in a mirror
  return true;
}

/// Either the coat reflects, or light comes out of the body somewhere else.
bool Integrator::meets_translucent(Path& path, const Spot& spot, const Material& material, const Vec3f& tint, int surface, Work& work) const {
  if (++path.surfaces > scene_.bounces) return false;
  const float coat = coat_share(material, spot.out.z());
  path.counted = false;
  if (coat > 0) {
    const float share = std::clamp(coat, 0.1f, 0.9f);
    const bool reflects = work.points.point(work.sample, path.dimension).x < share;
    path.dimension += kDimensionsAtSurface;
    if (reflects) {
      path.weight /= share;
      if (material.alpha == 0) {
        path.weight *= coat;
        path.density = 0;
        path.go(spot.point + scene_.offset(spot.point) * spot.geometric,
                keep_on_side(spot.frame.world(Vec3f(-spot.out.x(), -spot.out.y(), spot.out.z())), spot.geometric));
        return true;
      }
      Material shell = material;
      shell.model = Model::coated;
      const Reflector reflector(shell, Vec3f::Zero(), spot.out);
      ++path.scattered;
      light(path, spot, reflector, false, work);
      return scatters(path, spot, reflector, work);
    }
    path.weight *= (1 - coat) / (1 - share);
  }
  Spot exit = spot;
  if (!walks(path, exit, material, tint, surface, work)) return false;
  path.dimension += kDimensionsAtSurface;
  ++path.scattered;
  exit.out = Vec3f::UnitZ();
  const Material body{.model = Model::translucent, .ior = material.ior, .alpha = material.alpha, .albedo = material.albedo};
  const Reflector leaving(body, Vec3f::Ones(), exit.out);
  light(path, exit, leaving, false, work);
  return scatters(path, exit, leaving, work);
}

bool Integrator::meets_dielectric(Path& path, const Vec3f& point, const Hit& hit, Work& work) const {
  const bool entering = path.ray.direction.dot(hit.geometric) < 0;
  const Boundary between = boundary(path.media, scene_.rank[static_cast<std::size_t>(hit.surface)], entering);
  const Vec3f geometric = entering ? hit.geometric : Vec3f(-hit.geometric);
  const float here = scene_.ior(between.before), eta = scene_.ior(between.after) / here;
  // A ray that starts beyond a boundary, in a gap narrower than its offset, has passed it without knowing.
  constexpr float kRounding = 1e-3f;
  if (const float change = 1 / (here * here * path.compression); std::abs(change - 1) > kRounding) path.weight *= change, path.compression *= change;
  if (!between.real() || eta == 1) {
    if (path.is_straight()) work.first = {};  // nothing is to be seen of it
    path.flown += hit.t;
    path.media = between.after;
    path.ray.origin = point - scene_.offset(point) * geometric;
    return true;
  }
  if (++path.surfaces > scene_.bounces) {
    work.sum += path.weight.cwiseProduct(scene_.lights.sky.radiance(path.ray.direction)) / path.compression;
    return false;
  }
  const Vec3f normal = seen_normal(entering ? hit.shading : Vec3f(-hit.shading), path.ray.direction);
  if (const float alpha = scene_.surfaces[static_cast<std::size_t>(hit.surface)].material.alpha; alpha > 0) {
    const Frame frame(normal);
    guide(path, Vec3f::Ones(), normal, work);
    return meets_rough_dielectric(path, {point, geometric, frame, frame.local(-path.ray.direction), between.after}, between, alpha, eta, work);
  }
  const float cos_i = std::min(-path.ray.direction.dot(normal), 1.0f);
  float cos_t;
  const float reflected = fresnel(cos_i, eta, cos_t);
  const auto reflection = [&](Path& p) {
    p.media = between.before;
    p.go(point + scene_.offset(point) * geometric, keep_on_side(reflect(p.ray.direction, normal, cos_i), geometric));
  };
  const auto refraction = [&](Path& p) {
    p.media = between.after;
    p.weight /= eta * eta;
    p.compression /= eta * eta;
    p.go(point - scene_.offset(point) * geometric, keep_on_side(refract(p.ray.direction, normal, cos_i, cos_t, eta), -geometric));
  };
  path.density = 0;
  path.dimension += kDimensionsAtSurface;
  if (path.surfaces == 1 && work.count < kBranches && reflected > 0 && reflected < 1) {
    Path& other = work.waiting[static_cast<std::size_t>(work.count++)] = path;
    reflection(other);
    other.weight *= reflected;
    other.dimension = kReflectionDimensions;
    refraction(path);
    path.weight *= 1 - reflected;
    return true;
  }
  const float choice = work.points.point(work.sample, path.dimension - 1).x;
  choice < reflected ? reflection(path) : refraction(path);
  return true;
}

/// Lights are sampled here unless a surface that scatters has counted them by a straight shadow ray.
bool Integrator::meets_rough_dielectric(Path& path, const Spot& spot, const Boundary& between, float alpha, float eta, Work& work) const {
  bool back;
  const RoughBoundary& table = scene_.rough_boundary(alpha, eta, back);
  const RoughDielectric rough(table, back, spot.out);
  path.media = between.before;
  path.counted = path.counted || (path.scattered > 0 && scene_.caustics != Caustics::path);
  if (!path.counted) light(path, spot, rough, true, work);
  if (!scatters(path, spot, rough, work)) return false;
  if (path.ray.direction.dot(spot.geometric) < 0) {
    path.media = between.after;
    path.compression /= eta * eta;
  }
  return true;
}

}  // namespace render::trace
