// The keys of [render], [camera], [[light]] and [look.NAME].
#include <algorithm>

#include "render/attribute/attribute.h"
#include "render/render.h"

namespace render {
namespace {

constexpr std::string_view kKinds[] = {"area", "sphere", "sun", "sky", "environment"};
constexpr std::string_view kCaustics[] = {"straight", "path", "none"};
constexpr std::string_view kGrounds[] = {"floor", "cyclorama", "none"};
constexpr std::string_view kDenoise[] = {"none", "layer", "picture"};
constexpr std::string_view kDraw[] = {"points", "surface"};
constexpr std::string_view kViews[] = {"filmic", "srgb"};

/// Keys ascend, and what they say is not said again beside them.
void check_keys(const Camera& c, base::Params& p) {
  const auto named = [&](auto quantity) {
    return std::any_of(c.keys.begin(), c.keys.end(), [&](const CameraKey& k) { return (k.*quantity).has_value(); });
  };
  for (std::size_t i = 1; i < c.keys.size(); ++i)
    p.require(c.keys[i].frame > c.keys[i - 1].frame, "key." + std::to_string(i + 1) + ".frame", "must be above the frame of the key before");
  p.require(!c.position || !named(&CameraKey::position), "position", "is said by [[camera.key]] as well");
  p.require(!c.target || !named(&CameraKey::target), "target", "is said by [[camera.key]] as well");
  p.require(!c.fov || !named(&CameraKey::fov), "fov", "is said by [[camera.key]] as well");
  p.require(!c.focus || !named(&CameraKey::focus), "focus", "is said by [[camera.key]] as well");
  p.require(c.aperture || !named(&CameraKey::focus), "key", "focus needs camera.aperture: through a pinhole all is sharp");
}

}  // namespace

void Preview::params(base::Params& p) {
  const std::span<const std::string_view> names = p.vector_size() == 3 ? std::span<const std::string_view>(attribute::kNames) : attribute::kFlatNames;
  p("color", color, "what previews (and two-dimensional pictures) are coloured by", names);
  p("range", range, "the colour's", "end of the colour bar [m/s, 1/s, Pa, 1 or J/kg]", base::at_least(1e-30), "one that the shot hardly passes");
  if (p.when(p.vector_size() == 3)) p("draw", draw, "the particles, or the surface made of them", kDraw);
  else p.without("draw", "has no effect in two dimensions: points are drawn");
  p.require(draw == "points" || !attribute::only_particles_have(color), "color",
            "is known of particles only: preview.draw = \"surface\" cannot show it");
}

void CameraKey::params(base::Params& p) {
  p("frame", frame, "1", "frame of the key; keys stand in ascending order");
  p("position", position, "m", "where the camera stands", "as other keys say");
  p("target", target, "m", "what it looks at", "as other keys say");
  p("fov", fov, "degrees", "vertical field of view", base::within(1, 150), "as other keys say");
  p("focus", focus, "m", "distance that is sharp", base::above(0), "as other keys say");
  p.require(position || target || fov || focus, "frame", "the key says nothing of this frame: it needs position, target, fov or focus");
}

void Turntable::params(base::Params& p) {
  p("revolutions", revolutions, "1", "turns about the target, counter-clockwise seen from above", base::within(-1e6, 1e6));
  p("frames", frames, "1", "frames that they take; the film repeats after that", base::within(1e-3, 1e9));
}

void SetPiece::params(base::Params& p) {
  p("name", name, "unique name, used by --set set.NAME.key");
  std::string path = file.string();
  p.table("mesh", "what it is", [&](base::Params& q) {
    q("file", path, "OBJ, PLY or STL, z up; relative to the shot");
    q("scale", scale, "m", "length of one of the file's units", base::above(0));
    q("translate", translate, "m", "where the file's origin is");
  });
  file = path;
  p.require(!path.empty(), "mesh", "needs a file");
  p("look", look, "look of the piece in pictures");
}

void Camera::params(base::Params& p) {
  p("position", position, "m", "where the camera stands", "far enough from the target to see the whole domain");
  p("target", target, "m", "what it looks at", "the middle of the domain");
  p("up", up, "1", "direction that points up in the picture");
  p("fov", fov, "degrees", "vertical field of view", base::within(1, 150), "35");
  p("shutter", shutter, "1", "share of a frame's time that it is exposed for, centred on the frame's moment; 0 freezes all motion",
    base::within(0, 1));
  p("aperture", aperture, "1", "f-number of the lens, such as 2.8", base::within(0.1, 1000), "a pinhole: all is sharp");
  p("focus", focus, "m", "distance along the line of sight that is sharp, with an aperture", base::above(0), "the target's");
  p("sensor", sensor, "m", "height of the film behind the lens: how wide an f-number opens", base::within(1e-4, 10));
  p.list("key", keys, "the camera at a frame; each quantity runs smoothly through the keys that name it");
  Turntable turn = turntable.value_or(Turntable{});
  if (p.table("turntable", "circles the target", [&](base::Params& q) { turn.params(q); })) turntable = turn;
  check_keys(*this, p);
  p.require(aperture || !focus, "focus", "needs camera.aperture: through a pinhole all is sharp");
  p.require(up.norm() > 1e-6, "up", "must not be zero");
  const bool both = position && target;
  const bool apart = !both || (*target - *position).norm() > 1e-6;
  p.require(apart, "target", "must not be the camera's position");
  p.require(!both || !apart || (*target - *position).cross(up).norm() > 1e-6 * (*target - *position).norm() * up.norm(), "up",
            "must not be along the line of sight");
}

void Light::params(base::Params& p) {
  p("kind", kind,
    "a rectangle that shines to one side, a sphere, the sun, a sky that goes from one colour to another, or a picture of the surroundings", kKinds);
  p("color", color, "1", "scene-linear Rec.709; of a sky: at the zenith; of an environment: tint", base::at_least(0));
  p("intensity", intensity, "1", "radiance that the colour is multiplied with; of a sun: what it gives a white surface that faces it",
    base::at_least(0));
  p.where(kind == "area" || kind == "sphere", "kind = \"area\" or \"sphere\"", [&] { p("position", position, "m", "its middle"); });
  p.where(kind == "area", "kind = \"area\"", [&] {
    p("target", target, "m", "point that it faces");
    p("width", width, "m", "horizontal side", base::above(0));
    p("height", height, "m", "other side", base::above(0));
    p.require((target - position).norm() > 1e-6, "target", "must not be the light's position");
  });
  p.where(kind == "sphere", "kind = \"sphere\"", [&] { p("radius", radius, "m", "of the sphere", base::above(0)); });
  p.where(kind == "sun", "kind = \"sun\"", [&] {
    p("direction", direction, "1", "the way its light goes");
    p("angle", angle, "degrees", "angular diameter: how soft its shadows are", base::within(0.05, 90));
    p.require(direction.norm() > 1e-6, "direction", "must not be zero");
  });
  p.where(kind == "sky", "kind = \"sky\"", [&] { p("horizon", horizon, "1", "colour at the horizon and below", base::at_least(0)); });
  p.where(kind == "environment", "kind = \"environment\"", [&] {
    p("file", file, "lat-long picture (EXR, HDR, or one as displayed), relative to the shot; its middle is seen towards +y");
    p("rotation", rotation, "degrees", "turns it about z, clockwise seen from above");
    p.require(!file.empty(), "file", "an environment needs a picture");
  });
}

std::vector<Light> default_lights(const base::Box& domain) {
  const base::Vec3 middle = 0.5 * (domain.lower + domain.upper);
  const double reach = 0.5 * domain.size().norm();
  Light sky{.kind = "sky", .color = base::Vec3(0.46, 0.56, 0.72), .horizon = base::Vec3(0.335, 0.35, 0.37), .intensity = 1};
  Light key{.kind = "area", .color = base::Vec3(1, 0.94, 0.85), .intensity = 31};
  key.target = base::Vec3(middle.x(), middle.y(), domain.lower.z());
  key.position = key.target + reach * base::Vec3(-1.15, 0.8, 2.3);  // behind the water as the default camera sees it: it shines through
  key.width = key.height = 0.8 * reach;
  return {sky, key};
}

void Options::params(base::Params& p) {
  p("width", width, "pixels", "width of the image", base::within(16, 16384));
  p("height", height, "pixels", "height of the image", base::within(16, 16384));
  if (!p.when(p.vector_size() == 3)) {
    for (const auto key : {"spp", "bounces", "caustics", "ground", "noise", "time_limit", "denoise", "view", "exposure"})
      p.without(key, "has no effect in two dimensions: points are drawn as they are displayed");
    return;
  }
  p("spp", spp, "1", "samples a pixel; a power of two is stratified best", base::within(1, 65536));
  p("bounces", bounces, "1", "surfaces a path may meet", base::within(1, 256));
  p("caustics", caustics,
    "light through dielectrics: straight tinted shadow rays (biased, quiet), found by chance (unbiased, noisy), or none: full shadows", kCaustics);
  p("ground", ground, "the domain's floor without end, a studio's backdrop behind the domain, or nothing", kGrounds);
  p("noise", noise, "1", "relative error at which a tile of 16 x 16 pixels gets no more samples; spp is the most", base::between(0, 1),
    "all get spp samples");
  p("time_limit", time_limit, "s", "a frame that takes longer stops with the samples it has, and is not reproducible", base::above(0), "none");
  p("denoise", denoise, "noise taken out by what pixels have in common: not at all, as the EXR's channels denoised.RGB, or shown by the PNG, too",
    kDenoise);
  p.require(denoise == "none" || spp > 1, "denoise", "needs render.spp of 2 or more: one sample does not tell noise from a picture");
  p("view", view, "how scene light becomes PNG colours", kViews);
  p("exposure", exposure, "stops", "brightness of the PNG", base::within(-20, 20));
}

namespace {

bool draws(const Setting& setting, const std::string& as) {
  const auto drawn = [&](const std::string& name) {
    const auto look = setting.looks.find(name);
    return look != setting.looks.end() && look->second.draw == as;
  };
  return drawn(setting.liquid_look) || std::any_of(setting.body_looks.begin(), setting.body_looks.end(), drawn);
}

}  // namespace

bool Setting::draws_surface() const { return draws(*this, "surface"); }
bool Setting::draws_grains() const { return draws(*this, "grains"); }

bool Setting::is_grains(std::size_t body) const {
  const auto look = looks.find(body < body_looks.size() ? body_looks[body] : liquid_look);
  return look != looks.end() && look->second.draw == "grains";
}

bool Setting::parts_bodies() const {
  if (dimension != 3) return false;
  bool differ = false, grains = true;
  for (std::size_t body = 0; body < body_looks.size(); ++body) {
    differ = differ || body_looks[body] != body_looks.front();
    grains = grains && is_grains(body);
  }
  return differ && !grains;
}

void Setting::params(base::Params& p) {
  p.table("render", "the images", [&](base::Params& q) { options.params(q); });
  p.table("preview", "previews", [&](base::Params& q) { preview.params(q); });
  if (p.vector_size() == 2) {
    for (const auto table : {"camera", "light", "set", "look"})
      p.without(table, "has no effect in two dimensions: points are drawn, coloured as [preview] says, and all of the domain is in view");
    return;
  }
  p.table("camera", "the view; what is unset shows the whole domain", [&](base::Params& q) { camera.params(q); });
  p.list("light", lights, "lights; none means a soft sky and one area light");
  p.list("set", sets, "geometry from files that is drawn, but not met by the simulation");
  p.named("look", looks, "how surfaces look");
}

std::vector<std::filesystem::path> Setting::files() const {
  std::vector<std::filesystem::path> named;
  for (const Light& light : lights)
    if (light.kind == "environment") named.push_back(folder / light.file);
  for (const SetPiece& piece : sets) named.push_back(piece.file);
  return named;
}

}  // namespace render
