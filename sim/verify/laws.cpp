// Materials by themselves: returns to the yield surface, volume that sand gains and gives back.
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "sim/solid/drucker_prager.h"
#include "sim/solid/snow.h"
#include "sim/solid/von_mises.h"
#include "sim/verify/cases.h"
#include "sim/verify/follow.h"
#include "sim/verify/scenes.h"

namespace sim::verify {
namespace {

const Lame kLame = Lame::of(1e5, 0.3);

/// Random stretches, returned twice: the second time nothing moves, and the first leaves none outside. And none stores more energy than it had, snow's
/// published box apart.
template <int D, class Yield>
VerifyCase returns(const std::string& law, const Yield& yield, bool dissipates) {
  VerifyCase c = law_case("return_mapping/" + law, D, "case 12");
  c.expect = "a second return changes no stretch by more than the tolerance; none ends outside the yield surface" + std::string(dissipates ? ", none stores energy" : "");
  c.tolerance = 1e-12;
  c.run = [=] {
    std::mt19937 rng(D);
    std::uniform_real_distribution<double> u(-0.6, 0.6);
    double most = 0, gained = 0, outside = 0;
    int flowed = 0;
    for (int n = 0; n < 100000; ++n) {
      Principal<double, D> s;
      for (double& x : s) x = std::exp(u(rng)) - 1;
      std::sort(s.begin(), s.end(), std::greater<>());   // as a decomposition gives them
      const typename Yield::Elasticity elastic{kLame};
      const double was = elastic.template energy<double, D>(s);
      double state = 0;
      flowed += bool(yield.template project<double, D>(kLame, s, state));
      const double is = elastic.template energy<double, D>(s);
      if (dissipates) gained = worse(gained, (is - was) / (was + 1e-9));
      outside = worse(outside, yield.template excess<double, D>(kLame, s, state));
      Principal<double, D> again = s;
      double state_again = state;
      yield.template project<double, D>(kLame, again, state_again);
      for (std::size_t i = 0; i < D; ++i) most = worse(most, std::abs(again[i] - s[i]));
    }
    CaseOutcome found;
    found.value = most;
    found.outcome = say("%d of 1e5 random stretches flow; a second return moves them by %.1e", flowed, most);
    if (!(outside <= 1e-12)) found.broken.push_back(say("a return ended %.1e outside the yield surface", outside));
    if (!(gained <= 1e-12)) found.broken.push_back(say("a return stored %.1e of the energy", gained));
    if (flowed < 1000) found.broken.push_back("hardly any flowed");
    return found;
  };
  return c;
}

/// Pulled apart by a tenth an axis and pushed back until grains bear again: the volume at which they do.
template <int D>
VerifyCase sand_volume() {
  VerifyCase c = law_case("sand_at_the_tip", D, "case 12; Tampubolon17: 1.004 with the volume correction, 1.108 without");
  c.expect = "volume at which sand that was pulled apart bears again, over that at the start";
  c.tolerance = 1.03;
  c.run = [=] {
    const DruckerPrager sand{.friction_angle = 0.6, .cohesion = 0};
    Principal<double, D> s{};
    double state = 0, volume = 1;
    const auto strain = [&](double by) {
      for (double& x : s) x = std::exp(std::log1p(x) + by) - 1;
      volume *= std::exp(D * by);
      sand.template project<double, D>(kLame, s, state);
    };
    for (int n = 0; n < 100; ++n) strain(0.001);
    double pressed = 0;
    for (int n = 0; n < 200 && !(pressed < -1e-6); ++n) {
      strain(-0.001);
      pressed = (Hencky{kLame}.template kirchhoff<double, D>(s))[0];
    }
    CaseOutcome found;
    found.value = volume;
    found.outcome = say("bears again at %.4f of its volume", volume);
    if (volume < 0.98) found.broken.push_back("it lost volume");
    return found;
  };
  return c;
}

}  // namespace

void add_law_cases(std::vector<VerifyCase>& all) {
  const VonMises metal{.yield = 2e3, .hardening = 1e3};
  const DruckerPrager sand{.friction_angle = 0.6, .cohesion = 0}, damp{.friction_angle = 0.6, .cohesion = 500};
  const Snow snow{};
  all.push_back(returns<2>("von_mises", metal, true));
  all.push_back(returns<3>("von_mises", metal, true));
  all.push_back(returns<2>("drucker_prager", sand, true));
  all.push_back(returns<3>("drucker_prager", damp, true));
  all.push_back(returns<3>("snow", snow, false));
  all.push_back(sand_volume<2>());
  all.push_back(sand_volume<3>());
}

}  // namespace sim::verify
