#include "sim/plan.h"

#include "sim/effects/gravity.h"
#include "sim/transfer/modes.h"

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

template <Transfer kind>
bool has_transfer(const Scene& s) { return s.options.transfer == kind; }
template <Kernel kind>
bool has_kernel(const Scene& s) { return s.options.kernel == kind; }
template <Carry kind>
bool has_carry(const Scene& s) { return s.options.carry == kind; }
template <Seeding kind>
bool has_seeding(const Scene& s) { return s.options.seeding == kind; }
template <Precision kind>
bool has_precision(const Scene& s) { return s.options.precision == kind; }
template <Splitting kind>
bool has_splitting(const Scene& s) { return s.options.splitting == kind; }
template <Advection kind>
bool has_advection(const Scene& s) { return s.options.advection == kind; }
template <std::int64_t number>
bool has_dimension(const Scene& s) { return s.options.dimension == number; }

}  // namespace

std::int64_t mode_count(const Options& o) {
  return std::int64_t(o.dimension == 2 ? mode_set<2>(o.transfer, o.kernel, o.modes).size() : mode_set<3>(o.transfer, o.kernel, o.modes).size());
}

std::span<const base::PassRow> pass_rows() {
  static const std::vector<base::PassRow> rows = {
      {"sort", Often::step, {"particles"}, {"particles", "blocks"}},
      {"p2g", Often::step, {"particles", "blocks"}, {"grid velocity"}},
      {"forces", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"pressure", Often::step, {"grid velocity", "blocks", "solids"}, {"grid velocity"}},
      {"reflect", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"extrapolate", Often::step, {"grid velocity"}, {"grid velocity"}},
      {"volume", Often::step, {"blocks", "particles"}, {"particles"}},
      {"g2p", Often::step, {"grid velocity"}, {"particles"}},
      {"advect", Often::step, {"grid velocity", "particles"}, {"particles"}},
      {"collide", Often::step, {"solids", "particles"}, {"particles"}},
      {"carry", Often::step, {"departures", "particles"}, {"particles"}},
  };
  return rows;
}

std::span<const base::EffectRow<Scene>> effect_rows() {
  static const std::vector<base::EffectRow<Scene>> rows = {
      {"liquid", {"sim.solver=fluid", "sim.domain", "sim.cell", "sim.particles_per_cell", "sim.cfl", "sim.pressure_tolerance", "shot.fps", "body.NAME.material=water", "body.NAME"},
       [](const Scene& s) { return s.options.solver == "fluid"; }, {"sort", "p2g", "pressure", "extrapolate", "g2p", "advect"},
       [](const Scene& s) {
         const std::int64_t d = s.options.dimension, real = real_bytes(s);
         return std::vector<Attribute>{{"cell", 4 * d}, {"offset", real * d}, {"id", 8}, {"coefficients", real * d}};
       }},
      {"three dimensions", {"sim.dimension"}, has_dimension<3>},
      {"two dimensions", {"sim.dimension"}, has_dimension<2>},
      {"linear kernel", {"sim.kernel=linear"}, has_kernel<Kernel::linear>},
      {"quadratic kernel", {"sim.kernel=quadratic"}, has_kernel<Kernel::quadratic>},
      {"pic", {"sim.transfer=pic"}, has_transfer<Transfer::pic>},
      {"flip", {"sim.transfer=flip", "sim.flip_time"}, has_transfer<Transfer::flip>},
      {"apic", {"sim.transfer=apic"}, has_transfer<Transfer::apic>, {},
       [](const Scene& s) { return std::vector<Attribute>{{"coefficients", real_bytes(s) * s.options.dimension * (affine_count(s.options) - 1)}}; }},
      {"polypic", {"sim.transfer=polypic", "sim.modes=multilinear", "sim.modes=quadratic", "sim.modes=full"}, has_transfer<Transfer::polypic>, {},
       [](const Scene& s) { return std::vector<Attribute>{{"coefficients", real_bytes(s) * s.options.dimension * (mode_count(s.options) - 1)}}; }},
      {"limited carry", {"sim.carry=limited"}, has_carry<Carry::limited>, {"carry"}},
      {"hybrid carry", {"sim.carry=hybrid"}, has_carry<Carry::hybrid>, {"carry"}},
      {"fixed carry", {"sim.carry=fixed"}, has_carry<Carry::fixed>},
      {"lie splitting", {"sim.splitting=lie"}, has_splitting<Splitting::lie>},
      {"reflection", {"sim.splitting=reflection"}, has_splitting<Splitting::reflection>, {"reflect"}},
      {"midpoint advection", {"sim.advection=rk2"}, has_advection<Advection::rk2>},
      {"third-order advection", {"sim.advection=rk3"}, has_advection<Advection::rk3>},
      {"volume correction", {"sim.volume_correction"}, [](const Scene& s) { return s.options.volume_correction > 0; }, {"volume"}},
      {"single precision", {"sim.precision=single"}, has_precision<Precision::single_precision>},
      {"double precision", {"sim.precision=double"}, has_precision<Precision::double_precision>},
      {"jittered seeding", {"sim.seeding=jitter", "sim.seed"}, has_seeding<Seeding::jitter>},
      {"regular seeding", {"sim.seeding=regular"}, has_seeding<Seeding::regular>},
      {"gravity", {"effect.N.kind=gravity", "effect.N.acceleration"}, [](const Scene& s) { return !gravity(s).isZero(0); }, {"forces"}},
      {"walls", {"sim.boundary=slip"}, [](const Scene& s) { return any_side(s.options, Side::slip); }, {"collide"}},
      {"periodic sides", {"sim.boundary=periodic"}, [](const Scene& s) { return any_side(s.options, Side::periodic); }},
      {"colliders", {"collider.NAME"}, [](const Scene& s) { return !s.colliders.empty(); }, {"collide"}},
  };
  return rows;
}

base::Plan plan_of(const Scene& scene) { return base::make_plan("simulate", effect_rows(), pass_rows(), scene); }

}  // namespace sim
