// Looks: the keys of [look.NAME], and the table of those that are shipped.
#include "render/render.h"
#include "render/trace/material.h"

namespace render {

namespace {

constexpr std::string_view kDrawn[] = {"surface", "grains"};

}  // namespace

void Look::params(base::Params& p) {
  p("model", model, "how the surface scatters light", trace::kModels);
  const bool coats = model == "coated" || model == "translucent";
  p.where(model != "dielectric", "a model other than \"dielectric\", which has absorption", [&] {
    p("color", color, "1", "albedo, scene-linear Rec.709; of a conductor: reflectance straight on; of what is emissive: radiance",
      base::within(0, 1));
  });
  p.where(coats || model == "dielectric" || model == "conductor", "model = \"dielectric\", \"conductor\", \"coated\" or \"translucent\"",
          [&] { p("roughness", roughness, "1", "0 a mirror or clear, 1 as dull as can be", base::within(0, 1)); });
  p.where(model == "dielectric", "model = \"dielectric\"", [&] {
    p("ior", ior, "1", "index of refraction", base::within(1, 4));
    p("absorption", absorption, "1/m", "absorption of red, green and blue", base::at_least(0));
    p("scattering", scattering, "1/m", "how often light is scattered inside: milkiness", base::at_least(0));
    p("priority", priority, "1", "where two dielectrics overlap the one of higher priority is; of equals a collider, else the solid, else the later",
      base::within(-1000, 1000));
  });
  p.where(model == "conductor", "model = \"conductor\"", [&] { p("edge", edge, "1", "tint of what it reflects at 82 degrees", base::within(0, 1)); });
  p.where(coats, "model = \"coated\" or \"translucent\"",
          [&] { p("coat", coat, "1", "index of refraction of a coat around the body; 1 is none", base::within(1, 4)); });
  p.where(model == "translucent", "model = \"translucent\"",
          [&] { p("depth", depth, "m", "how far light goes in it before it is scattered", base::above(0)); });
  p.where(model == "emissive", "model = \"emissive\"",
          [&] { p("intensity", intensity, "1", "radiance that the colour is multiplied with", base::at_least(0)); });
  p("draw", draw, "of a body: its surface, or every particle as a ball", kDrawn);
  p.where(draw == "grains", "draw = \"grains\"", [&] {
    p("grain_size", grain_size, "1", "radius of a grain, in those of a ball of the particle's volume", base::above(0));
    p("grain_variation", grain_variation, "1", "share by which grains are lighter or darker than the colour", base::within(0, 1));
  });
}

// Water: pure water takes 0.34, 0.06 and 0.01 of a metre's red, green and blue; a tank of a metre or two shows its colour only when
// that is raised by about three, as a trace of copper or chlorine does.
std::map<std::string, Look> shipped_looks() {
  using base::Vec3;
  std::map<std::string, Look> looks;
  looks["water"] = {.model = "dielectric", .ior = 1.333, .absorption = Vec3(1.1, 0.24, 0.12)};
  looks["glass"] = {.model = "dielectric", .ior = 1.5, .absorption = Vec3(0.6, 0.25, 0.45)};
  looks["jelly"] = {.model = "dielectric", .roughness = 0.1, .ior = 1.36, .absorption = Vec3(0.5, 9, 12), .scattering = Vec3(1.6, 1.2, 1.0)};
  looks["snow"] = {.model = "translucent", .color = Vec3(0.93, 0.95, 0.97), .roughness = 0, .coat = 1, .depth = 0.006};
  looks["wax"] = {.model = "translucent", .color = Vec3(0.85, 0.68, 0.42), .roughness = 0.45, .coat = 1.44, .depth = 0.012};
  looks["rubber"] = {.model = "coated", .color = Vec3(0.035, 0.035, 0.038), .roughness = 0.62, .coat = 1.5};
  looks["clay"] = {.model = "coated", .color = Vec3(0.42, 0.17, 0.09), .roughness = 0.8, .coat = 1.35};
  looks["steel"] = {.model = "conductor", .color = Vec3(0.56, 0.57, 0.58), .roughness = 0.3, .edge = Vec3(0.9, 0.92, 0.95)};
  looks["lamp"] = {.model = "emissive", .color = Vec3(1, 0.62, 0.3), .intensity = 2.5};
  looks["sand"] = {.color = Vec3(0.58, 0.43, 0.27), .draw = "grains"};
  looks["dry_sand"] = {.color = Vec3(0.62, 0.47, 0.29), .draw = "grains"};
  looks["wet_sand"] = {.color = Vec3(0.36, 0.26, 0.16), .draw = "grains"};
  looks["water_mpm"] = looks["water"];
  looks["plaster"] = {.color = Vec3(0.72, 0.66, 0.58)};
  looks["slate"] = {.color = Vec3(0.075, 0.085, 0.1)};
  looks["ground"] = {.color = Vec3(0.60, 0.59, 0.57)};
  return looks;
}

}  // namespace render
