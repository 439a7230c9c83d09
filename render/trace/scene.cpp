#include "render/trace/scene.h"

#include "base/error.h"

namespace render::trace {
namespace {

Material material_of(const Setting& setting, const std::string& look, const std::string& key) {
  const auto found = setting.looks.find(look);
  if (found == setting.looks.end()) {
    std::string names;
    for (const auto& entry : setting.looks) names += (names.empty() ? "" : ", ") + entry.first;
    throw base::Error({.key = key, .value = "\"" + look + "\"", .allowed = "must be one of " + names});
  }
  const Look& l = found->second;
  return {.dielectric = l.model == "dielectric", .color = l.color.cast<float>(), .ior = static_cast<float>(l.ior), .absorption = l.absorption.cast<float>()};
}

AreaLight area_light(const Light& light) {
  const base::Vec3 normal = (light.target - light.position).normalized();
  base::Vec3 side = normal.cross(base::Vec3::UnitZ());
  if (side.norm() < 1e-6) side = base::Vec3::UnitX();
  side.normalize();
  const base::Vec3 u = 0.5 * light.width * side, v = 0.5 * light.height * side.cross(normal);
  return {.middle = light.position.cast<float>(), .u = u.cast<float>(), .v = v.cast<float>(), .normal = normal.cast<float>(),
          .radiance = (light.intensity * light.color).cast<float>(), .area = static_cast<float>(light.width * light.height)};
}

}  // namespace

Scene make_scene(const Setting& setting) {
  Scene scene;
  scene.surfaces.push_back({.material = material_of(setting, setting.liquid_look, "body.look")});
  for (const sim::Collider& c : setting.colliders)
    scene.surfaces.push_back({.material = material_of(setting, c.look, "collider." + c.name + ".look"), .shape = c.shape});
  for (const Light& light : setting.lights.empty() ? default_lights(setting.domain) : setting.lights) {
    if (light.kind == "area") {
      scene.lights.push_back(area_light(light));
    } else {
      scene.sky.zenith += (light.intensity * light.color).cast<float>();
      scene.sky.horizon += (light.intensity * light.horizon).cast<float>();
    }
  }
  const float reach = static_cast<float>(0.5 * setting.domain.size().norm());
  const Vec3f middle = (0.5 * (setting.domain.lower + setting.domain.upper)).cast<float>();
  scene.ground = {.material = material_of(setting, "ground", "look.ground"), .z = static_cast<float>(setting.domain.lower.z()), .middle = middle.head<2>(),
                  .solid_to = 1.5f * reach, .gone_from = 7 * reach};
  scene.bounces = static_cast<int>(setting.options.bounces);
  scene.straight = setting.options.caustics == "straight";
  scene.offset = 2e-5f * (reach + middle.cwiseAbs().maxCoeff());
  return scene;
}

}  // namespace render::trace
