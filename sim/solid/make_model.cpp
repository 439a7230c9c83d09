#include "sim/solid/make_model.h"

#include <numbers>

namespace sim {

Model make_model(const Material& m) {
  const Lame lame = Lame::of(m.young, m.poisson);
  switch (m.plasticity) {
    case Plasticity::von_mises: return Plastic<VonMises>{{lame}, {.yield = m.yield_stress, .hardening = m.hardening_modulus}};
    case Plasticity::drucker_prager:
      return Plastic<DruckerPrager>{{lame}, {.friction_angle = m.friction_angle * std::numbers::pi / 180, .cohesion = m.cohesion}};
    case Plasticity::snow: return Plastic<Snow>{{lame}, {m.critical_compression, m.critical_stretch, m.hardening, m.hardening_cap}};
    case Plasticity::none: break;
  }
  switch (m.model) {
    case Elasticity::fixed_corotated: return Elastic<FixedCorotated>{{lame}};
    case Elasticity::hencky: return Elastic<Hencky>{{lame}};
    case Elasticity::tait: return Liquid{{m.bulk_modulus}};
    case Elasticity::neo_hookean: break;
  }
  return Elastic<NeoHookean>{{lame}};
}

}  // namespace sim
