#include "render/plan.h"

#include <algorithm>

namespace render {
namespace {

using Often = base::PassRow::Often;

bool in_space(const Setting& s) { return s.dimension == 3; }
bool is_flat(const Setting& s) { return s.dimension == 2; }

/// Lights of a kind, the default ones included.
bool shines(const Setting& s, std::string_view kind) {
  if (is_flat(s)) return false;
  const std::vector<Light> lights = s.lights.empty() ? default_lights(s.domain) : s.lights;
  return std::any_of(lights.begin(), lights.end(), [&](const Light& light) { return light.kind == kind; });
}

/// Looks that something in the scene has.
std::vector<const Look*> used_looks(const Setting& s) {
  std::vector<std::string> names = {s.liquid_look};
  names.insert(names.end(), s.body_looks.begin(), s.body_looks.end());
  for (const sim::Collider& c : s.colliders) names.push_back(c.look);
  for (const SetPiece& piece : s.sets) names.push_back(piece.look);
  if (s.options.ground != "none") names.push_back("ground");
  std::vector<const Look*> looks;
  for (const std::string& name : names)
    if (const auto found = s.looks.find(name); found != s.looks.end()) looks.push_back(&found->second);
  return looks;
}

template <class Predicate>
bool any_look(const Setting& s, const Predicate& has) {
  const std::vector<const Look*> looks = used_looks(s);
  return in_space(s) && std::any_of(looks.begin(), looks.end(), [&](const Look* look) { return has(*look); });
}

bool any_model(const Setting& s, std::string_view model) {
  return any_look(s, [&](const Look& look) { return look.model == model; });
}

bool previews_surface(const Setting& s) { return in_space(s) && s.preview.draw == "surface"; }
bool has_ground(const Setting& s, std::string_view ground) { return in_space(s) && s.options.ground == ground; }
bool has_caustics(const Setting& s, std::string_view caustics) { return in_space(s) && s.options.caustics == caustics; }
bool has_denoise(const Setting& s, std::string_view denoise) { return in_space(s) && s.options.denoise == denoise; }
bool has_view(const Setting& s, std::string_view view) { return in_space(s) && s.options.view == view; }

}  // namespace

std::span<const base::PassRow> pass_rows() {
  static const std::vector<base::PassRow> rows = {
      {"mesh", Often::frame, {"surface file"}, {"mesh"}},
      {"bvh", Often::frame, {}, {"scene"}},
      {"trace", Often::frame, {"scene"}, {"image"}},
      {"denoise", Often::frame, {"image"}, {"image"}},
      {"draw", Often::frame, {"points file"}, {"image"}},
      {"write_image", Often::frame, {"image"}, {"image file"}},
  };
  return rows;
}

std::span<const base::EffectRow<Setting>> effect_rows() {
  static const std::vector<base::EffectRow<Setting>> rows = {
      {"path tracing",
       {"sim.dimension", "render.width", "render.height", "render.spp", "render.bounces", "camera.position", "camera.target", "camera.up",
        "camera.fov"},
       in_space,
       {"bvh", "trace", "write_image"}},
      {"AOVs", {"sim.dimension"}, in_space, {"trace"}},
      {"flat drawing", {"sim.dimension", "render.width", "render.height"}, is_flat, {"draw", "write_image"}},
      {"surface in pictures",
       {"body.NAME.look", "body.NAME.material", "look.NAME.draw=surface"},
       [](const Setting& s) { return in_space(s) && s.draws_surface(); },
       {"mesh", "bvh<mesh"}},
      {"grains in pictures",
       {"body.NAME.look", "body.NAME.material", "look.NAME.draw=grains", "look.NAME.grain_size", "look.NAME.grain_variation"},
       [](const Setting& s) { return in_space(s) && s.draws_grains(); },
       {"bvh<points file"}},
      {"solids in pictures", {"collider.NAME.look"}, [](const Setting& s) { return in_space(s) && !s.colliders.empty(); }, {"bvh<solids"}},
      {"set", {"set.NAME"}, [](const Setting& s) { return in_space(s) && !s.sets.empty(); }, {"bvh<set"}},
      {"coloured by speed", {"preview.color=speed", "preview.range"}, [](const Setting& s) { return s.preview.color == "speed"; }},
      {"coloured by x", {"preview.color=velocity_x"}, [](const Setting& s) { return s.preview.color == "velocity_x"; }},
      {"coloured by y", {"preview.color=velocity_y"}, [](const Setting& s) { return s.preview.color == "velocity_y"; }},
      {"coloured by z", {"preview.color=velocity_z"}, [](const Setting& s) { return s.preview.color == "velocity_z"; }},
      {"coloured by vorticity", {"preview.color=vorticity"}, [](const Setting& s) { return s.preview.color == "vorticity"; }},
      {"coloured by pressure", {"preview.color=pressure"}, [](const Setting& s) { return s.preview.color == "pressure"; }},
      {"coloured by strain", {"preview.color=strain"}, [](const Setting& s) { return s.preview.color == "strain"; }},
      {"coloured by mode energy", {"preview.color=mode_energy"}, [](const Setting& s) { return s.preview.color == "mode_energy"; }},
      {"coloured by material", {"preview.color=material"}, [](const Setting& s) { return s.preview.color == "material"; }},
      {"previews of particles", {"preview.draw=points"}, [](const Setting& s) { return !previews_surface(s); }},
      {"previews of the surface", {"preview.draw=surface"}, previews_surface},
      {"motion blur", {"camera.shutter"}, [](const Setting& s) { return in_space(s) && s.camera.shutter > 0; }},
      {"depth of field",
       {"camera.aperture", "camera.focus", "camera.sensor"},
       [](const Setting& s) { return in_space(s) && s.camera.aperture.has_value(); }},
      {"moving camera", {"camera.key.N"}, [](const Setting& s) { return in_space(s) && !s.camera.keys.empty(); }},
      {"turntable", {"camera.turntable"}, [](const Setting& s) { return in_space(s) && s.camera.turntable.has_value(); }},
      {"area lights", {"light.N.kind=area", "light.N"}, [](const Setting& s) { return shines(s, "area"); }},
      {"sphere lights", {"light.N.kind=sphere"}, [](const Setting& s) { return shines(s, "sphere"); }},
      {"sun", {"light.N.kind=sun"}, [](const Setting& s) { return shines(s, "sun"); }},
      {"sky", {"light.N.kind=sky"}, [](const Setting& s) { return shines(s, "sky"); }},
      {"environment picture", {"light.N.kind=environment"}, [](const Setting& s) { return shines(s, "environment"); }},
      {"diffuse", {"look.NAME.model=diffuse", "look.NAME"}, [](const Setting& s) { return any_model(s, "diffuse"); }},
      {"dielectric", {"look.NAME.model=dielectric"}, [](const Setting& s) { return any_model(s, "dielectric"); }},
      {"conductor", {"look.NAME.model=conductor"}, [](const Setting& s) { return any_model(s, "conductor"); }},
      {"coat", {"look.NAME.model=coated"}, [](const Setting& s) { return any_model(s, "coated"); }},
      {"subsurface walks", {"look.NAME.model=translucent"}, [](const Setting& s) { return any_model(s, "translucent"); }},
      {"emission", {"look.NAME.model=emissive"}, [](const Setting& s) { return any_model(s, "emissive"); }},
      {"milkiness",
       {"look.NAME.scattering"},
       [](const Setting& s) { return any_look(s, [](const Look& look) { return look.model == "dielectric" && !look.scattering.isZero(0); }); }},
      {"straight caustics", {"render.caustics=straight"}, [](const Setting& s) { return has_caustics(s, "straight"); }},
      {"traced caustics", {"render.caustics=path"}, [](const Setting& s) { return has_caustics(s, "path"); }},
      {"full shadows", {"render.caustics=none"}, [](const Setting& s) { return has_caustics(s, "none"); }},
      {"floor", {"render.ground=floor"}, [](const Setting& s) { return has_ground(s, "floor"); }},
      {"cyclorama", {"render.ground=cyclorama"}, [](const Setting& s) { return has_ground(s, "cyclorama"); }},
      {"no ground", {"render.ground=none"}, [](const Setting& s) { return has_ground(s, "none"); }},
      {"adaptive sampling", {"render.noise"}, [](const Setting& s) { return in_space(s) && s.options.noise.has_value(); }},
      {"time limit", {"render.time_limit"}, [](const Setting& s) { return in_space(s) && s.options.time_limit.has_value(); }},
      {"noisy pictures", {"render.denoise=none"}, [](const Setting& s) { return has_denoise(s, "none"); }},
      {"denoised layer", {"render.denoise=layer"}, [](const Setting& s) { return has_denoise(s, "layer"); }, {"denoise"}},
      {"denoised pictures", {"render.denoise=picture"}, [](const Setting& s) { return has_denoise(s, "picture"); }, {"denoise"}},
      {"filmic view", {"render.view=filmic", "render.exposure"}, [](const Setting& s) { return has_view(s, "filmic"); }},
      {"plain view", {"render.view=srgb", "render.exposure"}, [](const Setting& s) { return has_view(s, "srgb"); }},
  };
  return rows;
}

base::Plan plan_of(const Setting& setting) { return base::make_plan("render", effect_rows(), pass_rows(), setting); }

base::Plan preview_plan_of(const Setting& setting) {
  static const std::vector<base::EffectRow<Setting>> rows = {
      {"preview", {"render.width", "render.height"}, [](const Setting&) { return true; }, {"draw", "write_image"}},
      {"surface in previews", {"preview.draw=surface"}, previews_surface, {"mesh"}}};
  return base::make_plan("preview", std::span<const base::EffectRow<Setting>>(rows), pass_rows(), setting);
}

}  // namespace render
