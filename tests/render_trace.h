#pragma once
// Rays followed one by one, without a camera: their mean and how sure it is.
#include "render/trace/integrator.h"
#include "tests/render_scenes.h"

namespace tests {

namespace trace = render::trace;

struct Mean {
  Vec3 value = Vec3::Zero(), variance = Vec3::Zero();  // variance of the mean, from groups of samples
};

/// What a scene sends along single rays.
class Rays {
 public:
  explicit Rays(const render::Setting& setting, const surface::Mesh& mesh = {}) : scene(trace::make_scene(setting)), geometry_(scene.surfaces, 1) {
    geometry_.set_frame(mesh, none_, {});
  }
  /// Groups are frames: independent of each other, each stratified.
  Mean mean(const Vec3& from, const Vec3& to, int groups, int samples) const {
    const trace::Integrator integrator(scene, geometry_);
    const trace::Ray ray{.origin = from.cast<float>(), .direction = (to - from).normalized().cast<float>()};
    const trace::Media around = integrator.media_at(ray.origin, 0.5f);
    Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
    for (int g = 0; g < groups; ++g) {
      const render::sampling::Sequence sequence(samples, g + 1);
      const render::sampling::PixelSampler points(sequence, 0, 0);
      Vec3 group = Vec3::Zero();
      for (int s = 0; s < samples; ++s) {
        trace::FirstHit first;
        group += integrator.radiance(ray, around, points, static_cast<std::uint32_t>(s), first).cast<double>();
      }
      group /= samples;
      sum += group;
      squares += group.cwiseProduct(group);
    }
    const Vec3 value = sum / groups;
    return {value, (squares / groups - value.cwiseProduct(value)).cwiseMax(0.0) / (groups - 1)};
  }
  trace::Scene scene;

 private:
  trace::Geometry geometry_;
  render::Grains none_;
};

/// Nothing but what a test adds: no ground, and paths as they are.
inline render::Setting bare_setting() {
  render::Setting setting = empty_setting();
  setting.options.ground = "none";
  setting.options.caustics = "path";
  setting.options.bounces = 256;
  return setting;
}

inline sim::Collider ball(const std::string& look, const Vec3& center = Vec3(0, 0, 0.5), double radius = 0.4) {
  sim::Collider collider;
  collider.name = look;
  collider.look = look;
  collider.shape.sphere = sim::Shape::Sphere{center, radius};
  return collider;
}

inline sim::Collider block(const std::string& look, const base::Box& box) {
  sim::Collider collider;
  collider.name = look;
  collider.look = look;
  collider.shape.box = box;
  return collider;
}

}  // namespace tests
