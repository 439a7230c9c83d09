#include "sim/material.h"

#include <array>
#include <cassert>

namespace sim {
namespace {

using namespace std::string_view_literals;
constexpr std::array kElasticityNames{"fixed_corotated"sv, "neo_hookean"sv, "hencky"sv, "tait"sv};
constexpr std::array kPlasticityNames{"none"sv, "von_mises"sv, "drucker_prager"sv, "snow"sv};

/// A preset is a line here, and a look of the same name in pictures.
const std::array kPresets{
    Preset{"jelly", {.model = Elasticity::neo_hookean, .density = 1010, .young = 1.5e4, .poisson = 0.45},
           "gelatine gels of 5 to 10 %: 5 to 30 kPa [Hall97]"},
    Preset{"rubber", {.model = Elasticity::neo_hookean, .density = 930, .young = 1.5e6, .poisson = 0.48}, "natural rubber [Ashby11]"},
    Preset{"steel", {.model = Elasticity::hencky, .density = 7850, .young = 2.1e11, .poisson = 0.3, .plasticity = Plasticity::von_mises,
                     .yield_stress = 2.35e8, .hardening_modulus = 1e9},
           "structural steel S235 [Ashby11]"},
    Preset{"clay", {.model = Elasticity::hencky, .density = 1800, .young = 4e6, .poisson = 0.4, .plasticity = Plasticity::von_mises,
                    .yield_stress = 3.5e4, .hardening_modulus = 1e4},
           "soft clay, undrained strength 20 kPa, stiffness 200 times that [Terzaghi96]"},
    Preset{"dry_sand", {.model = Elasticity::hencky, .density = 2200, .young = 3.537e5, .poisson = 0.3, .plasticity = Plasticity::drucker_prager,
                        .friction_angle = 35},
           "constants of [Klar16]; friction angle of a medium quartz sand [Terzaghi96]"},
    Preset{"wet_sand", {.model = Elasticity::hencky, .density = 2000, .young = 7e5, .poisson = 0.3, .plasticity = Plasticity::drucker_prager,
                        .friction_angle = 38, .cohesion = 1e3},
           "capillary cohesion of damp sand, about 1 kPa [Mitarai06]"},
    Preset{"snow", {.model = Elasticity::fixed_corotated, .density = 400, .young = 1.4e5, .poisson = 0.2, .plasticity = Plasticity::snow},
           "constants of [Stomakhin13]"},
    Preset{"water_mpm", {.model = Elasticity::tait, .density = 1000, .bulk_modulus = 2e5},
           "exponent of water [Becker07]; softer than water so that sound is 14 m/s, ten times a splash"},
};

constexpr std::array kPresetNames{"jelly"sv, "rubber"sv, "steel"sv, "clay"sv, "dry_sand"sv, "wet_sand"sv, "snow"sv, "water_mpm"sv};

}  // namespace

std::span<const std::string_view> material_presets() { return kPresetNames; }
std::span<const Preset> preset_table() { return kPresets; }

const Material& preset_material(std::string_view name) {
  for (const Preset& preset : kPresets)
    if (preset.name == name) return preset.material;
  assert(false && "the reader accepts the names of presets alone");
  return kPresets.front().material;
}

void Material::params(base::Params& p) {
  p.choice("model", model, kElasticityNames, "law of elasticity; tait is a liquid that gives way a little");
  p("density", density, "kg/m^3", "mass per volume", base::above(0));
  p.where(model != Elasticity::tait, "a model other than \"tait\", which has bulk_modulus", [&] {
    p("young", young, "Pa", "Young's modulus: stiffness; the square root of it sets the number of steps", base::above(0));
    p("poisson", poisson, "1", "Poisson's ratio: how far it thins when it is pulled; near 0.5 it keeps its volume", base::between(-1, 0.5));
    p("volume_averaging", volume_averaging, "against locking near poisson 0.5: changes of volume are averaged over a cell");
  });
  p.where(model == Elasticity::tait, "model = \"tait\"",
          [&] { p("bulk_modulus", bulk_modulus, "Pa", "pressure per relative change of volume", base::above(0)); });
  p.choice("plasticity", plasticity, kPlasticityNames, "what it does beyond its yield stress");
  p.where(plasticity == Plasticity::von_mises, "plasticity = \"von_mises\"", [&] {
    p("yield_stress", yield_stress, "Pa", "stress in a pulled bar at which it begins to flow", base::above(0));
    p("hardening_modulus", hardening_modulus, "Pa", "what the yield stress grows by per plastic strain", base::at_least(0));
  });
  p.where(plasticity == Plasticity::drucker_prager, "plasticity = \"drucker_prager\"", [&] {
    p("friction_angle", friction_angle, "deg", "angle of internal friction", base::within(1, 80));
    p("cohesion", cohesion, "Pa", "what it bears without pressure; 0 for dry grains", base::at_least(0));
  });
  p.where(plasticity == Plasticity::snow, "plasticity = \"snow\"", [&] {
    p("critical_compression", critical_compression, "1", "compression at which it gives way", base::between(0, 0.5));
    p("critical_stretch", critical_stretch, "1", "stretch at which it breaks", base::between(0, 0.5));
    p("hardening", hardening, "1", "how fast packed snow gets stiffer", base::within(0, 50));
    p("hardening_cap", hardening_cap, "1", "most that packing multiplies, and loosening divides, its stiffness by", base::within(1, 1000));
  });
  p.require(model != Elasticity::fixed_corotated || poisson >= 0, "poisson",
            "must be at least 0 with model \"fixed_corotated\", whose energy has no least value below");
  const bool plain = plasticity == Plasticity::none;
  p.require(plain || model != Elasticity::tait, "plasticity", "a liquid (model tait) has none");
  p.require(plain || model != Elasticity::neo_hookean, "plasticity", "needs model \"hencky\", or \"fixed_corotated\" for snow");
  p.require(plain || model != Elasticity::hencky || plasticity != Plasticity::snow, "plasticity", "snow needs model \"fixed_corotated\"");
  p.require(plain || model != Elasticity::fixed_corotated || plasticity == Plasticity::snow, "plasticity", "needs model \"hencky\"");
}

}  // namespace sim
