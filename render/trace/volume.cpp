// Light inside of bodies: scattering media behind a boundary that refracts, and random walks below one that does not.
#include <bit>

#include "render/trace/work.h"

namespace render::trace {
namespace {

constexpr int kSteps = 16384;               // of a walk
constexpr float kWeightThatMatters = 0.2f;  // Russian roulette starts below

/// Scatters alike in all directions. The spot's frame is any.
struct Isotropic {
  Vec3f value(const Vec3f&) const { return Vec3f::Constant(1 / (4 * kPi)); }
  float density(const Vec3f&) const { return 1 / (4 * kPi); }
  Scattered sample(sampling::Point u, float) const { return {.direction = cap_direction(2, u), .weight = Vec3f::Ones(), .density = 1 / (4 * kPi)}; }
};

/// Numbers for a walk, which needs more than the sequence is good for: splitmix64 [Steele14] from one of its points.
class Stream {
 public:
  explicit Stream(sampling::Point p) : state_(std::uint64_t{std::bit_cast<std::uint32_t>(p.x)} << 32 | std::bit_cast<std::uint32_t>(p.y)) {}
  float next() {
    std::uint64_t v = state_ += 0x9e3779b97f4a7c15u;
    v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
    v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
    return static_cast<float>((v ^ (v >> 31)) >> 40) * 0x1p-24f;
  }
  sampling::Point point() {
    const float x = next();
    return {x, next()};
  }

 private:
  std::uint64_t state_;
};

constexpr float kLeastExtinction = 1e-30f;   // [1/m]

}  // namespace

/// Samples a length in the medium by one of the colours, weighed as if by all [PBRT4 14.2]. True when the path is scattered before t.
bool Integrator::flies_through(Path& path, const Material& medium, float t, Work& work) const {
  const sampling::Point u = work.points.point(work.sample, path.dimension++);
  const Eigen::Array3f extinction = medium.absorption + medium.scattering, share = path.weight.array() / path.weight.sum();
  int color = u.x < share[0] ? 0 : u.x < share[0] + share[1] ? 1 : 2;
  if (share[color] == 0) share.maxCoeff(&color);   // shares add up to 1 but for rounding
  const float length = -std::log(1 - u.y) / extinction[color];
  if (!(length < t)) {
    if (t == kFar) return false;
    const Eigen::Array3f through = (-t * extinction).exp();
    path.weight.array() *= through / (share * through).sum();
    return false;
  }
  const Eigen::Array3f through = (-length * extinction).exp();
  path.weight.array() *= medium.scattering.array() * through / (share * extinction * through).sum();
  ++path.scattered;
  path.counted = false;
  guide(path, (1 - medium.absorption.array() / extinction.max(kLeastExtinction)).matrix(), -path.ray.direction, work);   // 1 of a colour that passes
  const Vec3f point = path.ray.origin + length * path.ray.direction;
  const Frame frame(path.ray.direction);
  const Spot spot{point, path.ray.direction, frame, -Vec3f::UnitZ(), path.media};
  light(path, spot, Isotropic{}, false, work);
  if (!scatters(path, spot, Isotropic{}, work)) path.weight.setZero();
  return true;
}

/// Through the surface as through frosted glass, scattered alike in all directions at lengths of the medium, and out again. The
/// coat throws a part back inside whenever light arrives from there. False when nothing comes out.
bool Integrator::walks(Path& path, Spot& spot, const Material& material, const Vec3f& tint, int surface, Work& work) const {
  Stream random(work.points.point(work.sample, path.dimension + 1));
  Vec3f weight = path.weight.cwiseProduct(tint);
  Ray ray = path.ray;
  const float around = scene_.ior(path.media);
  const auto start = [&](const Vec3f& point, const Vec3f& normal) {  // from a surface to the side of its normal
    ray.origin = point + scene_.offset(point) * normal;
    ray.direction = Frame(normal).world(cosine_direction(random.point())).normalized();
  };
  start(spot.point, -spot.geometric);
  for (int k = 0; k < kSteps; ++k) {
    const float length = -std::log(1 - random.next()) / material.extinction;
    const Ground::Met ground = scene_.ground.meet(ray);
    Hit hit;
    if (geometry_.intersect(ray, std::min(length, ground.t), false, hit)) {
      const Vec3f point = ray.origin + hit.t * ray.direction;
      const bool leaves = ray.direction.dot(hit.geometric) > 0;
      const Material& other = scene_.surfaces[static_cast<std::size_t>(hit.surface)].material;
      if (hit.surface != surface && other.dielectric) {
        path.media = boundary(path.media, scene_.rank[static_cast<std::size_t>(hit.surface)], !leaves).after;
        ray.origin = point + scene_.offset(point) * ray.direction;
      } else if (hit.surface != surface) {
        weight = weight.cwiseProduct(other.color);
        start(point, leaves ? Vec3f(-hit.geometric) : hit.geometric);
      } else if (!leaves) {
        return false;  // it was outside: through a crack
      } else if (random.next() < material.inside) {
        start(point, -hit.geometric);
      } else {
        spot = {point, hit.geometric, Frame(hit.shading), Vec3f::UnitZ(), {}};
        const float eta = scene_.ior(path.media) / around;   // between what is outside here and there, as if it had been refracted
        path.weight = weight / (eta * eta);
        path.compression /= eta * eta;
        return true;
      }
    } else if (ground.t < length) {
      weight = weight.cwiseProduct(scene_.ground.material.color);
      start(ray.origin + ground.t * ray.direction, ground.normal);
    } else {
      weight = weight.cwiseProduct(material.scattering);
      ray.origin += length * ray.direction;
      ray.direction = cap_direction(2, random.point()).normalized();
    }
    const float go_on = weight.maxCoeff() / path.compression / kWeightThatMatters;
    if (go_on >= 1) continue;
    if (random.next() >= go_on) return false;
    weight /= go_on;
  }
  return false;
}

}  // namespace render::trace
