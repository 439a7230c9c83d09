#pragma once
// What a body of a solid shot is made of: keys of its material, and the presets that a name stands for.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "base/params.h"

namespace sim {

enum class Elasticity { fixed_corotated, neo_hookean, hencky, tait };
enum class Plasticity { none, von_mises, drucker_prager, snow };

struct Material {
  Elasticity model = Elasticity::neo_hookean;
  double density = 1000;                     // [kg/m^3]
  double young = 1e4, poisson = 0.45;        // [Pa], [1]
  double bulk_modulus = 2e5;                 // [Pa] of model tait
  Plasticity plasticity = Plasticity::none;
  double yield_stress = 1e6, hardening_modulus = 0;         // [Pa] von_mises
  double friction_angle = 35, cohesion = 0;                 // [deg], [Pa] drucker_prager
  double critical_compression = 2.5e-2, critical_stretch = 7.5e-3, hardening = 10, hardening_cap = 20;   // [1] snow
  bool volume_averaging = false;             // against locking: changes of volume and pressure are those of the cell
  void params(base::Params&);
};

/// Names of the presets, as the shot writes them.
std::span<const std::string_view> material_presets();
/// Values and where they come from; the name must be one of the presets.
struct Preset {
  std::string_view name;
  Material material;
  std::string_view source;
};
std::span<const Preset> preset_table();
const Material& preset_material(std::string_view name);

}  // namespace sim
