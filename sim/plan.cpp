#include "sim/plan.h"

#include "sim/effects/gravity.h"
#include "sim/transfer/modes.h"
#include "sim/transfer/order.h"

#include <algorithm>

namespace sim {
namespace {

using base::Attribute;
using Often = base::PassRow::Often;

std::int64_t real_bytes(const Scene& s) { return s.options.precision == Precision::double_precision ? sizeof(double) : sizeof(float); }

/// Modes of total degree <= 1.
std::int64_t affine_count(const Options& o) { return std::min<std::int64_t>(mode_count(o), 1 + o.dimension); }

bool any_side(const Options& o, Side side) {
  for (int a = 0; a < o.dimension; ++a)
    if (o.boundary[std::size_t(a)][0] == side || o.boundary[std::size_t(a)][1] == side) return true;
  return false;
}

bool is_fluid(const Scene& s) { return !s.options.is_solid(); }
bool is_solid(const Scene& s) { return s.options.is_solid(); }

/// Whether any body of a solid scene is so.
template <class Is>
bool any_solid(const Scene& s, const Is& is) {
  return is_solid(s) && std::any_of(s.bodies.begin(), s.bodies.end(), is);
}

/// Whether a fluid has the scheme, or any body of a solid scene: each may have its own.
template <class Has>
bool any_scheme(const Scene& s, const Has& has) {
  if (is_fluid(s)) return has(s.options);
  return any_solid(s, [&](const Body& b) { return has(with_scheme_of(b, s.options)); });
}

template <Elasticity kind>
bool has_model(const Scene& s) { return any_solid(s, [](const Body& b) { return b.solid.model == kind; }); }
template <Plasticity kind>
bool has_plasticity(const Scene& s) { return any_solid(s, [](const Body& b) { return b.solid.plasticity == kind; }); }
template <Contact kind>
bool has_contact(const Scene& s) {
  if (!is_solid(s)) return false;
  constexpr Side side = kind == Contact::sticky ? Side::sticky : Side::separating;
  return any_side(s.options, side) || std::any_of(s.colliders.begin(), s.colliders.end(), [](const Collider& c) { return c.contact == kind; });
}
template <Carry kind>
bool carries_solids(const Scene& s) { return is_solid(s) && any_scheme(s, [](const Options& o) { return o.carry == kind; }); }

template <Transfer kind>
bool has_transfer(const Scene& s) { return any_scheme(s, [](const Options& o) { return o.transfer == kind; }); }
template <Kernel kind>
bool has_kernel(const Scene& s) { return s.options.kernel == kind; }
template <Carry kind>
bool has_carry(const Scene& s) { return is_fluid(s) && s.options.carry == kind; }
template <Seeding kind>
bool has_seeding(const Scene& s) { return s.options.seeding == kind; }
template <Precision kind>
bool has_precision(const Scene& s) { return s.options.precision == kind; }
template <Splitting kind>
bool has_splitting(const Scene& s) { return is_fluid(s) && s.options.splitting == kind; }
template <Advection kind>
bool has_advection(const Scene& s) { return is_fluid(s) && s.options.advection == kind; }
template <std::int64_t number>
bool has_dimension(const Scene& s) { return s.options.dimension == number; }

/// Where particles were before the motion.
std::vector<Attribute> departures(const Scene& s) { return {{"departures", s.options.dimension * (4 + real_bytes(s)), false}}; }

}  // namespace

std::int64_t mode_count(const Options& o) {
  return std::int64_t(o.dimension == 2 ? mode_set<2>(o.transfer, o.kernel, o.modes).size() : mode_set<3>(o.transfer, o.kernel, o.modes).size());
}

std::int64_t most_modes(const Scene& s) {
  std::int64_t most = 1;
  any_scheme(s, [&](const Options& o) { return most = std::max(most, mode_count(o)), false; });
  return most;
}

std::span<const base::PassRow> pass_rows() {
  static const std::vector<base::PassRow> rows = {
      {"sort", Often::step, {"particles"}, {"particles", "blocks"}},
      {"p2g", Often::step, {"particles", "blocks"}, {"grid velocity"}},
      {"sums", Often::step, {"particles", "grid velocity"}, {}},
      {"forces", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"pressure", Often::step, {"grid velocity", "blocks"}, {"grid velocity"}},
      {"reflect", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"extrapolate", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"volume", Often::step, {"blocks", "particles"}, {"particles"}},
      {"g2p", Often::step, {"grid velocity"}, {"particles"}},
      {"advect", Often::step, {"grid velocity", "particles"}, {"particles"}},
      {"source", Often::step, {"particles"}, {"particles"}},
      {"collide", Often::step, {"particles"}, {"particles"}},
      {"carry", Often::step, {"departures", "particles"}, {"particles"}},
      {"audit", Often::step, {"particles", "grid velocity"}, {}},
      {"watch", Often::frame, {"particles"}, {"state"}},
  };
  return rows;
}

std::span<const base::PassRow> solid_pass_rows() {
  static const std::vector<base::PassRow> rows = {
      {"sort", Often::step, {"particles"}, {"particles", "blocks"}},
      {"p2g", Often::step, {"particles", "blocks"}, {"grid velocity"}},
      {"grid_update", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"forces", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"contact", Often::step, {"grid velocity", "particles"}, {"grid velocity"}},
      {"collide", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"g2p", Often::step, {"grid velocity", "particles"}, {"particles"}},
      {"audit", Often::step, {"particles", "grid velocity"}, {}},
      {"watch", Often::frame, {"particles"}, {"state"}},
  };
  return rows;
}

std::span<const base::EffectRow<Scene>> effect_rows() {
  static const std::vector<base::EffectRow<Scene>> rows = {
      {"liquid",
       {"sim.solver=fluid", "sim.domain", "sim.cell", "sim.particles_per_cell", "sim.cfl", "sim.pressure_tolerance", "shot.fps",
        "body.NAME.material=water", "body.NAME"},
       [](const Scene& s) { return s.options.solver == "fluid"; },
       {"sort", "p2g", "sums", "pressure", "extrapolate", "g2p", "advect", "watch"},
       [](const Scene& s) {
         const std::int64_t d = s.options.dimension, real = real_bytes(s);
         return std::vector<Attribute>{{"cell", 4 * d}, {"offset", real * d}, {"id", 8}, {"coefficients", real * d},
                                       {"order", sort_bytes(d, real, d * mode_count(s.options)), false}};
       }},
      {"solid",
       {"sim.solver=solid", "sim.domain", "sim.cell", "sim.particles_per_cell", "sim.cfl", "sim.sound_cfl", "shot.fps", "body.NAME"},
       is_solid,
       {"sort", "p2g", "grid_update", "g2p", "watch"},
       [](const Scene& s) {
         const std::int64_t d = s.options.dimension, real = real_bytes(s);
         const std::int64_t row = d * most_modes(s), strain = real * (d * d + 1), stress = real * d * (d + 1) / 2;
         return std::vector<Attribute>{{"cell", 4 * d},
                                       {"offset", real * d},
                                       {"id", 8},
                                       {"coefficients", real * row},
                                       {"deformation", strain},
                                       {"stress", stress},
                                       {"order", sort_bytes(d, real, row), false},
                                       {"spare", strain + (has_short_rows(std::size_t(row)) ? stress : 0), false}};
       }},
      {"fixed corotated elasticity", {"body.NAME.material.model=fixed_corotated", "body.NAME.material=snow"}, has_model<Elasticity::fixed_corotated>},
      {"neo-Hookean elasticity",
       {"body.NAME.material.model=neo_hookean", "body.NAME.material=jelly", "body.NAME.material=rubber"},
       has_model<Elasticity::neo_hookean>},
      {"Hencky elasticity", {"body.NAME.material.model=hencky"}, has_model<Elasticity::hencky>},
      {"Tait's liquid", {"body.NAME.material.model=tait", "body.NAME.material=water_mpm"}, has_model<Elasticity::tait>},
      {"no plasticity", {"body.NAME.material.plasticity=none"}, has_plasticity<Plasticity::none>},
      {"von Mises plasticity",
       {"body.NAME.material.plasticity=von_mises", "body.NAME.material=steel", "body.NAME.material=clay"},
       has_plasticity<Plasticity::von_mises>},
      {"Drucker-Prager plasticity",
       {"body.NAME.material.plasticity=drucker_prager", "body.NAME.material=dry_sand", "body.NAME.material=wet_sand"},
       has_plasticity<Plasticity::drucker_prager>},
      {"snow plasticity", {"body.NAME.material.plasticity=snow"}, has_plasticity<Plasticity::snow>},
      {"volume averaging",
       {"body.NAME.material.volume_averaging"},
       [](const Scene& s) { return any_solid(s, [](const Body& b) { return b.solid.volume_averaging; }); }},
      {"three dimensions", {"sim.dimension"}, has_dimension<3>},
      {"two dimensions", {"sim.dimension"}, has_dimension<2>},
      {"linear kernel", {"sim.kernel=linear"}, has_kernel<Kernel::linear>},
      {"quadratic kernel", {"sim.kernel=quadratic"}, has_kernel<Kernel::quadratic>},
      {"pic", {"sim.transfer=pic", "body.NAME.transfer=pic"}, has_transfer<Transfer::pic>},
      {"flip", {"sim.transfer=flip", "sim.flip_time", "body.NAME.transfer=flip"}, has_transfer<Transfer::flip>},
      {"apic",
       {"sim.transfer=apic", "body.NAME.transfer=apic"},
       has_transfer<Transfer::apic>,
       {},
       [](const Scene& s) {
         return is_solid(s) ? std::vector<Attribute>{}
                            : std::vector<Attribute>{{"coefficients", real_bytes(s) * s.options.dimension * (affine_count(s.options) - 1)}};
       }},
      {"polypic",
       {"sim.transfer=polypic", "sim.modes=multilinear", "sim.modes=quadratic", "sim.modes=full", "body.NAME.transfer=polypic",
        "body.NAME.modes=multilinear", "body.NAME.modes=quadratic", "body.NAME.modes=full"},
       has_transfer<Transfer::polypic>,
       {},
       [](const Scene& s) {
         return is_solid(s) ? std::vector<Attribute>{}
                            : std::vector<Attribute>{{"coefficients", real_bytes(s) * s.options.dimension * (mode_count(s.options) - 1)}};
       }},
      {"limited carry", {"sim.carry=limited"}, has_carry<Carry::limited>, {"carry"}, departures},
      {"hybrid carry", {"sim.carry=hybrid"}, has_carry<Carry::hybrid>, {"carry"}, departures},
      {"fixed carry", {"sim.carry=fixed"}, has_carry<Carry::fixed>},
      {"limited carry of solids", {"body.NAME.carry=limited", "sim.carry=limited"}, carries_solids<Carry::limited>},
      {"hybrid carry of solids", {"body.NAME.carry=hybrid", "sim.carry=hybrid"}, carries_solids<Carry::hybrid>},
      {"fixed carry of solids", {"body.NAME.carry=fixed", "sim.carry=fixed"}, carries_solids<Carry::fixed>},
      {"lie splitting", {"sim.splitting=lie"}, has_splitting<Splitting::lie>},
      {"reflection", {"sim.splitting=reflection"}, has_splitting<Splitting::reflection>, {"reflect"}},
      {"midpoint advection", {"sim.advection=rk2"}, has_advection<Advection::rk2>},
      {"third-order advection", {"sim.advection=rk3"}, has_advection<Advection::rk3>},
      {"volume correction", {"sim.volume_correction"}, [](const Scene& s) { return is_fluid(s) && s.options.volume_correction > 0; }, {"volume"}},
      {"single precision", {"sim.precision=single"}, has_precision<Precision::single_precision>},
      {"double precision", {"sim.precision=double"}, has_precision<Precision::double_precision>},
      {"jittered seeding", {"sim.seeding=jitter", "sim.seed"}, has_seeding<Seeding::jitter>},
      {"regular seeding", {"sim.seeding=regular"}, has_seeding<Seeding::regular>},
      {"pressure on particles",
       {"sim.write.pressure"},
       [](const Scene& s) { return s.options.write.pressure; },
       {},
       [](const Scene& s) {
         return is_fluid(s) ? std::vector<Attribute>{{"pressure", 4}} : std::vector<Attribute>{};
       }},
      {"strain on particles", {"sim.write.strain"}, [](const Scene& s) { return is_solid(s) && s.options.write.strain; }},
      {"mode energy on particles", {"sim.write.mode_energy"}, [](const Scene& s) { return s.options.write.mode_energy; }},
      {"gravity", {"effect.N.acceleration", "effect.N.kind=gravity"}, [](const Scene& s) { return !gravity(s).isZero(0); }, {"forces"}},
      {"walls", {"sim.boundary=slip"}, [](const Scene& s) { return any_side(s.options, Side::slip); }, {"collide"}},
      {"sticky contact", {"sim.boundary=sticky", "collider.NAME.contact=sticky"}, has_contact<Contact::sticky>, {"collide"}},
      {"separating contact",
       {"sim.boundary=separating", "sim.boundary.friction", "collider.NAME.contact=separating", "collider.NAME.friction"},
       has_contact<Contact::separating>,
       {"collide"}},
      {"bodies that stick",
       {"body.NAME.contact=sticky"},
       [](const Scene& s) { return is_solid(s) && std::count_if(s.bodies.begin(), s.bodies.end(), [](const Body& b) { return b.contact == Contact::sticky; }) > 1; }},
      {"contact of bodies",
       {"body.NAME.contact=separating", "body.NAME.contact=slip", "body.NAME.friction"},
       [](const Scene& s) { return s.bodies.size() > 1 && any_solid(s, [](const Body& b) { return b.contact != Contact::sticky; }); },
       {"contact"}},
      {"open sides", {"sim.boundary=open"}, [](const Scene& s) { return any_side(s.options, Side::open); }, {"collide"}},
      {"energy audit", {"sim.audit"}, [](const Scene& s) { return s.options.audit; }, {"audit"}},
      {"periodic sides", {"sim.boundary=periodic"}, [](const Scene& s) { return any_side(s.options, Side::periodic); }},
      {"sources",
       {"source.NAME", "source.NAME.velocity", "source.NAME.density", "source.NAME.start", "source.NAME.end"},
       [](const Scene& s) { return !s.sources.empty(); },
       {"source"}},
      {"colliders",
       {"collider.NAME", "collider.NAME.contact=slip"},
       [](const Scene& s) { return !s.colliders.empty(); },
       {"collide", "collide<solids", "pressure<solids"}},
      {"distances of meshes",
       {"collider.NAME.shape.mesh"},
       [](const Scene& s) { return std::any_of(s.colliders.begin(), s.colliders.end(), [](const Collider& c) { return c.shape.mesh.has_value(); }); },
       {"collide<solids"}},
      {"moving colliders",
       {"collider.NAME.velocity", "collider.NAME.spin", "collider.NAME.pivot", "collider.NAME.start", "collider.NAME.end"},
       [](const Scene& s) { return std::any_of(s.colliders.begin(), s.colliders.end(), [](const Collider& c) { return c.moves(); }); },
       {"collide"}},
  };
  return rows;
}

base::Plan plan_of(const Scene& scene) {
  return base::make_plan("simulate", effect_rows(), is_solid(scene) ? solid_pass_rows() : pass_rows(), scene);
}

}  // namespace sim
