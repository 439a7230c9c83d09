#include "sim/verify/cases.h"

namespace sim {

bool passes(const VerifyCase& c, const CaseOutcome& found) { return found.value <= c.tolerance && found.broken.empty(); }

std::vector<VerifyCase> verify_cases() {
  std::vector<VerifyCase> all;
  verify::add_transfer_cases(all);
  verify::add_law_cases(all);
  verify::add_spin_cases(all);
  verify::add_solid_cases(all);
  verify::add_contact_cases(all);
  verify::add_liquid_cases(all);
  verify::add_pouring_cases(all);
  verify::add_long_cases(all);
  return all;
}

std::vector<CaseNotBuilt> cases_not_built() {
  return {{"newton_indefinite", "an implicit integrator", "case 13"},
          {"implicit_force_is_the_energys_derivative", "an implicit integrator", "case 14"},
          {"density_ratio_1000", "two liquids of different density", "case 18"},
          {"viscosity_ratio_1e5", "viscosity", "case 18"},
          {"not_finite_level_set", "level sets as input", "case 7"}};
}

}  // namespace sim
