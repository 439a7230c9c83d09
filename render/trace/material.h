#pragma once
// A look as rays use it, with the tables it needs.
#include <array>
#include <string_view>

#include "base/vec.h"
#include "render/trace/albedo.h"

namespace render::trace {

using base::Vec3f;

enum class Model { diffuse, dielectric, conductor, coated, translucent, emissive };
inline constexpr std::array<std::string_view, 6> kModels = {"diffuse", "dielectric", "conductor", "coated", "translucent", "emissive"};

struct Material {
  Model model = Model::diffuse;
  bool dielectric = false;           // light goes through it: what rays may pass
  Vec3f color = Vec3f::Zero();       // diffuse, coated, translucent: albedo of the body. conductor: reflectance straight on
  Vec3f edge = Vec3f::Ones();        // conductor: tint of what is reflected at 82 degrees
  float ior = 1;                     // dielectric; coat of coated and translucent, 1: none
  float alpha = 0;                   // [1] rms slope of the facets, 0: smooth
  Vec3f absorption = Vec3f::Zero();  // [1/m] dielectric
  Vec3f scattering = Vec3f::Zero();  // [1/m] dielectric; of translucent: of the random walk, as a share of extinction
  float extinction = 0;              // [1/m] translucent
  Vec3f radiance = Vec3f::Zero();    // emissive
  int priority = 0;                  // dielectric: of two that overlap the higher one is there
  Albedo albedo = {};                // conductor: of mirror facets. coated, translucent: of the coat
  float inside = 0;                  // coated, translucent: share that the coat throws back into the body
  bool clear() const { return scattering.isZero(); }
};

}  // namespace render::trace
